// cv::Mat in and out: the library's own results, without a copy on a CPU.
#include "catch.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <cstring>

using namespace fathom;

namespace {

Camera camera() {
    Camera camera;
    camera.projection = perspective(1.0, 1.5, {0.5, 100});
    camera.width = 30;
    camera.height = 20;
    return camera;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
    return a.type() == b.type() && a.size() == b.size() && a.isContinuous() && b.isContinuous() &&
           std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

} // namespace

TEST_CASE("opencv: a matrix's type says how depth is stored", "[opencv]") {
    CHECK(storage_of(cv::Mat(1, 1, CV_32FC1)) == Storage::float32);
    CHECK(storage_of(cv::Mat(1, 1, CV_16FC1)) == Storage::float16);
    CHECK(storage_of(cv::Mat(1, 1, CV_16UC1)) == Storage::uint16);
    CHECK(storage_of(cv::Mat(1, 1, CV_32SC1)) == Storage::uint24);
    CHECK(storage_of(cv::Mat(1, 1, CV_8UC3)) == Storage::rgb8_red_low);
    for (const int type : {CV_8UC1, CV_64FC1, CV_32FC3, CV_16SC1})
        CHECK_THROWS_AS(storage_of(cv::Mat(1, 1, type)), std::invalid_argument);
}

TEST_CASE("opencv: a matrix goes to the device and comes back, whatever its type", "[opencv]") {
    const auto device = Device::open("cpu");
    for (const int type : {CV_8UC3, CV_16UC1, CV_32SC1, CV_16FC1, CV_32FC1, CV_32FC3, CV_32FC4}) {
        cv::Mat mat(20, 30, type);
        cv::randu(mat.reshape(1), 0, 100);
        const auto part = mat(cv::Rect(3, 5, 17, 9));
        CHECK(same(to_mat(to_device(device, mat)), mat));
        CHECK(same(to_mat(to_device(device, part)), part.clone()));
    }
    CHECK_THROWS_AS(to_device(device, cv::Mat()), std::invalid_argument);
    CHECK_THROWS_AS(to_device(device, cv::Mat(2, 2, CV_64FC1)), std::invalid_argument);
}

TEST_CASE("opencv: on a CPU the device sees the matrix itself", "[opencv]") {
    const auto device = Device::open("cpu");
    cv::Mat mat(20, 32, CV_32FC1, cv::Scalar(1));
    const auto image = to_device(device, mat);
    mat.at<float>(3, 4) = 5;
    CHECK(to_mat(image).at<float>(3, 4) == 5);
}

TEST_CASE("opencv: linearize and unproject give what the images of the library give", "[opencv]") {
    const auto device = Device::open("cpu");
    cv::Mat stored(20, 30, CV_32FC1);
    cv::randu(stored, 0.1f, 1.0f);
    const StoredDepth depth{to_device(device, stored), camera()};
    CHECK(same(linearize(device, stored, camera()), to_mat(linearize(depth).image)));
    for (const int channels : {3, 4}) {
        const UnprojectOptions options{.channels = channels};
        CHECK(unproject(device, stored, camera(), options).type() == CV_32FC(channels));
        CHECK(same(unproject(device, stored, camera(), options), to_mat(unproject(depth, options))));
    }
    CHECK_THROWS_AS(unproject(device, stored, camera(), {.channels = 2}), std::invalid_argument);
    auto unsized = camera();
    unsized.width = unsized.height = 0; // taken from the matrix
    CHECK(same(linearize(device, stored, unsized), to_mat(linearize(depth).image)));
    CHECK_THROWS_AS(linearize(device, stored(cv::Rect(0, 0, 7, 7)), camera()), std::invalid_argument);
}
