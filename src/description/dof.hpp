#pragma once

#include "description/lens.hpp"
#include "description/result.hpp"
#include "description/value.hpp"
#include "require.hpp"

#include <fathom/dof.hpp>

#include <algorithm>

namespace fathom::description {

template <typename Visitor, Is<DofOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("blades", o.aperture.blades, whole(3, 64).or_just(0),
      "corners of the aperture, a regular polygon; 0 is a circle");
    v("rotation_degrees", o.aperture.rotation_degrees, any_number,
      "turns the aperture counter-clockwise. At 0 a polygon has a corner on top, seen behind the focus");
    v("ratio", o.aperture.ratio, between(0.1, 10),
      "height over width of an aperture without blades, an ellipse, as anamorphic lenses have it");
    v("quality", in<Quality>(o.quality), {"fast", "balanced", "accurate"},
      "speed against accuracy. accurate is also exact behind a blurred edge, in 3 times the time and more for large "
      "circles");
    v("max_error", in<&MaxError::value>(o.quality), tolerated_error,
      "rms error of colours from 0 to 1, instead of a quality: takes the fastest quality whose measured error is at "
      "most this in every scene of docs/performance.md");
    v("sky", o.sky, {"blur", "sharp", "exclude"}, sky_words);
    v("max_coc_px", o.max_coc_px, between(1, 512), "largest blur, on either side of the focus, pixels");
    v("clean_plate", in<&CleanPlate::color>(o.clean_plate), Kind::picture,
      "the picture without its near objects. It shows what a blurred foreground hides");
    v("clean_plate_depth", in<&CleanPlate::depth>(o.clean_plate), Kind::depth, "the depth of the clean plate");
}

struct DofCall {
    static constexpr Said said{.name = "dof",
                               .summary =
                                   "Blurs a picture as a lens does that is focused on one depth: depth of field.",
                               .arguments = {"color"},
                               .group = "Blur",
                               .layer = "dof",
                               .excluding = {{{"ratio", {"blades"}}, {"clean_plate", {"relative"}}}},
                               .repairs = true};

    Image color = {};
    CircleOfConfusion circle = {};
    DofOptions options = {};
    Image result = {};

    /// Circles count in the result's pixels, and end where those of the frame must.
    void supersample(int factor) {
        const double most = DofOptions{}.max_coc_px;
        require(options.max_coc_px == most || options.max_coc_px * factor <= most, "max_coc_px = ", options.max_coc_px,
                " pixels of the result are ", options.max_coc_px * factor, " of the frame, where a blur ends at ", most,
                "; give ", most / factor, " or less");
        options.max_coc_px = std::min(options.max_coc_px * factor, most);
    }
    void run(const StoredDepth& stored, const Launch& launch) const {
        dof(stored, color, result, circle, options, launch);
    }
};

template <typename Visitor, Is<DofCall> Call>
void describe(const Visitor& v, Call& call) {
    v("color", call.color, Kind::picture, "the sharp picture");
    describe_circle(v, call.circle);
    describe(v, call.options);
}

template <typename Visitor>
void describe_results(const Visitor& v, DofCall& call, const StoredDepth&) {
    v("result", call.result, true, like(call.color),
      light(
          "each channel between the least and the greatest of the colours that can reach the pixel; alpha from 0 to 1"),
      "the blurred picture");
}

} // namespace fathom::description
