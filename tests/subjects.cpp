#include "subjects.hpp"

#include <array>
#include <cmath>
#include <functional>
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

namespace {

constexpr double ratios[] = {2, 10, 1e3, 1e6, 1e9};

// Every convention, order and range of depths, infinite ones included, as `make` builds them.
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

std::vector<Subject> of_ranges(const std::vector<std::array<double, 2>>& ranges, const std::vector<double>& fars) {
    std::vector<Subject> subjects;
    for (const auto& range : ranges)
        for (const DepthOrder order : orders)
            for (const double far : fars) {
                subjects.push_back(named(from_edges({-0.1, 0.3, -0.2, 0.1}, {0.1, far, order}),
                                         text_of("depth range", "", {range[0], range[1], order})));
                subjects.back().camera.depth_range = range;
            }
    return subjects;
}

std::vector<Subject> orthographics() {
    std::vector<Subject> subjects;
    for (const auto& [name, convention] : conventions)
        for (const DepthOrder order : orders)
            for (const auto& [near, far] : {std::pair{0.1, 1e8},
                                            {1e-6, 1e3},
                                            {-5.0, 20.0},
                                            {-0.1, 1e6},
                                            {-0.000180465, 521.376},
                                            {20.0, -5.0},
                                            {0.0, 1.0},
                                            {-1e6, 1e6},
                                            {1e6, 1e6 + 1},
                                            {-3.0, -2.0}}) {
                const DepthSpan span{near, far, order};
                subjects.push_back(
                    named(from_orthographic({-5, 7, -4, 3}, span, convention), text_of("orthographic", name, span)));
            }
    return subjects;
}

std::vector<Subject> oblique_orthographics() {
    std::vector<Subject> subjects;
    for (const auto& [name, convention] : conventions)
        for (const DepthOrder order : orders)
            for (const auto& [near, far] : {std::pair{0.1, 1e8}, {-5.0, 20.0}, {1e-6, 1e3}, {-1e4, 1e4}, {-1e6, 1e6}}) {
                const DepthSpan span{near, far, order};
                subjects.push_back(oblique_orthographic({0.3, -0.2, -1, -2}, span, name, convention));
                subjects.push_back(oblique_orthographic({1, 1, -0.1, 3}, span, name, convention));
            }
    return subjects;
}

void add_matrices(std::vector<Family>& families) {
    Family reciprocal{"reciprocal of a matrix", {}}, rational{"rational", {}};
    for (const double ratio : ratios)
        for (const double near : {0.1, 1e-6, 1e3}) {
            const Eigen::Matrix4d matrix = perspective_matrix(0.7, 0.5, near, near * ratio);
            const std::string name = text_of("matrix", "", {near, near * ratio});
            reciprocal.subjects.push_back(named(from_matrix(matrix), name));
            for (const auto& [how, other] : {std::pair{" tilted", tilted(matrix, 0.2, -0.1)},
                                             {" centre moved ahead", moved(matrix, {3 * near, near, -2 * near})},
                                             {" centre moved back", moved(matrix, {0, near, 0.3 * near})}})
                rational.subjects.push_back(named(from_matrix(other), name + how));
        }
    families.push_back(reciprocal);
    families.push_back(rational);
}

// With the numbers of their encodings.
void add_encodings(std::vector<Family>& families) {
    const Subject plain = from_field_of_view(1, 1.5, {0.1, 100});
    Family median{"median", {}}, metric{"linear, view-z, inverse", {}}, exponential{"exponential", {}};
    for (const double at : {1e-6, 0.1, 4.0, 1e6})
        for (const auto& range : {std::array{0.0, 1.0}, std::array{-1.0, 1.0}, std::array{1.0, 0.0}}) {
            median.subjects.push_back(encoded(named(plain, "median"), Encoding::median, 1));
            median.subjects.back().camera.median = at;
            median.subjects.back().camera.depth_range = range;
        }
    for (const Encoding encoding : {Encoding::linear, Encoding::pseudo_linear})
        for (const auto& [near, far] :
             {std::pair{0.0, 3.0}, {1e-6, 3.000002}, {0.1, 3.2}, {1e6, 2e6 + 3}, {0.1, 1e8}}) {
            metric.subjects.push_back(encoded(named(plain, to_string(encoding)), encoding, 1));
            metric.subjects.back().camera.near_plane = near;
            metric.subjects.back().camera.far_plane = far;
        }
    for (const Encoding encoding : {Encoding::view_z, Encoding::inverse})
        for (const double scale : {1.0, 0.001, 1e6, 0.1234567})
            metric.subjects.push_back(encoded(named(plain, to_string(encoding)), encoding, scale));
    for (const auto& range : {std::array{0.0, 1.0}, std::array{1.0, 0.0}, std::array{-1.0, 1.0}})
        for (const double ratio : ratios)
            for (const double c : {1.0, 0.001, 1e4})
                for (const Encoding encoding : {Encoding::logarithmic, Encoding::exponential}) {
                    const bool is_logarithmic = encoding == Encoding::logarithmic;
                    Subject subject = encoded(named(plain, text_of(to_string(encoding), "", {c, ratio})), encoding, 1);
                    subject.camera.depth_range = range;
                    subject.camera.log_c = c;
                    subject.camera.near_plane = c;
                    subject.camera.far_plane = is_logarithmic ? ratio : c * ratio;
                    exponential.subjects.push_back(subject);
                }
    families.insert(families.end(), {median, metric, exponential});
}

std::vector<Subject> along_rays() {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const DepthSpan span{0.1, 1e4};
    const Eigen::Matrix4d matrix = perspective_matrix(0.7, 0.5, 0.1, 1e4);
    std::vector<Subject> subjects;
    for (const auto& [name, subject] :
         {std::pair{"perspective", from_field_of_view(1.1, 1.5, span)},
          {"166 degrees", from_field_of_view(2.9, 1, span)},
          {"reversed", from_field_of_view(1.1, 1.5, {0.1, infinity, DepthOrder::reversed}, Convention::vulkan())},
          {"crop far outside", from_edges({3, 3.1, -7, -6.9}, span, Convention::direct3d())},
          {"orthographic", from_orthographic({-5, 7, -4, 3}, span)},
          {"matrix", from_matrix(matrix)},
          {"tilted", from_matrix(tilted(matrix, 0.2, -0.1))},
          {"centre moved sideways", from_matrix(moved(matrix, {3, 1, 0}))},
          {"centre moved ahead", from_matrix(moved(matrix, {3, 1, -2}))},
          {"centre moved back", from_matrix(moved(matrix, {3, 1, 2}))}})
        for (const double scale : {1.0, 0.001})
            subjects.push_back(encoded(named(subject, name), Encoding::ray_distance, scale));
    return subjects;
}

} // namespace

