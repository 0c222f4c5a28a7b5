// A lens of arguments, the camera's defaults and an image: each way to say it gives the circle of the same `Lens`.

#include "catch.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

constexpr LensDefaults none = {};

Camera camera_of_z() {
    Camera camera;
    camera.projection = perspective(FrustumEdges{-1, 1, -1, 1}, {1, 100});
    camera.width = 3;
    camera.height = 2;
    camera.encoding = Encoding::view_z;
    return camera;
}

void check_same(const CircleOfConfusion& circle, const CircleOfConfusion& expected) {
    for (const double z : {1.5, 3.0, 7.0, HUGE_VAL})
        CHECK(coc_at(circle, z) == coc_at(expected, z));
}

} // namespace

TEST_CASE("lens arguments: the camera has what is not given, and the image has the focus", "[lens_arguments]") {
    const Camera camera = camera_of_z();
    const std::vector<float> values{1, 2, 3, 4, 5, std::numeric_limits<float>::quiet_NaN()};
    const StoredDepth stored{Image::from_host(test_device(), Element::f32, values.data(), {3, 2}), camera};
    const auto circle = [&](const LensArguments& lens, const LensDefaults& defaults) {
        return circle_for(completed(lens, defaults, camera.projection), stored);
    };
    const LensDefaults defaults{.focal_length_mm = 50, .sensor_mm = 36, .f_stop = 2, .focus = 4, .ao_distance = {}};
    const auto expected = [&](double focus, double f_stop) {
        return circle_of_confusion({.f_stop = f_stop, .focus = focus, .focal_length_mm = 50, .sensor_mm = 36}, camera);
    };
    check_same(circle({}, defaults), expected(4, 2));
    check_same(circle({.focus = 7, .f_stop = 8}, defaults), expected(7, 8));
    check_same(circle({.focus_at = LensArguments::Pixel{2, 0}}, defaults), expected(3, 2));
    check_same(circle({.focus_along = LensArguments::AlongRay{{2, 1}, 5}}, defaults),
               expected(depth_along_ray(camera, 2.5, 1.5, 5), 2));
    check_same(circle({.circle = std::array{3.0, 6.0}}, none), {3, 6, 0, false});
    CHECK_THROWS_WITH(circle({.focus_at = LensArguments::Pixel{2, 1}}, defaults),
                      "pixel (2, 1) is invalid: it has no depth to focus on");
}

TEST_CASE("lens arguments: what is missing is refused by its name", "[lens_arguments]") {
    const Projection projection = camera_of_z().projection;
    const auto refused = [&](const LensArguments& lens, const LensDefaults& defaults, const std::string& message) {
        CHECK_THROWS_WITH(completed(lens, defaults, projection), message);
    };
    refused({.focus = 2}, none, "f_stop: missing, and the camera has no \"f_stop\"; give the f-number");
    refused({.f_stop = 2}, none,
            "focus: missing, and the camera has no \"focus_distance\"; give a length in scene units, or focus_at X,Y");
    refused({.focus = 2, .f_stop = 2}, none,
            "focal_length_mm: missing, and the camera has no \"lens_mm\"; give it or sensor_mm, or both");
    refused({.focus = 2, .focus_at = LensArguments::Pixel{0, 0}}, none,
            "focus_at and focus exclude each other: give one of the two");
    refused({.f_stop = 2, .circle = std::array{3.0, 6.0}}, none,
            "circle and f_stop exclude each other: give one of the two");
    refused({.mm_per_unit = 10, .circle = std::array{3.0, 6.0}}, none,
            "circle and mm_per_unit exclude each other: give one of the two");
    LensDefaults impossible;
    impossible.f_stop = -1;
    refused({.focus = 2}, impossible, "the camera: \"f_stop\" is -1; it must be a number above 0, or inf");
    refused({.focus = 0.04, .f_stop = 2, .focal_length_mm = 50}, none,
            "focus: 0.04 is 40 mm, within the focal length of 50 mm; focus farther away, or say with mm_per_unit how "
            "long a "
            "scene unit is");
}
