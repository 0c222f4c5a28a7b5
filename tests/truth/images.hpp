#pragma once

#include <fathom/linearize.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

/// Small images through the device, and how two of them differ.
namespace fathom::images {

/// All channels of all pixels.
inline std::vector<float> floats(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                              static_cast<std::size_t>(image.channels()));
    image.download(values.data());
    return values;
}

/// On a CPU device the values themselves: they have to stay.
template <typename Value>
StoredDepth stored_of(const Device& device, const std::vector<Value>& values, const Camera& camera,
                      Storage storage = Storage::float32) {
    return {Image::from_host(device, element_of(storage), values.data(),
                             {camera.width, camera.height, channels_of(storage)}),
            camera, storage};
}

inline bool same_bits(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

inline bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) { return same_bits(x, y); });
}

struct Difference {
    double worst = 0, mean = 0, bias = 0, rmse = 0;
    long pixels = 0;       ///< that differ at all
    bool same_kind = true; ///< NaN in the same places

    void print(const char* what) const {
        std::printf("  %-60s mean %.1e, worst %.1e, bias %+.1e\n", what, mean, worst, bias);
    }
};

inline Difference difference(const std::vector<float>& a, const std::vector<float>& b) {
    Difference d;
    double count = 0;
    d.same_kind = a.size() == b.size();
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        d.same_kind &= std::isnan(a[i]) == std::isnan(b[i]);
        if (std::isnan(a[i]) || std::isnan(b[i]))
            continue;
        const double off = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        d.worst = std::max(d.worst, std::abs(off));
        d.mean += std::abs(off);
        d.bias += off;
        d.rmse += off * off;
        d.pixels += a[i] != b[i];
        ++count;
    }
    d.mean /= count;
    d.bias /= count;
    d.rmse = std::sqrt(d.rmse / count);
    return d;
}

/// Pixels that are darker than the median of the 5 × 5 around them by more than 0.1, as an eye sees specks.
inline int dark_specks(const std::vector<float>& image, int width, int height) {
    int specks = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::vector<float> around;
            for (int row = std::max(y - 2, 0); row <= std::min(y + 2, height - 1); ++row)
                for (int column = std::max(x - 2, 0); column <= std::min(x + 2, width - 1); ++column)
                    around.push_back(image[static_cast<std::size_t>(row * width + column)]);
            const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
            std::nth_element(around.begin(), middle, around.end());
            specks += image[static_cast<std::size_t>(y * width + x)] < *middle - 0.1f;
        }
    return specks;
}

} // namespace fathom::images
