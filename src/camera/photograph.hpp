#pragma once

#include <fathom/photograph.hpp>
#include <fathom/relative.hpp>

#include <array>
#include <functional>
#include <vector>

/// Depth of photographs: onto their grid, and without a unit.
namespace fathom {

/// May images of two sizes show the same? So if the ratios of width to height differ by a pixel at most.
bool have_same_ratio(int width, int height, int other_width, int other_height);

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

/// The first step of `relative_values`: from 0 to 1, by the range if there is one. `bits` as there.
void to_fractions(std::span<float> values, int bits, const std::optional<std::array<double, 2>>& range);

RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options,
                               const HostFloats& color, const std::string& range_option, const InRows& in_rows);

} // namespace fathom
