// A projection matrix and a stored depth image in, distances out.

#include <fathom/opencv.hpp>
#include <iostream>

int main() {
    const Eigen::Matrix4d projection{{1.5, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, -1.002, -0.2002}, {0, 0, -1, 0}};
    const cv::Mat stored(720, 960, CV_32F, cv::Scalar(0.99));

    fathom::Camera camera;
    camera.projection = fathom::from_matrix(projection);
    camera.width = stored.cols;
    camera.height = stored.rows;

    cv::Mat depth;
    fathom::linearize(fathom::Device::open(), stored, camera, depth);
    std::cout << "stored 0.99 is " << depth.at<float>(360, 480) << " in front of the camera\n";
}
