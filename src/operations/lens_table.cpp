// What kernels read of a lens: the patches of kernels/camera/patch.h, made once for a camera and kept.

#include "operations/lens_table.hpp"

#include "lens/patches.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/kept.hpp"

#include <bit>

namespace fathom {
namespace {

using Bits = std::uint64_t;

// All that the patches depend on.
struct LensKey {
    std::array<Bits, 7> numbers;
    std::array<Bits, 13> coefficients; // how many, and they
    std::array<Bits, 9> turn;
};

constexpr auto bits_of_number = [](double value) { return std::bit_cast<Bits>(value); };

LensKey key_of(const Camera& camera, bool along_axis, const Eigen::Matrix3d& turn) {
    const LensModel& lens = *camera.lens;
    const Bits choices = static_cast<Bits>(lens.law) << 16 | static_cast<Bits>(camera.rows) << 9 |
                         static_cast<Bits>(along_axis) << 8 | static_cast<Bits>(camera.projection.convention.view_axes);
    LensKey key{{choices, static_cast<Bits>(camera.width), static_cast<Bits>(camera.height), bits_of_number(lens.fx),
                 bits_of_number(lens.fy), bits_of_number(lens.cx), bits_of_number(lens.cy)},
                {lens.k.size()},
                {}};
    std::ranges::transform(lens.k, key.coefficients.begin() + 1, bits_of_number);
    std::ranges::transform(turn.reshaped(), key.turn.begin(), bits_of_number);
    return key;
}

bool counts_along_axis(const Camera& camera) {
    return camera.encoding != Encoding::ray_distance && camera.along == Along::axis;
}

// The lens's own depths are distances, whichever way they count; what turns stored values into them is that of a pinhole.
DepthForm form_of_distances(const Camera& camera, Storage storage) {
    require(camera.encoding != Encoding::window, "the encoding window is of a projection, and the camera has the lens ",
            to_string(camera.lens->law),
            "; say what the values are: view-z, ray-distance, linear, inverse or another one");
    require(!camera.from_near_plane, "from_near_plane is of a projection, and the camera has the lens ",
            to_string(camera.lens->law), "; leave it out");
    Camera straight = camera;
    straight.lens.reset();
    straight.along = Along::axis;
    straight.projection = perspective(1, 1, {1, 2}, camera.projection.convention);
    if (camera.encoding == Encoding::ray_distance)
        straight.encoding = Encoding::view_z;
    return depth_form(straight, storage);
}

} // namespace

ThroughLens::ThroughLens(const StoredDepth& stored, const Eigen::Matrix3d& turn, const Eigen::Vector3d& centre,
                         int vector_width, bool stream)
    : form(form_of_distances(stored.camera, stored.storage)) {
    const Camera& camera = stored.camera;
    const Device& device = stored.image.device();
    const bool along_axis = counts_along_axis(camera);
    const lens::CameraLens lens(camera); // refuses what is none, also where the table is kept
    table = runtime::kept<LensTable>(device, key_of(camera, along_axis, turn), [&] {
        const lens::Patches patches = lens::patches_of(lens, camera.width, camera.height, along_axis);
        return std::make_shared<const LensTable>(LensTable{
            runtime::table(device, Element::u32, patches.tiles),
            runtime::table(device, Element::f32, lens::patch_floats(patches, lens, turn)), patches.tiles_across});
    });
    parameters = {};
    for (int i = 0; i < 3; ++i) {
        parameters.centre[i][0] = static_cast<float>(centre[i]);
        parameters.centre[i][1] = static_cast<float>(centre[i] - static_cast<double>(parameters.centre[i][0]));
    }
    parameters.least_ahead = static_cast<float>(lens::least_ahead());
    parameters.tiles = to_u32(table->tiles_across);
    defines = decoder_defines(form, Rays{}, stored.storage, vector_width, stream);
    defines.emplace_back("ALONG_AXIS", along_axis);
}

} // namespace fathom
