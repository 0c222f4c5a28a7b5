// Over a flat surface 1/z is affine in the pixel under a perspective, and z is under an orthographic camera. Few surfaces
// that are bent look flat under a wrong encoding, so that the encoding under which many are flat is the right one.
//
// `rank_encodings` asks the same of such windows without a camera, by the same rule, and searches the angle of view, near and
// far, which takes as long as a whole command does. Here the camera says them.
#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/plane_fits.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <fathom/pixel_rays.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace fathom {
namespace {

constexpr std::size_t few_windows = 12; // may win by chance
constexpr std::size_t to_one = 9;       // and so many where one speaks against it
// One window in so many has to speak for the other description, or it is bent surfaces that do, by chance. Those of an orthographic
// camera, whose only other description is a perspective, do so more often.
constexpr std::size_t least_part = 20, least_part_orthographic = 3;

constexpr float edge = 4;           // times: no surface rises so much within a window
constexpr double smooth_of = 0.03;  // of a window's rise, that a cubic polynomial leaves of a surface at most,
constexpr double little = 1.1;      // times, that noise makes a window's values differ
constexpr double of_rounding = 4;   // times: steps of a smooth surface are no noise, so that bends near them say little
constexpr double alike_noise = 1.5; // or so many times the noise from sample to sample, which an edge has not

// What the stored values could be instead of what the camera says.
struct Alternative {
    Shape shape;
    double parameter; ///< the rays of a sample are those of the camera
    std::string meaning = {};
    bool raw = false;        ///< the rays are those of the raw image, which are bent
    std::size_t places = 0;  ///< windows without an edge that may tell it from what the camera says
    std::size_t flat = 0;    ///< of these, flat with it, and bent as the camera has it
    std::size_t against = 0; ///< and where it is the other way round
};

// What the camera makes of a value: 1/z under a perspective and z under an orthographic camera. In double, and not in the floats
// of the decoded image, whose rounding bends what is flat.
class Decoder {
public:
    Decoder(const Camera& camera, const DepthForm& form) : form_(form), along_ray_(is_along_ray(form)) {
        if (!form.perspective)
            return;
        const Rays rays = straight_rays(camera);
        direction_ = rays.direction.cast<double>();
        ahead_ = rays.depth.cast<double>();
        centre_ = static_cast<double>(rays.centre_depth);
    }

    PlaneSample sample(const Sampled& sampled, int i) const {
        const Eigen::Vector3d pixel(sampled.window.x(i) + 0.5, sampled.window.y(i) + 0.5, 1),
            ray = direction_ * pixel / ahead_.dot(pixel);
        return {ray.x(), ray.y(), sampled.window.u(i), sampled.window.t(i),
                static_cast<double>(sampled.values[static_cast<std::size_t>(i)])};
    }

    PlaneQuantity quantity(const PlaneSample& at) const {
        auto [z, change] = decoded(at.v);
        if (along_ray_) {
            const double stretch = std::sqrt(1 + at.x * at.x + at.y * at.y);
            z = z / stretch + static_cast<double>(form_.offset);
            change /= stretch;
        }
        if (!form_.perspective)
            return {z, 1 / change};
        z -= centre_;
        return {1 / z, -z * z / change};
    }

    // What is stored, along the axis or along the ray, and its change with the value.
    std::array<double, 2> decoded(double v) const {
        const auto value = [](const Affine& row, double v) {
            return static_cast<double>(row[0]) * v + static_cast<double>(row[3]);
        };
        double z, change; // of z with the value
        if (form_.form == Form::exponential) {
            const double rate = std::numbers::ln2 * static_cast<double>(form_.rate),
                         power = std::expm1(rate * v + std::numbers::ln2 * static_cast<double>(form_.start)),
                         amplitude = static_cast<double>(form_.amplitude);
            z = amplitude * power + static_cast<double>(form_.offset);
            change = amplitude * rate * (power + 1);
        } else {
            const double above = value(form_.numerator, v), below = value(form_.denominator, v);
            z = above / below;
            change = (static_cast<double>(form_.numerator[0]) - static_cast<double>(form_.denominator[0]) * z) / below;
        }
        return {z, change};
    }

private:
    const DepthForm& form_;
    bool along_ray_;
    Eigen::Matrix3d direction_ = Eigen::Matrix3d::Identity();
    Eigen::RowVector3d ahead_{0, 0, 1};
    double centre_ = 0;
};

// The image as it was before its distortion was undone: 1/z of a plane is affine in where its rays go, which are bent.
class RawImage {
public:
    RawImage(const Camera& camera, const Decoder& decoder)
        : decoder_(decoder), rays_(raw(camera)), width_(camera.width) {}

