// Rays from the camera centre, along which planes are affine on the screen.
//   n·(O + w D(x, y)) = c  ⇒  1/w = n·D(x, y) / (c − n·O)                     rays that meet in the camera centre O
//   n·(O(x, y) + w D) = c  ⇒  w = (c − n·O(x, y)) / n·D                       orthographic rays
// The ray O + w D is that of Lenaerts, part 2; the planes follow. Operations that compare depths take 1/w under a
// perspective and w under an orthographic projection.
//   position = view⁻¹ (O + w D)                                                in the world

#include "camera/rays.hpp"

#include "camera/matrix.hpp"
#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace fathom {

CentreRays centre_rays(const Rays& rays) {
    CentreRays result{.perspective = !rays.w_is_depth || !rays.direction.leftCols<2>().isZero(),
                      .origin = rays.origin,
                      .direction = rays.direction,
                      .depth = rays.depth,
                      .centre_depth = rays.centre_depth};
    if (!result.perspective)
        result.centre_depth = 0; // depth is counted from where the rays cross z = 0
    if (result.perspective && rays.w_is_depth) {
        result.origin.col(2) += rays.centre_depth * rays.direction.col(2);
        result.origin.leftCols<2>().setZero();
    }
    return result;
}

Rays axes_of_view() {
    Rays axes;
    axes.direction.setIdentity();
    return axes;
}

Rays rays_in_world(const Rays& rays, const Eigen::Matrix4d& view, const Eigen::Vector3d& origin) {
    require(view.allFinite() && view.row(3) == Eigen::RowVector4d(0, 0, 0, 1),
            "the view matrix must be finite with a fourth row of 0 0 0 1");
    require(origin.allFinite(), "origin = (", origin.transpose(), ") must be finite");
    const auto inverse = checked_inverse(view.cast<long double>(), "the view matrix");
    Rays world = rays;
    world.direction = inverse.topLeftCorner<3, 3>() * rays.direction;
    world.origin = inverse.topLeftCorner<3, 3>() * rays.origin;
    world.origin.col(2) += inverse.topRightCorner<3, 1>() - origin.cast<long double>();
    return world;
}

// How far storing depth moves inverse depth.
//   z = (n v + n₀) / (m v + m₀)  ⇒  dz/dv = (n − m z)² / Δ,  v = (n₀ − m₀ z) / (m z − n),  Δ = n m₀ − m n₀
// so a step of fixed size costs a square in z, and a float's step, which is relative, the product of two sums.
//   q = D / (z − centre_depth)  ⇒  δq = (q²/D) δz                               rays that meet in the camera centre

namespace {

using Real = long double;

// The decoded depth, its distance from the camera centre, the quotient and their sum's low part, in units of 2^-24 of q.
constexpr Real roundings = 4 * 0x1p-24L;

// c + l t + s t², t ≥ 0
struct Quadratic {
    Real constant = 0, linear = 0, square = 0;

