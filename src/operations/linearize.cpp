// View depth from stored depth: one pass of kernels/linearize.cl.

#include <fathom/linearize.hpp>

#include "operations/parameters.hpp"

#include <stdexcept>

namespace fathom {
namespace {

void run(const StoredDepth& stored, const Image& result, const LinearizeOptions& options, int begin, int end,
         int vector_width, bool stream) {
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = form.form == Form::ray_distance ? camera_rays(stored.camera) : Rays{};
    runtime::Kernel& kernel =
        runtime::kernel(device, "linearize", decoder_defines(form, view, stored.storage, vector_width, stream));
    const auto columns = static_cast<std::size_t>((end - begin + vector_width - 1) / vector_width);
    runtime::launch(device, kernel, {columns, static_cast<std::size_t>(result.height())}, stored.image, result,
                    grid_parameters(stored, result, begin, end),
                    depth_parameters(form, stored.storage, options.background, arithmetic),
                    ray_parameters(view, form.scale, arithmetic));
}

} // namespace

void linearize(const StoredDepth& stored, const Image& view_depth, const LinearizeOptions& options) {
    check_stored(stored);
    check_result(stored, view_depth, 1);
    if (stored.image.overlaps(view_depth)) {
        throw std::invalid_argument("the result shares memory with the stored depth: use linearize_in_place");
    }
    const int width = view_depth.width();
    const int vector_width = vector_width_for(stored.image.device(), width);
    run(stored, view_depth, options, 0, width, vector_width, worth_streaming(view_depth, vector_width));
}

ViewDepth linearize(const StoredDepth& stored, const LinearizeOptions& options) {
    check_stored(stored);
    const Image result(stored.image.device(), Element::f32, {stored.image.width(), stored.image.height()});
    linearize(stored, result, options);
    return {result, stored.camera, stored.x, stored.y};
}

ViewDepth linearize_in_place(const StoredDepth& stored, const LinearizeOptions& options) {
    check_stored(stored);
    if (stored.storage != Storage::float32) {
        throw std::invalid_argument(std::string("only float32 depth can be linearized in place, not ") +
                                    to_string(stored.storage));
    }
    // Groups that overlap would decode a pixel twice: what is left of whole groups is done lane by lane.
    const int width = stored.image.width();
    const int vector_width = vector_width_for(stored.image.device(), width);
    const int whole = width / vector_width * vector_width;
    run(stored, stored.image, options, 0, whole, vector_width, false);
    if (whole < width)
        run(stored, stored.image, options, whole, width, 1, false);
    return {stored.image, stored.camera, stored.x, stored.y};
}

} // namespace fathom
