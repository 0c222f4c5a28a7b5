// Over a flat surface 1/z is affine in the pixel under a perspective, and z is under an orthographic camera. Few surfaces
// that are bent look flat under a wrong encoding, so that the encoding under which many are flat is the right one.
//
// `rank_encodings` asks the same without a camera. It searches the angle of view, near and far, which takes as long as a whole
// command does. Here the camera says them, so that a few crosses of nine pixels are enough.
#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/plane_fits.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace fathom {
namespace {

constexpr double flatter = 0.1;        // a description under which a cross is bent so much less wins this cross
constexpr double flat_enough = 0.035;  // if it is bent no more than so much of its rise; noise is bent more
constexpr std::size_t few_places = 24; // may win by chance
constexpr std::size_t least_part = 50; // one in so many has to speak for the other description
constexpr std::size_t to_one = 9;      // and so many where one speaks against it
constexpr double rounded = 0.55;       // of a step: no flat surface is bent more by the storage's rounding

constexpr float edge = 4; // times: no surface rises so much within a cross
// What the stored values could be instead of what the camera says.
struct Alternative {
    Shape shape;
    double parameter; ///< the rays of a cross are those of the camera
    std::string meaning;
    std::size_t flat = 0;    ///< crosses where it is much flatter than the camera's own
    std::size_t against = 0; ///< and where it is bent much more
};

// Along the row and along the column.
double rise_of(const std::array<float, Cross::size>& v) {
    return static_cast<double>(std::abs(v[4] - v[0]) + std::abs(v[8] - v[5]));
}

// The value of all crosses that is farthest away, with the sign that makes it the greatest.
float farthest_of(const std::vector<Cross>& crosses, float sign) {
    float farthest = -std::numeric_limits<float>::infinity();
    for (const Cross& cross : crosses)
        for (const float value : cross.values)
            if (std::isfinite(value))
                farthest = std::max(farthest, sign * value);
    return farthest;
}

// What the camera makes of a value: 1/z under a perspective and z under an orthographic camera. In double, and not in the floats
// of the decoded image, whose rounding bends what is flat.
class Decoder {
public:
    Decoder(const Camera& camera, const DepthForm& form) : form_(form), along_ray_(is_along_ray(form)) {
        if (!form.perspective)
            return;
        const Rays rays = camera_rays(camera);
        direction_ = rays.direction.cast<double>();
        ahead_ = rays.depth.cast<double>();
        centre_ = static_cast<double>(rays.centre_depth);
    }

    PlaneSample sample(const Cross& cross, std::size_t i) const {
        const Eigen::Vector3d pixel(cross.x[i] + 0.5, cross.y[i] + 0.5, 1),
            ray = direction_ * pixel / ahead_.dot(pixel);
        return {ray.x(), ray.y(), Cross::across[i] / 2.0, Cross::down[i] / 2.0, static_cast<double>(cross.values[i])};
    }

    PlaneQuantity quantity(const PlaneSample& at) const {
        const auto value = [](const Affine& row, double v) {
            return static_cast<double>(row[0]) * v + static_cast<double>(row[3]);
        };
        double z, change; // of z with the value
        if (form_.form == Form::exponential) {
            const double rate = std::numbers::ln2 * static_cast<double>(form_.rate),
                         power = std::expm1(rate * at.v + std::numbers::ln2 * static_cast<double>(form_.start)),
                         amplitude = static_cast<double>(form_.amplitude);
            z = amplitude * power + static_cast<double>(form_.offset);
            change = amplitude * rate * (power + 1);
        } else {
            const double above = value(form_.numerator, at.v), below = value(form_.denominator, at.v);
            z = above / below;
            change = (static_cast<double>(form_.numerator[0]) - static_cast<double>(form_.denominator[0]) * z) / below;
            if (along_ray_) {
                const double stretch = std::sqrt(1 + at.x * at.x + at.y * at.y);
                z = z / stretch + static_cast<double>(form_.offset);
                change /= stretch;
            }
        }
        if (!form_.perspective)
            return {z, 1 / change};
        z -= centre_;
        return {1 / z, -z * z / change};
    }

private:
    const DepthForm& form_;
    bool along_ray_;
    Eigen::Matrix3d direction_ = Eigen::Matrix3d::Identity();
    Eigen::RowVector3d ahead_{0, 0, 1};
    double centre_ = 0;
};

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
    const ValueChanges& near = subject.changes;
    const float least =
        storage == Storage::float16 ? std::max(near.least_second, near.highest * 0x1p-11f) : near.least_second;
    // A second difference is no smaller than a step, unless it is 0.
    const double step = std::isfinite(least) ? static_cast<double>(least) : 0;
    const Decoder decoder(camera, form);
    std::vector<Alternative> others = alternatives(camera, storage, form.perspective);
    const float farthest = farthest_of(subject.crosses, form.farther);
    std::size_t places = 0; // that tell two descriptions apart
    for (const Cross& cross : subject.crosses) {
        const auto [low, high] = std::ranges::minmax(cross.values);
        const auto is_finite = [](float v) { return std::isfinite(v); };
        if (!std::ranges::all_of(cross.values, is_finite) || !std::ranges::all_of(cross.z, is_finite))
            continue;
        if (low * high > 0 && edge < std::max(high / low, low / high)) // through which a reciprocal goes too easily
            continue;
        // A sky, or a sensor's farthest distance, is flat under some description, and no surface.
        const bool may_be_sky = low == high && form.farther * low == farthest;
        std::array<PlaneSample, Cross::size> samples;
        std::array<PlaneQuantity, Cross::size> quantities;
        for (std::size_t i = 0; i < Cross::size; ++i) {
            samples[i] = decoder.sample(cross, i);
            quantities[i] = decoder.quantity(samples[i]);
        }
        // How bent it is under each description, in stored units, in which the storage rounds all of them alike: a surface that
        // is seen straight on does not rise at all under the right one. All pixels count alike, so that a cross over an edge is
        // bent under every description.
        const double own = misfit(samples, quantities), rise = rise_of(cross.values),
                     rounding = rounded *
                                std::max(step, 0x1p-23 * static_cast<double>(std::max(std::abs(low), std::abs(high))));
        if (!std::isfinite(own))
            continue;
        bool tells = false;
        for (Alternative& other : others) {
            const double bent = misfit(samples, other.shape, other.parameter);
            const double most = std::min(flatter * own, flat_enough * std::max(rise, own));
            const bool wins = !may_be_sky && own > rounding && bent < most;
            const bool loses = bent > rounding && own < flatter * bent;
            other.flat += wins;
            other.against += loses;
            tells |= own > rounding || bent > rounding;
        }
        places += tells;
    }
    const auto best = std::ranges::max_element(others, {}, &Alternative::flat);
    if (best == others.end() || best->flat < few_places || least_part * best->flat < places ||
        best->flat <= to_one * best->against)
        return std::nullopt;
    return text("flat surfaces are bent as \"", to_string(camera.encoding), "\" has it, and flat if the values are ",
                best->meaning, "? fathom inspect shows more");
}

} // namespace fathom
