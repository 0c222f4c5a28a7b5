#pragma once

#include "description/range.hpp"

#include <fathom/dof_masks.hpp>

namespace fathom::description {

inline constexpr const char* dof_masks_summary =
    "Computes the size of each pixel's blur, and masks of what is near, in focus and far.";

template <typename Visitor, Is<DofMasksOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("sharp_px", o.sharp_px, from(0), "circles of confusion up to this are wholly in focus, pixels");
    v("transition_px", o.transition_px, from(0), "circles larger by this are not in focus at all, pixels");
    v("sky", o.sky, {"blur", "sharp", "exclude"},
      "blur: the background is infinitely far; sharp: it is in focus; exclude: it is left out like invalid pixels");
    v("max_coc_px", o.max_coc_px, above(0).or_infinite(),
      "max CoC, on either side of the focus, pixels: circles end there");
    v("near_weight", o.near_weight, a_result, "the weight of what lies before the focus");
    v("focus_weight", o.focus_weight, a_result, "the weight of what is in focus");
    v("far_weight", o.far_weight, a_result, "the weight of what lies behind the focus");
    v("max_near_coc", o.max_near_coc, a_result, "the max near CoC that reaches each pixel");
    v("near_alpha", o.near_alpha, a_result, "how much of each pixel the blurred near field covers");
    v("disocclusion", o.disocclusion, a_result, "where a blur shows what lies behind the near field");
    v("mixed_pixels", o.mixed_pixels, a_result, "which pixels have a depth that was averaged over an edge");
    v("tile_px", o.tile_px, whole(1, 65536), "width of a tile, pixels");
    v("tile_min_coc", o.tile_min_coc, a_result, "the smallest CoC of each tile");
    v("tile_max_coc", o.tile_max_coc, a_result, "the largest CoC of each tile");
}

} // namespace fathom::description
