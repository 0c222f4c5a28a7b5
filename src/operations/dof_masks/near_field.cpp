// What the discs of near pixels do to those around them: tiles, then near_field_weight.cl and
// near_field.cl of kernels/dof_masks.
//
// The discs' weights are needed only until they are added up, and the sums go on from launch to launch in the order of one launch.
// So weights may be held of a few rows of blocks at a time, with the same bits, however far the discs reach.

#include "operations/bands.hpp"
#include "operations/dof_masks/dof_masks.hpp"
#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <algorithm>

namespace fathom {
namespace {

constexpr int tile_px = 16; // a tile as wide as the widest vector
constexpr int block_px = tile_px * params::near_block;

enum class Spread { max_near_coc = 0, near_alpha = 1, disocclusion = 2 };

int parts(int whole, int part) {
    return (whole - 1) / part + 1;
}

// Pixels from the corner of the block that holds an image's first pixel to that pixel.
int before(int first) {
    return first % block_px;
}

bool looks_around(const DofMasksOptions& options) {
    return options.max_near_coc || options.near_alpha || options.disocclusion;
}

bool needs_weights(const DofMasksOptions& options) {
    return options.near_alpha || options.disocclusion;
}

// The least of each square of so many pixels, or tiles, across; and the greatest, if there is an image for it. The first square
// begins `left` and `top` before the image.
void find_extremes(const Image& from, int across, const Image& least, const Image& greatest = {}, int left = 0,
                   int top = 0) {
    params::near_field_params p{};
    p.left = to_u32(left);
    p.top = to_u32(top);
    p.width = to_u32(from.width());
    p.height = to_u32(from.height());
    p.tile = to_u32(across);
    p.columns = to_u32(least.width());
    p.rows = to_u32(least.height());
    const Device& device = from.device();
    const auto launch = [&](const auto&... results) {
        runtime::launch(device,
                        runtime::kernel(device, "near_field_tiles",
                                        {{"V", 1}, {"STREAM", 0}, {"GREATEST", static_cast<bool>(greatest)}}),
                        range_of(least.width(), least.height()), from, place_parameters(from), results..., p);
    };
    if (greatest)
        launch(least, place_parameters(least), greatest, place_parameters(greatest));
    else
        launch(least, place_parameters(least));
}

// The extremes of tiles that are asked for. Where the least are not, the kernel makes them elsewhere.
void find_asked_extremes(const Image& circle, const DofMasksOptions& options, const DofMasks& masks) {
    const Image &least = masks.tile_min_coc, &greatest = masks.tile_max_coc;
    if (least)
        return find_extremes(circle, options.tile_px, least, greatest);
    if (!greatest)
        return;
    const RowNeeds tiles{0, greatest.height(), greatest.height(), {0}, [&](int, int made) {
                             return Image::allocation(Element::f32, {greatest.width(), made});
                         }};
    for (const Band& band : bands(tiles, budget_of(circle.device()))) {
        runtime::Scratch scratch(circle.device());
        const int rows = band.end - band.begin, first = band.begin * options.tile_px,
                  last = std::min(band.end * options.tile_px, circle.height());
        find_extremes(circle.region(0, first, circle.width(), last - first), options.tile_px,
                      scratch.image(Element::f32, {greatest.width(), rows}),
                      greatest.region(0, band.begin, greatest.width(), rows));
    }
}

params::near_field_params near_field_parameters(const Image& tiles, const Image& blocks, const StoredDepth& stored,
                                                const DofMasksOptions& options) {
    params::near_field_params p{};
    p.width = to_u32(stored.image.width());
    p.height = to_u32(stored.image.height());
    p.left = to_u32(before(stored.x));
    p.top = to_u32(before(stored.y));
    p.first_row = 0;
    p.last_row = p.height;
    p.tile = to_u32(tile_px);
    p.columns = to_u32(tiles.width());
    p.rows = to_u32(tiles.height());
    p.tile_stride = to_u32(tiles.row_stride());
    p.block_columns = to_u32(blocks.width());
    p.block_stride = to_u32(blocks.row_stride());
    const PixelScale scale = pixel_scale(stored.camera);
    p.vertical = static_cast<float>(scale.x / scale.y);
    p.sharp = static_cast<float>(options.sharp_px);
    p.inverse_transition = inverse_transition(options);
    p.shows = static_cast<float>(1 - disocclusion_min_transparency);
    return p;
}

} // namespace

int rows_of_blocks(const Region& pixels) {
    return parts(before(pixels.y) + pixels.height, block_px);
}

std::size_t near_field_bytes(const Region& pixels, const DofMasksOptions& options, int rows_of_blocks) {
    const auto bytes = [](int across, int down) { return Image::allocation(Element::f32, {across, down}); };
    if (!looks_around(options))
        return 0;
    const int width = before(pixels.x) + pixels.width, height = before(pixels.y) + pixels.height;
    return bytes(parts(width, tile_px), parts(height, tile_px)) +
           bytes(parts(width, block_px), parts(height, block_px)) +
           (needs_weights(options) ? bytes(pixels.width, std::min(rows_of_blocks * block_px, pixels.height)) : 0);
}

std::vector<Band> bands_of_weights(const StoredDepth& stored, const DofMasksOptions& options) {
    const Region pixels = Tile(stored).pixels;
    const int down = rows_of_blocks(pixels);
    return bands({0, down, down, {0}, [&](int, int made) { return near_field_bytes(pixels, options, made); }},
                 budget_of(stored.image.device()),
                 text("dof_masks of ", ImageSize{pixels.width, pixels.height}, " pixels"));
}

void near_field(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& masks,
                const std::vector<Band>& weighed) {
    const Image& circle = masks.coc;
    const Device& device = circle.device();
    const int width = circle.width(), height = circle.height(), left = before(stored.x), top = before(stored.y);
    runtime::Scratch scratch(device);
    find_asked_extremes(circle, options, masks);
    if (!looks_around(options))
        return;

    const Image tiles = scratch.image(Element::f32, {parts(left + width, tile_px), parts(top + height, tile_px)}),
                blocks = scratch.image(Element::f32, {parts(left + width, block_px), parts(top + height, block_px)});
    find_extremes(circle, tile_px, tiles, {}, left, top);
    find_extremes(tiles, params::near_block, blocks);

    const params::near_field_params all = near_field_parameters(tiles, blocks, stored, options);
    const int vector_width = vector_width_for(device, width);
    const auto gather = [&](Spread output, const Image& weights, const Image& result,
                            const params::near_field_params& p) {
        runtime::launch(device,
                        runtime::kernel(device, "near_field",
                                        {{"V", vector_width}, {"STREAM", 0}, {"OUTPUT", static_cast<int>(output)}}),
                        range_of(width, height, vector_width), circle, place_parameters(circle), weights,
                        place_parameters(weights), tiles, blocks, result, place_parameters(result), p);
    };
    if (options.max_near_coc)
        gather(Spread::max_near_coc, circle, masks.max_near_coc, all);
    if (!needs_weights(options))
        return;
    const Image weights = scratch.image(Element::f32, {width, std::min(most_made(weighed) * block_px, height)});
    // Where nobody wants the near alpha it waits in the place of what is made from it.
    const Image& alpha = options.near_alpha ? masks.near_alpha : masks.disocclusion;
    runtime::Kernel& weigh = runtime::kernel(device, "near_field_weight", {{"V", vector_width}, {"STREAM", 0}});
    for (const Band& blocks_of : weighed) {
        const int first = std::max(blocks_of.begin * block_px - top, 0),
                  last = std::min(blocks_of.end * block_px - top, height);
        params::near_field_params band = all;
        band.first_row = to_u32(first);
        band.last_row = to_u32(last);
        runtime::launch(device, weigh, range_of(width, last - first, vector_width), circle, place_parameters(circle),
                        weights, place_parameters(weights), band);
        gather(Spread::near_alpha, weights, alpha, band);
    }
    if (options.disocclusion)
        gather(Spread::disocclusion, alpha, masks.disocclusion, all);
}

} // namespace fathom
