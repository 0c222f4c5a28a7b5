// The circle of confusion of a thin lens.
//   c = A f/(S − f) (1 − S/z)                      diameter on the sensor, z and S from the lens, positive behind the focus
// affine in 1/z, so k and g describe it completely. Potmesil and Chakravarty 1981. Orthographic rays are a lens moved
// away to −L with A/L and A/(S + L)·fx kept: what is left is affine in z.

#include <fathom/lens.hpp>

#include "camera/form.hpp"
#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/lens.hpp"
#include "lens/camera_lens.hpp"
#include "require.hpp"

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

using Real = long double;
using Vector3 = Eigen::Matrix<Real, 3, 1>;

constexpr Real infinity = std::numeric_limits<Real>::infinity();

void require_length(double value, const char* key) {
    require(std::isfinite(value) && value > 0, key, " = ", value, " must be a number above 0");
}

// Lengths in scene units, but for the scale of the image.
struct Optics {
    bool perspective;
    Real centre_depth;
    Real aperture;
    Real focal_length; // 0 for an orthographic camera, where only the aperture counts
    Real image_scale;  // thin lens: pixels per scene unit on the sensor; otherwise the projection's, see PixelScale
    bool thin_lens;    // is k that of focal length and sensor, not the projection's?
};

PixelScale any_scale_of(const Camera& camera) {
    if (camera.lens) {
        const Eigen::Vector2d pixel = lens::CameraLens(camera).pixel_on_axis();
        return {1 / static_cast<Real>(pixel.x()), 1 / static_cast<Real>(pixel.y())};
    }
    const CentreRays rays = centre_rays(camera_rays(camera));
    const Vector3 middle(camera.width / Real{2}, camera.height / Real{2}, 1);
    if (!rays.perspective)
        return {1 / rays.origin.col(0).norm(), 1 / rays.origin.col(1).norm()};
    const Vector3 direction = rays.direction * middle;
    const Real depth = rays.depth.dot(middle);
    require(depth > 0, "the image's middle lies beyond the horizon of the tilted image plane: it has no pixel scale");
    const auto slope = [&](int i) {
        const Vector3 moved = (rays.direction.col(i) * depth - direction * rays.depth(i)) / (depth * depth);
        return moved.head<2>().norm();
    };
    return {1 / slope(0), 1 / slope(1)};
}

Optics optics(const Lens& lens, const Camera& camera) {
    describe_optics(description::Check{}, lens);
    const bool perspective = camera.lens || camera.projection.is_perspective();
    Optics result{perspective, perspective ? straight_rays(camera).centre_depth : 0, 0, 0, 0, false};
    const Real unit = lens.mm_per_unit, number = lens.f_stop;
    result.image_scale = pixel_scale(camera).x;
    if (!perspective) {
        require(lens.focal_length_mm.has_value(),
                "orthographic rays have no focal length: the lens needs focal_length_mm for its aperture");
        result.aperture = *lens.focal_length_mm / (number * unit);
        return result;
    }
    require(lens.focal_length_mm || lens.sensor_mm,
            "the lens needs focal_length_mm or sensor_mm: the projection gives the other one");
    const Real focal_mm = lens.focal_length_mm ? static_cast<Real>(*lens.focal_length_mm)
                                               : result.image_scale * *lens.sensor_mm / camera.width;
    result.focal_length = focal_mm / unit;
    result.aperture = result.focal_length / number;
    result.thin_lens = lens.focal_length_mm && lens.sensor_mm;
    if (result.thin_lens)
        result.image_scale = unit * camera.width / *lens.sensor_mm;
    return result;
}

} // namespace

PixelScale pixel_scale(const Camera& camera) {
    const PixelScale scale = any_scale_of(camera);
    check_pixel_aspect(scale.y, scale.x);
    return scale;
}

double circle_deformation(const Camera& camera) {
    if (!camera.lens)
        return 0;
    const lens::CameraLens lens(camera);
    const Eigen::Vector2d on_axis = lens.pixel_on_axis();
    constexpr int across = 32; // places in a row and in a column
    double most = 0;
    for (int i = 0; i <= across; ++i)
        for (int j = 0; j <= across; ++j) {
            const auto ray =
                lens.ray(0.5 + i * (camera.width - 1.0) / across, 0.5 + j * (camera.height - 1.0) / across);
            if (!ray)
                continue;
            // How far the ray moves over the plane in focus for a pixel across and down, in pixels of the axis.
            const auto& [right, down, ahead] = *ray;
            const lens::Jet x = right / ahead, y = down / ahead;
            const Eigen::Matrix2d moved{{x.x / on_axis.x(), x.y / on_axis.x()}, {y.x / on_axis.y(), y.y / on_axis.y()}};
            for (const double part : Eigen::JacobiSVD<Eigen::Matrix2d>(moved).singularValues())
                most = std::max(most, std::abs(1 / part - 1));
        }
    return most;
}

