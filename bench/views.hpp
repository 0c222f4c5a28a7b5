#pragma once

#include "oracle.hpp"
#include "scene/scene.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace fathom::bench {

/// Vertical angle of the perspectives but the mirror's, radians.
inline constexpr double view_fov_y = 0.9;

/// An analytic scene through a camera that is known to the last bit: what errors are measured on.
struct View {
    std::string name;
    scene::Scene scene;
    oracle::Subject subject; ///< the camera, and the truth about its depth
    double check;            ///< side of a square of its checkered surfaces, scene units
    bool closed;             ///< no pixel is background

    const Camera& camera() const { return subject.camera; }
};

/// A room; hills under an infinite reversed perspective; thin bars; spheres on a plane; a corridor, far/near 10⁵; the room
/// in a mirror, whose near plane is oblique; its plan, orthographic from above.
std::vector<View> views(int width, int height);

/// The first of them.
View room_view(int width, int height);

/// The ordinary perspectives among them, in OpenCV's axes: what other libraries' pinholes see.
std::vector<View> pinhole_views(int width, int height);

/// Linear red, green and blue of a surface in world space: a checker pattern, lit from above. No primitive has its own
/// colour.
Eigen::Vector3d color_of(const View& view, const Eigen::Vector3d& position, const Eigen::Vector3d& normal);
Eigen::Vector3d sky_color();

} // namespace fathom::bench
