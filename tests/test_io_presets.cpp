// Sources of depth by name. The truth is each source's own formula, written down here once more, at one pixel.
#include "io_files.hpp"
#include "matrices.hpp"
#include "places.hpp"
#include "scene/scene.hpp"

#include <fathom/fathom.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>
#include <fathom/presets.hpp>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr float nothing = std::numeric_limits<float>::infinity();
constexpr float invalid = std::numeric_limits<float>::quiet_NaN();

/// Decoded depth is within an ulp of the stored number's; the formulas here are in double.
constexpr double tolerance = 0x1p-23;

// Images of 4 x 2 pixels under 90 degrees across: the first pixel's centre lies ¾ to the left and ¼ up on the plane z = 1.
constexpr int width = 4, height = 2;
const double slant = std::sqrt(1 + 0.75 * 0.75 + 0.25 * 0.25);
const std::string wide = "fov_x_deg=90";

/// Floats, and what each is.
struct Pixel {
    double stored;
    double z;
};

cv::Mat floats(const std::vector<Pixel>& pixels) {
    cv::Mat image(height, width, CV_32FC1);
    for (int i = 0; i < width * height; ++i)
        image.at<float>(i / width, i % width) =
            static_cast<float>(pixels[static_cast<std::size_t>(i) % pixels.size()].stored);
    return image;
}

cv::Mat as(int type, const std::vector<Pixel>& pixels) {
    return converted(floats(pixels), type);
}

/// A file's depth as the preset decodes it, one float a pixel.
std::vector<float> decoded(const std::string& preset, const std::filesystem::path& path) {
    static const Device device = Device::open("cpu");
    const CameraFile file = preset_file(preset);
    const DepthFile depth = read_depth(path, {.packing = file.packing});
    const Camera camera = camera_for(file, depth.values.cols, depth.values.rows);
    const cv::Mat z = to_mat(linearize({to_device(device, depth.values), camera, depth.storage}).image);
    return {z.ptr<float>(0), z.ptr<float>(0) + z.cols};
}

/// Checks a row of pixels: those of `image`'s first row are `pixels` in turn.
void check(const std::string& preset, const cv::Mat& image, const std::vector<Pixel>& pixels,
           const std::string& name = "depth.tif") {
    const TempFolder folder;
    const auto path = folder / name;
    REQUIRE(cv::imwrite(path.string(), image));
    const std::vector<float> z = decoded(preset, path);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        INFO(preset << ": stored " << pixels[i].stored << " is " << z[i] << ", expected " << pixels[i].z);
        if (std::isfinite(pixels[i].z))
            CHECK(std::abs(z[i] - pixels[i].z) <= tolerance * std::abs(pixels[i].z));
        else
            CHECK((std::isnan(pixels[i].z) ? std::isnan(z[i]) : std::isinf(z[i])));
    }
}

void check_floats(const std::string& preset, const std::vector<Pixel>& pixels) {
    check(preset, floats(pixels), pixels);
}

void check_codes(const std::string& preset, const std::vector<Pixel>& pixels) {
    check(preset, as(CV_16U, pixels), pixels, "depth.png");
}

void check_bytes(const std::string& preset, const std::vector<Pixel>& pixels) {
    check(preset, as(CV_8U, pixels), pixels, "depth.png");
}

/// A picture whose first pixels are these bytes, in B, G, R, A order.
cv::Mat packed(int channels, const std::vector<std::array<int, 4>>& pixels) {
    cv::Mat image(height, width, CV_8UC(channels), cv::Scalar::all(0));
    for (std::size_t i = 0; i < pixels.size(); ++i)
        for (int c = 0; c < channels; ++c)
            image.ptr<std::uint8_t>(0)[static_cast<int>(i) * channels + c] =
                static_cast<std::uint8_t>(pixels[i][static_cast<std::size_t>(c)]);
    return image;
}

/// z of a depth-buffer value from 0 to 1.
double window(double v, double near, double far) {
    return 1 / (1 / near + v * (1 / far - 1 / near));
}

const std::string intrinsics = "fx=2,fy=2,cx=1.5,cy=0.5";

/// What each preset makes of numbers that its source wrote.
struct Truth {
    std::string preset;
    void (*check)(const std::string& preset, const std::vector<Pixel>& pixels);
    std::vector<Pixel> pixels;
};

