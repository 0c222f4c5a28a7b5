#pragma once

#include "description/range.hpp"
#include "description/result.hpp"

#include <fathom/contours.hpp>

namespace fathom::description {

template <typename Visitor, Is<ContoursOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("step", o.step, above(0), "distance between two contour lines, scene units");
}

struct ContoursCall {
    static constexpr Said said{.name = "contours",
                               .summary = "Says where depth lies between two contour lines.",
                               .notes = R"(The result is float32, from 0 on the nearer line to 1 on the next one.

Example:
  fathom contours frame.exr --camera camera.json -o lines.exr --step 0.5)",
                               .group = "Contours",
                               .layer = "contours"};

    ContoursOptions options{.step = 1};
    Image result = {};

    void run(const StoredDepth& stored, const Launch& launch) const { contours(stored, result, options, launch); }
};

template <typename Visitor>
void describe_results(const Visitor& v, ContoursCall& call, const StoredDepth& stored) {
    v("result", call.result, true, floats(stored, 1), fractions("V"),
      "0 on the nearer line, and below 1. Invalid pixels and the background are NaN");
}

} // namespace fathom::description
