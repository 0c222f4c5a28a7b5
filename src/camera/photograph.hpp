#pragma once

#include <fathom/photograph.hpp>
#include <fathom/relative.hpp>

#include <array>
#include <functional>
#include <vector>

/// Depth of photographs: onto their grid, and without a unit.
namespace fathom {

/// Floats of a row, and those of a pixel.
inline std::span<const float> row_of(const HostFloats& image, int y) {
    const auto row = static_cast<std::size_t>(image.width * image.channels);
    return {image.data + static_cast<std::size_t>(y) * (image.row_stride > 0 ? image.row_stride : row), row};
}

inline const float* pixel_at(const HostFloats& image, int x, int y) {
    return row_of(image, y).data() + static_cast<std::size_t>(x * image.channels);
}

/// May images of two sizes show the same? So if the ratios of width to height differ by a pixel at most.
bool have_same_ratio(int width, int height, int other_width, int other_height);

/// A pixel's colour as eyes judge differences, about: the root of the light.
std::array<float, 3> seen_color(const HostFloats& image, int x, int y);

/// `upsample_along_edges`, some rows at a time.
class EdgeUpsampling {
public:
    EdgeUpsampling(const HostFloats& depth, const HostFloats& color);

    /// Rows [begin, end) of the picture's size; `result` is the first of them. May be called by several threads.
    void rows(int begin, int end, float* result) const;

    /// The same of distances, whose background is +infinity: a pixel is surface, background or invalid as most of its weights are,
    /// and a surface has the mean of theirs. `inverse`: that of 1/z, which is affine on every plane under a perspective.
    void rows_of_distances(int begin, int end, bool inverse, float* result) const;

private:
    template <typename Take>
    void around(int x, int y, const Take& take) const;

    using Color = std::array<float, 3>;

    HostFloats depth_, color_;
    double across_, down_;    // pixels of the depth in one of the picture
    std::vector<Color> mean_; // of the part of the picture under each pixel of the depth
};

/// Pixels of this many channels whose light has its highlights restored.
void restore_highlights_of(float* pixels, std::size_t count, int channels, double highlights);

/// Runs a function over ranges [begin, end) of rows, perhaps several at once.
using InRows = std::function<void(int rows, const std::function<void(int begin, int end)>& work)>;

/// On all cores.
void in_threads(int rows, const std::function<void(int begin, int end)>& work);

/// Edges along lines of an image: those from one pixel to the next, as exact depth has them, ramps of a few pixels in what is affine
/// over planes, and pixels that are a mean of both sides in z.
struct EdgeCounts {
    std::size_t hard = 0, soft = 0, clean = 0, means = 0;

    /// An edge is at least `least` high, plus `least_part` of what is nearer. `line`: nearness, as `sharpened_edges` takes it.
    void add(std::span<const float> line, float least, float least_part);

    /// The same of distances: edges without a mean of both sides between them, and with one to three.
    void add_distances(std::span<const float> z);

    bool are_soft() const;
    bool are_means() const;
};

/// Depth whose edges are ramps of a few pixels, with edges: each pixel of a ramp gets the nearness of one of its sides, and all others
/// keep theirs. Empty where most edges are hard already, or there are few. Rows without a gap.
/// `nearness`: 1/z, or what else is affine in the pixel over planes and greater where it is nearer; NaN where nothing is known, and
/// rows without a gap. `color`: the picture, of the same size, in linear light; no pixels if there is none. An edge is at least `least`
/// high, plus `least_part` of what is nearer.
std::vector<float> sharpened_edges(const HostFloats& nearness, const HostFloats& color, float least, float least_part,
                                   const InRows& in_rows);

/// The same of distances, +infinity for the background, NaN for what is invalid. `inverse`: under a perspective 1/z is affine.
std::vector<float> sharpened_distances(const HostFloats& z, bool inverse, const HostFloats& color,
                                       const InRows& in_rows);

/// Distances in which no pixel is a mean of both sides of an edge. Empty where few are. `open`: the same where a background has the
/// distance that is stored, with which it was averaged. `of_inverse`: are they means of 1/z, as a depth buffer's are? Rows without a gap.
std::vector<float> without_means(const HostFloats& z, const HostFloats& open, bool of_inverse);

/// The least and the greatest finite value; infinity and -infinity of none.
std::array<double, 2> ends_of(std::span<const float> values);

/// The first step of `relative_values`: from 0 to 1, by the range if there is one. `bits` as there.
void to_fractions(std::span<float> values, int bits, const std::optional<std::array<double, 2>>& range);

RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options,
                               const HostFloats& color, const std::string& range_option, const InRows& in_rows);

} // namespace fathom
