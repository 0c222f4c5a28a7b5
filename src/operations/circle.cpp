// The circle of confusion as a function of the stored value and the pixel.
//   z = (n·q)/(m·q),  q = (v, x, y, 1)
//   c = k − g/(z − lens) = k − g (m·q)/(n'·q),  n' = n − lens m                 under a perspective
//   c = g z − k          = ((g n − k m)·q)/(m·q)                                under an orthographic projection
// where n' or m is constant that is affine in q. Potmesil and Chakravarty 1981; 1/z is affine by Popov 2016, eq. 5, 6.

#include "operations/circle.hpp"

#include "operations/parameters.hpp"
#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

using Real = long double;

// What the rounding of the eye's depth leaves of a coefficient that is zero.
constexpr Real noise = 0x1p-48L;

// factor_a a + factor_b b, coefficients that all but cancel being none.
Affine combined(Real factor_a, const Affine& a, Real factor_b, const Affine& b) {
    Affine row;
    for (std::size_t i = 0; i < 4; ++i) {
        const Real first = factor_a * a[i], second = factor_b * b[i];
        row[i] = first + second;
        if (std::abs(row[i]) < noise * (std::abs(first) + std::abs(second)))
            row[i] = 0;
    }
    return row;
}

bool is_constant(const Affine& row) {
    return row[0] == 0 && row[1] == 0 && row[2] == 0;
}

Affine divided(Affine row, Real by) {
    for (Real& value : row)
        value /= by;
    return row;
}

// Of the depth from the lens, which is numerator / denominator for all forms but the last two.
Affine from_lens(const DepthForm& form, const CircleOfConfusion& circle) {
    return combined(1, form.numerator, -circle.lens_depth, form.denominator);
}

// A quotient is the same in any unit: one in which the low parts of two floats are no denormals. Metric values are so large
// already that 1 is the only safe one.
Real unit_of(const DepthForm& form, const Affine& numerator, const Affine& denominator) {
    if (form.form != Form::rational)
        return 1;
    const auto exponent = [](const Affine& row) {
        Real largest = std::numeric_limits<Real>::min();
        for (const Real coefficient : row)
            largest = std::max(largest, std::abs(coefficient));
        return std::ilogb(largest);
    };
    return std::ldexp(Real{1}, std::min(40 - exponent(denominator), 100 - exponent(numerator)));
}

void pack(params::wide (&target)[4], const Affine& row, Real unit, Arithmetic arithmetic) {
    for (std::size_t i = 0; i < 4; ++i)
        target[i] = pack_wide(row[i] * unit, arithmetic);
}

void set_recentred(params::circle_params& p, const DepthForm& form, const CircleOfConfusion& circle) {
    const Real inverse = form.denominator[0] / form.numerator[3], rest = form.denominator[3] / form.numerator[3];
    const bool far_is_low = inverse > 0;
    const float end = far_is_low ? form.lowest : form.highest;
    const Real slope = -circle.g * std::abs(inverse);
    p.sign = far_is_low ? 1.0f : -1.0f;
    p.end = far_is_low ? -end : end;
    p.slope_high = static_cast<float>(slope);
    p.slope_low = static_cast<float>(slope - p.slope_high);
    p.at_end = static_cast<float>(circle.k - circle.g * (inverse * end + rest));
}

void set_sums(params::circle_params& p, const DepthForm& form, const CircleOfConfusion& circle, Arithmetic arithmetic) {
    const Affine &n = form.numerator, &m = form.denominator;
    const Affine denominator = circle.telecentric ? m : from_lens(form, circle);
    const Affine numerator =
        circle.telecentric ? combined(circle.g, n, -circle.k, m) : combined(circle.k, denominator, -circle.g, m);
    if (is_constant(denominator)) {
        pack(p.numerator, divided(circle.telecentric ? numerator : m, denominator[3]), 1, arithmetic);
        return;
    }
    const Real unit = unit_of(form, numerator, denominator);
    pack(p.numerator, numerator, unit, arithmetic);
    pack(p.denominator, denominator, unit, arithmetic);
    pack(p.in_front, m, unit, arithmetic);
}

float clamped(Real circle, float largest) {
    return std::clamp(static_cast<float>(circle), -largest, largest);
}

} // namespace

void check_circle(const CircleOfConfusion& circle, const DepthForm& form) {
    require(std::isfinite(circle.k) && circle.k >= 0, text("the circle's k = ", circle.k, " must be 0 or greater"));
    require(std::isfinite(circle.g) && circle.g >= 0, text("the circle's g = ", circle.g, " must be 0 or greater"));
    require(std::isfinite(circle.lens_depth), text("the circle's lens_depth = ", circle.lens_depth, " must be finite"));
    require(circle.telecentric != form.perspective,
            circle.telecentric ? "a telecentric circle does not belong to a perspective camera"
                               : "a camera of an orthographic camera needs a telecentric circle");
}

void count_from_lens(DepthForm& form, Rays& rays, const CircleOfConfusion& circle) {
    if (circle_form(form, circle) != CircleForm::of_depth)
        return;
    rays.eye_depth -= circle.lens_depth;
    form.offset -= circle.lens_depth;
    const Real least = form.least_depth - circle.lens_depth; // itself a float
    form.least_depth = std::abs(least) <= 0x1p-23L * std::abs(circle.lens_depth) ? 0.0f : static_cast<float>(least);
}

CircleForm circle_form(const DepthForm& form, const CircleOfConfusion& circle) {
    if (form.form == Form::exponential || form.form == Form::ray_distance)
        return CircleForm::of_depth;
    if (!is_constant(circle.telecentric ? form.denominator : from_lens(form, circle)))
        return CircleForm::quotient;
    return form.form == Form::reciprocal && !circle.telecentric ? CircleForm::recentred : CircleForm::sum;
}

params::circle_params circle_parameters(const DepthForm& form, const CircleOfConfusion& circle,
                                        const DofMasksOptions& options, Arithmetic arithmetic) {
    params::circle_params p{};
    switch (circle_form(form, circle)) {
    case CircleForm::recentred:
        set_recentred(p, form, circle);
        break;
    case CircleForm::sum:
    case CircleForm::quotient:
        set_sums(p, form, circle, arithmetic);
        break;
    case CircleForm::of_depth:
        break;
    }
    p.k = pack_wide(circle.k, arithmetic);
    p.g = pack_wide(circle.g, arithmetic);
    p.largest = static_cast<float>(options.max_coc_px);
    p.infinite = clamped(coc_at(circle, std::numeric_limits<Real>::infinity()), p.largest);
    p.sky = options.sky == Sky::blur    ? p.infinite
            : options.sky == Sky::sharp ? 0.0f
                                        : std::numeric_limits<float>::quiet_NaN();
    p.sharp = static_cast<float>(options.sharp_px);
    p.inverse_transition = inverse_transition(options);
    return p;
}

float inverse_transition(const DofMasksOptions& options) {
    return static_cast<float>(
        std::min(1 / static_cast<Real>(options.transition_px), static_cast<Real>(std::numeric_limits<float>::max())));
}

runtime::Defines circle_defines(const DepthForm& form, const CircleOfConfusion& circle, const Rays& rays,
                                Storage storage, int vector_width, bool stream) {
    runtime::Defines choices = decoder_defines(form, rays, storage, vector_width, stream);
    choices.emplace_back("CIRCLE", static_cast<int>(circle_form(form, circle)));
    choices.emplace_back("TELECENTRIC", circle.telecentric);
    return choices;
}

} // namespace fathom
