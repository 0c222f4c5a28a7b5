// fathom fog: the files hold what the library gives, and what is wrong is told in one line.
#include "program.hpp"

#include <fathom/fog.hpp>
#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

const std::string view_key = R"(, "view": [[1, 0, 0, 0], [0, 0.8, 0.6, -1], [0, -0.6, 0.8, 0], [0, 0, 0, 1]])";

// A ramp of depths and a picture as the program and as the library see them.
struct Scene {
    Folder folder;
    std::string camera, input, picture_file;
    cv::Mat depth = ramp(), color;

    explicit Scene(int channels = 3)
        : camera(camera_file(folder, view_key)), picture_file(folder / "colour.exr"),
          color(height, width, CV_32FC(channels)) {
        input = depth_file(folder, "frame.exr", depth);
        cv::randu(color.reshape(1), 0, 1);
        write_color(picture_file, color);
    }

    Arguments arguments(const std::string& output, const Arguments& more) const {
        return joined({"fog", input, "--color", picture_file, "--camera", camera, "-o", output}, more);
    }

    cv::Mat expected(FogOptions options) const {
        std::swap(options.fog_color[0], options.fog_color[2]); // a matrix is B, G, R
        cv::Mat result;
        fog(Device::open(), depth, camera_for(read_camera(camera), width, height), color, result, options);
        return result;
    }
};

} // namespace

TEST_CASE("fog program: writes what the library computes, red in R") {
    for (const int channels : {3, 4}) {
        const Scene scene(channels);
        const std::string out = scene.folder / "out/foggy.exr";
        check_done(scene.arguments(out, {"--density", "0.4", "--fog-color", "1,0.5,0"}));
        CHECK(same(read_color(out), scene.expected({.density = 0.4, .fog_color = {1, 0.5, 0}})));
        check_done(scene.arguments(out, {"--density", "1e6", "--fog-color", "1,0.5,0"}));
        const cv::Mat red = channel(out, "R"), green = channel(out, "G"), blue = channel(out, "B");
        if (channels == 3) {
            CHECK(cv::countNonZero(red != 1) == 0);
            CHECK(cv::countNonZero(green != 0.5) == 0);
            CHECK(cv::countNonZero(blue) == 0);
        }
    }
}

TEST_CASE("fog program: the sky is hidden or kept") {
    const Scene scene; // the last pixel is the background
    const std::string out = scene.folder / "out/foggy.exr";
    const auto corner = [&] { return read_color(out).at<cv::Vec3f>(height - 1, width - 1); };
    check_done(scene.arguments(out, {"--density", "0.01", "--fog-color", "3,4,5"}));
    CHECK(corner() == cv::Vec3f(5, 4, 3));
    check_done(scene.arguments(out, {"--density", "0.01", "--sky", "keep"}));
    CHECK(corner() == scene.color.at<cv::Vec3f>(height - 1, width - 1));
}

TEST_CASE("fog program: what is wrong is told in one line") {
    const Scene scene;
    const std::string out = scene.folder / "out/foggy.exr";
    check_refused(scene.arguments(out, {}), 2, "--density");
    check_refused(scene.arguments(out, {"--density", "1", "--fog-color", "1,2"}), 2, "three finite numbers");
    check_refused(scene.arguments(out, {"--density", "1", "--up", "0,1,0"}), 2, "--height-falloff");
    const std::string plain = camera_file(scene.folder);
    check_refused({"fog", scene.input, "--color", scene.picture_file, "--camera", plain, "-o", out, "--density", "1",
                   "--height-falloff", "1"},
                  1, "view");
    const std::string small = scene.folder / "small.exr";
    write_color(small, scene.color(cv::Rect(0, 0, 6, 9)));
    check_refused({"fog", scene.input, "--color", small, "--camera", scene.camera, "-o", out, "--density", "1"}, 1,
                  "small.exr");
    CHECK(scene.folder.results().empty());
}
