#pragma once

#include <Eigen/Core>

#include <optional>
#include <span>

namespace fathom {
#pragma GCC visibility push(default)

/// Values of z/w at the two ends of the view volume: OpenGL −1..1, Direct3D and Vulkan 0..1.
enum class ClipZ { negative_one_to_one, zero_to_one };

/// Where y/w = +1 lies on the screen: on top (OpenGL, Direct3D) or at the bottom (Vulkan).
enum class ClipY { up, down };

/// Axes of the view space that the matrix was written for.
/// `opengl`: x right, y up, −z ahead. `directx`: x right, y up, +z ahead. `opencv`: x right, y down, +z ahead.
enum class ViewAxes { opengl, directx, opencv };

/// Is near or far stored as the larger value? Reversed depth keeps float32 exact far away.
enum class DepthOrder { standard, reversed };

/// What a graphics interface agrees on.
struct Convention {
    ClipZ clip_z = ClipZ::negative_one_to_one;
    ClipY clip_y = ClipY::up;
    ViewAxes view_axes = ViewAxes::opengl;

    static constexpr Convention opengl() { return {}; }
    static constexpr Convention direct3d() { return {ClipZ::zero_to_one, ClipY::up, ViewAxes::directx}; }
    static constexpr Convention vulkan() { return {ClipZ::zero_to_one, ClipY::down, ViewAxes::opengl}; }

    bool operator==(const Convention&) const = default;
};

/// Distances along the view axis, in scene units. `far_plane` may be infinity for a perspective.
struct DepthSpan {
    double near_plane;
    double far_plane;
    DepthOrder order = DepthOrder::standard;
};

/// Edges of the view volume, x to the right and y up: on the near plane for a perspective,
/// at any depth for an orthographic projection. Scene units.
struct FrustumEdges {
    double left, right, bottom, top;
};

/// Pinhole intrinsics in pixels. The principal point is counted from the top-left corner of the top-left pixel;
/// calibrations that count from that pixel's centre say `cx + 0.5`.
struct Intrinsics {
    double fx, fy, cx, cy;
    int width, height;
};

/// A projection: clip = matrix · view-space point (column vectors), with the conventions needed to read it.
///
/// The matrix is kept in `long double`, because at far/near = 10⁹ a double alone shifts depth by 3e-8.
/// A builder's projection is exact for its parameters, a given matrix for the doubles that were given.
struct Projection {
    using Matrix = Eigen::Matrix<long double, 4, 4>;

    using Row = Eigen::Matrix<long double, 1, 4>;

    Matrix matrix = Matrix::Zero(); ///< of a camera without a projection
    Convention convention;
    DepthOrder order = DepthOrder::standard;

    /// The third row without a multiple of the fourth, which belongs to one end of the volume: matrix.row(2) =
    /// clip_value · matrix.row(3) + row. Builders know it; in the matrix, a far plane that is far away has rounded it
    /// off.
    struct ThirdRow {
        long double clip_value; ///< clip_near() or clip_far()
        Row row;
    };
    std::optional<ThirdRow> known_third_row;

    /// Clip values z/w of the near and the far end: (−1, 1), (0, 1), or the other way round when reversed.
    long double clip_near() const;
    long double clip_far() const;

    /// A projection with a camera centre at a finite place: w varies in front of it.
    bool is_perspective() const;

    /// The same projection for the OpenGL axes (x right, y up, −z ahead), whatever axes it was written for.
    Matrix matrix_in_opengl_axes() const;

    /// What the builder knows if the matrix still agrees, otherwise the difference. Axes as the matrix.
    ThirdRow third_row() const;
};

/// Symmetric perspective. `fov_y` is the full vertical angle in radians; `aspect` is width / height.
/// Throws: std::invalid_argument for an angle outside (0, π), near ≤ 0, near = far, far < near.
Projection perspective(double fov_y, double aspect, DepthSpan span, Convention convention = {});

/// Perspective through the given edges of the near plane; off-centre when they are not symmetric.
Projection perspective(FrustumEdges edges, DepthSpan span, Convention convention = {});

/// Perspective of a calibrated pinhole camera, its image `width` × `height` pixels.
Projection perspective(Intrinsics intrinsics, DepthSpan span, Convention convention = {});

/// Orthographic projection. Near and far may be anything but equal, zero and negative included.
Projection orthographic(FrustumEdges edges, DepthSpan span, Convention convention = {});

/// Any 4 × 4 matrix, rows of P with clip = P · view. It must be finite and invertible.
/// The order (reversed or not) is read off the matrix: which clip value lies nearer to the camera centre.
/// Throws: std::invalid_argument, with the condition number, when the matrix is singular, and for one that is transposed or whose
/// view space has other axes than the convention says.
Projection from_matrix(const Eigen::Matrix4d& matrix, Convention convention = {});

/// The same from 16 floats in columns, as graphics code holds a matrix.
Projection from_column_major(std::span<const float, 16> elements, Convention convention = {});

/// Replaces the near plane by `plane` = (a, b, c, d), view space in the projection's own axes:
/// points with a x + b y + c z + d ≥ 0 are kept. The far plane is tilted to touch the opposite corner of the
/// view volume, which is what it costs: see `depth_spacing` in precision.hpp.
///   M₃' = v_n M₄ + α C,  α = (v_f − v_n)(M₄·Q)/(C·Q),  Q = M⁻¹(±1, ±1, v_f, 1)
/// Throws: std::invalid_argument when C·Q ≤ 0 (the far corner is clipped away), when the camera centre E of a perspective
/// is not on the clipped side (C·E ≥ 0), and when the plane of an orthographic projection does not face ahead.
/// Source: Lengyel 2005, eq. 7, 9, 10, which hold for any invertible matrix; Pranckevičius 2007 for orthographic ones.
Projection with_oblique_near_plane(const Projection& projection, const Eigen::Vector4d& plane);

#pragma GCC visibility pop
} // namespace fathom
