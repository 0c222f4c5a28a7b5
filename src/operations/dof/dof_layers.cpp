// Where a layer has pixels, where its aperture carries them, and how many rows of tiles fit into the memory for its strips.

#include "operations/dof/dof_layers.hpp"
#include "operations/dof/tile_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace fathom {
namespace {

using params::u32;

static_assert(params::dof_tile_columns == 2 * params::dof_hiding_columns);

// Does a plan keep parts of the lens?
bool keeps_parts(const LayerPlanOptions& options) {
    return options.quality == Quality::accurate && !options.open;
}

// Up to this reach `accurate` reads pixels with their own places in the lens: in small circles the middle of a pixel's
// part of the lens is not at the pixel's middle.
constexpr int most_taps = 8;

// Tiles in columns [left, right) and rows [begin, end).
struct Area {
    int left, right, begin, end;
};

// Rows of pixels that are summed into a row of a strip.
int pitch_for(double radius, const LayerPlanOptions& options) {
    const bool polygon = options.aperture.blades != 0;
    if (options.quality == Quality::fast)
        return radius >= 24 ? 8 : radius >= 12 ? 4 : radius >= (polygon ? 5 : 4) ? 2 : 1;
    if (keeps_parts(options))
        return radius >= 64 ? 4 : radius >= 20 ? 2 : 1;
    if (options.quality == Quality::balanced && !polygon)
        return radius >= 10 ? 2 : 1;
    return radius >= 96 ? 4 : radius >= 48 ? 2 : 1;
}

// Pixels across and down that are summed into a cell; 1 where they are not.
int cell_for(double radius, const LayerPlanOptions& options) {
    const double least = keeps_parts(options) ? INFINITY : least_cells(options.aperture, options.quality);
    int cell = 1;
    while (cell < 8 && radius >= least * 2 * cell)
        cell *= 2;
    return cell;
}

// Rounded down, and up.
int divided(int a, int b) {
    return (a >= 0 ? a : a - b + 1) / b;
}
int divided_up(int a, int b) {
    return (a + b - 1) / b;
}

// A layer's circle and aperture, which do not depend on where its pixels are.
struct Layer {
    int number;
    double circle;
    int pitch, cell;
    ApertureSpans spans;
    bool direct, fill;
    int tiles_up, tiles_aside; // that its aperture reaches
};

Layer layer_of(int number, const LayerPlanOptions& options) {
    Layer layer{};
    layer.number = number;
    layer.circle = number == options.scale.middle ? 1 : options.scale.circle(number);
    const double least = std::abs(layer.circle) / 2 * std::min(options.aspect, 1.0); // radius
    layer.pitch = pitch_for(least * thinnest(options.aperture), options);
    layer.cell = cell_for(least * thinnest(options.aperture), options);
    layer.spans =
        aperture_spans(options.aperture, layer.circle, options.aspect, options.upright, layer.pitch, options.quality);
    const int direct_up_to = keeps_parts(options) ? most_taps : params::dof_direct_reach;
    layer.direct = layer.spans.columns <= direct_up_to && layer.spans.reach <= direct_up_to;
    layer.fill = options.quality != Quality::accurate && number < options.scale.middle;
    layer.tiles_up = divided_up(layer.spans.reach * layer.pitch, params::dof_tile_rows);
    layer.tiles_aside = divided_up(layer.spans.columns, params::dof_tile_columns);
    return layer;
}

class Planner {
public:
    Planner(std::span<const TileBits> tiles, int across, const LayerPlanOptions& options)
        : options_(options), bright_(with_bit(tiles, across, bright_bit)),
          near_(with_any(tiles, across, options.open ? 0 : options.scale.middle)), none_(across, bright_.down),
          jumps_(jumps_in_halves(tiles, across)), before_(none_) {}

