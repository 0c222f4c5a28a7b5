#pragma once

#include "camera/form.hpp"
#include "camera/photograph.hpp"
#include "doubts/finding.hpp"
#include "doubts/planes.hpp"

#include <fathom/findings.hpp>

#include <array>
#include <bit>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fathom {

/// What codes along lines of an image are: the bits of floats, or numbers. Over a smooth surface the bits of floats rise half as fast
/// above a power of two as below it, and numbers rise alike.
struct Bends {
    std::size_t of_floats = 0, of_numbers = 0;

    /// Looks at the powers of two that a line crosses, where floats have so many bits below the exponent.
    void add(std::span<const std::uint32_t> line, int mantissa_bits);
};

/// What a depth image is once it is decoded. Depths are in scene units along the view axis.
struct Look {
    std::size_t pixels = 0, invalid = 0, background = 0;
    float nearest = 0, farthest = 0; ///< of the surfaces; 0 where no pixel shows one

    std::size_t surfaces() const { return pixels - invalid - background; }

    /// Counts more of the image, and keeps none of it.
    void add(const HostFloats& more);
};

/// How stored values change from a pixel to the next one of its row.
struct ValueChanges {
    float least_second = std::numeric_limits<float>::infinity(); ///< difference, of those that are not 0
    float highest = 0;                                           ///< value
    std::size_t steps = 0, alike = 0,
                carried = 0;               ///< of the highest byte by 16 at most; the byte below, too; or as a sum does
    std::size_t straight = 0;              ///< of these, where the sum goes on as before, and its lowest byte jumps
    std::bitset<256> stepping;             ///< highest bytes of steps
    std::array<std::size_t, 8> low_bits{}; ///< codes other than 0 by their three lowest bits
    std::size_t no_fives = 0, odd_fives = 0; ///< codes that are no multiple of 5, and that are an odd one
    std::size_t odd_eighths = 0;             ///< codes in the upper half that are 8 more than a multiple of 16
    /// Of neighbours of 16 bits that differ: all; those whose lowest bits differ; of these the ones that are alike as they are;
    /// and of all those that are alike only if their bits are rotated right by three, and left.
    std::size_t neighbours = 0, differ_below = 0, alike_below = 0, alike_right = 0, alike_left = 0;
    /// Bits of how neighbours change that differ, as they are and once all bits are rotated left: the right rotation has the fewest.
    static constexpr std::array<int, 5> rotations{0, 8, -5, -3, 3};
    std::array<std::size_t, rotations.size()> change_bits{};
    /// Of those whose upper three bits differ, all, and those that are alike without these bits.
    std::size_t differ_above = 0, alike_below_13 = 0;
    std::bitset<256> lower_bytes = {}; ///< of codes of 16 bits

    std::size_t half_codes = 0, half_ends = 0,
                no_half_codes = 0;  ///< as bits of half floats: of lengths, of infinity, of neither
    std::uint32_t highest_half = 0; ///< of those of lengths
    Bends bends = {};               ///< of 16 bits
    std::array<std::size_t, 2>
        carries{}; ///< by 1 into the highest byte of three, and into the lowest as if it were the highest
    std::bitset<256> carried_into_lowest; ///< its values
    /// Of the two upper bytes: small steps, those where the byte below changes little, and not at all; places where it wraps; values
    /// where it changes little, and those of the byte below.
    std::array<std::size_t, 2> small_steps{}, small_below{}, frozen{}, wraps{};
    std::array<std::bitset<256>, 2> steady_values = {}, values_below = {};
    std::set<std::uint32_t> colors = {}; ///< of three bytes, until they are more than a map has
    bool ends_differ = false;            ///< of a pixel's three bytes
    std::size_t pixels_of_three = 0;
    std::array<std::size_t, 2> full{}; ///< pixels whose lowest byte is 255 and highest 0, and the other way round
    std::bitset<256> between = {};     ///< the byte between these

    void add(const HostDepth& row);

    /// Do packed bytes change like the colours of a picture? Those of a number do not: a byte wraps where the next one steps.
    /// Of a depth buffer they may all lie in the last 256th of the range.
    bool are_of_a_picture(bool is_buffer = false) const;

    /// Do the lower two of three bytes take all values up to 254, and never 255?
    bool are_of_base_255() const;

    /// Do three bytes count up as if the lowest were the highest?
    bool are_turned_round() const;

    /// May 16 bits be those of half floats that are lengths?
    bool may_be_halves() const;

private:
    bool are_of_one_channel(bool is_buffer) const;
    void add_codes(const HostDepth& row);
    void add_bytes(const HostDepth& row);
    void add_neighbours(std::uint32_t one, std::uint32_t other);

    std::vector<std::uint32_t> codes_before_ = {}; ///< of the row before
};

/// Borders of something, and those of them that a filter has made.
struct FilteredBorders {
    std::size_t count = 0, filtered = 0;
};

/// Borders of pixels without depth along lines of an image.
struct LineBorders {
    float least_gap = 0; ///< between what has no depth and the surface, in stored units
    /// On either side of them: for filters that blend, and that go beyond both, too.
    std::array<FilteredBorders, 2> blended = {}, swinging = {};
    FilteredBorders of_background = {}; ///< beside which one value of what has no depth differs from all others
    FilteredBorders far_off =
        {}; ///< those of numbers that are far off from the surface, on both sides, of filters that blend

    /// A value, and whether it has no depth.
    using Value = std::pair<float, bool>;
    static Value value_of(const DepthForm& form, bool counts_distances, float value, std::uint32_t bits);

    void add(std::span<const Value> line, const DepthForm& form, bool counts_distances);
};

