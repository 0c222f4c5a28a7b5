#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace fathom {
#pragma GCC visibility push(default)

/// How a central lens turns pixels into rays. (u, v) = ((x − cx)/fx, (y − cy)/fy); X right, Y down and Z ahead; θ is the angle
/// from the axis and r = |(u, v)|.
enum class LensLaw {
    brown, ///< a distorted pinhole; k as OpenCV has it: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, 4, 5, 8 or 12 of them
    equidistant,    ///< r = θ
    equisolid,      ///< r = 2 sin(θ/2)
    stereographic,  ///< r = 2 tan(θ/2)
    opencv_fisheye, ///< r = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), Kannala and Brandt
    double_sphere,  ///< k = ξ, α of Usenko and others
    blender_polynomial, ///< θ = −(k0 + k1 r + k2 r² + k3 r³ + k4 r⁴) with k0 = 0, fx and fy in pixels a millimetre of the sensor
    equirectangular, ///< a panorama: u is the longitude, −v the latitude
    rays,            ///< whatever has no name here: a ray for each pixel
};

/// The rays of an image's pixels, unit vectors of X right, Y down and Z ahead, three floats a pixel, from the top left one on. NaN
/// or 0, 0, 0 where there is none. Derivatives are differences of neighbours.
struct RayMap {
    int width = 0, height = 0;
    std::vector<float> rays = {};
};

/// A lens: its law and its numbers. A plain value; whoever uses it checks it.
struct LensModel {
    LensLaw law;
    double fx, fy; ///< pixels; of a panorama pixels a radian
    double cx, cy; ///< where the axis meets the image, pixels from the corner of the image's top left pixel
    std::vector<double> k = {};
    std::shared_ptr<const RayMap> map = {}; ///< of the law `rays`, for which fx = fy = 1 and cx = cy = 0
};

/// The lens of such rays. Throws: std::invalid_argument for a number of floats that is not 3 · width · height.
LensModel lens_of_rays(RayMap map);

/// Where a polynomial turns back, so that pixels beyond it have no ray.
struct LensFold {
    double angle;            ///< from the axis, radians
    double radius;           ///< in the image, in focal lengths; blender_polynomial: millimetres of the sensor
    std::string coefficient; ///< which one bends it most
};

/// The name in the camera file.
const char* to_string(LensLaw law);

#pragma GCC visibility pop
} // namespace fathom
