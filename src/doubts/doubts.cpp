// Doubts about decoded depth: a description that does not fit its image is told, because every result of it would be wrong.
#include <fathom/doubts.hpp>

#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/ssao.hpp"
#include "doubts/lengths.hpp"
#include "doubts/look.hpp"
#include "doubts/stored_values.hpp"
#include "lens/camera_lens.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

namespace fathom {
namespace {

constexpr double many_invalid = 0.25;  // a fraction of the pixels that is probably no accident
constexpr float many_units = 100;      // no scene in metres begins so far away and is stored in whole metres
constexpr double crowded = 1.2;        // no scene lies in the first fifth behind its near plane
constexpr double hardly_behind = 0.02; // of its distance, a plane has no scene
constexpr double nearly_all = 0.98;    // of the surfaces
constexpr float few_units = 0.25f;     // no scene in metres ends so near
constexpr double half_too_near = 0.4;  // metres, before which cameras of depth see little
constexpr float nearest_of_fives = 2;  // metres, five times what they see at least
constexpr std::size_t to_an_edge = 5;  // codes; fewer differ from their neighbours where surfaces are seen straight on
constexpr double mostly_far = 0.8;     // what most values of a depth buffer exceed
constexpr double past_a_plane = 0.1;   // of its distance; nothing that is rightly described lies so far beyond it
constexpr double many_beyond_fold = 0.01; // of the pixels
constexpr double many_far = 0.001;        // the same for one value that is farther than all others

using Doubt = std::optional<std::string>;

StoredStatistics statistics_of(const Subject& subject) {
    return statistics_of_parts(subject.storage, [&](const auto& visit) {
        subject.each([&](const HostDepth& values, const HostFloats&) { visit(values); });
    });
}

template <typename Visit>
void visit_all(const Subject& subject, const Visit& visit) {
    subject.each([&](const HostDepth& values, const HostFloats&) { visit_values(values, visit); });
}

// The distance of the value farthest away that is finite, in stored units; 0 where none is ahead.
double farthest_finite(const Subject& subject) {
    const float sign = subject.camera.scale < 0 ? -1.0f : 1.0f;
    float farthest = 0;
    visit_all(subject, [&](float value, std::uint32_t) {
        farthest = std::isfinite(value) ? std::max(farthest, sign * value) : farthest;
    });
    return static_cast<double>(farthest);
}

// Through a lens what a value means is that of a camera whose rays are straight.
DepthForm form_of(const Camera& camera, Storage storage) {
    return depth_form(straightened(camera), storage);
}

// How many stored values are of a kind.
std::size_t count_of(StoredKind kind, const Camera& camera, const Subject& subject) {
    const DepthForm form = form_of(camera, subject.storage);
    std::size_t count = 0;
    visit_all(subject, [&](float value, std::uint32_t bits) { count += kind_of(form, value, bits) == kind; });
    return count;
}

bool is_measured(const Subject& subject) {
    const DepthForm form = form_of(subject.camera, subject.storage);
    bool found = false;
    visit_all(subject, [&](float value, std::uint32_t bits) {
        found |= !std::isnan(value) && kind_of(form, value, bits) != StoredKind::missing;
    });
    return found;
}

// Where the highest byte of a surface's depth grows by 1, the byte below it falls by nearly 256. In a picture both grow alike.
Doubt photograph_doubt(const Subject& subject) {
    if (!subject.changes.are_of_a_picture(subject.camera.encoding == Encoding::window))
        return std::nullopt;
    return "its bytes change like the colours of a picture, and not like packed depth; is it the right file? Depth "
           "that a renderer shows in colours cannot be decoded: save raw depth";
}

// Another program's projection · view has the rotation in its fourth row, and rows that are at right angles to it.
Doubt projection_doubt(const Projection& projection) {
    const Projection::Matrix& m = projection.matrix;
    using Row = Eigen::Matrix<long double, 1, 3>;
    const Row ahead = m.block<1, 3>(3, 0), right = m.block<1, 3>(0, 0), up = m.block<1, 3>(1, 0);
    constexpr long double rounding = 1e-5L; // of matrices in floats
    const bool turned = std::hypot(ahead[0], ahead[1]) > 0.01L && std::abs(ahead.norm() - 1) < rounding &&
                        std::abs(ahead.dot(right)) < rounding * right.norm() &&
                        std::abs(ahead.dot(up)) < rounding * up.norm() &&
                        std::abs(right.dot(up)) < rounding * right.norm() * up.norm();
    if (!turned)
        return std::nullopt;
    const auto part = [&](int i) { return number(static_cast<double>(ahead[i]), 3); };
    return text("the fourth row of \"projection\" looks along (", part(0), ", ", part(1), ", ", part(2),
                "): it holds the view as well; give the projection alone, and the rest as \"view\"");
}

// The nearest depth that a depth buffer can hold in the middle of the image. None for other depth.
std::optional<double> near_end_of(const Camera& given, Storage storage) {
    const Camera camera = straightened(given);
    if (camera.encoding != Encoding::window || !camera.projection.is_perspective())
        return std::nullopt;
    const DepthForm form = depth_form(camera, storage);
    std::optional<double> nearest;
    for (const float end : {form.lowest, form.highest}) {
        const auto z = static_cast<double>(view_depth(camera, storage, camera.width / 2.0, camera.height / 2.0, end));
        if (std::isfinite(z) && z > 0 && (!nearest || z < *nearest))
            nearest = z;
    }
    return nearest;
}

// The distances between which a projection shows anything. None where that was never said, or changes across the image.
std::optional<std::pair<double, double>> clip_distances(const Camera& camera) {
    if (camera.projection.known_third_row && !(camera.near_plane && camera.far_plane))
        return std::nullopt; // a camera made of angles or a calibration, which has any planes
    if (!camera.projection.is_perspective() && camera.near_plane == 0 && camera.far_plane == 1)
        return std::nullopt; // what a camera says that has none
    const Projection::Matrix m = camera.projection.matrix_in_opengl_axes();
    const auto distance = [&](long double clip_value) {
        const Projection::Row end = m.row(2) - clip_value * m.row(3);
        return end[0] == 0 && end[1] == 0 ? static_cast<double>(end[3] / end[2]) : std::nan("");
    };
    const double near_plane = distance(camera.projection.clip_near());
    double far_plane = distance(camera.projection.clip_far());
    if (camera.projection.is_perspective() && !(far_plane > 0)) // infinite, but for rounding
        far_plane = std::numeric_limits<double>::infinity();
    if (!std::isfinite(near_plane) || !(far_plane > near_plane))
        return std::nullopt;
    return std::pair{near_plane, far_plane};
}

// Distances of which many lie where the projection shows nothing.
Doubt clipped_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const Camera& camera = subject.camera;
    const auto clip = camera.lens ? std::nullopt : clip_distances(camera);
    const bool are_heights = camera.scale < 0 && !camera.projection.is_perspective(); // which count from any level
    if (!clip || !is_metric(camera.encoding) || are_heights)
        return std::nullopt;
    const auto [near_plane, far_plane] = *clip;
    // The planes of a matrix of floats are rounded.
    const auto low = static_cast<float>(near_plane - past_a_plane * std::abs(near_plane)),
               high = static_cast<float>(far_plane + past_a_plane * std::abs(far_plane));
    if (look.nearest >= low && look.farthest <= high)
        return std::nullopt;
    std::size_t before = 0, behind = 0;
    subject.each([&](const HostDepth&, const HostFloats& z) {
        for (int y = 0; y < z.height; ++y)
            for (const float distance : row_of(z, y)) {
                before += distance < low;
                behind += distance > high && distance < std::numeric_limits<float>::infinity();
            }
    });
    if (!(static_cast<double>(before + behind) > many_invalid * static_cast<double>(look.surfaces())))
        return std::nullopt;
    const bool nearer = before > behind;
    const bool from_0_to_1 = camera.scale == 1 && look.nearest >= 0 && look.farthest <= 1;
    return text(percent(nearer ? before : behind, look.surfaces()), " of the surfaces lie ",
                nearer ? "before the near" : "behind the far", " plane of the projection, ",
                number(nearer ? near_plane : far_plane, 4), ", which cuts them off; ",
                from_0_to_1
                    ? "are the values from 0 to 1 no distances (\"encoding\": \"window\", \"linear\" or another)?"
                    : "are they in the units of the projection (\"scale\")?");
}

// All of it background though the values differ, or all of it close behind the near plane.
Doubt range_doubt(const Subject& subject) {
    const Look& look = subject.look;
    if (look.background == look.pixels) {
        const StoredStatistics found = statistics_of(subject);
        if (found.min < found.max)
            return text("every pixel is background, though the values run from ", number(found.min), " to ",
                        number(found.max), "; does the scale fit, or what the camera says of the background?");
    }
    const auto near_end = near_end_of(subject.camera, subject.storage);
    const auto within = [&](double near_plane, const char* cure) {
        return text("everything lies within ", number(100 * (static_cast<double>(look.farthest) / near_plane - 1), 2),
                    " % of the near plane, ", number(near_plane, 4), cure);
    };
    if (look.surfaces() == 0)
        return std::nullopt;
    // Some values may be farther, such as those of a sky.
    if (near_end && static_cast<double>(look.farthest) >= *near_end * crowded &&
        static_cast<double>(look.nearest) < *near_end * (1 + hardly_behind)) {
        std::size_t crowd = 0;
        const auto end = static_cast<float>(*near_end * (1 + hardly_behind));
        subject.each([&](const HostDepth&, const HostFloats& z) {
            for (int y = 0; y < z.height; ++y)
                for (const float distance : row_of(z, y))
                    crowd += distance < end;
        });
        if (static_cast<double>(crowd) > nearly_all * static_cast<double>(look.surfaces()))
            return text(percent(crowd, look.surfaces()), " of the surfaces lie within ", number(100 * hardly_behind),
                        " % of the near plane, ", number(*near_end, 4), "; do \"encoding\" and \"reversed\" fit?");
    }
    if (near_end && static_cast<double>(look.farthest) < *near_end * crowded)
        return within(*near_end,
                      "; are the values distances (\"encoding\": \"view-z\"), or is \"reversed\" the wrong way "
                      "round?");
    const auto clip = subject.camera.lens ? std::nullopt : clip_distances(subject.camera);
    if (clip && is_metric(subject.camera.encoding) && clip->first > 0 &&
        static_cast<double>(look.nearest) >= clip->first * (1 - past_a_plane) &&
        static_cast<double>(look.farthest) < clip->first * crowded)
        return within(clip->first, "; was it decoded with another projection than this one?");
    return std::nullopt;
}

// The number that is most often there of those that programs write where there is no depth, and that are none; and at how many pixels.
std::pair<double, std::size_t> commonest_number(const Subject& subject) {
    const Camera& camera = subject.camera;
    double value = 0;
    std::size_t most = 0, count = 0;
    for (std::size_t i = 0; is_metric(camera.encoding) && i < subject.numbers.numbers.size(); ++i)
        if (const auto each = static_cast<double>(subject.numbers.numbers[i]);
            each * camera.scale <= 0 && camera.missing != each && subject.numbers.counts[i] > most) {
            value = each;
            most = subject.numbers.counts[i];
        }
    if (most > 0)
        visit_all(subject, [&](float each, std::uint32_t) { count += static_cast<double>(each) == value; });
    return {value, count};
}

// What `linearize` makes of stored values. The last bit may differ.
auto decoder(const Camera& camera, Storage storage) {
    const DepthForm form = form_of(camera, storage);
    return [form, rays = is_along_ray(form) ? camera_rays(camera) : Rays{}](int x, int y, float value,
                                                                            std::uint32_t bits) {
        constexpr float invalid = std::numeric_limits<float>::quiet_NaN();
        const StoredKind kind = kind_of(form, value, bits);
        if (kind == StoredKind::background)
            return std::numeric_limits<float>::infinity();
        if (kind == StoredKind::missing || !(value >= form.lowest && value <= form.highest))
            return invalid;
        if (std::isinf(value) && (form.form == Form::affine || form.form == Form::ray_distance))
            return form.farther * value > 0 ? form.farther * value : invalid; // sums of it would be NaN
        const auto z = static_cast<float>(view_depth(form, rays, x + 0.5, y + 0.5, static_cast<double>(value)));
        return z > form.least_depth ? z : invalid;
    };
}

// Pixels whose value fits no depth. Through a lens others have no ray, which is no mistake of the values.
std::size_t invalid_of(const Subject& subject) {
    if (!subject.camera.lens)
        return subject.look.invalid;
    std::size_t invalid = 0;
    subject.each([&](const HostDepth& values, const HostFloats&) {
        visit_values(values, [&, decode = decoder(subject.camera, subject.storage)](float value, std::uint32_t bits) {
            invalid += std::isnan(decode(0, 0, value, bits)); // which no form through a lens has terms of
        });
    });
    return invalid;
}

// Why no value, or few of them, has a depth.
std::string reason(const Subject& subject, const StoredStatistics& found) {
    const Camera& camera = subject.camera;
    const DepthForm form = form_of(camera, subject.storage);
    const std::size_t invalid = invalid_of(subject);
    const std::string values = found.min == found.max
                                   ? text("the values are ", number(found.min))
                                   : text("the values run from ", number(found.min), " to ", number(found.max));
    if (found.nan == found.pixels)
        return "all of its values are NaN; is it the right file, or the right channel (--channel)?";
    if (std::isnan(found.min))
        return "none of its values is finite; is it the right file, or the right channel (--channel)?";
    if (count_of(StoredKind::missing, camera, subject) == found.pixels)
        return text("all of its values are ", number(found.min), ", which the camera says was not measured");
    const double end =
        camera.encoding == Encoding::inverse ? 0.0 - camera.offset : 0; // where depth begins, or infinity lies
    // A sky may lie at the end itself.
    if (is_metric(camera.encoding) && found.min < found.max && (camera.scale > 0 ? found.max <= end : found.min >= end))
        return text(values, ", on the other side of ", number(end), " than \"scale\" has it; if they count ",
                    camera.scale > 0 ? "backwards, as Isaac Gym's depth and ZED's disparity do" : "forwards",
                    ", say \"scale\": ", number(-camera.scale));
    if (!is_metric(camera.encoding) && is_float(subject.storage) &&
        found.percentiles[3] > static_cast<double>(form.highest))
        return text(values, ", and \"", to_string(camera.encoding), "\" depth lies in ",
                    number(static_cast<double>(form.lowest)), " to ", number(static_cast<double>(form.highest)),
                    "; are these distances (\"encoding\": \"view-z\")?");
    if (const auto [value, count] = commonest_number(subject); 2 * count > invalid - found.nan)
        return text(percent(count, found.pixels), " of the values are ", number(value),
                    "; if that was not measured, say \"missing\": ", number(value),
                    "; if nothing is there, \"background\": ", number(value),
                    value == 0 ? ", which is Nuke's sky, whose values are 1/z (\"encoding\": \"inverse\")" : "");
    if (counts_distances(camera.encoding) && camera.scale < 0 && 2 * found.inf > invalid - found.nan)
        return text(percent(found.inf, found.pixels),
                    " of the values are infinity, on the other side of 0 than \"scale\" "
                    "has it; if nothing is there, say \"background\": \"infinity\"");
    if (camera.encoding == Encoding::window)
        return values + "; do clip_z, reversed and depth_range fit the program that wrote them?";
    return values + "; fathom inspect shows what the camera makes of them";
}

Doubt invalid_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const std::size_t invalid = invalid_of(subject);
    const auto many = [&](std::size_t count) {
        return static_cast<double>(count) > many_invalid * static_cast<double>(look.pixels);
    };
    if (!many(invalid))
        return std::nullopt;
    const std::size_t missing = count_of(StoredKind::missing, subject.camera, subject);
    const StoredStatistics found = statistics_of(subject);
    if (!many(invalid - std::min(invalid, missing + found.nan)))
        return std::nullopt;
    return text(percent(invalid, look.pixels), " of the pixels are invalid: ", reason(subject, found));
}

