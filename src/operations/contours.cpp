// Contour lines of depth: one pass of kernels/contours/contours.cl.

#include <fathom/contours.hpp>

#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/contours.hpp"
#include "operations/parameters.hpp"
#include "runtime/launched.hpp"

namespace fathom {

void contours(const StoredDepth& stored, const Image& result, const ContoursOptions& options, const Launch& launch) {
    check_stored(stored);
    describe(description::Check{}, options);
    check_result(stored, result, 1);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = is_along_ray(form) ? camera_rays(stored.camera) : Rays{};
    const runtime::Launched launched(device, launch);
    const int width = result.width(), vector_width = vector_width_for(device, width);
    runtime::launch(device,
                    runtime::kernel(device, "contours",
                                    decoder_defines(form, view, stored.storage, vector_width,
                                                    worth_streaming(result, vector_width))),
                    range_of(width, result.height(), vector_width), stored.image, result,
                    grid_parameters(stored, result, 0, width),
                    depth_parameters(form, stored.storage, Background::nan, arithmetic),
                    ray_parameters(view, arithmetic), params::contours_params{static_cast<float>(1 / options.step)});
    launched.done();
}

Image contours(const StoredDepth& stored, const ContoursOptions& options, const Launch& launch) {
    check_stored(stored);
    const Image result(stored.image.device(), Element::f32, {stored.image.width(), stored.image.height()});
    contours(stored, result, options, launch);
    return result;
}

} // namespace fathom
