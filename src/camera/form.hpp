#pragma once

#include <fathom/camera.hpp>

namespace fathom {

inline bool is_float(Storage storage) {
    return storage == Storage::float32 || storage == Storage::float16;
}

/// The camera without its lens: its depth is the number that a value stored through the lens means, a distance along the ray or one
/// along the axis. Itself without a lens.
/// Throws: std::invalid_argument for values that only a projection has.
Camera straightened(const Camera& camera);

/// The widest or highest pixels through a lens and in circles of confusion, which are as many times as high; those of scanners are
/// 20 times as high as wide. All else takes what no mistaken unit makes.
inline constexpr double most_pixel_aspect = 100, most_aspect_of_rays = 1e6;

/// Refuses pixels that see so much more across than down, or so much less. The lengths may count in anything.
void check_pixel_aspect(long double across, long double down, double most = most_pixel_aspect);

/// The sign of what lies ahead, in the third of the camera's own axes.
double forwards(const Camera& camera);

/// Along what a value stored through a lens counts.
Along counted_along(const Camera& camera);

/// Is a plane in focus, or with a lens that is no distorted pinhole a sphere around the camera? Circles follow the depth along the
/// axis, or the distance along the ray.
bool has_plane_in_focus(const Camera& camera);

/// The camera's rays; none through a lens, which has none that are affine in the pixel.
Rays straight_rays(const Camera& camera);

/// Does decoding need the lengths of the camera's rays?
bool is_along_ray(const DepthForm& form);

/// `view_depth` for many points, of what was derived once from the camera.
long double view_depth(const DepthForm& form, const Rays& rays, double x, double y, double stored);

} // namespace fathom
