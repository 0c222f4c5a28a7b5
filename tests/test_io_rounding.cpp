// A thread whose rounding mode is another one is refused, before it changes a bit.
#include "io_files.hpp"
#include "matrices.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/io.hpp>
#include <fathom/lens.hpp>
#include <fathom/opencv.hpp>
#include <fathom/presets.hpp>

#include <cfenv>

using namespace fathom;
using namespace fathom::test;

TEST_CASE(
    "rounding: a thread that does not round to nearest is refused in one line, and computes the same bits afterwards",
    "[io]") {
    const TempFolder folder;
    cv::Mat stored(20, 30, CV_32FC1);
    cv::randu(stored, 0.1f, 0.9f);
    const auto file = folder / "a.exr";
    write_image(file, stored);
    Camera camera;
    camera.projection = perspective(1, 1.5, {0.3, 70});
    camera.width = stored.cols;
    camera.height = stored.rows;
    const Camera through_lens = [&] {
        Camera bent = camera;
        bent.encoding = Encoding::view_z;
        bent.lens = LensModel{LensLaw::brown, 30, 30, 15, 10, {0.01, 0, 0, 0}};
        return bent;
    }();
    const Device device = Device::open();
    cv::Mat before, after;
    linearize(device, stored, camera, before);
    const std::pair<const char*, std::function<void()>> uses[] = {
        {"opening", [] { Device::open(); }},
        {"listing", [] { list_devices(); }},
        {"computing", [&] { linearize(device, stored, camera, after); }},
        {"computing through a lens", [&] { linearize(device, stored, through_lens, after); }},
        {"a projection",
         [] {
             perspective(1, 1.5, {0.3, 70});
         }},
        {"a lens", [&] { pixel_scale(through_lens); }},
        {"a camera's depth", [&] { view_depth(camera, Storage::float32, 3, 4, 0.5); }},
        {"a preset", [] { preset_camera("carla:fov_x_deg=90", 30, 20); }},
        {"reading", [&] { read_depth(file); }},
        {"writing", [&] { write_image(folder / "b.exr", stored); }},
    };
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO})
        for (const auto& [what, use] : uses) {
            std::fesetround(mode);
            const std::string said = refusal(use);
            std::fesetround(FE_TONEAREST);
            INFO(what);
            check_says(said, {"does not round floating-point numbers to the nearest"});
        }
    CHECK(!fs::exists(folder / "b.exr"));
    linearize(device, stored, camera, after);
    CHECK(same(before, after));
}
