// Constants of the circle of confusion for the kernels. src/camera/circle_form.cpp has its formula.

#include "operations/dof_masks/dof_masks.hpp"

#include "camera/form.hpp"
#include "operations/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

using Real = long double;

static_assert(static_cast<int>(CircleForm::recentred) == CIRCLE_RECENTRED &&
              static_cast<int>(CircleForm::sum) == CIRCLE_SUM &&
              static_cast<int>(CircleForm::quotient) == CIRCLE_QUOTIENT &&
              static_cast<int>(CircleForm::of_depth) == CIRCLE_OF_DEPTH);

Affine divided(Affine row, Real by) {
    for (Real& value : row)
        value /= by;
    return row;
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
    const Affine& m = form.denominator;
    const auto [numerator, denominator] = circle_quotient(form, circle);
    if (is_constant(denominator)) {
        pack_row(p.numerator, divided(circle.telecentric ? numerator : m, denominator[3]), 1, arithmetic);
        return;
    }
    const Real unit = unit_of_quotient(form, numerator, denominator);
    pack_row(p.numerator, numerator, unit, arithmetic);
    pack_row(p.denominator, denominator, unit, arithmetic);
    pack_row(p.in_front, m, unit, arithmetic);
}

} // namespace

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
    p.infinite =
        std::clamp(static_cast<float>(coc_at(circle, std::numeric_limits<Real>::infinity())), -p.largest, p.largest);
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

} // namespace fathom
