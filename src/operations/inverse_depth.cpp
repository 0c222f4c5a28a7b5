// Inverse depth from stored depth: one pass of kernels/inverse_depth.cl.

#include "operations/inverse_depth.hpp"

#include "operations/parameters.hpp"

namespace fathom {

void inverse_depth(const StoredDepth& stored, const EyeRays& eye, const Image& result, Background background) {
    check_stored(stored);
    check_result(stored, result, 1);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = camera_rays(stored.camera);
    const int vector_width = vector_width_for(device, result.width());
    runtime::Defines choices = decoder_defines(form, view, stored.storage, vector_width, false);
    choices.emplace_back("PERSPECTIVE", eye.perspective);
    runtime::Kernel& kernel = runtime::kernel(device, "inverse_depth", choices);
    const auto columns = static_cast<std::size_t>((result.width() + vector_width - 1) / vector_width);
    runtime::launch(device, kernel, {columns, static_cast<std::size_t>(result.height())}, stored.image, result,
                    grid_parameters(stored, result, 0, result.width()),
                    depth_parameters(form, stored.storage, background, arithmetic),
                    ray_parameters(view, form.scale, arithmetic));
}

} // namespace fathom
