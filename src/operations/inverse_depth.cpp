// Inverse depth from stored depth: one pass of kernels/camera/inverse_depth.cl.

#include "operations/inverse_depth.hpp"

#include "camera/form.hpp"
#include "operations/bands.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"

namespace fathom {

namespace {

// Rows and columns with the margin: all of a row, to the next one's start. The last row's margin lies behind the row before it.
Layout with_margin(int width, int height) {
    constexpr int columns = params::depth_margin_columns, rows = params::depth_margin_rows;
    return {(width + columns - 1) / columns * columns + columns, height + 2 * rows + 1};
}

} // namespace

std::size_t inverse_depth_bytes(int width, int height) {
    return Image::allocation(Element::f32, with_margin(width, height));
}

Image image_of_inverse_depth(runtime::Scratch& scratch, int width, int height) {
    return scratch.image(Element::f32, with_margin(width, height))
        .region(params::depth_margin_columns, params::depth_margin_rows, width, height);
}

Image inverse_depth(runtime::Scratch& scratch, const StoredDepth& stored, Background background) {
    check_stored(stored);
    const int width = stored.image.width(), height = stored.image.height();
    const Image result = image_of_inverse_depth(scratch, width, height);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(straightened(stored.camera), stored.storage);
    const Rays view = straight_rays(stored.camera);
    const KernelLens lens(device, stored.camera);
    const int vector_width = vector_width_for(device, width);
    runtime::Defines defines = lens.with_lens(decoder_defines(form, view, stored.storage, vector_width, false));
    defines.insert(defines.end(), {{"AS_DISTANCE", false}, {"PERSPECTIVE", form.perspective}});
    runtime::Kernel& kernel = runtime::kernel(device, "inverse_depth", defines, "decode");
    lens.launch(device, kernel, range_of(width, with_margin(width, height).height, vector_width), stored.image, result,
                grid_parameters(stored, result, 0, width),
                depth_parameters(form, stored.storage, background, arithmetic), ray_parameters(view, arithmetic));
    return result;
}

void over_inverse_depth(
    const StoredDepth& stored, Background background, int reach, std::string_view what, const Image& result,
    const std::function<void(const Image& depth, const Image& made, const params::grid_params& grid)>& run) {
    const int width = stored.image.width(), height = stored.image.height();
    const RowNeeds rows{
        .begin = 0,
        .end = height,
        .height = height,
        .reaches = {reach},
        .bytes = [&](int read, int) { return inverse_depth_bytes(width, read); },
        .least = 64,
    };
    for (const Band& band :
         bands(rows, budget_of(stored.image.device()), text(what, " of ", ImageSize{width, height}, " pixels"))) {
        runtime::Scratch scratch(result.device());
        const StoredDepth part = stored.region(0, band.first, width, band.last - band.first);
        const Image depth = inverse_depth(scratch, part, background),
                    made = result.region(0, band.begin, width, band.end - band.begin);
        params::grid_params grid = grid_parameters(depth, made, 0, width, part.x, part.y);
        grid.y_begin = to_u32(band.begin - band.first);
        run(depth, made, grid);
    }
}

} // namespace fathom
