// Blender's multilayer EXR to world positions, compared with Blender's own Position pass where the file has one.

#include <fathom/fathom.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace {

/// Blender's positions (X, Y, Z of the view layer's Position pass), or nothing where the file has no such pass.
std::optional<std::array<cv::Mat, 3>> position_pass(const std::string& file) {
    try {
        std::array<cv::Mat, 3> axes;
        for (int axis = 0; axis < 3; ++axis) {
            const std::string channel = std::string("ViewLayer.Position.") + "XYZ"[axis];
            axes[static_cast<std::size_t>(axis)] = fathom::read_depth(file, {.channel = channel, .packing = {}}).values;
        }
        return axes;
    } catch (const fathom::Error&) {
        return std::nullopt;
    }
}

/// Distances between two sets of positions, relative to the distance from the camera centre, in ascending order.
std::vector<double> differences(const cv::Mat& ours, const std::array<cv::Mat, 3>& theirs,
                                const Eigen::Vector3d& centre) {
    std::vector<double> result;
    for (int y = 0; y < ours.rows; ++y) {
        for (int x = 0; x < ours.cols; ++x) {
            const auto& p = ours.at<cv::Vec3f>(y, x);
            const Eigen::Vector3d a(p[0], p[1], p[2]);
            const Eigen::Vector3d b(theirs[0].at<float>(y, x), theirs[1].at<float>(y, x), theirs[2].at<float>(y, x));
            if (a.allFinite()) {
                result.push_back((a - b).norm() / (a - centre).norm());
            }
        }
    }
    std::ranges::sort(result);
    return result;
}

void run(const std::string& exr, const std::string& camera_file, const std::string& output) {
    const fathom::DepthFile depth = fathom::read_depth(exr);
    const fathom::Camera camera =
        fathom::camera_for(fathom::read_camera(camera_file), depth.values.cols, depth.values.rows);
    const auto space = camera.view ? fathom::Space::world : fathom::Space::view;

    fathom::UnprojectOptions options;
    options.space = space;
    cv::Mat positions;
    fathom::unproject(fathom::Device::open(), depth.values, camera, positions, options);
    std::cout << exr << ": " << positions.cols << " x " << positions.rows << " positions from " << depth.channel
              << '\n';

    if (const auto theirs = position_pass(exr); theirs && camera.view) {
        const Eigen::Vector3d centre = camera.view->inverse().topRightCorner<3, 1>();
        // What is left at the worst pixels is Blender's own rounding on long thin triangles.
        if (const auto all = differences(positions, *theirs, centre); !all.empty()) {
            std::cout << "difference to Blender's Position pass, of the distance from the camera centre: "
                      << all[all.size() / 2] << " at half of the pixels, at most " << all.back() << '\n';
        }
    }
    if (!output.empty()) {
        fathom::write_image(output, positions, {.channels = {"P.X", "P.Y", "P.Z"}, .png_scale = {}});
        std::cout << "wrote " << output << '\n';
    }
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc < 3 || argc > 4) {
        std::cerr << "usage: blender_exr RENDER.exr CAMERA.json [POSITIONS.exr|.ply]\n";
        return 2;
    }
    try {
        run(argv[1], argv[2], argc == 4 ? argv[3] : "");
    } catch (const std::exception& error) {
        std::cerr << "blender_exr: " << error.what() << '\n';
        return 1;
    }
}
