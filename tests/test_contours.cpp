// Contour lines against their definition in double.

#include "catch.hpp"
#include "images.hpp"

#include <fathom/contours.hpp>
#include <fathom/opencv.hpp>

using namespace fathom;

TEST_CASE("contours: a depth lies where its fraction of a step says", "[contours]") {
    constexpr int width = 64, height = 16;
    constexpr double step = 0.3;
    std::vector<float> depth(width * height);
    for (std::size_t i = 0; i < depth.size(); ++i)
        depth[i] = 0.5f + 0.01f * static_cast<float>(i);
    depth.front() = std::nanf("");
    const Camera camera{
        .projection = perspective(1, 4, {0.1, 100}), .width = width, .height = height, .encoding = Encoding::view_z};
    const Device device = Device::open("cpu");
    const StoredDepth stored{Image::from_host(device, Element::f32, depth.data(), {width, height}), camera};
    const auto got = images::floats(contours(stored, {.step = step}));
    double worst = 0;
    for (std::size_t i = 1; i < depth.size(); ++i) {
        const double t = static_cast<double>(depth[i]) / step, off = std::abs(got[i] - (t - std::floor(t)));
        worst = std::max(worst, std::min(off, 1 - off) / t); // 1 is the next line's 0
    }
    std::printf("contours: worst error %.3g of the number of steps\n", worst);
    CHECK(worst <= contours_error);
    CHECK(std::isnan(got.front()));
    CHECK_THROWS_AS(contours(stored, {.step = 0}), std::invalid_argument);

    cv::Mat result;
    contours(device, cv::Mat(height, width, CV_32FC1, depth.data()), camera, result, {.step = step});
    CHECK(images::same_bits(std::vector<float>(result.begin<float>(), result.end<float>()), got));
}
