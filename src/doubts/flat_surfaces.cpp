// Flat surfaces that are bent as the camera describes them, and flat under another reading of their values.
#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/planes.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace fathom {
namespace {

constexpr std::size_t few_windows = 12;      // may win by chance
constexpr std::size_t few_large_windows = 8; // the same of large ones
constexpr std::size_t to_one = 9;            // and so many where one speaks against it
// One window in so many has to speak for the other reading, or it is bent surfaces that do, by chance. Those of an orthographic
// camera, whose only other reading is a perspective, do so more often.
constexpr std::size_t least_part = 20, least_part_orthographic = 3;
constexpr std::size_t of_bent = 5; // one in so many bent windows: hills are bent under each reading, but for a few
constexpr std::size_t least_part_searched = 3;  // and those of a reading with a parameter
constexpr double farthest_of_logarithms = 1e10; // in nearest distances, or in 1/C
constexpr double of_rounding = 4; // times: steps of a smooth surface are no noise, so that bends near them say little
constexpr int least_windows = 32; // across the image: smaller ones are bent too little by a lens

constexpr const char* if_they_are = "if they are";

// What the stored values could be instead of what the camera says.
struct Alternative {
    Reading reading;
    std::string meaning;
    std::vector<Cure> cures = {};
    std::string otherwise = "are they? fathom inspect shows more";
    bool has_no_unit = false;
    bool of_lens = false;    ///< does it bend rays a little?
    std::size_t places = 0;  ///< windows without an edge that may tell it from what the camera says
    std::size_t flat = 0;    ///< of these, flat with it, and bent as the camera has it
    std::size_t against = 0; ///< and where it is the other way round
};

std::vector<Alternative> alternatives_of(const Subject& subject, const DepthForm& form) {
    const Camera& camera = subject.camera;
    const Storage storage = subject.storage;
    const auto of = [&](Shape shape, double p = 0, double largest = 1) {
        return reading_of(shape, p, largest, camera.width, camera.height);
    };
    const auto along = [&](Along way) {
        Reading reading = of(Shape::reciprocal);
        reading.along = way;
        return reading;
    };
    const auto length = [&](Along way) { // along the axis, the rays or a cube's axes
        const bool is_ray = way == Along::ray;
        return Alternative{
            along(way),
            is_ray               ? "distances along the rays"
            : way == Along::axis ? "distances along the view axis"
                                 : "distances along the axes of a cube's faces",
            {{way == Along::cube ? std::vector<Key>{{"encoding", Encoding::view_z}, {"along", way}}
                                 : std::vector<Key>{{"encoding", is_ray ? Encoding::ray_distance : Encoding::view_z}},
              if_they_are}}};
    };
    std::vector<Alternative> others;
    if (camera.lens) {
        for (const Along way : {Along::axis, Along::ray, Along::cube})
            if (way != counted_along(camera))
                others.push_back(length(way));
        return others;
    }
    if (!form.perspective) {
        Reading reading = of(Shape::reciprocal);
        reading.view = pinhole_view(camera.width, camera.height, 1);
        return {{reading, "distances of a perspective camera", {}, "is this its projection?"}};
    }
    using enum Encoding;
    const Encoding own = camera.encoding;
    const double largest = storage_max(storage);
    const bool are_parts = static_cast<double>(subject.changes.highest) <= largest; // of the range
    const bool has_span = are_parts && camera.near_plane && camera.far_plane && std::isfinite(*camera.far_plane) &&
                          *camera.near_plane > 0 && *camera.far_plane > *camera.near_plane;
    if (own != view_z)
        others.push_back(length(Along::axis));
    if (own != view_z && !is_metric(own) && is_float(storage) && are_parts) {
        others.back().meaning += " or median depth, z/(z + m)";
        others.back().cures = {};
        others.back().otherwise = "if they are, say \"encoding\": \"view-z\" with its scale, or \"median\" with its m";
    }
    if (own != ray_distance)
        others.push_back(length(Along::ray));
    if (camera.along == Along::ray || (own != window && own != inverse && own != inverse_range)) {
        others.push_back(
            {of(Shape::affine),
             "depth-buffer values or 1/z, or come from an orthographic camera",
             {},
             "if they are a buffer's, say \"encoding\": \"window\" with its near and far; if they are disparity "
             "or 1/z, \"encoding\": \"inverse\" with its scale"});
        others.back().has_no_unit = true;
        if (has_span)
            others.back().cures = {{{{"encoding", window}}, if_they_are}};
    }
    if (own == view_z && camera.near_plane)
        others.push_back({of(Shape::offset, *camera.near_plane / camera.scale),
                          "distances from the near plane on, so that it has to be added",
                          {},
                          "add it to the values"});
    const auto add = [&](Encoding encoding, Shape shape, double p, const char* meaning) {
        if (own == encoding)
            return;
        others.push_back({of(shape, p, largest), meaning, {{{{"encoding", encoding}}, if_they_are}}});
        others.back().has_no_unit = true;
    };
    if (has_span) {
        const double near = *camera.near_plane, far = *camera.far_plane;
        add(linear, Shape::offset, near / (far - near), "linear from near to far");
        add(exponential, Shape::exponential, std::log(far / near), "logarithms of distances from near to far");
    }
    if (!is_metric(own) && are_parts && camera.far_plane && *camera.far_plane > 0 && std::isfinite(*camera.far_plane))
        add(logarithmic, Shape::logarithmic, std::log1p(camera.log_c * *camera.far_plane), "logarithms of C z + 1");
    if (own == linear || own == inverse || own == inverse_range) {
        Camera other = camera;
        other.along = camera.along == Along::ray ? Along::axis : Along::ray;
        const bool is_ray = other.along == Along::ray;
        others.push_back({reading_of(other, storage),
                          is_ray ? "the same along the rays" : "the same along the view axis",
                          {{{{"along", other.along}}, if_they_are}}});
    }
    if (own == logarithmic && camera.near_plane && !camera.from_near_plane) {
        Camera from_near = camera;
        from_near.from_near_plane = true;
        others.push_back({reading_of(from_near, storage),
                          "logarithms of distances from the near plane on, as Cesium's",
                          {{{{"from_near_plane", true}}, if_they_are}}});
    }
    if (!is_metric(own) || own == inverse)
        for (const auto& [gamma, curve] : {std::pair{gamma_of_srgb, "the curve of a display, that of sRGB"},
                                           {2.2, "the curve of a display, a gamma of 2.2"},
                                           {0.5, "a square, as Blender's quadratic mist"}})
            others.push_back({reading_of(camera, storage, gamma),
                              text("what went through ", curve),
                              {{{{"gamma", gamma}}, if_they_are}},
                              "are they? fathom inspect shows more",
                              true});
    if (camera.raw_lens) {
        Reading raw = reading_of(camera, storage);
        Camera bent = camera;
        bent.lens = camera.raw_lens;
        raw.view = view_of(bent);
        others.push_back({.reading = raw, .meaning = {}, .of_lens = true});
    }
    return others;
}

bool has_few_values(const std::vector<Sampled>& windows) {
    constexpr std::size_t few = 16;
    std::set<float> values;
    for (const Sampled& sampled : windows)
        for (const float value : sampled.values)
            if (std::isfinite(value) && values.insert(value).second && values.size() > few)
                return false;
    return true;
}

// What is compared with what the camera says.
class Contest {
public:
    Contest(const Subject& subject, const DepthForm& form, const Rounding& rounding)
        : image_width_(subject.camera.width) {
        const Reading own = reading_of(subject.camera, subject.storage);
        const View view = view_of(subject.camera);
        float farthest = -std::numeric_limits<float>::infinity(); // with the sign that makes it the greatest
        for (const Sampled& sampled : subject.windows)
            for (const float value : sampled.values)
                if (std::isfinite(value))
                    farthest = std::max(farthest, form.farther * value);
        for (const Sampled& sampled : subject.windows) {
            auto patch = patch_of(sampled, view, rounding);
            const auto left = patch ? misfit(*patch, own) : std::nullopt;
            if (!left)
                continue;
            // A sky, or a sensor's farthest distance, is flat under some reading, and no surface.
            const bool may_be_sky = patch->low == patch->high &&
                                    static_cast<double>(form.farther) * patch->low == static_cast<double>(farthest);
            const bool is_bent = !may_be_sky && *left > of_rounding * patch->rounded;
            auto& group = is_bent ? bent_ : flat_;
            group.push_back({std::move(*patch), &sampled, *left, may_be_sky});
        }
        std::erase_if(bent_, [](Seen& seen) { return !seen.is_smooth(); });
        for (const Seen& seen : bent_)
            if (seen.own > of_known.fails * seen.patch.noise)
                bent.push_back(seen.patch);
    }

