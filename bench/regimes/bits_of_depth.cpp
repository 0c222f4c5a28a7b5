// Bits of depth, of integers from 4 to 24 bits and of floats, near and far a factor of 100 apart.

#include "camera_over.hpp"
#include "regimes/corner.hpp"

namespace fathom::regimes {
namespace {

constexpr const char* open_plane = "visibility lost by a plane, rms";
constexpr const char* fitted = "least squares, bits known";
constexpr const char* as_floats = "taken for floats";

} // namespace

Regime bits_of_depth(const Device& device) {
    Regime regime{"bits-of-depth", "bits (32: float)"};
    const Camera camera = camera_over(perspective(1.0, static_cast<double>(corner_width) / corner_height, {1, 100}),
                                      corner_width, corner_height);
    const Corner corner(camera);
    const auto put = [&](const char* quantity, const char* curve, int bits, double error) {
        regime.panel(quantity).curve(curve).points.push_back({static_cast<double>(bits), error});
    };
    for (const int bits : {4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 32}) {
        const CornerErrors known = corner_errors(device, corner, {bits, true});
        add(regime, "bits known", bits, known);
        put(quantity::normal, fitted, bits, known.fitted);
        put(quantity::visibility, as_floats, bits, corner_errors(device, corner, {bits, false}).visibility);
        put(open_plane, "bits known", bits, plane_lost(device, camera, {bits, true}));
        put(open_plane, as_floats, bits, plane_lost(device, camera, {bits, false}));
    }
    add(regime, "24 in three bytes", 24, corner_errors(device, corner, {24, true, true}));
    const char* const storing = "derived: half a step of the buffer";
    regime.boundaries = {
        {quantity::depth, "bits known", 0.01, 10, 8, storing},
        {quantity::normal, "bits known", 1, 16, 12, "derived: normals_slope_error"},
        {quantity::normal, fitted, 1, 14, 12, "measured"},
        {quantity::visibility, "bits known", 0.03, 14, 12, "measured"},
        {quantity::visibility, as_floats, 0.03, 12, 10, "measured"},
        {open_plane, "bits known", 0.002, 4, none, "promised: ssao_plane_error"},
        {open_plane, as_floats, 0.002, 16, 14, "promised: ssao_plane_error", none, 6},
        {quantity::circle, "bits known", 0.1, 10, 8, storing},
    };
    return regime;
}

} // namespace fathom::regimes
