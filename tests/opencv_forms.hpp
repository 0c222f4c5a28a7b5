#pragma once

#include "matrices.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <array>
#include <cstring>
#include <functional>
#include <vector>

/// Every operation on OpenCV's matrices, with what it has to give.
namespace fathom::opencv_forms {

using test::same;

inline Camera camera() {
    return {.projection = perspective(1.0, 1.5, {0.5, 100}), .width = 30, .height = 20};
}

inline constexpr CircleOfConfusion lens{6, 12};

inline FogOptions fog_of(std::array<double, 3> color) {
    return {.density = 0.3, .fog_color = color};
}

inline cv::Mat depths() {
    cv::Mat stored(20, 30, CV_32FC1);
    cv::randu(stored, 0.5f, 0.95f);
    return stored;
}

inline cv::Mat picture() {
    cv::Mat color(20, 30, CV_8UC3);
    cv::randu(color, 0, 256);
    return color;
}

/// A part of a larger matrix: rows that do not follow each other.
struct Part {
    cv::Mat around, within;

    explicit Part(const cv::Mat& content) : around(content.rows + 9, content.cols + 13, content.type()) {
        cv::randu(around.reshape(1), 1, 2);
        within = around(cv::Rect(5, 3, content.cols, content.rows));
        content.copyTo(within);
    }
    /// Is all but the part as it was?
    bool same_around(const cv::Mat& before) const {
        cv::Mat now = around.clone(), then = before.clone();
        for (cv::Mat* each : {&now, &then})
            (*each)(cv::Rect(5, 3, within.cols, within.rows)).setTo(0);
        return same(now, then);
    }
};

/// An operation on matrices and what it has to give.
struct Given {
    const char* name;
    cv::Mat expected;
    std::function<void(cv::InputArray stored, cv::InputArray color, cv::OutputArray result)> run;
};

/// The operations on one device; what they have to give is computed from images on another.
inline std::vector<Given> forms(const Device& device, const Device& truth, const cv::Mat& stored,
                                const cv::Mat& color) {
    const StoredDepth depth{to_device(truth, stored), camera()};
    using In = cv::InputArray;
    using Out = cv::OutputArray;
    const Camera seen = camera();
    const DofMasks masks =
        dof_masks(depth, lens, {.focus_weight = true, .mixed_pixels = true, .tile_px = 7, .tile_max_coc = true});
    const Occlusion occlusion = ssao(depth, 0.5, {.bent_normal = true, .confidence = true});
    return {
        {"linearize", to_mat(linearize(depth).image), [=](In s, In, Out r) { linearize(device, s, seen, r); }},
        {"unproject", to_mat(unproject(depth)), [=](In s, In, Out r) { unproject(device, s, seen, r); }},
        {"unproject, 4 channels", to_mat(unproject(depth, {.channels = 4})),
         [=](In s, In, Out r) { unproject(device, s, seen, r, {.channels = 4}); }},
        {"normals", to_mat(normals(depth)), [=](In s, In, Out r) { normals(device, s, seen, r); }},
        {"ssao", to_mat(occlusion.visibility), [=](In s, In, Out r) { ssao(device, s, seen, 0.5, r); }},
        {"bent normals", to_mat(occlusion.bent_normal),
         [=](In s, In, Out r) { ssao(device, s, seen, 0.5, {.bent_normal = r}, {.bent_normal = true}); }},
        {"confidence", to_mat(occlusion.confidence),
         [=](In s, In, Out r) { ssao(device, s, seen, 0.5, {.confidence = r}, {.confidence = true}); }},
        {"coc", to_mat(masks.coc), [=](In s, In, Out r) { dof_masks(device, s, seen, lens, {.coc = r}); }},
        {"focus weight", to_mat(masks.focus_weight),
         [=](In s, In, Out r) { dof_masks(device, s, seen, lens, {.focus_weight = r}, {.focus_weight = true}); }},
        {"mixed pixels", to_mat(masks.mixed_pixels),
         [=](In s, In, Out r) { dof_masks(device, s, seen, lens, {.mixed_pixels = r}, {.mixed_pixels = true}); }},
        {"tiles", to_mat(masks.tile_max_coc),
         [=](In s, In, Out r) {
             dof_masks(device, s, seen, lens, {.tile_max_coc = r}, {.tile_px = 7, .tile_max_coc = true});
         }},
        {"dof", to_mat(dof(depth, to_device(truth, color), lens)),
         [=](In s, In c, Out r) { dof(device, s, seen, c, lens, r); }},
        {"fog", to_mat(fog(depth, to_device(truth, color), fog_of({0.2, 0.5, 1}))),
         [=](In s, In c, Out r) {
             fog(device, s, seen, c, r, fog_of({0.2, 0.5, 1}));
         }},
    };
}

} // namespace fathom::opencv_forms
