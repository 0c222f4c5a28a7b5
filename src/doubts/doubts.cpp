// Doubts about decoded depth: a description that does not fit its image is told, because every result of it would be wrong.
#include <fathom/doubts.hpp>

#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/ssao.hpp"
#include "doubts/lengths.hpp"
#include "doubts/look.hpp"
#include "doubts/stored_values.hpp"
#include "quantile.hpp"
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
constexpr double many_at_one = 0.03;   // of the pixels, where distances hardly end
constexpr double past_a_plane = 0.1;   // of its distance; nothing that is rightly described lies so far beyond it
constexpr double many_far = 0.001;     // the same for one value that is farther than all others

using Doubt = std::optional<Finding>;

StoredStatistics statistics_of(const Subject& subject) {
    return stored_statistics(subject.values());
}

template <typename Visit>
void visit_all(const Subject& subject, const Visit& visit) {
    visit_values(subject.values(), visit);
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

Cure scale_cure(double scale, const std::string& when, const std::string& words = {}) {
    return {{{"scale", scale}}, when, words};
}

// Where the highest byte of a surface's depth grows by 1, the byte below it falls by nearly 256. In a picture both grow alike.
Doubt picture_doubt(const Subject& subject) {
    if (!subject.changes.are_of_a_picture(subject.camera.encoding == Encoding::window))
        return std::nullopt;
    return Finding{Fault::picture,
                   "its bytes change like the colours of a picture, and not like packed depth; is it the right file?",
                   {},
                   "depth that a renderer shows in colours cannot be decoded: save raw depth"};
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
    return Finding{Fault::projection,
                   text("the fourth row of \"projection\" looks along (", part(0), ", ", part(1), ", ", part(2),
                        "): it holds the view as well"),
                   {},
                   "give the projection alone, and the rest as \"view\""};
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
    const auto are_fractions = [&] {
        bool are = true;
        visit_all(subject, [&](float value, std::uint32_t) { are &= !(std::abs(value) > 1); });
        return are && is_float(subject.storage);
    };
    const bool are_heights = camera.scale < 0 && !camera.projection.is_perspective(); // which count from any level
    if (!clip || !is_metric(camera.encoding) || (are_heights && !are_fractions()))
        return std::nullopt;
    const auto [near_plane, far_plane] = *clip;
    // The planes of a matrix of floats are rounded.
    const double low = near_plane - past_a_plane * std::abs(near_plane),
                 high = far_plane + past_a_plane * std::abs(far_plane);
    if (static_cast<double>(look.nearest) >= low && static_cast<double>(look.farthest) <= high)
        return std::nullopt;
    const std::size_t before = count_depths(subject, [&](double z) { return z < low; }),
                      behind = count_depths(subject, [&](double z) { return z > high && std::isfinite(z); });
    if (!(static_cast<double>(before + behind) > many_invalid * static_cast<double>(look.surfaces())))
        return std::nullopt;
    const bool nearer = before > behind, from_0_to_1 = std::abs(camera.scale) == 1 && are_fractions();
    return Finding{Fault::range,
                   text(percent(nearer ? before : behind, look.surfaces()), " of the surfaces lie ",
                        nearer ? "before the near" : "behind the far", " plane of the projection, ",
                        number(nearer ? near_plane : far_plane, 4), ", which cuts them off"),
                   {},
                   from_0_to_1
                       ? "are the values from 0 to 1 no distances (\"encoding\": \"window\", \"linear\" or another)?"
                       : "are they in the units of the projection (\"scale\")?"};
}

// All of it background though the values differ, or all of it close behind the near plane.
Doubt range_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const auto told = [](std::string cause, const char* otherwise) {
        return Finding{Fault::range, std::move(cause), {}, otherwise};
    };
    if (look.background == look.pixels) {
        const StoredStatistics found = statistics_of(subject);
        if (found.min < found.max)
            return told(text("every pixel is background, though the values run from ", number(found.min), " to ",
                             number(found.max)),
                        "does the scale fit, or what the camera says of the background?");
    }
    const auto near_end = near_end_of(subject.camera, subject.storage);
    const auto within = [&](double near_plane) {
        return text("everything lies within ", number(100 * (static_cast<double>(look.farthest) / near_plane - 1), 2),
                    " % of the near plane, ", number(near_plane, 4));
    };
    if (look.surfaces() == 0)
        return std::nullopt;
    // Some values may be farther, such as those of a sky.
    if (near_end && static_cast<double>(look.farthest) >= *near_end * crowded &&
        static_cast<double>(look.nearest) < *near_end * (1 + hardly_behind)) {
        const std::size_t crowd = count_depths(subject, [&](double z) { return z < *near_end * (1 + hardly_behind); });
        if (static_cast<double>(crowd) > nearly_all * static_cast<double>(look.surfaces()))
            return told(text(percent(crowd, look.surfaces()), " of the surfaces lie within ",
                             number(100 * hardly_behind), " % of the near plane, ", number(*near_end, 4)),
                        "do \"encoding\" and \"reversed\" fit?");
    }
    if (near_end && static_cast<double>(look.farthest) < *near_end * crowded)
        return told(within(*near_end), "are the values distances (\"encoding\": \"view-z\"), or is \"reversed\" the "
                                       "wrong way round?");
    const auto clip = subject.camera.lens ? std::nullopt : clip_distances(subject.camera);
    if (clip && is_metric(subject.camera.encoding) && clip->first > 0 &&
        static_cast<double>(look.nearest) >= clip->first * (1 - past_a_plane) &&
        static_cast<double>(look.farthest) < clip->first * crowded)
        return told(within(clip->first), "was it decoded with another projection than this one?");
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

// Pixels whose value fits no depth. Through a lens others have no ray, which is no mistake of the values.
std::size_t invalid_of(const Subject& subject) {
    if (!subject.camera.lens)
        return subject.look.invalid;
    const DepthForm form = form_of(subject.camera, subject.storage);
    std::size_t invalid = 0;
    visit_all(subject, [&](float value, std::uint32_t bits) {
        const StoredKind kind = kind_of(form, value, bits);
        const bool is_in =
            value >= form.lowest && value <= form.highest &&
            view_depth(form, {}, 0, 0, static_cast<double>(value)) > static_cast<long double>(form.least_depth);
        invalid += kind == StoredKind::missing || (kind == StoredKind::depth && !is_in);
    });
    return invalid;
}

// Why no value, or few of them, has a depth.
Finding reason(const Subject& subject, const StoredStatistics& found, const std::string& before) {
    const Camera& camera = subject.camera;
    const DepthForm form = form_of(camera, subject.storage);
    const std::size_t invalid = invalid_of(subject);
    const auto told = [&](const std::string& cause, std::vector<Cure> cures, std::string otherwise) {
        return Finding{Fault::invalid, before + cause, std::move(cures), std::move(otherwise)};
    };
    const std::string values = found.min == found.max
                                   ? text("the values are ", number(found.min))
                                   : text("the values run from ", number(found.min), " to ", number(found.max)),
                      channel = "is it the right file, or the right channel (--channel)?";
    if (found.nan == found.pixels)
        return told("all of its values are NaN", {}, channel);
    if (std::isnan(found.min))
        return told("none of its values is finite", {}, channel);
    if (count_of(StoredKind::missing, camera, subject) == found.pixels)
        return told(text("all of its values are ", number(found.min), ", which the camera says was not measured"), {},
                    {});
    const double end =
        camera.encoding == Encoding::inverse ? 0.0 - camera.offset : 0; // where depth begins, or infinity lies
    // A sky may lie at the end itself.
    if (is_metric(camera.encoding) && found.min < found.max && (camera.scale > 0 ? found.max <= end : found.min >= end))
        return told(
            text(values, ", on the other side of ", number(end), " than \"scale\" has it"),
            {scale_cure(-camera.scale, camera.scale > 0
                                           ? "if they count backwards, as Isaac Gym's depth and ZED's disparity do"
                                           : "if they count forwards")},
            {});
    if (!is_metric(camera.encoding) && is_float(subject.storage) &&
        found.percentiles[3] > static_cast<double>(form.highest))
        return told(text(values, ", and \"", to_string(camera.encoding), "\" depth lies in ",
                         number(static_cast<double>(form.lowest)), " to ", number(static_cast<double>(form.highest))),
                    {{{{"encoding", Encoding::view_z}}, {}, "are these distances (\"encoding\": \"view-z\")?"}}, {});
    if (const auto [value, count] = commonest_number(subject); 2 * count > invalid - found.nan) {
        const std::string key = number(value);
        return told(
            text(percent(count, found.pixels), " of the values are ", key),
            {{{{"missing", value}}, "if that was not measured"},
             {{{"background", value}},
              {},
              text("if nothing is there, \"background\": ", key,
                   value == 0 ? ", which is Nuke's sky, whose values are 1/z (\"encoding\": \"inverse\")" : "")}},
            {});
    }
    if (counts_distances(camera.encoding) && camera.scale < 0 && 2 * found.inf > invalid - found.nan)
        return told(text(percent(found.inf, found.pixels),
                         " of the values are infinity, on the other side of 0 than \"scale\" has it"),
                    {{{{"background", std::numeric_limits<double>::infinity()}}, "if nothing is there"}}, {});
    if (camera.encoding == Encoding::window)
        return told(values, {}, "do clip_z, reversed and depth_range fit the program that wrote them?");
    return told(values, {}, "fathom inspect shows what the camera makes of them");
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
    return reason(subject, found, text(percent(invalid, look.pixels), " of the pixels are invalid: "));
}

// Distances in another unit.
Doubt unit_doubt(const Subject& subject, bool distances) {
    const Look& look = subject.look;
    const Camera& camera = subject.camera;
    const bool floats = is_float(subject.storage);
    if (look.surfaces() == 0)
        return std::nullopt;
    const auto told = [](std::string cause, std::vector<Cure> cures, std::string otherwise = {}) {
        return Finding{Fault::unit, std::move(cause), std::move(cures), std::move(otherwise)};
    };
    if (distances && !floats && camera.scale == 1 && look.nearest >= many_units)
        return told(text("its integers count as scene units, so that depths run from ", number(look.nearest, 4), " to ",
                         number(look.farthest, 4)),
                    {scale_cure(0.001, "if they are millimetres and a unit is a metre")});
    const auto nearer_than = [&](double metres) {
        return count_depths(subject, [&](double z) { return z <= metres; });
    };
    if (distances && camera.usual_metres > 0 && static_cast<double>(look.farthest) > camera.usual_metres) {
        const std::size_t far = look.surfaces() - nearer_than(camera.usual_metres);
        if (2 * far > look.surfaces()) {
            std::vector<Cure> cures;
            for (const auto& [scale, name] : {std::pair{0.001, "millimetres"},
                                              {0.01, "centimetres"},
                                              {0.00025, "quarters of millimetres"},
                                              {0.0002, "those of TUM"},
                                              {0.0001, "tenths of millimetres, as a D405 has"}})
                if (scale != camera.scale &&
                    2 * nearer_than(camera.usual_metres * camera.scale / scale) >= look.surfaces())
                    cures.push_back(scale_cure(scale, text("if the values are ", name)));
            const bool is_any = !cures.empty();
            return told(text(percent(far, look.surfaces()), " of the surfaces lie beyond ", number(camera.usual_metres),
                             " metres, up to ", number(look.farthest, 4), ", where this source sees little"),
                        std::move(cures),
                        is_any ? "" : "if the values are in another unit, say \"scale\": how many metres it has");
        }
    }
    if (distances && camera.usual_metres > 0 && subject.storage == Storage::uint16 && camera.scale == 0.001 &&
        look.farthest < few_units)
        return told(text("its integers count as millimetres and end at ", number(look.farthest, 4),
                         " metres, nearer than such cameras see"),
                    {}, "say how long their unit is (\"scale\"), and save all of their bits");
    // Cameras of depth count in millimetres, and TUM has saved five times as much.
    const std::array<std::size_t, 8>& ends = subject.changes.low_bits;
    const std::size_t codes = std::accumulate(ends.begin(), ends.end(), std::size_t{});
    const bool is_sensor = distances && camera.usual_metres == 10 && subject.storage == Storage::uint16;
    if (is_sensor && camera.scale == 0.001 && look.nearest >= nearest_of_fives && subject.changes.no_fives == 0 &&
        4 * subject.changes.odd_fives >= codes && to_an_edge * subject.changes.neighbours >= codes)
        return told(text("its codes are multiples of 5, and nothing is nearer than ", number(look.nearest, 3),
                         " metres, as in TUM's depth, which has 5000 a metre"),
                    {scale_cure(0.0002, {}, "if it is such, say \"scale\": 0.0002, or --preset tum")});
    if (is_sensor && camera.scale == 0.0002)
        if (const std::size_t near = nearer_than(half_too_near); 2 * near > look.surfaces())
            return told(text(percent(near, look.surfaces()), " of the surfaces are nearer than ", number(half_too_near),
                             " metres, where such cameras see little"),
                        {scale_cure(0.001, "if the codes are millimetres")});
    if (distances && floats && std::abs(camera.scale) < 0.1 && look.farthest < few_units)
        return told(text("its floats times the scale of ", number(camera.scale), " are ", number(look.farthest, 4),
                         " at most; floats are mostly scene units already"),
                    {scale_cure(1, {}, "which is \"scale\": 1")});
    if (camera.encoding == Encoding::inverse && camera.scale == 1 && look.farthest < few_units)
        return told(text("depths run from ", number(look.nearest, 2), " to ", number(look.farthest, 2),
                         ": 1 over the values, which looks like disparity without its \"scale\""),
                    {}, "that is the baseline times the focal length in pixels");
    return std::nullopt;
}

// What is seen of floats from 0 to exactly 1 that count as distances, though buffers end so, and hardly any scene.
Doubt fractions_doubt(const Subject& subject, const auto& seen_of, const char* cure) {
    if (!is_float(subject.storage) || !is_metric(subject.camera.encoding) || subject.camera.scale != 1 ||
        subject.look.surfaces() == 0 || subject.changes.highest != 1)
        return std::nullopt;
    const StoredStatistics found = statistics_of(subject);
    const std::string seen = found.min >= 0 && found.min < 1 && found.max == 1 ? seen_of(found) : "";
    if (seen.empty())
        return std::nullopt;
    return Finding{Fault::buffer, text("the values run from ", number(found.min), " to 1, and ", seen), {}, cure};
}

Doubt buffer_doubt(const Subject& subject) {
    const auto seen = [&](const StoredStatistics& found) {
        return subject.look.farthest == 1 && found.percentiles[1] > mostly_far
                   ? text("95 % are above ", number(found.percentiles[1]), ", as in a depth buffer")
                   : "";
    };
    return fractions_doubt(subject, seen, "if it is one, say \"encoding\": \"window\" with near and far");
}

Doubt normalised_doubt(const Subject& subject) {
    const auto seen = [](const StoredStatistics& found) {
        return static_cast<double>(found.at_largest) > many_at_one * static_cast<double>(found.pixels)
                   ? text(percent(found.at_largest, found.pixels), " of the pixels hold 1, as in normalised depth")
                   : "";
    };
    return fractions_doubt(subject, seen,
                           "if they are no distances, say \"encoding\": \"linear\", or \"window\" for a depth buffer, "
                           "with near and far");
}

// The value of a sky as a distance.
Doubt sky_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const bool known = subject.camera.encoding == Encoding::view_z && subject.camera.scale == 1;
    const double farthest = known ? static_cast<double>(look.farthest) : farthest_finite(subject),
                 value = subject.camera.scale < 0 ? -farthest : farthest;
    const auto stored = static_cast<float>(value);
    if (!(farthest == 65504 || farthest >= 1e9) ||
        kind_of(form_of(subject.camera, subject.storage), stored, bits_of_value(stored, subject.storage)) ==
            StoredKind::background)
        return std::nullopt;
    Camera counted = subject.camera;
    counted.background_from = value;
    const std::size_t far_away = count_of(StoredKind::background, counted, subject);
    if (!(static_cast<double>(far_away) > many_far * static_cast<double>(look.pixels)))
        return std::nullopt;
    return Finding{Fault::number,
                   text(percent(far_away, look.pixels), " of the pixels hold ", number(value),
                        ", which renderers write where nothing is, and which counts as a surface here"),
                   {{{{"background_from", value}}, "if so"}}};
}

} // namespace

