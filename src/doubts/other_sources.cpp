// Doubts about what wrote an image: bits that another source turns or packs, and pictures of all directions.
#include "doubts/look.hpp"

#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace fathom {
namespace {

using Doubt = std::optional<std::string>;

// Codes of 16 bits that hold something else than a distance in their three lowest bits.
Doubt low_bits_doubt(const Subject& subject) {
    const std::array<std::size_t, 8>& ends = subject.changes.low_bits;
    std::size_t all = 0;
    for (const std::size_t count : ends)
        all += count;
    const std::size_t others = all - ends[0];
    constexpr std::size_t few = 16;
    // Noise has all ends alike, and depth that is rounded to a multiple of 8 has one. Few surfaces are farther than 8 m, and most of
    // them nearer than 16 m.
    const bool is_rotated = others >= few && 5 * ends[0] >= 4 * all && 5 * ends[1] >= 2 * others;
    if (!is_rotated)
        return std::nullopt;
    return "its codes are multiples of 8 but for some, most of which end alike, as in SUN RGB-D, whose bits are "
           "rotated left "
           "by three; if it is from there, say \"packing\": \"uint16-rotated\", or --preset sunrgbd";
}

// 256 steps that are too small for a scene.
Doubt eight_bits_doubt(const Subject& subject) {
    const double end = 255 * std::abs(subject.camera.scale);
    if (end > 0.5)
        return std::nullopt;
    return text("its 8 bits times the scale of ", number(subject.camera.scale), " end at ", number(end, 3),
                "; depth in millimetres has 16 bits. Is it a picture of depth, or \"scale\" that of other files?");
}

// Pictures of all directions are twice as wide as high, and their last column lies beside the first.
Doubt panorama_doubt(const Subject& subject) {
    const int width = subject.camera.width, height = subject.camera.height;
    constexpr int least_height = 32;
    if (width != 2 * height || height < least_height || !subject.camera.projection.is_perspective())
        return std::nullopt;
    std::vector<float> step, seam, half, mirrored; // of the rows, relative to the depth
    std::array<float, 2> before{};                 // of the first column, 1/z
    std::size_t bends = 0, bent = 0;
    subject.each([&](const HostDepth&, const HostFloats& z) {
        if (z.width != width)
            return; // a sample
        for (int y = 0; y < z.height; ++y) {
            const std::span<const float> row = row_of(z, y);
            const float inverse = 1 / row[0], second = before[0] - 2 * before[1] + inverse;
            const bool follows = before[0] > 0 && before[1] > 0 && inverse > 0;
            bends += follows;
            bent += follows && second < -0x1p-16f * inverse;
            before = {before[1], inverse};
            const auto between = [&](int a, int b) {
                const float one = row[static_cast<std::size_t>(a)], other = row[static_cast<std::size_t>(b)];
                return std::abs(one - other) / std::max(one, other);
            };
            const std::array<float, 4> all{between(0, 1), between(0, width - 1), between(0, width / 2),
                                           between(width / 4, width - 1 - width / 4)};
            if (!std::ranges::all_of(all, [](float v) { return std::isfinite(v); }))
                continue;
            step.push_back(all[0]);
            seam.push_back(all[1]);
            half.push_back(all[2]);
            mirrored.push_back(all[3]);
        }
    });
    if (4 * step.size() < static_cast<std::size_t>(height))
        return std::nullopt;
    const auto quantile = [](std::vector<float>& values, double part) {
        const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size()));
        std::ranges::nth_element(values, at);
        return static_cast<double>(*at);
    };
    const double little = quantile(step, 0.5), much = std::max(0.1, 4 * little);
    // A floor or a wall has all of a row alike, and a corridor its two halves.
    const bool differs = quantile(half, 0.75) >= much && quantile(mirrored, 0.75) >= much;
    // A floor that has all of a row alike is straight in 1/z from row to row, but curved where rows are angles.
    const bool is_curved = 4 * bends >= static_cast<std::size_t>(height) && 10 * bent >= 9 * bends;
    if (quantile(seam, 0.75) > 1.5 * quantile(step, 0.75) + 0x1p-12 || !(differs || is_curved))
        return std::nullopt;
    return "it is twice as wide as high, and its left and right columns continue each other, as in a picture of all "
           "directions (equirectangular), which no \"perspective\" describes; cut it into views first";
}

} // namespace

std::vector<std::string> other_source_doubts(const Subject& subject) {
    const Camera& camera = subject.camera;
    const bool distances = camera.encoding == Encoding::view_z || camera.encoding == Encoding::ray_distance;
    std::vector<std::string> said;
    const auto add = [&](const Doubt& doubt) {
        if (doubt)
            said.push_back(*doubt);
    };
    if (distances && subject.storage == Storage::uint16)
        add(low_bits_doubt(subject));
    if (distances && subject.storage == Storage::uint8)
        add(eight_bits_doubt(subject));
    add(panorama_doubt(subject));
    return said;
}

} // namespace fathom