    // How bent a window is if it is one of the raw image. None where the image is not distorted enough, or has no rays.
    std::optional<double> misfit_of(const Sampled& sampled) const {
        if (sampled.window.width * least_windows < width_)
            return std::nullopt;
        std::vector<PlaneSample> samples;
        std::vector<PlaneQuantity> quantities;
        for (int i = 0; i < Window::size; ++i) {
            const auto at = static_cast<std::size_t>(i);
            if (!std::isfinite(sampled.values[at]) || !std::isfinite(sampled.z[at]))
                continue;
            const auto ray = rays_.ray_of(sampled.window.x(i) + 0.5, sampled.window.y(i) + 0.5);
            if (!ray || std::abs(ray->z()) < least_ahead)
                return std::nullopt;
            const double x = ray->x() / std::abs(ray->z()), y = ray->y() / std::abs(ray->z());
            samples.push_back({x, y, x, y, static_cast<double>(sampled.values[at])});
            quantities.push_back(decoder_.quantity(samples.back()));
        }
        return misfit(samples, quantities);
    }

private:
    static constexpr int least_windows = 32; // across the image: smaller ones are bent too little
    static constexpr double least_ahead = 0.1;

    static Camera raw(Camera camera) {
        camera.lens = camera.raw_lens;
        return camera;
    }

    const Decoder& decoder_;
    PixelRays rays_;
    int width_ = 0;
};

// Noise from sample to sample, most of which lie beside no edge.
double noise_between(const Sampled& sampled) {
    std::vector<double> seconds;
    for (std::size_t i = 0; i + 2 < Window::size; ++i) {
        const double second = static_cast<double>(sampled.values[i]) - 2 * static_cast<double>(sampled.values[i + 1]) +
                              static_cast<double>(sampled.values[i + 2]);
        if (i % Window::across + 2 < Window::across && std::isfinite(second))
            seconds.push_back(std::abs(second));
    }
    if (seconds.empty())
        return 0;
    const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
    std::ranges::nth_element(seconds, middle);
    return *middle / (0.6745 * std::sqrt(6)); // a normal distribution's median, and variances of 1, 4 and 1
}

std::vector<Alternative> alternatives(const Camera& camera, Storage storage, bool perspective) {
    if (!perspective)
        return {{Shape::reciprocal, 0, "distances of a perspective camera; is this its projection"}};
    std::vector<Alternative> result;
    if (camera.encoding != Encoding::view_z)
        result.push_back({Shape::reciprocal, 0, "distances along the view axis (\"encoding\": \"view-z\"); are they"});
    if (camera.encoding != Encoding::ray_distance)
        result.push_back({Shape::ray, 1, "distances along the rays (\"encoding\": \"ray-distance\"); are they"});
    if (camera.along == Along::ray || (camera.encoding != Encoding::window && camera.encoding != Encoding::inverse &&
                                       camera.encoding != Encoding::inverse_range))
        result.push_back({Shape::affine, 0,
                          "depth-buffer values or 1/z (\"encoding\": \"window\" or \"inverse\"), or come from an "
                          "orthographic camera; are they"});
    if (camera.encoding == Encoding::view_z && camera.near_plane)
        result.push_back({Shape::offset, *camera.near_plane / camera.scale,
                          "distances from the near plane on, so that it has to be added; are they"});
    if (camera.encoding != Encoding::linear && camera.near_plane && camera.far_plane &&
        std::isfinite(*camera.far_plane))
        result.push_back({Shape::offset,
                          *camera.near_plane * storage_max(storage) / (*camera.far_plane - *camera.near_plane),
                          "linear from near to far (\"encoding\": \"linear\"); are they"});
    return result;
}

bool has_few_values(std::span<const Sampled> windows) {
    constexpr std::size_t few = 16;
    std::set<float> values;
    for (const Sampled& sampled : windows)
        for (const float value : sampled.values)
            if (std::isfinite(value) && values.insert(value).second && values.size() > few)
                return false;
    return true;
}

// The descriptions of an image's values, the camera's own first: samples of a window, none where a pixel has no ray, and how bent
// those that were chosen are under each, in stored units.
struct Descriptions {
    using Chosen = std::vector<int>;
    using Samples = std::vector<PlaneSample>;