Doubt near_and_far_doubt(const Camera& camera, const std::array<std::optional<double>, 2>& of_file) {
    constexpr double rounding = 1e-3;
    const auto clip = clip_distances(camera);
    const std::array own{clip ? clip->first : camera.near_plane, clip ? clip->second : camera.far_plane};
    std::vector<Key> keys;
    std::string ours;
    for (const std::size_t i : {0, 1})
        if (of_file.at(i) && own.at(i) && !(std::abs(*own.at(i) / *of_file.at(i) - 1) < rounding)) {
            keys.push_back({i == 0 ? "near" : "far", *of_file.at(i)});
            ours += text(ours.empty() ? "" : ", ", keys.back().name, " = ", number(*own.at(i)));
        }
    if (keys.empty() || is_metric(camera.encoding))
        return std::nullopt;
    return Finding{
        Fault::range, text("the text of the file says other ends than the camera, which has ", ours), {{keys}}};
}

Doubt refusal(const Subject& subject) {
    if (invalid_of(subject) == subject.look.pixels) {
        Finding why = reason(subject, statistics_of(subject), "no pixel has a depth: ");
        why.fault = Fault::nothing_measured;
        return why;
    }
    return no_depth_doubt(subject);
}

std::vector<Finding> untried_doubts(const Subject& subject) {
    const Camera& camera = subject.camera;
    const bool distances = counts_distances(camera.encoding), float_distances = distances && is_float(subject.storage);
    std::vector<Finding> said;
    const auto add = [&](const Doubt& doubt) {
        if (doubt)
            said.push_back(*doubt);
        return doubt.has_value();
    };
    // What the codes are comes first: all else that is seen follows from it.
    if (add(bits_doubt(subject)) || add(picture_doubt(subject)) || add(panorama_doubt(subject)))
        return said;
    const bool is_invalid = add(invalid_doubt(subject)), is_buffer = add(buffer_doubt(subject));
    const bool is_bent = !is_buffer &&
                         (!is_invalid || camera.lens) && // behind the camera values along its axis are below 0
                         add(flat_surfaces_doubt(subject));
    if (!is_bent || !said.back().has_no_unit)
        add(unit_doubt(subject, distances));
    if (float_distances)
        add(sky_doubt(subject));
    if (!is_invalid) // or holes would be told twice
        add(special_number_doubt(subject));
    if (is_bent || !add(soft_edges_doubt(subject)))
        add(filtered_doubt(subject));
    add(projection_doubt(camera.projection));
    if (said.empty()) {
        add(range_doubt(subject));
        add(clipped_doubt(subject));
    }
    if (said.empty())
        add(normalised_doubt(subject));
    return said;
}

