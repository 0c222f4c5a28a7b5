// Parameters of the kernels: plain structs of fixed-width scalars, read by both compilers.
//
// A `wide` is a double as its bits, or two floats (high part in the low word) for a device without double:
// `pack_wide` in src/operations/parameters.cpp writes it, `wide_*` in vector.h reads it.
// An affine function of (v, x, y, 1) is four of them: v the stored value, (x, y) the pixel's centre.
//
// Every struct is followed by PARAMS(name, bytes): both compilers check its size, and the host learns the name that OpenCL
// reports for an argument of it. Nothing else needs to know that a struct exists.
// Every number that a kernel and the host share stands here once: as a CONSTANT, or as a macro if the preprocessor reads it.

#ifndef FATHOM_PARAMS_H
#define FATHOM_PARAMS_H

#ifdef __OPENCL_C_VERSION__
typedef uint u32;
typedef ulong u64;
typedef ulong wide;
#define PARAMS(name, bytes) typedef char name##_has_its_size[sizeof(name) == (bytes) ? 1 : -1];
#define CONSTANT(name, value) enum { name = value };
#else
#include <cstdint>
namespace fathom::params {
using u32 = std::uint32_t;
using u64 = std::uint64_t;
using wide = std::uint64_t;
#define PARAMS(name, bytes)                                                                                            \
    static_assert(sizeof(name) == (bytes), "a params struct has the same size on the host and on the device");         \
    constexpr const char* type_name(const name&) {                                                                     \
        return #name;                                                                                                  \
    }
#define CONSTANT(name, value) inline constexpr int name = value;
#endif

// Form of the depth decoder: DepthForm in include/fathom/camera.hpp.
#define ALONG_AXIS 0
#define ALONG_RAY 1
#define ALONG_CUBE 2

#define FORM_RECIPROCAL 0
#define FORM_RECIPROCAL_AFFINE 1
#define FORM_AFFINE 2
#define FORM_RATIONAL 3
#define FORM_EXPONENTIAL 4
#define FORM_RAY_DISTANCE 5
#define FORM_INVERSE_RAY_DISTANCE 6

// A distance along the ray that is an inverse is counted in this unit: it may be longer than any float though its depth is one.
CONSTANT(inverse_ray_unit, 256)

// How stored depth lies in memory.
#define STORAGE_FLOAT32 0
#define STORAGE_FLOAT16 1
#define STORAGE_UINT16 2
#define STORAGE_UINT24 3
#define STORAGE_RGB8 4
#define STORAGE_UINT8 5

// How a colour lies in memory.
#define ELEMENT_FLOAT 0
#define ELEMENT_HALF 1
#define ELEMENT_U16 2
#define ELEMENT_U8 3

// How the circle of confusion is computed.
#define CIRCLE_RECENTRED 0 // affine in the stored value, counted from the far end of its range
#define CIRCLE_SUM 1       // affine in the stored value and the pixel
#define CIRCLE_QUOTIENT 2  // of two such sums
#define CIRCLE_OF_DEPTH 3  // the depth is decoded first

// Columns [x_begin, x_end) of `height` rows, from one image to another. Offsets and strides are in elements. The first pixel
// of the images is pixel (pixel_x, pixel_y) of the camera. The target's first row is row y_begin of what is computed.
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
    u32 y_begin;
} grid_params;
PARAMS(grid_params, 48)

// An image with several channels that is read beside the depth. Offset and stride are in elements.
typedef struct {
    u64 offset;
    u32 stride;
    u32 channels;
} source_params;
PARAMS(source_params, 16)

// Where an image of one float a pixel lies in its buffer. In elements.
typedef struct {
    u64 offset;
    u32 stride;
    u32 reserved;
} place_params;
PARAMS(place_params, 16)

