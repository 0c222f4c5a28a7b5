#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/unproject.hpp>

namespace fathom::description {

template <typename Visitor, Is<UnprojectOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("space", o.space, {"view", "world"},
      "axes of the positions: the camera's, or the world's, which need the camera's view matrix");
    v("origin", o.origin, Kind::point,
      "the point of the world that positions are counted from. A point in the scene keeps floats exact far away from "
      "the world's origin");
    v("channels", o.channels, one_of(3.0, 4.0), "x, y and z, and with 4 also w: 1, or 0 where there is no position");
    v("background", o.background, {"inf", "decode", "nan"},
      "background pixels have no position (inf or nan), or lie on the far plane (decode)");
    v("no_mixed_pixels", o.no_mixed_pixels, Kind::flag,
      "pixels have no position whose depth was averaged over an edge: they would fly between two surfaces");
}

struct UnprojectCall {
    static constexpr Said said{
        .name = "unproject",
        .summary = "Turns stored depth into exact positions, in the camera's axes or the world's.",
        .notes =
            R"(The result is three float32 a pixel in scene units. An EXR holds them as P.X P.Y P.Z. Pixels without a position
are NaN. A PLY leaves them out. It may have the points' colours (--color, sRGB of 8 bits) and --normals.

Example:
  fathom unproject frame.exr --camera camera.json -o points.ply --space world)",
        .group = "Positions",
        .needing = {{{"origin", {"space=world"}}}}};

    UnprojectOptions options = {};
    Image result = {};

    void run(const StoredDepth& stored, const Launch& launch) const { unproject(stored, result, options, launch); }
};

template <typename Visitor>
void describe_results(const Visitor& v, UnprojectCall& call, const StoredDepth& stored) {
    v("result", call.result, true, floats(stored, call.options.channels),
      lengths("P.X P.Y P.Z", any_number.or_infinite(), "scene units"),
      "x, y, z in scene units. Pixels without a position are NaN");
}

} // namespace fathom::description
