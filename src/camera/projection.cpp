// Projections: builders, the oblique near plane, and any 4 × 4.
//   z_clip / w = v_f + q (1/Z - 1/far),  q = (v_n - v_f) / (1/near - 1/far)    (Z = distance along the view axis)
// Everything is derived in long double; an infinite far plane is 1/far = 0, with no case of its own.
// Lengyel 2005, eq. 7, 9, 10 (oblique near plane); Everitt and Kilgard 2002, as Kooima has it (infinite far plane).

#include <fathom/projection.hpp>

#include "camera/matrix.hpp"
#include "require.hpp"

#include <Eigen/Core>

#include <cmath>
#include <numbers>

namespace fathom {
namespace {

using Real = long double;

// Turns view-space points of the given axes into the OpenGL ones, and back: it is its own inverse.
Projection::Matrix to_opengl(ViewAxes axes) {
    Projection::Matrix flip = Projection::Matrix::Identity();
    flip(1, 1) = axes == ViewAxes::opencv ? -1 : 1;
    flip(2, 2) = axes == ViewAxes::opengl ? 1 : -1;
    return flip;
}

void set_third_row(Projection& projection, Real clip_value, const Projection::Row& row) {
    projection.known_third_row = {clip_value, row};
    projection.matrix.row(2) = clip_value * projection.matrix.row(3) + row;
}

// A matrix built for the OpenGL axes with y up on the screen, its third row counted from `clip_value`, as the convention
// wants it.
Projection in_convention(Projection::Matrix matrix, Real clip_value, DepthOrder order, Convention convention) {
    require_rounding();
    if (convention.clip_y == ClipY::down)
        matrix.row(1) = -matrix.row(1);
    Projection result{matrix * to_opengl(convention.view_axes), convention, order, {}};
    set_third_row(result, clip_value, result.matrix.row(2));
    return result;
}

void require_edges(const FrustumEdges& edges) {
    require(std::isfinite(edges.left) && std::isfinite(edges.right) && edges.left != edges.right, "left = ", edges.left,
            " and right = ", edges.right, " must be finite and differ");
    require(std::isfinite(edges.bottom) && std::isfinite(edges.top) && edges.bottom != edges.top,
            "bottom = ", edges.bottom, " and top = ", edges.top, " must be finite and differ");
}

void require_perspective_span(const DepthSpan& span) {
    require(std::isfinite(span.near_plane) && span.near_plane > 0, "near = ", span.near_plane,
            " must be above 0 for a perspective");
    require(span.far_plane > span.near_plane, "far = ", span.far_plane,
            " must be greater than near = ", span.near_plane);
}

// Perspective from the slopes of its edges: x/Z = left..right, y/Z = bottom..top.
Projection perspective_from_slopes(Real left, Real right, Real bottom, Real top, DepthSpan span,
                                   Convention convention) {
    require_perspective_span(span);
    const Projection ends{{}, convention, span.order, {}};
    const Real inverse_far = 1 / static_cast<Real>(span.far_plane);
    const Real q = (ends.clip_near() - ends.clip_far()) / (1 / static_cast<Real>(span.near_plane) - inverse_far);

    Projection::Matrix m = Projection::Matrix::Zero();
    m(0, 0) = 2 / (right - left);
    m(0, 2) = (right + left) / (right - left);
    m(1, 1) = 2 / (top - bottom);
    m(1, 2) = (top + bottom) / (top - bottom);
    m(2, 2) = q * inverse_far; // counted from the far end, whose distance is what a sum would lose
    m(2, 3) = q;
    m(3, 2) = -1;
    return in_convention(m, ends.clip_far(), span.order, convention);
}

// Is a matrix the transposed one of a perspective or of an orthographic projection? A perspective has (0, 0, ±1, 0) in its
// fourth row, which a transposed one has in its fourth column, with another number in the row. An orthographic one has
// (0, 0, 0, 1) and nothing beside its diagonal but the fourth column.
bool looks_transposed(const Eigen::Matrix4d& m) {
    const Eigen::Vector4d column = m.col(3);
    const Eigen::RowVector4d row = m.row(3);
    const auto is_unit = [](const auto& vector, Eigen::Index at) {
        return std::abs(vector[at]) == 1 && vector.cwiseAbs().sum() == 1;
    };
    const bool perspective = is_unit(column, 2) && row.head<2>().isZero(0) && row[3] == 0 && std::abs(row[2]) != 1;
    const bool orthographic = is_unit(column, 3) && !is_unit(row, 3) && m.topLeftCorner<3, 3>().isDiagonal(0);
    return perspective || orthographic;
}

} // namespace

long double Projection::clip_near() const {
    if (order == DepthOrder::reversed)
        return 1;
    return convention.clip_z == ClipZ::negative_one_to_one ? -1 : 0;
}

long double Projection::clip_far() const {
    if (order == DepthOrder::standard)
        return 1;
    return convention.clip_z == ClipZ::negative_one_to_one ? -1 : 0;
}

bool Projection::is_perspective() const {
    return matrix(3, 0) != 0 || matrix(3, 1) != 0 || matrix(3, 2) != 0;
}

Projection::Matrix Projection::matrix_in_opengl_axes() const {
    return matrix * to_opengl(convention.view_axes);
}

Projection::ThirdRow Projection::third_row() const {
    if (known_third_row) {
        const auto& [clip_value, row] = *known_third_row;
        const Row end = clip_value * matrix.row(3), doubt = matrix.row(2) - end - row;
        const Row rounding = (end.cwiseAbs() + row.cwiseAbs()) * 0x1p-62L;
        if ((doubt.cwiseAbs().array() <= rounding.array()).all())
            return *known_third_row;
    }
    const Real end = is_perspective() ? clip_far() : clip_near();
    return {end, matrix.row(2) - end * matrix.row(3)};
}

Projection perspective(double fov_y, double aspect, DepthSpan span, Convention convention) {
    require(fov_y > 0 && fov_y < std::numbers::pi, "fov_y = ", fov_y, " must lie between 0 and pi radians");
    require(std::isfinite(aspect) && aspect > 0, "aspect = ", aspect, " must be above 0");
    const Real slope = std::tan(static_cast<Real>(fov_y) / 2);
    return perspective_from_slopes(-slope * aspect, slope * aspect, -slope, slope, span, convention);
}

Projection perspective(FrustumEdges edges, DepthSpan span, Convention convention) {
    require_edges(edges);
    require_perspective_span(span);
    const Real near = span.near_plane;
    return perspective_from_slopes(edges.left / near, edges.right / near, edges.bottom / near, edges.top / near, span,
                                   convention);
}

Projection perspective(Intrinsics intrinsics, DepthSpan span, Convention convention) {
    const Intrinsics& k = intrinsics;
    require(
        std::isfinite(k.fx) && k.fx > 0 && std::isfinite(k.fy) && k.fy > 0, "fx = ", k.fx, " and fy = ", k.fy,
        " must be above 0",
        k.fx < 0 && k.fy > 0
            ? "; below 0, fx says that the image is mirrored: flip it, take width - cx for cx, and leave the sign out"
        : k.fx > 0 && k.fy < 0 ? "; below 0, fy says that y points up: leave its sign out and say \"view_axes\": "
                                 "\"directx\" (x right, y up, z ahead)"
                               : "");
    require(std::isfinite(k.cx) && std::isfinite(k.cy), "cx = ", k.cx, " and cy = ", k.cy, " must be finite");
    require(k.width > 0 && k.height > 0, "an image of ", k.width, " x ", k.height, " pixels has no intrinsics");
    const Real fx = k.fx, fy = k.fy, cx = k.cx, cy = k.cy;
    return perspective_from_slopes(-cx / fx, (k.width - cx) / fx, (cy - k.height) / fy, cy / fy, span, convention);
}

Projection orthographic(FrustumEdges edges, DepthSpan span, Convention convention) {
    require_edges(edges);
    require(std::isfinite(span.near_plane) && std::isfinite(span.far_plane) && span.near_plane != span.far_plane,
            "near = ", span.near_plane, " and far = ", span.far_plane, " must be finite and differ");
    const Projection ends{{}, convention, span.order, {}};
    const Real left = edges.left, right = edges.right, bottom = edges.bottom, top = edges.top;
    const Real near = span.near_plane, far = span.far_plane;
    const Real slope = (ends.clip_far() - ends.clip_near()) / (far - near);

    Projection::Matrix m = Projection::Matrix::Zero();
    m(0, 0) = 2 / (right - left);
    m(0, 3) = -(right + left) / (right - left);
    m(1, 1) = 2 / (top - bottom);
    m(1, 3) = -(top + bottom) / (top - bottom);
    m(2, 2) = -slope; // counted from the near end
    m(2, 3) = -slope * near;
    m(3, 3) = 1;
    return in_convention(m, ends.clip_near(), span.order, convention);
}

Projection from_matrix(const Eigen::Matrix4d& matrix, Convention convention) {
    require(matrix.allFinite(), "the projection matrix has an element that is not a finite number");
    require(!looks_transposed(matrix),
            "the projection matrix is transposed: its fourth column is what a fourth row is; "
            "write its columns as rows, as from_column_major reads them");
    Projection projection{matrix.cast<Real>(), convention, DepthOrder::standard, {}};
    // What is ahead has a positive w, or nothing of it would be on the screen.
    const bool ahead_is_negative = convention.view_axes == ViewAxes::opengl;
    require(!projection.is_perspective() || !(ahead_is_negative ? matrix(3, 2) > 0 : matrix(3, 2) < 0),
            "the projection matrix must have ", ahead_is_negative ? "-1" : "+1",
            " in its fourth row, third column, for the given \"view_axes\"; say \"",
            ahead_is_negative ? "directx\" or \"opencv" : "opengl", "\"");
    const Projection::Matrix inverse = checked_inverse(projection.matrix_in_opengl_axes(), "the projection matrix");

    // Seen from the camera centre, where clip space is (0, 0, 1, 0), the nearer end has the larger 1/Z; without a camera
    // centre, the smaller Z. It need not be the origin: a shift may be baked into the matrix.
    const Eigen::Matrix<Real, 4, 1> centre = inverse.col(2);
    const bool has_centre =
        projection.is_perspective() && std::abs(centre.w()) > 0x1p-56L * inverse.row(3).cwiseAbs().maxCoeff();
    const auto nearness = [&](Real clip_z) {
        const Eigen::Matrix<Real, 4, 1> point = inverse * Eigen::Matrix<Real, 4, 1>(0, 0, clip_z, 1);
        return has_centre ? -point.w() / (point.z() - point.w() * (centre.z() / centre.w())) : point.z() / point.w();
    };
    const Real low = projection.clip_near();
    if (nearness(low) < nearness(1))
        projection.order = DepthOrder::reversed;
    return projection;
}

Projection from_column_major(std::span<const float, 16> elements, Convention convention) {
    return from_matrix(Eigen::Map<const Eigen::Matrix4f>(elements.data()).cast<double>(), convention);
}

Projection with_oblique_near_plane(const Projection& projection, const Eigen::Vector4d& plane) {
    using Vector = Eigen::Matrix<Real, 4, 1>;
    require(plane.allFinite() && plane.head<3>().norm() > 0, "the near plane (", plane.transpose(),
            ") must be finite and have a normal");
    const Vector c = plane.cast<Real>();
    const Projection::Matrix inverse = checked_inverse(projection.matrix, "the projection matrix");

    // The camera centre is where all rays meet: the point that clip space calls (0, 0, 1, 0), or a direction.
    const Vector centre = inverse.col(2);
    const Real v_near = projection.clip_near(), v_far = projection.clip_far();
    if (projection.is_perspective()) {
        const Real side = c.dot(centre) / centre.w();
        require(side < 0,
                "the camera centre is on the kept side of the near plane (plane at the camera centre = ", side,
                ", must be negative): turn the plane round or move it in front of the camera centre");
    } else {
        const Real ahead = c.dot(centre) * (v_far - v_near);
        require(ahead > 0, "the near plane (", plane.transpose(),
                ") keeps what lies towards the viewer: its normal must point ahead");
    }

    // The corner of the far end that lies furthest inside the plane: its image under the new projection is the far
    // plane's only point, so that the view volume keeps as much depth as it can.
    const Vector clip_plane = inverse.transpose() * c;
    const auto sign = [](Real value) { return value < 0 ? Real{-1} : Real{1}; };
    const Vector corner = inverse * Vector(sign(clip_plane.x()), sign(clip_plane.y()), v_far, 1);
    const Real inside = c.dot(corner);
    require(inside > 0, "the near plane leaves nothing of the view volume (plane at the farthest corner = ", inside,
            ", must be positive)");

    Projection result = projection;
    set_third_row(result, v_near, ((v_far - v_near) / inside) * c.transpose());
    checked_inverse(result.matrix, "the projection with this oblique near plane");
    return result;
}

} // namespace fathom
