// The camera of a part of an image. In pixels r = (1 + s y) H/2 from the first row, s = ±1, so that rows from r₀ on are
//   y' = y H/h + s ((H − 2 r₀)/h − 1),   and so for columns, with s = 1
// which multiplies the projection's rows and adds a part of its fourth. Depth is untouched.

#include <fathom/camera.hpp>

#include "require.hpp"

namespace fathom {

Camera cropped(const Camera& camera, int x, int y, int width, int height) {
    require(camera.width > 0 && camera.height > 0 && width > 0 && height > 0, "a part of ", width, " x ", height,
            " pixels of an image of ", camera.width, " x ", camera.height, ": all of them must be at least 1");
    Camera part = camera;
    part.width = width;
    part.height = height;
    const bool rows_go_up = (camera.rows == Rows::bottom_up) == (camera.projection.convention.clip_y == ClipY::up);
    const auto change = [&](Eigen::Index row, long double whole, long double first, long double pixels,
                            long double sign) {
        auto& matrix = part.projection.matrix;
        matrix.row(row) =
            matrix.row(row) * (whole / pixels) + matrix.row(3) * (sign * ((whole - 2 * first) / pixels - 1));
    };
    change(0, camera.width, x, width, 1);
    change(1, camera.height, y, height, rows_go_up ? 1 : -1);
    for (auto* lens : {&part.lens, &part.raw_lens})
        if (*lens) { // which counts from the top
            (*lens)->cx -= x;
            (*lens)->cy -= camera.rows == Rows::top_down ? y : camera.height - height - y;
        }
    return part;
}

} // namespace fathom
