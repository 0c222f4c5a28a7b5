// Depth of another size than its picture. A scene of planes under a pinhole is known at every size: 1/z is affine in the pixel on
// each plane, and the picture shows exactly where one plane ends.
#include "program.hpp"

#include <fathom/opencv.hpp>

#include <fmt/format.h>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

constexpr int across = 64, down = 48, factor = 4; // of the depth, and how much larger the picture is
constexpr double edge = 31.4, sky = 50.3; // pixels of the depth: before it a near slope, then a wall, then the sky

struct Seen {
    double z;
    cv::Vec3b color;
};

/// At a place in pixels of the depth.
Seen at(double x, double y) {
    if (x > sky)
        return {HUGE_VAL, {220, 120, 20}};
    if (x > edge)
        return {1 / (0.1 + 2e-4 * y), {30, 60, 30}};
    return {1 / (0.4 + 1e-3 * x - 5e-4 * y), {40, 200, 230}};
}

cv::Mat depth_of(int scale = 1) {
    return filled(across * scale, down * scale,
                  [&](int x, int y) { return at((x + 0.5) / scale, (y + 0.5) / scale).z; });
}

cv::Mat picture_of(int scale = factor) {
    return filled<cv::Vec3b>(across * scale, down * scale,
                             [&](int x, int y) { return at((x + 0.5) / scale, (y + 0.5) / scale).color; });
}

struct Scene {
    Folder folder;
    std::string depth = folder / "depth.exr", picture = folder / "photo.png", camera = folder / "camera.json",
                out = folder / "out/o.exr";

    Scene() {
        write_image(depth, depth_of());
        REQUIRE(cv::imwrite(picture, picture_of()));
        write(camera, R"({"encoding": "view-z", "intrinsics": {"fx": 60, "fy": 60, "cx": 32, "cy": 24}})");
    }

    cv::Mat made(const Arguments& arguments, const std::string& name = {}) const {
        check_done(joined(arguments, {"--camera", camera, "-o", out}));
        return name.empty() ? read_color(out) : channel(out, name);
    }
};

/// Pixels that lie so far from the border that planes are exact there.
bool is_inside(int x, int y) {
    return x >= 2 * factor && y >= 2 * factor && x < (across - 2) * factor && y < (down - 2) * factor;
}

} // namespace

TEST_CASE("sizes program: masks have the picture's size, and each pixel has the depth of its own surface") {
    const Scene scene;
    const cv::Mat coc = scene.made({"dof-masks", scene.depth, "--color", scene.picture, "--circle", "40,300"}, "coc");
    REQUIRE(coc.size() == cv::Size(across * factor, down * factor));
    double worst = 0;
    for (int y = 0; y < coc.rows; ++y)
        for (int x = 0; x < coc.cols; ++x)
            if (is_inside(x, y)) {
                const double z = at((x + 0.5) / factor, (y + 0.5) / factor).z;
                // The circle's own k and g are those of the depth's pixels or of the picture's: of the picture's.
                worst = std::max(worst, std::abs(static_cast<double>(coc.at<float>(y, x)) - (40 - 300 / z)));
            }
    std::printf("depth brought up 4 times: circles off by at most %.4f px of up to 120\n", worst);
    // Colours of other surfaces count 10^-4, over 0.3 of inverse depth; the planes' own slopes bend where an edge cuts the tent.
    CHECK(worst < 300 * 2e-3);
}

TEST_CASE("sizes program: fog lies on the picture's own pixels, and the background stays the background") {
    const Scene scene;
    const cv::Mat fog = scene.made({"fog", scene.depth, "--color", scene.picture, "--density", "0.2", "--fog-color",
                                    "1,1,1", "--max-opacity", "0.9"});
    const cv::Mat light = read_picture(scene.picture).color;
    REQUIRE(fog.size() == light.size());
    for (int y = 0; y < fog.rows; ++y)
        for (int x = 0; x < fog.cols; ++x) {
            if (!is_inside(x, y))
                continue;
            const double px = (x + 0.5) / factor, py = (y + 0.5) / factor, z = at(px, py).z;
            const double distance = z * std::hypot((px - 32) / 60, (py - 24) / 60, 1.0); // fx of the depth's pixels
            const double opacity = std::min(0.9, 1 - std::exp(-0.2 * distance));
            const auto got = fog.at<cv::Vec3f>(y, x), was = light.at<cv::Vec3f>(y, x);
            for (int c = 0; c < 3; ++c)
                if (const double expected = static_cast<double>(was[c]) * (1 - opacity) + opacity;
                    std::abs(static_cast<double>(got[c]) - expected) > 3e-3)
                    FAIL("pixel " << x << ", " << y << ": " << got[c] << ", not " << expected);
        }
}

