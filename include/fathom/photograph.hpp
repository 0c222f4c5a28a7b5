#pragma once

#include <cstddef>
#include <span>
#include <vector>

/// What a photograph and its estimated depth need before a blur. On the host, without a device. Target `fathom::camera`.
namespace fathom {
#pragma GCC visibility push(default)

/// Floats in host memory: depth, or the light of a picture with its channels interleaved.
struct HostFloats {
    const float* data = nullptr;
    int width = 0;              ///< pixels
    int height = 0;             ///< pixels
    int channels = 1;           ///< of a pixel
    std::size_t row_stride = 0; ///< floats from one row to the next; 0: rows follow each other without a gap
};

/// What becomes of edges in depth that ramp over a few pixels, as `sharpen_edges` of linearize.hpp has it.
enum class Edges { keep, sharpen };

/// Depth on the grid of a picture of another size: a mean of the nearest 4 × 4 depths, in which those count whose part of the
/// picture has this pixel's colour. Both show the same; neither is cropped. In: one float a pixel, and three or four in linear
/// light. Out: one float for each pixel of the picture, rows without a gap; NaN where no depth is known.
/// Throws: std::invalid_argument for images without pixels, and for other channels.
/// Source: Kopf, Cohen, Lischinski, Uyttendaele 2007, eq. 2.
std::vector<float> upsample_along_edges(const HostFloats& depth, const HostFloats& color);

/// Makes white brighter, which a file of integers has cut off: light from 0.97 on grows smoothly, to `highlights` times of itself at 1.
/// Two channels have to be that bright and the third above 0.9, or one of a saturated colour, such as an orange lamp's, whose
/// smallest channel is less than 0.11 of its largest (none of it counts from 0.2 on). So a pale surface that reaches white in one
/// channel or two stays, or changes by 12 codes of sRGB at most.
/// In: pixels of three or four channels in linear light, without gaps. An alpha stays as it is.
/// A blur then shows lamps as bright discs. What a lamp's light really was is not known; photo editors offer the same guess.
/// Throws: std::invalid_argument unless highlights is finite and 1 or greater, and for other channels.
void restore_highlights(std::span<float> color, int channels, double highlights);

#pragma GCC visibility pop
} // namespace fathom
