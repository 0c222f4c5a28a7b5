// Masks for depth of field: one pass of kernels/dof_masks/dof_masks.cl, and the passes of near_field.cpp and
// mixed_pixels.cpp if they are asked for.

#include <fathom/dof_masks.hpp>

#include <fathom/linearize.hpp>

#include "operations/circle.hpp"
#include "operations/mixed_pixels.hpp"
#include "operations/near_field.hpp"
#include "operations/parameters.hpp"
#include "runtime/launched.hpp"
#include "runtime/scratch.hpp"

#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace fathom {
namespace {

void check(const CircleOfConfusion& coc, const DofMasksOptions& options, const DepthForm& form) {
    check_circle(coc, form);
    check_enum("sky", options.sky, {"blur", "sharp", "exclude"});
    require(std::isfinite(options.sharp_px) && options.sharp_px >= 0, "sharp_px = ", options.sharp_px,
            " must be finite and 0 or greater");
    require(std::isfinite(options.transition_px) && options.transition_px >= 0,
            "transition_px = ", options.transition_px, " must be finite and 0 or greater");
    require(options.max_coc_px > 0, "max_coc_px = ", options.max_coc_px, " must be greater than 0");
    require(options.tile_px >= 0 && options.tile_px <= 65536, "tile_px = ", options.tile_px,
            " must be 1 to 65536, or 0 for no tiles");
}

// One of the results: is it asked for, and how large is it?
struct Result {
    bool asked;
    const char* name;
    Image DofMasks::*image;
    Layout layout;
};

std::vector<Result> results_of(const StoredDepth& stored, const DofMasksOptions& options) {
    const int width = stored.image.width(), height = stored.image.height(), tile = std::max(options.tile_px, 1);
    const Layout pixels{width, height}, tiles{(width - 1) / tile + 1, (height - 1) / tile + 1};
    const std::vector<Result> all{{true, "coc", &DofMasks::coc, pixels},
                                  {options.weights, "near_weight", &DofMasks::near_weight, pixels},
                                  {options.weights, "focus_weight", &DofMasks::focus_weight, pixels},
                                  {options.weights, "far_weight", &DofMasks::far_weight, pixels},
                                  {options.max_near_coc, "max_near_coc", &DofMasks::max_near_coc, pixels},
                                  {options.near_alpha, "near_alpha", &DofMasks::near_alpha, pixels},
                                  {options.disocclusion, "disocclusion", &DofMasks::disocclusion, pixels},
                                  {options.mixed_pixels, "mixed_pixels", &DofMasks::mixed_pixels, pixels},
                                  {options.tile_px > 0, "tile_min_coc", &DofMasks::tile_min_coc, tiles},
                                  {options.tile_px > 0, "tile_max_coc", &DofMasks::tile_max_coc, tiles}};
    std::vector<Result> asked;
    std::ranges::copy_if(all, std::back_inserter(asked), &Result::asked);
    return asked;
}

void check_results(const StoredDepth& stored, const DofMasks& given, const std::vector<Result>& asked) {
    std::vector<NamedImage> others{{"the stored depth", stored.image}};
    for (const Result& result : asked) {
        const NamedImage named{result.name, given.*result.image};
        check_result(stored, named, Element::f32, result.layout, others);
        others.push_back(named);
    }
}

// A kernel that computes circles from stored depth, and what it reads them with.
struct CircleKernel {
    const StoredDepth& stored;
    DepthForm form;
    Rays view;
    const CircleOfConfusion& coc;
    const DofMasksOptions& options;
    int vector_width;

    CircleKernel(const StoredDepth& depth, const DepthForm& decoded, const CircleOfConfusion& circle,
                 const DofMasksOptions& asked)
        : stored(depth), form(decoded), view(needs_rays(form) ? camera_rays(depth.camera) : Rays{}), coc(circle),
          options(asked), vector_width(vector_width_for(depth.image.device(), depth.image.width())) {
        count_from_lens(form, coc);
    }