TEST_CASE("sizes library: images and matrices give what the program does") {
    const Scene scene;
    const cv::Mat depth = depth_of(), light = read_picture(scene.picture).color;
    const Camera camera = camera_for(read_camera(scene.camera), across, down);
    const Device device = Device::open();
    const StoredDepth stored{to_device(device, depth), camera};
    const Image color = to_device(device, light);
    const StoredDepth fine = upsample_along_edges(stored, color);
    const CircleOfConfusion circle{40, 300};
    const FogOptions fog_options{.density = 0.2, .fog_color = {0.7, 0.6, 0.5}}; // B, G, R

    const cv::Mat fog_of_program = scene.made({"fog", scene.depth, "--color", scene.picture, "--density", "0.2"});
    CHECK(same(to_mat(fog(fine, color, fog_options)), fog_of_program));
    cv::Mat fog_of_matrices, dof_of_matrices;
    fog(device, depth, camera, light, fog_of_matrices, fog_options);
    CHECK(same(fog_of_matrices, fog_of_program));
    const cv::Mat dof_of_program =
        scene.made({"dof", scene.depth, "--color", scene.picture, "--circle", "4,30", "--quality", "fast"});
    dof(device, depth, camera, light, {4, 30}, dof_of_matrices, {.quality = Quality::fast});
    CHECK(same(dof_of_matrices, dof_of_program));
    DofMasks masks;
    masks.coc = Image(device, Element::f32, {light.cols, light.rows});
    dof_masks(fine, masks, circle);
    CHECK(same(to_mat(masks.coc),
               scene.made({"dof-masks", scene.depth, "--color", scene.picture, "--circle", "40,300"}, "coc")));

    // Codes count as what they stand for.
    const cv::Mat z = to_mat(fine.image);
    for (const cv::Mat& picture :
         {converted(light, CV_8U, 255), converted(light, CV_16F), converted(light, CV_16U, 65535)}) {
        const cv::Mat other = to_mat(upsample_along_edges(stored, to_device(device, picture)).image);
        for (int y = 0; y < z.rows; ++y)
            for (int x = 0; x < z.cols; ++x)
                if (std::isfinite(z.at<float>(y, x)) && is_inside(x, y) &&
                    !(std::abs(other.at<float>(y, x) / z.at<float>(y, x) - 1) < 0.01f))
                    FAIL(x << ", " << y << ": " << other.at<float>(y, x) << ", not " << z.at<float>(y, x));
    }

    const auto refused = [&](const StoredDepth& of, const Image& picture, const char* reason) {
        CHECK_THROWS_WITH(upsample_along_edges(of, picture), ContainsSubstring(reason));
    };
    refused(stored, Image(device, Element::f32, {256, 186, 3}), "same ratio of width to height");
    refused(stored, Image(device, Element::f32, {256, 192, 1}), "color has 1 channels");
    refused(stored, {}, "color has no image");
    refused(stored.region(0, 0, 32, 24), color, "a part of an image");
    CHECK_THROWS_WITH(fog(stored, color, {.density = 0.2}), ContainsSubstring("upsample_along_edges"));
}

TEST_CASE("sizes program: points have the mean colour of their part of a larger picture") {
    const Scene scene;
    cv::Mat noise(down * factor, across * factor, CV_8UC3);
    cv::randu(noise, 0, 256);
    REQUIRE(cv::imwrite(scene.picture, noise));
    const std::string ply = scene.folder / "out/points.ply";
    check_done({"unproject", scene.depth, "--camera", scene.camera, "--color", scene.picture, "-o", ply});
    const std::string bytes = content(ply), end = "end_header\n";
    const std::size_t begin = bytes.find(end) + end.size();
    const cv::Mat light = read_picture(scene.picture).color;
    std::size_t point = 0;
    int worst = 0;
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            if (std::isinf(at(x + 0.5, y + 0.5).z))
                continue;
            const auto* rgb = reinterpret_cast<const unsigned char*>(bytes.data() + begin + 15 * point++ + 12);
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (int j = 0; j < factor; ++j)
                    for (int i = 0; i < factor; ++i)
                        sum += static_cast<double>(light.at<cv::Vec3f>(y * factor + j, x * factor + i)[2 - c]);
                const double mean = sum / (factor * factor);
                const double code = 255 * (mean <= 0.0031308 ? 12.92 * mean : 1.055 * std::pow(mean, 1 / 2.4) - 0.055);
                worst = std::max(worst, std::abs(static_cast<int>(rgb[c]) - static_cast<int>(std::lround(code))));
            }
        }
    CHECK(bytes.size() == begin + 15 * point);
    CHECK(worst <= 1);
}

TEST_CASE("sizes program: other ratios of width to height are refused, a pixel's rounding is not") {
    const Scene scene;
    const auto with = [&](int columns, int rows) {
        const std::string other = scene.folder / "other.png";
        REQUIRE(cv::imwrite(other, cv::Mat(rows, columns, CV_8UC3, cv::Scalar(9, 90, 200))));
        return run({"fog", scene.depth, "--color", other, "--density", "0.1", "--camera", scene.camera, "-o",
                    scene.folder / "out/other.exr"});
    };
    check_done(with(256, 190)); // of 64 × 47.5 pixels
    check_done(with(32, 24));
    check_refused(with(256, 186), 1, "same ratio of width to height"); // 46.5
    check_refused(with(48, 64), 1, "other.png: is 48 × 64");
    const auto masks_with = [&](const std::string& color) {
        return run({"dof-masks", scene.depth, "--color", color, "--circle", "40,300", "--camera", scene.camera, "-o",
                    scene.folder / "out/masks.exr"});
    };
    check_refused(masks_with(scene.folder / "other.png"), 1, "other.png: is 48 × 64");
    check_refused(masks_with(scene.folder / "none.png"), 1, "none.png");
    REQUIRE(cv::imwrite(scene.folder / "plate.png", picture_of()));
    check_refused(
        run({"dof", scene.depth, "--color", scene.picture, "--clean-plate", scene.folder / "plate.png",
             "--clean-plate-depth", scene.depth, "--circle", "20,100", "--camera", scene.camera, "-o", scene.out}),
        1, "a clean plate is given");
}
