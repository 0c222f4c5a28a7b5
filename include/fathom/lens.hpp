#pragma once

#include <fathom/camera.hpp>
#include <fathom/required.hpp>

#include <optional>

namespace fathom {
#pragma GCC visibility push(default)

/// A thin lens at the camera centre. Give the focal length, the sensor's width, or both. With one of them the projection gives
/// the other: its horizontal focal length in pixels is focal_length_mm · width / sensor_mm. With both the projection's
/// focal length does not count.
struct Lens {
    Required f_stop; ///< focal length over the diameter of the aperture; infinity: a pinhole
    Required focus;  ///< depth that is sharp, along the view axis, scene units; infinity allowed
    std::optional<double> focal_length_mm = {}; ///< default: the projection's, which then needs the sensor's width
    std::optional<double> sensor_mm = {}; ///< of the whole image; default: the projection's, from the focal length
    double mm_per_unit = 1000;            ///< millimetres in a scene unit
};

/// A lens that belongs to a camera: what its file says of it. `ao_distance` is the radius for ambient occlusion.
struct LensDefaults {
    std::optional<double> focal_length_mm, sensor_mm, f_stop, focus, ao_distance;
};

/// A number as the unevaluated sum of two doubles: 106 bits, the same on every platform. Any number that fits becomes one, and it
/// becomes the widest one that a platform has.
struct DoubleDouble {
    double high = 0;
    double low = 0; ///< at most half a unit in the last place of `high`

    constexpr DoubleDouble() = default;
    constexpr DoubleDouble(int value) : high(value) {}
    constexpr DoubleDouble(double value) : high(value) {}
    constexpr DoubleDouble(long double value)
        : high(static_cast<double>(value)),
          low(high - high == 0 ? static_cast<double>(value - static_cast<long double>(high)) : 0) {} // of finite ones
    constexpr operator long double() const { return static_cast<long double>(high) + static_cast<long double>(low); }
};

/// Diameter of the circle of confusion, in horizontal pixels of the camera's image, positive behind the focus:
///   c = k − g / (z − lens_depth)   under a perspective;  k is the circle of a point at infinity
///   c = g z − k                    under an orthographic projection, where the lens is telecentric
/// A plain value: `circle_of_confusion` makes it from a lens, or you fill it in. The focus is where c = 0.
struct CircleOfConfusion {
    DoubleDouble k = {};          ///< pixels
    DoubleDouble g = {};          ///< pixels times scene units; orthographic: pixels per scene unit
    DoubleDouble lens_depth = {}; ///< z of the lens, which is the camera centre. Scene units
    bool telecentric = false;     ///< is the camera orthographic?
};

/// Depths between which no circle is larger than an acceptable one. Scene units along the view axis.
struct SharpRange {
    double nearest;
    double farthest; ///< may be infinity
};

/// Pixels that a unit of slope (perspective) or of length (orthographic) takes, at the middle of the image. A circle of
/// c horizontal pixels is c · y/x vertical ones high.
struct PixelScale {
    long double x, y;
};

PixelScale pixel_scale(const Camera& camera);

/// By how much the picture of the aperture is longer or shorter somewhere in the image than on the axis, in any direction: 0.08 for
/// 8 %. 0 without a `Camera::lens`.
double circle_deformation(const Camera& camera);

/// The circle of confusion of this lens and camera. With A = f/N the aperture, S the distance from the lens to the focus and p the
/// pixels in a millimetre of the sensor
///   k = A f/(S − f) p              focal length and sensor given
///   k = A (fx/S)                   one of them given: fx is the projection's focal length in pixels, f = fx/p
///   k = A · (pixels per unit)      orthographic camera, which needs the focal length for A
/// and g = k S, finite for a focus at infinity too; g = k/S for an orthographic camera.
/// Throws: std::invalid_argument unless f_stop > 0, focal_length_mm, sensor_mm and mm_per_unit are finite and
/// above 0, the focus is farther from the lens than the focal length, and the lens is known; NaN is none of these.
/// Source: Potmesil and Chakravarty 1981, eq. 1–4; telecentric as the limit of a far lens with a long focal length.
CircleOfConfusion circle_of_confusion(const Lens& lens, const Camera& camera);

/// The circle of a surface at depth z, which may be infinity. Signed, in horizontal pixels.
/// NaN where a perspective sees nothing: at the lens and behind it.
long double coc_at(const CircleOfConfusion& circle, long double z);

/// The inverse: the one depth whose circle is `diameter_px`, infinity included. None where no depth has that circle, or all
/// have it (a pinhole, a telecentric lens focused at infinity).
std::optional<long double> depth_with_coc(const CircleOfConfusion& circle, long double diameter_px);

/// The depths between which circles are at most `acceptable_px` wide: depth of field.
/// Throws: std::invalid_argument unless acceptable_px is finite and above 0.
SharpRange sharp_range(const CircleOfConfusion& circle, double acceptable_px);

/// The nearest focus for which a circle is at most `acceptable_px` at infinity: f + f²/(N c) from the lens for a given
/// lens and sensor. Scene units along the view axis. `lens.focus` does not matter.
/// Throws: std::invalid_argument as above, and for an orthographic camera, which has none.
double hyperfocal_distance(const Lens& lens, const Camera& camera, double acceptable_px);

/// The depth of the point that lies `distance` away along the ray of pixel position (x, y), a pixel's centre being at +½:
/// counted from the camera centre of a perspective, or from where orthographic rays cross z = 0. A lens focused there is sharp
/// at that depth everywhere, and not at that distance. Infinity for infinity.
/// Throws: std::invalid_argument for a distance that is NaN, or not above 0 under a perspective.
double depth_along_ray(const Camera& camera, double x, double y, double distance);

#pragma GCC visibility pop
} // namespace fathom
