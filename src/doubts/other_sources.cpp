// Doubts about what wrote an image: bits that another source turns or packs, and pictures of all directions. Also about lenses.
#include "camera/form.hpp"
#include "doubts/look.hpp"

#include "doubts/stored_values.hpp"
#include "lens/camera_lens.hpp"
#include "quantile.hpp"
#include "text.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

namespace fathom {
namespace {

using Doubt = std::optional<Finding>;

// Codes of 16 bits that hold something else than a distance in some of their bits, or in another order.
Doubt codes_doubt(const Subject& subject) {
    const ValueChanges& found = subject.changes;
    const Camera& camera = subject.camera;
    constexpr std::size_t few = 16;
    const std::size_t order =
        static_cast<std::size_t>(std::ranges::min_element(found.change_bits) - found.change_bits.begin());
    const bool is_other_order = found.neighbours > 4 * few && 3 * found.change_bits[order] < 2 * found.change_bits[0] &&
                                found.lower_bytes.count() > 2;
    if (is_other_order && ValueChanges::rotations[order] == 8)
        return Finding{
            Fault::bits,
            "its codes change smoothly only if their two bytes are exchanged: they are in the other byte order",
            {{{{"packing", Packing::uint16_swapped}},
              {},
              "say \"packing\": \"uint16-swapped\", or write the file anew"}}};
    if (is_other_order && ValueChanges::rotations[order] == -5)
        return Finding{
            Fault::bits,
            "its codes change smoothly only if their bits are not rotated and their two bytes are exchanged: "
            "they are in the other byte order, and not from SUN RGB-D",
            {},
            "say \"packing\": \"uint16-swapped\" instead of the preset sunrgbd or \"uint16-rotated\""};
    // Millimetres that were rotated for nothing have an eighth of them there.
    std::size_t codes = 0, of_lengths = 0;
    visit_values(subject.values(), [&](float, std::uint32_t bits) {
        codes += bits != 0;
        of_lengths += (bits & 0x1fff) >= 0x400;
    });
    const bool are_lengths = 2 * of_lengths > codes;
    if (found.differ_above >= few && 10 * found.alike_below_13 >= 9 * found.differ_above &&
        (are_lengths || !(found.alike_left >= few && 4 * found.alike_left > found.neighbours)))
        return Finding{Fault::bits,
                       "neighbours are alike but for the upper three bits of their codes, which are flags or a "
                       "confidence then, as in Android's DEPTH16",
                       {{{{"packing", Packing::uint13}}}}};
    if (found.alike_left >= few && 4 * found.alike_left > found.neighbours)
        return Finding{Fault::bits,
                       "its codes are those of surfaces only if their bits are not rotated, as those of SUN RGB-D are",
                       {},
                       "leave out \"packing\": \"uint16-rotated\", or take another preset than sunrgbd"};
    if (!counts_distances(camera.encoding))
        return std::nullopt;
    const std::array<std::size_t, 8>& ends = found.low_bits;
    std::size_t all = 0, most_others = 0;
    for (const std::size_t count : ends)
        all += count;
    for (std::size_t i = 1; i < ends.size(); ++i)
        most_others = std::max(most_others, ends[i]);
    const std::size_t others = all - ends[0];
    const std::vector<Key> rotate{{"packing", Packing::uint16_rotated}};
    // A surface that goes on beyond 8.19 m begins again at 1. Where only edges go so far, noise has all ends alike, depth that is
    // rounded to a multiple of 8 has one, and a Kinect's player, who has another, stands on the floor.
    const bool goes_on = found.alike_right >= few && 20 * found.alike_right >= found.differ_below;
    const bool ends_alike = others >= few && 5 * ends[0] >= 4 * all && 5 * ends[1] >= 2 * others &&
                            4 * found.alike_below < found.differ_below && camera.scale != 0.000125;
    if (goes_on || ends_alike)
        return Finding{
            Fault::bits,
            "its codes are multiples of 8 but for some, most of which end alike, as in SUN RGB-D, whose bits "
            "are rotated left by three",
            {{rotate, {}, "if it is from there, say \"packing\": \"uint16-rotated\", or --preset sunrgbd"}}};
    constexpr float far_indoors = 20, far_for_nearest = 3.5f; // metres: sensors see nothing nearer than an eighth of it
    if (camera.usual_metres > 0 && camera.scale == 0.001 && subject.look.farthest > far_indoors &&
        subject.look.nearest > far_for_nearest && found.odd_eighths >= few && 1000 * (others - most_others) <= all &&
        2 * ends[0] >= all)
        return Finding{Fault::bits,
                       text("its codes are multiples of 8, or have the same three lowest bits, and reach ",
                            number(static_cast<double>(subject.look.farthest), 4), " metres as millimetres"),
                       {{rotate, "if the bits are rotated as in SUN RGB-D"},
                        {{{"scale", 0.000125}}, "if a Kinect keeps its player there"}}};
    return std::nullopt;
}

// Three bytes in the other order, or in base 255.
Doubt bytes_doubt(const Subject& subject) {
    if (subject.changes.are_of_base_255())
        return Finding{
            Fault::bits,
            "its lower two bytes take all values up to 254 and never 255, as in Unity's EncodeFloatRGBA, which "
            "counts in base 255",
            {{{{"packing", Packing::base_255}}}}};
    if (!subject.changes.are_turned_round())
        return std::nullopt;
    const bool red_is_high = subject.storage == Storage::bgr8_red_high || subject.storage == Storage::rgb8_red_high;
    return Finding{
        Fault::bits,
        text("its ", red_is_high ? "blue" : "red", " byte steps where the green one wraps, so that it is the highest"),
        {{{{"packing", red_is_high ? Packing::rgb_red_low : Packing::rgb_red_high}}}}};
}

// The second derivative of columns of an image of all directions along their angle, as a part of the values, where most pixels have
// one; NaN otherwise.
double median_bend(std::span<const std::vector<float>> columns, int height) {
    const auto span = static_cast<std::size_t>(height / 16), most = std::max<std::size_t>(1, span / 2);
    const double angle = std::numbers::pi * static_cast<double>(span) / height;
    std::vector<float> bends;
    const auto mean = [&](const std::vector<float>& column, std::size_t from) { // since noise would blur the bends
        return std::accumulate(&column[from], &column[from] + most, 0.0f);
    };
    for (const std::vector<float>& column : columns)
        for (std::size_t i = span; i + span + most <= column.size(); ++i) {
            const float middle = mean(column, i),
                        second = (mean(column, i - span) - 2 * middle + mean(column, i + span)) / middle;
            if (std::isfinite(second))
                bends.push_back(second / static_cast<float>(angle * angle));
        }
    return 4 * bends.size() >= columns.size() * static_cast<std::size_t>(height)
               ? static_cast<double>(quantile(bends))
               : std::numeric_limits<double>::quiet_NaN();
}

// What rows of a picture hold that tells whether it shows all directions.
struct PanoramaRows {
    static constexpr int columns = 16;

