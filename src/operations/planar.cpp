// Planar depth from stored depth: one pass of kernels/planar.cl.

#include "operations/planar.hpp"

#include "operations/parameters.hpp"

namespace fathom {

void planar(const StoredDepth& stored, const EyeRays& eye, const Image& result) {
    check_stored(stored);
    check_result(stored, result, 1);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = rays(stored.camera);
    const int lanes = lanes_for(device, result.width());
    runtime::Choices choices = decoder_choices(form, view, stored.storage, lanes, false);
    choices.emplace_back("PERSPECTIVE", eye.perspective);
    runtime::Kernel& kernel = runtime::kernel(device, "planar", choices);
    const auto columns = static_cast<std::size_t>((result.width() + lanes - 1) / lanes);
    runtime::launch(device, kernel, {columns, static_cast<std::size_t>(result.height())}, stored.image, result,
                    grid_parameters(stored, result, 0, result.width()),
                    depth_parameters(form, stored.storage, Background::inf, arithmetic),
                    ray_parameters(view, form.scale, arithmetic));
}

} // namespace fathom
