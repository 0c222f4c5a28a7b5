#pragma once

#include <fathom/camera.hpp>
#include <fathom/precision.hpp>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

/// Analytic scenes, ray-cast in double through any camera: depth images whose truth is known.
/// Shares no code with the library: rays come from the inverse projection, stored values from their definitions.
namespace fathom::scene {

/// Infinite plane through `point`.
struct Plane {
    Eigen::Vector3d point, normal;
};

struct Sphere {
    Eigen::Vector3d centre;
    double radius;
};

/// Flat disk.
struct Disk {
    Eigen::Vector3d centre, normal;
    double radius;
};

/// Box turned about the y axis by `yaw` radians.
struct Box {
    Eigen::Vector3d centre, half_size;
    double yaw = 0;
};

/// Hills where |x|, |z| ≤ half_size: y = base + Σ amplitude · sin(kx x + kz z + phase).
struct HeightField {
    struct Wave {
        double amplitude, kx, kz, phase;
    };
    double base, half_size;
    std::vector<Wave> waves;
};

/// Hollow cap of a sphere: its points no higher than `depth` above the lowest one, where `axis` points out of the hollow.
struct Bowl {
    Eigen::Vector3d centre; ///< of the sphere
    double radius;
    Eigen::Vector3d axis; ///< unit length
    double depth;         ///< at most the diameter
};

using Primitive = std::variant<Plane, Sphere, Disk, Box, HeightField, Bowl>;

/// Primitives in world space: right-handed, y up. Without a view matrix the world is the view space of the OpenGL axes,
/// so the named scenes lie around the −z axis.
using Scene = std::vector<Primitive>;

Scene room();     ///< closed room, 8 × 3 × 10, with table, shelves, a sphere: z from 1 to 10
Scene spheres();  ///< spheres resting on a plane, open sky
Scene corridor(); ///< 60 long, with door frames: grazing walls and a far end
Scene railings(); ///< thin bars before a wall: edges everywhere
Scene terrain();  ///< hills up to 400 away
Scene slant();    ///< one slanted plane that fills the image

/// Names of the above, and the scene of a name. Throws: std::invalid_argument naming the scenes that exist.
const std::vector<std::string>& names();
Scene named(const std::string& name);

/// What one pixel's ray sees.
struct Surface {
    Eigen::Vector3d position; ///< view space, in the projection's own axes
    Eigen::Vector3d normal;   ///< unit length, towards the camera, same axes
    double z;                 ///< distance along the view axis, positive in front of the camera
    double stored;            ///< value that the camera's encoding gives it, before rounding
};

/// The surface at a pixel position (centres are at +½, rows counted as stored); nothing where the ray meets none
/// between the near and the far plane, oblique ones included.
std::optional<Surface> cast(const Scene& scene, const Camera& camera, double x, double y);

/// A line of sight: the points origin + t · direction, in the view volume while first ≤ t ≤ last.
/// Direction is not of unit length. Under a perspective all rays start in the camera centre and the direction is affine in
/// the pixel position; orthographic rays have one direction, and an origin within the view volume that is affine.
struct Ray {
    Eigen::Vector3d origin, direction;
    double first, last;

    Eigen::Vector3d at(double t) const { return origin + t * direction; }
};

/// A scene and a camera taken apart once, for many rays. Keeps copies of both.
class Caster {
public:
    Caster(Scene scene, Camera camera);

    const Scene& scene() const;
    const Camera& camera() const;

    /// The ray of a pixel position: view space, in the projection's own axes, from the camera centre into the scene.
    Ray ray(double x, double y) const;

    /// As `scene::cast`.
    std::optional<Surface> at(double x, double y) const;

private:
    struct Parts;
    std::shared_ptr<const Parts> parts_;
};

/// Does a free ray meet any primitive at a distance in [least, length]? Both sides of a surface block.
/// World space: positions and normals that `cast` returns are view space, and differ where the camera has a view
/// matrix or axes other than OpenGL's. `direction` is of unit length. `least` keeps a ray that starts on a surface from
/// meeting its start.
bool blocked(const Scene& scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
             double length = std::numeric_limits<double>::infinity(), double least = 1e-9);

/// Where a ray meets a scene, in world space. The normal is of unit length and looks against the ray.
struct Met {
    Eigen::Vector3d position, normal;
};

/// The first primitive that a ray of any kind meets between its ends, world space.
std::optional<Met> met(const Scene& scene, const Ray& ray);

/// View space (the projection's own axes) to world.
Eigen::Matrix4d to_world(const Camera& camera);
/// The turns of cameras that look ahead, to the four sides, up and down, so that views of 90 degrees see all directions.
std::array<Eigen::Matrix3d, 6> cube_turns();

/// A rendered image, row-major in the camera's row order. Pixels that see nothing hold the camera's clear value,
/// z = +inf, position NaN and normal 0.
struct Rendered {
    int width = 0;
    int height = 0;
    std::vector<float> stored; ///< rounded to float32
    std::vector<double> exact; ///< the same before rounding
    std::vector<double> z;
    std::vector<Eigen::Vector3d> position;
    std::vector<Eigen::Vector3d> normal;
};

/// Casts one ray through the centre of each of `camera.width` × `camera.height` pixels.
/// A view matrix must be orthogonal (mirror views may reflect).
Rendered render(const Scene& scene, const Camera& camera);

/// The unit ray of a pixel position in view space, or none: what a lens makes of it.
using RayOf = std::function<std::optional<Eigen::Vector3d>(double x, double y)>;

/// The same through a lens that bends rays. Stored are distances along the rays, or along the axis (`view_z`), and NaN where a
/// pixel has no ray.
Rendered render(const Scene& scene, const Camera& camera, const RayOf& ray_of);

/// The stored value that means "nothing here": the camera's, or its encoding's default.
double clear_value(const Camera& camera);

/// Stored values as codes: a normalised encoding times 2^bits − 1, a metric one as it is; rounded to nearest.
std::vector<std::uint16_t> codes16(const Rendered& image, const Camera& camera);
std::vector<std::uint32_t> codes24(const Rendered& image, const Camera& camera);

/// Stored values as a program reads them back from a buffer of these bits: floats on the buffer's grid.
std::vector<float> read_back(const Rendered& image, DepthBits bits);

} // namespace fathom::scene
