#pragma once

// Cameras that more than one operation is judged with.

#include "oracle.hpp"

#include <fathom/fathom.hpp>

#include <string>
#include <utility>
#include <vector>

namespace oracle {

inline constexpr fathom::DepthOrder orders[] = {fathom::DepthOrder::standard, fathom::DepthOrder::reversed};

inline const std::pair<const char*, fathom::Convention> conventions[] = {{"OpenGL", fathom::Convention::opengl()},
                                                                         {"Direct3D", fathom::Convention::direct3d()},
                                                                         {"Vulkan", fathom::Convention::vulkan()}};

inline constexpr fathom::Encoding encodings[] = {fathom::Encoding::window,       fathom::Encoding::view_z,
                                                 fathom::Encoding::ray_distance, fathom::Encoding::linear,
                                                 fathom::Encoding::logarithmic,  fathom::Encoding::exponential,
                                                 fathom::Encoding::median,       fathom::Encoding::pseudo_linear,
                                                 fathom::Encoding::inverse,      fathom::Encoding::inverse_range};

/// Names a subject: what it is, its convention and its range of depths.
std::string text_of(const char* what, const char* convention, fathom::DepthSpan span);

/// The subject with another encoding, near 0.1, far 1e4, median 4.
Subject encoded(Subject subject, fathom::Encoding encoding, double scale = 0.001);

/// An ordinary perspective with that encoding.
Subject encoded(fathom::Encoding encoding, double scale = 0.001);

/// Cameras whose distance is measured along the ray, from the near plane, or with an offset.
std::vector<Subject> of_every_measure();

/// A plane given for a camera that looks along -z, in the axes of a convention.
Eigen::Vector4d in_axes(Eigen::Vector4d plane, const fathom::Convention& convention);

/// An oblique near plane, given at near = 1, over a perspective that is off-centre.
Subject oblique_perspective(Eigen::Vector4d plane, fathom::DepthSpan span, const fathom::Convention& convention);

/// An oblique near plane over orthographic rays.
Subject oblique_orthographic(const Eigen::Vector4d& plane, fathom::DepthSpan span, const char* name,
                             const fathom::Convention& convention);

/// A camera of every form and encoding.
std::vector<Subject> of_every_encoding();

/// Cameras whose depth is decoded in one way.
struct Family {
    std::string name;
    std::vector<Subject> subjects;
};

/// Every form in every convention, order and range of depths, infinite ones included, and every encoding with its numbers.
std::vector<Family> families();

double half_value(std::uint16_t bits);

} // namespace oracle
