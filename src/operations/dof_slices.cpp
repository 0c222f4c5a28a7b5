// Where a slice has pixels, where its aperture carries them, and how many rows of tiles fit into the memory for its strips.

#include "operations/dof_slices.hpp"

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

using params::u32;

// Floats that strips may take; a slice that needs more is done in bands of rows.
constexpr std::size_t strip_budget = std::size_t{24} << 20;

// Up to this many pixels around one, reading them one by one is cheaper than running sums.
constexpr int most_direct = 2;

// With every pixel's own place in the lens: for small circles a pixel's middle is not that of what shows through it.
constexpr int most_taps = 8;

struct Grid {
    int across, down;
    std::vector<bool> marked;

    Grid(int across_, int down_)
        : across(across_), down(down_), marked(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_)) {}
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x);
    }
    bool any() const { return std::ranges::find(marked, true) != marked.end(); }
};

// Every tile within so many of a marked one.
Grid widened(const Grid& grid, int columns, int rows) {
    Grid wide(grid.across, grid.down), result(grid.across, grid.down);
    for (int y = 0; y < grid.down; ++y)
        for (int x = 0; x < grid.across; ++x)
            if (grid.marked[grid.index(x, y)])
                for (int i = std::max(0, x - columns); i <= std::min(grid.across - 1, x + columns); ++i)
                    wide.marked[wide.index(i, y)] = true;
    for (int y = 0; y < grid.down; ++y)
        for (int x = 0; x < grid.across; ++x)
            if (wide.marked[wide.index(x, y)])
                for (int i = std::max(0, y - rows); i <= std::min(grid.down - 1, y + rows); ++i)
                    result.marked[result.index(x, i)] = true;
    return result;
}

Grid with_bit(std::span<const TileBits> tiles, int across, int bit) {
    Grid grid(across, static_cast<int>(tiles.size()) / across);
    for (std::size_t i = 0; i < tiles.size(); ++i)
        grid.marked[i] = has_bit(tiles[i], bit);
    return grid;
}

// Tiles with pixels in slices before `end`.
Grid with_any(std::span<const TileBits> tiles, int across, int end) {
    Grid grid(across, static_cast<int>(tiles.size()) / across);
    for (int bit = 0; bit < end; ++bit) {
        const Grid one = with_bit(tiles, across, bit);
        for (std::size_t i = 0; i < tiles.size(); ++i)
            grid.marked[i] = grid.marked[i] || one.marked[i];
    }
    return grid;
}

// Tiles in rows [begin, end), the last bits set where `also` and `near` are marked.
u32 add_list(const Grid& grid, int begin, int end, const Grid& also, const Grid& near, std::vector<u32>& lists) {
    const std::size_t before = lists.size();
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < grid.across; ++x)
            if (grid.marked[grid.index(x, y)])
                lists.push_back(static_cast<u32>(x) | static_cast<u32>(y) << 16 |
                                static_cast<u32>(near.marked[grid.index(x, y)]) << 30 |
                                static_cast<u32>(also.marked[grid.index(x, y)]) << 31);
    return static_cast<u32>(lists.size() - before);
}

int pitch_for(double circle, BlurQuality quality) {
    const double radius = std::abs(circle) / 2;
    if (quality == BlurQuality::fast)
        return radius >= 24 ? 8 : radius >= 12 ? 4 : radius >= 5 ? 2 : 1;
    return radius >= 96 ? 4 : radius >= 48 ? 2 : 1;
}

int divided_up(int a, int b) {
    return (a + b - 1) / b;
}

} // namespace

double SliceScale::circle(int slice) const {
    const int away = std::abs(slice - middle), octave = away / per_octave;
    const double size = std::ldexp(1 + static_cast<double>(away % per_octave) / per_octave, octave);
    return slice < middle ? -size : size;
}

SliceScale slice_scale(int per_octave, double largest_px) {
    SliceScale scale{per_octave, 0};
    while (scale.circle(2 * scale.middle) < largest_px)
        ++scale.middle;
    return scale;
}