    void add(int number, const TileGrid& own) {
        Layer layer = layer_of(number, options_);
        TileGrid reached = widened(own, layer.tiles_aside, layer.tiles_up);
        for (std::size_t i = 0; i < options_.only.size(); ++i)
            reached.marked[i] = reached.marked[i] && options_.only[i];
        const bool grouped = !keeps_parts(options_) && layer.direct;
        if (!grouped)
            end_all(groups_);
        if (layer.cell == 1)
            end_all(cell_groups_);
        // What lies behind is summed only around what ends. A group has one answer for all its layers, which reach one tile.
        TileGrid filled = reached;
        if (layer.fill) {
            const int halves = grouped ? 1 : divided_up(layer.spans.columns, params::dof_hiding_columns);
            const TileGrid around = tiles_of_halves(widened(jumps_, halves, grouped ? 1 : layer.tiles_up));
            for (std::size_t i = 0; i < filled.marked.size(); ++i)
                filled.marked[i] &= around.marked[i];
        }
        TileGrid rest = reached;
        for (std::size_t i = 0; i < rest.marked.size(); ++i)
            rest.marked[i] = layer.fill && !filled.marked[i] && reached.marked[i];
        for (const TileGrid* part : {&filled, &rest}) {
            if (!part->any())
                continue;
            layer.fill = layer.fill && part == &filled;
            if (grouped)
                add_to_group(groups_[layer.fill ? 0 : 1], layer, *part);
            else if (layer.cell > 1)
                add_cells(layer, *part);
            else
                add_passes(layer, own, *part);
        }
        before_ = reached;
    }

    /// No pixel lies in a layer.
    void skip() { before_ = none_; }

    LayerPlan plan() {
        end_all(groups_);
        end_all(cell_groups_);
        return std::move(plan_);
    }

private:
    // Tiles of a group of layers whose pixels are read directly: which of these reach them, and which follow one that does.
    struct Group {
        int first;
        bool fill;
        std::vector<u32> reach, follow; // a bit a layer
        std::vector<u32> layers;        // where its spans begin, and its rows
    };

    // A layer that is summed over cells: where the rows of its aperture begin and how many there are on either side, the blocks
    // that it takes aside and up, and its tiles.
    struct CellLayer {
        int number;
        std::array<u32, 2> start_and_reach;
        int aside, up;
        TileGrid reached, before;
    };

    // Blocks of cells in a rectangle, and the first one's place.
    struct Blocks {
        int column, row, across, down;
    };

    // Layers whose cells and sums are made by one launch each, and that are laid by one.
    struct CellGroup {
        int cell;
        bool fill;
        std::vector<CellLayer> layers;

        u32 nth(const CellLayer& layer) const { return static_cast<u32>(layer.number - layers.front().number); }
        int block_width() const { return params::dof_block_columns * cell; }
        int block_height() const { return params::dof_block_rows * cell; }
        bool overlaps(const TileGrid& reached) const {
            for (const CellLayer& layer : layers)
                for (std::size_t i = 0; i < reached.marked.size(); ++i)
                    if (reached.marked[i] && layer.reached.marked[i])
                        return true;
            return false;
        }
        // Where its tiles are.
        Area area() const {
            Area all{0, layers.front().reached.across, layers.front().reached.down, 0};
            for (const CellLayer& layer : layers) {
                all.begin = std::min(all.begin, layer.reached.first_row());
                all.end = std::max(all.end, layer.reached.end_row());
            }
            return all;
        }
        // The blocks that these rows of tiles read.
        Blocks blocks(int begin, int end) const {
            int aside = 0, up = 0;
            for (const CellLayer& layer : layers) {
                aside = std::max(aside, layer.aside);
                up = std::max(up, layer.up);
            }
            const int columns = layers.front().reached.across * params::dof_tile_columns;
            const int row = divided(begin * params::dof_tile_rows, block_height()) - up - 1;
            return {-aside - 1, row, divided_up(columns, block_width()) + 2 * (aside + 1),
                    divided_up(end * params::dof_tile_rows, block_height()) + up + 1 - row};
        }
    };

