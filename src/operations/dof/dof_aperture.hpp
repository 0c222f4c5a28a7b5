#pragma once

#include "params.h"

#include <fathom/dof.hpp>

#include <array>
#include <vector>

namespace fathom {

/// An aperture laid over the rows of an image: which pixels around one show through it, and how much of each.
///
/// Rows are those of strips, `pitch` rows of pixels each. For a pixel that is the n-th of its strip's, row r from −reach to
/// reach, entries starts[n (2 reach + 1) + r + reach] to before the next are spans of columns around the pixel. Weights are
/// multiples of 2^-bits, so that sums of them and of fractions of 1/512 are exact in a float.
struct ApertureSpans {
    int reach;   ///< rows of strips above and below
    int columns; ///< on either side
    std::vector<params::u32> starts;
    std::vector<params::span_params> spans;
};

/// Does the aperture look alike however it is turned?
bool is_round(const Aperture& aperture);

/// Half the shorter axis of the unit aperture: 1 except for an ellipse.
double thinnest(const Aperture& aperture);

/// Of the unit aperture: pi for a circle.
double aperture_area(const Aperture& aperture);

/// `circle` in horizontal pixels, its sign that of the circle of confusion: before the focus the aperture is upside down.
/// `aspect`: a circle's height over its width. `upright`: is row 0 on top? `quality`: fast rounds spans of smaller circles to
/// whole pixels. Pure: no device.
ApertureSpans aperture_spans(const Aperture& aperture, double circle, double aspect, bool upright, int pitch,
                             Quality quality = Quality::balanced);

/// An aperture laid over cells of an image, `cell` pixels across and down: how much of each cell around one shows through it.
///
/// Weights are for `rows` neighbouring cells at a time, one below the other. For row r of cells from −reach to reach + rows − 1,
/// counted from the first of them, stand at starts[2 (r + reach)] how many columns on either side the weights reach, and where
/// they begin; then from column to column one for each of the neighbours.
/// Summing into cells and interpolating between them widen what comes out. The aperture is smaller by so much that its
/// variance is that of the circle.
struct ApertureCells {
    int reach;
    std::vector<params::u32> starts;
    std::vector<float> weights;
};
ApertureCells aperture_cells(const Aperture& aperture, double circle, double aspect, bool upright, int cell, int rows);

/// How many cells wide the radius of an aperture has to be, so that the error of summing into cells is small.
double least_cells(const Aperture& aperture, Quality quality);

/// Parts across and down that a pixel is cut into, so that a small circle is resolved even if one pixel covers most of
/// it.
int parts_of_pixel(const Aperture& aperture, double circle, double aspect);

/// Parts of the pixels of a small aperture, pixel by pixel: weights that sum to 1, and the middle of the part of the lens
/// that each shows through.
/// Lens coordinates go from -1 to 1, to the right and down an image of what lies behind the focus.
std::vector<params::aperture_tap_params> aperture_taps(const Aperture& aperture, double circle, double aspect,
                                                       bool upright);

/// For each direction of the first moment of a part of the aperture and each fraction that the part has, 256 from 0 to 1: the
/// half-plane that has them. Cosine and sine of the turn from the moment to its normal, its distance from the middle, and the
/// moment's size. Directions are evenly spaced in y / (|x| + |y|) from -y onwards; a circle has one.
std::vector<std::array<float, 4>> aperture_halves(const Aperture& aperture, bool upright);

} // namespace fathom