std::vector<Truth> truths() {
    const auto inverse = [](double v) { return 20 * 0.5 / (20 - v / 255 * (20 - 0.5)); };
    const double aside = std::sqrt(1 + 0.5 * 0.5); // pixel (0.5, 0.5), centre (1.5, 0.5), fx = 2
    const std::string from_half_to_20 = "near=0.5,far=20," + intrinsics;
    return {
        {"airsim-planar:" + wide, check_floats, {{2.5, 2.5}, {65504, nothing}, {70000, nothing}}},
        {"airsim-perspective:" + wide, check_floats, {{2.5, 2.5 / slant}, {65504, nothing}}},
        {"airsim-vis:" + wide, check_bytes, {{51, 20}, {255, nothing}, {254, 25400 / 255.0}}},
        {"apple-disparity:" + intrinsics, check_floats, {{0.5, 2}, {0, nothing}, {-1, invalid}}},
        {"azure-kinect:" + intrinsics, check_codes, {{1500, 1.5}, {0, invalid}}},
        // The first of 4 x 2 pixels looks 135 degrees to the left and 45 upwards.
        {"blender-panorama", check_floats, {{3, -1.5}, {1e10, nothing}}},
        {"habitat-panorama", check_floats, {{2.5, -1.25}, {0, nothing}}},
        {"matterport-panorama", check_codes, {{8000, -1}, {0, invalid}}},
        {"blender:" + wide, check_floats, {{3, 3}, {1e10, nothing}, {65504, 65504}}},
        {"colmap:" + intrinsics, check_floats, {{1.25, 1.25}, {0, invalid}}},
        {"gazebo:fov_x_deg=60", check_floats, {{1.25, 1.25}, {INFINITY, nothing}, {NAN, invalid}}},
        {"gdepth-inverse:" + from_half_to_20, check_bytes, {{0, 0.5}, {51, inverse(51)}, {255, 20}}},
        {"gdepth-inverse:along=ray," + from_half_to_20, check_bytes, {{51, inverse(51) / aside}}},
        {"gdepth-linear:" + from_half_to_20, check_bytes, {{0, 0.5}, {51, 0.5 + 19.5 / 5}, {255, 20}}},
        {"gdepth-linear:along=ray," + from_half_to_20, check_bytes, {{51, 4.4 / aside}}},
        {"habitat:" + wide, check_floats, {{2.5, 2.5}, {0, nothing}}},
        {"habitat-lab:near=0,far=10," + wide, check_floats, {{0.25, 2.5}, {0, invalid}, {1, nothing}}},
        {"habitat-lab:near=0.5,far=5," + wide, check_floats, {{0.5, 2.75}, {0, invalid}, {1, nothing}}},
        {"hypersim:" + wide, check_floats, {{2.5, 2.5 / slant}, {NAN, invalid}}},
        {"isaac-planar:" + wide, check_floats, {{2.5, 2.5}, {INFINITY, nothing}}},
        {"isaac-ray:" + wide, check_floats, {{2.5, 2.5 / slant}, {INFINITY, nothing}}},
        {"kinect:" + intrinsics, check_codes, {{1500, 1.5}, {0, invalid}, {65535, 65.535}}},
        {"kitti:" + intrinsics, check_codes, {{1280, 5}, {0, invalid}}},
        {"middlebury:scale=800,offset=30.5," + intrinsics,
         check_floats,
         {{9.5, 20}, {INFINITY, invalid}, {0, 800 / 30.5}}},
        {"mitsuba2:" + wide, check_floats, {{2.5, 2.5 / slant}, {0, nothing}}},
        // The ray crosses the near plane at near/cos, so the distance from the camera centre is v + near/cos.
        {"mitsuba3:near=0.25," + wide, check_floats, {{2.5, 0.25 + 2.5 / slant}, {0, nothing}}},
        // The last code of 24 bits before the far plane is 49.97.
        {"mujoco:near=0.01,far=50,fov_y_deg=45", check_floats, {{2, 2}, {49.95, nothing}, {50, nothing}, {49.9, 49.9}}},
        {"mujoco-raw:near=0.5,far=50,fov_y_deg=45", check_floats, {{0.5, window(0.5, 0.5, 50)}, {1, nothing}}},
        {"nuke-depth:" + wide, check_floats, {{0.25, 4}, {0, nothing}}},
        {"pybullet:near=0.5,far=50,fov_y_deg=60", check_floats, {{0.5, window(0.5, 0.5, 50)}, {1, nothing}}},
        {"realsense:" + intrinsics, check_codes, {{1500, 1.5}, {0, invalid}}},
        {"realsense:scale=0.0001," + intrinsics, check_codes, {{1500, 0.15}, {0, invalid}}},
        {"replica:" + intrinsics, check_codes, {{13107, 13107 / 6553.5}, {0, invalid}}},
        {"scannet:" + intrinsics, check_codes, {{1500, 1.5}, {0, invalid}}},
        // 1500 · 8, and 9000 · 8 = 2¹⁶ + 6464
        {"sunrgbd:" + intrinsics, check_codes, {{12000, 1.5}, {6465, 9}, {0, invalid}}},
        {"tum:" + intrinsics, check_codes, {{5000, 1}, {0, invalid}}},
        {"unreal-cm:" + wide, check_floats, {{250, 2.5}, {65504, nothing}}},
        {"unreal-cm:" + wide, check_floats, {{250, 2.5}, {65505, 655.05}, {192000, 1920}, {1e10, nothing}}},
        {"unreal-meters:" + wide, check_floats, {{2.5, 2.5}, {65504, nothing}}},
        {"vkitti2:" + intrinsics, check_codes, {{1500, 15}, {65535, nothing}, {65534, 655.34}}},
        {"vray-z:near=2,far=12," + wide, check_floats, {{0.25, 4.5}, {0, 2}, {1, nothing}}},
        {"vray-z:near=12,far=2," + wide, check_floats, {{0.75, 4.5}, {1, 2}, {0, nothing}}}, // near is white
    };
}

