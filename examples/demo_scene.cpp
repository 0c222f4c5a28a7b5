// The depth buffer that a renderer would leave of one of the analytic scenes, for a camera file.

#include "scene/scene.hpp"

#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>

#include <exception>
#include <iostream>
#include <string>

int main(int argc, char* argv[]) {
    if (argc != 4) {
        std::cerr << "usage: demo_scene SCENE CAMERA.json DEPTH.png|.tif|.exr\n       16 bits in a .png, 32-bit floats "
                     "otherwise\n";
        return 2;
    }
    try {
        const fathom::Camera camera = fathom::read_camera(argv[2]).camera;
        auto image = fathom::scene::render(fathom::scene::named(argv[1]), camera);
        const cv::Mat stored(image.height, image.width, CV_32FC1, image.stored.data());
        fathom::write_image(argv[3], stored, {.channels = {"Z"}, .png_scale = 1.0});
    } catch (const std::exception& error) {
        std::cerr << "demo_scene: " << error.what() << '\n';
        return 1;
    }
}