    int width;
    bool distances;                                                    // are stored
    std::vector<float> step = {}, seam = {}, half = {}, mirrored = {}; // of the rows, relative to the depth
    std::vector<float> firsts = {};                                    // values of the first column
    // Sums of 1 over the distance and over z, down some columns.
    std::array<std::vector<float>, columns> inverse = {}, inverse_z = {};

    void add(const Subject& subject, int y) {
        const auto visit = [&](int x, int wide, const auto& use) {
            visit_values(part_of(subject.whole, x, y, wide, 1), [&](float value, std::uint32_t bits) {
                use(value, subject.depth(x, y, value, bits));
                ++x;
            });
        };
        const int wide = std::max(1, width / (4 * columns));
        for (int i = 0; i < columns; ++i) {
            float sum = 0, sum_of_z = 0;
            visit(i * width / columns, wide, [&](float value, float depth) {
                const float distance = distances ? std::abs(value) : depth; // along the rays of whichever picture it is
                sum += std::isfinite(depth) ? 1 / distance : NAN;
                sum_of_z += 1 / depth;
            });
            inverse[static_cast<std::size_t>(i)].push_back(sum);
            inverse_z[static_cast<std::size_t>(i)].push_back(std::isfinite(sum) ? sum_of_z : NAN);
        }
        visit(0, 1, [&](float value, float depth) {
            if (depth > 0 && std::isfinite(depth))
                firsts.push_back(std::abs(value));
        });
        const auto at = [&](int x) {
            float found = 0;
            visit(x, 1, [&](float, float depth) { found = depth; });
            return found;
        };
        const auto between = [&](int a, int b) {
            const float one = at(a), other = at(b);
            return std::abs(one - other) / std::max(one, other);
        };
        const std::array<float, 4> all{between(0, 1), between(0, width - 1), between(0, width / 2),
                                       between(width / 4, width - 1 - width / 4)};
        if (!std::ranges::all_of(all, [](float v) { return std::isfinite(v); }))
            return;
        step.push_back(all[0]);
        seam.push_back(all[1]);
        half.push_back(all[2]);
        mirrored.push_back(all[3]);
    }
};

constexpr double many_beyond_fold = 0.01; // of the pixels

// Rays of a map whose axes are others than right, down and ahead: a mirror image, or turned upside down.
Doubt map_doubt(const Camera& camera) {
    if (!camera.lens || !camera.lens->map)
        return std::nullopt;
    const RayMap& map = *camera.lens->map;
    const auto ray = [&](int x, int y) -> Eigen::Vector3f {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) + static_cast<std::size_t>(x);
        return Eigen::Map<const Eigen::Vector3f>(&map.rays[3 * at]);
    };
    const int step = std::max(1, std::max(map.width, map.height) / 64);
    std::size_t all = 0, mirrored = 0, upwards = 0;
    for (int y = 0; y + 1 < map.height; y += step)
        for (int x = 0; x + 1 < map.width; x += step) {
            const Eigen::Vector3f here = ray(x, y), by_x = ray(x + 1, y) - here, by_y = ray(x, y + 1) - here;
            const float turn = here.dot(by_x.cross(by_y));
            if (!(turn != 0)) // NaN, too
                continue;
            ++all;
            mirrored += turn < 0;
            upwards += by_y.y() < 0;
        }
    const auto told = [](const char* how, const char* cure) {
        return Finding{
            Fault::lens,
            text("the map of rays is ", how, ": its axes are x right, y down and z ahead, rows from the top down"),
            {},
            cure};
    };
    if (2 * mirrored > all)
        return told("a mirror image", "turn the sign of y if it points up");
    if (2 * upwards > all)
        return told("upside down", "turn the signs of y and z of a map in OpenGL's axes");
    return std::nullopt;
}

// Where a lens folds within the image, beyond which nothing is seen. A fisheye whose circle ends in the image is another matter.
Doubt fold_doubt(const Camera& camera) {
    if (!camera.lens)
        return std::nullopt;
    const lens::CameraLens lens(camera);
    const double part = lens.part_beyond_fold(camera.width, camera.height);
    if (!(part > many_beyond_fold))
        return std::nullopt;
    return Finding{Fault::lens,
                   text(number(100 * part, 3), " % of the pixels have no ray, because the lens ", lens.fold_words()),
                   {},
                   "calibrate with points in the image's corners, or give the part that they surround"};
}

} // namespace