/// The same of pictures.
struct PictureTruth {
    std::string preset;
    cv::Mat image;
    std::vector<Pixel> pixels;
};

std::vector<PictureTruth> picture_truths() {
    const double carla = 1000.0 * (3 + 256 * 2 + 65536) / 16777215; // R = 3, G = 2, B = 1
    const auto threejs = [](double v) { return window(static_cast<float>(v / 256), 0.5, 50); };
    const std::string clip = "near=0.5,far=50,fov_y_deg=50";
    const cv::Mat code = as(CV_8U, {{51, 0}}), grey = merged({code, code, code}); // as some programs write GDepth
    return {{"carla:" + wide, packed(3, {{1, 2, 3}, {255, 255, 255}}), {{0, carla}, {0, nothing}}},
            {"carla:" + wide, packed(4, {{1, 2, 3, 255}}), {{0, carla}}},
            {"gdepth-linear:near=0.5,far=20," + intrinsics, grey, {{51, 0.5 + 19.5 / 5}}},
            {"threejs-rgba:" + clip,
             packed(4, {{1, 2, 200, 7}, {255, 255, 255, 255}}),
             {{0, threejs(((7 / 255.0 + 1) / 256 + 2) / 256 + 200)}, {0, nothing}}},
            {"threejs-rgba-r166:" + clip,
             packed(4, {{1, 2, 3, 200}}),
             {{0, threejs(((3 / 256.0 + 2) / 256 + 1) / 256 + 200)}}}};
}

} // namespace

TEST_CASE("presets: each decodes what its source writes, by the source's own formula", "[presets]") {
    std::set<std::string> checked;
    for (const Truth& truth : truths()) {
        truth.check(truth.preset, truth.pixels);
        checked.insert(truth.preset.substr(0, truth.preset.find(':')));
    }
    for (const PictureTruth& truth : picture_truths()) {
        check(truth.preset, truth.image, truth.pixels, "depth.png");
        checked.insert(truth.preset.substr(0, truth.preset.find(':')));
    }
    CHECK(preset_file("mujoco-raw:near=0.5,far=50,fov_y_deg=45").camera.rows == Rows::bottom_up);
    std::set<std::string> all;
    for (const Preset& preset : presets())
        all.insert(preset.name);
    CHECK(checked == all);
}

