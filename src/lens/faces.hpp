#pragma once

#include "lens/camera_lens.hpp"

#include <cstdint>
#include <vector>

namespace fathom::lens {

/// Pixels [left, right) x [top, bottom).
struct PixelBox {
    int left, top, right, bottom;

    int width() const { return right - left; }
    int height() const { return bottom - top; }
};

constexpr int fade =
    4; ///< pixels right of a block, and below it, in which its face's results pass over into those of the next one

constexpr double least_part_ahead = 0.05; ///< of a unit ray, ahead of a face that looks at it

/// A pinhole that sees a block of a lens's image, as dense as the lens in the block's middle. Its image has the view axis in its
/// middle, and more pixels than a call looks at.
struct Face {
    PixelBox block;       ///< of the lens's image
    Eigen::Matrix3d turn; ///< rows: right, down and ahead of the face in the axes of view space
    double focal;         ///< pixels
    int half;             ///< pixels from the image's middle to its border
    PixelBox inner;       ///< of the face's image: where the block's rays meet it, with what interpolation needs
    double least, most;   ///< what a step ahead of the face is long along the block's rays, in what depth counts along
};

/// Blocks that hold all pixels of the image, each with its face: one where a pinhole has about as many pixels as the image.
/// `along_axis`: does depth count along the view axis?
std::vector<Face> faces_of(const CameraLens& lens, int width, int height, bool along_axis);

/// The part of a face's image that lies within a margin around what the block covers. The margin is the angle that a sphere covers
/// whose radius is `sine` times its distance, and at most where the face ends.
PixelBox with_margin(const Face& face, double sine);

/// What a tile of 16 x 16 pixels of the lens's image covers of a face, in tangents of the angles from its axis. Tiles without rays
/// are left out.
struct FaceTile {
    int column, row; ///< of the tile in the lens's image
    double left, top, right, bottom;
};
std::vector<FaceTile> tiles_of(const CameraLens& lens, const Face& face);

/// The same with a margin of each tile's own: `sines` in the order of `tiles`.
PixelBox with_margin(const Face& face, const std::vector<FaceTile>& tiles, const std::vector<double>& sines);

/// Squares of so many pixels of a face's image, from its first pixel on, by rows: 1 where results are needed for the lens's pixels,
/// 0 elsewhere.
struct FaceBlocks {
    int columns;
    std::vector<std::uint32_t> needed;
};
FaceBlocks blocks_of(const Face& face, const std::vector<FaceTile>& tiles, int size);

/// Where the pixels of a tile of 16 x 16 pixels of the lens's image are seen on its face, in pixels from the axis: a polynomial of
/// both indices in the tile, up to their squares. Three rows of eight floats, one for each power of the row: x and y of the three
/// powers of the column, and two that are 0; all NaN where the polynomial is off by more than a 64th of a pixel.
struct FacePlaces {
    int tiles_across;
    std::vector<float> numbers;
};
FacePlaces places_of(const CameraLens& lens, int width, int height, const std::vector<Face>& faces);

/// Which pixel position of the lens's image each pixel of a part of a face sees: tiles of 16 x 16 pixels with nodes every h pixels,
/// between which they are bilinear. NaN where the lens sees nothing.
struct FacePositions {
    int tiles_across;
    std::vector<std::uint32_t> tiles; ///< by rows: 8 times the first node, and h = 1 << the lowest three bits
    std::vector<float> nodes;         ///< x, y
};

/// The sides of `part` are multiples of 16 pixels.
FacePositions positions_of(const CameraLens& lens, const Face& face, const PixelBox& part);

} // namespace fathom::lens