// The units of files that this image may have, of which `fits` is true, but for the one that the camera has.
std::string units_of(const Camera& camera, const std::function<bool(double scale)>& fits) {
    std::string units;
    for (const auto& [scale, name] : {std::pair{0.001, "millimetres"},
                                      {0.01, "centimetres"},
                                      {0.0002, "those of TUM"},
                                      {0.0001, "tenths of millimetres, as a D405 has"}})
        if (scale != camera.scale && fits(scale))
            units += text(units.empty() ? "" : ", ", number(scale), units.empty() ? " if they are " : " ", name);
    return units.empty() ? "how many metres it has" : units;
}

// Distances in another unit.
Doubt unit_doubt(const Subject& subject, bool distances) {
    const Look& look = subject.look;
    const Camera& camera = subject.camera;
    const bool floats = is_float(subject.storage);
    if (look.surfaces() == 0)
        return std::nullopt;
    if (distances && !floats && camera.scale == 1 && look.nearest >= many_units)
        return text("its integers count as scene units, so that depths run from ", number(look.nearest, 4), " to ",
                    number(look.farthest, 4), "; if they are millimetres and a unit is a metre, say \"scale\": 0.001");
    const auto nearer_than = [&](double metres) {
        std::size_t count = 0;
        subject.each([&](const HostDepth&, const HostFloats& z) {
            for (int y = 0; y < z.height; ++y)
                for (const float depth : row_of(z, y))
                    count += static_cast<double>(depth) <= metres;
        });
        return count;
    };
    if (distances && camera.usual_metres > 0 && static_cast<double>(look.farthest) > camera.usual_metres) {
        const std::size_t far = look.surfaces() - nearer_than(camera.usual_metres);
        if (2 * far > look.surfaces())
            return text(percent(far, look.surfaces()), " of the surfaces lie beyond ", number(camera.usual_metres),
                        " metres, up to ", number(look.farthest, 4),
                        ", where this source sees little; if the values are in another unit, say \"scale\": ",
                        units_of(camera, [&](double scale) {
                            return 2 * nearer_than(camera.usual_metres * camera.scale / scale) >= look.surfaces();
                        }));
    }
    if (distances && camera.usual_metres > 0 && subject.storage == Storage::uint16 && camera.scale == 0.001 &&
        look.farthest < few_units)
        return text("its integers count as millimetres and end at ", number(look.farthest, 4),
                    " metres, nearer than such cameras see; say how long their unit is (\"scale\"), and save all of "
                    "their bits");
    // Cameras of depth count in millimetres, and TUM has saved five times as much.
    const std::array<std::size_t, 8>& ends = subject.changes.low_bits;
    const std::size_t codes = std::accumulate(ends.begin(), ends.end(), std::size_t{});
    const bool is_sensor = distances && camera.usual_metres == 10 && subject.storage == Storage::uint16;
    if (is_sensor && camera.scale == 0.001 && look.nearest >= nearest_of_fives && subject.changes.no_fives == 0 &&
        4 * subject.changes.odd_fives >= codes && to_an_edge * subject.changes.neighbours >= codes)
        return text(
            "its codes are multiples of 5, and nothing is nearer than ", number(look.nearest, 3),
            " metres, as in TUM's depth, which has 5000 a metre; if it is such, say \"scale\": 0.0002, or --preset "
            "tum");
    if (is_sensor && camera.scale == 0.0002)
        if (const std::size_t near = nearer_than(half_too_near); 2 * near > look.surfaces())
            return text(percent(near, look.surfaces()), " of the surfaces are nearer than ", number(half_too_near),
                        " metres, where such cameras see little; if the codes are millimetres, say \"scale\": 0.001");
    if (distances && floats && std::abs(camera.scale) < 0.1 && look.farthest < few_units)
        return text("its floats times the scale of ", number(camera.scale), " are ", number(look.farthest, 4),
                    " at most; floats are mostly scene units already, which is \"scale\": 1");
    if (camera.encoding == Encoding::inverse && camera.scale == 1 && look.farthest < few_units)
        return text("depths run from ", number(look.nearest, 2), " to ", number(look.farthest, 2),
                    ": 1 over the values, which looks like disparity without its \"scale\"; that is the baseline times "
                    "the focal length in pixels");
    return std::nullopt;
}