// How a stored value becomes a view depth. See DepthForm in include/fathom/camera.hpp.
typedef struct {
    wide numerator[4];   // affine, rational; ray_distance: the distance
    wide denominator[4]; // reciprocal_affine, rational; inverse_ray_distance: the inverse of the distance
    wide rate;           // exponential: z = amplitude (2^(rate v + start) - 1) + offset
    wide start;
    wide amplitude;
    wide offset;         // exponential; depth that distances along the ray are counted from
    float sign; // reciprocal: t = sign v + end >= 0, z = gain / (t + pole)
    float end;
    float gain_high, gain_low;
    float pole_high, pole_low;
    float lowest, highest;  // stored values that can be a surface
    float least_depth;      // z must be greater: 0 under a perspective
    float background_depth; // what a background pixel becomes
    u32 background;         // its stored bits; 1 where no value means background
    u32 background_mask;    // of a value's bits that are compared with it: all, all but a 0's sign, or none
    float farther;          // the background, too: farther v >= background_from; NaN where none is
    float background_from;
    u32 missing;            // likewise of what was not measured
    u32 missing_mask;
    u32 has_special;        // are there values of background_from or missing?
    u32 code_shift;         // uint24: bits below the code
    u32 byte_weights[3];    // rgb8
} depth_params;
PARAMS(depth_params, 184)

// position = origin + w direction; w is the depth, or (z - centre_depth) / depth(x, y). Columns multiply (x, y, 1).
typedef struct {
    wide origin[3][3];
    wide direction[3][3];
    wide length[3][3]; // upper triangular, as long as direction for every pixel
    wide depth[3];
    wide centre_depth;
} ray_params;
PARAMS(ray_params, 248)

// Rays through a lens are patches: see kernels/camera/patch.h. Tiles of 1 << lens_tile_shift pixels on a side choose their size.
CONSTANT(lens_tile_shift, 4)

// Rows of a work-item through a lens, on a CPU: they share what depends on their columns.
CONSTANT(lens_rows, 16)

// Floats of a node of the patches.
CONSTANT(lens_node_floats, 20)

typedef struct {
    wide to_view[3][3];  // rays from the axes of the result back to those of view space
    float centre[3][2];  // the camera centre in the axes of the result: sums of two floats
    float least_ahead;   // rays with less of them along the view axis have no depth along it
    u32 tiles;           // in a row
} lens_params;
PARAMS(lens_params, 104)

// A pinhole that sees a part of a lens's image: see kernels/faces. Its pixel (x, y) looks along
//   ahead + X right + Y down,   (X, Y) = (x, y) + first
typedef struct {
    float ahead[3], right[3], down[3]; // a step of one along its axis, and what a pixel to the right and one down add
    float first[2];      // of the first pixel's middle, pixels from the axis
    float pixel;         // a pixel's width at distance one
    u32 columns, rows;   // of its image, multiples of 16
    u32 stride;          // elements from row to row of it
    u32 tiles;           // of its positions in a row
    u32 turn;            // columns of a whole turn that the camera sees, or 0
    u32 camera_columns, camera_rows;
    u32 left, top;       // the first pixel of the depth in the camera's image
    u32 width, height;   // of the depth
    u32 plane_stride;    // pixels from row to row of the tangent planes
} face_params;
PARAMS(face_params, 96)

// Columns of a face that a work-item of onto_face fills, of vectors.
CONSTANT(onto_face_columns, 64)

// What is brought onto a face besides depth: an image of the depth's size, and how its vectors turn.
typedef struct {
    u64 offset;
    u64 target_offset;
    u32 stride;
    u32 channels;
    float turn[3][3];
    u32 margin; // rows of invalid pixels above the target, and one more below it; then there are columns, too
} onto_face_params;
PARAMS(onto_face_params, 64)

// A result that goes back: columns [first_column, last_column] and rows of the face have it.
typedef struct {
    float unit[3][3];   // right, down and ahead of the face, as columns
    float error;        // of inverse depth, relative
    float edge;         // widths of a pixel that a neighbour may lie off the plane
    int first_column, first_row, last_column, last_row;
    u32 stride;         // elements from row to row of it
    u32 x, y;           // the target's first pixel in the depth
    u32 depth_offset;   // of the face's depth
    float least_ahead;  // of a unit ray that the face has computed
    int left, top, right, bottom; // the face's block in the depth
    int fade_left, fade_top, fade_right; // where blocks begin or end that were there before, or far away
} from_face_params;
PARAMS(from_face_params, 108)

// Pixels to the right of a block and below it in which its face's results pass over into those of the next one.
CONSTANT(lens_fade, 4)

// Of the blocks of a face's whole image.
typedef struct {
    u32 columns;
    u32 reserved;
} face_block_params;
PARAMS(face_block_params, 8)