    // Windows that are bent as the camera has them, and smooth.
    std::vector<Patch> bent = {};

    // Only bent windows speak for another reading, so that the flat ones, which are most of a right camera's, are asked if many do.
    void run(std::vector<Alternative>& others) {
        constexpr std::size_t part = 4, of_many = 200, hardly_any = 2;
        for (std::size_t first = 0; first < part; ++first) {
            for (std::size_t i = first; i < bent_.size(); i += part)
                compare(bent_[i], true, others);
            if (bent_.size() > of_many && most_flat(others) < hardly_any)
                return;
        }
        if (most_flat(others) >= few_large_windows)
            for (Seen& seen : flat_)
                compare(seen, false, others);
    }

    const Alternative* winner(const std::vector<Alternative>& others, std::size_t part) const {
        const auto best = std::ranges::max_element(others, {}, &Alternative::flat);
        return best == others.end() || best->flat < (best->of_lens ? few_large_windows : few_windows) ||
                       part * best->flat < best->places || best->flat <= to_one * best->against ||
                       (!best->of_lens && of_bent * best->flat < bent_.size())
                   ? nullptr
                   : &*best;
    }

private:
    struct Seen {
        Patch patch;
        const Sampled* sampled;
        double own; // what the camera's reading leaves
        bool may_be_sky;