std::vector<Family> families() {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::vector<Family> all{
        {"reciprocal", everywhere("perspective",
                                  [](DepthSpan span, Convention convention) {
                                      return from_field_of_view(1.1, 1.5, span, convention);
                                  })},
        {"depth range", of_ranges({{1, 0}, {-1, 1}, {0, 0.5}, {-1, 0.25}}, {1e4})},
        // Ends that are no floats, or lie away from zero.
        {"uneven depth range", of_ranges({{0.1, 0.9}, {0.25, 0.75}, {0.9, 0.1}, {3, 7.5}}, {5, 1e5, infinity})},
        {"affine", orthographics()},
        {"affine with x and y", oblique_orthographics()},
        {"ray distance", along_rays()},
        {"measures", of_every_measure()}};
    for (const Eigen::Vector4d& tilt :
         {Eigen::Vector4d(0.1, -0.2, -1, -2), Eigen::Vector4d(0.6, 0.5, -0.7, -1.2), Eigen::Vector4d(0, 0, -1, -1.5)})
        all.push_back({"reciprocal-affine " + std::to_string(tilt[0]),
                       everywhere("oblique", [&](DepthSpan span, Convention convention) {
                           return oblique_perspective(tilt, span, convention);
                       })});
    add_matrices(all);
    add_encodings(all);
    return all;
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