// Values of a depth buffer as distances.
Doubt buffer_doubt(const Subject& subject) {
    const Look& look = subject.look;
    if (subject.camera.scale != 1 || look.surfaces() == 0 || look.farthest != 1 ||
        !(look.nearest > 0 && look.nearest < 1))
        return std::nullopt;
    const StoredStatistics found = statistics_of(subject);
    if (!(found.percentiles[1] > mostly_far))
        return std::nullopt;
    return text("the values run from ", number(found.min), " to 1, and 95 % are above ", number(found.percentiles[1]),
                ", as in a depth buffer; if it is one, say \"encoding\": \"window\" with near and far");
}

// Rays of a map whose axes are others than right, down and ahead: a mirror image, or turned upside down.
Doubt map_doubt(const Camera& camera) {
    if (!camera.lens || !camera.lens->map)
        return std::nullopt;
    const RayMap& map = *camera.lens->map;
    const auto ray = [&](int x, int y) -> Eigen::Vector3f {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) + static_cast<std::size_t>(x);
        return Eigen::Map<const Eigen::Vector3f>(&map.rays[3 * at]);
    };
    const int step = std::max(1, std::max(map.width, map.height) / 64);
    std::size_t all = 0, mirrored = 0, upwards = 0;
    for (int y = 0; y + 1 < map.height; y += step)
        for (int x = 0; x + 1 < map.width; x += step) {
            const Eigen::Vector3f here = ray(x, y), by_x = ray(x + 1, y) - here, by_y = ray(x, y + 1) - here;
            const float turn = here.dot(by_x.cross(by_y));
            if (!(turn != 0)) // NaN, too
                continue;
            ++all;
            mirrored += turn < 0;
            upwards += by_y.y() < 0;
        }
    if (2 * mirrored > all)
        return text(
            "the map of rays is a mirror image: its axes are x right, y down and z ahead, rows from the top down; turn "
            "the sign of y if it points up");
    if (2 * upwards > all)
        return text("the map of rays is upside down: its axes are x right, y down and z ahead, rows from the top down; "
                    "turn the signs of y and z of a map in OpenGL's axes");
    return std::nullopt;
}

