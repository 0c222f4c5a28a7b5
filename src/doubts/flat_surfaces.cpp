// Over a flat surface 1/z is affine in the pixel under a perspective, and z is under an orthographic camera. Few surfaces
// that are bent look flat under a wrong encoding, so that the encoding under which many are flat is the right one.
//
// `rank_encodings` asks the same without a camera. It searches the angle of view, near and far, which takes as long as a whole
// command does. Here the camera says them, so that a few crosses of nine pixels are enough.
#include "doubts/look.hpp"
#include "doubts/plane_fits.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fathom {
namespace {

constexpr double flatter = 0.1;        // a description under which a cross is bent so much less wins this cross
constexpr double flat_enough = 0.035;  // if it is bent no more than so much of its rise; noise is bent more
constexpr std::size_t few_places = 24; // may win by chance
constexpr std::size_t least_part = 50; // one in so many has to speak for the other description
constexpr std::size_t to_one = 9;      // and so many where one speaks against it
constexpr double many_steps = 16;      // of the storage, over which a cross has to rise

using CrossFloats = std::array<float, Cross::size>;

// What the stored values could be instead of what the camera says.
struct Alternative {
    Shape shape;
    double parameter; ///< the rays of a cross are those of the camera
    std::string meaning;
    std::size_t flat = 0; ///< crosses where it is much flatter than the camera's own
};

// Along the row and along the column.
double rise_of(const auto& q) {
    return static_cast<double>(std::abs(q[4] - q[0]) + std::abs(q[8] - q[5]));
}

std::vector<Alternative> alternatives(const Camera& camera, Storage storage, bool perspective) {
    if (!perspective)
        return {{Shape::reciprocal, 0, "distances of a perspective camera; is this its projection"}};
    std::vector<Alternative> result;
    if (camera.along == Along::ray || (camera.encoding != Encoding::window && camera.encoding != Encoding::inverse &&
                                       camera.encoding != Encoding::inverse_range))
        result.push_back({Shape::affine, 0,
                          "depth-buffer values or 1/z (\"encoding\": \"window\" or \"inverse\"), or come from an "
                          "orthographic camera; are they"});
    if (camera.encoding != Encoding::view_z)
        result.push_back({Shape::reciprocal, 0, "distances along the view axis (\"encoding\": \"view-z\"); are they"});
    if (camera.encoding != Encoding::ray_distance)
        result.push_back({Shape::ray, 1, "distances along the rays (\"encoding\": \"ray-distance\"); are they"});
    if (camera.encoding != Encoding::linear && camera.near_plane && camera.far_plane &&
        std::isfinite(*camera.far_plane))
        result.push_back({Shape::offset,
                          *camera.near_plane * storage_max(storage) / (*camera.far_plane - *camera.near_plane),
                          "linear from near to far (\"encoding\": \"linear\"); are they"});
    return result;
}

} // namespace

std::optional<std::string> flat_surfaces_doubt(const Subject& subject) {
    const Camera& camera = subject.camera;
    const Storage storage = subject.storage;
    const DepthForm form = depth_form(camera, storage);
    const bool of_pixel = // the values themselves change across the image, and z has more rounding than they have
        form.numerator[1] != 0 || form.numerator[2] != 0 || form.denominator[1] != 0 || form.denominator[2] != 0;
    const bool packed = pixel_bytes(storage) == 3 || storage == Storage::uint24_high; // elements are no numbers
    if (of_pixel || packed || camera.encoding == Encoding::pseudo_linear)             // which is bent inside triangles
        return std::nullopt;
    const Shape own_shape = form.perspective ? Shape::reciprocal : Shape::affine;
    const ValueChanges& near = subject.changes;
    const float least =
        storage == Storage::float16 ? std::max(near.least_second, near.highest * 0x1p-11f) : near.least_second;
    // A second difference is no smaller than a step, unless it is 0.
    const double step = std::isfinite(least) ? static_cast<double>(least) : 0;
    const Rays rays = form.perspective ? camera_rays(camera) : Rays{};
    const Eigen::Matrix3d direction = rays.direction.cast<double>();
    const Eigen::RowVector3d ahead = rays.depth.cast<double>();
    // How far a quantity is from a plane, of its rise. All pixels count alike, so that a cross over an edge is bent under every
    // description. NaN where it does not rise, or is unknown.
    const auto bend = [&](const Cross& cross, const CrossFloats& values, Shape shape, double parameter) {
        std::array<PlaneSample, Cross::size> samples;
        std::array<double, Cross::size> quantity;
        for (std::size_t i = 0; i < Cross::size; ++i) {
            samples[i] = {0, 0, Cross::across[i] / 2.0, Cross::down[i] / 2.0, static_cast<double>(values[i])};
            if (shape == Shape::ray) {
                const Eigen::Vector3d pixel(cross.x[i] + 0.5, cross.y[i] + 0.5, 1),
                    ray = direction * pixel / ahead.dot(pixel);
                samples[i].x = ray.x();
                samples[i].y = ray.y();
            }
            samples[i].v = quantity[i] = affine_over_planes(shape, parameter, samples[i]);
        }
        return misfit(samples, Shape::affine, 0) / rise_of(quantity);
    };
    const auto bend_under = [&](const Cross& cross, const Alternative& other) {
        return bend(cross, cross.values, other.shape, other.parameter);
    };

    std::vector<std::pair<const Cross*, double>> places; // and how bent they are
    std::vector<Alternative> others = alternatives(camera, storage, form.perspective);
    for (const Cross& cross : subject.crosses) {
        const double rise = rise_of(cross.values),
                     rounding = std::max(step, 0x1p-23 * std::abs(static_cast<double>(cross.values[2])));
        if (!(rise >= many_steps * rounding))
            continue;
        const double own = bend(cross, cross.z, own_shape, 0);
        if (!std::isfinite(own))
            continue;
        places.emplace_back(&cross, own);
        const double noise =
            0.55 * rounding / rise + 0x1p-24 * std::abs(static_cast<double>(cross.z[2])) / rise_of(cross.z);
        if (own <= noise)
            continue;
        for (Alternative& other : others)
            other.flat += bend_under(cross, other) < std::min(flat_enough, flatter * own);
    }
    const auto best = std::ranges::max_element(others, {}, &Alternative::flat);
    if (best == others.end() || best->flat < few_places || least_part * best->flat < places.size())
        return std::nullopt;
    const auto against = static_cast<std::size_t>(std::ranges::count_if(
        places, [&](const auto& place) { return place.second < flatter * bend_under(*place.first, *best); }));
    if (best->flat <= to_one * against)
        return std::nullopt;
    return text("flat surfaces are bent as \"", to_string(camera.encoding), "\" has it, and flat if the values are ",
                best->meaning, "? fathom inspect shows more");
}

} // namespace fathom
