// Frames that are larger than their results. Means are sums in double, in which 16 floats leave no rounding that a float would show.
#include <fathom/supersampled.hpp>

#include "camera/photograph.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <type_traits>
#include <vector>

namespace fathom {
namespace {

void check_factor(int factor) {
    require(factor >= 1 && factor <= most_supersampled, "supersampled = ", factor, " must be 1 to ", most_supersampled);
}

template <typename T>
void average(const Image& large, const Image& small, bool directions) {
    using Sum = Eigen::Array4d;
    const auto width = static_cast<std::size_t>(small.width()), height = static_cast<std::size_t>(small.height()),
               channels = static_cast<std::size_t>(small.channels()),
               factor = static_cast<std::size_t>(large.width()) / width, row = width * factor * channels;
    const std::vector<T> pixels = runtime::on_host<T>(large);
    std::vector<T> made(width * height * channels);
    const auto mean_at = [&](std::size_t x, std::size_t y) -> Sum {
        Sum sum = Sum::Zero(), count = Sum::Zero();
        for (std::size_t j = y * factor; j < (y + 1) * factor; ++j)
            for (std::size_t i = x * factor; i < (x + 1) * factor; ++i)
                for (std::size_t c = 0; c < channels; ++c)
                    if (const double v = static_cast<float>(pixels[j * row + i * channels + c]); !std::isnan(v)) {
                        sum[static_cast<Eigen::Index>(c)] += v;
                        count[static_cast<Eigen::Index>(c)] += 1;
                    }
        if (!directions || !(count > 0).any())
            return sum / count;
        const double length = sum.matrix().norm();
        return length > 0 ? Sum(sum / length) : Sum::Zero();
    };
    in_threads(small.height(), [&](int begin, int end) {
        T* target = &made[static_cast<std::size_t>(begin) * width * channels];
        for (auto y = static_cast<std::size_t>(begin); y < static_cast<std::size_t>(end); ++y)
            for (std::size_t x = 0; x < width; ++x) {
                const Sum mean = mean_at(x, y);
                for (std::size_t c = 0; c < channels; ++c, ++target)
                    if constexpr (std::is_integral_v<T>)
                        *target = static_cast<T>(std::lround(mean[static_cast<Eigen::Index>(c)]));
                    else
                        *target = static_cast<T>(static_cast<float>(mean[static_cast<Eigen::Index>(c)]));
            }
    });
    runtime::copy_from_host(made.data(), small);
}

} // namespace

Camera supersampled(const Camera& camera, int factor) {
    check_factor(factor);
    Camera large = camera;
    large.width *= factor;
    large.height *= factor;
    for (auto* lens : {&large.lens, &large.raw_lens})
        if (*lens && factor > 1) {
            require(!(*lens)->map, "the camera's lens is a map of rays, one for each pixel of its own image; give the "
                                   "map of the large image");
            for (double LensModel::*length : {&LensModel::fx, &LensModel::fy, &LensModel::cx, &LensModel::cy})
                (*lens).value().*length *= factor;
        }
    return large;
}

LensArguments supersampled(LensArguments lens, int factor) {
    check_factor(factor);
    const auto to_middle = [factor](LensArguments::Pixel& pixel) {
        constexpr int most = std::numeric_limits<int>::max() / most_supersampled - 1;
        require(std::max(std::abs(pixel.x), std::abs(pixel.y)) <= most, "pixel (", pixel.x, ", ", pixel.y,
                ") lies outside every image");
        pixel = {pixel.x * factor + factor / 2, pixel.y * factor + factor / 2};
    };
    if (lens.focus_at)
        to_middle(*lens.focus_at);
    if (lens.focus_along)
        to_middle(lens.focus_along->pixel);
    if (lens.circle)
        for (double& number : *lens.circle)
            number *= factor;
    if (lens.blur_px)
        *lens.blur_px *= factor;
    return lens;
}

void average_squares(const Image& large, const Image& small, bool directions) {
    require(large && small && large.element() == small.element() && large.channels() == small.channels() &&
                large.channels() <= 4,
            "both images must have the same type of elements and number of channels, 4 at most");
    require(large.width() % small.width() == 0 && large.height() % small.height() == 0 &&
                large.width() / small.width() == large.height() / small.height(),
            "the large image is ", large.width(), " x ", large.height(), " pixels, the small one ", small.width(),
            " x ", small.height(), "; it must be a whole number of times as large, the same each way");
    require(!directions || large.channels() == 3, "directions have 3 channels, and the image has ", large.channels());
    switch (large.element()) {
    case Element::f32:
        return average<float>(large, small, directions);
    case Element::f16:
        return average<Eigen::half>(large, small, directions);
    case Element::u8:
        return average<std::uint8_t>(large, small, directions);
    case Element::u16:
        return average<std::uint16_t>(large, small, directions);
    case Element::u32:
        break;
    }
    require(false, "images of 32-bit integers hold no numbers to average");
}

} // namespace fathom