    u32 add_spans(const ApertureSpans& spans) {
        const auto first_start = static_cast<u32>(plan_.starts.size()),
                   first_span = static_cast<u32>(plan_.spans.size());
        for (const u32 start : spans.starts)
            plan_.starts.push_back(start + first_span);
        plan_.spans.insert(plan_.spans.end(), spans.spans.begin(), spans.spans.end());
        return first_start;
    }

    void add_to_group(std::optional<Group>& group, const Layer& layer, const TileGrid& reached) {
        if (group && layer.number - group->first >= 32)
            end_all(groups_);
        if (!group)
            group = Group{layer.number,
                          layer.fill,
                          std::vector<u32>(reached.marked.size()),
                          std::vector<u32>(reached.marked.size()),
                          {}};
        const auto bit = static_cast<std::size_t>(layer.number - group->first);
        for (std::size_t i = 0; i < reached.marked.size(); ++i) {
            group->reach[i] |= static_cast<u32>(reached.marked[i]) << bit;
            group->follow[i] |= static_cast<u32>(before_.marked[i]) << bit;
        }
        group->layers.resize(2 * bit);
        group->layers.push_back(add_spans(layer.spans));
        group->layers.push_back(static_cast<u32>(layer.spans.reach));
    }

    template <typename Groups>
    void end_all(Groups& groups) {
        for (auto& group : groups) {
            if (group)
                end(*group);
            group.reset();
        }
    }

    void end(const Group& group) {
        LayerPass pass{};
        pass.direct = true;
        pass.cell = 1;
        pass.fill = group.fill;
        pass.gather.layer = static_cast<float>(group.first);
        pass.gather.list = static_cast<u32>(plan_.lists.size());
        pass.gather.starts = static_cast<u32>(plan_.starts.size());
        pass.gather.pitch = 1;
        pass.gather.pad = params::dof_margin;
        plan_.starts.insert(plan_.starts.end(), group.layers.begin(), group.layers.end());
        const auto bits = [&](std::size_t i) { return std::pair(group.reach[i], group.follow[i]); };
        pass.gather.tiles = add_tiles(0, near_.down, bits);
        plan_.passes.push_back(pass);
    }

    // A launch, or several where the strips of all tiles would not fit.
    void add_passes(const Layer& layer, const TileGrid& own, const TileGrid& reached) {
        LayerPass pass{};
        pass.direct = layer.direct;
        pass.cell = 1;
        pass.fill = layer.fill;
        for (std::size_t i = 0; i < own.marked.size(); ++i)
            pass.bright = pass.bright || (!layer.direct && own.marked[i] && bright_.marked[i]);
        pass.parts = keeps_parts(options_);
        if (pass.parts)
            pass.part = part(layer);
        const int channels = options_.channels;
        const int planes = pass.parts
                               ? (pass.bright ? 16 : 8) // WIDTH in kernels/dof/parts.h
                               : 2 + channels + pass.fill * (2 + channels) + pass.bright * channels * (1 + pass.fill);
        const int pad = divided_up(layer.spans.columns + 2, 16) * 16;
        const int plane = divided_up(params::dof_tile_columns + 2 * pad + 1, 16) * 16;
        pass.gather.layer = static_cast<float>(layer.number);
        pass.gather.starts = add_spans(layer.spans);
        pass.gather.pitch = static_cast<u32>(layer.pitch);
        pass.gather.pad = static_cast<u32>(pad);
        pass.gather.strip_plane = static_cast<u32>(plane);
        pass.gather.strip_row = static_cast<u32>(planes * plane);
        pass.gather.reach = layer.spans.reach;
        pass.gather.columns = layer.spans.columns;
        const int begin_row = reached.first_row(), end_row = reached.end_row(), down = end_row - begin_row;
        const int across = near_.across, per_tile = params::dof_tile_rows / layer.pitch;
        const std::size_t tile = pass.gather.strip_row * static_cast<std::size_t>(per_tile);
        const auto kept = static_cast<int>(std::min<std::size_t>(options_.most_floats / tile, 1u << 15)); // tiles
        const int read = std::min(end_row + layer.tiles_up, near_.down) - std::max(begin_row - layer.tiles_up, 0);
        const int high = layer.direct || kept >= read ? down : std::max(kept - 2 * layer.tiles_up, 1);
        for (int begin = begin_row; begin < end_row; begin += high) {
            const int end = std::min(begin + high, end_row);
            const int first = std::max(begin - layer.tiles_up, 0), last = std::min(end + layer.tiles_up, near_.down);
            const int wide = layer.direct ? across : std::max(kept / (last - first), 1);
            for (int left = 0; left < across; left += wide) {
                const int right = std::min(left + wide, across);
                pass.gather.first = static_cast<u32>(first);
                pass.gather.first_column = static_cast<u32>(left);
                pass.gather.strip_column = pass.gather.strip_row * static_cast<u32>((last - first) * per_tile);
                add_pass(pass, layer, reached, {left, right, begin, end});
            }
        }
    }

