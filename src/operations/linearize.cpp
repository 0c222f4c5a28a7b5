// View depth from stored depth: one pass of kernels/camera/linearize.cl.

#include <fathom/linearize.hpp>

#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/linearize.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "runtime/launch.hpp"

namespace fathom {
namespace {

void run(const StoredDepth& stored, const Image& result, const LinearizeOptions& options, int begin, int end,
         int vector_width, bool stream) {
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const bool as_distance = options.as == Along::ray;
    const runtime::Range range = range_of(end - begin, result.height(), vector_width);
    const DepthForm form = depth_form(straightened(stored.camera), stored.storage);
    const Rays view = as_distance || is_along_ray(form) ? straight_rays(stored.camera) : Rays{};
    const KernelLens lens(device, stored.camera);
    runtime::Defines defines = lens.with_lens(decoder_defines(form, view, stored.storage, vector_width, stream));
    defines.insert(defines.end(), {{"AS_DISTANCE", as_distance}, {"PERSPECTIVE", form.perspective}});
    lens.launch(device, runtime::kernel(device, "linearize", defines, "decode"), range, stored.image, result,
                grid_parameters(stored, result, begin, end),
                depth_parameters(form, stored.storage, options.background, arithmetic),
                ray_parameters(view, arithmetic));
}

// Groups that overlap would decode a pixel twice, so the columns after the last whole group are done pixel by pixel.
void run_in_place(const StoredDepth& stored, const LinearizeOptions& options) {
    const int width = stored.image.width();
    const int vector_width = vector_width_for(stored.image.device(), width);
    const int whole = width / vector_width * vector_width;
    run(stored, stored.image, options, 0, whole, vector_width, false);
    if (whole < width)
        run(stored, stored.image, options, whole, width, 1, false);
}

} // namespace

void linearize(const StoredDepth& stored, const Image& result, const LinearizeOptions& options, const Launch& launch) {
    check_stored(stored);
    describe(description::Check{}, options);
    const bool in_place = stored.storage == Storage::float32 && result.same_as(stored.image);
    if (!in_place)
        check_result(stored, result, 1);
    const runtime::Launched launched(stored.image.device(), launch);
    if (in_place) {
        run_in_place(stored, options);
    } else {
        const int width = result.width();
        const int vector_width = vector_width_for(stored.image.device(), width);
        run(stored, result, options, 0, width, vector_width, worth_streaming(result, vector_width));
    }
    launched.done();
}

ViewDepth linearize(const StoredDepth& stored, const LinearizeOptions& options, const Launch& launch) {
    check_stored(stored);
    const Image result = run_into_new_images(description::LinearizeCall{.options = options}, stored, launch).result;
    return {result, stored.camera, stored.x, stored.y};
}

} // namespace fathom
