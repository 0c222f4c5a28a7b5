#pragma once

#include "operations/dof/dof_aperture.hpp"

#include "params.h"

#include <array>
#include <span>
#include <vector>

namespace fathom {

/// Floats that strips, and cells and the sums around them, may take each. A layer that needs more is done in bands of rows.
inline constexpr std::size_t layer_floats = std::size_t{8} << 20;

/// How layers are spaced: a circle c lies `per_octave` (L(|c| + offset) - L(1 + offset)) layers from the middle. Within an octave
/// of x = 1 + t, L(x) is t + bend t (1 - t), nearly log2. `offset` is a power of two less 1.
struct LayerSpacing {
    double per_octave, offset, bend;
};

/// Circles up to this lie in the middle layer alone: the first layer is less than 1/1024 away.
double largest_in_focus(const LayerSpacing& spacing);

/// Polygons need more layers than what is round: the sides of an edge's ramp end abruptly.
LayerSpacing layer_spacing(Quality quality, const Aperture& aperture);

/// Layers of circle of confusion: number `middle` has the circles up to one pixel.
struct LayerScale {
    LayerSpacing spacing;
    int middle;

    int count() const { return 2 * middle + 1; }
    double circle(int layer) const;               ///< signed, in pixels; ±1 in the middle
    double farthest_circle(double largest) const; ///< of the layers that pixels of circles up to ± `largest` lie in
};

/// The scale for circles of up to `max_coc_px`; at most `most_layers`.
LayerScale layer_scale(const LayerSpacing& spacing, double max_coc_px);

/// Bits of the layers that a tile's pixels lie in; the last one: some colour is beyond the knee; the two before it: something
/// before the focus ends in the first or the second dof_hiding_columns; and before these: some pixel's area is not a pixel's.
using TileBits = std::array<params::u32, params::dof_tile_words>;
inline constexpr int bright_bit = 32 * params::dof_tile_words - 1, jump_bit = bright_bit - 2, area_bit = jump_bit - 1,
                     most_layers = area_bit;

bool any_with(std::span<const TileBits> tiles, int bit);

/// The farthest layer that a pixel may lie in.
int farthest_layer(std::span<const TileBits> tiles);

/// Adds the second surfaces to the tiles of the first ones. Where something is hidden, something ends.
void add_hidden(std::vector<TileBits>& tiles, const std::vector<TileBits>& hiding);

/// A launch of kernels/dof/dof_strips.cl, unless the pixels are read directly, and of dof_gather.cl beside it. Where pixels are
/// read directly and the quality is not accurate, a launch is of several layers, the first in `gather`: after its tile an
/// entry of the list has a bit for each that reaches it, and a bit for each that follows one that does; at `starts` stand where
/// a layer's own starts begin, and its reach.
///
/// Where an aperture is many pixels wide, it is summed over cells of pixels instead: a launch of dof_cells.cl,
/// dof_cell_sums.cl and dof_cell_layer.cl, of several layers where there is room for their cells. Entries of its lists of
/// blocks have the layer's number after them, counted from the first; those of tiles have bits as above.
struct LayerPass {
    params::layer_params strips, gather;
    params::cell_params cells;
    int cell;                 ///< pixels across and down; 1: `strips` and `gather` are used
    params::part_params part; ///< accurate only
    bool parts;               ///< of the lens are kept: kernels/dof/dof_parts.cl. Accurate only
    bool direct, fill, bright;
};

/// What the passes of dof do, in order, and the tables they read.
struct LayerPlan {
    std::vector<LayerPass> passes;
    std::vector<params::u32> lists; ///< tiles: column, and row in the high half
    std::vector<params::u32> starts;
    std::vector<params::span_params> spans;
    std::vector<params::aperture_tap_params> taps;     ///< accurate only
    std::vector<float> weights;                        ///< of cells
    std::size_t strip_elements = 1, cell_elements = 1; ///< that the largest pass needs
};

struct LayerPlanOptions {
    Aperture aperture;
    LayerScale scale;
    double aspect = 1;
    bool upright = true;
    Quality quality = Quality::balanced;
    int channels = 3;
    std::size_t most_floats = layer_floats;
    bool open =
        false; ///< accurate only: in tiles that see nothing hidden all of the lens is open, and no parts are kept
    std::vector<unsigned char> only = {}; ///< the tiles to work on are not 0; all of them if empty
};

/// The tiles in whose pixels' apertures some pixel has a second surface; `hiding` has the layers of those pixels and of what is
/// behind them, for tiles of dof_hiding_columns, `across` of them in a row.
std::vector<unsigned char> tiles_seeing(std::span<const TileBits> hiding, int across, const LayerPlanOptions& options);

/// Which tiles each layer reaches, front to back. Pure: no device.
LayerPlan layer_plan(std::span<const TileBits> tiles, int across, const LayerPlanOptions& options);

} // namespace fathom
