#pragma once

#include "operations/dof/dof_layers.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

/// Grids of tiles that are marked for the layers that they hold. Pure: no device.
namespace fathom {

inline bool has_bit(const TileBits& tile, int bit) {
    return (tile[static_cast<std::size_t>(bit / 32)] >> (bit % 32) & 1) != 0;
}

inline void set_bit(TileBits& tile, int bit) {
    tile[static_cast<std::size_t>(bit / 32)] |= params::u32{1} << (bit % 32);
}

/// Marks of tiles.
struct TileGrid {
    int across, down;
    std::vector<unsigned char> marked;

    TileGrid(int across_, int down_)
        : across(across_), down(down_), marked(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_)) {}
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x);
    }
    bool any() const { return std::ranges::find(marked, 1) != marked.end(); }
    int row_of(std::size_t place) const { return static_cast<int>(place / static_cast<std::size_t>(across)); }
    // Rows from the first marked one, and to beyond the last.
    int first_row() const { return row_of(static_cast<std::size_t>(std::ranges::find(marked, 1) - marked.begin())); }
    int end_row() const {
        const auto after = std::find(marked.rbegin(), marked.rend(), 1).base();
        return row_of(static_cast<std::size_t>(after - marked.begin()) + static_cast<std::size_t>(across) - 1);
    }
};

/// Marks every place of a line, `step` apart, that is within `reach` of a marked one.
inline void widen_line(unsigned char* line, int count, int step, int reach, std::vector<int>& until) {
    int last = -reach - 1;
    for (int i = 0; i < count; ++i) // the last marked one up to here
        until[static_cast<std::size_t>(i)] = last = line[i * step] ? i : last;
    int next = count + reach;
    for (int i = count - 1; i >= 0; --i) {
        const int before = until[static_cast<std::size_t>(i)];
        next = before == i ? i : next;
        line[i * step] = i - before <= reach || next - i <= reach;
    }
}

/// Every tile within so many columns and rows of a marked one.
inline TileGrid widened(TileGrid grid, int columns, int rows) {
    std::vector<int> until(static_cast<std::size_t>(std::max(grid.across, grid.down)));
    for (int y = 0; columns > 0 && y < grid.down; ++y)
        widen_line(&grid.marked[grid.index(0, y)], grid.across, 1, columns, until);
    for (int x = 0; rows > 0 && x < grid.across; ++x)
        widen_line(&grid.marked[grid.index(x, 0)], grid.down, grid.across, rows, until);
    return grid;
}

inline TileGrid with_bit(std::span<const TileBits> tiles, int across, int bit) {
    TileGrid grid(across, static_cast<int>(tiles.size()) / across);
    for (std::size_t i = 0; i < tiles.size(); ++i)
        grid.marked[i] = has_bit(tiles[i], bit);
    return grid;
}

/// Tiles with pixels in layers before `end`.
inline TileGrid with_any(std::span<const TileBits> tiles, int across, int end) {
    TileGrid grid(across, static_cast<int>(tiles.size()) / across);
    for (std::size_t i = 0; i < tiles.size(); ++i)
        for (int bit = 0; bit < end && !grid.marked[i]; ++bit)
            grid.marked[i] = has_bit(tiles[i], bit);
    return grid;
}

/// The tiles that have a marked half.
inline TileGrid tiles_of_halves(const TileGrid& halves) {
    TileGrid tiles(halves.across / 2, halves.down);
    for (int y = 0; y < halves.down; ++y)
        for (int x = 0; x < halves.across; ++x)
            tiles.marked[tiles.index(x / 2, y)] |= halves.marked[halves.index(x, y)];
    return tiles;
}

/// The halves of tiles in which something before the focus ends.
inline TileGrid jumps_in_halves(std::span<const TileBits> tiles, int across) {
    TileGrid halves(2 * across, static_cast<int>(tiles.size()) / across);
    for (std::size_t i = 0; i < halves.marked.size(); ++i)
        halves.marked[i] = has_bit(tiles[i / 2], jump_bit + static_cast<int>(i % 2));
    return halves;
}

} // namespace fathom
