// fathom dof: pictures and repaired depth reach the library, and what is wrong is told in one line. Its options are those of
// test_cli_options.cpp.
#include "program.hpp"

#include <fathom/dof.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

cv::Mat picture(int channels) {
    cv::Mat color(height, width, CV_32FC(channels));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width * channels; ++x)
            color.at<float>(y, x) = static_cast<float>((x * 7 + y * 13) % 32) / 31.0f; // codes of 16 bits hold it
    return color;
}

// A ramp of depths and a picture as the program and as the library sees them.
struct Scene {
    Folder folder;
    std::string camera, input, picture_file;
    cv::Mat depth = ramp(), color;
    StoredDepth stored;
    Lens lens{.f_stop = 0.2, .focus = 3, .focal_length_mm = 50, .sensor_mm = 36};

    explicit Scene(int channels = 3)
        : camera(camera_file(folder)), picture_file(folder / "colour.exr"), color(picture(channels)) {
        input = depth_file(folder, "frame.exr", depth);
        std::vector<std::string> names{"R", "G", "B", "A"};
        names.resize(static_cast<std::size_t>(channels));
        write_color(picture_file, color, {.channels = names});
        stored = {to_device(Device::open(), depth), camera_for(read_camera(camera), width, height)};
    }

    Arguments arguments(const std::string& output, const Arguments& more = {}) const {
        return joined({"dof", input, "--color", picture_file, "--camera", camera, "-o", output, "--focus", "3",
                       "--f-stop", "0.2", "--focal-length-mm", "50", "--sensor-mm", "36"},
                      more);
    }

    cv::Mat expected(const std::function<void(DofOptions&)>& change = {}) const {
        DofOptions options;
        if (change)
            change(options);
        return to_mat(dof(stored, to_device(stored.image.device(), color), circle_of_confusion(lens, stored.camera),
                          options))
            .clone();
    }
};

} // namespace

TEST_CASE("dof program: a grown foreground reaches the library, and the words of the defaults change nothing") {
    const Scene scene(4); // with an alpha
    const cv::Mat plain = scene.expected();
    const std::string grown = scene.folder / "out/grown.exr", out = scene.folder / "out/circle.exr";
    check_done(scene.arguments(grown, {"--grow-foreground", "2"}));
    Scene larger(4);
    larger.stored = grow_foreground(scene.stored, 2);
    CHECK(same(read_color(grown), larger.expected()));
    CHECK(!same(larger.expected(), plain));
    check_done(scene.arguments(out, {"--aperture", "circle", "--quality", "balanced", "--sky", "blur"}));
    CHECK(same(read_color(out), plain));
}

TEST_CASE("dof program: a photograph is blurred as light, and stays what it was") {
    const Scene scene;
    const std::string png = scene.folder / "photo.png", out = scene.folder / "out/photo.png";
    cv::imwrite(png, converted(scene.color, CV_8U, 255));
    const auto blurred = [&](const std::string& picture, const std::string& result, const Arguments& more = {}) {
        return check_done(joined({"dof", scene.input, "--color", picture, "--camera", scene.camera, "-o", result,
                                  "--f-stop", "0.2", "--focus", "2", "--focal-length-mm", "50", "--sensor-mm", "36"},
                                 more));
    };
    const Outcome outcome = blurred(png, out);
    CHECK(outcome.out.find("sRGB, 8 bits") != std::string::npos);
    CHECK(cv::imread(out, cv::IMREAD_UNCHANGED).type() == CV_8UC3);

    const Picture light = read_picture(png); // the same as light, in floats
    const std::string exr = scene.folder / "light.exr", exr_out = scene.folder / "out/light.exr";
    write_color(exr, light.color);
    CHECK(blurred(exr, exr_out).out.find("linear floats") != std::string::npos);
    write_picture(scene.folder / "out/expected.png", {read_color(exr_out), light.format});
    CHECK(same(cv::imread(out, cv::IMREAD_UNCHANGED),
               cv::imread(scene.folder / "out/expected.png", cv::IMREAD_UNCHANGED)));

    cv::imwrite(scene.folder / "16.png", converted(scene.color, CV_16U, 65535)); // those of 8 bits bring a warning
    blurred(scene.folder / "16.png", scene.folder / "out/linear.png", {"--color-space", "linear"});
    CHECK(!same(cv::imread(out), cv::imread(scene.folder / "out/linear.png")));
    blurred(png, scene.folder / "out/photo.jpg");
    blurred(scene.folder / "out/photo.jpg", scene.folder / "out/again.jpeg");
    check_done({"dof", scene.input, "--color", png, "--camera", scene.camera, "-o", out, "--circle", "0,0"});
    CHECK(same(cv::imread(out, cv::IMREAD_UNCHANGED),
               cv::imread(png, cv::IMREAD_UNCHANGED))); // all in focus: no code changes
}

TEST_CASE("dof program: a renderer's layer is found, or named") {
    const Scene scene;
    const std::string layered = scene.folder / "layered.exr";
    write_color(layered, scene.color, {.channels = {"View.Combined.R", "View.Combined.G", "View.Combined.B"}});
    CHECK(same(read_color(layered), scene.color));
    CHECK(same(read_color(layered, "View.Combined"), scene.color));
    CHECK_THROWS_WITH(read_color(layered, "Diffuse"), ContainsSubstring("R, G and B; it has View.Combined"));
    CHECK_THROWS_WITH(read_color(layered, "Combined"), ContainsSubstring("it has View.Combined"));
    CHECK_THROWS_WITH(read_color(scene.input),
                      ContainsSubstring("has no channels R, G and B, so no picture; it has Z"));
    const std::string two = scene.folder / "two.exr";
    write_image(two, merged({scene.color, scene.color}), {.channels = {"a.B", "a.G", "a.R", "b.B", "b.G", "b.R"}});
    CHECK_THROWS_WITH(read_color(two), ContainsSubstring("say which it is (--color-layer): a, b"));
    CHECK(same(read_color(two, "b"), scene.color));
}