// Where a lens folds within the image, beyond which nothing is seen. A fisheye whose circle ends in the image is another matter.
Doubt fold_doubt(const Camera& camera) {
    if (!camera.lens)
        return std::nullopt;
    const lens::CameraLens lens(camera);
    const double part = lens.part_beyond_fold(camera.width, camera.height);
    if (!(part > many_beyond_fold))
        return std::nullopt;
    return text(number(100 * part, 3), " % of the pixels have no ray, because the lens ", lens.fold_words(),
                "; calibrate with points in the image's corners, or give the part that they surround");
}

// The value of a sky as a distance.
Doubt sky_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const bool known = subject.camera.encoding == Encoding::view_z && subject.camera.scale == 1;
    const double farthest = known ? static_cast<double>(look.farthest) : farthest_finite(subject),
                 value = subject.camera.scale < 0 ? -farthest : farthest;
    if (!(farthest == 65504 || farthest >= 1e9) ||
        (subject.camera.background && static_cast<float>(*subject.camera.background) == static_cast<float>(value)))
        return std::nullopt;
    Camera counted = subject.camera;
    counted.background_from = value;
    const std::size_t far_away = count_of(StoredKind::background, counted, subject);
    if (!(static_cast<double>(far_away) > many_far * static_cast<double>(look.pixels)))
        return std::nullopt;
    return text(percent(far_away, look.pixels), " of the pixels hold ", number(value),
                ", which renderers write where nothing is, and which counts as a surface here; if so, say "
                "\"background_from\": ",
                number(value));
}

} // namespace

