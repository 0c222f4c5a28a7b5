#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

/// Depth as filters leave it: distances in, distances out, by plain loops in double.
namespace fathom::test {

using Distances = std::vector<float>;

/// At a pixel, or at the nearest one within the image.
inline double at(const Distances& z, int width, int height, int x, int y) {
    return static_cast<double>(
        z[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
          static_cast<std::size_t>(std::clamp(x, 0, width - 1))]);
}

/// 1/z, blurred by a normal distribution.
inline Distances blurred(const Distances& z, int width, int height, double sigma) {
    const int reach = static_cast<int>(std::ceil(4 * sigma));
    std::vector<double> weights;
    double all = 0;
    for (int i = -reach; i <= reach; ++i)
        all += weights.emplace_back(std::exp(-i * i / (2 * sigma * sigma)));
    const auto along = [&](const std::vector<double>& from, int dx, int dy) {
        std::vector<double> made;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                double sum = 0;
                for (int i = -reach; i <= reach; ++i)
                    sum += weights[static_cast<std::size_t>(i + reach)] *
                           from[static_cast<std::size_t>(std::clamp(y + i * dy, 0, height - 1)) *
                                    static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(std::clamp(x + i * dx, 0, width - 1))];
                made.push_back(sum / all);
            }
        return made;
    };
    std::vector<double> inverse;
    for (const float value : z)
        inverse.push_back(1 / static_cast<double>(value));
    inverse = along(along(inverse, 1, 0), 0, 1);
    Distances made;
    for (const double value : inverse)
        made.push_back(static_cast<float>(1 / value));
    return made;
}

/// Means of z over size x size pixels, as renderers average.
inline Distances averaged(const Distances& z, int width, int height, int size) {
    Distances made;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double sum = 0;
            for (int j = 0; j < size; ++j)
                for (int i = 0; i < size; ++i)
                    sum += at(z, width, height, x + i - size / 2, y + j - size / 2);
            made.push_back(static_cast<float>(sum / (size * size)));
        }
    return made;
}

/// Means of 1/z over so many pixels each way, of which bilinear interpolation makes the image again.
inline Distances enlarged(const Distances& z, int width, int height, int times) {
    const int across = width / times, down = height / times;
    std::vector<double> small;
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            double sum = 0;
            for (int j = 0; j < times; ++j)
                for (int i = 0; i < times; ++i)
                    sum += 1 / at(z, width, height, times * x + i, times * y + j);
            small.push_back(sum / (times * times));
        }
    const auto of = [&](int x, int y) {
        return small[static_cast<std::size_t>(std::clamp(y, 0, down - 1)) * static_cast<std::size_t>(across) +
                     static_cast<std::size_t>(std::clamp(x, 0, across - 1))];
    };
    Distances made;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double u = (x + 0.5) / times - 0.5, v = (y + 0.5) / times - 0.5;
            const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
            const double a = u - left, b = v - top;
            made.push_back(static_cast<float>(1 / ((1 - b) * ((1 - a) * of(left, top) + a * of(left + 1, top)) +
                                                   b * ((1 - a) * of(left, top + 1) + a * of(left + 1, top + 1)))));
        }
    return made;
}

struct Softening {
    const char* name;
    std::function<Distances(const Distances&, int width, int height)> soften;
};

inline const std::array<Softening, 6> softenings{
    {{"1/z blurred by 1.5 pixels", [](const Distances& z, int w, int h) { return blurred(z, w, h, 1.5); }},
     {"1/z blurred by 3 pixels", [](const Distances& z, int w, int h) { return blurred(z, w, h, 3); }},
     {"z averaged over 2 x 2 pixels", [](const Distances& z, int w, int h) { return averaged(z, w, h, 2); }},
     {"z averaged over 4 x 4 pixels", [](const Distances& z, int w, int h) { return averaged(z, w, h, 4); }},
     {"enlarged from a half", [](const Distances& z, int w, int h) { return enlarged(z, w, h, 2); }},
     {"enlarged from a quarter", [](const Distances& z, int w, int h) { return enlarged(z, w, h, 4); }}}};

} // namespace fathom::test
