// Inverse of a 4 × 4 with a condition that does not depend on units: rows and columns are first scaled by powers of
// two, which rounds nothing.

#include "camera/matrix.hpp"

#include "text.hpp"

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace fathom {
namespace {

using Matrix = Eigen::Matrix<long double, 4, 4>;
using Vector = Eigen::Matrix<long double, 4, 1>;

long double power_of_two_near(long double value) {
    return value > 0 ? std::ldexp(1.0L, -std::ilogb(value)) : 1.0L;
}

} // namespace

Matrix checked_inverse(const Matrix& matrix, const std::string& what) {
    Vector rows = Vector::Ones(), columns = Vector::Ones();
    Matrix scaled = matrix;
    for (int pass = 0; pass < 4; ++pass) {
        for (int i = 0; i < 4; ++i) {
            const long double factor = power_of_two_near(scaled.row(i).cwiseAbs().maxCoeff());
            scaled.row(i) *= factor;
            rows(i) *= factor;
        }
        for (int i = 0; i < 4; ++i) {
            const long double factor = power_of_two_near(scaled.col(i).cwiseAbs().maxCoeff());
            scaled.col(i) *= factor;
            columns(i) *= factor;
        }
    }
    const Eigen::FullPivLU<Matrix> lu(scaled);
    const Matrix inverse = lu.inverse();
    const long double condition =
        lu.isInvertible() && inverse.allFinite()
            ? scaled.cwiseAbs().rowwise().sum().maxCoeff() * inverse.cwiseAbs().rowwise().sum().maxCoeff()
            : std::numeric_limits<long double>::infinity();
    if (!(condition <= largest_condition)) {
        throw std::invalid_argument(
            text(what, " is singular: its condition number is ", condition, ", the limit is ", largest_condition));
    }
    return columns.asDiagonal() * inverse * rows.asDiagonal();
}

} // namespace fathom
