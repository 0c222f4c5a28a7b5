#pragma once

#include "description/lens.hpp"
#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/dof_masks.hpp>

namespace fathom::description {

template <typename Visitor, Is<DofMasksOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("sharp_px", o.sharp_px, from(0), "circles of confusion up to this are wholly in focus, pixels");
    v("transition_px", o.transition_px, from(0), "circles larger by this are not in focus at all, pixels");
    v("sky", o.sky, {"blur", "sharp", "exclude"}, sky_words);
    v("max_coc_px", o.max_coc_px, above(0).or_infinite(),
      "max CoC, on either side of the focus, pixels. Wider circles are set to it");
    v("near_weight", o.near_weight, a_result);
    v("focus_weight", o.focus_weight, a_result);
    v("far_weight", o.far_weight, a_result);
    v("max_near_coc", o.max_near_coc, a_result);
    v("near_alpha", o.near_alpha, a_result);
    v("disocclusion", o.disocclusion, a_result);
    v("mixed_pixels", o.mixed_pixels, a_result);
    v("tile_px", o.tile_px, whole(1, 65536), "width of a tile, pixels");
    v("tile_min_coc", o.tile_min_coc, a_result);
    v("tile_max_coc", o.tile_max_coc, a_result);
}

struct DofMasksCall {
    static constexpr Said said{
        .name = "dof_masks",
        .summary = "Computes the size of each pixel's blur, and masks of what is near, in focus and far.",
        .group = "Masks",
        .needing = {{{"tile_px", {"tile_min_coc", "tile_max_coc"}}}},
        .results = "DofMasks"};

    CircleOfConfusion circle = {};
    DofMasksOptions options = {};
    DofMasks results = {};

    void run(const StoredDepth& stored, const Launch& launch) const {
        dof_masks(stored, results, circle, options, launch);
    }
};

template <typename Visitor, Is<DofMasksCall> Call>
void describe(const Visitor& v, Call& call) {
    describe_circle(v, call.circle);
    describe(v, call.options);
}

template <typename Visitor>
void describe_results(const Visitor& v, DofMasksCall& call, const StoredDepth& stored) {
    const DofMasksOptions& o = call.options;
    DofMasks& results = call.results;
    const auto pixel = floats(stored, 1), tile = tiles(stored, o.tile_px);
    const Range circle = between(-o.max_coc_px, o.max_coc_px).or_infinite(),
                near_circle = between(0, o.max_coc_px).or_infinite();
    const char* const sum = "the weights near, focus and far of a pixel sum to 1, or are all 0";
    v("coc", results.coc, true, pixel, lengths("coc", circle, "pixels"),
      "diameter of the circle of confusion in pixels, positive behind the focus; NaN if invalid");
    v("near_weight", results.near_weight, o.near_weight, pixel, fractions("near", sum),
      "the weight of what lies before the focus: 1 there, 0 in focus and behind it");
    v("focus_weight", results.focus_weight, o.focus_weight, pixel, fractions("focus", sum),
      "the weight of what is in focus");
    v("far_weight", results.far_weight, o.far_weight, pixel, fractions("far", sum),
      "the weight of what lies behind the focus: 1 there, 0 in focus and before it");
    v("max_near_coc", results.max_near_coc, o.max_near_coc, pixel, lengths("coc", near_circle, "pixels"),
      "the largest near CoC that reaches each pixel, pixels");
    v("near_alpha", results.near_alpha, o.near_alpha, pixel, fractions("near"),
      "how much of each pixel the blurred near field covers");
    v("disocclusion", results.disocclusion, o.disocclusion, pixel, fractions("disocclusion"),
      "where a blur shows what lies behind the near field: 1 there, else 0");
    v("mixed_pixels", results.mixed_pixels, o.mixed_pixels, pixel, fractions("mixed"),
      "which pixels have a depth that was averaged over an edge: 1 for them, else 0");
    v("tile_min_coc", results.tile_min_coc, o.tile_min_coc, tile, lengths("min", circle, "pixels"),
      "the smallest CoC of each tile, pixels");
    v("tile_max_coc", results.tile_max_coc, o.tile_max_coc, tile, lengths("max", circle, "pixels"),
      "the largest CoC of each tile, pixels");
}

} // namespace fathom::description
