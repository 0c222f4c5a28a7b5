// The depth at one pixel, as where a lens focuses.

#include <fathom/linearize.hpp>

#include "camera/form.hpp"
#include "require.hpp"

#include <cmath>

namespace fathom {

double depth_at(const StoredDepth& stored, int x, int y) {
    require(x >= 0 && y >= 0 && x < stored.image.width() && y < stored.image.height(), "pixel (", x, ", ", y,
            ") lies outside the image of ", stored.image.width(), " x ", stored.image.height());
    float depth;
    linearize(stored.region(x, y, 1, 1), {.as = has_plane_in_focus(stored.camera) ? Along::axis : Along::ray})
        .image.download(&depth);
    require(!std::isnan(depth), "pixel (", x, ", ", y, ") is invalid: it has no depth to focus on");
    return static_cast<double>(depth);
}

} // namespace fathom