    // `more`: other results, each with where it lies.
    template <typename... More>
    void launch(const char* name, runtime::Defines defines, bool stream, runtime::Range range, const Image& result,
                const More&... more) const {
        const Device& device = stored.image.device();
        const Arithmetic arithmetic = device.options().arithmetic;
        runtime::Defines all = circle_defines(form, coc, view, stored.storage, vector_width, stream);
        all.insert(all.end(), defines.begin(), defines.end());
        runtime::launch(device, runtime::kernel(device, name, all), range, stored.image, result, more...,
                        grid_parameters(stored, result, 0, stored.image.width()),
                        depth_parameters(form, stored.storage, Background::inf, arithmetic),
                        ray_parameters(view, arithmetic), circle_parameters(form, coc, options, arithmetic));
    }
};

void circles_and_weights(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options,
                         const DepthForm& form, const DofMasks& masks) {
    const CircleKernel kernel(stored, form, coc, options);
    const runtime::Range range{
        static_cast<std::size_t>((stored.image.width() + kernel.vector_width - 1) / kernel.vector_width),
        static_cast<std::size_t>(stored.image.height())};
    const auto streams = [&](const Image& image) { return worth_streaming(image, kernel.vector_width); };
    const runtime::Defines weights{{"WEIGHTS", options.weights}};
    if (!options.weights)
        return kernel.launch("dof_masks", weights, streams(masks.coc), range, masks.coc);
    const Image &near = masks.near_weight, &focus = masks.focus_weight, &far = masks.far_weight;
    kernel.launch("dof_masks", weights, streams(masks.coc) && streams(near) && streams(focus) && streams(far), range,
                  masks.coc, near, place_parameters(near), focus, place_parameters(focus), far, place_parameters(far));
}

// Checks everything but the results.
DepthForm checked_form(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options) {
    check_stored(stored);
    DepthForm form = depth_form(stored.camera, stored.storage);
    check(coc, options, form);
    return form;
}

} // namespace

float widest_coc(const StoredDepth& stored, const CircleOfConfusion& circle, const DofMasksOptions& options) {
    const DepthForm form = checked_form(stored, circle, options);
    runtime::Scratch scratch(stored.image.device());
    const Image rows = scratch.image(Element::f32, {stored.image.height(), 1});
    CircleKernel(stored, form, circle, options)
        .launch("dof_largest", {}, false, {static_cast<std::size_t>(stored.image.height()), 1}, rows);
    std::vector<float> largest(static_cast<std::size_t>(stored.image.height()));
    rows.download(largest.data());
    return std::ranges::max(largest);
}

void dof_masks(const StoredDepth& stored, const DofMasks& results, const CircleOfConfusion& coc,
               const DofMasksOptions& options, const Launch& launch) {
    const DepthForm form = checked_form(stored, coc, options);
    const std::vector<Result> asked = results_of(stored, options);
    check_results(stored, results, asked);
    const runtime::Launched launched(stored.image.device(), launch);
    const int rows_at_once = near_field_rows(stored, options);
    if (options.mixed_pixels) // before the others: it may refuse the budget, and then nothing is written
        mixed_pixels(stored, results.mixed_pixels);
    circles_and_weights(stored, coc, options, form, results);
    near_field(stored, options, results, rows_at_once);
    launched.done();
}

DofMasks dof_masks(const StoredDepth& stored, const CircleOfConfusion& coc, const DofMasksOptions& options,
                   const Launch& launch) {
    checked_form(stored, coc, options);
    DofMasks masks;
    for (const Result& result : results_of(stored, options))
        masks.*result.image = Image(stored.image.device(), Element::f32, result.layout);
    dof_masks(stored, masks, coc, options, launch);
    return masks;
}

double depth_at(const StoredDepth& stored, int x, int y) {
    require(x >= 0 && y >= 0 && x < stored.image.width() && y < stored.image.height(), "pixel (", x, ", ", y,
            ") lies outside the image of ", stored.image.width(), " x ", stored.image.height());
    float depth;
    linearize(stored.region(x, y, 1, 1)).image.download(&depth);
    require(!std::isnan(depth), "pixel (", x, ", ", y, ") is invalid: it has no depth to focus on");
    return static_cast<double>(depth);
}

} // namespace fathom