namespace {

std::vector<std::string> in_words(const std::vector<Finding>& findings) {
    std::vector<std::string> said;
    for (const Finding& finding : findings)
        said.push_back(in_words(finding));
    return said;
}

std::vector<std::string> doubts_of(const Camera& camera, const HostDepth& stored, Closely closely) {
    check_size(camera, stored);
    const Subject subject(camera, stored, closely);
    if (subject.look.invalid == subject.look.pixels) // what was measured may lie between
        return in_words(doubts(Subject(camera, stored, Closely::whole)));
    return in_words(doubts(subject));
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
    const Subject subject(camera, stored, Closely::most);
    UnsaidDoubts found{no_depth_doubt(subject), special_number_doubt(subject)};
    if (!found.bits)
        found.bits = bits_doubt(subject);
    return found;
}

std::vector<std::string> depth_doubts(const Camera& camera, const HostDepth& stored) {
    return doubts_of(camera, stored, Closely::most);
}

DepthSketch sketch_of(const HostDepth& stored) {
    constexpr int side = 16;
    std::vector<double> values;
    for (int y = 0; y < stored.height; y += 1 + stored.height / side)
        for (int x = 0; x < stored.width; x += 1 + stored.width / side)
            visit_values(part_of(stored, x, y, 1, 1), [&](float value, std::uint32_t) {
                if (std::isfinite(value) && value != 0)
                    values.push_back(std::abs(static_cast<double>(value)));
            });
    return {stored.storage, stored.width, stored.height, values.empty() ? 0 : quantile(std::move(values))};
}

bool are_alike(const DepthSketch& one, const DepthSketch& other) {
    const auto [less, more] = std::minmax(one.typical, other.typical);
    return one.storage == other.storage && one.width == other.width && one.height == other.height && more <= 4 * less;
}

std::vector<std::string> radius_doubts(const Camera& camera, const HostDepth& stored, double radius) {
    description::Check{}("radius", radius, description::ssao_radius);
    check_size(camera, stored);
    return radius_doubts(Subject(camera, stored, Closely::most), radius);
}

std::vector<std::string> lens_doubts(const Camera& camera, const HostDepth& stored, const LensArguments& lens,
                                     const CircleOfConfusion& circle, Sky sky, double max_coc_px,
                                     const LensWords& words) {
    check_size(camera, stored);
    return lens_doubts(Subject(camera, stored, Closely::most), lens, circle, sky, max_coc_px, words);
}

std::vector<std::string> depth_doubts_of_sample(const Camera& camera, const HostDepth& stored) {
    return doubts_of(camera, stored, Closely::some);
}

} // namespace fathom
