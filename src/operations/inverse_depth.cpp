// Inverse depth from stored depth: one pass of kernels/inverse_depth.cl.

#include "operations/inverse_depth.hpp"

#include "operations/parameters.hpp"

namespace fathom {

Image inverse_depth(runtime::Scratch& scratch, const StoredDepth& stored, const CentreRays& rays,
                    Background background) {
    check_stored(stored);
    const int width = stored.image.width(), height = stored.image.height();
    constexpr int columns = params::depth_margin_columns, rows = params::depth_margin_rows;
    const int padded_width =
        (width + columns - 1) / columns * columns + columns; // all of a row, to the next one's start
    const int padded_rows = height + 2 * rows + 1;           // the last one's margin lies behind the row before it
    const Image result = scratch.image(Element::f32, {padded_width, padded_rows}).region(columns, rows, width, height);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = camera_rays(stored.camera);
    const int vector_width = vector_width_for(device, width);
    runtime::Defines defines = decoder_defines(form, view, stored.storage, vector_width, false);
    defines.emplace_back("PERSPECTIVE", rays.perspective);
    runtime::Kernel& kernel = runtime::kernel(device, "inverse_depth", defines);
    const auto vectors = static_cast<std::size_t>((width + vector_width - 1) / vector_width);
    runtime::launch(device, kernel, {vectors, static_cast<std::size_t>(padded_rows)}, stored.image, result,
                    grid_parameters(stored, result, 0, width),
                    depth_parameters(form, stored.storage, background, arithmetic), ray_parameters(view, arithmetic));
    return result;
}

} // namespace fathom
