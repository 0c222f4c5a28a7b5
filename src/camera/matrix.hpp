#pragma once

#include <Eigen/Core>

#include <string>

namespace fathom {

/// Largest condition number, after rows and columns are scaled to size one, whose inverse in `long double` still
/// keeps the accuracy that `linearize` promises. Ordinary projections stay below 100, whatever their units.
inline constexpr long double largest_condition = 1e10L;

/// The inverse of a projection, or std::invalid_argument naming `what` and its condition number.
Eigen::Matrix<long double, 4, 4> checked_inverse(const Eigen::Matrix<long double, 4, 4>& matrix,
                                                 const std::string& what);

} // namespace fathom