    void add_pass(LayerPass pass, const Layer& layer, const TileGrid& reached, const Area& area) {
        pass.gather.list = static_cast<u32>(plan_.lists.size());
        pass.gather.tiles = add_list(area, before_, [&](int x, int y) { return reached.marked[reached.index(x, y)]; });
        if (pass.gather.tiles == 0)
            return;
        if (!layer.direct) {
            pass.strips = pass.gather;
            pass.strips.list = static_cast<u32>(plan_.lists.size());
            const int up = layer.tiles_up;
            const Area read{area.left, area.right, std::max(area.begin - up, 0), std::min(area.end + up, near_.down)};
            pass.strips.tiles = add_list(read, none_, [&](int x, int y) {
                for (int row = std::max(y - up, area.begin); row < std::min(y + up + 1, area.end); ++row)
                    if (reached.marked[reached.index(x, row)])
                        return true;
                return false;
            });
            plan_.strip_elements = std::max(plan_.strip_elements, static_cast<std::size_t>(pass.gather.strip_column) *
                                                                      static_cast<std::size_t>(area.right - area.left));
        }
        plan_.passes.push_back(pass);
    }

    // The aperture is summed over cells, for as many layers at once as there is room for.
    void add_cells(const Layer& layer, const TileGrid& reached) {
        std::optional<CellGroup>& group = cell_groups_[layer.fill ? 0 : 1];
        const ApertureCells aperture = aperture_cells(options_.aperture, layer.circle, options_.aspect,
                                                      options_.upright, layer.cell, layer.fill ? 2 : 4);
        int aside = 0;
        for (std::size_t i = 0; i < aperture.starts.size(); i += 2)
            aside = std::max(aside, static_cast<int>(aperture.starts[i]));
        CellLayer one{layer.number,
                      {static_cast<u32>(plan_.starts.size()), static_cast<u32>(aperture.reach)},
                      divided_up(aside, params::dof_block_columns),
                      divided_up(aperture.reach, params::dof_block_rows),
                      reached,
                      before_};
        for (std::size_t i = 0; i < aperture.starts.size(); i += 2) {
            plan_.starts.push_back(aperture.starts[i]);
            plan_.starts.push_back(aperture.starts[i + 1] + static_cast<u32>(plan_.weights.size()));
        }
        plan_.weights.insert(plan_.weights.end(), aperture.weights.begin(), aperture.weights.end());

        if (group &&
            (layer.cell != group->cell || layer.number - group->layers.front().number >= 32 || !fits(*group, one)))
            end_all(cell_groups_);
        // A group with what lies behind is laid before the one without.
        if (layer.fill && cell_groups_[1] && cell_groups_[1]->overlaps(reached))
            end_all(cell_groups_);
        if (!group)
            group = CellGroup{layer.cell, layer.fill, {}};
        group->layers.push_back(std::move(one));
    }

