#pragma once

#include <fathom/camera.hpp>
#include <fathom/lens.hpp>

namespace fathom {

/// How kernels/dof_masks/circle.h computes a circle; the values are the CIRCLE_ constants of params.h.
enum class CircleForm {
    recentred, ///< affine in the stored value, in floats
    sum,       ///< affine in the stored value and the pixel, in double or two floats
    quotient,  ///< of two such sums
    of_depth,  ///< the depth is decoded first
};

/// The simplest form that is exact for this decoder and lens.
CircleForm circle_form(const DepthForm& form, const CircleOfConfusion& circle);

/// A circle whose form is a sum or a quotient, as a quotient of two affine functions.
struct CircleQuotient {
    Affine numerator, denominator;
};
CircleQuotient circle_quotient(const DepthForm& form, const CircleOfConfusion& circle);

/// Does an affine function depend neither on the stored value nor on the pixel?
bool is_constant(const Affine& row);

/// Where the depth is decoded first, makes the decoder count it from the lens: the sum of the two would cancel again.
void count_from_lens(DepthForm& form, const CircleOfConfusion& circle);

/// Throws: std::invalid_argument for a circle that no lens has, or that does not belong to this kind of camera.
void check_circle(const CircleOfConfusion& circle, const DepthForm& form);

} // namespace fathom
