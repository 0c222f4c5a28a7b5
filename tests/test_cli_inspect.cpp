// fathom inspect without a camera: what it names, and that the camera file that it prints is one.
#include "program.hpp"
#include "scene/scene.hpp"

#include <fathom/camera_file.hpp>

#include <opencv2/imgcodecs.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

/// A room's distances along the axis, 240 × 180 pixels.
cv::Mat room() {
    Camera camera{.projection = perspective(1.0, 4.0 / 3, {0.05, 100}), .width = 240, .height = 180};
    const scene::Rendered image = scene::render(scene::room(), camera);
    cv::Mat z(camera.height, camera.width, CV_32FC1);
    std::copy(image.z.begin(), image.z.end(), z.begin<float>());
    return z;
}

/// CARLA's 24 bits, R the lowest: 1000 m/(2²⁴ − 1) a step.
cv::Mat packed(const cv::Mat& z) {
    return filled<cv::Vec3b>(z.cols, z.rows, [&](int x, int y) {
        const auto code = static_cast<unsigned>(std::lround(static_cast<double>(z.at<float>(y, x)) * 16777.215));
        return cv::Vec3b(static_cast<std::uint8_t>(code >> 16), static_cast<std::uint8_t>(code >> 8),
                         static_cast<std::uint8_t>(code));
    });
}

/// What follows `label` on its line.
std::string after(const std::string& text, const std::string& label) {
    const auto at = text.find(label);
    REQUIRE(at != std::string::npos);
    return text.substr(at + label.size(), text.find('\n', at) - at - label.size());
}

const std::string label = "a camera file to start from: ";

} // namespace

TEST_CASE("inspect: without a camera it names the family and prints a camera file that works") {
    const Folder folder;
    const cv::Mat z = room();
    const std::string input = folder / "z.tif", camera = folder / "camera.json", output = folder / "out/z.tif";
    cv::imwrite(input, z);
    const Outcome outcome = check_done({"inspect", input});
    CHECK(after(outcome.out, "what the values could be: ") == "planar");
    CHECK(contains(outcome.out, "metres are plausible"));
    CHECK(contains(outcome.out, "assumed in it, for you to replace: the angle of view\n"));
    write(camera, after(outcome.out, label));
    check_done({"linearize", input, "--camera", camera, "-o", output});
    CHECK(cv::norm(cv::imread(output, cv::IMREAD_UNCHANGED), z, cv::NORM_INF) == 0);

    const Outcome with_camera = run({"inspect", input, "--camera", camera});
    CHECK(!contains(with_camera.out, "probably wrong"));
    CHECK(contains(run({"inspect", input, "--preset", "kinect:fx=50,fy=50,cx=20,cy=20"}).out,
                   "probably wrong:\n  its floats times the scale of 0.001 are "));
    CHECK(!contains(with_camera.out, "could be"));
    CHECK(run({"inspect", input, "--camera", camera, "--json"}).out.find(R"("could_be":null)") != std::string::npos);
    const Outcome json = run({"inspect", input, "--json"});
    CHECK(contains(json.out, R"("could_be":{"family":"planar","evidence":[)"));
    CHECK(contains(json.out, R"("camera_file":{"perspective":{"fov_y_deg":60},"encoding":"view-z"})"));
}

TEST_CASE("inspect: a packing that nobody said is found, or the image is refused as before") {
    const Folder folder;
    const cv::Mat z = room();
    const std::string input = folder / "carla.png", camera = folder / "camera.json", output = folder / "out/z.tif";
    cv::imwrite(input, packed(z));
    const Outcome outcome = check_done({"inspect", input});
    CHECK(after(outcome.out, "what the values could be: ") == "planar");
    CHECK(contains(outcome.out, "rgb-low-first"));
    write(camera, after(outcome.out, label));
    check_done({"linearize", input, "--camera", camera, "-o", output});
    constexpr double half_a_step = 0.51 * 1000 / 16777215; // and a float's rounding
    CHECK(cv::norm(cv::imread(output, cv::IMREAD_UNCHANGED), z, cv::NORM_INF) < half_a_step);

    cv::Mat picture(60, 80, CV_8UC3);
    cv::randu(picture, 0, 256);
    cv::imwrite(input, picture);
    const Outcome refused = run({"inspect", input});
    check_refused(refused, 1, input);
    CHECK(contains(refused.err, "\"packing\": \"rgb-low-first\""));
}

TEST_CASE("inspect: where it cannot tell it says so, with every reading that is left") {
    const Folder folder;
    cv::Mat inverse = room();
    cv::divide(0.5, inverse, inverse); // 1/z, or a reversed depth buffer whose near plane lies at 0.5
    const std::string input = folder / "inverse.tif";
    cv::imwrite(input, inverse);
    const Outcome outcome = check_done({"inspect", input});
    CHECK(after(outcome.out, "what the values could be: ") == "cannot tell");
    CHECK(contains(outcome.out, "\n  window-affine "));
    CHECK(contains(outcome.out, "\n  inverse  "));
    cv::imwrite(input, cv::Mat(20, 30, CV_32FC1, cv::Scalar(NAN)));
    const Outcome nothing = check_done({"inspect", input});
    CHECK(after(nothing.out, "what the values could be: ") == "cannot tell");
    CHECK(!contains(nothing.out, label));
}