Doubt refusal(const Subject& subject) {
    if (invalid_of(subject) == subject.look.pixels)
        return "no pixel has a depth: " + reason(subject, statistics_of(subject));
    if (const Doubt halves = half_bits_doubt(subject))
        return halves;
    return eight_bits_doubt(subject);
}

std::vector<std::string> doubts(const Subject& subject) {
    if (const Doubt refused = refusal(subject)) // whatever else is seen follows from it
        return {*refused};
    const Camera& camera = subject.camera;
    const bool distances = counts_distances(camera.encoding), float_distances = distances && is_float(subject.storage);
    std::vector<std::string> said;
    const auto add = [&](const Doubt& doubt) {
        if (doubt)
            said.push_back(*doubt);
        return doubt.has_value();
    };
    const bool is_invalid = add(invalid_doubt(subject));
    const std::vector<std::string> of_another = other_source_doubts(subject);
    if (of_another.empty())
        add(unit_doubt(subject, distances));
    const bool is_buffer = float_distances && add(buffer_doubt(subject));
    if (float_distances && !camera.background_from && !camera.background_from_largest_half)
        add(sky_doubt(subject));
    if (!is_invalid) // or holes would be told twice
        add(special_number_doubt(subject));
    add(filtered_doubt(subject));
    if (!is_buffer && (!is_invalid || camera.lens)) // behind the camera values along its axis are below 0
        add(flat_surfaces_doubt(subject));
    add(photograph_doubt(subject));
    said.insert(said.end(), of_another.begin(), of_another.end());
    add(projection_doubt(camera.projection));
    if (said.empty()) {
        add(range_doubt(subject));
        add(clipped_doubt(subject));
    }
    add(fold_doubt(camera));
    add(map_doubt(camera));
    return said;
}