TEST_CASE("presets: a camera file names one, and its own keys come first", "[presets]") {
    const TempFolder folder;
    const auto read = [&](const std::string& text) { return read_camera(put(folder / "camera.json", text)); };
    const CameraFile file = read(R"({"preset": "realsense", "scale": 0.0001, "width": 4, "height": 2,
                                     "intrinsics": {"fx": 2, "fy": 2, "cx": 1.5, "cy": 0.5}})");
    CHECK(file.preset == "realsense");
    CHECK(file.camera.scale == 0.0001);
    CHECK(file.camera.missing == 0);
    CHECK(file.camera.projection.convention.view_axes == ViewAxes::opencv);
    const Rays::Matrix direction =
        camera_rays(file.camera).direction; // calibrations count from the first pixel's centre
    CHECK(static_cast<double>((direction * Eigen::Matrix<long double, 3, 1>(2, 1, 1)).head<2>().norm()) < 1e-15);

    const auto refused = [&](const std::string& text) { return refusal([&] { read(text); }); };
    check_says(refused(R"({"preset": "kinekt", "width": 4})"), {"camera.json", "\"kinekt\"", "nearest is \"kinect\""});
    check_says(refused(R"({"preset": "kinect"})"), {"\"intrinsics\" is missing", "fx, fy, cx and cy"});
    check_says(refused(R"({"preset": "carla"})"), {"\"perspective.fov_x_deg\" is missing", "usually fov_x_deg is 90"});
    check_says(refused(R"({"preset": "gdepth-linear", "near": 1, "perspective": {"fov_x_deg": 60}})"),
               {"\"far\" is missing", "GDepth:Far"});
    const CameraFile other =
        read(R"({"preset": "habitat", "encoding": "ray-distance", "perspective": {"fov_x_deg": 90}})");
    CHECK(other.camera.encoding == Encoding::ray_distance);
    CHECK(other.camera.background == 0); // the preset's
    check_says(refused(R"({"preset": 3})"), {"must be a word in quotes"});
    CHECK_NOTHROW(
        read(R"({"preset": "pybullet", "projection": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.1, -1], [0, 0, -1, 0]]})"));
}

TEST_CASE("presets: a grey picture of depth is no packed depth", "[presets]") {
    const TempFolder folder;
    cv::Mat grey(16, 16, CV_8UC3);
    for (int i = 0; i < 256; ++i)
        grey.at<cv::Vec3b>(i / 16, i % 16) = cv::Vec3b::all(static_cast<std::uint8_t>(i));
    REQUIRE(cv::imwrite((folder / "grey.png").string(), grey));
    check_says([&] { read_depth(folder / "grey.png", {.packing = Packing::rgb_red_low}); },
               {"grey.png", "R = G = B in every pixel", "save raw depth"});
    REQUIRE(cv::imwrite((folder / "sky.png").string(), cv::Mat(16, 16, CV_8UC3, cv::Scalar::all(255))));
    CHECK_NOTHROW(read_depth(folder / "sky.png", {.packing = Packing::rgb_red_low}));
}

TEST_CASE("presets: 16 bits in two channels, and fractions in four, are packed depth", "[presets]") {
    const TempFolder folder;
    const auto saved = [&](int type, const auto& pixel_of) { // a floor before two walls, z from 2 to 20
        cv::Mat made(120, 160, type);
        for (int y = 0; y < made.rows; ++y)
            for (int x = 0; x < made.cols; ++x)
                pixel_of(std::min({y > 60 ? 120.0 / (y - 60) : 1e9, 12 + 0.03 * x, 20 - 0.05 * x}),
                         made.ptr(y) + static_cast<std::size_t>(x) * made.elemSize());
        REQUIRE(cv::imwrite((folder / "a.png").string(), made));
    };
    for (const bool red_is_low : {false, true}) { // in the upper two bytes
        saved(CV_8UC3, [&](double z, std::uint8_t* bgr) {
            const auto code = static_cast<std::uint32_t>(z * 1000);
            bgr[red_is_low ? 0 : 2] = static_cast<std::uint8_t>(code >> 8);
            bgr[1] = static_cast<std::uint8_t>(code), bgr[red_is_low ? 2 : 0] = 0;
        });
        CHECK_NOTHROW(
            read_depth(folder / "a.png", {.packing = red_is_low ? Packing::rgb_red_low : Packing::rgb_red_high}));
        check_says([&] { read_depth(folder / "a.png"); }, {"16 bits in two of its channels", "16-bit integers"});
    }
    // Fractions, also those whose bits would be those of floats from 2 to 32, which rise alike at all of the powers of two.
    for (const auto& [first, part] : {std::pair{0.0, 1.0}, {0.25, 0.0078}}) {
        saved(CV_8UC4, [first = first, part = part](double z, std::uint8_t* bgra) {
            const auto bits = static_cast<std::uint32_t>((first + part * z / 21) * 0x1p32);
            for (const auto& [place, byte] : {std::pair{2, 0}, {1, 1}, {0, 2}, {3, 3}})
                bgra[place] = static_cast<std::uint8_t>(bits >> (8 * byte));
        });
        CHECK_NOTHROW(read_depth(folder / "a.png", {.packing = Packing::rgba_red_low}));
        check_says([&] { read_depth(folder / "a.png", {.packing = Packing::rgb_red_low}); },
                   {"a.png: has an alpha between 0 and 255", "\"rgba-low-first\""});
    }
}