SlicePlan slice_plan(std::span<const TileBits> tiles, int across, const SlicePlanOptions& options) {
    SlicePlan plan;
    const Grid bright = with_bit(tiles, across, 159);
    const int down = bright.down;
    const Grid none(across, down);
    const Grid near = with_any(tiles, across, options.scale.middle);
    Grid before = none; // tiles that the slice just before reached
    for (int slice = 0; slice < options.scale.count(); ++slice) {
        const Grid own = with_bit(tiles, across, slice);
        if (!own.any()) {
            before = none;
            continue;
        }
        const double circle = slice == options.scale.middle ? 1 : options.scale.circle(slice);
        const int pitch =
            pitch_for(circle * std::min(options.aspect, 1.0) * thinnest(options.aperture), options.quality);
        const ApertureSpans spans = aperture_spans(options.aperture, circle, options.aspect, options.upright, pitch);
        const bool accurate = options.quality == BlurQuality::accurate;
        const int direct_up_to = accurate ? most_taps : most_direct;
        const bool direct = spans.columns <= direct_up_to && spans.reach <= direct_up_to;
        const int rows = spans.reach * pitch;
        const int tiles_up = divided_up(rows, tile_rows), tiles_aside = divided_up(spans.columns, tile_columns);
        const Grid reached = widened(own, tiles_aside, tiles_up);

        SlicePass pass{};
        pass.direct = direct;
        pass.fill = !accurate && slice < options.scale.middle;
        for (std::size_t i = 0; i < own.marked.size(); ++i)
            pass.bright = pass.bright || (!direct && own.marked[i] && bright.marked[i]);
        const int planes =
            2 + options.channels + pass.fill * (2 + options.channels) + pass.bright * options.channels + accurate;
        const int pad = divided_up(spans.columns + 2, 16) * 16;
        const int plane = divided_up(tile_columns + 2 * pad + 1, 16) * 16;
        const int per_tile = tile_rows / pitch;

        if (accurate) {
            const double radius = std::abs(circle) / 2, to_lens = circle > 0 ? -1 / radius : 1 / radius;
            pass.part = {.across = static_cast<float>(to_lens),
                         .down = static_cast<float>(to_lens / options.aspect),
                         .radius =
                             static_cast<float>(radius * parts_of_pixel(options.aperture, circle, options.aspect)),
                         .single = radius <= 0.5,
                         .taps = static_cast<u32>(plan.taps.size()),
                         .tap_count = 0,
                         .directions = is_round(options.aperture) ? 1u : 64u};
            if (direct) {
                const auto taps = aperture_taps(options.aperture, circle, options.aspect, options.upright);
                plan.taps.insert(plan.taps.end(), taps.begin(), taps.end());
                pass.part.tap_count = static_cast<u32>(taps.size());
            }
        }

        const auto starts = static_cast<u32>(plan.starts.size()), first_span = static_cast<u32>(plan.spans.size());
        for (const u32 start : spans.starts)
            plan.starts.push_back(start + first_span);
        plan.spans.insert(plan.spans.end(), spans.spans.begin(), spans.spans.end());

        const std::size_t row_of_tiles = static_cast<std::size_t>(across) * static_cast<std::size_t>(per_tile) *
                                         static_cast<std::size_t>(planes) * static_cast<std::size_t>(plane);
        const int kept = direct ? down : static_cast<int>(std::min<std::size_t>(strip_budget / row_of_tiles, 1u << 15));
        const int band = direct ? down : std::max(kept - 2 * tiles_up, 1);
        for (int begin = 0; begin < down; begin += band) {
            const int end = std::min(begin + band, down);
            const int first = std::max(begin - tiles_up, 0), last = std::min(end + tiles_up, down);
            Grid wanted(across, down);
            for (int y = begin; y < end; ++y)
                for (int x = 0; x < across; ++x)
                    wanted.marked[wanted.index(x, y)] = reached.marked[reached.index(x, y)];
            const int strip_rows = (last - first) * per_tile;
            const params::slice_params common{.slice = static_cast<float>(slice),
                                              .tiles = 0,
                                              .list = 0,
                                              .starts = starts,
                                              .first = static_cast<u32>(first),
                                              .pitch = static_cast<u32>(pitch),
                                              .pad = static_cast<u32>(pad),
                                              .strip_plane = static_cast<u32>(plane),
                                              .strip_row = static_cast<u32>(planes * plane),
                                              .strip_column = static_cast<u32>(planes * plane * strip_rows),
                                              .reach = spans.reach,
                                              .reserved = 0};
            pass.strips = pass.gather = common;
            pass.gather.list = static_cast<u32>(plan.lists.size());
            pass.gather.tiles = add_list(wanted, begin, end, before, near, plan.lists);
            if (pass.gather.tiles == 0)
                continue;
            if (!direct) {
                pass.strips.list = static_cast<u32>(plan.lists.size());
                pass.strips.tiles = add_list(widened(wanted, 0, tiles_up), first, last, none, none, plan.lists);
                plan.strip_elements = std::max(plan.strip_elements, static_cast<std::size_t>(pass.strips.strip_column) *
                                                                        static_cast<std::size_t>(across));
            }
            plan.passes.push_back(pass);
        }
        before = reached;
    }
    return plan;
}

} // namespace fathom