namespace {

// Asks about the whole image.
template <typename Ask>
auto asked_of(const Camera& camera, const HostDepth& stored, const Ask& ask) {
    check_size(camera, stored);
    const auto decode = decoder(camera, stored.storage);
    std::vector<float> z;
    z.reserve(static_cast<std::size_t>(stored.width) * static_cast<std::size_t>(stored.height));
    for (int y = 0; y < stored.height; ++y) {
        int x = 0;
        visit_values(part_of(stored, 0, y, stored.width, 1),
                     [&](float value, std::uint32_t bits) { z.push_back(decode(x++, y, value, bits)); });
    }
    const HostFloats distances{z.data(), stored.width, stored.height};
    Subject subject(camera, stored.storage);
    subject.add(stored, distances);
    subject.each = [&](const auto& visit) { visit(stored, distances); };
    return ask(subject);
}

} // namespace

UnsaidDoubts unsaid_doubts(const HostDepth& stored, bool backwards, double background_from) {
    Camera camera;
    camera.width = stored.width;
    camera.height = stored.height;
    camera.projection = perspective(1, static_cast<double>(stored.width) / stored.height, {0.1, 100});
    camera.encoding = Encoding::view_z;
    camera.scale = backwards ? -1 : 1;
    camera.missing = 0;
    if (std::isfinite(background_from))
        camera.background_from = backwards ? -background_from : background_from;
    return asked_of(camera, stored, [](const Subject& subject) {
        return UnsaidDoubts{half_bits_doubt(subject), special_number_doubt(subject)};
    });
}

