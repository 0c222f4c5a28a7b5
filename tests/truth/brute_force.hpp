#pragma once

// Sample points of an image with their visibility by brute force, and what a method is off by there.

#include "occlusion.hpp"

#include <fathom/camera.hpp>

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace oracle {

struct Sample {
    int x, y;
    double visibility;
};

/// Slices of brute force for a sample point. Against 256 that is off by 6e-4 at a radius of 5% of the width, and by up to
/// 1.8e-3 at 40%, root mean square.
inline constexpr int sample_slices = 64;

/// Pixels from one sample to the next: every phase of a pattern of 4 × 4 pixels is met alike.
inline constexpr int sample_stride = 41;

/// Visibility by brute force of the depth image at every stride-th pixel that is a surface.
/// `normals`: one a pixel, view space.
std::vector<Sample> brute_force(const DepthLayer& layer, const std::vector<Eigen::Vector3d>& normals, double radius,
                                double thickness, int slices = sample_slices, int stride = sample_stride);

/// Rays of `ray_traced` for a sample point. Against `visibility` with its own counts that is off by at most this, root mean
/// square.
inline constexpr int sample_rays = 1024;
inline constexpr double sample_rays_error = 0.0015;

/// Visibility of the scene itself at every stride-th pixel that is a surface: the fraction of rays over its hemisphere,
/// weighted by the cosine, that meet nothing within `radius`. What a depth image hides or does not frame blocks them, too,
/// but not what lies before the near plane or behind the far one.
std::vector<Sample> ray_traced(const fathom::scene::Scene& scene, const fathom::Camera& camera,
                               const fathom::scene::Rendered& image, double radius, int rays = sample_rays,
                               int stride = sample_stride);

/// Depth of each pixel where what it shows ends: the solids that its ray goes through one after the other without a gap. What
/// encloses nothing, as the ground, the walls of a room and flat disks, ends infinitely far away. NaN where there is nothing.
std::vector<float> ends_of(const fathom::scene::Scene& scene, const fathom::Camera& camera);

/// Width of the image, in scene units, where half of its surfaces are nearer.
double median_width(const DepthLayer& layer);

struct Off {
    double rmse = 0, bias = 0, p99 = 0, worst = 0;
    double common = 0; ///< root of the mean square of all but the worst 2%
};

/// What the visibility of an image so many pixels wide is off by at the points.
Off error_of(const std::vector<Sample>& points, const std::vector<float>& image, int width);

} // namespace oracle
