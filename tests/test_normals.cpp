// normals against analytic scenes: planes at every tilt under every kind of camera, spheres, boxes and whole scenes, for each
// method; quantised and noisy depth; images that are all edges.

#include "catch.hpp"
#include "operations/normals.hpp"
#include "stability.hpp"

#include <fathom/fathom.hpp>

#include <Eigen/Dense>

#include <scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

using namespace fathom;
using Eigen::Vector3d;

namespace {

using stability::camera_of;
using stability::infinity;
using stability::not_a_number;

constexpr double degree = 3.14159265358979323846 / 180;

// What float32 depth of 161 × 121 pixels and 57 by 72 degrees leaves of a plane's normal, inside. An error of depth turns a
// normal the more, the nearer two pixels' rays are: by its share of the depth over their angle.
constexpr double plane_error_deg = 1e-3;

double angle_deg(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) / degree;
}

struct Result {
    int width, height;
    std::vector<float> values; // x, y, z and the validity

    Vector3d at(int x, int y) const {
        const float* n = &values[4 * static_cast<std::size_t>(y * width + x)];
        return {n[0], n[1], n[2]};
    }
    float validity(int x, int y) const { return values[4 * static_cast<std::size_t>(y * width + x) + 3]; }
};

template <typename Value>
StoredDepth stored_of(const std::vector<Value>& values, const Camera& camera, Storage storage = Storage::float32,
                      Arithmetic arithmetic = Arithmetic::fp64) {
    return {Image::from_host(oracle::device(arithmetic), element_of(storage), values.data(),
                             {camera.width, camera.height, channels_of(storage)}),
            camera, storage};
}

Result normals_of(const StoredDepth& stored, NormalsOptions options = {}) {
    options.channels = 4;
    const Image image = normals(stored, options);
    Result result{image.width(), image.height(), {}};
    result.values.resize(4 * static_cast<std::size_t>(result.width * result.height));
    image.download(result.values.data());
    return result;
}

// Unit length with validity 1, or nothing with validity 0.
bool well_formed(const Result& result) {
    for (std::size_t i = 0; i < result.values.size(); i += 4) {
        const float* n = &result.values[i];
        const double length = std::hypot(n[0], n[1], n[2]);
        const bool nothing = n[0] == 0 && n[1] == 0 && n[2] == 0 && n[3] == 0;
        if (!nothing && !(n[3] == 1 && std::abs(length - 1) <= normals_length_error))
            return false;
    }
    return true;
}

struct Subject {
    const char* name;
    Camera camera;
    double distance = 2.5; // of the planes, along the view axis
};

Camera with(Camera camera, Encoding encoding) {
    camera.encoding = encoding;
    if (encoding != Encoding::window) {
        camera.near = 0.5;
        camera.far = 500;
        camera.median = 6;
    }
    return camera;
}

Camera sized(const Projection& projection) {
    return camera_of(projection, 161, 121);
}

