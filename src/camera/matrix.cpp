// Inverse of a 4 × 4 with a condition that does not depend on units: rows and columns are first scaled by powers of
// two, which rounds nothing. It starts from products of the matrix's elements (Cramer's rule), so that what is zero by the
// matrix's own zeros is exactly zero: an elimination leaves noise there, and noise in the fourth row costs a camera its
// simple form. One step of Newton, X + X (1 - A X), then makes the rest as good as an elimination with full pivoting.

#include "camera/matrix.hpp"

#include "require.hpp"

#include <cmath>
#include <limits>

namespace fathom {
namespace {

using Matrix = Eigen::Matrix<long double, 4, 4>;
using Vector = Eigen::Matrix<long double, 4, 1>;

long double power_of_two_near(long double value) {
    return value > 0 ? std::ldexp(1.0L, -std::ilogb(value)) : 1.0L;
}

// Laplace expansion by the 2 × 2 minors of the upper and of the lower two rows. Not finite when singular.
Matrix inverse_by_minors(const Matrix& m) {
    const auto minor = [&](int row, int i, int j) { return m(row, i) * m(row + 1, j) - m(row, j) * m(row + 1, i); };
    const long double a01 = minor(0, 0, 1), a02 = minor(0, 0, 2), a03 = minor(0, 0, 3), a12 = minor(0, 1, 2),
                      a13 = minor(0, 1, 3), a23 = minor(0, 2, 3);
    const long double b01 = minor(2, 0, 1), b02 = minor(2, 0, 2), b03 = minor(2, 0, 3), b12 = minor(2, 1, 2),
                      b13 = minor(2, 1, 3), b23 = minor(2, 2, 3);
    // Column `i` of the adjugate: row `other` of the matrix against the minors of the opposite two rows.
    const auto column = [&](int other, long double c01, long double c02, long double c03, long double c12,
                            long double c13, long double c23) {
        const auto e = m.row(other);
        return Vector(e(1) * c23 - e(2) * c13 + e(3) * c12, -e(0) * c23 + e(2) * c03 - e(3) * c02,
                      e(0) * c13 - e(1) * c03 + e(3) * c01, -e(0) * c12 + e(1) * c02 - e(2) * c01);
    };
    Matrix adjugate;
    adjugate.col(0) = column(1, b01, b02, b03, b12, b13, b23);
    adjugate.col(1) = -column(0, b01, b02, b03, b12, b13, b23);
    adjugate.col(2) = column(3, a01, a02, a03, a12, a13, a23);
    adjugate.col(3) = -column(2, a01, a02, a03, a12, a13, a23);
    return adjugate / (a01 * b23 - a02 * b13 + a03 * b12 + a12 * b03 - a13 * b02 + a23 * b01);
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
    Matrix inverse = inverse_by_minors(scaled);
    const Matrix correction = inverse * (Matrix::Identity() - scaled * inverse);
    inverse += (inverse.array() != 0).select(correction, 0);
    const long double condition = inverse.allFinite() ? scaled.cwiseAbs().rowwise().sum().maxCoeff() *
                                                            inverse.cwiseAbs().rowwise().sum().maxCoeff()
                                                      : std::numeric_limits<long double>::infinity();
    require(condition <= largest_condition, what, " is singular: its condition number is ", condition,
            ", the limit is ", largest_condition);
    return columns.asDiagonal() * inverse * rows.asDiagonal();
}

} // namespace fathom
