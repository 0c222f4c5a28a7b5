// Host side of line_sweep.cl and obscurance.cl.

#include "ssao_rivals.hpp"

#include "runtime/launch.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

const std::map<std::string, std::string>& fathom_rival_files(); // generated from the kernels beside this file

namespace fathom::bench {
namespace {

constexpr int bands = 64; // of lines that are swept at once

params::u32 u32(std::integral auto value) {
    return static_cast<params::u32>(value);
}

params::grid_params grid(const Image& source, const Image& target) {
    return {.source_offset = source.offset(),
            .target_offset = target.offset(),
            .source_stride = u32(source.row_stride()),
            .target_stride = u32(target.row_stride()),
            .x_begin = 0,
            .x_end = u32(target.width()),
            .height = u32(target.height()),
            .pixel_x = 0,
            .pixel_y = 0,
            .reserved = 0};
}

std::size_t size(int value) {
    return static_cast<std::size_t>(value);
}

runtime::Kernel built(const Device& device, const std::string& before, const std::string& file, const std::string& name,
                      const runtime::Defines& choices) {
    std::string options = "-cl-std=CL1.2 -cl-kernel-arg-info";
    for (const auto& [key, value] : choices)
        options += text(" -D", key, "=", value);
    const cl::Program program(device.context(),
                              before + "\n#line 1 \"bench/" + file + "\"\n" + fathom_rival_files().at(file));
    try {
        program.build(options.c_str());
    } catch (const cl::Error&) {
        throw Error(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>().front().second);
    }
    return {cl::Kernel(program, name.c_str()), text("bench/", file, " ", name)};
}

int fp64(const Device& device) {
    return device.options().arithmetic == Arithmetic::fp64;
}

Image uploaded(const Device& device, Element element, const void* data, std::size_t count) {
    const Image image(device, element, {static_cast<int>(count), 1});
    device.queue().enqueueWriteBuffer(image.buffer(), CL_TRUE, 0, count * 4, data);
    return image;
}

SsaoOptions options_of(double radius) {
    SsaoOptions options;
    options.radius = radius;
    options.thickness = std::numeric_limits<double>::infinity();
    return options;
}

params::occlusion_params parameters(const StoredDepth& stored, const EyeRays& eye, double radius,
                                    const SliceTable& table) {
    params::occlusion_params p = occlusion_parameters(
        stored.camera, eye, inverse_depth_error(stored.camera, stored.storage), options_of(radius), table);
    p.slope_errors = slope_errors_neighbours;
    return p;
}

} // namespace

OcclusionPlanes::OcclusionPlanes(const StoredDepth& stored, double radius, const SliceTable& table, int patterns)
    : layout(split_parameters(pixel_lattice(stored))), stored_(stored), eye_(eye_rays(camera_rays(stored.camera))),
      patterns_(patterns), depth_(device(), Element::f32, {stored.image.width(), stored.image.height()}) {
    occlusion = parameters(stored, eye_, radius, table);
    fronts = planes(1);
    backs = planes(1);
    slopes = planes(1);
    sums = planes(2);
}

Image OcclusionPlanes::planes(int count) const {
    const Image image(device(), Element::f32,
                      {static_cast<int>(layout.stride), count * 16 * static_cast<int>(layout.rows + 2)});
    const float zero = 0;
    device().queue().enqueueFillBuffer(image.buffer(), zero, 0, size(count) * 16 * layout.plane * sizeof zero);
    return image;
}

runtime::Kernel OcclusionPlanes::kernel(const std::string& file, const std::string& name,
                                        runtime::Defines choices) const {
    choices.insert(choices.end(), {{"V", device().options().vector_width},
                                   {"STREAM", 0},
                                   {"FP64", fp64(device())},
                                   {"PERSPECTIVE", eye_.perspective},
                                   {"CONFIDENCE", 0},
                                   {"BENT", 0}});
    return built(device(), runtime::assembled_source("ssao.cl"), file, name, choices);
}

void OcclusionPlanes::split() {
    inverse_depth(stored_, eye_, depth_);
    const int vector_width = device().options().vector_width;
    runtime::Kernel& kernel = runtime::kernel(device(), "ssao_planes",
                                              {{"THICKNESS", 0},
                                               {"GIVEN_NORMALS", 0},
                                               {"CLAMP", 0},
                                               {"EVERY", 1},
                                               {"V", vector_width},
                                               {"STREAM", 0},
                                               {"PERSPECTIVE", eye_.perspective}});
    const params::grid_params all = grid(depth_, depth_);
    runtime::launch(device(), kernel, {layout.stride / size(vector_width), 4 * (layout.rows + 2)}, depth_, depth_,
                    depth_, fronts, backs, slopes, all, all, all, layout, occlusion);
}

void OcclusionPlanes::filter(const Image& visibility) {
    const int vector_width = device().options().vector_width;
    runtime::Kernel& kernel = runtime::kernel(device(), "denoise",
                                              {{"REACH", patterns_ == 16  ? 2
                                                         : patterns_ == 4 ? 1
                                                                          : 0},
                                               {"OUTPUT", 0},
                                               {"CLAMP", 0},
                                               {"V", vector_width},
                                               {"STREAM", 0},
                                               {"PERSPECTIVE", eye_.perspective}});
    runtime::launch(device(), kernel, {layout.columns / size(vector_width), size(visibility.height())}, fronts, slopes,
                    sums, visibility, grid(visibility, visibility), layout, occlusion);
}

LineSweep::LineSweep(const StoredDepth& stored, double radius, int slices)
    : planes_(stored, radius, {.slices = 1, .samples = 1, .levels = 1, .taps = {}, .turns = {}, .counts = {}}, 1),
      sweep_(planes_.kernel("line_sweep.cl", "line_sweep", {})),
      add_(planes_.kernel("line_sweep.cl", "line_sweep_sums", {})), horizons_(planes_.planes(2)) {
    const Device& device = planes_.device();
    for (int k = 0; k < slices; ++k) { // direction_params of line_sweep.cl
        const double angle = std::numbers::pi * (k + 0.5) / slices, x = std::cos(angle), y = std::sin(angle);
        const bool by_rows = std::abs(y) > std::abs(x);
        const double shear = by_rows ? x / y : y / x;
        const float values[] = {by_rows ? 1.0f : 0.0f,
                                static_cast<float>(shear),
                                by_rows ? static_cast<float>(shear) : 1.0f,
                                by_rows ? 1.0f : static_cast<float>(shear),
                                1,
                                0.5f,
                                static_cast<float>(1 + shear * shear),
                                k == 0 ? 1.0f : 0.0f};
        directions_.push_back(uploaded(device, Element::f32, values, std::size(values)));
    }
    const int longest = std::max(stored.image.width(), stored.image.height());
    scratch_ = Image(device, Element::f32, {6 * longest + 2, bands});
    const std::vector<float> none(16 * planes_.layout.plane * 2, -1e30f); // where there is no surface
    device.queue().enqueueWriteBuffer(horizons_.buffer(), CL_TRUE, 0, none.size() * sizeof(float), none.data());
}

void LineSweep::run(const Image& visibility) {
    const Device& device = planes_.device();
    planes_.split();
    const params::split_params& layout = planes_.layout;
    for (const Image& direction : directions_) {
        runtime::launch(device, sweep_, {1, bands}, planes_.fronts, planes_.slopes, direction, scratch_, horizons_,
                        layout, planes_.occlusion);
        runtime::launch(device, add_, {layout.columns / size(device.options().vector_width), 16 * layout.rows},
                        planes_.fronts, planes_.slopes, direction, horizons_, planes_.sums, layout, planes_.occlusion);
    }
    planes_.filter(visibility);
}

namespace {

SliceTable table_of(const StoredDepth& stored, int slices, int steps) {
    const params::split_params layout = split_parameters(pixel_lattice(stored));
    return slice_table(slices, steps, std::max(stored.image.width(), stored.image.height()), 16, 0, 0,
                       {static_cast<int>(layout.stride), static_cast<int>(layout.plane)});
}

} // namespace

Obscurance::Obscurance(const StoredDepth& stored, double radius, int slices, int steps, Falloff falloff,
                       double intensity)
    : table_(table_of(stored, slices, steps)), planes_(stored, radius, table_, 16),
      kernel_(planes_.kernel("obscurance.cl", "obscurance", {{"FALLOFF", static_cast<int>(falloff)}})) {
    const Device& device = planes_.device();
    const auto constant = static_cast<float>(intensity);
    taps_ = uploaded(device, Element::f32, table_.taps.data(), table_.taps.size() * sizeof(table_.taps[0]) / 4);
    turns_ = uploaded(device, Element::f32, table_.turns.data(), table_.turns.size());
    counts_ = uploaded(device, Element::u32, table_.counts.data(), table_.counts.size());
    intensity_ = uploaded(device, Element::f32, &constant, 1);
}

void Obscurance::run(const Image& visibility) {
    const Device& device = planes_.device();
    const params::split_params& layout = planes_.layout;
    planes_.split();
    runtime::launch(device, kernel_,
                    {(layout.columns + 255) / 256 * 256 / size(device.options().vector_width) * 16 * layout.rows, 1},
                    planes_.fronts, planes_.slopes, taps_, turns_, counts_, intensity_, planes_.sums, layout,
                    planes_.occlusion);
    planes_.filter(visibility);
}

} // namespace fathom::bench
