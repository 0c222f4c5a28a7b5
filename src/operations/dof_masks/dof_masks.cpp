// Masks for depth of field: one pass of kernels/dof_masks/dof_masks.cl, and the passes of near_field.cpp and those for mixed pixels
// if they are asked for.

#include <fathom/dof_masks.hpp>

#include "camera/form.hpp"
#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/dof_masks.hpp"
#include "operations/bands.hpp"
#include "operations/dof_masks/dof_masks.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"
#include "runtime/scratch.hpp"

#include <fathom/tiles.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace fathom {
namespace {

void check(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options,
           const DepthForm& form) {
    check_circle(coc, form);
    describe(description::Check{}, options);
    if (!stored.camera.lens)
        return;
    const char* const lens = to_string(stored.camera.lens->law);
    for (const auto& [asked, name] : {std::pair{options.max_near_coc, "max_near_coc"},
                                      {options.near_alpha, "near_alpha"},
                                      {options.disocclusion, "disocclusion"}})
        require(!asked, name, " looks around a pixel for circles of one shape, and the lens ", lens,
                " gives them another one in each part of the image; leave it out");
    require(!options.mixed_pixels, "mixed_pixels looks along straight lines, and the lens ", lens,
            " bends them; leave it out");
}

void check_results(const StoredDepth& stored, const DofMasks& given, const DofMasksOptions& options) {
    description::DofMasksCall call{.options = options, .results = given};
    check_results(stored, description::results_of(call, stored), {});
}

// A kernel that computes circles from stored depth, and what it reads them with.
struct CircleKernel {
    const StoredDepth& stored;
    DepthForm form;
    Rays view;
    KernelLens lens;
    const CircleOfConfusion& coc;
    const DofMasksOptions& options;
    int vector_width;

    CircleKernel(const StoredDepth& depth, const DepthForm& decoded, const CircleOfConfusion& circle,
                 const DofMasksOptions& asked)
        : stored(depth), form(decoded), view(is_along_ray(form) ? camera_rays(depth.camera) : Rays{}),
          lens(depth.image.device(), depth.camera), coc(circle), options(asked),
          vector_width(vector_width_for(depth.image.device(), depth.image.width())) {
        count_from_lens(form, coc);
    }

    // `more`: other results, each with where it lies.
    template <typename... More>
    void launch(const char* name, runtime::Defines defines, bool stream, runtime::Range range, const Image& result,
                const More&... more) const {
        const Device& device = stored.image.device();
        const Arithmetic arithmetic = device.options().arithmetic;
        runtime::Defines all = lens.with_lens(decoder_defines(form, view, stored.storage, vector_width, stream));
        all.insert(all.end(), {{"CIRCLE", static_cast<int>(circle_form(form, coc))},
                               {"TELECENTRIC", coc.telecentric},
                               {"PLANE_IN_FOCUS", has_plane_in_focus(stored.camera)}});
        all.insert(all.end(), defines.begin(), defines.end());
        lens.launch(device, runtime::kernel(device, name, all), range, stored.image, result, more...,
                    grid_parameters(stored, result, 0, stored.image.width()),
                    depth_parameters(form, stored.storage, Background::inf, arithmetic),
                    ray_parameters(view, arithmetic), circle_parameters(form, coc, options, arithmetic));
    }
};

// The circles of some rows, and all weights or none.
void circles_and_weights(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options,
                         const DepthForm& form, const DofMasks& masks) {
    const CircleKernel kernel(stored, form, coc, options);
    const runtime::Range range = range_of(stored.image.width(), stored.image.height(), kernel.vector_width);
    const auto streams = [&](const Image& image) { return worth_streaming(image, kernel.vector_width); };
    const Image &near = masks.near_weight, &focus = masks.focus_weight, &far = masks.far_weight;
    const runtime::Defines weights{{"WEIGHTS", static_cast<bool>(near)}};
    if (!near)
        return kernel.launch("dof_masks", weights, streams(masks.coc), range, masks.coc);
    kernel.launch("dof_masks", weights, streams(masks.coc) && streams(near) && streams(focus) && streams(far), range,
                  masks.coc, near, place_parameters(near), focus, place_parameters(focus), far, place_parameters(far));
}

constexpr Image DofMasks::*all_weights[] = {&DofMasks::near_weight, &DofMasks::focus_weight, &DofMasks::far_weight};

// Bytes of the weights that nobody asks for beside another one.
std::size_t unasked_weight_bytes(int width, int height, const DofMasksOptions& options) {
    const int asked = options.near_weight + options.focus_weight + options.far_weight;
    return asked == 0 ? 0 : static_cast<std::size_t>(3 - asked) * Image::allocation(Element::f32, {width, height});
}

// The circles, and the weights that are asked for. The kernel makes all three, so that the others need a place, too.
void circles_and_asked_weights(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options,
                               const DepthForm& form, const DofMasks& masks) {
    const int width = stored.image.width(), height = stored.image.height();
    if (unasked_weight_bytes(width, height, options) == 0)
        return circles_and_weights(stored, coc, options, form, masks);
    const RowNeeds all{
        0, height, height, {0}, [&](int, int made) { return unasked_weight_bytes(width, made, options); }};
    for (const Band& band : bands(all, budget_of(stored.image.device()), "dof_masks")) {
        runtime::Scratch scratch(stored.image.device());
        const int rows = band.end - band.begin;
        DofMasks part{.coc = masks.coc.region(0, band.begin, width, rows)};
        for (const auto weight : all_weights)
            part.*weight = masks.*weight ? (masks.*weight).region(0, band.begin, width, rows)
                                         : scratch.image(Element::f32, {width, rows});
        circles_and_weights(stored.region(0, band.begin, width, rows), coc, options, form, part);
    }
}

// Checks everything but the results.
DepthForm checked_form(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options) {
    check_stored(stored);
    DepthForm form = depth_form(straightened(stored.camera), stored.storage);
    check(stored, coc, options, form);
    return form;
}

} // namespace

