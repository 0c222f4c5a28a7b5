// What the discs of near pixels do to those around them: tiles, then kernels/near_field_weight.cl and kernels/near_field.cl.

#include "operations/near_field.hpp"

#include "operations/circle.hpp"
#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

constexpr int tile_px = 16; // a tile as wide as the widest vector

enum class Spread { max_near_coc = 0, near_alpha = 1, disocclusion = 2 };

int parts(int whole, int part) {
    return (whole - 1) / part + 1;
}

// The least and the greatest of each tile, or of each block of tiles.
struct Extremes {
    Image least, greatest;
};

runtime::Range range_of(const Image& image, int vector_width = 1) {
    return {static_cast<std::size_t>(parts(image.width(), vector_width)), static_cast<std::size_t>(image.height())};
}

void find_extremes(const Extremes& from, int across, const Extremes& result) {
    params::near_field_params p{};
    p.width = to_u32(from.least.width());
    p.height = to_u32(from.least.height());
    p.stride = to_u32(from.least.row_stride());
    p.tile = to_u32(across);
    p.columns = to_u32(result.least.width());
    p.rows = to_u32(result.least.height());
    p.tile_stride = to_u32(result.least.row_stride());
    const Device& device = from.least.device();
    runtime::launch(device, runtime::kernel(device, "near_field_tiles", {{"V", 1}, {"STREAM", 0}}),
                    range_of(result.least), from.least, from.greatest, result.least, result.greatest, p);
}

params::near_field_params near_field_parameters(const Extremes& tiles, const Extremes& blocks, const Image& circle,
                                                const Camera& camera, const DofMasksOptions& options) {
    params::near_field_params p{};
    p.width = to_u32(circle.width());
    p.height = to_u32(circle.height());
    p.stride = to_u32(circle.row_stride());
    p.tile = to_u32(tile_px);
    p.columns = to_u32(tiles.least.width());
    p.rows = to_u32(tiles.least.height());
    p.tile_stride = to_u32(tiles.least.row_stride());
    p.block_columns = to_u32(blocks.least.width());
    p.block_rows = to_u32(blocks.least.height());
    p.block_stride = to_u32(blocks.least.row_stride());
    const PixelScale scale = pixel_scale(camera);
    p.vertical = static_cast<float>(scale.x / scale.y);
    p.sharp = static_cast<float>(options.sharp_px);
    p.inverse_transition = inverse_transition(options);
    p.shows = static_cast<float>(1 - disocclusion_min_transparency);
    return p;
}

} // namespace

std::size_t near_field_bytes(int width, int height, const DofMasksOptions& options) {
    const bool covered = options.near_alpha || options.disocclusion;
    if (!options.max_near_coc && !covered)
        return 0;
    const auto bytes = [](int across, int down) { return Image::allocation(Element::f32, {across, down}); };
    const int columns = parts(width, tile_px), rows = parts(height, tile_px);
    const std::size_t tables =
        2 * (bytes(columns, rows) + bytes(parts(columns, params::near_block), parts(rows, params::near_block)));
    const int images = (covered ? 1 : 0) + (options.disocclusion && !options.near_alpha ? 1 : 0);
    return tables + static_cast<std::size_t>(images) * bytes(width, height);
}

void near_field(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& masks) {
    const Image& circle = masks.coc;
    const Device& device = circle.device();
    const int width = circle.width(), height = circle.height();
    if (options.tile_px > 0)
        find_extremes({circle, circle}, options.tile_px, {masks.tile_min_coc, masks.tile_max_coc});
    const bool covered = options.near_alpha || options.disocclusion;
    if (!options.max_near_coc && !covered)
        return;

    runtime::Scratch scratch(device);
    const auto extremes = [&](int columns, int rows) {
        const Layout layout{columns, rows};
        return Extremes{scratch.image(Element::f32, layout), scratch.image(Element::f32, layout)};
    };
    const int columns = parts(width, tile_px), rows = parts(height, tile_px);
    const Extremes tiles = extremes(columns, rows),
                   blocks = extremes(parts(columns, params::near_block), parts(rows, params::near_block));
    find_extremes({circle, circle}, tile_px, tiles);
    find_extremes(tiles, params::near_block, blocks);

    const params::near_field_params p = near_field_parameters(tiles, blocks, circle, stored.camera, options);
    const int vector_width = vector_width_for(device, width);
    const Layout layout{width, height};
    const auto gather = [&](Spread output, const Image& weights, const Image& result) {
        runtime::launch(device,
                        runtime::kernel(device, "near_field",
                                        {{"V", vector_width}, {"STREAM", 0}, {"OUTPUT", static_cast<int>(output)}}),
                        range_of(circle, vector_width), circle, weights, tiles.least, blocks.least, result, p);
    };
    if (options.max_near_coc)
        gather(Spread::max_near_coc, circle, masks.max_near_coc);
    if (!covered)
        return;
    const Image weights = scratch.image(Element::f32, layout);
    runtime::launch(device, runtime::kernel(device, "near_field_weight", {{"V", vector_width}, {"STREAM", 0}}),
                    range_of(circle, vector_width), circle, weights, p);
    const Image alpha = options.near_alpha ? masks.near_alpha : scratch.image(Element::f32, layout);
    gather(Spread::near_alpha, weights, alpha);
    if (options.disocclusion)
        gather(Spread::disocclusion, alpha, masks.disocclusion);
}

} // namespace fathom