Doubt panorama_doubt(const Subject& subject) {
    const HostDepth& whole = subject.whole;
    const int width = whole.width, height = whole.height;
    constexpr int least_height = 32;
    if (subject.camera.lens || width < 2 * height || height < least_height || subject.closely == Closely::some ||
        !subject.camera.projection.is_perspective())
        return std::nullopt;
    PanoramaRows rows{.width = width, .distances = counts_distances(subject.camera.encoding)};
    for (int y = 0; y < height; ++y)
        rows.add(subject, y);
    if (4 * rows.step.size() < static_cast<std::size_t>(height))
        return std::nullopt;
    const float little = quantile(rows.step), much = std::max(0.1f, 4 * little);
    // A floor or a wall has all of a row alike, and a corridor its two halves.
    const bool differs = quantile(rows.half, 0.75) >= much && quantile(rows.mirrored, 0.75) >= much;
    // Over a plane 1/z is straight from row to row, but where rows are angles 1/distance is a sine of them, whose second derivative
    // is its own negative. The seam says little about a picture of the first kind, whose floor has all of a row alike. Of a part of
    // all latitudes the angles are unknown.
    const double bend = median_bend(rows.inverse, height), bend_of_z = median_bend(rows.inverse_z, height);
    const bool is_whole = width == 2 * height, is_curved = is_whole && std::abs(bend + 1) < 0.3,
               is_straight = is_whole && std::abs(bend_of_z) < 0.3;
    const double code =
        is_float(subject.storage) ? 0 : 1 / static_cast<double>(quantile(rows.firsts)); // as a part of the depth
    if (static_cast<double>(quantile(rows.seam, 0.75)) >
            1.5 * static_cast<double>(quantile(rows.step, 0.75)) + 0x1p-12 + code ||
        !(is_curved || (differs && !is_straight)))
        return std::nullopt;
    return Finding{Fault::panorama,
                   text("it is ", is_whole ? "twice" : number(static_cast<double>(width) / height, 3) + " times",
                        " as wide as high, and its left and right columns continue each other, as in a picture of all "
                        "directions (equirectangular), which no \"perspective\" describes, but a \"lens\" of the model "
                        "\"equirectangular\" does",
                        is_whole ? "" : ", with its \"latitude_deg\""),
                   {},
                   "or cut it into views"};
}