struct Subject;

/// Numbers that programs write where there is no depth, or the near plane's code.
struct SharedNumbers {
    std::vector<float> numbers; ///< in ascending order
    std::vector<std::size_t> counts, pairs,
        alone; ///< of pixels that hold one of them; of those whose left neighbour does so, too, and neither
    std::size_t pixels = 0;
    /// Pixels with another value that their left neighbour and the row before have, too; and those of integers that have a value
    /// next to that of one of both.
    std::size_t constant = 0, gradual = 0;
    LineBorders borders = {}; ///< of rows

    SharedNumbers() = default;

    /// `stored`: where numbers are looked for that many pixels share, at an end of all.
    SharedNumbers(const Camera& camera, const HostDepth& stored);
    void add(const HostDepth& row);

    /// Looks at the numbers in every so many pixels of a row, and in no borders.
    void add_some(const HostDepth& row, int step);

    /// The borders of columns, of which `each` gives the rows in order.
    LineBorders borders_of_columns(const Subject& subject) const;

private:
    static constexpr std::size_t marks = 1024;
    static std::size_t mark_of(float value) {
        return (std::bit_cast<std::uint32_t>(value + 0.0f) * 0x9e3779b1u) >> 22; // Knuth's multiplicative hash
    }
    void count(float value, float left, float right, float& before);

    DepthForm form_{};
    bool are_integers_ = false;
    bool counts_distances_ = false;
    std::vector<float> before_ = {}; ///< the row before
    std::bitset<marks> marks_ = {};  ///< of the numbers: most other values have none
};

/// How closely an image is looked at.
enum class Closely {
    some,  ///< a few thousand pixels, spread evenly, and some rows
    most,  ///< some fifty thousand, and all windows
    whole, ///< all
};

/// What is to be seen in an image as a camera describes it.
struct Subject {
    Camera camera; ///< of the whole image
    Storage storage = Storage::float32;
    Closely closely = Closely::whole;
    HostDepth whole = {};
    Look look = {};
    ValueChanges changes = {};
    SharedNumbers numbers = {};
    std::vector<Sampled> windows = {};

    Subject() = default;

    /// Depths are computed. The values stay where they are.
    Subject(const Camera& camera, const HostDepth& stored, Closely closely);

    /// `z`: what they are decoded to, +infinity for the background, and NaN for what is invalid.
    Subject(const Camera& camera, const HostDepth& stored, const HostFloats& z, Closely closely);

    /// What a value at a pixel is decoded to. The last bit may differ.
    float depth(int x, int y, float value, std::uint32_t bits) const;

    /// Calls a function with the pixels that are looked at, which may be a sample in one row, and with their depths.
    template <typename Visit>
    void each(const Visit& visit) const {
        visit(values(), z());
    }

    HostDepth values() const;
    HostFloats z() const;

private:
    void take_sample(int columns, int rows);

    DepthForm form_ = {};
    std::array<double, 4> numerator_{}, denominator_{}; // of the form, in fewer digits
    Rays rays_ = {};
    HostFloats given_ = {};              // depths of the whole image, if there are any
    std::vector<std::byte> sample_ = {}; // pixels, side by side
    std::vector<float> depths_ = {};     // of these
};

/// How many of the depths that are looked at are of a kind.
std::size_t count_depths(const Subject& subject, const auto& is) {
    std::size_t count = 0;
    const HostFloats z = subject.z();
    for (int y = 0; y < z.height; ++y)
        for (const float depth : row_of(z, y))
            count += is(static_cast<double>(depth));
    return count;
}

/// Are stored values distances?
inline bool counts_distances(Encoding encoding) {
    return encoding == Encoding::view_z || encoding == Encoding::ray_distance;
}

/// Of values whose meaning nobody has said: the one about their bits, and the one where many pixels hold a number that is probably no
/// distance, if it is not one of those that are left out.
struct UnsaidDoubts {
    std::optional<Finding> bits, number;
};
UnsaidDoubts unsaid_doubts(const HostDepth& stored, bool backwards, double background_from);

/// Is nothing measured anywhere, or is there no depth whatever the scale is? Then no result can be right.
std::optional<Finding> refusal(const Subject& subject);

/// What is probably wrong with the description of an image. Where it is refused, the only one says why.
std::vector<Finding> doubts(const Subject& subject);

/// The same without trying what would cure it.
std::vector<Finding> untried_doubts(const Subject& subject);

/// The one where flat surfaces are bent as the camera describes them, but flat under another reading.
std::optional<Finding> flat_surfaces_doubt(const Subject& subject);

/// The one where many pixels hold a number that is probably no depth.
std::optional<Finding> special_number_doubt(const Subject& subject);

/// The one where codes hold more than a number, or in another order.
std::optional<Finding> bits_doubt(const Subject& subject);

/// The one where they are the bits of half floats, or 8 bits too few for depth.
std::optional<Finding> no_depth_doubt(const Subject& subject);

/// The one where an image of all directions is said to be a perspective's.
std::optional<Finding> panorama_doubt(const Subject& subject);

/// Where the camera's lens folds within the image, and where its map of rays is a mirror image or upside down.
std::vector<Finding> lens_mistakes(const Camera& camera);

/// The one where a file says another near or far than its camera.
std::optional<Finding> near_and_far_doubt(const Camera& camera, const std::array<std::optional<double>, 2>& of_file);

/// The one where a filter has mixed depth with what is none.
std::optional<Finding> filtered_doubt(const Subject& subject);

/// The one where edges ramp over some pixels, as no surface makes them, or have means of both sides.
std::optional<Finding> soft_edges_doubt(const Subject& subject);

} // namespace fathom
