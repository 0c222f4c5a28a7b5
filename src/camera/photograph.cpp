// A photograph's depth on its own grid, and the light that its highlights have lost.
//   z(p) = sum of w(q) z(q) / sum of w(q),  w = a tent over the distance of p and q times exp(-d^2 / (2 sigma^2))
// with d the difference of colour between the pixel and the part of the picture that is q's. Kopf, Cohen, Lischinski and
// Uyttendaele 2007, eq. 2; the picture is not upsampled here, so each q has a mean colour.

#include "camera/photograph.hpp"

#include "description/check.hpp"
#include "description/lens.hpp"
#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <system_error>
#include <thread>

namespace fathom {
std::array<float, 3> seen_color(const HostFloats& image, int x, int y) {
    const float* c = pixel_at(image, x, y);
    const auto root = [](float v) { return v > 0 ? std::sqrt(std::min(v, 4.0f)) : 0.0f; };
    return {root(c[0]), root(c[1]), root(c[2])};
}

EdgeUpsampling::EdgeUpsampling(const HostFloats& depth, const HostFloats& color)
    : depth_(depth), color_(color), across_(static_cast<double>(depth.width) / color.width),
      down_(static_cast<double>(depth.height) / color.height) {
    mean_.reserve(static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height));
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x) {
            const auto first = [](int at, double scale, int count) {
                return std::min(static_cast<int>(at / scale), count - 1);
            };
            const int x0 = first(x, across_, color.width), y0 = first(y, down_, color.height);
            const int x1 = std::max(x0 + 1, std::min(static_cast<int>((x + 1) / across_), color.width));
            const int y1 = std::max(y0 + 1, std::min(static_cast<int>((y + 1) / down_), color.height));
            Color sum{};
            for (int j = y0; j < y1; ++j)
                for (int i = x0; i < x1; ++i) {
                    const Color own = seen_color(color, i, j);
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += own[c];
                }
            const float share = 1.0f / static_cast<float>((x1 - x0) * (y1 - y0));
            mean_.push_back({sum[0] * share, sum[1] * share, sum[2] * share});
        }
}

// Calls `take(weight, value)` with the depths around a pixel of the picture.
template <typename Take>
void EdgeUpsampling::around(int x, int y, const Take& take) const {
    constexpr float sigma = 0.08f, least = 1e-4f; // of colours from 0 to 1; what another colour counts all the same
    constexpr int reach = 2;                      // pixels of the depth image
    const double fx = (x + 0.5) * across_ - 0.5, fy = (y + 0.5) * down_ - 0.5;
    const int left = static_cast<int>(std::floor(fx)), top = static_cast<int>(std::floor(fy));
    const Color own = seen_color(color_, x, y);
    for (int j = top - reach + 1; j <= top + reach; ++j)
        for (int i = left - reach + 1; i <= left + reach; ++i) {
            const int u = std::clamp(i, 0, depth_.width - 1), v = std::clamp(j, 0, depth_.height - 1);
            const Color& mean = mean_[static_cast<std::size_t>(v) * static_cast<std::size_t>(depth_.width) +
                                      static_cast<std::size_t>(u)];
            const auto square = [&](std::size_t c) { return (mean[c] - own[c]) * (mean[c] - own[c]); };
            const float distance = square(0) + square(2) + square(1); // the same for blue first
            const double weight = (reach - std::abs(i - fx)) * (reach - std::abs(j - fy)) *
                                  static_cast<double>(std::exp(-distance / (2 * sigma * sigma)) + least);
            take(weight, *pixel_at(depth_, u, v));
        }
}

void EdgeUpsampling::rows(int begin, int end, float* result) const {
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < color_.width; ++x) {
            double sum = 0, weights = 0;
            around(x, y, [&](double weight, float value) {
                if (std::isnan(value))
                    return;
                sum += weight * static_cast<double>(value);
                weights += weight;
            });
            *result++ = weights > 0 ? static_cast<float>(sum / weights) : std::numeric_limits<float>::quiet_NaN();
        }
}