TEST_CASE("dof program: refuses in one line what cannot be") {
    const Scene scene;
    const std::string out = scene.folder / "out/blurred.exr";
    const auto refused = [&](const Arguments& more, int code, const std::string& named) {
        check_refused(scene.arguments(out, more), code, named);
        CHECK(scene.folder.results().empty());
    };
    refused({"--aperture", "oval"}, 2, "--aperture");
    refused({"--aperture", "ellipse:two"}, 2, "--aperture: 'ellipse:two'");
    check_refused({"dof", scene.input, "--camera", scene.camera, "-o", out}, 2, "--color");
    check_refused({"dof", scene.input, "--color", scene.folder / "missing.exr", "--camera", scene.camera, "-o", out,
                   "--circle", "9,30"},
                  1, "missing.exr");
    CHECK(scene.folder.results().empty());
}

TEST_CASE("dof program: holes in the depth are filled as the library fills them") {
    Scene scene;
    scene.depth(cv::Rect(10, 5, 9, 20)).setTo(std::numeric_limits<float>::quiet_NaN());
    scene.input = depth_file(scene.folder, "frame.exr", scene.depth);
    const Device device = scene.stored.image.device();
    scene.stored.image = to_device(device, scene.depth);
    const cv::Mat kept = scene.expected();
    const std::string out = scene.folder / "out/blurred.exr";
    check_done(scene.arguments(out, {"--invalid", "keep"}));
    CHECK(same(read_color(out), kept));
    scene.stored = fill_invalid(scene.stored);
    CHECK(!same(scene.expected(), kept));
    check_done(scene.arguments(out, {"--invalid", "fill"}));
    CHECK(same(read_color(out), scene.expected()));
}

TEST_CASE("dof program: a clean plate shows what the foreground hides") {
    Scene scene;
    for (int y = 8; y < 24; ++y)
        for (int x = 10; x < 30; ++x)
            scene.depth.at<float>(y, x) = 0.55f; // before the focus
    scene.input = depth_file(scene.folder, "frame.exr", scene.depth);
    const cv::Mat behind = ramp(), other = 1 - scene.color;
    const std::string clean_plate = scene.folder / "plate.exr", color = scene.folder / "plate-colour.exr";
    write_image(clean_plate, merged({other, behind}), {.channels = {"B", "G", "R", "Z"}});
    write_color(color, other);
    const std::string depth = depth_file(scene.folder, "behind.exr", behind);
    const Device device = scene.stored.image.device();
    scene.stored.image = to_device(device, scene.depth);
    const cv::Mat truth = scene.expected([&](DofOptions& o) {
        o.clean_plate = {to_device(device, other), {to_device(device, behind), scene.stored.camera}};
    });
    CHECK(!same(truth, scene.expected()));
    const std::string out = scene.folder / "out/blurred.exr";
    check_done(scene.arguments(out, {"--clean-plate", clean_plate}));
    CHECK(same(read_color(out), truth));
    check_done(scene.arguments(out, {"--clean-plate", color, "--clean-plate-depth", depth}));
    CHECK(same(read_color(out), truth));
    fs::remove(out);
    check_refused(scene.arguments(out, {"--clean-plate-depth", depth}), 2,
                  "--clean-plate-depth: is of no use without --clean-plate");
    check_refused(scene.arguments(out, {"--clean-plate", color}), 1, "needs --clean-plate-depth");
    const std::string grey = scene.folder / "plate-grey.pfm"; // whose three equal channels could be depth, too
    cv::imwrite(grey, merged({behind, behind, behind}));
    check_refused(scene.arguments(out, {"--clean-plate", grey}), 1, "needs --clean-plate-depth");
    const std::string small = scene.folder / "small.exr";
    write_color(small, other(cv::Rect(0, 0, width - 1, height)).clone());
    check_refused(scene.arguments(out, {"--clean-plate", small, "--clean-plate-depth", depth}), 1,
                  "small.exr: is 47 × 32");
    CHECK(scene.folder.results().empty());
}

TEST_CASE("dof program: --highlights restores a lamp that is cut off, and no pale colour") {
    const Scene scene;
    cv::Mat codes(height, width, CV_8UC3, cv::Scalar(255, 236, 196)); // blue first
    codes.colRange(0, width / 2).setTo(cv::Scalar(60, 200, 255));
    const std::string png = scene.folder / "photo.png", exr = scene.folder / "out/light.exr";
    cv::imwrite(png, codes);
    for (const std::string& out : {exr, scene.folder / "out/light.png"})
        check_done({"dof", scene.input, "--color", png, "--camera", scene.camera, "-o", out, "--circle", "0,0",
                    "--highlights", "4"});
    const cv::Mat light = read_color(exr), written = cv::imread(scene.folder / "out/light.png", cv::IMREAD_COLOR);
    CHECK(light.at<cv::Vec3f>(1, 1)[2] > 2); // the lamp's red
    constexpr int most_codes = 12;
    CHECK(cv::norm(written.colRange(width / 2, width), codes.colRange(width / 2, width), cv::NORM_INF) <= most_codes);
}