// What tells how far a tangent plane may be off.
typedef struct {
    float radius;
    float error_constant, error_linear, error_quadratic;
    u32 stride; // pixels from row to row of the planes
    u32 given;  // channels of normals that are given
} lens_plane_params;
PARAMS(lens_plane_params, 24)

// From inverse depth q and its slopes gx, gy per pixel to a normal. See kernels/normals/normals.cl.
//   n = of_slope_x gx + of_slope_y gy + of_depth (q - gx (x - centre_x) - gy (y - centre_y)), or 1 for the last factor
// for an orthographic camera. The bound of q's error is error_constant + error_linear |q| + error_quadratic q^2.
typedef struct {
    float of_slope_x[3];
    float of_slope_y[3];
    float of_depth[3];
    float centre_x[2]; // sum of two floats
    float centre_y[2];
    float error_constant, error_linear, error_quadratic;
    float noise; // standard deviation of q over |q|, besides
    u32 rows;    // of the result
} normal_params;
PARAMS(normal_params, 72)

// Invalid pixels around an image of inverse depth: columns before each row, which are also those behind the row before it,
// and rows above and below. Kernels that look at neighbours need no case for the image's border.
CONSTANT(depth_margin_columns, 16)
CONSTANT(depth_margin_rows, 3)

// Columns of a plane beyond the image on either side: the greatest vector width.
CONSTANT(split_margin, 16)

// Planes that an image is split into, 4 x 4: as many as there are jitter patterns.
CONSTANT(split_planes, 16)

// Columns of a plane that the occlusion kernel works through before it goes on to the next: its samples stay in the cache.
CONSTANT(ssao_band, 256)

// An image split into 4 x 4 planes: pixel (x, y) lies in plane 4 (y mod 4) + x mod 4 at column x / 4 and row y / 4, so
// that pixels which share a jitter pattern are neighbours in memory. `split_margin` columns on both sides and one row above
// and below hold what lies outside. A row of all planes lies before the next row, so that a band of rows is one piece.
typedef struct {
    u32 width, height;   // of the image, pixels
    u32 pixel_x, pixel_y; // of the image's first pixel in the camera's image
    u32 columns, rows;   // of a plane, without margins; columns are a multiple of 16
    u32 stride;          // elements from row to row of a plane
    u32 plane;           // elements from plane to plane
} split_params;
PARAMS(split_params, 32)

// The rows of the planes that one launch works on. Their sums overwrite those of earlier rows: row r lies at
// (r + 1) & `ring`.
typedef struct {
    u32 first, rows;
    u32 ring; // a power of two, less 1
    u32 sums; // elements from one kind of sum to the next
} band_params;
PARAMS(band_params, 16)

// Blocks of 64 x 64 pixels of the camera's image, see kernels/ssao/blocks.h.
CONSTANT(ssao_block_shift, 6)

// The blocks of an image, and those that a pass works for.
typedef struct {
    int first_column, first_row; // of the camera's image, in blocks
    u32 columns, rows;           // 0: the pass works for all pixels
    u32 every;                   // pixels from one of the pass to the next, in a row and from row to row
    u32 wanted;                  // the word of the blocks that it works for
    u32 margin;                  // pixels around them that it works for too
    float least;                 // inverse depth of the farthest surface on which the radius is long enough
    float least_rough;           // the same where there are low steps and thin objects
} block_params;
PARAMS(block_params, 36)

// A sample of one jitter pattern along a slice: the pixel nearest to it, and the stretch of the slice that this pixel
// represents. Distances are in pixels along the slice, from the centre pixel unless said otherwise.
typedef struct {
    int offset;               // elements from the centre pixel to the sample, in the split image
    int rows_columns;         // the same offset: rows in the high half, columns in the low half
    float distance;           // to the sample's pixel
    float inverse_distance;
    float square_distance;
    float aside;              // from the sample's pixel across to the slice
    float low, high;          // from the sample to the previous one and to the next one: its surface may end anywhere between
    float inverse_low, inverse_high; // 1 / the distances to these two
    float gap;                // from the previous sample to this one
    float before, after;      // from the previous sample, and from this one, to the midpoint between them
    float inverse_inner;      // 1 / the distance to that midpoint
} tap_params;
PARAMS(tap_params, 56)

