// fathom fog: what files hold of colours, and what is wrong is told in one line.
#include "program.hpp"

using namespace fathom;
using namespace fathom::test;

namespace {

const std::string view_key = R"(, "view": [[1, 0, 0, 0], [0, 0.8, 0.6, -1], [0, -0.6, 0.8, 0], [0, 0, 0, 1]])";

// A ramp of depths and a picture with an alpha.
struct Scene {
    Folder folder;
    std::string camera = camera_file(folder, view_key), input = depth_file(folder, "frame.exr"),
                picture_file = folder / "colour.exr";
    cv::Mat color = cv::Mat(height, width, CV_32FC4);

    Scene() {
        cv::randu(color.reshape(1), 0, 1);
        write_color(picture_file, color);
    }

    Arguments arguments(const std::string& output, const Arguments& more) const {
        return joined({"fog", input, "--color", picture_file, "--camera", camera, "-o", output}, more);
    }
};

} // namespace

TEST_CASE("fog program: red is in R, and an alpha is kept") {
    const Scene scene;
    const std::string out = scene.folder / "out/foggy.exr";
    check_done(scene.arguments(out, {"--density", "1e6", "--fog-color", "1,0.5,0"}));
    const cv::Mat alpha = channel(out, "A");
    CHECK(same(alpha, plane(scene.color, 3)));
    CHECK(same(channel(out, "R"), alpha));
    CHECK(same(channel(out, "G"), alpha * 0.5));
    CHECK(cv::countNonZero(channel(out, "B")) == 0);
}

TEST_CASE("fog program: what is wrong is told in one line") {
    const Scene scene;
    const std::string out = scene.folder / "out/foggy.exr";
    check_refused(scene.arguments(out, {}), 2, "--density");
    check_refused(scene.arguments(out, {"--density", "1", "--fog-color", "1,2"}), 2, "three finite numbers");
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
