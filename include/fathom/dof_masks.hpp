#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/lens.hpp>

#include <limits>

namespace fathom {
#pragma GCC visibility push(default)

/// What becomes of the background.
enum class Sky {
    blur,    ///< it is infinitely far: its circle is exactly k; for a telecentric lens, max_coc_px
    sharp,   ///< it stays sharp: its circle is 0
    exclude, ///< it is left out, like invalid pixels
};

struct DofMasksOptions {
    double sharp_px = 1;      ///< circles up to this are wholly in focus; from 0
    double transition_px = 1; ///< circles larger by this are not at all; from 0, a hard edge
    Sky sky = Sky::blur;
    double max_coc_px = std::numeric_limits<double>::infinity(); ///< circles are clamped to ± this; above 0

    // Which results of `DofMasks` are wanted, besides the circle?
    bool near_weight = false;
    bool focus_weight = false;
    bool far_weight = false;
    bool max_near_coc = false;
    bool near_alpha = false;
    bool disocclusion = false;
    bool mixed_pixels = false;
    int tile_px = 16; ///< pixels across of the tiles whose extremes are wanted, 1 to 65536
    bool tile_min_coc = false;
    bool tile_max_coc = false;
};

/// The circle is within this many units in the last place of the exact circle of the stored number. The unit is that of the
/// larger of |c| and k. If stored depth is summed with the pixel, or encoded otherwise, that sum adds its own error:
/// `sum_condition_fp64` (or `_two_float`) times the condition κ of the depth's own sum, times k + g/(z − lens_depth), or k + g |z|.
inline constexpr double coc_ulp = 4.0;

/// A near field shows something behind it if its alpha is below 1 by at least this.
inline constexpr double disocclusion_min_transparency = 0x1p-10;

/// A mixed pixel lies at least this fraction of the step between two surfaces away from either of them. The fraction is one of
/// unclamped circles: of 1/z under a perspective, of z for an orthographic camera.
inline constexpr double mixed_pixels_min_step = 1.0 / 16;

/// And that step is as deep as this many pixels are wide at its distance, because a rough surface has smaller steps everywhere.
inline constexpr double mixed_pixels_min_widths = 8;

/// Near alpha is within this of its definition in exact arithmetic.
inline constexpr double near_alpha_error = 1e-5;

/// Results of `dof_masks`: one float a pixel each, all of the depth's size.
///
/// Those but the circle are made on request, and those from `max_near_coc` on are passes of their own. A pixel x lies within the
/// disc of a pixel p if the distance of their centres, in horizontal pixels, is at most |c_p|/2. Invalid pixels and those outside
/// the image have no disc.
struct DofMasks {
    Image coc = {};          ///< diameter in horizontal pixels, positive behind the focus; NaN for invalid pixels
    Image near_weight = {};  ///< 1 before the focus, 0 in it and behind it
    Image focus_weight = {}; ///< 1 in focus
    Image far_weight = {};   ///< 1 behind the focus, 0 in it and before it

    /// The largest |c_p| of all near discs (c_p < 0) that x lies within; 0 if there is none.
    Image max_near_coc = {};

    /// min(1, Σ near_p / n_p) over the discs that x lies within. n_p is the number of pixels in p's disc, as if the image had no
    /// border; for discs wider than 1024 pixels it is their area.
    Image near_alpha = {};

    /// 1 where a blur needs what the near field (c_p < −sharp_px) hides. Either x belongs to the near field and its near alpha is
    /// below 1 by `disocclusion_min_transparency`, or x does not and a pixel of the near field lies within the disc of
    /// x. 0 elsewhere, and for invalid pixels.
    Image disocclusion = {};

    /// 1 where depth was averaged over an edge: along a row or a column it lies between the surfaces on both sides, and neither
    /// side's plane goes through it. 0 elsewhere, and along an axis with fewer than two valid pixels on a side. Does not depend
    /// on the lens.
    Image mixed_pixels = {};

    /// Smallest and largest CoC of each tile of tile_px × tile_px pixels. The last tiles of a row and a column are narrower.
    /// NaN for a tile without a valid pixel.
    Image tile_min_coc = {};
    Image tile_max_coc = {};
};

/// Circle of confusion and, on request, three weights (near, in focus and far) from stored depth in one pass.
///
/// In: one stored value a pixel, and the lens as `circle_of_confusion` gives it. Out: see DofMasks.
///
/// With a = clamp((|c| − sharp_px) / transition_px, 0, 1), rounded to a multiple of 2⁻²³: near = a where c < 0, far = a where
/// c > 0, focus = 1 − a. The three sum to exactly 1, in any order, and near or far is 0. Invalid pixels have a circle of NaN
/// and no weight, so the sum of the weights is also the validity. `sky` says what the background is. Same bits for any vector
/// width and group size. A region has the same bits too, except for the masks that look around a pixel: they see no farther
/// than the given image, and cost more for larger discs.
/// Accuracy: `coc_ulp`; `inexact::dof_masks_error` more on a device that is not exact (probe.hpp). Depth-buffer values of a
/// perspective need no division, even with an oblique near plane.
/// Throws: std::invalid_argument for options out of range and a circle that is not this camera's; Error from the device.
/// Source: Potmesil and Chakravarty 1981; affine in the stored value because 1/z is, by Popov 2016, eq. 5, 6:
/// docs/depth-of-field.md.
DofMasks dof_masks(const StoredDepth& stored, const CircleOfConfusion& circle, const DofMasksOptions& options = {},
                   const Launch& launch = {});

/// The same into the caller's images: those that `options` asks for, of one float a pixel, with any row stride. They share
/// memory neither with the input nor with each other. A second call allocates nothing. Kernels write straight into the images,
/// wherever they lie in their memory.
///
/// For themselves, near alpha and disocclusion take 4 bytes a pixel, mixed pixels 4, each weight that is not asked for beside
/// another one 4, and the three masks of near discs a 64th of a byte. A memory budget makes the 4 bytes of near alpha of fewer
/// rows: of 256 at least, however large the discs are. Same bits.
/// Throws: as above, and std::invalid_argument for images that are missing, do not fit or were not asked for.
void dof_masks(const StoredDepth& stored, const DofMasks& results, const CircleOfConfusion& circle,
               const DofMasksOptions& options = {}, const Launch& launch = {});

/// The widest circle of confusion of all pixels that have one, in pixels: no more than `max_coc_px`, and 0 if no pixel has one.
/// Asks the device and waits for it.
float widest_coc(const StoredDepth& stored, const CircleOfConfusion& circle, const DofMasksOptions& options = {});

#pragma GCC visibility pop
} // namespace fathom