// How positions lie around a pixel, for the occlusion kernels. See CentreRays in src/camera/rays.hpp.
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
    float edge;            // how many of these widths a neighbour may lie off the tangent plane
    float crease;          // pixels that a surface is followed down to another one, with which it then has no gap; 0: none
    u32 slices;            // per pixel
    u32 levels;            // of radii on the screen, each the square root of two times the last
} occlusion_params;
PARAMS(occlusion_params, 140)

// What a silhouette's width is measured by, see kernels/ssao/silhouette.cl. Lengths are in scene units.
typedef struct {
    float step[4];     // a pixel's step along the row, the column and the two diagonals: at distance one (perspective)
    float reach;       // how far is looked, pixels: at distance one (perspective)
    float least, most; // thickness
    float farther;     // a surface that is this much deeper is another one
    u32 directions;       // of `step` that are looked along, from the first one on
    u32 first_x, first_y; // of the pixels that it is measured at
} silhouette_params;
PARAMS(silhouette_params, 44)

// The circle of confusion of a stored value: CircleOfConfusion of include/fathom/lens.hpp as kernels/dof_masks/circle.h has it.
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
    float inverse_transition; // 1 / the pixels from there to where nothing is in focus
} circle_params;
PARAMS(circle_params, 152)

// The bound of inverse depth's error, as in normal_params; and the least step between two surfaces that counts, constant and
// per inverse depth. See kernels/dof_masks/mixed_pixels.cl.
typedef struct {
    float error_constant, error_linear, error_quadratic;
    float step_constant, step_linear;
    float min_step; // fraction of the step between two surfaces that a mixed pixel is away from either
} mixed_params;
PARAMS(mixed_params, 24)

// Tiles across and down of a block.
CONSTANT(near_block, 16)

// An image of circles in tiles, and tiles in blocks of 16 x 16, each with the least circle in it. Both are counted from the first
// pixel of the camera's image, so that a part of it sums discs in the order of the whole. A launch looks into whole rows of blocks.
typedef struct {
    u32 width, height;       // pixels
    u32 left, top;           // pixels from the first block's corner to the image's first pixel
    u32 first_row, last_row; // the rows of pixels that are looked into, from the first to before the last
    u32 tile;                // pixels across
    u32 columns, rows;       // tiles
    u32 tile_stride;         // elements from row to row of tiles
    u32 block_columns;
    u32 block_stride;
    float vertical;          // horizontal pixels that a vertical one is high
    float sharp;             // as in circle_params
    float inverse_transition;
    float shows;             // a near field whose alpha is less than this shows something behind it
} near_field_params;
PARAMS(near_field_params, 64)

// Columns and rows of a tile; columns of a plane beyond its tiles on either side; words of bits that a tile has.
CONSTANT(dof_tile_columns, 64)
CONSTANT(dof_tile_rows, 8)
CONSTANT(dof_tile_words, 5)
CONSTANT(dof_margin, 16)

// Columns of what says where pixels hide something: half a tile's, so that the halo of a tile holds all that decides how it is
// blurred.
CONSTANT(dof_hiding_columns, 32)

// Rows of pixels that an item of dof_gather works through at once: they read nearly the same strips.
CONSTANT(dof_rows_at_once, 2)

// Up to this many pixels around one, reading them one by one is cheaper than running sums.
CONSTANT(dof_direct_reach, 2)

// Fractions of the aperture, from 0 to 1, that the table of half-planes holds.
CONSTANT(dof_fractions, 256)

// Pixels across and down of a block, of which the farthest layer is known.
CONSTANT(dof_behind_block, 8)

// Cells across and down of a block, which is an item of dof_cells.
CONSTANT(dof_block_columns, 16)
CONSTANT(dof_block_rows, 4)

// An entry of a list of tiles: a tile's column, its row, and two flags.
#define ENTRY_ROW_SHIFT 16
#define ENTRY_COLUMN_MASK 0xffffu
#define ENTRY_ROW_MASK 0x3fffu
#define ENTRY_FOREGROUND_BIT 30 // some pixels lie before the focus
#define ENTRY_FOLLOWS_BIT 31    // the layer just before it reached this tile too

