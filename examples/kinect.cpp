// A Kinect's 16-bit PNG to points and normals in cv::Mat, and a foggy picture.

#include <fathom/camera_file.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/imgcodecs.hpp>

#include <cmath>
#include <iostream>

int main(int argc, char* argv[]) {
    if (argc != 2 && argc != 4) {
        std::cerr << "usage: kinect DEPTH.png [PICTURE.png FOGGY.png]\n";
        return 2;
    }
    const cv::Mat millimetres = cv::imread(argv[1], cv::IMREAD_UNCHANGED); // 0 where nothing was measured
    if (millimetres.type() != CV_16UC1) {
        std::cerr << "kinect: " << argv[1] << " is no image of 16-bit depth\n";
        return 1;
    }

    // Metres; x right, y down, z ahead.
    const fathom::Camera camera =
        fathom::preset_camera("kinect:fx=525,fy=525,cx=319.5,cy=239.5", millimetres.cols, millimetres.rows);

    const fathom::Device device = fathom::Device::open();
    cv::Mat points, normals; // CV_32FC3, NaN where nothing was measured
    fathom::unproject(device, millimetres, camera, points);
    fathom::normals(device, millimetres, camera, normals);
    const int x = points.cols / 2, y = points.rows / 2;
    std::cout << "the middle lies at " << points.at<cv::Vec3f>(y, x) << ", its normal is "
              << normals.at<cv::Vec3f>(y, x) << '\n';

    if (argc == 4) {
        const cv::Mat picture = cv::imread(argv[2]);
        cv::Mat foggy;
        fathom::fog(device, millimetres, camera, picture, foggy,
                    {.density = 0.3, .fog_color = {0.7, 0.6, 0.5}}); // B, G, R
        cv::imwrite(argv[3], foggy);
    }
}
