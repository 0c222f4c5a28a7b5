#pragma once

#include "params.h"
#include "runtime/program.hpp"
#include "runtime/state.hpp"
#include "text.hpp"

#include <fathom/image.hpp>

namespace fathom::runtime {

/// Work-items in x and y; x is rounded up to whole groups, and the kernel checks its bounds.
struct Range {
    std::size_t x, y;
};

inline std::string argument_type(const Image& image) {
    switch (image.element()) {
    case Element::u8:
        return "uchar*";
    case Element::u16:
    case Element::f16:
        return "ushort*";
    case Element::u32:
        return "uint*";
    case Element::f32:
        return "float*";
    }
    return "?";
}
inline std::string argument_type(const params::grid_params&) {
    return "grid_params";
}
inline std::string argument_type(const params::depth_params&) {
    return "depth_params";
}
inline std::string argument_type(const params::ray_params&) {
    return "ray_params";
}
inline std::string argument_type(const params::normal_params&) {
    return "normal_params";
}

inline std::string argument_type(const params::split_params&) {
    return "split_params";
}
inline std::string argument_type(const params::occlusion_params&) {
    return "occlusion_params";
}
inline std::string argument_type(const params::circle_params&) {
    return "circle_params";
}
inline std::string argument_type(const params::near_field_params&) {
    return "near_field_params";
}
inline std::string argument_type(const params::blur_params&) {
    return "blur_params";
}
inline std::string argument_type(const params::layer_params&) {
    return "layer_params";
}
inline std::string argument_type(const params::part_params&) {
    return "part_params";
}
inline std::string argument_type(const params::behind_params&) {
    return "behind_params";
}
inline std::string argument_type(const params::mixed_params&) {
    return "mixed_params";
}

inline cl::Buffer argument_value(const Image& image) {
    return buffer_of(image);
}
template <typename Params>
const Params& argument_value(const Params& params) {
    return params;
}

/// PoCL takes a struct of the wrong size without a word, so the kernel's own declaration is compared once.
void check_arguments(Kernel& kernel, const std::vector<std::string>& types);

/// Starts a kernel: images and params in the order of its declaration.
/// Throws: Error when they are not what the kernel declares, or when the device refuses.
template <typename... Arguments>
void launch(const Device& device, Kernel& kernel, Range range, const Arguments&... arguments) {
    if (!kernel.checked)
        check_arguments(kernel, {argument_type(arguments)...});
    const auto group = static_cast<std::size_t>(device.options().group_size);
    try {
        cl_uint index = 0;
        (kernel.kernel.setArg(index++, argument_value(arguments)), ...);
        const std::size_t rounded = (range.x + group - 1) / group * group;
        queue_of(device).enqueueNDRangeKernel(kernel.kernel, cl::NullRange, cl::NDRange(rounded, range.y),
                                              cl::NDRange(group, 1));
    } catch (const cl::Error& error) {
        throw Error(
            text(device.info().name, " refused ", kernel.description, ": ", error.what(), " returned ", error.err()));
    }
}

} // namespace fathom::runtime