    std::vector<Alternative> others;
    std::function<std::optional<PlaneSample>(const Sampled& sampled, int i)> sample;
    std::function<std::vector<double>(const Sampled& sampled, const Chosen& chosen, const Samples& samples)> misfits;
};

Descriptions of_straight_rays(const Camera& camera, Storage storage, const Decoder& decoder, bool perspective) {
    std::vector<Alternative> others = alternatives(camera, storage, perspective);
    std::optional<RawImage> raw;
    if (camera.raw_lens && perspective) {
        raw.emplace(camera, decoder);
        others.push_back({.shape = Shape::affine, .parameter = 0, .raw = true});
    }
    return {others, [&decoder](const Sampled& sampled, int i) { return decoder.sample(sampled, i); },
            [others, raw, &decoder](const Sampled& sampled, const Descriptions::Chosen&,
                                    const Descriptions::Samples& samples) {
                std::vector<PlaneQuantity> quantities;
                for (const PlaneSample& each : samples)
                    quantities.push_back(decoder.quantity(each));
                std::vector<double> misfits{misfit(samples, quantities)};
                for (const Alternative& other : others)
                    misfits.push_back(other.raw ? raw->misfit_of(sampled).value_or(misfits.front())
                                                : misfit(samples, other.shape, other.parameter));
                return misfits;
            }};
}

// Through a lens 1/distance is linear in the unit ray u over a plane, so that its quotient by u's part along the ray of the window's
// middle is affine in the place where u meets the plane across that ray.
Descriptions through_lens(const Camera& camera, const Decoder& decoder) {
    struct Place {
        double right, down, straight; // across the middle's ray, and along it
        std::array<double, 3> stored; // the parts along what depth may count along, in the order of Along
    };
    const auto place = [rays = PixelRays(camera), forwards = forwards(camera)](const Window& window,
                                                                               int i) -> std::optional<Place> {
        const auto middle = rays.ray_of(window.left + window.width / 2.0, window.top + window.height / 2.0),
                   ray = rays.ray_of(window.x(i) + 0.5, window.y(i) + 0.5);
        if (!middle || !ray || !(middle->dot(*ray) > 0))
            return std::nullopt;
        const Eigen::Vector3d right = middle->unitOrthogonal(), down = middle->cross(right);
        const double straight = middle->dot(*ray);
        return Place{right.dot(*ray) / straight,
                     down.dot(*ray) / straight,
                     straight,
                     {forwards * ray->z(), 1, ray->cwiseAbs().maxCoeff()}};
    };
    // In the order of Along.
    std::vector<Alternative> others{
        {Shape::reciprocal, 0, "distances along the view axis (\"encoding\": \"view-z\"); are they"},
        {Shape::ray, 1, "distances along the rays (\"encoding\": \"ray-distance\"); are they"},
        {Shape::offset, 0,
         "distances along the axes of a cube's faces (\"encoding\": \"view-z\", \"along\": \"cube\"); are they"}};
    std::vector<std::size_t> order{0, 1, 2}; // the camera's own first
    const auto own = static_cast<std::size_t>(counted_along(camera));
    std::swap(order.front(), order[own]);
    std::swap(others.front(), others[own]);
    others.erase(others.begin());
    return {others,
            [place](const Sampled& sampled, int i) -> std::optional<PlaneSample> {
                const auto at = place(sampled.window, i);
                if (!at)
                    return std::nullopt;
                return PlaneSample{0, 0, at->right, at->down,
                                   static_cast<double>(sampled.values[static_cast<std::size_t>(i)])};
            },
            [place, order, &decoder](const Sampled& sampled, const Descriptions::Chosen& chosen,
                                     const Descriptions::Samples& samples) {
                std::array<std::vector<PlaneQuantity>, 3> quantities; // in the order of Along
                for (std::size_t i = 0; i < samples.size(); ++i) {
                    const Place at = *place(sampled.window, chosen[i]);
                    const auto [length, change] = decoder.decoded(samples[i].v);
                    for (std::size_t along = 0; along < quantities.size(); ++along) {
                        const double inverse = at.stored[along] / (at.straight * length);
                        quantities[along].push_back({inverse, -length / (inverse * change)});
                    }
                }
                std::vector<double> misfits;
                for (const std::size_t along : order)
                    misfits.push_back(misfit(samples, quantities[along]));
                return misfits;
            }};
}

// How bent a window is under each description, in stored units, in which the storage rounds all of them alike: a surface that is
// seen straight on does not rise at all under the right one.
struct WindowBends {
    std::vector<double> misfits;
    double rest = 0, rounded = 0; // what a cubic polynomial leaves, and what rounding does
    double low = 0, high = 0;     // the values' ends
};

// None where no surface without an edge tells the descriptions apart.
std::optional<WindowBends> bends_of(const Sampled& sampled, const Descriptions& descriptions,
                                    const Rounding& rounding) {
    Descriptions::Samples samples;
    Descriptions::Chosen chosen;
    for (int i = 0; i < Window::size; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (!std::isfinite(sampled.values[at]) || !std::isfinite(sampled.z[at]))
            continue;
        if (const auto sample = descriptions.sample(sampled, i)) {
            samples.push_back(*sample);
            chosen.push_back(i);
        }
    }
    if (static_cast<double>(samples.size()) < least_samples)
        return std::nullopt;
    const auto [first, last] = std::ranges::minmax(samples, {}, &PlaneSample::v);
    const double low = first.v, high = last.v;
    if (low * high > 0 && edge < std::max(high / low, low / high)) // through which a reciprocal goes too easily
        return std::nullopt;
    const std::vector<double> misfits = descriptions.misfits(sampled, chosen, samples);
    const double rounded = rounding.in(samples);
    if (!std::isfinite(misfits.front()))
        return std::nullopt;
    const auto [least_bent, most_bent] = std::ranges::minmax(misfits);
    if (!(most_bent > of_known.apart * std::max(least_bent, rounded)))
        return std::nullopt;
    const double rest = cubic_misfit(samples);
    const bool is_noise = low * high > 0 && std::max(high / low, low / high) < little && // or bars before a wall are
                          rest <= alike_noise * noise_between(sampled);
    if (!is_noise && rest > std::max(smooth_of * (high - low), of_known.flat * rounded))
        return std::nullopt;
    return WindowBends{misfits, rest, rounded, low, high};
}

} // namespace

