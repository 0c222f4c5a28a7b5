#pragma once

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/fog.hpp>
#include <fathom/image.hpp>
#include <fathom/linearize.hpp>
#include <fathom/normals.hpp>
#include <fathom/ssao.hpp>
#include <fathom/unproject.hpp>

#include <cstddef>
#include <limits>

/// What a host asks that cuts images into tiles, or has to know whether a call fits into a device: how far around a tile an
/// operation reads, and the memory that a call takes for itself. The operations ask the same when they cut images into bands.

namespace fathom {
#pragma GCC visibility push(default)

/// How far an operation looks. It depends on the options, on the camera and on how depth is stored, not on the tile's size or place;
/// nothing here asks a device, but for the one that says so. Options out of range throw as the operation's own call does.
/// Operations of single pixels say it in their own headers: nothing around a tile, and no memory.
Reach reach(const Tile& tile, const NormalsOptions& options);

/// `widest_coc_px`: the widest circle of confusion around the tile, in pixels, as `widest_coc` finds it; `max_coc_px` if not
/// given. Tiles of `tile_min_coc` and `tile_max_coc` are counted from the image's first pixel: begin images at multiples of
/// `tile_px`.
Reach reach(const Tile& tile, const DofMasksOptions& options,
            double widest_coc_px = std::numeric_limits<double>::infinity());
Reach reach(const Tile& tile, const DofOptions& options,
            double widest_coc_px = std::numeric_limits<double>::infinity());

/// Depends on how near surfaces come, since a radius covers the more pixels the nearer they are. `nearest` is the least view depth
/// of any surface, in scene units; under an orthographic camera it does not matter.
/// Throws: std::invalid_argument for a nearest depth behind the camera.
Reach reach(const Tile& tile, double radius, const SsaoOptions& options, double nearest);

/// The same for the surfaces that a depth image has, which is less if the near ones lie where the camera sees them best. Asks the
/// device and waits for it.
Reach reach(const StoredDepth& stored, double radius, const SsaoOptions& options);

/// Bytes of a device's memory that a call for all of a tile's pixels takes for itself, besides its inputs and results: a
/// `memory_budget` of so much is no bound to it, and less makes the call work in bands. They grow with the tile's width, and with
/// its height up to where an operation works in bands anyway. Nothing here asks a device.
std::size_t bytes(const Tile& tile, const NormalsOptions& options);
std::size_t bytes(const Tile& tile, const DofMasksOptions& options);
std::size_t bytes(const Tile& tile, const SsaoOptions& options);

/// The most that a call takes for a picture of so many channels. It takes less where few layers have pixels.
std::size_t bytes(const Tile& tile, int channels, const DofOptions& options,
                  double widest_coc_px = std::numeric_limits<double>::infinity());

#pragma GCC visibility pop
} // namespace fathom