    std::size_t planes_of(const CellGroup& group) const {
        return static_cast<std::size_t>((2 + options_.channels) * (1 + group.fill));
    }

    // Elements of a group in these rows of tiles.
    std::size_t elements(const CellGroup& group, int begin, int end) const {
        const Blocks blocks = group.blocks(begin, end);
        return (group.nth(group.layers.back()) + std::size_t{1}) *
               (planes_of(group) * params::dof_block_columns * params::dof_block_rows + 1) *
               static_cast<std::size_t>(blocks.across) * static_cast<std::size_t>(blocks.down);
    }

    bool fits(CellGroup group, const CellLayer& one) const {
        group.layers.push_back(one);
        const Area area = group.area();
        return elements(group, area.begin, area.end) <= options_.most_floats;
    }

    // In bands of rows where one layer alone needs too much memory.
    void end(const CellGroup& group) {
        LayerPass pass{};
        pass.cell = group.cell;
        pass.fill = group.fill;
        pass.cells.layer = static_cast<float>(group.layers.front().number);
        pass.cells.layers = static_cast<u32>(plan_.starts.size());
        plan_.starts.resize(plan_.starts.size() + 2 * static_cast<std::size_t>(group.nth(group.layers.back()) + 1));
        for (const CellLayer& layer : group.layers)
            std::ranges::copy(layer.start_and_reach, plan_.starts.begin() + pass.cells.layers + 2 * group.nth(layer));
        const Area area = group.area();
        const int step = std::max(params::dof_block_rows * group.cell / params::dof_tile_rows, 1);
        int band = (area.end - area.begin + step - 1) / step * step;
        while (band > step && elements(group, area.begin, area.begin + band) > options_.most_floats)
            band -= step;
        for (int begin = area.begin; begin < area.end; begin += band)
            add_cells(pass, group, begin, std::min(begin + band, area.end));
    }

    void add_cells(LayerPass pass, const CellGroup& group, int begin, int end) {
        constexpr int tile_columns = params::dof_tile_columns, tile_rows = params::dof_tile_rows;
        const int wide = group.block_width(), high = group.block_height();
        const Blocks blocks = group.blocks(begin, end);
        pass.cells.column = blocks.column;
        pass.cells.row = blocks.row;
        pass.cells.across = blocks.across;
        pass.cells.plane =
            static_cast<u32>(blocks.across * blocks.down * params::dof_block_columns * params::dof_block_rows);
        pass.cells.one =
            static_cast<u32>(planes_of(group) * pass.cells.plane) + static_cast<u32>(blocks.across * blocks.down);
        std::vector<TileGrid> wanted, read;
        for (const CellLayer& layer : group.layers) {
            TileGrid own(blocks.across, blocks.down);
            for (int y = begin; y < end; ++y)
                for (int x = 0; x < near_.across; ++x)
                    if (layer.reached.marked[layer.reached.index(x, y)]) // with the cells around its own
                        for (int i = divided(y * tile_rows - 1, high); i <= (y * tile_rows + tile_rows) / high; ++i)
                            for (int j = divided(x * tile_columns - 1, wide);
                                 j <= (x * tile_columns + tile_columns) / wide; ++j)
                                own.marked[own.index(j - blocks.column, i - blocks.row)] = 1;
            read.push_back(widened(own, layer.aside, layer.up));
            wanted.push_back(std::move(own));
        }
        const auto size = [&] { return static_cast<u32>(plan_.lists.size()); };
        const auto list = [&](const TileGrid& grid, std::size_t i, u32 nth) {
            if (!grid.marked[i])
                return 0u;
            const u32 x = static_cast<u32>(i) % static_cast<u32>(grid.across),
                      y = static_cast<u32>(i) / static_cast<u32>(grid.across);
            plan_.lists.insert(plan_.lists.end(), {x | y << ENTRY_ROW_SHIFT, nth});
            return 1u;
        };
        pass.cells.list = size();
        for (std::size_t i = 0; i < read.front().marked.size(); ++i) // layers in turn read the same pixels
            for (std::size_t k = 0; k < read.size(); ++k)
                pass.cells.blocks += list(read[k], i, group.nth(group.layers[k]));
        pass.cells.sum_list = size();
        for (std::size_t k = 0; k < wanted.size(); ++k)
            for (std::size_t i = 0; i < wanted[k].marked.size(); ++i)
                pass.cells.sum_blocks += list(wanted[k], i, group.nth(group.layers[k]));
        pass.cells.tile_list = size();
        pass.cells.tiles = add_tiles(begin, end, [&](std::size_t i) {
            u32 reach = 0, follow = 0;
            for (const CellLayer& layer : group.layers) {
                reach |= static_cast<u32>(layer.reached.marked[i]) << group.nth(layer);
                follow |= static_cast<u32>(layer.before.marked[i]) << group.nth(layer);
            }
            return std::pair(reach, follow);
        });
        if (pass.cells.tiles == 0)
            return;
        const std::size_t last = group.nth(group.layers.back()) + std::size_t{1};
        plan_.cell_elements = std::max(plan_.cell_elements, last * pass.cells.one);
        plan_.passes.push_back(pass);
    }

