// Parameters of the kernels: plain structs of fixed-width scalars, read by both compilers.
//
// A `wide` is a double as its bits, or two floats (high part in the low word) for a device without double:
// `pack_wide` in src/operations/parameters.cpp writes it, `wide_*` in vector.h reads it.
// An affine function of (v, x, y, 1) is four of them: v the stored value, (x, y) the pixel's centre.

#ifndef FATHOM_PARAMS_H
#define FATHOM_PARAMS_H

#ifdef __OPENCL_C_VERSION__
typedef uint u32;
typedef ulong u64;
typedef ulong wide;
#else
#include <cstdint>
namespace fathom::params {
using u32 = std::uint32_t;
using u64 = std::uint64_t;
using wide = std::uint64_t;
#endif

// Columns [x_begin, x_end) of `height` rows, from one image to another. Offsets and strides in elements; the first
// pixel of the images is pixel (pixel_x, pixel_y) of the camera.
typedef struct {
    u64 source_offset;
    u64 target_offset;
    u32 source_stride;
    u32 target_stride;
    u32 x_begin;
    u32 x_end;
    u32 height;
    u32 pixel_x;
    u32 pixel_y;
    u32 reserved; // a size that is a multiple of eight on both sides
} grid_params;

// How a stored value becomes a view depth. See DepthForm in include/fathom/camera.hpp.
typedef struct {
    wide numerator[4];   // affine, rational
    wide denominator[4]; // reciprocal_affine, rational
    wide rate;           // exponential: z = amplitude (2^(rate v + start) - 1) + offset
    wide start;
    wide amplitude;
    wide offset;
    float sign; // reciprocal: t = sign v + end >= 0, z = gain / (t + pole)
    float end;
    float gain_high, gain_low;
    float pole_high, pole_low;
    float lowest, highest;  // stored values that can be a surface
    float least_depth;      // z must be greater: 0 under a perspective
    float background_depth; // what a background pixel becomes
    u32 background;         // its stored bits
    u32 background_mask;    // all ones, or 0 where no value means background
    u32 code_shift;         // uint24: bits below the code
    u32 byte_weights[3];    // rgb8
} depth_params;

// position = origin + w direction; w is the depth, or (z - eye_depth) / depth(x, y). Columns multiply (x, y, 1).
typedef struct {
    wide origin[3][3];
    wide direction[3][3];
    wide length[3][3]; // upper triangular, as long as direction for every pixel
    wide depth[3];
    wide eye_depth;
    wide scale; // ray distance: scene units per stored unit
} ray_params;

// From inverse depth q and its slopes gx, gy per pixel to a normal. See kernels/normals.cl.
//   n = of_slope_x gx + of_slope_y gy + of_depth (q - gx (x - centre_x) - gy (y - centre_y)), or 1 for the last factor
// for an orthographic camera. The bound of q's error is error_constant + error_linear |q| + error_quadratic q^2.
typedef struct {
    float of_slope_x[3];
    float of_slope_y[3];
    float of_depth[3];
    float centre_x[2]; // sum of two floats
    float centre_y[2];
    float error_constant, error_linear, error_quadratic;
} normal_params;

// An image split into 4 x 4 planes: pixel (x, y) lies in plane 4 (y mod 4) + x mod 4 at column x / 4 and row y / 4, so
// that pixels which share a sampling pattern are neighbours in memory. `margin` columns on both sides and one row above
// and below hold what lies outside.
typedef struct {
    u32 width, height;   // of the image, pixels
    u32 pixel_x, pixel_y; // of the image's first pixel in the camera's image
    u32 columns, rows;   // of a plane, without margins; columns are a multiple of 16
    u32 stride;          // elements from row to row of a plane
    u32 plane;           // elements from plane to plane
} split_params;

// A place that the pixels of one sampling pattern look at, along a slice: the nearest pixel, and the stretch of the slice
// that it stands for. Distances in pixels along the slice.
typedef struct {
    int offset;               // elements from the pixel to it, in the split image
    int rows_columns;         // the same, rows in the high half and columns in the low one
    float distance;           // of its centre
    float inverse_distance;
    float square_distance;
    float aside;              // from the pixel's centre to the slice
    float low, high;          // from it to where its stretch begins at the nearest and ends at the farthest
    float inverse_low, inverse_high; // of the distances there
    float gap;                // from the last one to it
    float before, after;      // from the last one, and from it, to half way between them
    float inverse_inner;      // of the distance there
} tap_params;

// How positions lie around a pixel, for the occlusion kernels. See EyeRays in src/camera/eye_rays.hpp.
typedef struct {
    float direction[3][3]; // of the ray through pixel (x, y): rows x, y, z; columns multiply (x, y, 1)
    float step[3][2];      // what one pixel to the right and one down adds: to the direction (perspective), to the
                           // place where the ray starts (orthographic rays)
    float normals[3][3];   // given normals to view space
    float radius;
    float thickness;
    float slope_errors;    // of the tangent plane, in errors of inverse depth per pixel
    float error_constant, error_linear, error_quadratic; // of inverse depth, see InverseDepthError
    float pixel;           // a pixel's width: at distance one (perspective), or anywhere
    float edge;            // how many of them a neighbour may lie off the tangent plane
    u32 slices;            // per pixel
    u32 levels;            // of radii on the screen, each the square root of two times the last
} occlusion_params;

// The circle of confusion of a stored value: see Circle in include/fathom/lens.hpp and kernels/circle.h.
typedef struct {
    wide numerator[4];   // sum: c, or 1/(z - lens_depth) under a perspective; quotient: c = numerator / denominator
    wide denominator[4];
    wide in_front[4];    // quotient under a perspective: has the denominator's sign for what lies before the lens
    wide k, g;           // of the depth beyond the lens
    float sign, end;     // recentred: t = sign v + end >= 0, c = slope t + at_end
    float slope_high, slope_low;
    float at_end;
    float sky;      // of the background: NaN where it is left out
    float infinite; // of a stored value that is infinite
    float largest;  // no circle is larger, on either side
    float sharp;    // up to this |c| all is in focus
    float inverse_transition; // of the pixels from there to none
} circle_params;

// The bound of inverse depth's error, as in normal_params; and the least step between two surfaces that counts, constant and
// per inverse depth. See kernels/mixed_pixels.cl.
typedef struct {
    float error_constant, error_linear, error_quadratic;
    float step_constant, step_linear;
} mixed_params;

// An image of circles in tiles, and tiles in blocks of 16 x 16, each with the least and the greatest circle in it. All images
// start at their buffer's first element.
typedef struct {
    u32 width, height;   // pixels
    u32 stride;          // elements from row to row of whatever has a value a pixel
    u32 tile;            // pixels across
    u32 columns, rows;   // tiles
    u32 tile_stride;     // elements from row to row of what has a value a tile
    u32 block_columns, block_rows;
    u32 block_stride;
    float vertical;      // horizontal pixels that a vertical one is high
    float sharp;         // as in circle_params
    float inverse_transition;
    float shows;         // a near layer that covers less than this lets something through
} near_field_params;

// An image cut into tiles of 64 x 16 pixels that are anchored at the camera's image; planes hold whole tiles, with a margin
// of 16 columns on either side.
typedef struct {
    u32 width, height; // of the image, pixels
    u32 left, top;     // columns and rows of the first tile before the image's first pixel
    u32 columns, rows; // of a plane, without margins
    u32 stride;        // elements from row to row of a plane
    u32 plane;         // elements from plane to plane
    u32 middle;        // the slice of what is in focus
    float per_octave;  // slices in which a circle doubles
    float largest;     // circle, pixels
    float knee;        // colours beyond this are summed apart
} blur_params;

// One slice of circle of confusion, and the tiles that it is worked out for at once; of several the first.
typedef struct {
    float layer;
    u32 tiles, list;  // how many there are, and where the list of them begins
    u32 starts;       // where the table of spans by row begins
    u32 first;        // row of tiles of the first strips
    u32 first_column; // and column of tiles
    u32 pitch;        // rows of pixels summed into a row of a strip: 1, 2, 4, 8 or 16
    u32 pad;          // columns of a strip on either side of its tile
    u32 strip_plane;  // elements from plane to plane of a strip's row
    u32 strip_row;    // elements from row to row
    u32 strip_column; // elements from a column of tiles to the next
    int reach;        // rows of strips above and below that the aperture covers
    int columns;      // and columns on either side
} layer_params;

// Pixels from `low` to before `high` of a row, and what each counts.
typedef struct {
    int low, high;
    float weight;
} span_params;

// A pixel of a small aperture or a part of one, what it counts, and the middle of the part of the lens that it shows through.
typedef struct {
    int column, row;
    float weight;
    float u, v;
} aperture_tap_params;

// How a slice's pixels lie in the lens, and which tables its parts are read from. See kernels/dof_parts.cl.
typedef struct {
    float across, down;  // lens coordinates per column and row
    float radius;        // of the aperture, parts of a pixel
    u32 single;          // does the pixel alone show through all of the lens?
    u32 taps, tap_count; // where the slice's own begin, where pixels are read directly
    u32 directions;      // of the table of half-planes: 1, or many all around
} part_params;

// Where to look for what lies behind a pixel.
typedef struct {
    u32 block_columns, block_rows; // of 8 x 8 pixels
    float farthest;                // slice of any pixel
    float vertical;                // horizontal pixels that a row is high
} behind_params;

#ifndef __OPENCL_C_VERSION__
} // namespace fathom::params
#endif

#endif