void EdgeUpsampling::rows_of_distances(int begin, int end, bool inverse, float* result) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < color_.width; ++x) {
            double sum = 0, surface = 0, background = 0, invalid = 0;
            around(x, y, [&](double weight, float z) {
                if (std::isfinite(z)) {
                    sum += weight * (inverse ? 1 / static_cast<double>(z) : static_cast<double>(z));
                    surface += weight;
                } else {
                    (z == infinity ? background : invalid) += weight;
                }
            });
            const double mean = inverse ? surface / sum : sum / surface;
            *result++ = invalid > std::max(surface, background) ? std::numeric_limits<float>::quiet_NaN()
                        : background > surface                  ? infinity
                                                                : static_cast<float>(mean);
        }
}

void in_threads(int rows, const std::function<void(int begin, int end)>& work) {
    const int cores = static_cast<int>(std::thread::hardware_concurrency()), parts = std::clamp(cores, 1, rows);
    const auto first = [=](int part) { return static_cast<int>(static_cast<long long>(rows) * part / parts); };
    std::vector<std::future<void>> others; // which end with this call
    int part = 0;
    try {
        for (; part + 1 < parts; ++part)
            others.push_back(std::async(std::launch::async, work, first(part), first(part + 1)));
    } catch (const std::system_error&) { // no more threads
    }
    work(first(part), rows);
    for (std::future<void>& other : others)
        other.get(); // what it threw
}

bool have_same_ratio(int width, int height, int other_width, int other_height) {
    if (other_width < width)
        return have_same_ratio(other_width, other_height, width, height);
    const double across = static_cast<double>(other_width) / width, down = static_cast<double>(other_height) / height;
    return std::min(std::abs(other_height / across - height), std::abs(other_width / down - width)) <= 1;
}

std::vector<float> upsample_along_edges(const HostFloats& depth, const HostFloats& color) {
    const auto check = [](const char* name, const HostFloats& image) {
        require(image.data && image.width > 0 && image.height > 0, name, " has no pixels");
    };
    check("the depth", depth);
    check("color", color);
    require(depth.channels == 1, "the depth has ", depth.channels, " channels; it must have one");
    require(color.channels == 3 || color.channels == 4, "color has ", color.channels,
            " channels; it must have 3, or 4 with an alpha");
    require(have_same_ratio(depth.width, depth.height, color.width, color.height), "color is ", color.width, " x ",
            color.height, " pixels, the depth ", depth.width, " x ", depth.height,
            "; both must show the same, with the same ratio of width to height");
    const EdgeUpsampling upsampling(depth, color);
    std::vector<float> result(static_cast<std::size_t>(color.width) * static_cast<std::size_t>(color.height));
    in_threads(color.height, [&](int begin, int end) {
        upsampling.rows(begin, end,
                        result.data() + static_cast<std::size_t>(begin) * static_cast<std::size_t>(color.width));
    });
    return result;
}

void restore_highlights_of(float* pixels, std::size_t count, int channels, double highlights) {
    constexpr double from = 0.97,
                     nearly = 0.9; // nearly white: what makes it white changes it by 12 codes of sRGB at most
    constexpr double saturated = 0.11, pale = 0.2; // smallest channel over the largest
    const auto white = [](double channel, double begins) {
        const double over = std::clamp((channel - begins) / (1 - begins), 0.0, 1.0);
        return over * over;
    };
    for (float* pixel = pixels; count > 0; --count, pixel += channels) {
        std::array<double, 3> sorted{static_cast<double>(pixel[0]), static_cast<double>(pixel[1]),
                                     static_cast<double>(pixel[2])};
        std::sort(sorted.begin(), sorted.end());
        const auto [least, middle, most] = sorted;
        if (!(most > from))
            continue;
        // A lamp that is brighter than white clips all channels, unless its colour is saturated. With one or two at white it is else a
        // pale surface or the sky, whose other channels say how bright it is.
        const double colored = std::clamp((pale - least / most) / (pale - saturated), 0.0, 1.0) * white(most, from);
        const auto gain = static_cast<float>(
            1 + (highlights - 1) * std::max(std::min(white(middle, from), white(least, nearly)), colored));
        for (int c = 0; c < 3; ++c)
            pixel[c] *= gain;
    }
}

void restore_highlights(std::span<float> color, int channels, double highlights) {
    description::Check{}("highlights", highlights, description::highlights);
    require(channels == 3 || channels == 4, "channels = ", channels, " must be 3 or 4");
    const auto each = static_cast<std::size_t>(channels);
    require(color.size() % each == 0, color.size(), " floats are no pixels of ", channels, " channels");
    restore_highlights_of(color.data(), color.size() / each, channels, highlights);
}

} // namespace fathom