TEST_CASE("presets: depth that a colour map paints is refused under every packing, and no packed depth is",
          "[presets]") {
    constexpr int wide_px = 160, high_px = 120;
    Camera camera;
    camera.projection = perspective(1.05, static_cast<double>(wide_px) / high_px, {0.1, 100});
    camera.width = wide_px;
    camera.height = high_px;
    camera.encoding = Encoding::view_z;
    std::mt19937 random(8);
    std::normal_distribution<double> noise;
    struct Painted {
        std::string name;
        cv::Mat z; ///< metres, and infinity
    };
    std::vector<Painted> scenes;
    for (const double part : {0.0, 0.003, 0.02}) {
        const auto add = [&](const std::string& name, const auto& depth) {
            scenes.push_back({name + " with noise of " + std::to_string(part),
                              filled<double>(wide_px, high_px,
                                             [&](int x, int y) { return depth(x, y) * (1 + part * noise(random)); })});
        };
        for (const auto& [name, scene] : {std::pair{"room", scene::room()}, {"corridor", scene::corridor()}}) {
            const scene::Rendered image = scene::render(scene, camera);
            add(name, [&](int x, int y) { return image.z[static_cast<std::size_t>(y * wide_px + x)]; });
        }
        add("ramp", [](int x, int) { return 1 + 0.05 * x; });
        add("plane under a sky", [](int x, int y) { return y < 30 ? HUGE_VAL : 1 / (1 - 0.005 * y - 0.001 * x); });
    }
    const TempFolder folder;
    const auto read = [&](const cv::Mat& pixels, Packing packing) {
        REQUIRE(cv::imwrite((folder / "a.png").string(), pixels));
        return refusal([&] { read_depth(folder / "a.png", {.packing = packing, .as_counted = true}); });
    };
    const auto in_four = [](const cv::Mat& bgr) {
        cv::Mat bgra;
        cv::cvtColor(bgr, bgra, cv::COLOR_BGR2BGRA);
        return bgra;
    };
    // The others change in one channel for most of a scene.
    const std::vector maps{cv::COLORMAP_JET,     cv::COLORMAP_HSV,    cv::COLORMAP_TURBO,    cv::COLORMAP_VIRIDIS,
                           cv::COLORMAP_PLASMA,  cv::COLORMAP_MAGMA,  cv::COLORMAP_INFERNO,  cv::COLORMAP_PARULA,
                           cv::COLORMAP_CIVIDIS, cv::COLORMAP_WINTER, cv::COLORMAP_COOL,     cv::COLORMAP_SUMMER,
                           cv::COLORMAP_SPRING,  cv::COLORMAP_BONE,   cv::COLORMAP_TWILIGHT, cv::COLORMAP_PINK,
                           cv::COLORMAP_AUTUMN};
    for (const auto& [name, z] : scenes) {
        cv::Mat grey;
        z.convertTo(grey, CV_8U, 255 / 9.0, -255 / 9.0);
        for (const int map : maps) {
            cv::Mat painted;
            cv::applyColorMap(grey, painted, map);
            if (map % 2) // another colour where nothing is
                painted.setTo(cv::Scalar(255, 200, 120), z == HUGE_VAL);
            INFO(name << ", map " << map);
            for (const Packing packing : {Packing::rgb_red_low, Packing::rgb_red_high})
                CHECK(read(painted, packing).find("like the colours of a picture") != std::string::npos);
            for (const Packing packing : {Packing::rgba_red_low, Packing::rgba_red_high})
                CHECK(read(in_four(painted), packing).find("like the colours of a picture") != std::string::npos);
            REQUIRE(cv::imwrite((folder / "a.png").string(), painted));
            CHECK(refusal([&] { read_depth(folder / "a.png"); }).find("packing") == std::string::npos);
            if (map ==
                cv::COLORMAP_AUTUMN) // which a depth buffer of 16 bits may look like, whose surfaces lie in the last 256th
                CHECK(refusal([&] { read_depth(folder / "a.png", {.packing = Packing::rgb_red_high}); }) ==
                      "(nothing was refused)");
        }
        // Numbers of 24 bits in many codes and in few, from 16 bits that fill them and with a sky.
        for (const double range : {10.0, 100.0, 1000.0})
            for (const double codes : {16777215.0, 65535.0, 4096.0, 256.0, 64.0, 10.0}) {
                cv::Mat packed(z.size(), CV_8UC3);
                for (int i = 0; i < wide_px * high_px; ++i) {
                    const double part = std::min(z.at<double>(i / wide_px, i % wide_px) / range, 1.0);
                    const auto code = static_cast<std::uint32_t>(std::round(part * codes) / codes * 16777215);
                    for (int c = 0; c < 3; ++c)
                        packed.at<cv::Vec3b>(i / wide_px, i % wide_px)[c] =
                            static_cast<std::uint8_t>(code >> (16 - 8 * c));
                }
                INFO(name << ", " << codes << " codes to " << range << " m");
                CHECK(read(packed, Packing::rgb_red_low) == "(nothing was refused)");
                CHECK(read(in_four(packed), Packing::rgb_red_low) == "(nothing was refused)");
            }
    }
}

