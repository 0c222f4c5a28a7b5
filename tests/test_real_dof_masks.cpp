// dof_masks on depth that others made: the circles of what OpenGL's rasteriser stored are those of the depths that it
// meant, as nearly as linearize finds these depths; and the lens of a renderer's camera file.

#include "real_inputs.hpp"

#include <fathom/fathom.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

using namespace fathom;
using namespace fathom::real;

namespace {

double ulp(double value) {
    const auto f = static_cast<float>(std::abs(value));
    return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity()) - f);
}

} // namespace

TEST_CASE("real inputs: circles from an OpenGL depth buffer are those of the depths that it meant",
          "[dof_masks][real]") {
    if (!there("opengl"))
        return;
    int buffers = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(data / "opengl")) {
        if (entry.path().extension() != ".json")
            continue;
        const std::string name = entry.path().stem().string();
        const DepthFile depth = opengl_depth(name);
        const cv::Mat truth = cv::imread((data / "opengl" / (name + ".z.tif")).string(), cv::IMREAD_UNCHANGED);
        REQUIRE(truth.type() == CV_32F);
        const Camera camera = camera_for(read_camera(entry.path()), depth.values.cols, depth.values.rows);
        const StoredDepth stored{to_device(Device::open("cpu"), depth.values), camera, depth.storage};
        const cv::Mat decoded = to_mat(linearize(stored).image);
        const bool perspective = depth_form(camera, depth.storage).perspective;
        const CircleOfConfusion circle{20, perspective ? 100.0 : 4.0,
                                       perspective ? camera_rays(camera).centre_depth : 0, !perspective};
        const cv::Mat found = to_mat(dof_masks(stored, circle).coc);
        double worst = 0, worst_px = 0;
        long surfaces = 0, sky = 0;
        INFO(name);
        for (int y = 0; y < truth.rows; ++y)
            for (int x = 0; x < truth.cols; ++x) {
                const auto c = static_cast<double>(found.at<float>(y, x));
                const double z = static_cast<double>(truth.at<float>(y, x)),
                             got = static_cast<double>(decoded.at<float>(y, x));
                if (std::isnan(z)) {
                    sky += c == (perspective ? 20 : HUGE_VAL);
                    REQUIRE(std::isinf(got) == (c == (perspective ? 20 : HUGE_VAL)));
                    continue;
                }
                ++surfaces;
                const auto of = [&](double depth_there) { return static_cast<double>(coc_at(circle, depth_there)); };
                const double meant = of(z), per_depth = perspective ? 100 / (std::min(z, got) * std::min(z, got)) : 4;
                const double bound =
                    per_depth * (std::abs(got - z) + 2 * ulp(z)) + coc_ulp * ulp(std::max(std::abs(meant), 20.0));
                worst = std::max(worst, std::abs(c - meant) / bound);
                worst_px = std::max(worst_px, std::abs(c - meant));
            }
        std::printf("%-16s %6ld surfaces, %6ld sky, circles off by at most %.2e px, %.3f of what depth is off by\n",
                    name.c_str(), surfaces, sky, worst_px, worst);
        CHECK(surfaces > 1000);
        CHECK(worst <= 1);
        ++buffers;
    }
    CHECK(buffers >= 19);
}

TEST_CASE("real inputs: the lens of Blender's camera files", "[dof_masks][real]") {
    if (!there("blender"))
        return;
    for (const std::string view : {"perspective", "orthographic"}) {
        const DepthFile depth = read_depth(data / "blender" / view / "sharp.exr");
        const CameraFile file = read_camera(data / "blender" / view / "camera.json");
        const Camera camera = camera_for(file, depth.values.cols, depth.values.rows);
        const StoredDepth stored{to_device(Device::open("cpu"), depth.values), camera, depth.storage};
        const double focus = *file.lens.focus, focal = *file.lens.focal_length_mm, width = *file.lens.sensor_mm;
        const Lens lens{.f_stop = *file.lens.f_stop, .focus = focus, .focal_length_mm = focal, .sensor_mm = width};
        const CircleOfConfusion circle = circle_of_confusion(lens, camera);
        const cv::Mat found = to_mat(dof_masks(stored, circle).coc);
        // Written from the lens equation, in millimetres; the orthographic view's pixels per unit are its projection's.
        const double aperture = focal / *file.lens.f_stop, pixels_per_mm = 480 / width;
        double worst = 0, least = 0, greatest = 0;
        for (int y = 0; y < found.rows; ++y)
            for (int x = 0; x < found.cols; ++x) {
                const double z = static_cast<double>(depth.values.at<float>(y, x)),
                             c = static_cast<double>(found.at<float>(y, x));
                if (!(z < 1e9))
                    continue;
                const double exact = view == "perspective"
                                         ? aperture * focal / (1000 * focus - focal) * (1 - focus / z) * pixels_per_mm
                                         : aperture / 1000 / focus * (z - focus) *
                                               camera.projection.matrix_in_opengl_axes().cast<double>()(0, 0) * 240;
                worst = std::max(worst, std::abs(c - exact));
                least = std::min(least, c);
                greatest = std::max(greatest, c);
            }
        std::printf("Blender's lens, %-12s circles from %.2f to %.2f px, off the lens equation by at most %.1e px\n",
                    view.c_str(), least, greatest, worst);
        CHECK(worst <= coc_ulp * ulp(std::max(-least, greatest)));
        CHECK(least < -5);
        CHECK(greatest > 2);
        // The projection knows the same lens: it differs by f/S, since a pinhole's image lies at f for every focus.
        if (view == "perspective") {
            const CircleOfConfusion derived =
                circle_of_confusion({.f_stop = *file.lens.f_stop, .focus = focus, .sensor_mm = width}, camera);
            CHECK(std::abs(static_cast<double>(derived.k / circle.k) - (1 - focal / 1000 / focus)) < 1e-6);
        }
    }
}