// An image cut into tiles of 64 x 8 pixels that are anchored at the camera's image. Planes hold whole tiles, with a margin of
// 16 columns on either side.
typedef struct {
    u32 width, height; // of the image, pixels
    u32 left, top;     // columns and rows of the first tile before the image's first pixel
    u32 columns, rows; // of a plane, without margins
    u32 stride;        // elements from row to row of a plane
    u32 plane;         // elements from plane to plane
    u32 middle;        // the layer of what is in focus
    float per_octave;  // layers in which a circle and `offset` double
    float offset;      // pixels
    float bend;        // of the layers' law within an octave: 0 for evenly spaced circles
    float largest;     // circle, pixels
    float knee;        // colours beyond this are summed apart
    float area;        // of a circle that is a pixel wide, or the aperture in it: pixels
    u32 state_row;     // row of the planes that the state's first row belongs to
    u32 state_plane;   // elements from plane to plane of the state
    float guessed;     // layers from the middle up to which what a surface hides is guessed wholly, and over an octave less
    u32 areas;         // elements from the first plane to that of the pixels' areas; 0 where all of them are a pixel's
} blur_params;
PARAMS(blur_params, 76)

// One layer of circle of confusion, or the first of several, and the tiles that one launch computes.
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
PARAMS(layer_params, 52)

// Layers whose pixels are summed into cells first, and what their launches compute. The blocks of cells that are kept go on
// beyond the image, so that the aperture around every cell that is summed lies within them.
typedef struct {
    float layer;              // the first
    u32 blocks, list;         // of cells: how many there are, and where the list of them begins
    u32 sum_blocks, sum_list; // those around whose cells the aperture is summed
    u32 tiles, tile_list;     // of pixels that the layers reach
    u32 layers;               // where in a table stands for each layer where its weights by row begin, and the cells that
                              // its aperture covers on every side
    int across;               // blocks from row to row of those that are kept
    int column, row;          // block of the first one, counted from the first pixel's
    u32 plane;                // elements from plane to plane
    u32 one;                  // and from layer to layer
} cell_params;
PARAMS(cell_params, 52)

// Pixels from `low` to before `high` of a row, and what each counts.
typedef struct {
    int low, high;
    float weight;
} span_params;
PARAMS(span_params, 12)

// A pixel of a small aperture or a part of one, what it counts, and the middle of the part of the lens that it shows through.
typedef struct {
    int column, row;
    float weight;
    float u, v;
} aperture_tap_params;
PARAMS(aperture_tap_params, 20)

// How a layer's pixels lie in the lens, and which tables its parts are read from. See kernels/dof/dof_parts.cl.
typedef struct {
    float across, down;  // lens coordinates per column and row
    float radius;        // of the aperture, parts of a pixel
    u32 single;          // does the pixel alone show through all of the lens?
    u32 taps, tap_count; // where the layer's own begin, if pixels are read directly
    u32 directions;      // of the table of half-planes: 1, or many all around
} part_params;
PARAMS(part_params, 28)

// Where to look for what lies behind a pixel.
typedef struct {
    u32 block_columns, block_rows; // of 8 x 8 pixels
    float farthest;                // layer of any pixel
    float vertical;                // horizontal pixels that a row is high
    float most;                    // pixels that a guess lies away at most
} behind_params;
PARAMS(behind_params, 20)

typedef struct {
    u32 gain; // 1 for the pixels that light joins, 0 for those that it is taken from
} unmix_params;
PARAMS(unmix_params, 4)

// Fog, see kernels/fog/fog.cl. The exponents are those of two.
// An edge is where the fog's part differs by one part in so many.
CONSTANT(fog_steps, 64)
typedef struct {
    wide at_centre[3]; // log2 of the density where the ray starts, over ln 2: affine in (x, y, 1)
    wide per_step[3];  // what one step of the direction adds to it
    wide start;        // distance along the ray at which the fog begins
    float color[3];
    float density; // over ln 2, where it is the same everywhere
    float max_opacity;
    float sky;    // optical depth to the sky along a level ray: infinite, or 0 without any fog
    u32 keep_sky; // all ones to leave the sky as it is
    float least_bend; // of the inverse depth beside a pixel, of itself, at an edge; infinite: none is looked for
    float rough_scale, rough_offset; // of a stored value: about its length, or the inverse, up to a factor
} fog_params;
PARAMS(fog_params, 96)

// How many cases of arithmetic are tried, and a divisor that compilers know, see kernels/device/arithmetic.cl.
CONSTANT(probe_divisor, 65535)
typedef struct {
    u32 cases;
} probe_params;
PARAMS(probe_params, 4)

#ifndef __OPENCL_C_VERSION__
} // namespace fathom::params
#endif

#endif