std::vector<std::string> depth_doubts(const Camera& camera, const HostDepth& stored) {
    return asked_of(camera, stored, doubts);
}

std::vector<std::string> radius_doubts(const Camera& camera, const HostDepth& stored, double radius) {
    description::Check{}("radius", radius, description::ssao_radius);
    return asked_of(camera, stored, [&](const Subject& subject) { return radius_doubts(subject, radius); });
}

std::vector<std::string> lens_doubts(const Camera& camera, const HostDepth& stored, const LensArguments& lens,
                                     const CircleOfConfusion& circle, Sky sky, double max_coc_px,
                                     const LensWords& words) {
    return asked_of(camera, stored,
                    [&](const Subject& subject) { return lens_doubts(subject, lens, circle, sky, max_coc_px, words); });
}

std::vector<std::string> depth_doubts_of_sample(const Camera& camera, const HostDepth& stored) {
    constexpr int most_windows = 2, growth = 4, columns = 24, rows = 16, most_of_numbers = 240, rows_of_numbers = 40;
    check_size(camera, stored);
    const auto decode = decoder(camera, stored.storage);
    Subject subject(camera, stored.storage, most_windows, growth);
    const auto look_at = [&](int x, int y, const auto& put) {
        visit_values(part_of(stored, x, y, 1, 1),
                     [&](float value, std::uint32_t bits) { put(value, decode(x, y, value, bits)); });
    };
    for (Sampled& sampled : subject.windows)
        for (int i = 0; i < Window::size; ++i)
            look_at(sampled.window.x(i), sampled.window.y(i), [&](float value, float depth) {
                sampled.values[static_cast<std::size_t>(i)] = value;
                sampled.z[static_cast<std::size_t>(i)] = depth;
            });
    std::vector<std::byte> pixels; // side by side, so that each of the questions goes through them at once
    std::vector<float> z;
    const int across = std::max(1, stored.width / columns), down = std::max(1, stored.height / rows);
    for (int y = down / 2; y < stored.height; y += down)
        for (int x = across / 2; x < stored.width; x += across) {
            const auto* first = static_cast<const std::byte*>(part_of(stored, x, y, 1, 1).data);
            pixels.insert(pixels.end(), first, first + pixel_bytes(stored.storage));
            look_at(x, y, [&](float, float depth) { z.push_back(depth); });
        }
    const HostDepth sampled{pixels.data(), static_cast<int>(z.size()), 1, pixels.size(), stored.storage};
    const HostFloats distances{z.data(), sampled.width, 1};
    subject.look.add(distances);
    for (int y = down; y < stored.height; y += 5 * down)
        subject.add_row(part_of(stored, 0, y, stored.width, 1));
    for (int y = 0; y < stored.height; y += std::max(1, stored.height / rows_of_numbers))
        subject.numbers.add_some(part_of(stored, 0, y, stored.width, 1), std::max(1, stored.width / most_of_numbers));
    subject.each = [&](const auto& visit) { visit(sampled, distances); };
    if (subject.look.invalid == subject.look.pixels && !is_measured(subject)) // what was measured may lie between
        return {};
    return doubts(subject);
}

} // namespace fathom
