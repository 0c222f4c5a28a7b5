// Ambient occlusion between two steps of OpenCV, in the memory of OpenCV's own device.

#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>
#include <opencv2/core/ocl.hpp>

#include <iostream>

int main() {
    // A wall 5 m away, with a cupboard before its left half; the rows from the bottom up, as OpenGL has them.
    cv::Mat metres(480, 640, CV_32F, cv::Scalar(5));
    metres(cv::Rect(0, 0, 320, 240)).setTo(4.5);

    fathom::Camera camera;
    camera.projection = fathom::perspective(1.0, 640.0 / 480, {.near_plane = 0.1, .far_plane = 100});
    camera.encoding = fathom::Encoding::view_z;

    const fathom::Device device = fathom::opencv_device();
    cv::UMat bottom_up, depth, visibility, shaded;
    metres.copyTo(bottom_up);
    const cv::UMat grey(metres.size(), CV_32F, cv::Scalar(0.8));

    cv::flip(bottom_up, depth, 0);
    fathom::ssao(device, depth, camera, 0.5, visibility);
    cv::multiply(grey, visibility, shaded);

    const cv::Mat result = shaded.getMat(cv::ACCESS_READ); // the first line that waits
    std::cout << device.info().name << (cv::ocl::useOpenCL() ? ", in OpenCV's own buffers" : ", through the host")
              << ": a grey of 0.8 is " << result.at<float>(400, 322) << " beside the cupboard and "
              << result.at<float>(100, 500) << " in the open\n";
}
