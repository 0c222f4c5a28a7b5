#pragma once

#include <fathom/lens_model.hpp>
#include <fathom/projection.hpp>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace fathom {
#pragma GCC visibility push(default)

/// Which row of the stored image is the top one on the screen.
enum class Rows { top_down, bottom_up };

/// What a stored depth value means.
enum class Encoding {
    window,       ///< depth-buffer value: z/w mapped to the depth range
    view_z,       ///< distance along the view axis
    ray_distance, ///< distance from the camera centre along the pixel's ray
    linear,       ///< 0 at `near_plane`, 1 at `far_plane`, linear in the distance along the view axis
    logarithmic,  ///< log(C z + 1) / log(C far_plane + 1)
    exponential,  ///< log(z / near_plane) / log(far_plane / near_plane)
    median,       ///< (z − m)/(z + m) mapped to the depth range: −1 at the camera, 0 at the median m, 1 at infinity
    pseudo_linear, ///< z·w written by a vertex program: linear at vertices only (see `pseudo_linear_bound`)
    inverse,       ///< scale / z − offset: disparity
    inverse_range, ///< 0 at `near_plane`, 1 at `far_plane`, linear in 1/z
};

/// Along what `linear`, `inverse` and `inverse_range` measure their distance, and through a lens every encoding but `ray_distance`.
enum class Along {
    axis, ///< the view axis
    ray,  ///< the pixel's ray, counted from the camera centre
    cube, ///< with a lens: the axis of the cube's face that the ray meets, of six that look along the axes of view space
};

/// How a stored value lies in memory.
/// Integers are normalised by their full range for `window`, `linear`, `logarithmic`, `exponential`, `median`,
/// `pseudo_linear` and `inverse_range`, and taken as they are for the metric encodings `view_z`, `ray_distance` and
/// `inverse`.
enum class Storage {
    float32,
    float16,
    uint8,
    uint16,
    uint24,        ///< the low 24 bits of a uint32
    uint24_high,   ///< the high 24 bits of a uint32 (D24S8 and the like)
    rgb8_red_low,  ///< three bytes R, G, B in memory, R the lowest of the 24 bits
    rgb8_red_high, ///< three bytes R, G, B in memory, R the highest
    bgr8_red_low,  ///< three bytes B, G, R in memory, as OpenCV holds them, R the lowest
    bgr8_red_high  ///< three bytes B, G, R in memory, R the highest
};

/// How a file holds depth where the type of its elements does not say it.
enum class Packing {
    uint8,          ///< one channel of 8 bits, which is usually a picture and no depth
    uint16_rotated, ///< 16 bits that are rotated left by three: SUN RGB-D
    uint16_swapped, ///< 16 bits whose bytes are exchanged
    uint13,         ///< the low 13 of 16 bits: Android's DEPTH16
    uint24,         ///< the low 24 bits of 32
    uint24_high,    ///< the high 24 bits of 32
    rgb_red_low,    ///< 24 bits in three channels of 8 bits, R the lowest
    rgb_red_high,   ///< R the highest
    rgba_red_low, ///< 32 bits in four channels, R the lowest: three.js to r166. (R/2²⁴ + G/2¹⁶ + B/2⁸ + A) / 2⁸
    rgba_red_high, ///< R the highest: three.js from r167 on. (R + G/2⁸ + (B + A/255) / 2¹⁶) / 2⁸
    base_255,      ///< Unity's EncodeFloatRGBA, in three channels or four: R/255 + G/255² + B/255³ + A/255⁴
};

/// What becomes of a pixel whose stored value is the background.
enum class Background { inf, decode, nan };

/// Axes of a result: the projection's own, or those of the world that `Camera::view` comes from.
enum class Space { view, world };

/// Everything that turns a stored value at a pixel into a place in view space.
/// A plain value: fill in what differs from the defaults and hand it on; whoever uses it checks it.
struct Camera {
    Projection projection;
    int width = 0;  ///< pixels; the projection maps the whole image
    int height = 0; ///< pixels
    Rows rows = Rows::top_down;
    Encoding encoding = Encoding::window;
    std::array<double, 2> depth_range{0.0, 1.0}; ///< stored values of clip_z's low and high end (glDepthRange)
    /// Scene units; for `linear`, `exponential`, `pseudo_linear`, `inverse_range` and `from_near_plane`.
    std::optional<double> near_plane;
    /// Scene units; for `linear`, `exponential`, `pseudo_linear`, `inverse_range` and `logarithmic`.
    std::optional<double> far_plane;
    std::optional<double> median; ///< for `median`; scene units
    double log_c = 1.0;           ///< C of `logarithmic`; per scene unit
    double scale = 1.0;  ///< scene units per stored unit (metric encodings); z = scale / (v + offset) for `inverse`
    double offset = 0.0; ///< for `inverse`; stored units
    Along along = Along::axis; ///< for `linear`, `inverse` and `inverse_range`, and with a lens
    /// For `ray_distance`: is it counted from where the ray crosses the near plane? For `logarithmic`: are z and `far_plane` counted
    /// from the near plane, as Cesium does?
    bool from_near_plane = false;
    std::optional<double> background;      ///< stored value that means "nothing here"; NaN: none; default by encoding
    std::optional<double> background_from; ///< so do this stored value and all that mean a greater distance
    /// The same from 65504 on, where half floats end. In full floats only that value itself, and from 1e10 on.
    bool background_from_largest_half = false;
    double usual_metres =
        0; ///< beyond which the source has hardly half of its depths, if it counts in metres. For doubts alone
    std::optional<double> missing; ///< stored value that means "not measured": an invalid pixel
    std::optional<int>
        depth_bits; ///< 1 to 24, or 32: of the buffer that a float image came from, for error bounds and fits
    std::optional<Eigen::Matrix4d> view; ///< world to view, in the projection's axes
    /// What bends the pixels' rays. Of the projection then only the axes of view space count, and with `brown` and `window` what turns
    /// a depth buffer's values into depth: those of a pinhole whose picture was warped. `PixelRays` and the operations take the
    /// camera, but for `ssao` and `dof`; everything else refuses it.
    std::optional<LensModel> lens = {};
    /// The lens of the raw image, if this image is said to be undistorted. Only warnings use it.
    std::optional<LensModel> raw_lens = {};
};