    params::part_params part(const Layer& layer) {
        const double radius = std::abs(layer.circle) / 2, to_lens = layer.circle > 0 ? -1 / radius : 1 / radius;
        const int parts = parts_of_pixel(options_.aperture, layer.circle, options_.aspect);
        params::part_params part{.across = static_cast<float>(to_lens),
                                 .down = static_cast<float>(to_lens / options_.aspect),
                                 .radius = static_cast<float>(radius * parts),
                                 .single = radius <= 0.5,
                                 .taps = static_cast<u32>(plan_.taps.size()),
                                 .tap_count = 0,
                                 .directions = is_round(options_.aperture) ? 1u : 64u};
        if (layer.direct) {
            const auto taps = aperture_taps(options_.aperture, layer.circle, options_.aspect, options_.upright);
            plan_.taps.insert(plan_.taps.end(), taps.begin(), taps.end());
            part.tap_count = static_cast<u32>(taps.size());
        }
        return part;
    }

    // The word that stands for a tile in a list: its column and row, whether it has a foreground, and whether the layer just
    // before, whose tiles are marked in `before`, reached it too.
    u32 entry(int x, int y, const TileGrid& before) const {
        const std::size_t i = near_.index(x, y);
        return static_cast<u32>(x) | static_cast<u32>(y) << ENTRY_ROW_SHIFT |
               static_cast<u32>(near_.marked[i]) << ENTRY_FOREGROUND_BIT |
               static_cast<u32>(before.marked[i]) << ENTRY_FOLLOWS_BIT;
    }

    template <class Wanted>
    u32 add_list(const Area& area, const TileGrid& before, const Wanted& wanted) {
        const std::size_t size = plan_.lists.size();
        for (int y = area.begin; y < area.end; ++y)
            for (int x = area.left; x < area.right; ++x)
                if (wanted(x, y))
                    plan_.lists.push_back(entry(x, y, before));
        return static_cast<u32>(plan_.lists.size() - size);
    }

    // The tiles in these rows that a layer of a group reaches. `bits` gives a bit for each that does, and for each that follows one.
    template <class Bits>
    u32 add_tiles(int begin, int end, const Bits& bits) {
        u32 count = 0;
        for (int y = begin; y < end; ++y)
            for (int x = 0; x < near_.across; ++x)
                if (const auto [reach, follow] = bits(near_.index(x, y)); reach != 0) {
                    plan_.lists.insert(plan_.lists.end(), {entry(x, y, none_), reach, follow});
                    ++count;
                }
        return count;
    }

    const LayerPlanOptions& options_;
    TileGrid bright_, near_, none_;
    TileGrid jumps_;  // in halves of tiles, for whole ones would look beyond the halo of a region
    TileGrid before_; // tiles that the layer just before reached
    LayerPlan plan_;
    std::array<std::optional<Group>, 2> groups_; // with what lies behind, and without
    std::array<std::optional<CellGroup>, 2> cell_groups_;
};

} // namespace

