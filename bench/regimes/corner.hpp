#pragma once

// A corner whose depth, normals, visibility and circles of confusion are all known in closed form.

#include "regimes/regime.hpp"

#include "scene/scene.hpp"

#include <fathom/fathom.hpp>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace fathom::regimes {

inline constexpr int corner_width = 160, corner_height = 120;
inline constexpr double corner_depth = 20, corner_radius = 3;

/// Two planes that meet at a right angle in an upright edge, 20 before the camera, and face it: z = 20 - |x - edge|.
/// The truth is the ray caster's z and normals; V = 1 - (a - sin a cos a)/pi with cos a = d/radius at the distance d
/// from the edge.
class Corner {
public:
    /// Judged are pixels whose x is at least `from`.
    explicit Corner(const Camera& camera, double edge = 0, double from = -std::numeric_limits<double>::infinity());

    const Camera& camera() const { return camera_; }
    const scene::Rendered& truth() const { return truth_; }
    static SsaoOptions options(); ///< that the visibility is meant for

    bool judged(std::size_t i) const { return truth_.position[i].x() >= from_; }
    bool away_from_edges(int x, int y) const;                          ///< by as much as a window of normals needs
    double normals_off(const std::vector<float>& normals) const;       ///< largest, degrees
    double visibility_off(const std::vector<float>& visibility) const; ///< root of the mean square within the radius

private:
    Camera camera_;
    double edge_, from_;
    scene::Rendered truth_;
};

/// What depth is stored in.
struct Buffer {
    int bits;            ///< of an integer; 32: a float
    bool known = true;   ///< to the library; otherwise it takes them for floats
    bool packed = false; ///< 24 bits in three bytes
};

/// Largest errors over the image, but for the visibility's, and their bounds.
struct CornerErrors {
    double depth = 0, depth_bound = 0;   ///< relative to z
    double normal = 0, normal_bound = 0; ///< degrees, of neighbours
    double fitted = 0;                   ///< degrees, of least squares
    double visibility = 0;
    double circle = 0, circle_bound = 0; ///< pixels
};

/// Of a corner whose camera stores a perspective in the window encoding.
CornerErrors corner_errors(const Device& device, const Corner& corner, Buffer buffer,
                           const CircleOfConfusion& lens = {.k = 20, .g = 200});

/// What a plane that nothing rises above loses of its visibility of 1: root of the mean square. It passes the corner's edge
/// and is turned by 30 degrees.
double plane_lost(const Device& device, const Camera& camera, Buffer buffer);

/// The four quantities that a regime shows of them.
namespace quantity {
inline constexpr const char* depth = "largest error of z, relative";
inline constexpr const char* normal = "largest error of normals, degrees";
inline constexpr const char* visibility = "error of visibility, rms";
inline constexpr const char* circle = "largest error of circles, pixels";
} // namespace quantity

/// One point of each of these curves; normals of neighbours.
void add(Regime& regime, const std::string& curve, double parameter, const CornerErrors& errors);

} // namespace fathom::regimes