        bool is_smooth() {
            patch.noise = cubic_misfit(patch);
            return fathom::is_smooth(*sampled, patch);
        }
    };

    static std::size_t most_flat(const std::vector<Alternative>& others) {
        std::size_t most = 0;
        for (const Alternative& other : others)
            most = std::max(most, other.flat);
        return most;
    }

    void compare(Seen& seen, bool is_bent, std::vector<Alternative>& others) const {
        const Patch& patch = seen.patch;
        std::vector<double> misfits{seen.own};
        for (const Alternative& other : others) {
            const bool is_told = !other.of_lens || patch.window->width * least_windows >= image_width_;
            misfits.push_back(is_told ? misfit(patch, other.reading).value_or(seen.own) : seen.own);
        }
        const double rounded = patch.rounded;
        const auto [least_bent, most_bent] = std::ranges::minmax(misfits);
        if (!(most_bent > of_known.apart * std::max(least_bent, rounded)) || !(is_bent || seen.is_smooth()))
            return;
        const std::vector<Verdict> verdicts = judge(misfits, std::max(patch.noise, rounded), rounded, of_known);
        for (std::size_t i = 0; i < others.size(); ++i) {
            // A wall that is seen straight on is flat whether a distortion has been undone or not.
            const auto [less, more] = std::minmax(seen.own, misfits[i + 1]);
            others[i].places += !seen.may_be_sky && more > of_known.apart * std::max(less, rounded);
            if (verdicts.empty())
                continue;
            others[i].flat += is_bent && verdicts.front() == Verdict::bent && verdicts[i + 1] == Verdict::flat;
            others[i].against += verdicts.front() == Verdict::flat && verdicts[i + 1] == Verdict::bent;
        }
    }

