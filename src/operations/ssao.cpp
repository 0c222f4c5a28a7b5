// Ambient occlusion from stored depth: planar depth, planes, slices, and the filter over the patterns.

#include <fathom/ssao.hpp>

#include "operations/parameters.hpp"
#include "operations/planar.hpp"
#include "operations/slices.hpp"
#include "runtime/scratch.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace fathom {
namespace {

constexpr int margin = 16; // MARGIN of kernels/split.h

// Of the bound of a pixel's slopes from neighbouring depths: each is the difference of two.
constexpr float slope_errors = 2;

// Pixels that a neighbour may lie off the tangent plane and still be of the same surface.
constexpr float filter_edge = 0.5f;

struct Preset {
    int slices, steps, patterns;
};

Preset preset(const SsaoOptions& options) {
    constexpr Preset presets[] = {{1, 6, 16}, {2, 8, 16}, {6, 12, 4}};
    Preset chosen = presets[static_cast<int>(options.quality)];
    chosen.slices = options.slices.value_or(chosen.slices);
    chosen.steps = options.steps.value_or(chosen.steps);
    chosen.patterns = options.patterns.value_or(chosen.patterns);
    return chosen;
}

params::u32 u32(std::integral auto value) {
    return static_cast<params::u32>(value);
}

params::split_params split_parameters(const StoredDepth& stored) {
    const int width = stored.image.width(), height = stored.image.height();
    const int columns = ((width + (stored.x & 3) + 3) / 4 + 15) / 16 * 16;
    const int rows = (height + (stored.y & 3) + 3) / 4;
    const int stride = columns + 2 * margin;
    return {u32(width),   u32(height), u32(stored.x), u32(stored.y),
            u32(columns), u32(rows),   u32(stride),   u32(stride * (rows + 2))};
}

params::occlusion_params occlusion_parameters(const EyeRays& eye, const PlanarError& error, const SsaoOptions& options,
                                              const SliceTable& table) {
    params::occlusion_params p{};
    const Rays::Matrix& moving = eye.perspective ? eye.direction : eye.origin;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            p.direction[i][j] = static_cast<float>(eye.direction(i, j));
        for (int j = 0; j < 2; ++j)
            p.step[i][j] = static_cast<float>(moving(i, j));
    }
    p.radius = static_cast<float>(options.radius);
    p.thickness = static_cast<float>(options.thickness.value_or(options.radius / 4));
    p.error_constant = error.constant;
    p.error_linear = error.linear;
    p.error_quadratic = error.quadratic;
    p.pixel = static_cast<float>(std::sqrt(moving.leftCols<2>().squaredNorm() / 2));
    p.edge = filter_edge;
    p.slices = u32(table.slices);
    p.steps = u32(table.steps);
    p.levels = u32(table.levels);
    return p;
}

params::grid_params grid(const Image& source, const Image& target, const StoredDepth& stored) {
    return {source.offset(),
            target.offset(),
            u32(source.row_stride()),
            u32(target.row_stride()),
            0,
            u32(source.width()),
            u32(source.height()),
            u32(stored.x),
            u32(stored.y),
            u32(source.channels())};
}

} // namespace

Occlusion ssao(const StoredDepth& stored, const SsaoOptions& options) {
    check_stored(stored);
    const Device& device = stored.image.device();
    const EyeRays eye = eye_rays(rays(stored.camera));
    const int width = stored.image.width(), height = stored.image.height();
    runtime::Scratch scratch(device);
    const Image depth = scratch.image(Element::f32, {width, height});
    planar(stored, eye, depth);

    const Preset chosen = preset(options);
    const SliceTable table =
        slice_table(chosen.slices, chosen.steps, std::max(width, height), chosen.patterns, options.seed);
    const params::split_params split = split_parameters(stored);
    const params::occlusion_params occlusion =
        occlusion_parameters(eye, planar_error(stored.camera, stored.storage), options, table);
    const Layout planes{static_cast<int>(split.stride), static_cast<int>(16 * (split.rows + 2))};
    const Layout two_planes{planes.width, 2 * planes.height};
    const Image fronts = scratch.image(Element::f32, planes), backs = scratch.image(Element::f32, planes);
    const Image slopes = scratch.image(Element::f32, two_planes), sums = scratch.image(Element::f32, two_planes);
    const Image result(device, Element::f32, {width, height});
    const auto upload = [&](const auto& values, Element element) {
        return Image::from_host(device, element, values.data(), {static_cast<int>(values.size()), 1});
    };
    const Image taps = upload(table.taps, Element::f32), turns = upload(table.turns, Element::f32);
    const Image counts = upload(table.counts, Element::u32);

    const int lanes = device.options().lanes;
    const auto vectors = [&](auto columns) {
        return static_cast<std::size_t>(columns) / static_cast<std::size_t>(lanes);
    };
    const auto choices = [&](std::initializer_list<std::pair<const char*, int>> more) {
        runtime::Choices all{{"V", lanes}, {"STREAM", 0}, {"PERSPECTIVE", eye.perspective}};
        all.insert(all.end(), more);
        return all;
    };
    const params::grid_params depth_grid = grid(depth, result, stored);
    const Image normals = options.normals ? options.normals : depth;
    runtime::launch(device,
                    runtime::kernel(device, "ssao_planes",
                                    choices({{"THICKNESS", std::isfinite(occlusion.thickness)},
                                             {"GIVEN_NORMALS", static_cast<bool>(options.normals)},
                                             {"CLAMP", options.border == Border::clamp}})),
                    {vectors(split.stride), 4 * (split.rows + 2)}, depth, depth, normals, fronts, backs, slopes,
                    depth_grid, depth_grid, grid(normals, result, stored), split, occlusion);
    runtime::launch(device, runtime::kernel(device, "ssao", choices({})), {vectors(split.columns), 16 * split.rows},
                    fronts, backs, slopes, taps, turns, counts, sums, split, occlusion);
    const int reach = chosen.patterns == 16 ? 2 : chosen.patterns == 4 ? 1 : 0;
    runtime::launch(device, runtime::kernel(device, "denoise", choices({{"REACH", reach}})),
                    {vectors(split.columns), static_cast<std::size_t>(height)}, fronts, slopes, sums, result,
                    depth_grid, split, occlusion);
    device.finish();
    return {.visibility = result, .bent_normal = {}, .confidence = {}};
}

} // namespace fathom