/// The formula that decodes a camera. See docs/camera.md.
enum class Form {
    reciprocal,        ///< z = A / (t + C), t the distance from the end of the range
    reciprocal_affine, ///< z = 1 / (a v + b·(x, y) + c)
    affine,            ///< z = a v + b·(x, y) + c
    rational,          ///< z = (n·q) / (m·q), q = (v, x, y, 1)
    exponential,       ///< z = A (2^(L v + S) − 1) + B
    ray_distance,      ///< z = (n v + n') D_z/|D(x, y)| + B, D_z the part of the ray's direction D along the view axis
    inverse_ray_distance, ///< z = D_z/|D(x, y)| / (m v + m') + B
};

/// Four coefficients of (v, x, y, 1): v the stored value as it lies in memory (an integer code, or a float),
/// x and y the pixel's centre counted from the corner of the first stored pixel.
using Affine = std::array<long double, 4>;

/// The simplest exact form of a camera, with its constants. Host side, `long double`, no OpenCL.
struct DepthForm {
    Form form;
    std::string reason; ///< why this form is enough, for people

    Affine numerator{0, 0, 0, 1};   ///< affine, rational: n; ray_distance: the distance
    Affine denominator{0, 0, 0, 1}; ///< reciprocal (without x and y), reciprocal_affine, rational: m;
                                    ///< inverse_ray_distance: the inverse of the distance
    long double rate = 0;           ///< exponential: L
    long double start = 0;          ///< exponential: S
    long double amplitude = 0;      ///< exponential: A
    long double offset = 0;         ///< exponential, ray distances: B

    float lowest;                            ///< smallest stored value that can be a surface, as it lies in memory
    float highest;                           ///< largest
    bool perspective;                        ///< rays meet in a camera centre; depths behind it are invalid
    float least_depth;                       ///< surfaces are deeper than this: the centre's own depth, or −infinity
    std::optional<std::uint32_t> background; ///< bits of the stored value that means "nothing here"
    std::optional<std::uint32_t> missing;    ///< bits of the stored value that means "not measured"
    float farther = 1;                       ///< +1 where larger stored values are farther away, otherwise −1
    std::optional<float> background_from;    ///< "nothing here" from farther · v = this on
};

/// What a stored value says besides a distance.
enum class StoredKind { depth, background, missing };

/// Is a stored value, given as a number and as the bits that it has in memory, the background or missing?
StoredKind kind_of(const DepthForm& form, float value, std::uint32_t bits);

/// Are the stored values distances or their inverse themselves, so that integers are not normalised?
bool is_metric(Encoding encoding);

/// Where the pixels look: position = origin(x, y) + w · direction(x, y), both affine in the pixel's centre (x, y).
///
/// `w_is_depth`: w is the view depth itself, as under every camera whose fourth row has no x and y.
/// Otherwise w = (z − centre_depth) / depth(x, y), and origin is the camera centre.
struct Rays {
    using Matrix = Eigen::Matrix<long double, 3, 3>;
    Matrix origin = Matrix::Zero();    ///< rows x, y, z in the projection's own axes; columns multiply (x, y, 1)
    Matrix direction = Matrix::Zero(); ///< likewise
    bool w_is_depth = true;
    Eigen::Matrix<long double, 1, 3> depth{0, 0, 1}; ///< view depth that one step of `direction` covers
    long double centre_depth = 0;
};

/// Derives the simplest form that is exact for this camera and storage.
/// Throws: std::invalid_argument naming the field, its value and what it must be.
DepthForm depth_form(const Camera& camera, Storage storage = Storage::float32);

/// The camera of a part of its image, or of an image that reaches beyond it (overscan): the pixels of `width` × `height` from
/// (x, y) on, which are counted from the first stored pixel and may be negative. Depths and positions stay the same.
/// Throws: std::invalid_argument for a camera or a part without pixels.
Camera cropped(const Camera& camera, int x, int y, int width, int height);

/// Derives the rays of the camera's pixels.
/// Throws: std::invalid_argument as above, and for rays that run across the view axis.
Rays camera_rays(const Camera& camera);

/// The inverse of viewport · projection: M (x, y, d, 1)ᵀ is the view-space point (canonical OpenGL axes) up to its
/// fourth component, with d a depth-buffer value inside the depth range.
Eigen::Matrix<long double, 4, 4> unprojection(const Camera& camera);

/// View depth of a stored value at a pixel position, evaluated in `long double` on the host.
/// Meant for single points (inspection, precision); images go through `linearize`.
long double view_depth(const Camera& camera, Storage storage, double x, double y, double stored);

/// The stored value that a view depth has at a pixel position: the inverse of `view_depth`.
long double stored_depth(const Camera& camera, Storage storage, double x, double y, double z);

/// The largest code of an integer storage; 1 for floats.
double storage_max(Storage storage);

/// Names as the camera file and the program write them. The `bgr8_` storages have the names of the `rgb8_` ones: a camera
/// file says which channel is the lowest, not in which order a program holds the bytes.
const char* to_string(Encoding encoding);
const char* to_string(Storage storage);
const char* to_string(Packing packing);
const char* to_string(Form form);
const char* to_string(Along along);

#pragma GCC visibility pop
} // namespace fathom