    std::vector<Seen> bent_ = {}, flat_ = {}; // as the camera has them; the former are smooth
    int image_width_;
};

// Readings with a parameter, which is searched under bent windows: what the camera says cannot name them.
std::vector<Alternative> searched(const Camera& camera, const DepthForm& form, Storage storage,
                                  const std::vector<Patch>& bent) {
    if (camera.lens || !form.perspective)
        return {};
    double largest = 0, lowest = std::numeric_limits<double>::infinity();
    for (const Patch& patch : bent) {
        largest = std::max({largest, std::abs(patch.low), std::abs(patch.high)});
        lowest = std::min(lowest, patch.low);
    }
    const std::vector<Patch> some = some_of(bent, 48);
    std::vector<Alternative> others;
    const auto search = [&](const std::function<Reading(double)>& make, double least, double greatest, int steps) {
        const double p = best_parameter(some, make, least, greatest, steps);
        others.push_back({make(p), {}});
        return p;
    };
    const auto of_shape = [&](Shape shape) {
        return [&, shape](double p) { return reading_of(shape, p, largest, camera.width, camera.height); };
    };
    const double parts = storage_max(storage) / largest; // of the stored range
    const bool is_logarithmic = camera.encoding == Encoding::logarithmic;
    if ((is_logarithmic || camera.encoding == Encoding::ray_distance) && !camera.from_near_plane) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Patch& patch : bent)
            nearest = std::min(nearest, 1 / reading_of(camera, storage).inverse(patch.low).value);
        const auto make = [&](double near) {
            Reading reading = reading_of(camera, storage);
            reading.further += near;
            return reading;
        };
        const double near = search(make, 1e-3 * nearest, 10 * nearest, 24);
        others.back().meaning =
            text(is_logarithmic ? "logarithms of distances" : "distances along the rays", " from a near plane on, at ",
                 number(near, 3), is_logarithmic ? ", as Cesium's" : ", as Mitsuba 3's");
        others.back().cures = {{{{"from_near_plane", true}, {"near", std::stod(number(near, 3))}}, if_they_are}};
    }
    for (const Shape shape : {Shape::exponential, Shape::logarithmic}) {
        if (lowest < 0)
            break;
        const bool is_exponential = shape == Shape::exponential;
        const double power = search(of_shape(shape), is_exponential ? 1 : 1.5, 30, 12) * parts;
        if (power > std::log(farthest_of_logarithms)) {
            others.pop_back();
            continue;
        }
        Alternative& found = others.back();
        found.has_no_unit = true;
        found.meaning = is_exponential ? text("logarithms of distances whose farthest is ", number(std::exp(power), 4),
                                              " times the nearest, as MoGe's")
                                       : text("logarithms of C z + 1 with a C of ", number(std::expm1(power), 4),
                                              " over the far plane's distance");
        found.otherwise = is_exponential
                              ? "if they are, say \"encoding\": \"exponential\" with the near and far of their source"
                              : "if they are, say \"encoding\": \"logarithmic\" with \"log_c\" and \"far\"";
    }
    const double far = camera.far_plane.value_or(0);
    if (lowest >= 0 && camera.encoding == Encoding::linear && camera.along == Along::axis && std::isfinite(far))
        for (const Shape shape : {Shape::offset, Shape::reversed_offset}) { // near and far of another ratio
            const double found = search(of_shape(shape), 1e-3, 3, 14);
            const bool is_reversed = shape == Shape::reversed_offset;
            const double ends = (is_reversed ? 1 + found : found) / parts, // of the range from near to far
                ratio = is_reversed ? (ends - 1) / ends : ends / (1 + ends);
            if (!(ratio > 0)) {
                others.pop_back();
                continue;
            }
            const double unit = std::max(far, camera.near_plane.value_or(0)), near = std::stod(number(ratio * unit, 6));
            others.back().meaning = text("linear from a near plane at ", number(ratio, 3), " of the far one",
                                         is_reversed ? ", near being white" : "");
            others.back().otherwise = {};
            others.back().cures = {{{{"near", is_reversed ? unit : near}, {"far", is_reversed ? near : unit}},
                                    "if that is so, and the far plane is right"}};
        }
    if (lowest >= 0 && counts_distances(camera.encoding)) {
        const double part = search(of_shape(Shape::offset), 1e-3, 3, 14); // of the greatest value
        others.back().meaning = text("distances from a near plane on, at ", number(part * largest * camera.scale, 3),
                                     " in the unit of the rest");
        others.back().otherwise =
            "if they are, say \"encoding\": \"linear\" with near and far, or add it to the values";
        others.back().has_no_unit = true;
    }
    return others;
}

