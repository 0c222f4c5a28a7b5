// The circle of confusion as a function of the stored value and the pixel.
//   z = (n·q)/(m·q),  q = (v, x, y, 1)
//   c = k − g/(z − lens) = k − g (m·q)/(n'·q),  n' = n − lens m                 under a perspective
//   c = g z − k          = ((g n − k m)·q)/(m·q)                                under an orthographic projection
// where n' or m is constant that is affine in q. Potmesil and Chakravarty 1981; 1/z is affine by Popov 2016, eq. 5, 6.

#include "camera/circle_form.hpp"

#include "description/check.hpp"
#include "description/lens.hpp"
#include "require.hpp"

#include <cmath>

namespace fathom {
namespace {

using Real = long double;

// A coefficient this small beside its terms is zero but for the rounding of the camera centre's depth.
constexpr Real noise = 0x1p-48L;

// factor_a a + factor_b b, where coefficients that all but cancel become 0.
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

// The numerator of the depth counted from the lens. Depth is numerator / denominator for all forms before `exponential`.
Affine from_lens(const DepthForm& form, const CircleOfConfusion& circle) {
    return combined(1, form.numerator, -circle.lens_depth, form.denominator);
}

} // namespace

bool is_constant(const Affine& row) {
    return row[0] == 0 && row[1] == 0 && row[2] == 0;
}

void check_circle(const CircleOfConfusion& circle, const DepthForm& form) {
    const description::Accepts two(description::Kind::lens);
    require(two.accepts(circle), "circle = (", static_cast<double>(circle.k), ", ", static_cast<double>(circle.g),
            ") must be ", two.accepted());
    require(std::isfinite(static_cast<long double>(circle.lens_depth)), "the circle's lens_depth = ", circle.lens_depth,
            " must be finite");
    require(circle.telecentric != form.perspective, circle.telecentric
                                                        ? "a telecentric circle does not belong to a perspective camera"
                                                        : "an orthographic camera needs a telecentric circle");
}

void count_from_lens(DepthForm& form, const CircleOfConfusion& circle) {
    if (circle_form(form, circle) != CircleForm::of_depth)
        return;
    form.offset -= circle.lens_depth;
    const Real least = form.least_depth - circle.lens_depth; // itself a float
    form.least_depth = std::abs(least) <= 0x1p-23L * std::abs(circle.lens_depth) ? 0.0f : static_cast<float>(least);
}

CircleForm circle_form(const DepthForm& form, const CircleOfConfusion& circle) {
    if (form.form >= Form::exponential)
        return CircleForm::of_depth;
    if (!is_constant(circle.telecentric ? form.denominator : from_lens(form, circle)))
        return CircleForm::quotient;
    return form.form == Form::reciprocal && !circle.telecentric ? CircleForm::recentred : CircleForm::sum;
}

CircleQuotient circle_quotient(const DepthForm& form, const CircleOfConfusion& circle) {
    const Affine &n = form.numerator, &m = form.denominator;
    if (circle.telecentric)
        return {combined(circle.g, n, -circle.k, m), m};
    const Affine denominator = from_lens(form, circle);
    return {combined(circle.k, denominator, -circle.g, m), denominator};
}

} // namespace fathom
