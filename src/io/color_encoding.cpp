// sRGB and alpha. IEC 61966-2-1: a line up to 0.04045, and a power of 2.4 from there.
#include "formats.hpp"

#include "camera/photograph.hpp"
#include "description/check.hpp"
#include "description/lens.hpp"

#include <opencv2/core.hpp>

#include <cmath>

namespace fathom {
namespace {

/// Applies a function to each pixel, rows in parallel.
template <typename Function>
void for_each_pixel(cv::Mat& color, const Function& function) {
    const int channels = color.channels();
    cv::parallel_for_(cv::Range(0, color.rows), [&](const cv::Range& rows) {
        for (int y = rows.start; y < rows.end; ++y) {
            auto* pixel = color.ptr<float>(y);
            for (int x = 0; x < color.cols; ++x, pixel += channels)
                function(pixel);
        }
    });
}

} // namespace

const char* to_string(ColorEncoding encoding) {
    return encoding == ColorEncoding::linear ? "linear" : "sRGB";
}

void restore_highlights(Picture& picture, double highlights) {
    description::Check{}("highlights", highlights, description::highlights);
    if (picture.format.bits == 32 || highlights == 1) // floats go beyond white
        return;
    for_each_pixel(picture.color, [&, channels = picture.color.channels()](float* pixel) {
        restore_highlights_of(pixel, 1, channels, highlights);
    });
}

namespace io {
namespace {

float light_of(float code) {
    const double c = std::abs(static_cast<double>(code));
    const double light = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    return static_cast<float>(std::copysign(light, static_cast<double>(code)));
}

float code_of(float light) {
    const double l = std::abs(static_cast<double>(light));
    const double code = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
    return static_cast<float>(std::copysign(code, static_cast<double>(light)));
}

template <float (*of)(float)>
void convert(cv::Mat& color) {
    for_each_pixel(color, [](float* pixel) {
        for (int c = 0; c < 3; ++c)
            pixel[c] = of(pixel[c]);
    });
}

} // namespace

void to_linear(cv::Mat& color, ColorEncoding encoding) {
    if (encoding == ColorEncoding::srgb)
        convert<light_of>(color);
}

void from_linear(cv::Mat& color, ColorEncoding encoding) {
    if (encoding == ColorEncoding::srgb)
        convert<code_of>(color);
}

void premultiply(cv::Mat& color) {
    if (color.channels() == 4)
        for_each_pixel(color, [](float* pixel) {
            for (int c = 0; c < 3; ++c)
                pixel[c] *= pixel[3];
        });
}

void unpremultiply(cv::Mat& color) {
    if (color.channels() == 4)
        for_each_pixel(color, [](float* pixel) {
            for (int c = 0; c < 3; ++c)
                pixel[c] = pixel[3] > 0 ? pixel[c] / pixel[3] : 0.0f;
        });
}

} // namespace io
} // namespace fathom
