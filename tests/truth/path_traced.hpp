#pragma once

#include <fathom/camera_file.hpp>
#include <fathom/io.hpp>
#include <fathom/lens.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <vector>

/// Blender's frame with what its path tracer makes of it, which no code of this project has made.
namespace oracle {

/// Red, green and blue of each pixel.
inline std::vector<float> path_traced_picture(const std::filesystem::path& file) {
    std::vector<float> values;
    for (std::size_t c = 0; c < 3; ++c) {
        const char* const names[] = {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"};
        cv::Mat channel;
        fathom::read_depth(file, {.channel = names[c]}).values.convertTo(channel, CV_32F);
        values.resize(3 * channel.total());
        std::size_t at = c;
        for (int y = 0; y < channel.rows; ++y)
            for (int x = 0; x < channel.cols; ++x, at += 3)
                values[at] = channel.at<float>(y, x);
    }
    return values;
}

/// A frame of a pinhole, and the same through a lens.
struct PathTraced {
    cv::Mat depth;
    std::vector<float> sharp, blurred;
    fathom::Camera camera;
    fathom::CircleOfConfusion circle;
};

inline PathTraced path_traced(const std::filesystem::path& folder) {
    const cv::Mat depth = fathom::read_depth(folder / "sharp.exr").values;
    const fathom::CameraFile file = fathom::read_camera(folder / "camera.json");
    const fathom::Camera camera = fathom::camera_for(file, depth.cols, depth.rows);
    return {depth, path_traced_picture(folder / "sharp.exr"), path_traced_picture(folder / "dof.exr"), camera,
            fathom::circle_of_confusion({.f_stop = file.lens.f_stop.value(),
                                         .focus = file.lens.focus.value(),
                                         .focal_length_mm = file.lens.focal_length_mm,
                                         .sensor_mm = file.lens.sensor_mm},
                                        camera)};
}

/// Pixels within 12 of two neighbours of which one is more than 5 % farther away.
inline std::vector<char> near_edges(const cv::Mat& depth) {
    constexpr int reach = 12;
    cv::Mat edges = cv::Mat::zeros(depth.size(), CV_8U);
    const auto mark = [&](int x, int y, int dx, int dy) {
        if (x + dx >= depth.cols || y + dy >= depth.rows)
            return;
        const float a = depth.at<float>(y, x), b = depth.at<float>(y + dy, x + dx);
        if (std::abs(a - b) > 0.05f * std::min(a, b))
            edges.at<uchar>(y, x) = edges.at<uchar>(y + dy, x + dx) = 1;
    };
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x) {
            mark(x, y, 1, 0);
            mark(x, y, 0, 1);
        }
    std::vector<char> near(depth.total());
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x)
            for (int dy = -reach; dy <= reach && edges.at<uchar>(y, x); ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    if (dx * dx + dy * dy <= reach * reach && y + dy >= 0 && y + dy < depth.rows && x + dx >= 0 &&
                        x + dx < depth.cols)
                        near[static_cast<std::size_t>((y + dy) * depth.cols + x + dx)] = 1;
    return near;
}

/// Differences of colours, cut off at 0 and 1, of all pixels or of `only` those.
inline std::vector<double> color_errors(const std::vector<float>& got, const std::vector<float>& truth,
                                        const std::vector<char>* only = nullptr) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < truth.size(); ++i)
        if (!only || (*only)[i / 3])
            errors.push_back(static_cast<double>(std::clamp(got[i], 0.0f, 1.0f)) -
                             static_cast<double>(std::clamp(truth[i], 0.0f, 1.0f)));
    return errors;
}

/// Of a frame of the folder `blender`, the path tracer's own ambient occlusion.
inline cv::Mat path_traced_visibility(const std::filesystem::path& folder) {
    return fathom::read_depth(folder / "sharp.exr", {.channel = "ViewLayer.AO.R"}).values;
}

} // namespace oracle