    Real at(Real t) const { return constant + (linear + square * t) * t; }
    Quadratic operator*(Real factor) const { return {constant * factor, linear * factor, square * factor}; }
};

// (a + b t)(c + d t)
Quadratic product(Real a, Real b, Real c, Real d) {
    return {a * c, a * d + b * c, b * d};
}

Quadratic worst(const Quadratic& a, const Quadratic& b) {
    return {std::max(a.constant, b.constant), std::max(a.linear, b.linear), std::max(a.square, b.square)};
}

// Half the step of a stored value: `fixed`, or `relative` times the value, whichever is less.
struct HalfStep {
    std::optional<Real> fixed, relative;
};

HalfStep half_step(const Camera& camera, const DepthForm& form, Storage storage) {
    if (storage != Storage::float32 && storage != Storage::float16)
        return {0.5L, std::nullopt};
    const Real relative = storage == Storage::float32 ? 0x1p-24L : 0x1p-11L;
    const float largest = std::max(std::abs(form.lowest), std::abs(form.highest));
    if (!(largest < 0x1p90f)) // a metric encoding
        return {std::nullopt, relative};
    Real fixed = std::ldexp(relative, std::ilogb(std::nextafter(largest, 0.0f)));
    if (camera.depth_bits && *camera.depth_bits < 32)
        return {fixed + 0.5L / (std::exp2(static_cast<Real>(*camera.depth_bits)) - 1), std::nullopt};
    return {fixed, relative};
}

// The bound of z's error in t = |z − centre_depth| at one pixel, of fixed steps or of relative ones.
struct Bounds {
    std::optional<Quadratic> fixed, relative;
};

Bounds depth_error(const DepthForm& form, const HalfStep& step, const CentreRays& rays, Real x, Real y) {
    const Real centre_depth = rays.centre_depth;
    Bounds bounds;
    if (form.form == Form::exponential) { // dz/dv = rate ln 2 (z − offset + amplitude)
        const Real rate = std::abs(form.rate) * std::numbers::ln2_v<Real>;
        const Quadratic slope{rate * std::abs(centre_depth - form.offset + form.amplitude), rate, 0};
        bounds.fixed = slope * *step.fixed;
    } else if (form.form == Form::ray_distance) { // at most the stored length's own, along a slanted ray less
        if (step.fixed)
            bounds.fixed = Quadratic{std::abs(form.numerator[0]) * *step.fixed, 0, 0};
        if (step.relative) // the length is 1/cos of the depth beyond the camera centre, its error cos of its own
            bounds.relative = Quadratic{std::abs(form.numerator[3]) * *step.relative, *step.relative, 0};
    } else if (form.form == Form::inverse_ray_distance) { // with L = 1/(m v + n) the length, dL/dv = m L²
        const Eigen::Matrix<Real, 3, 1> pixel(x, y, 1);
        const Real slant = (rays.direction * pixel).norm() / rays.depth.dot(pixel);
        if (step.fixed)
            bounds.fixed = Quadratic{0, 0, slant * std::abs(form.denominator[0]) * *step.fixed};
        if (step.relative)
            bounds.relative = Quadratic{0, *step.relative, slant * std::abs(form.denominator[3]) * *step.relative};
    } else {
        const auto rest = [&](const Affine& row) { return row[1] * x + row[2] * y + row[3]; };
        const Real m = form.denominator[0], m0 = rest(form.denominator);
        const Real n = form.numerator[0] - centre_depth * m,
                   n0 = rest(form.numerator) - centre_depth * m0; // of z − centre_depth
        const Real delta = std::abs(n * m0 - m * n0);
        if (!(delta > 0))
            return bounds;
        const Quadratic slope = product(std::abs(n), std::abs(m), std::abs(n), std::abs(m)) * (1 / delta);
        if (step.fixed)
            bounds.fixed = slope * *step.fixed;
        if (step.relative)
            bounds.relative = product(std::abs(n0), std::abs(m0), std::abs(n), std::abs(m)) * (*step.relative / delta);
    }
    return bounds;
}

// |q| of the value in the middle of the stored range, at the first pixel; of depth 1 where that is none.
Real inverse_depth_at_middle(const Camera& camera, Storage storage, const DepthForm& form, const CentreRays& rays) {
    const double middle = (static_cast<double>(form.lowest) + static_cast<double>(form.highest)) / 2;
    const Real away = std::abs(view_depth(camera, storage, 0.5, 0.5, middle) - rays.centre_depth);
    const Real q = rays.perspective ? std::abs(rays.depth(2)) / away : away;
    return std::isfinite(q) ? q : 1;
}

} // namespace

InverseDepthError inverse_depth_error(const Camera& camera, Storage storage) {
    const DepthForm form = depth_form(camera, storage);
    const CentreRays rays = centre_rays(camera_rays(camera));
    const HalfStep step = half_step(camera, form, storage);
    Bounds all;
    // From the bound of z's error in t = |z − centre_depth| to that of q's in |q|, `covered` the depth that one step of the ray covers.
    const auto keep = [&](std::optional<Quadratic>& kept, const std::optional<Quadratic>& z, Real covered) {
        if (!z)
            return;
        const Quadratic q = rays.perspective ? Quadratic{z->square * covered, z->linear, z->constant / covered} : *z;
        kept = kept ? worst(*kept, q) : q;
    };
    for (const Real x : {Real{0}, static_cast<Real>(camera.width)}) {
        for (const Real y : {Real{0}, static_cast<Real>(camera.height)}) {
            const Real covered = rays.depth(0) * x + rays.depth(1) * y + rays.depth(2);
            if (!(covered > 0))
                continue; // beyond the horizon of a tilted image plane
            const Bounds bounds = depth_error(form, step, rays, x, y);
            keep(all.fixed, bounds.fixed, covered);
            keep(all.relative, bounds.relative, covered);
        }
    }
    // Both hold. A float's step grows with its value, so the relative one is nearer to the truth unless what it adds for
    // the sum's other terms is more than it saves.
    const Quadratic fixed = all.fixed.value_or(Quadratic{}), relative = all.relative.value_or(fixed);
    const Real middle = inverse_depth_at_middle(camera, storage, form, rays);
    const Quadratic bound = !all.fixed || relative.at(middle) <= 1.25L * fixed.at(middle) ? relative : fixed;
    return {static_cast<float>(bound.constant), static_cast<float>(bound.linear + roundings),
            static_cast<float>(bound.square)};
}

} // namespace fathom