TEST_CASE("presets: the four bytes of a float are refused in any order, whatever its sky and its packing",
          "[presets]") {
    constexpr int wide_px = 160, high_px = 120;
    const TempFolder folder;
    const auto write = [&](const std::array<int, 4>& places, float unit, float sky) {
        const auto bgra = filled<cv::Vec4b>(wide_px, high_px, [&](int x, int y) {
            const double z = std::min(y > 60 ? 120.0 / (y - 60) : 1e9, 12 + 0.03 * x);
            const auto bits = std::bit_cast<std::uint32_t>(y < 30 ? sky : unit * static_cast<float>(z));
            cv::Vec4b pixel;
            for (int byte = 0; byte < 4; ++byte)
                pixel[places[static_cast<std::size_t>(byte)]] = static_cast<std::uint8_t>(bits >> (8 * byte));
            return pixel;
        });
        REQUIRE(cv::imwrite((folder / "a.png").string(), bgra));
    };
    for (const std::array<int, 4>& places : {std::array{2, 1, 0, 3}, {3, 0, 1, 2}, {0, 1, 2, 3}, {3, 2, 1, 0}})
        for (const float unit : {1.0f, 1000.0f, 0.05f, -1.0f})
            for (const float sky : {12.0f * unit, 0.0f, 1e10f, INFINITY, NAN}) {
                INFO(places[0] << places[1] << places[2] << places[3] << ", " << unit << ", " << sky);
                write(places, unit, sky);
                for (const std::optional<Packing> packing : {std::optional<Packing>{},
                                                             {Packing::rgb_red_low},
                                                             {Packing::rgb_red_high},
                                                             {Packing::rgba_red_low},
                                                             {Packing::rgba_red_high}})
                    check_says([&] { read_depth(folder / "a.png", {.packing = packing}); },
                               {"a.png", "four bytes of floats", ".exr"});
            }
}

