#pragma once

#include "program.hpp"
#include "scene/scene.hpp"

#include <fathom/opencv.hpp>

namespace fathom::test {

/// A camera's place in the world, for a camera file.
inline constexpr const char* view = R"(, "view": [[0,0,1,0],[0,1,0,0],[-1,0,0,5],[0,0,0,1]])";

/// A scene before the camera as the program and as the library see it, with a background pixel and an invalid one.
struct RenderedInput {
    Folder folder;
    std::string camera, input;
    StoredDepth stored;
    cv::Mat depth;

    RenderedInput(const scene::Scene& scene, const std::string& more) : camera(camera_file(folder, more)) {
        const Camera seen = camera_for(read_camera(camera), width, height);
        Camera still = seen; // the scene lies before the camera, wherever the world is
        still.view.reset();
        auto image = scene::render(scene, still);
        depth = cv::Mat(height, width, CV_32FC1, image.stored.data()).clone();
        depth.at<float>(0, 0) = 1;
        depth.at<float>(0, 1) = NAN;
        input = depth_file(folder, "frame.exr", depth);
        stored = {to_device(Device::open(), depth), seen};
    }
};

} // namespace fathom::test
