// The depth buffer that a renderer would leave of one of the analytic scenes, for a camera file. On request also its
// linear picture: a checker pattern, lit from above, with small lamps at the corners of its squares.

#include "scene/scene.hpp"

#include <fathom/io.hpp>
#include <fathom/pixel_rays.hpp>

#include <opencv2/core/mat.hpp>

#include <Eigen/Core>
#include <Eigen/LU>

#include <cmath>
#include <exception>
#include <iostream>
#include <string>

namespace {

using fathom::scene::Rendered;

// B, G, R. `check`: side of a square. Lamps are much brighter than white, so that a lens draws them as discs.
cv::Vec3f color_at(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, double check) {
    const Eigen::Array3d place = position.array() / check;
    const Eigen::Array3d corner = (place / 2).round() * 2;
    if ((place - corner).matrix().norm() < 0.07)
        return {15, 30, 40};
    const auto odd = static_cast<long>((place + 1e-6).floor().sum()) & 1;
    const double light = 0.55 + 0.45 * normal.dot(Eigen::Vector3d(0.3, 0.8, 0.5).normalized());
    const Eigen::Array3d color = light * (odd ? 0.5 : 1) * (0.45 + 0.25 * normal.array());
    return {static_cast<float>(color[2]), static_cast<float>(color[1]), static_cast<float>(color[0])};
}

cv::Mat picture_of(const Rendered& image, const fathom::Camera& camera, double check) {
    const Eigen::Matrix4d world = fathom::scene::to_world(camera);
    cv::Mat picture(image.height, image.width, CV_32FC3, cv::Scalar(0.7, 0.45, 0.3)); // the sky's
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const auto i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
            if (!std::isfinite(image.z[i]))
                continue;
            const Eigen::Vector3d position =
                world.topLeftCorner<3, 3>() * image.position[i] + world.topRightCorner<3, 1>();
            picture.at<cv::Vec3f>(y, x) = color_at(position, world.topLeftCorner<3, 3>() * image.normal[i], check);
        }
    }
    return picture;
}

fathom::scene::RayOf ray_of(const fathom::Camera& camera) {
    return [rays = fathom::PixelRays(camera)](double x, double y) { return rays.ray_of(x, y); };
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc != 4 && argc != 6) {
        std::cerr
            << "usage: demo_scene SCENE CAMERA.json DEPTH.png|.tif|.exr [PICTURE.exr CHECK]\n       depth of 16 bits "
               "in a .png, 32-bit floats otherwise; a checker pattern of squares CHECK scene units wide\n";
        return 2;
    }
    try {
        const fathom::CameraFile file = fathom::read_camera(argv[2]);
        const fathom::Camera camera = fathom::camera_for(file, file.camera.width, file.camera.height);
        const fathom::scene::Scene scene = fathom::scene::named(argv[1]);
        auto image =
            camera.lens ? fathom::scene::render(scene, camera, ray_of(camera)) : fathom::scene::render(scene, camera);
        const cv::Mat stored(image.height, image.width, CV_32FC1, image.stored.data());
        fathom::write_image(argv[3], stored, {.channels = {"Z"}, .png_scale = 1.0});
        if (argc == 6)
            fathom::write_color(argv[4], picture_of(image, camera, std::stod(argv[5])));
    } catch (const std::exception& error) {
        std::cerr << "demo_scene: " << error.what() << '\n';
        return 1;
    }
}
