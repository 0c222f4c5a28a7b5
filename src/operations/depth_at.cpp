// The depth at one pixel, as where a lens focuses.

#include <fathom/linearize.hpp>

#include "camera/form.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"

#include <cmath>

namespace fathom {

double depth_at(const StoredDepth& stored, int x, int y) {
    check_pixel("pixel", size_of(stored.image), x, y);
    float depth;
    linearize(stored.region(x, y, 1, 1), {.as = has_plane_in_focus(stored.camera) ? Along::axis : Along::ray})
        .image.download(&depth);
    require(!std::isnan(depth), "pixel (", x, ", ", y, ") is invalid: it has no depth to focus on");
    return static_cast<double>(depth);
}

} // namespace fathom
