// Fog over a picture: one pass of kernels/fog/fog.cl.

#include <fathom/fog.hpp>

#include "camera/form.hpp"
#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/fog.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

namespace fathom {
namespace {

using Real = long double;

// log2 of no density: so far below any other that the kernel makes 0 of it.
constexpr Real nothing = -1e6L;

// How much the inverse depth bends, of itself, where the fog's part changes by a step: the part is 1 - exp(-D (L - start)), and
// L times its derivative is largest at a distance of 1/D, or where the fog begins.
float least_bend(const FogOptions& options) {
    const double begin = options.density * options.start;
    return static_cast<float>(1 / (params::fog_steps * (begin < 1 ? std::exp(begin - 1) : begin)));
}

void check(const StoredDepth& stored, const Image& color, const FogOptions& options) {
    check_stored(stored);
    check_picture(stored, {"color", color}, upsample_to_picture);
    describe(description::Check{}, options);
    require(options.height_falloff == 0 || stored.camera.view,
            "height fog needs the camera's view matrix, and it has none");
}

// The rays counted from the camera centre, in the form that the camera's own have.
Rays from_centre(const Rays& rays) {
    const CentreRays centred = centre_rays(rays);
    return {.origin = centred.origin,
            .direction = centred.direction,
            .w_is_depth = rays.w_is_depth,
            .depth = centred.depth,
            .centre_depth = centred.centre_depth};
}

// What kernels/fog/fog.cl reads of a lens's rays: as y, how much a unit of their length rises in the world.
LensAxes rise_of_rays(const Camera& camera, const FogOptions& options) {
    LensAxes axes;
    if (options.height_falloff > 0) {
        const Eigen::RowVector3d rise =
            options.up.normalized().transpose() *
            rays_in_world(axes_of_view(), *camera.view, Eigen::Vector3d::Zero()).direction.cast<double>();
        axes.turn.row(0) = rise.unitOrthogonal(); // two that have a way back, whatever the third is
        axes.turn.row(1) = rise;
        axes.turn.row(2) = axes.turn.row(0).cross(rise);
    }
    return axes;
}

params::fog_params fog_parameters(const Camera& camera, const DepthForm& form, const Rays& centred,
                                  const FogOptions& options, Arithmetic arithmetic) {
    params::fog_params p{};
    const Real per_ln_2 = std::numbers::log2e_v<Real>, density = options.density * per_ln_2;
    if (options.height_falloff > 0) {
        const Rays world = rays_in_world(centred, *camera.view, Eigen::Vector3d::Zero());
        const Eigen::Matrix<Real, 1, 3> up = options.up.normalized().cast<Real>().transpose();
        const Real falloff = options.height_falloff * per_ln_2;
        Eigen::Matrix<Real, 1, 3> at_centre = -falloff * (up * world.origin),
                                  per_step = -falloff * (up * world.direction);
        if (camera.lens) // whose rays come as how much they rise
            per_step << 0, -falloff, 0;
        at_centre(2) += falloff * options.reference_height + (density > 0 ? std::log2(density) : nothing);
        for (int i = 0; i < 3; ++i) {
            p.at_centre[i] = pack_wide(at_centre(i), arithmetic);
            p.per_step[i] = pack_wide(per_step(i), arithmetic);
        }
    }
    p.density = static_cast<float>(density);
    p.start = pack_wide(options.start, arithmetic);
    for (std::size_t i = 0; i < 3; ++i)
        p.color[i] = static_cast<float>(options.fog_color[i]);
    p.max_opacity = static_cast<float>(options.max_opacity);
    p.sky = options.density > 0 ? std::numeric_limits<float>::infinity() : 0;
    p.keep_sky = options.sky == FogSky::keep ? ~params::u32{0} : 0;
    p.least_bend = options.whole_pixels ? std::numeric_limits<float>::infinity() : least_bend(options);
    const bool is_inverse = form.form == Form::reciprocal || form.form == Form::reciprocal_affine ||
                            form.form == Form::inverse_ray_distance;
    const Affine& length = is_inverse ? form.denominator : form.numerator;
    p.rough_scale = static_cast<float>(length[0]);
    p.rough_offset = static_cast<float>(length[3]);
    return p;
}

} // namespace

void fog(const StoredDepth& stored, const Image& color, const Image& result, const FogOptions& options,
         const Launch& launch) {
    check(stored, color, options);
    check_result(stored, {"the result", result}, color.element(), {color.width(), color.height(), color.channels()},
                 {{"the stored depth", stored.image}, {"color", color}});
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(straightened(stored.camera), stored.storage);
    const Rays rays = straight_rays(stored.camera), centred = stored.camera.lens ? axes_of_view() : from_centre(rays);
    const KernelLens lens(device, stored.camera,
                          stored.camera.lens ? rise_of_rays(stored.camera, options) : LensAxes{});

    const int width = result.width(), height = result.height(), vector_width = vector_width_for(device, width);
    const bool stream = result.element() == Element::f32 && worth_streaming(result, vector_width);
    auto defines = lens.with_lens(decoder_defines(form, rays, stored.storage, vector_width, stream));
    defines.insert(defines.end(), {{"CHANNELS", color.channels()},
                                   {"ELEMENT", element_define(color.element())},
                                   {"HEIGHT", options.height_falloff > 0},
                                   {"START", options.start > 0},
                                   {"PREMULTIPLIED", options.alpha == FogAlpha::premultiplied}});
    const runtime::Launched launched(device, launch);
    lens.launch(device, runtime::kernel(device, "fog", defines), range_of(width, height, vector_width), stored.image,
                color, result, grid_parameters(stored, result, 0, width),
                params::source_params{color.offset(), to_u32(color.row_stride()), to_u32(color.channels())},
                depth_parameters(form, stored.storage, Background::inf, arithmetic), ray_parameters(rays, arithmetic),
                ray_parameters(centred, arithmetic), fog_parameters(stored.camera, form, centred, options, arithmetic));
    launched.done();
}

Image fog(const StoredDepth& stored, const Image& color, const FogOptions& options, const Launch& launch) {
    check(stored, color, options);
    return run_into_new_images(description::FogCall{.color = color, .options = options}, stored, launch).result;
}

} // namespace fathom