std::optional<std::string> flat_surfaces_doubt(const Subject& subject) {
    const Camera& camera = subject.camera;
    const Storage storage = subject.storage;
    const DepthForm form = depth_form(straightened(camera), storage);
    const bool of_pixel = // the values themselves change across the image, and z has more rounding than they have
        form.numerator[1] != 0 || form.numerator[2] != 0 || form.denominator[1] != 0 || form.denominator[2] != 0;
    const bool packed = pixel_bytes(storage) == 3 || storage == Storage::uint24_high; // elements are no numbers
    if (of_pixel || packed || camera.encoding == Encoding::pseudo_linear)             // which is bent inside triangles
        return std::nullopt;
    // A second difference is no smaller than a step, unless it is 0. Values that are few lie on surfaces that are seen straight on,
    // which step from one to the next.
    const double least = has_few_values(subject.windows) ? (is_float(storage) ? 0 : 1)
                                                         : static_cast<double>(subject.changes.least_second);
    const Rounding rounding{storage != Storage::float16 && std::isfinite(least) ? least : 0,
                            storage == Storage::float16 ? 0x1p-10 : 0x1p-23};
    const Decoder decoder(camera, form);
    const Descriptions descriptions =
        camera.lens ? through_lens(camera, decoder) : of_straight_rays(camera, storage, decoder, form.perspective);
    std::vector<Alternative> others = descriptions.others;
    float farthest = -std::numeric_limits<float>::infinity(); // with the sign that makes it the greatest
    for (const Sampled& sampled : subject.windows)
        for (const float value : sampled.values)
            if (std::isfinite(value))
                farthest = std::max(farthest, form.farther * value);
    for (const Sampled& sampled : subject.windows) {
        const auto bends = bends_of(sampled, descriptions, rounding);
        if (!bends)
            continue;
        const auto& [misfits, rest, rounded, low, high] = *bends;
        const std::vector<Verdict> verdicts = judge(misfits, std::max(rest, rounded), rounded, of_known);
        // A sky, or a sensor's farthest distance, is flat under some description, and no surface.
        const bool may_be_sky = low == high && static_cast<double>(form.farther) * low == static_cast<double>(farthest);
        for (std::size_t i = 0; i < others.size(); ++i) {
            // A wall that is seen straight on is flat whether a distortion has been undone or not.
            const auto [less, more] = std::minmax(misfits.front(), misfits[i + 1]);
            others[i].places += !may_be_sky && more > of_known.apart * std::max(less, rounded);
            if (verdicts.empty())
                continue;
            others[i].flat += !may_be_sky && verdicts.front() == Verdict::bent &&
                              misfits.front() > of_rounding * rounded && verdicts[i + 1] == Verdict::flat;
            others[i].against += verdicts.front() == Verdict::flat && verdicts[i + 1] == Verdict::bent;
        }
    }
    const auto best = std::ranges::max_element(others, {}, &Alternative::flat);
    if (best == others.end() || best->flat < few_windows ||
        (form.perspective ? least_part : least_part_orthographic) * best->flat < best->places ||
        best->flat <= to_one * best->against)
        return std::nullopt;
    if (best->raw)
        return "flat surfaces are bent, and flat if the distortion of the lens has not been undone; undo it, or do not "
               "say that it was (\"undistorted\", \"raw_lens\")";
    return text("flat surfaces are bent as \"", to_string(camera.encoding), "\" has it, and flat if the values are ",
                best->meaning, "? fathom inspect shows more");
}

} // namespace fathom
