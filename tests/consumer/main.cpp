#include <fathom/camera_file.hpp>
#include <fathom/fathom.hpp>
#ifdef WITH_IO
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>
#endif

#include <fstream>
#include <iostream>

int main() {
    std::ofstream("consumer-camera.json")
        << R"({"orthographic": {"left": -1, "right": 1, "bottom": -1, "top": 1, "near": 2, "far": 6}})";
    const fathom::Camera camera = fathom::camera_for(fathom::read_camera("consumer-camera.json"), 1, 1);
    const auto device = fathom::Device::open();
#ifdef WITH_IO
    cv::Mat depth;
    fathom::linearize(device, cv::Mat(1, 1, CV_32F, cv::Scalar(0.5)), camera, depth);
    const float z = depth.at<float>(0, 0);
#else
    const float stored = 0.5f;
    float z = 0;
    const auto image = fathom::Image::from_host(device, fathom::Element::f32, &stored, {1, 1});
    fathom::linearize({image, camera}).image.download(&z);
#endif
    std::cout << "half way between 2 and 6 is " << z << '\n';
    return z == 4 ? 0 : 1;
}