std::vector<Subject> cameras() {
    const DepthSpan span{0.5, 500}, reversed{0.5, std::numeric_limits<double>::infinity(), DepthOrder::reversed};
    const Convention opencv{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    const Camera plain = sized(perspective(1.0, 4.0 / 3, span));
    const Camera parallel = sized(orthographic({-2, 2, -1.5, 1.5}, {0.5, 100}));
    Eigen::Matrix4d tilt = plain.projection.matrix.cast<double>();
    tilt.row(3) = Eigen::RowVector4d(0.06, -0.04, -1, 0);
    Eigen::Matrix4d shear = parallel.projection.matrix.cast<double>();
    shear(0, 2) = 0.2;
    shear(1, 2) = -0.1;
    Eigen::Matrix4d moved = plain.projection.matrix.cast<double>();
    moved.col(3) -= moved.leftCols<3>() * Vector3d(0.3, -0.1, 0.4);
    Camera bottom_up = plain;
    bottom_up.rows = Rows::bottom_up;
    return {
        {"perspective", plain},
        {"rows bottom up", bottom_up},
        {"off-centre", sized(perspective(FrustumEdges{-0.6, 0.15, -0.15, 0.4}, span))},
        {"OpenCV axes", sized(perspective(1.0, 4.0 / 3, span, opencv))},
        {"Direct3D", sized(perspective(1.0, 4.0 / 3, span, Convention::direct3d()))},
        {"reversed infinite", sized(perspective(1.0, 4.0 / 3, reversed, Convention::vulkan()))},
        {"infinite", sized(perspective(1.0, 4.0 / 3, {0.5, std::numeric_limits<double>::infinity()}))},
        {"oblique", sized(with_oblique_near_plane(plain.projection, {0.2, 0.1, -1, -0.6}))},
        {"150 degrees", sized(perspective(150 * degree, 4.0 / 3, span))},
        {"tilted", sized(from_matrix(tilt))},
        {"eye moved", sized(from_matrix(moved)), 2.9},
        {"orthographic", parallel},
        {"oblique orthographic", sized(with_oblique_near_plane(parallel.projection, {0.2, -0.1, -1, -0.6}))},
        {"sheared orthographic", sized(from_matrix(shear))},
        {"view-z", with(plain, Encoding::view_z)},
        {"linear", with(plain, Encoding::linear)},
        {"ray distance", with(plain, Encoding::ray_distance)},
        {"ray distance, tilted", with(sized(from_matrix(tilt)), Encoding::ray_distance)},
        {"logarithmic", with(plain, Encoding::logarithmic)},
        {"exponential", with(plain, Encoding::exponential)},
        {"median", with(plain, Encoding::median)},
        {"inverse", with(plain, Encoding::inverse)},
        {"orthographic, view-z", with(parallel, Encoding::view_z)},
    };
}

/// What slopes that are off by `normals_slope_error` and a depth that is off by its own bound do to a plane's normal:
/// n = gx Dy x d + gy d x Dx + q Dx x Dy moves by no more than the sum of the three.
class Promise {
public:
    explicit Promise(const Camera& camera)
        : eye_(eye_rays(rays(camera))), error_(planar_error(camera, Storage::float32)),
          direction_(eye_.direction.cast<double>()),
          moving_(eye_.perspective ? direction_ : Eigen::Matrix3d(eye_.origin.cast<double>())),
          of_q_(moving_.col(0).cross(moving_.col(1))) {}

    double degrees(int x, int y, double z, const Vector3d& normal) const {
        const Vector3d pixel(x + 0.5, y + 0.5, 1);
        const Vector3d d = eye_.perspective ? Vector3d(direction_ * pixel) : Vector3d(direction_.col(2));
        const Vector3d of_x = moving_.col(1).cross(d), of_y = d.cross(moving_.col(0));
        const double covered = eye_.depth.cast<double>().dot(pixel);
        const double q = eye_.perspective ? covered / (z - static_cast<double>(eye_.eye_depth)) : -z;
        const double size = std::abs(q),
                     off = static_cast<double>(error_.constant) +
                           (static_cast<double>(error_.linear) + static_cast<double>(error_.quadratic) * size) * size;
        // n.d is q, or 1, times the volume of the three; the kernel's own arithmetic is a few roundings of all that.
        const double length = std::abs((eye_.perspective ? q : 1) * of_q_.dot(d) / normal.dot(d));
        const double moved = normals_slope_error * off * (of_x.norm() + of_y.norm()) +
                             (eye_.perspective ? off * of_q_.norm() : 0) + 16 * 0x1p-24 * length;
        return std::asin(std::min(1.0, moved / length)) / degree;
    }

private:
    EyeRays eye_;
    PlanarError error_;
    Eigen::Matrix3d direction_, moving_;
    Vector3d of_q_;
};

struct PlaneErrors {
    double worst = 0, share = 0;
    long pixels = 0;
};

void judge_plane(const scene::Rendered& truth, const Camera& camera, const Result& result, int reach,
                 PlaneErrors& errors) {
    const Promise promise(camera);
    for (int y = reach; y < camera.height - reach; ++y) {
        for (int x = reach; x < camera.width - reach; ++x) {
            bool inside = true;
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    inside &= std::isfinite(truth.z[static_cast<std::size_t>((y + dy) * camera.width + x + dx)]);
            if (!inside)
                continue;
            const auto i = static_cast<std::size_t>(y * camera.width + x);
            const double off = angle_deg(result.at(x, y), truth.normal[i]);
            errors.worst = std::max(errors.worst, off);
            errors.share = std::max(errors.share, off / promise.degrees(x, y, truth.z[i], truth.normal[i]));
            ++errors.pixels;
        }
    }
}

} // namespace

TEST_CASE("normals: planes at tilts up to 85 degrees under every camera", "[normals][exact]") {
    std::printf("normals of planes, worst error in degrees (share of normals_slope_error's promise)\n");
    for (const Subject& subject : cameras()) {
        PlaneErrors neighbours, least_squares;
        for (const double tilt : {0.0, 30.0, 60.0, 75.0, 85.0}) {
            for (const double around : {0.0, 77.0, 200.0}) {
                // The scene's world has the OpenGL axes, the result the projection's own.
                const Vector3d normal(std::sin(tilt * degree) * std::cos(around * degree),
                                      std::sin(tilt * degree) * std::sin(around * degree), std::cos(tilt * degree));
                const scene::Rendered truth =
                    scene::render({scene::Plane{{0, 0, -subject.distance}, normal}}, subject.camera);
                const auto arithmetic = tilt == 30 ? Arithmetic::two_float : Arithmetic::fp64;
                const StoredDepth stored = stored_of(truth.stored, subject.camera, Storage::float32, arithmetic);
                const Result nearest = normals_of(stored, {.method = NormalMethod::neighbours});
                const Result fitted = normals_of(stored, {.method = NormalMethod::least_squares});
                CHECK(well_formed(nearest));
                CHECK(well_formed(fitted));
                judge_plane(truth, subject.camera, nearest, normals_reach_neighbours, neighbours);
                judge_plane(truth, subject.camera, fitted, normals_reach_least_squares, least_squares);
            }
        }
        std::printf("  %-22s neighbours %.2e (%.3f)   least squares %.2e   %ld pixels\n", subject.name,
                    neighbours.worst, neighbours.share, least_squares.worst, neighbours.pixels);
        INFO(subject.name);
        CHECK(neighbours.pixels > 60000);
        CHECK(neighbours.worst <= plane_error_deg);
        CHECK(neighbours.share <= 1);
        CHECK(least_squares.worst <= plane_error_deg);
    }
}