// Distances along rays that are other than the camera's: windows are flat for themselves then, but none lies in its neighbour's plane.
// So the rays are searched under which most do.
class RaySearch {
public:
    RaySearch(const Subject& subject, const Rounding& rounding) : camera_(subject.camera) {
        const View view = view_of(camera_);
        const auto ahead = [&](double x, double y) -> Eigen::Vector2d {
            const auto ray = view(x, y);
            return ray ? Eigen::Vector2d(ray->head<2>() / ray->z()) : Eigen::Vector2d::Zero();
        };
        const double w = camera_.width, h = camera_.height;
        origin_ = ahead(0, 0);
        by_pixel_.col(0) = (ahead(w, 0) - origin_) / w;
        by_pixel_.col(1) = (ahead(0, h) - origin_) / h;
        int side = Window::across;
        while (2 * side <= camera_.width / 8)
            side *= 2;
        for (const Sampled& sampled : subject.windows) {
            auto patch = sampled.window.width == side ? patch_of(sampled, view, rounding) : std::nullopt;
            if (!patch || !(patch->low > 0) || !((patch->noise = cubic_misfit(*patch)) < smooth * patch->low))
                continue;
            patches_.push_back(std::move(*patch));
        }
        fit(1, {0, 0});
        for (std::size_t i = 0; i < patches_.size(); ++i)
            for (std::size_t j = i + 1; j < patches_.size(); ++j) {
                const Window &a = *patches_[i].window, &b = *patches_[j].window;
                const int apart = std::max(std::abs(a.left - b.left), std::abs(a.top - b.top));
                if (apart >= side && apart <= 4 * side && out_of_plane(i, j) < smooth)
                    pairs_.emplace_back(i, j);
            }
        constexpr std::size_t most = 300;
        if (pairs_.size() > most) {
            for (std::size_t i = 0; i < most; ++i)
                pairs_[i] = pairs_[i * pairs_.size() / most];
            pairs_.resize(most);
        }
    }

    std::optional<Finding> doubt() {
        if (pairs_.size() < few_pairs)
            return std::nullopt;
        double noise = 0;
        for (const auto& [i, j] : pairs_)
            noise += std::log(std::max(patches_[i].noise, patches_[i].rounded) / patches_[i].low) /
                     static_cast<double>(pairs_.size());
        const double said = cost(1, {0, 0});
        if (said < noise + std::log(out_of_noise))
            return std::nullopt;
        double scale = 1;
        Eigen::Vector2d shift(0, 0);
        const double half = by_pixel_.col(0).norm() * camera_.width / 2;
        for (int round = 0; round < 4; ++round) { // shifts of 0.6 to either side, in half the view's width
            for (const int axis : {0, 1})
                shift[axis] = half * (least_at(
                                          [&](double by) {
                                              Eigen::Vector2d other = shift;
                                              other[axis] = half * (by - 2);
                                              return cost(scale, other);
                                          },
                                          1.4, 2.6, 9) -
                                      2);
            scale = least_at([&](double by) { return cost(by, shift); }, 0.5, 2, 7);
        }
        const double found = cost(scale, shift);
        if (!(found < said - std::log(out_of_noise) && found < noise + std::log(out_of_noise)))
            return std::nullopt;
        if (shift.norm() < little * half && std::abs(scale - 1) < little)
            return std::nullopt;
        const Eigen::Vector2d axis = by_pixel_.inverse() * (shift - origin_);
        return Finding{Fault::planes,
                       text("flat surfaces are bent as \"", to_string(camera_.encoding),
                            "\" has it, and flat if the values are distances along rays whose axis meets pixel ",
                            number(axis.x(), 4), ", ", number(axis.y(), 4), ", under a view of ",
                            number(2 * std::atan(half * scale) * 180 / std::numbers::pi, 3),
                            " degrees across, as a shifted lens has it"),
                       {},
                       "give its fx, fy, cx and cy, or Hypersim's M_proj as \"projection\""};
    }

private:
    static constexpr std::size_t few_pairs = 24;
    static constexpr double little = 0.02; // of half the view's width: half a pixel is no other view
    static constexpr double smooth = 0.03, out_of_noise = 2.5; // of a distance; times

    // The planes of all patches: 1/distance is linear in the unit ray.
    void fit(double scale, const Eigen::Vector2d& shift) {
        rays_.assign(patches_.size(), {});
        planes_.assign(patches_.size(), Eigen::Vector3d::Zero());
        for (std::size_t i = 0; i < patches_.size(); ++i) {
            const Patch& patch = patches_[i];
            Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
            Eigen::Vector3d b = Eigen::Vector3d::Zero();
            for (std::size_t k = 0; k < patch.values.size(); ++k) {
                const Eigen::Vector2d pixel(patch.window->x(patch.chosen[k]) + 0.5,
                                            patch.window->y(patch.chosen[k]) + 0.5),
                    ahead = scale * (origin_ + by_pixel_ * pixel - shift);
                const Eigen::Vector3d ray = patch.values[k] * Eigen::Vector3d(ahead.x(), ahead.y(), 1).normalized();
                rays_[i].push_back(ray);
                a.noalias() += ray * ray.transpose();
                b += ray;
            }
            planes_[i] = a.ldlt().solve(b);
        }
    }

