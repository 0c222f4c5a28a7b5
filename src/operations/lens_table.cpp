// What kernels read of a lens: the patches of kernels/camera/patch.h, made once for a camera and kept.

#include "operations/lens_table.hpp"

#include "camera/form.hpp"
#include "lens/patches.hpp"
#include "operations/parameters.hpp"
#include "runtime/table.hpp"

#include <Eigen/LU>

#include <bit>

namespace fathom {
namespace {

static_assert(static_cast<int>(Along::axis) == ALONG_AXIS && static_cast<int>(Along::ray) == ALONG_RAY &&
              static_cast<int>(Along::cube) == ALONG_CUBE);

using Bits = std::uint64_t;

constexpr auto bits_of_number = [](double value) { return std::bit_cast<Bits>(value); };

} // namespace

LensKey lens_key(const Camera& camera, bool along_axis, const Eigen::Matrix3d& turn) {
    const LensModel& lens = *camera.lens;
    const Bits choices = static_cast<Bits>(lens.law) << 16 | static_cast<Bits>(camera.rows) << 9 |
                         static_cast<Bits>(along_axis) << 8 | static_cast<Bits>(camera.projection.convention.view_axes);
    LensKey key{{choices, static_cast<Bits>(camera.width), static_cast<Bits>(camera.height), bits_of_number(lens.fx),
                 bits_of_number(lens.fy), bits_of_number(lens.cx), bits_of_number(lens.cy)},
                {lens.k.size()},
                {},
                reinterpret_cast<std::uintptr_t>(lens.map.get())};
    std::ranges::transform(lens.k, key.coefficients.begin() + 1, bits_of_number);
    std::ranges::transform(turn.reshaped(), key.turn.begin(), bits_of_number);
    return key;
}

KernelLens::KernelLens(const Device& device, const Camera& camera, const LensAxes& axes) {
    if (!camera.lens)
        return;
    along_ = counted_along(camera);
    // Must rays be exact in their part along the view axis?
    const bool along_axis = along_ == Along::axis || has_plane_in_focus(camera);
    const lens::CameraLens lens(camera); // refuses what is none, also where the table is kept
    table_ = runtime::kept<LensTable>(device, lens_key(camera, along_axis, axes.turn), [&] {
        const lens::Patches patches = lens::patches_of(lens, camera.width, camera.height, along_axis);
        return std::make_shared<const LensTable>(
            LensTable{runtime::table(device, Element::u32, patches.tiles),
                      runtime::table(device, Element::f32, lens::patch_floats(patches, lens, axes.turn)),
                      patches.tiles_across, camera.lens->map});
    });
    const Eigen::Matrix3d to_view = axes.turn.inverse();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            parameters_.to_view[i][j] = pack_wide(to_view(i, j), device.options().arithmetic);
        parameters_.centre[i][0] = static_cast<float>(axes.centre[i]);
        parameters_.centre[i][1] = static_cast<float>(axes.centre[i] - static_cast<double>(parameters_.centre[i][0]));
    }
    parameters_.least_ahead = static_cast<float>(lens::least_ahead());
    parameters_.tiles = to_u32(table_->tiles_across);
}

runtime::Defines KernelLens::with_lens(runtime::Defines defines) const {
    defines.emplace_back("LENS", static_cast<bool>(table_));
    if (table_)
        defines.emplace_back("ALONG", static_cast<int>(along_));
    return defines;
}

} // namespace fathom
