#pragma once

#include <fathom/camera.hpp>

#include <string>
#include <vector>

/// Cameras with a lens of every law, for tests: from 60 degrees to a whole panorama, with folds inside the image and without.
struct LensSubject {
    std::string name;
    fathom::Camera camera;
};

inline std::vector<LensSubject> lens_subjects() {
    using namespace fathom;
    using enum LensLaw;
    constexpr double pi = 3.14159265358979323846;
    const auto camera = [](LensModel lens, int width, int height) { // of half that size
        for (double* const each : {&lens.fx, &lens.fy, &lens.cx, &lens.cy})
            *each /= 2;
        Camera result;
        result.width = width / 2;
        result.height = height / 2;
        result.encoding = Encoding::ray_distance;
        result.projection = perspective(1, 1, {1, 2}, {.view_axes = ViewAxes::opencv});
        result.lens = lens;
        return result;
    };
    std::vector<LensSubject> all{
        {"Azure Kinect",
         camera({brown, 504.9, 504.8, 326.2, 334, {5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1}}, 640, 576)},
        {"brown, k1 = -0.35", camera({brown, 605, 605, 480, 270, {-0.35, 0.13, 0, 0, 0.01}}, 960, 540)},
        {"brown with a fold in the image",
         camera({brown, 500, 500, 480, 270, {-0.3, 0.1, 1e-3, -5e-4, -0.02}}, 960, 540)},
        {"brown with a thin prism",
         camera({brown, 500, 505, 480, 270, {-0.1, 0.02, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 2e-4, -1e-3, 1e-4}}, 960, 540)},
        {"equidistant", camera({equidistant, 250, 250, 480, 270}, 960, 540)},
        {"equisolid", camera({equisolid, 362, 362, 512, 512}, 1024, 1024)},
        {"stereographic", camera({stereographic, 200, 200, 480, 270}, 960, 540)},
        {"OpenCV's fisheye", camera({opencv_fisheye, 310, 312, 512, 510, {0.05, -0.01, 0.002, -3e-4}}, 1024, 1024)},
        {"OpenCV's fisheye with a fold in the image",
         camera({opencv_fisheye, 310, 312, 512, 510, {0.05, -0.03, 0, 0}}, 1024, 1024)},
        {"double sphere", camera({double_sphere, 350, 350, 512, 512, {-0.2, 0.6}}, 1024, 1024)},
        {"Blender's polynomial",
         camera({blender_polynomial, 26.7, 26.7, 480, 270, {0, -0.0919, -0.0019, -0.00017, 0}}, 960, 540)},
        {"panorama", camera({equirectangular, 1024 / (2 * pi), 512 / pi, 512, 256}, 1024, 512)},
        {"part of a panorama", camera({equirectangular, 400, 420, -100, 500}, 700, 300)},
    };
    const auto again = [&](std::size_t i, const std::string& how) {
        all.push_back({all[i].name + how, all[i].camera});
        return &all.back().camera;
    };
    again(0, ", opengl")->projection.convention.view_axes = ViewAxes::opengl;
    again(3, ", directx")->projection.convention.view_axes = ViewAxes::directx;
    again(7, ", rows bottom up")->rows = Rows::bottom_up;
    again(11, ", opengl")->projection.convention.view_axes = ViewAxes::opengl;
    return all;
}