float widest_coc(const StoredDepth& stored, const CircleOfConfusion& circle, const DofMasksOptions& options) {
    const DepthForm form = checked_form(stored, circle, options);
    runtime::Scratch scratch(stored.image.device());
    const Image rows = scratch.image(Element::f32, {stored.image.height(), 1});
    CircleKernel(stored, form, circle, options)
        .launch("dof_largest", {}, false, {static_cast<std::size_t>(stored.image.height()), 1}, rows);
    return std::ranges::max(runtime::on_host<float>(rows));
}

void dof_masks(const StoredDepth& stored, const DofMasks& results, const CircleOfConfusion& circle,
               const DofMasksOptions& options, const Launch& launch) {
    const DepthForm form = checked_form(stored, circle, options);
    check_results(stored, results, options);
    const runtime::Launched launched(stored.image.device(), launch);
    const std::vector<Band> weighed = bands_of_weights(stored, options);
    if (options.mixed_pixels) // before the others: where it refuses the budget, no result has been written
        mixed_pixels(stored, results.mixed_pixels);
    circles_and_asked_weights(stored, circle, options, form, results);
    near_field(stored, options, results, weighed);
    launched.done();
}

DofMasks dof_masks(const StoredDepth& stored, const CircleOfConfusion& circle, const DofMasksOptions& options,
                   const Launch& launch) {
    checked_form(stored, circle, options);
    return run_into_new_images(description::DofMasksCall{.circle = circle, .options = options}, stored, launch).results;
}

Reach reach(const Tile& tile, const DofMasksOptions& options, double widest_coc_px) {
    describe(description::Check{}, options);
    Reach reach;
    if (options.max_near_coc || options.near_alpha || options.disocclusion) {
        const double disc = std::min(widest_coc_px, options.max_coc_px) / 2;
        const PixelScale scale = pixel_scale(tile.camera);
        reach = {static_cast<int>(std::ceil(disc)) + 1,
                 static_cast<int>(std::ceil(disc * static_cast<double>(scale.y / scale.x))) + 1};
    }
    if (options.mixed_pixels)
        reach = {std::max(reach.columns, mixed_pixels_reach), std::max(reach.rows, mixed_pixels_reach)};
    return reach;
}

std::size_t bytes(const Tile& tile, const DofMasksOptions& options) {
    describe(description::Check{}, options);
    const int width = tile.pixels.width, height = tile.pixels.height;
    return std::max({unasked_weight_bytes(width, height, options),
                     near_field_bytes(tile.pixels, options, rows_of_blocks(tile.pixels)),
                     options.mixed_pixels ? inverse_depth_bytes(width, height) : 0});
}

// Pixels between two surfaces: kernels/camera/inverse_depth.cl, then kernels/dof_masks/mixed_pixels.cl.

void mixed_pixels(const StoredDepth& stored, const Image& result) {
    const Device& device = stored.image.device();
    const int width = result.width();
    const CentreRays rays = centre_rays(camera_rays(stored.camera));
    const InverseDepthError error = inverse_depth_error(stored.camera, stored.storage);
    // A pixel's width is a fraction of its distance under a perspective, and 1/z changes by the fraction that z changes by.
    const auto& moving = rays.perspective ? rays.direction : rays.origin;
    const auto least = static_cast<float>(mixed_pixels_min_widths * std::sqrt(moving.leftCols<2>().squaredNorm() / 2));
    const int vector_width = vector_width_for(device, width);
    runtime::Kernel& kernel =
        runtime::kernel(device, "mixed_pixels", {{"V", vector_width}, {"STREAM", 0}, {"CHANNELS", result.channels()}});
    const params::mixed_params parameters{error.constant,
                                          error.linear,
                                          error.quadratic,
                                          rays.perspective ? 0 : least,
                                          rays.perspective ? least : 0,
                                          static_cast<float>(mixed_pixels_min_step)};
    // Where the far plane is finite its depth is averaged like any other.
    over_inverse_depth(stored, Background::decode, mixed_pixels_reach, "mixed_pixels", result,
                       [&](const Image& depth, const Image& made, const params::grid_params& grid) {
                           runtime::launch(device, kernel, range_of(width, made.height(), vector_width), depth, made,
                                           grid, parameters);
                       });
}

} // namespace fathom