void add_hidden(std::vector<TileBits>& tiles, const std::vector<TileBits>& hiding) {
    for (std::size_t i = 0; i < hiding.size(); ++i) {
        TileBits& tile = tiles[i / 2];
        bool any = false;
        for (std::size_t word = 0; word < tile.size(); ++word) {
            tile[word] |= hiding[i][word];
            any |= hiding[i][word] != 0;
        }
        if (any)
            set_bit(tile, jump_bit + static_cast<int>(i % 2));
    }
}

bool any_with(std::span<const TileBits> tiles, int bit) {
    return std::ranges::any_of(tiles, [=](const TileBits& tile) { return has_bit(tile, bit); });
}

int farthest_layer(std::span<const TileBits> tiles) {
    int bit = most_layers - 1;
    while (bit > 0 && !any_with(tiles, bit))
        --bit;
    return bit;
}

LayerSpacing layer_spacing(Quality quality, const Aperture& aperture) {
    constexpr double bend = 0.344; // log2 to 0.008
    if (quality == Quality::accurate || !is_round(aperture))
        return {quality == Quality::fast ? 3.0 : 8.0, 0, 0};
    return quality == Quality::fast ? LayerSpacing{2.875, 1, bend} : LayerSpacing{6, 3, bend};
}

double largest_in_focus(const LayerSpacing& spacing) {
    constexpr double least = 0.99 / 1024; // of a layer; layers are multiples of 1/512
    return 1 + least * (1 + spacing.offset) / (spacing.per_octave * (1 + spacing.bend));
}

double LayerScale::circle(int layer) const {
    const double away = std::abs(layer - middle) + spacing.per_octave * std::log2(1 + spacing.offset);
    const double whole = std::floor(away / spacing.per_octave), sum = 1 + spacing.bend;
    const double part = (away - whole * spacing.per_octave) / spacing.per_octave;
    // part = sum t - bend t^2
    const double t = 2 * part / (sum + std::sqrt(sum * sum - 4 * spacing.bend * part));
    const double size = std::ldexp(1 + t, static_cast<int>(whole)) - spacing.offset;
    return layer < middle ? -size : size;
}

double LayerScale::farthest_circle(double largest) const {
    int layer = middle;
    while (layer + 1 < count() && circle(layer) < largest)
        ++layer;
    return circle(layer);
}

LayerScale layer_scale(const LayerSpacing& spacing, double max_coc_px) {
    LayerScale scale{spacing, 0};
    while (scale.circle(2 * scale.middle) < max_coc_px)
        ++scale.middle;
    return scale;
}

std::vector<unsigned char> tiles_seeing(std::span<const TileBits> hiding, int across, const LayerPlanOptions& options) {
    const int down = static_cast<int>(hiding.size()) / across;
    TileGrid seeing(across, down);
    for (int number = 0; number < options.scale.count(); ++number) {
        const TileGrid own = with_bit(hiding, across, number);
        if (!own.any())
            continue;
        const Layer layer = layer_of(number, options);
        const TileGrid reached =
            widened(own, divided_up(layer.spans.columns, params::dof_hiding_columns), layer.tiles_up);
        for (std::size_t i = 0; i < seeing.marked.size(); ++i)
            seeing.marked[i] |= reached.marked[i];
    }
    return tiles_of_halves(seeing).marked;
}

LayerPlan layer_plan(std::span<const TileBits> tiles, int across, const LayerPlanOptions& options) {
    Planner planner(tiles, across, options);
    for (int layer = 0; layer < options.scale.count(); ++layer) {
        const TileGrid own = with_bit(tiles, across, layer);
        if (own.any())
            planner.add(layer, own);
        else
            planner.skip();
    }
    return planner.plan();
}

} // namespace fathom
