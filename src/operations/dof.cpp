// Depth of field: circles, planes of layer and colour, then layer by layer from front to back.

#include <fathom/dof.hpp>

#include "camera/circle_form.hpp"
#include "operations/cheapest.hpp"
#include "operations/circle.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launched.hpp"
#include "runtime/scratch.hpp"
#include "runtime/table.hpp"
#include "sampling/dof_layers.hpp"

#include <cmath>

namespace fathom {
namespace {

using params::u32;

// Running sums of colours up to this are off by 2^-24 of it times some hundred pixels at most.
constexpr float knee = 4;

void check_clean_plate(const CleanPlate& clean_plate, const StoredDepth& stored, const Image& color) {
    check_stored(clean_plate.depth);
    check_picture(stored, {"the clean plate", clean_plate.color});
    const Image& depth = clean_plate.depth.image;
    check_device(stored, {"the clean plate's depth", depth});
    require(depth.width() == stored.image.width() && depth.height() == stored.image.height(),
            "the clean plate's depth is ", depth.width(), " x ", depth.height(), " pixels, the clean plate ",
            stored.image.width(), " x ", stored.image.height());
    require(clean_plate.color.channels() == color.channels(), "the clean plate has ", clean_plate.color.channels(),
            " channels, the colour ", color.channels());
    require(clean_plate.depth.x == stored.x && clean_plate.depth.y == stored.y,
            "the clean plate's depth is of another region than the depth");
}

void check(const StoredDepth& stored, const Image& color, const DofOptions& options) {
    check_stored(stored);
    check_picture(stored, {"the colour", color});
    if (options.clean_plate)
        check_clean_plate(*options.clean_plate, stored, color);
    check_enum("quality", options.quality, {"fast", "balanced", "accurate"});
    check_enum("sky", options.sky, {"blur", "sharp", "exclude"});
    const int blades = options.aperture.blades;
    require(blades == 0 || (blades >= 3 && blades <= 64), "blades = ", blades, " must be 0, or 3 to 64");
    const double ratio = options.aperture.ratio;
    require(ratio >= 0.1 && ratio <= 10, "ratio = ", ratio, " must be 0.1 to 10");
    require(ratio == 1 || blades == 0, "ratio = ", ratio, ": a polygon has none, blades must be 0");
    require(std::isfinite(options.aperture.rotation_degrees), "rotation_degrees = ", options.aperture.rotation_degrees,
            " must be finite");
    const double pixels = (stored.image.width() + 128.0) * (stored.image.height() + 32.0);
    constexpr int widest = ENTRY_COLUMN_MASK * params::dof_tile_columns,
                  highest = ENTRY_ROW_MASK * params::dof_tile_rows;
    require(pixels * (2 * color.channels() + 7) < 0x1p31 && stored.image.width() <= widest &&
                stored.image.height() <= highest,
            "an image of ", stored.image.width(), " x ", stored.image.height(),
            " pixels is too large; blur it in parts");
    require(options.max_coc_px >= 1 && options.max_coc_px <= 512, "max_coc_px = ", options.max_coc_px,
            " must be 1 to 512");
}

params::blur_params blur_parameters(const StoredDepth& stored, const LayerScale& scale, double largest) {
    const int left = stored.x % params::dof_tile_columns, top = stored.y % params::dof_tile_rows;
    const auto whole = [](int size, int tile) { return (size + tile - 1) / tile * tile; };
    const int columns = whole(stored.image.width() + left, params::dof_tile_columns);
    const int rows = whole(stored.image.height() + top, params::dof_tile_rows),
              stride = columns + 2 * params::dof_margin;
    return {.width = static_cast<u32>(stored.image.width()),
            .height = static_cast<u32>(stored.image.height()),
            .left = static_cast<u32>(left),
            .top = static_cast<u32>(top),
            .columns = static_cast<u32>(columns),
            .rows = static_cast<u32>(rows),
            .stride = static_cast<u32>(stride),
            .plane = static_cast<u32>(stride * rows),
            .middle = static_cast<u32>(scale.middle),
            .per_octave = static_cast<float>(scale.spacing.per_octave),
            .offset = static_cast<float>(scale.spacing.offset),
            .bend = static_cast<float>(scale.spacing.bend),
            .largest = static_cast<float>(largest),
            .knee = knee};
}

params::grid_params grid(const Image& source, const Image& target) {
    return {.source_offset = source.offset(),
            .target_offset = target.offset(),
            .source_stride = static_cast<u32>(source.row_stride()),
            .target_stride = static_cast<u32>(target.row_stride()),
            .x_begin = 0,
            .x_end = static_cast<u32>(source.width()),
            .height = static_cast<u32>(source.height()),
            .pixel_x = 0,
            .pixel_y = 0,
            .y_begin = 0};
}

// Planes of the state: T, colour, what is hidden and its colour, T before the layer. Then follow the part of T that is
// left to wide circles or, where accurate, the moments of T now and before the layer.
int state_planes(int channels, Quality quality) {
    return 2 * channels + 3 + (quality == Quality::accurate ? 4 : 1);
}

// The device's images of one call, and what every kernel of it is built for.
struct Blur {
    Device device;
    params::blur_params p;
    int channels, element, vector_width;
    Quality quality;
    bool clean_plate;
    Aperture aperture;
    float aspect; // of a circle: its height over its width
    bool upright;
    Image planes, state, tiles;