Doubt no_depth_doubt(const Subject& subject) {
    const Camera& camera = subject.camera;
    const double end = 255 * std::abs(camera.scale);
    if (subject.storage == Storage::uint8 && counts_distances(camera.encoding) && end <= 0.5)
        return Finding{Fault::bits,
                       text("its 8 bits times the scale of ", number(camera.scale), " end at ", number(end, 3),
                            "; depth in millimetres has 16 bits. Is it a picture of depth, or \"scale\" that of other "
                            "files? Where all is so near, count in millimetres (\"scale\": 1)")};
    const ValueChanges& found = subject.changes;
    if (subject.storage != Storage::uint16 || !found.may_be_halves())
        return std::nullopt;
    // Infinity, and nothing just below it.
    bool are_halves = 1000 * found.half_ends > found.half_codes && found.highest_half < 0x7b00;
    if (!are_halves) {
        Bends bends = found.bends;
        constexpr int most_columns = 64;
        const int width = subject.whole.width;
        for (int x = 0; x < width && subject.closely != Closely::some; x += 1 + width / most_columns) {
            std::vector<std::uint32_t> column;
            visit_values(part_of(subject.whole, x, 0, 1, subject.whole.height),
                         [&](float, std::uint32_t bits) { column.push_back(bits); });
            bends.add(column, 10);
        }
        are_halves = bends.of_floats >= 24 && bends.of_floats > 4 * bends.of_numbers;
    }
    if (!are_halves)
        return std::nullopt;
    return Finding{
        Fault::bits,
        "its codes are the bits of half floats and no lengths: they change half as fast above each multiple of "
        "1024, or end at infinity, which is 31744",
        {},
        "save them as floats (.exr, .npy or .tif), since no \"scale\" makes depth of them"};
}

Doubt bits_doubt(const Subject& subject) {
    return subject.storage == Storage::uint16 ? codes_doubt(subject) : bytes_doubt(subject);
}

std::vector<Finding> lens_mistakes(const Camera& camera) {
    std::vector<Finding> said;
    for (const Doubt& doubt : {fold_doubt(camera), map_doubt(camera)})
        if (doubt)
            said.push_back(*doubt);
    return said;
}

} // namespace fathom
