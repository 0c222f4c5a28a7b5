#pragma once

// Truth for depth and positions in __float128, from what a builder was told or from the doubles of a given matrix.
//   perspective   1/Z = (1 − s)/near + s/far                  s: 0 on the near plane, 1 on the far plane
//   orthographic    Z = (1 − s) near + s far
//   oblique plane C, rays D(x, y), k the largest C·Q over the far corners Q:
//     perspective 1/Z = (s k − C·D)/C_w, with Q per unit of depth;   orthographic Z = (C·(X, Y, 0, 1) − s k)/C_z
//   any matrix      Z = −(m₃·q)/(m₄·q),  M = P⁻¹,  q the pixel in clip space
// Written from these equations; it shares no code with src/camera.

#include <fathom/camera.hpp>
#include <fathom/projection.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace oracle {

using Quad = __float128;
using Point = std::array<Quad, 3>;
using Matrix = std::array<std::array<Quad, 4>, 4>;

/// low·(1 − u) + high·u + x·x + y·y + one: u runs from 0 to 1 over the stored range, (x, y) is the pixel's centre.
struct Sum {
    Quad low = 0, high = 0, x = 0, y = 0, one = 0;

    Quad at(Quad complement, Quad u, Quad px, Quad py) const {
        return low * complement + high * u + x * px + y * py + one;
    }
};

/// Z = numerator / denominator.
struct Quotient {
    Quad v_low, v_high; // stored values, as they lie in memory, of u = 0 and u = 1
    Sum numerator{}, denominator{};

    Quad at(Quad v, Quad x, Quad y) const {
        const Quad range = v_high - v_low, complement = (v_high - v) / range, u = (v - v_low) / range;
        return numerator.at(complement, u, x, y) / denominator.at(complement, u, x, y);
    }
};

/// What a builder was told. Edges are x and y over depth for a perspective, x and y themselves for an orthographic camera.
struct Frustum {
    bool is_orthographic;
    Quad left, right, bottom, top;
    Quad near, far;
    bool reversed;
    std::optional<std::array<Quad, 4>> plane = std::nullopt; ///< oblique near plane, in the axes of the convention
};

/// A camera as the library is given it, and the truth about it.
struct Subject {
    std::string name;
    fathom::Camera camera;
    std::optional<Frustum> frustum; ///< its truth, or
    Matrix matrix{};                ///< the doubles that were given
};

/// The same parameters to the library's builder and to the oracle.
Subject from_field_of_view(double fov_y, double aspect, fathom::DepthSpan span, fathom::Convention convention = {});
Subject from_edges(fathom::FrustumEdges edges, fathom::DepthSpan span, fathom::Convention convention = {});
Subject from_intrinsics(fathom::Intrinsics intrinsics, fathom::DepthSpan span, fathom::Convention convention = {});
Subject from_orthographic(fathom::FrustumEdges edges, fathom::DepthSpan span, fathom::Convention convention = {});
Subject from_matrix(const Eigen::Matrix4d& matrix, fathom::Convention convention = {});
Subject with_oblique_near_plane(Subject subject, const Eigen::Vector4d& plane);
Subject named(Subject subject, std::string name, int width = 16384, int height = 16384);

/// An ordinary OpenGL perspective as doubles, and with its fourth row tilted or its camera centre moved.
Eigen::Matrix4d perspective_matrix(double slope_x, double slope_y, double near, double far);
Eigen::Matrix4d tilted(Eigen::Matrix4d matrix, double by_x, double by_y);
Eigen::Matrix4d moved(Eigen::Matrix4d matrix, const Eigen::Vector3d& centre);

class Truth {
public:
    Truth(const Subject& subject, fathom::Storage storage);

    /// Distance along the view axis of a stored value that is a surface. (x, y) is the pixel's centre.
    Quad depth(double v, double x, double y) const;

    /// Can the value be a surface at all? Limits that no float meets are rounded outwards.
    bool in_range(double v) const;

    /// Is that depth in front of the camera, where there is one?
    bool in_front(Quad depth) const { return is_orthographic_ || depth > -centre_[2]; }

    /// The point at that depth on the ray of a pixel, in the axes of the projection.
    Point position(Quad depth, double x, double y) const;

    /// That point in the world, relative to an origin.
    Point in_world(const Point& position, const Eigen::Vector3d& origin) const;

    /// The camera centre in the axes of the projection, or its origin for an orthographic camera.
    Point centre() const { return to_own(centre_); }

    /// Σ|terms|/|sum| of the sums of this form as they are written in camera.h.
    Quad condition(fathom::Form form, double v, double x, double y) const;

    /// Window, linear, median and metric encodings.
    const Quotient& quotient() const { return quotient_; }

private:
    void set_frustum(const Frustum& frustum);
    void set_matrix(const Matrix& matrix);
    void set_encoding();
    Point on_ray(Quad depth, Quad x, Quad y) const;
    Quad along_ray(Quad length, Quad x, Quad y) const;
    bool is_infinitely_far(double v) const;
    Quad beyond_centre() const; // where a ray distance is counted from, as a depth beyond the camera centre
    Point to_own(Point canonical) const;

    fathom::Camera camera_;
    fathom::Storage storage_;
    std::optional<Frustum> frustum_;
    Matrix inverse_{};
    bool is_orthographic_ = false;
    Point centre_{};
    Quotient quotient_{};
    Quad rate_ = 0, amplitude_ = 0, offset_ = 0; // exponential: Z = amplitude (e^(rate u) − 1) + offset
};

/// Unit in the last place of a value in float: the distance between the floats around it, denormals included.
double ulp(Quad value);

/// |got − exact| in units of ulp(exact). Beyond the largest float, infinity is exact.
double error_in_ulp(float got, Quad exact);

} // namespace oracle
