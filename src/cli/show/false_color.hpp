#pragma once

#include "color_maps.hpp"

#include <opencv2/core/mat.hpp>

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// An image for people to look at, as its file holds it.
struct Viewed {
    enum class Kind { values, normals, picture };

    Kind kind = Kind::values;
    cv::Mat image;            ///< CV_32FC1 values; CV_32FC3 vectors x, y, z; CV_32FC3 or 4 in linear light, B, G, R
    std::string name = {};    ///< of the channel or the layer; of files without names what the values are
    std::string unit = {};    ///< where the name says it; otherwise empty
    bool from_0_to_1 = false; ///< does the name say so?
};

/// Reads any result or depth image. Of an EXR it takes the channel or the layer of this name. Without a name it takes
/// the first of: the channels that the program itself writes, normals, what is named like depth, a picture, the only
/// channel.
/// Three floats a pixel are normals where their lengths say so, and otherwise a picture.
/// Throws: Error as `read_depth`.
Viewed read_viewed(const std::filesystem::path& file, const std::string& channel = {});

/// What an image holds.
struct Statistics {
    std::size_t pixels = 0, invalid = 0;
    std::size_t background = 0;      ///< values of +infinity
    double least = 0, greatest = 0;  ///< of the finite values; 0 where there is none
    std::vector<double> sample = {}; ///< finite values of pixels all over the image, ascending
    bool any() const { return !sample.empty(); }
};

/// Of pictures and normals only the numbers of pixels. Invalid are NaN and -infinity, vectors of length 0, and colors
/// that are not finite.
Statistics statistics_of(const Viewed& viewed);

/// How values become places on a map of colors.
enum class ColorScale { linear, logarithmic, inverse };

const char* to_string(ColorScale scale);

/// The values at the ends of a map, and the scale between them. Values beyond have the colors of the ends.
struct ColorRange {
    ColorScale scale = ColorScale::linear;
    double low = 0, high = 1;

    /// 0 at `low`, 1 at `high`; not limited to these.
    double place(double value) const;

    /// Why a map cannot have this range, for a message; empty where it can.
    std::string fault() const;
};

/// What a caller leaves open of a range is chosen by the values.
struct RangeWish {
    std::optional<std::array<double, 2>> ends = {};
    std::optional<ColorScale> scale = {};
};

/// The ends are the least and the greatest value. Where a few values stretch the range to more than three times of what
/// the middle 99 % have, they are the ends of those. The scale is linear, unless another one of positive values uses the
/// colors more evenly, by half a bit of entropy.
ColorRange choose_range(const Statistics& of, bool from_0_to_1, const RangeWish& wish = {});

/// A value beside a map of colors.
struct Tick {
    double place; ///< from 0 to 1
    std::string label;
};

/// The ends, and round values between them whose labels do not touch on a line of so many letters.
std::vector<Tick> ticks_of(const ColorRange& range, int letters_a_line);

/// Colors of pixels that have none on the map. B, G, R.
inline constexpr std::array<unsigned char, 3> invalid_color{255, 0, 255}, background_color{240, 215, 200};

/// The image in false color, normals as ½n + ½, a picture as sRGB: CV_8UC3.
cv::Mat false_color(const Viewed& viewed, const ColorRange& range, ColorMap map);

/// What the colors mean: "AO (viridis, log scale)".
std::string meaning_of(const Viewed& viewed, const ColorRange& range);

/// The picture with a bar of colors below it, the meaning, and what the marks stand for. A narrow picture gets a
/// margin.
cv::Mat with_legend(const cv::Mat& picture, const Viewed& viewed, const Statistics& found, const ColorRange& range,
                    ColorMap map);

} // namespace fathom::cli