    // How far each of two patches is from the other's plane, as a part of the distance.
    double out_of_plane(std::size_t i, std::size_t j) const {
        double sum = 0;
        for (const auto& [plane, points] : {std::pair{i, j}, {j, i}})
            for (const Eigen::Vector3d& point : rays_[points])
                sum += std::pow(1 - planes_[plane].dot(point), 2) / static_cast<double>(rays_[points].size());
        return std::sqrt(sum / 2);
    }

    // The mean logarithm over the half of the pairs that is nearest to one plane.
    double cost(double scale, const Eigen::Vector2d& shift) {
        fit(scale, shift);
        std::vector<double> each;
        for (const auto& [i, j] : pairs_)
            each.push_back(std::log(std::max(out_of_plane(i, j), 1e-9)));
        const auto half = each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2);
        std::nth_element(each.begin(), half, each.end());
        return std::accumulate(each.begin(), half, 0.0) / static_cast<double>(each.size() / 2);
    }

    const Camera& camera_;
    Eigen::Vector2d origin_;   ///< where the ray of the first pixel's corner goes, for a depth of one
    Eigen::Matrix2d by_pixel_; ///< and how that changes
    std::vector<Patch> patches_;
    std::vector<std::vector<Eigen::Vector3d>> rays_; ///< to the points, by the distances
    std::vector<Eigen::Vector3d> planes_;
    std::vector<std::pair<std::size_t, std::size_t>> pairs_;
};

} // namespace

std::optional<Finding> flat_surfaces_doubt(const Subject& subject) {
    const Camera& camera = subject.camera;
    const DepthForm form = depth_form(straightened(camera), subject.storage);
    const bool of_pixel = // the values themselves change across the image, and z has more rounding than they have
        form.numerator[1] != 0 || form.numerator[2] != 0 || form.denominator[1] != 0 || form.denominator[2] != 0;
    if (of_pixel || camera.encoding == Encoding::pseudo_linear) // which is bent inside triangles
        return std::nullopt;
    // A second difference is no smaller than a step, unless it is 0. Values that are few lie on surfaces that are seen straight on,
    // which step from one to the next.
    const double least = has_few_values(subject.windows) ? (is_float(subject.storage) ? 0 : 1)
                                                         : static_cast<double>(subject.changes.least_second);
    const Rounding rounding{subject.storage != Storage::float16 && std::isfinite(least) ? least : 0,
                            subject.storage == Storage::float16 ? 0x1p-10 : 0x1p-23};
    Contest contest(subject, form, rounding);
    std::vector<Alternative> others = alternatives_of(subject, form);
    contest.run(others);
    const std::size_t part = form.perspective ? least_part : least_part_orthographic;
    const Alternative* best = contest.winner(others, part);
    const bool is_clear = best && 2 * best->flat > best->places;
    if (!is_clear && contest.bent.size() >= few_windows && subject.closely != Closely::some) {
        std::vector<Alternative> more = searched(camera, form, subject.storage, contest.bent);
        contest.run(more);
        if (const Alternative* found = contest.winner(more, least_part_searched);
            found && 3 * found->flat >= contest.bent.size() && (!best || (!best->of_lens && found->flat > best->flat)))
            others = {*found};
        else if (best)
            others = {*best};
        best = contest.winner(others, part);
    }
    if (!best && camera.encoding == Encoding::ray_distance && !camera.lens && form.perspective &&
        !camera.from_near_plane && subject.closely != Closely::some)
        return RaySearch(subject, rounding).doubt();
    if (!best)
        return std::nullopt;
    if (best->of_lens)
        return Finding{Fault::planes,
                       "flat surfaces are bent, and flat if the distortion of the lens has not been undone",
                       {},
                       "undo it, or do not say that it was (\"undistorted\", \"raw_lens\")"};
    return Finding{Fault::planes,
                   text("flat surfaces are bent as \"", to_string(camera.encoding),
                        "\" has it, and flat if the values are ", best->meaning),
                   best->cures, best->otherwise, best->has_no_unit};
}

} // namespace fathom
