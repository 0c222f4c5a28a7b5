#include "subjects.hpp"

#include <cmath>
#include <limits>
#include <sstream>

namespace oracle {

using namespace fathom;

std::string text_of(const char* what, const char* convention, DepthSpan span) {
    std::ostringstream text;
    text << what << ' ' << convention << (span.order == DepthOrder::reversed ? " reversed" : "") << " near "
         << span.near_plane << " far " << span.far_plane;
    return text.str();
}

Subject encoded(Subject subject, Encoding encoding, double scale) {
    subject.camera.encoding = encoding;
    subject.camera.near_plane = 0.1;
    subject.camera.far_plane = 1e4;
    subject.camera.median = 4;
    subject.camera.scale = scale;
    return subject;
}

Subject encoded(Encoding encoding, double scale) {
    return encoded(named(from_field_of_view(1.1, 1.5, {0.1, 1e4}), to_string(encoding)), encoding, scale);
}

Eigen::Vector4d in_axes(Eigen::Vector4d plane, const Convention& convention) {
    if (convention.view_axes != ViewAxes::opengl)
        plane[2] = -plane[2];
    return plane;
}

Subject oblique_perspective(Eigen::Vector4d plane, DepthSpan span, const Convention& convention) {
    plane[3] *= span.near_plane;
    return with_oblique_near_plane(
        from_edges({-0.7 * span.near_plane, 0.9 * span.near_plane, -0.4 * span.near_plane, 0.5 * span.near_plane}, span,
                   convention),
        in_axes(plane, convention));
}

Subject oblique_orthographic(const Eigen::Vector4d& plane, DepthSpan span, const char* name,
                             const Convention& convention) {
    return named(
        with_oblique_near_plane(from_orthographic({-5, 7, -4, 3}, span, convention), in_axes(plane, convention)),
        text_of("oblique orthographic", name, span));
}

std::vector<Subject> of_every_measure() {
    std::vector<Subject> subjects;
    const auto add = [&](const char* name, Subject subject, Along along, double offset, bool from_near_plane) {
        subject.camera.along = along;
        subject.camera.offset = offset;
        subject.camera.from_near_plane = from_near_plane;
        subjects.push_back(named(subject, name));
    };
    const Subject tilt = named(from_matrix(tilted(perspective_matrix(0.7, 0.5, 0.1, 100), 0.2, -0.1)), "tilted");
    const Subject ahead = named(from_matrix(moved(perspective_matrix(0.7, 0.5, 0.1, 1e4), {3, 1, -2})), "moved");
    using enum Encoding;
    add("inverse, offset", encoded(inverse), Along::axis, 3.7, false);
    add("inverse, negative offset", encoded(inverse), Along::axis, -0.3, false);
    add("linear along the ray", encoded(linear), Along::ray, 0, false);
    add("inverse along the ray", encoded(inverse), Along::ray, 0, false);
    add("inverse with an offset along the ray", encoded(inverse, 80), Along::ray, 2.5, false);
    add("inverse range along the ray", encoded(inverse_range), Along::ray, 0, false);
    add("inverse range along tilted rays", encoded(tilt, inverse_range), Along::ray, 0, false);
    add("inverse range along rays of a centre ahead", encoded(ahead, inverse_range), Along::ray, 0, false);
    add("linear along tilted rays", encoded(tilt, linear), Along::ray, 0, false);
    add("ray distance from the near plane", encoded(ray_distance), Along::axis, 0, true);
    add("view-z backwards", encoded(view_z, -0.001), Along::axis, 0, false);
    add("view-z backwards, orthographic", encoded(named(from_orthographic({-5, 7, -4, 3}, {-3, 100}), ""), view_z, -1),
        Along::axis, 0, false);
    add("ray distance backwards", encoded(ray_distance, -0.3), Along::axis, 0, false);
    add("ray distance backwards from the near plane", encoded(ray_distance, -0.001), Along::axis, 0, true);
    add("inverse backwards", encoded(inverse, -0.001), Along::axis, 0, false);
    add("inverse backwards, offset", encoded(inverse, -351.3), Along::axis, -1092.5, false);
    add("inverse backwards along the ray", encoded(inverse, -0.001), Along::ray, 0, false);
    add("inverse backwards with an offset along the ray", encoded(inverse, -80), Along::ray, -250, false);
    return subjects;
}

std::vector<Subject> of_every_encoding() {
    std::vector<Subject> subjects;
    for (const Encoding encoding : encodings)
        subjects.push_back(encoded(encoding));
    for (const Subject& subject : of_every_measure())
        subjects.push_back(subject);
    const DepthSpan reversed{0.1, std::numeric_limits<double>::infinity(), DepthOrder::reversed};
    subjects.push_back(named(from_field_of_view(1, 1, reversed, Convention::vulkan()), "reversed"));
    subjects.push_back(
        named(with_oblique_near_plane(from_field_of_view(1, 1, {0.1, 100}), {0.3, 0.2, -1, -0.2}), "oblique"));
    subjects.push_back(named(from_orthographic({-5, 7, -4, 3}, {-3, 100}), "orthographic"));
    subjects.push_back(oblique_orthographic({0.3, -0.2, -1, -2}, {-3, 100}, "OpenGL", {}));
    subjects.push_back(named(from_matrix(tilted(perspective_matrix(0.7, 0.5, 0.1, 100), 0.2, -0.1)), "tilted"));
    return subjects;
}

std::vector<Subject> everywhere(const char* what, const std::function<Subject(DepthSpan, Convention)>& make) {
    constexpr double nears[] = {0.1, 1e-6, 3.7, 1e3, 0.01};
    std::vector<Subject> subjects;
    for (const auto& [name, convention] : conventions)
        for (const DepthOrder order : orders)
            for (std::size_t i = 0; i <= std::size(ratios); ++i) {
                const bool infinite = i == std::size(ratios);
                const double near = nears[i % std::size(nears)];
                const double far = infinite ? std::numeric_limits<double>::infinity() : near * ratios[i];
                const DepthSpan span{near, far, order};
                subjects.push_back(named(make(span, convention), text_of(what, name, span)));
            }
    return subjects;
}

double half_value(std::uint16_t bits) {
    const int exponent = (bits >> 10) & 31, fraction = bits & 1023;
    const double sign = (bits & 0x8000) != 0 ? -1 : 1;
    if (exponent == 31)
        return fraction == 0 ? sign * std::numeric_limits<double>::infinity()
                             : std::numeric_limits<double>::quiet_NaN();
    return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(fraction + 1024, exponent - 25));
}

} // namespace oracle