    runtime::Kernel& kernel(const char* name, runtime::Defines defines, bool stream = false) const {
        defines.insert(defines.end(), {{"V", vector_width}, {"STREAM", stream}, {"CHANNELS", channels}});
        return runtime::kernel(device, name, defines);
    }
    bool behind() const { return clean_plate || accurate(); } // have pixels a second surface?
    bool accurate() const { return quality == Quality::accurate; }
    std::size_t vectors(u32 columns) const { return columns / static_cast<u32>(vector_width); }
    int across() const { return static_cast<int>(p.columns) / params::dof_tile_columns; }
    int down() const { return static_cast<int>(p.rows) / params::dof_tile_rows; }
};

std::vector<TileBits> tile_bits(const Blur& blur, const Image& tiles, int across, const runtime::Defines& which) {
    const auto columns = static_cast<std::size_t>(across), rows = static_cast<std::size_t>(blur.down());
    runtime::launch(blur.device, blur.kernel("dof_tiles", which), {columns, rows}, blur.planes, tiles, blur.p);
    std::vector<TileBits> bits(columns * rows);
    tiles.download(bits.data());
    return bits;
}

// Of the first surfaces, or of the second ones too.
std::vector<TileBits> tile_bits(const Blur& blur, bool behind) {
    return tile_bits(blur, blur.tiles, blur.across(), {{"BEHIND", behind}, {"HIDING", 0}});
}

// The tiles whose pixels see some surface that another one hides.
std::vector<unsigned char> tiles_seeing_hidden(const Blur& blur, const LayerPlanOptions& options,
                                               runtime::Scratch& scratch) {
    const int across = static_cast<int>(blur.p.columns) / params::dof_hiding_columns;
    const Image tiles = scratch.image(Element::u32, {static_cast<int>(TileBits{}.size()) * across * blur.down(), 1});
    return tiles_seeing(tile_bits(blur, tiles, across, {{"BEHIND", 1}, {"HIDING", 1}}), across, options);
}

// The farthest layer that a pixel may lie in.
int farthest_layer(std::span<const TileBits> tiles) {
    for (int bit = most_layers - 1; bit > 0; --bit)
        for (const TileBits& tile : tiles)
            if (has_bit(tile, bit))
                return bit;
    return 0;
}

// Gives every pixel its second surface: what lies behind it.
void look_behind(const Blur& blur, int farthest, runtime::Scratch& scratch) {
    constexpr u32 side = params::dof_behind_block;
    const params::behind_params b{.block_columns = blur.p.columns / side,
                                  .block_rows = blur.p.rows / side,
                                  .farthest = static_cast<float>(farthest),
                                  .vertical = 1 / blur.aspect};
    const Image blocks =
        scratch.image(Element::f32, {static_cast<int>(b.block_columns), 4 * static_cast<int>(b.block_rows)});
    const Image inner = scratch.image(Element::f32, {static_cast<int>(blur.p.stride), static_cast<int>(blur.p.rows)});
    runtime::launch(blur.device, blur.kernel("dof_inner", {}), {b.block_columns, b.block_rows}, blur.planes, inner,
                    blocks, blur.p, b);
    runtime::launch(blur.device, blur.kernel("dof_behind", {{"CLEAN_PLATE", blur.clean_plate}}),
                    {blur.p.stride / side, b.block_rows}, blur.planes, inner, blocks, blur.p, b);
}

DofMasksOptions circle_options(const DofOptions& options) {
    return {.sky = options.sky, .max_coc_px = options.max_coc_px, .weights = false};
}

// The circles of a picture's pixels, as the options have them.
Image circles_of(const StoredDepth& stored, const CircleOfConfusion& coc, const DofOptions& options,
                 runtime::Scratch& scratch) {
    const Image circles = scratch.image(Element::f32, {stored.image.width(), stored.image.height()});
    dof_masks(stored, {.coc = circles}, coc, circle_options(options));
    return circles;
}

void cut_into_planes(const Blur& blur, const Image& circles, const Image& color, bool clean_plate) {
    const runtime::Defines defines{{"ELEMENT", element_define(color.element())}, {"CLEAN_PLATE", clean_plate}};
    runtime::launch(blur.device, blur.kernel("dof_planes", defines), {blur.vectors(blur.p.stride), blur.p.rows},
                    circles, color, blur.planes, grid(circles, circles), grid(color, color), blur.p);
}

void cut_into_surfaces(const Blur& blur, const Image& circles, const Image& color, const CircleOfConfusion& coc,
                       const DofOptions& options, runtime::Scratch& scratch) {
    cut_into_planes(blur, circles, color, false);
    if (options.clean_plate)
        cut_into_planes(blur, circles_of(options.clean_plate->depth, coc, options, scratch), options.clean_plate->color,
                        true);
    if (blur.accurate())
        look_behind(blur, farthest_layer(tile_bits(blur, false)), scratch);
}

void clear(const Blur& blur) {
    const int planes = state_planes(blur.channels, blur.quality);
    runtime::launch(blur.device,
                    blur.kernel("dof_clear", {{"PLANES", planes}, {"WIDE", !blur.accurate()}},
                                worth_streaming(blur.state, blur.vector_width)),
                    {blur.vectors(blur.p.stride), blur.p.rows}, blur.state, blur.p);
}

// `behind`: do the pixels that the plan's tiles see have a second surface?
void run(const Blur& blur, const LayerPlan& plan, bool behind) {
    if (plan.passes.empty())
        return;
    runtime::Scratch scratch(blur.device); // the next plan's launches may take it again
    const auto table = [&](Element element, auto values) {
        if (values.empty()) // no pass reads it
            values.emplace_back();
        return runtime::table(blur.device, element, values).on(blur.device);
    };
    const Image lists = table(Element::u32, plan.lists);
    const Image starts = table(Element::u32, plan.starts);
    const Image spans = table(Element::f32, plan.spans);
    const auto half_planes =
        blur.accurate() ? aperture_halves(blur.aperture, blur.upright) : std::vector<std::array<float, 4>>(1);
    const Image halves = table(Element::f32, half_planes);
    const Image taps = table(Element::f32, plan.taps);
    constexpr int row = 4096;
    const Image weights = table(Element::f32, plan.weights);
    const auto floats = [&](std::size_t count) {
        return scratch.image(Element::f32, {row, static_cast<int>((count + row - 1) / row) + 1});
    };
    const Image strips = floats(plan.strip_elements), cells = floats(plan.cell_elements),
                cell_sums = floats(plan.cell_elements);
    for (const LayerPass& pass : plan.passes) {
        if (pass.cell > 1) {
            const runtime::Defines cell{{"FILL", pass.fill}, {"BEHIND", behind}, {"CELL", pass.cell}};
            constexpr std::size_t pixels = 16; // of an item of dof_cell_layer
            runtime::launch(blur.device, blur.kernel("dof_cells", cell), {pass.cells.blocks, 1}, blur.planes,
                            blur.tiles, lists, cells, blur.p, pass.cells);
            runtime::launch(blur.device, blur.kernel("dof_cell_sums", {{"FILL", pass.fill}}),
                            {pass.cells.sum_blocks * (pass.fill ? 2u : 1u), 1}, cells, lists, starts, weights,
                            cell_sums, pass.cells);
            runtime::launch(blur.device, blur.kernel("dof_cell_layer", cell),
                            {pass.cells.tiles * params::dof_tile_columns / pixels * params::dof_tile_rows, 1},
                            blur.planes, cell_sums, lists, blur.state, blur.p, pass.cells);
            continue;
        }
        const runtime::Defines sums{{"FILL", pass.fill}, {"BRIGHT", pass.bright}};
        const runtime::Range strips_range{pass.strips.tiles, static_cast<std::size_t>(params::dof_tile_rows) /
                                                                 std::max(pass.strips.pitch, 1u)};
        if (!pass.direct && pass.parts) {
            runtime::launch(blur.device, blur.kernel("dof_part_strips", {{"BRIGHT", pass.bright}}), strips_range,
                            blur.planes, lists, strips, blur.p, pass.strips);
        } else if (!pass.direct) {
            runtime::Defines stripped = sums;
            stripped.emplace_back("BEHIND", behind);
            runtime::launch(blur.device, blur.kernel("dof_strips", stripped), strips_range, blur.planes, blur.tiles,
                            lists, strips, blur.p, pass.strips);
        }
        if (pass.parts) {
            runtime::launch(blur.device, blur.kernel("dof_parts", {{"DIRECT", pass.direct}, {"BRIGHT", pass.bright}}),
                            {pass.gather.tiles * blur.vectors(params::dof_tile_columns) * params::dof_tile_rows, 1},
                            pass.direct ? blur.planes : strips, lists, starts, pass.direct ? taps : spans, halves,
                            blur.state, blur.p, pass.gather, pass.part);
            continue;
        }
        runtime::Defines gathered = sums;
        gathered.emplace_back("DIRECT", pass.direct);
        gathered.emplace_back("BEHIND", behind);
        runtime::launch(blur.device, blur.kernel("dof_gather", gathered),
                        {pass.gather.tiles * blur.vectors(params::dof_tile_columns) * params::dof_tile_rows /
                             params::dof_rows_at_once,
                         1},
                        blur.planes, blur.tiles, pass.direct ? blur.planes : strips, lists, starts, spans, blur.state,
                        blur.p, pass.gather);
    }
}

// Blurs a picture that has a circle somewhere.
void blur(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
          const DofOptions& options, const Image& circles, runtime::Scratch& scratch) {
    const Device& device = stored.image.device();
    const LayerScale scale = layer_scale(layer_spacing(options.quality, options.aperture), options.max_coc_px);
    const params::blur_params p = blur_parameters(stored, scale, options.max_coc_px);
    const auto planes = [&](int count) {
        return scratch.image(Element::f32, {static_cast<int>(p.stride), count * static_cast<int>(p.rows)});
    };
    const int channels = color.channels();
    const PixelScale pixels = pixel_scale(stored.camera);
    const bool accurate = options.quality == Quality::accurate;
    Blur call{device,
              p,
              channels,
              element_define(color.element()),
              device.options().vector_width,
              options.quality,
              options.clean_plate.has_value(),
              options.aperture,
              static_cast<float>(pixels.y / pixels.x),
              stored.camera.rows == Rows::top_down,
              planes((accurate || options.clean_plate ? 2 : 1) * (channels + 1)),
              planes(state_planes(channels, options.quality)),
              {}};
    call.tiles = scratch.image(Element::u32, {static_cast<int>(TileBits{}.size()) * call.across() * call.down(), 1});
    cut_into_surfaces(call, circles, color, coc, options, scratch);
    const std::vector<TileBits> tiles = tile_bits(call, call.behind());
    clear(call);
    LayerPlanOptions plan{.aperture = options.aperture,
                          .scale = scale,
                          .aspect = static_cast<double>(pixels.y / pixels.x),
                          .upright = call.upright,
                          .quality = options.quality,
                          .channels = channels};
    if (accurate) { // keeps parts of the lens where something hidden is seen, and there only
        plan.only = tiles_seeing_hidden(call, plan, scratch);
        run(call, layer_plan(tiles, call.across(), plan), true);
        for (unsigned char& tile : plan.only)
            tile = !tile;
        plan.open = true;
        run(call, layer_plan(tiles, call.across(), plan), false);
    } else {
        run(call, layer_plan(tiles, call.across(), plan), call.clean_plate);
    }
    runtime::launch(device, call.kernel("dof", {{"ELEMENT", call.element}}), {call.vectors(p.columns), p.rows},
                    call.state, color, result, grid(color, result), p);
}

void check_dof_result(const StoredDepth& stored, const Image& color, const Image& result, const DofOptions& options) {
    const Image none;
    check_result(stored, {"the result", result}, color.element(), {color.width(), color.height(), color.channels()},
                 {{"the stored depth", stored.image},
                  {"the colour", color},
                  {"the clean plate", options.clean_plate ? options.clean_plate->color : none},
                  {"the clean plate's depth", options.clean_plate ? options.clean_plate->depth.image : none}});
}

} // namespace

void dof(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
         const DofOptions& options, const Launch& launch) {
    check(stored, color, options);
    if (options.max_error)
        return dof(stored, color, result, coc, chosen(stored, options), launch);
    check_dof_result(stored, color, result, options);
    const Device& device = stored.image.device();
    const runtime::Launched launched(device, launch);
    runtime::Scratch scratch(device);
    if (coc.k == 0 && coc.g == 0) {
        check_circle(coc, depth_form(stored.camera, stored.storage));
        runtime::copy(color, result);
    } else if (static_cast<double>(widest_coc(stored, coc, circle_options(options))) <=
               largest_in_focus(layer_spacing(options.quality, options.aperture))) {
        runtime::copy(color, result);
    } else {
        blur(stored, color, result, coc, options, circles_of(stored, coc, options, scratch), scratch);
    }
    launched.done();
}

Image dof(const StoredDepth& stored, const Image& color, const CircleOfConfusion& coc, const DofOptions& options,
          const Launch& launch) {
    check(stored, color, options);
    const Image result(stored.image.device(), color.element(), {color.width(), color.height(), color.channels()});
    dof(stored, color, result, coc, options, launch);
    return result;
}

} // namespace fathom