CircleOfConfusion circle_of_confusion(const Lens& lens, const Camera& camera) {
    const Optics o = optics(lens, camera);
    const Real focus = lens.focus - o.centre_depth;
    require(!std::isnan(lens.focus) && focus > 0, "focus = ", lens.focus,
            " must lie in front of the lens, which is at depth ", o.centre_depth + 0); // and not at -0
    require(static_cast<double>(focus) > static_cast<double>(o.focal_length), "focus = ", lens.focus,
            " must be farther away than the focal length, which is ", o.focal_length, " scene units");
    const Real full = o.aperture * o.image_scale;
    if (!o.perspective)
        return {full, full / focus, 0, true};
    const Real lens_depth = o.centre_depth;
    if (!o.thin_lens)
        return {full / focus, full, lens_depth, false};
    const Real image = full * o.focal_length;
    return {image / (focus - o.focal_length), std::isinf(focus) ? image : image / (1 - o.focal_length / focus),
            lens_depth, false};
}

long double coc_at(const CircleOfConfusion& circle, long double z) {
    if (circle.telecentric)
        return circle.g == 0 ? -circle.k : circle.g * z - circle.k;
    const Real distance = z - circle.lens_depth;
    return distance > 0 ? circle.k - circle.g / distance : std::numeric_limits<Real>::quiet_NaN();
}

std::optional<long double> depth_with_coc(const CircleOfConfusion& circle, long double diameter_px) {
    if (circle.g == 0 || std::isnan(diameter_px))
        return std::nullopt;
    if (circle.telecentric)
        return (diameter_px + circle.k) / circle.g;
    const Real distance = circle.g / (circle.k - diameter_px);
    if (diameter_px == circle.k)
        return infinity;
    return distance > 0 ? std::optional<long double>(circle.lens_depth + distance) : std::nullopt;
}

SharpRange sharp_range(const CircleOfConfusion& circle, double acceptable_px) {
    require_length(acceptable_px, "acceptable_px");
    const auto bound = [&](Real diameter_px, Real otherwise) {
        return static_cast<double>(depth_with_coc(circle, diameter_px).value_or(otherwise));
    };
    const bool same_everywhere = circle.g == 0;
    if (same_everywhere && std::abs(circle.k) > acceptable_px) {
        const double nowhere = std::numeric_limits<double>::quiet_NaN();
        return {nowhere, nowhere};
    }
    const Real nearest = circle.telecentric ? -infinity : static_cast<Real>(circle.lens_depth);
    return {bound(-static_cast<Real>(acceptable_px), nearest), bound(acceptable_px, infinity)};
}

double hyperfocal_distance(const Lens& lens, const Camera& camera, double acceptable_px) {
    require_length(acceptable_px, "acceptable_px");
    Lens anywhere = lens;
    anywhere.focus = static_cast<double>(infinity);
    const Optics o = optics(anywhere, camera);
    require(o.perspective, "orthographic rays have no hyperfocal distance: their circles grow without end");
    const Real full = o.aperture * o.image_scale / acceptable_px;
    const Real distance = o.thin_lens ? o.focal_length + full * o.focal_length : full;
    return static_cast<double>(o.centre_depth + distance);
}

double depth_along_ray(const Camera& camera, double x, double y, double distance) {
    if (camera.lens) {
        require(distance > 0, "distance = ", distance, " must be above 0");
        const lens::CameraLens lens(camera);
        const auto ray = lens.direction(x, y);
        require(ray.has_value(), "pixel position (", x, ", ", y, ") has no ray");
        return has_plane_in_focus(camera) ? distance * lens.ahead(*ray) : distance;
    }
    const CentreRays rays = centre_rays(camera_rays(camera));
    require(!std::isnan(distance) && (!rays.perspective || distance > 0), "distance = ", distance, " must be above 0");
    const Vector3 pixel(x, y, 1), direction = rays.direction * pixel;
    const Real ahead = rays.depth.dot(pixel) / direction.norm();
    require(ahead > 0, "the ray of pixel position (", x, ", ", y, ") does not point ahead");
    return static_cast<double>(rays.centre_depth + distance * ahead);
}

} // namespace fathom
