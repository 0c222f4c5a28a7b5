// Masks for depth of field: one pass of kernels/dof_masks.cl, and those of near_layer.cpp where they are asked for.

#include <fathom/dof_masks.hpp>

#include <fathom/linearize.hpp>

#include "operations/circle.hpp"
#include "operations/near_layer.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"

#include <cmath>

namespace fathom {
namespace {

void check(const DofMasksOptions& options, const DepthForm& form) {
    check_circle(options.circle, form);
    require(std::isfinite(options.sharp_px) && options.sharp_px >= 0,
            text("sharp_px = ", options.sharp_px, " must be 0 or greater"));
    require(std::isfinite(options.transition_px) && options.transition_px >= 0,
            text("transition_px = ", options.transition_px, " must be 0 or greater"));
    require(options.largest_px > 0, text("largest_px = ", options.largest_px, " must be greater than 0"));
    require(options.tile_px >= 0 && options.tile_px <= 65536,
            text("tile_px = ", options.tile_px, " must be 1 to 65536, or 0 for no tiles"));
}

} // namespace

DofMasks dof_masks(const StoredDepth& stored, const DofMasksOptions& options) {
    const Device& device = stored.image.device();
    check_stored(stored);
    DepthForm form = depth_form(stored.camera, stored.storage);
    check(options, form);
    Rays view = form.form == Form::ray_distance ? rays(stored.camera) : Rays{};
    count_from_lens(form, view, options.circle);
    const Arithmetic arithmetic = device.options().arithmetic;
    const int width = stored.image.width(), height = stored.image.height();

    const Layout layout{width, height};
    const auto image = [&] { return Image(device, Element::f32, layout); };
    DofMasks masks;
    masks.circle = image();
    const int lanes = lanes_for(device, width);
    runtime::Choices choices =
        circle_choices(form, options.circle, view, stored.storage, lanes, worth_streaming(masks.circle, lanes));
    choices.emplace_back("WEIGHTS", options.weights);
    runtime::Kernel& kernel = runtime::kernel(device, "dof_masks", choices);
    const runtime::Range range{static_cast<std::size_t>((width + lanes - 1) / lanes), static_cast<std::size_t>(height)};
    const auto launch = [&](const auto&... results) { // which all have the same layout
        runtime::launch(device, kernel, range, stored.image, results...,
                        grid_parameters(stored, masks.circle, 0, width),
                        depth_parameters(form, stored.storage, Background::inf, arithmetic),
                        ray_parameters(view, form.scale, arithmetic), circle_parameters(form, options, arithmetic));
    };
    if (options.weights) {
        masks.near = image();
        masks.focus = image();
        masks.far = image();
        launch(masks.circle, masks.near, masks.focus, masks.far);
    } else {
        launch(masks.circle);
    }
    near_layer(stored, options, masks);
    return masks;
}

double depth_at(const StoredDepth& stored, int x, int y) {
    require(x >= 0 && y >= 0 && x < stored.image.width() && y < stored.image.height(),
            text("pixel (", x, ", ", y, ") lies outside the image of ", stored.image.width(), " x ",
                 stored.image.height()));
    float depth;
    linearize(stored.region(x, y, 1, 1)).image.download(&depth);
    require(!std::isnan(depth), text("pixel (", x, ", ", y, ") is no surface: it has no depth to focus on"));
    return static_cast<double>(depth);
}

} // namespace fathom