TEST_CASE("presets: as text", "[presets]") {
    const auto refused = [](const std::string& text) { return refusal([&] { preset_file(text); }); };
    check_says(refused("carla:fov_x_deg"), {"preset carla:fov_x_deg", "no key and value", "key=value"});
    check_says(refused("carla:=90"), {"no key and value"});
    check_says(refused("carla:fov_x_deg="), {"no key and value"});
    check_says(refused("carla:fov_x_deg=90,fov_x_deg=80"), {"\"fov_x_deg\" is given twice"});
    check_says(refused("carla:fov_x_deg=wide"), {"\"wide\" must be a number"});
    check_says(refused("carla:fov_x=90"), {"unknown key \"fov_x\""});
    check_says(refused("karla:fov_x_deg=90"), {"nearest is \"carla\""});
    check_says(refused("carla"), {"\"perspective.fov_x_deg\" is missing"});
    check_says(refused(""), {"preset"});
    check_says(refused("carla:perspective=1,fov_x_deg=90"), {"\"perspective\" does not stand here"});
    check_says(refused("carla\xff:fov_x_deg=90"), {"preset carla"});
    check_says(refused("kinect:fx=2,fy=2,cx=1,cy=1,scale=1e-999"), {"preset kinect"});
    check_says(refused("mujoco:near=1,far=infinity,fov_y_deg=45"), {"a finite one"});
    CHECK(preset_file("habitat:fov_x_deg=90,missing=0").camera.missing == 0);
    check_says(refused("mujoco:near=1,far=inf,fov_y_deg=45"), {"far"});
    CHECK(preset_file("carla:fov_x_deg=90,width=800,height=600").camera.width == 800);
    CHECK(preset_file("isaac-ray:fov_x_deg=90,background=infinity").camera.background == INFINITY);
    for (const std::string number : {"90.0", "9e1", "0.9e2", "900e-1", " 90"})
        CHECK(preset_camera("carla:fov_x_deg=" + number, 800, 600).projection.matrix ==
              preset_camera("carla:fov_x_deg=90", 800, 600).projection.matrix);
    for (const std::string none : {"+90", "90.", ".9e2", "090.0", "0x5a", "9e", "9.0.0", "90deg", "1e999", "-", "."})
        check_says(refused("carla:fov_x_deg=" + none), {"fov_x_deg"});
}

TEST_CASE("presets: width, height and aspect come from the image", "[presets]") {
    const Camera image = preset_camera("carla:fov_x_deg=90", 800, 600);
    CHECK(image.projection.matrix(0, 0) == Approx(1.0L).epsilon(1e-15));
    CHECK(image.projection.matrix(1, 1) == Approx(800.0L / 600).epsilon(1e-15));
    const Camera calibrated = preset_camera("tum:fx=500,fy=510,cx=319.5,cy=239.5", 640, 480);
    const PixelScale scale = pixel_scale(calibrated);
    CHECK((scale.x == Approx(500.0L).epsilon(1e-15) && scale.y == Approx(510.0L).epsilon(1e-15)));
}

TEST_CASE("presets: the README counts all", "[presets][pages]") {
    std::ifstream page(std::string(places::sources) + "/README.md");
    const std::string text((std::istreambuf_iterator<char>(page)), std::istreambuf_iterator<char>());
    CHECK(contains(text, "[" + std::to_string(presets().size()) + " sources by name]"));
}

TEST_CASE("presets: the page lists each with its formula and what it needs", "[presets][pages]") {
    std::ifstream page(std::string(places::sources) + "/docs/sources.md");
    const std::string text((std::istreambuf_iterator<char>(page)), std::istreambuf_iterator<char>());
    std::set<std::string> seen;
    for (const Preset& preset : presets()) {
        CHECK(seen.insert(preset.name).second);
        std::string needs;
        for (const auto& [key, meaning] : preset.needs)
            needs += "`" + key + "`, ";
        needs += preset.projection == "fx"   ? "`fx`, `fy`, `cx`, `cy`"
                 : preset.projection.empty() ? "nothing"
                                             : "`" + preset.projection + "`";
        if (!preset.usual.empty())
            needs += " (" + preset.usual + ")";
        const std::string row =
            "| `" + preset.name + "` | " + preset.source + " | " + preset.formula + " | " + needs + " |";
        INFO("this row is missing in docs/sources.md:\n" << row);
        CHECK(contains(text, row));
    }
}

TEST_CASE("presets: where values count backwards, so does the value from which on nothing is there", "[io]") {
    for (const char* preset : {"unreal-meters", "airsim-planar"}) // largest-half, and from 65504 on
        check_floats(std::string(preset) + ":fov_x_deg=60,scale=-1",
                     {{-2, 2}, {-300, 300}, {-65504, nothing}, {-2e10, nothing}});
    check_floats("blender:fov_x_deg=60,scale=-1", {{-2, 2}, {-300, 300}, {-1e10, nothing}, {-5, 5}});
}

TEST_CASE("presets: codes that are packed, and values that went through a curve, come back as they were", "[presets]") {
    const TempFolder folder;
    const fs::path file = folder / "a.png";
    const auto codes = filled(17, 5, [](int x, int y) { return 1 + 61.0 * (17 * y + x); });
    cv::Mat right, packed;
    codes.convertTo(right, CV_16U);
    const auto write = [&](const auto& pack) {
        packed = right.clone();
        std::ranges::transform(std::span(right.ptr<std::uint16_t>(), right.total()), packed.ptr<std::uint16_t>(), pack);
        REQUIRE(cv::imwrite(file.string(), packed));
    };
    const auto is_right = [&](Packing packing) {
        const DepthFile depth = read_depth(file, {.packing = packing});
        return depth.storage == Storage::uint16 && cv::norm(depth.values, right, cv::NORM_INF) == 0;
    };
    write([](std::uint16_t code) { return std::rotl(code, 3); });
    CHECK(is_right(Packing::uint16_rotated));
    write([](std::uint16_t code) { return std::rotl(code, 8); });
    CHECK(is_right(Packing::uint16_swapped));
    write([](std::uint16_t code) { return static_cast<std::uint16_t>(code | 0x6000); });
    CHECK(is_right(Packing::uint13));
    CHECK(preset_file("kinect:fx=1,fy=1,cx=1,cy=1,packing=uint13").packing == Packing::uint13);

    // IEC 61966-2-1, and powers, to half a step of 16 bits.
    const auto display = [](double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; };
    for (const auto& [text, curve] : std::vector<std::pair<std::string, std::function<double(double)>>>{
             {"srgb", display}, {"2.2", [](double v) { return std::pow(v, 1 / 2.2); }}, {"0.5", [](double v) {
                                                                                             return v * v;
                                                                                         }}}) {
        const auto part = [](int x, int y) { return (1.0 + 17 * y + x) / 90; };
        filled(17, 5, [&](int x, int y) { return std::round(65535 * curve(part(x, y))); }).convertTo(packed, CV_16U);
        REQUIRE(cv::imwrite(file.string(), packed));
        const CameraFile camera = preset_file("encoding=linear,near=0,far=1,fov_x_deg=60,gamma=" + text);
        const DepthFile depth = read_depth(file, {.gamma = camera.gamma});
        INFO(text);
        REQUIRE(depth.storage == Storage::float32);
        for (int y = 0; y < 5; ++y)
            for (int x = 0; x < 17; ++x) {
                const double slope = (curve(part(x, y) + 1e-5) - curve(part(x, y) - 1e-5)) / 2e-5;
                CHECK(std::abs(static_cast<double>(depth.values.at<float>(y, x)) - part(x, y)) <=
                      0.51 / 65535 / slope + 1e-6);
            }
        CHECK(cv::norm(read_depth(file, {.gamma = camera.gamma, .as_counted = true}).values, 65535 * depth.values,
                       cv::NORM_INF) < 0.01);
    }
    check_says([] { preset_file("encoding=linear,near=0,far=1,fov_x_deg=60,gamma=-1"); }, {"\"gamma\"", "above 0"});
    check_says([] { preset_file("encoding=linear,near=0,far=1,fov_x_deg=60,gamma=rec709"); }, {"\"gamma\""});

    // Unity's EncodeFloatRGBA, and its R, G and B alone.
    for (const int channels : {3, 4}) {
        cv::Mat bytes(5, 17, CV_8UC(channels));
        for (int i = 0; i < 85; ++i)
            for (int c = 0; c < channels; ++c)
                bytes.data[channels * i + c] = static_cast<unsigned char>((i * (c + 3)) % 255);
        REQUIRE(cv::imwrite(file.string(), bytes));
        const DepthFile depth = read_depth(file, {.packing = Packing::base_255});
        REQUIRE(depth.storage == Storage::float32);
        for (int i = 0; i < 85; ++i) {
            const unsigned char* pixel = bytes.data + channels * i;
            const double truth = pixel[2] / 255.0 + pixel[1] / 65025.0 + pixel[0] / 16581375.0 +
                                 (channels == 4 ? pixel[3] / 4228250625.0 : 0);
            CHECK(depth.values.at<float>(i / 17, i % 17) == Approx(truth).epsilon(1e-6));
        }
    }
}
