// Numbers that programs write where there is no depth, and that are no depth unless they are said to be.
//
// OpenCV's reprojectImageTo3D writes 10000, libSGM 65520 and more, half floats end at 65504, Blender's sky is 1e10, GDAL's nodata are
// often -9999 or -32768, and codes of n bits are full. A surface seldom has such a depth, and if it has it, then other surfaces lie
// just beside it: only a number that many pixels share and that stands apart from all others is told.
#include "camera/form.hpp"
#include "camera/photograph.hpp"
#include "doubts/look.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace fathom {
namespace {

constexpr double many_of_a_number = 0.001;   // of the pixels
constexpr double many_without_depth = 0.1;   // of the pixels, where a number has no depth anyway
constexpr double many_before_all = 0.2;      // of the pixels, for a surface that is nearer than all else
constexpr std::size_t least_pixels = 8;      // of the sampled ones
constexpr double many_alone = 0.005;         // of the pixels, with the number and without a neighbour that has it
constexpr double many_at_the_near = 0.02;    // of the pixels, that no scene has on the near plane itself
constexpr double apart = 1.25;               // times the value farthest out
constexpr double round_apart = 1.5;          // the same for blocks of 1000, 10000 and so on, which are distances, too
constexpr std::size_t many_steps = 10;       // steps by one code for so many pixels without any
constexpr double no_wall = 10;               // times that, before which no room has a wall
constexpr double apart_of_range = 0.25;      // of the range of all others, where a ratio says nothing
constexpr double above_nothing = 0.01;       // of the largest value: what is nearer may begin at 0
constexpr double near_gap = 0.05;            // of the range of all others
constexpr double many_filtered = 0.3;        // of the borders of what has no depth
constexpr double many_filtered_buffer = 0.6; // the same of depth buffers, in which far surfaces are near the sky
constexpr std::size_t least_filtered = 32;   // borders
// Where the number is so many times the surface's depth, hardly anything else lies between, and fewer borders tell.
constexpr float far_off_times = 1000;
constexpr double many_of_far = 0.1;
constexpr std::size_t least_of_far = 8;
constexpr std::size_t least_of_side = 12; // borders, that speak for themselves
// Beside a pixel without depth, one that lies between its number and the surface that follows was made by a filter. Cubic filters
// and Lanczos's then go beyond the surface, which a sphere's rim does not, and come to rest later.
constexpr std::size_t blend_px = 4, ring_px = 7; // behind the border, where the surface rests
constexpr float raw_kinect_highest = 1100;       // of the values that its 11 bits have
constexpr float raw_kinect_none = 2047;          // which may be shifted left by three

constexpr double many_at_an_end = 0.05; // of the pixels, that lie where a range was cut off,
constexpr double least_end = 10;        // scene units: walls are nearer

constexpr bool is_round(double number) {
    return number >= 1e3 && number < 1e10 && number == std::round(number) &&
           std::abs(std::log10(number) - std::round(std::log10(number))) < 1e-12;
}

// Does a number have two digits at most, as people write the end of a range?
bool is_written(double number) {
    const double power = std::pow(10, std::floor(std::log10(number)) - 1), digits = number / power;
    return std::abs(digits - std::round(digits)) < 1e-5;
}

// The values at both ends of all, where so many pixels of a sample share them that they may stand for something.
std::vector<float> shared_ends(const HostDepth& stored) {
    constexpr int columns = 48, rows = 16;
    constexpr std::size_t few = 4;
    std::vector<float> values;
    for (int y = 0; y < stored.height; y += 1 + stored.height / rows)
        for (int x = 0; x < stored.width; x += 1 + stored.width / columns)
            visit_values(part_of(stored, x, y, 1, 1), [&](float value, std::uint32_t) {
                if (std::isfinite(value))
                    values.push_back(value);
            });
    std::vector<float> shared;
    for (const bool low : {true, false}) {
        if (values.empty())
            break;
        const float end = low ? *std::ranges::min_element(values) : *std::ranges::max_element(values);
        if (static_cast<std::size_t>(std::ranges::count(values, end)) >= few)
            shared.push_back(end + 0.0f); // not -0
    }
    return shared;
}

// Where values count backwards, such numbers often have the other sign, too.
std::vector<float> numbers_without_depth(bool backwards) {
    std::vector<float> numbers{-32768, -9999, 0, 9999, 8 * raw_kinect_none, 32768, 65504, 1e10f};
    for (int bits = 8; bits <= 24; ++bits)
        numbers.push_back(static_cast<float>((1 << bits) - 1));
    for (int code = 65520; code < 65535; ++code)
        numbers.push_back(static_cast<float>(code));
    for (double power = 1e3; power < 1e10; power *= 10)
        numbers.push_back(static_cast<float>(power));
    if (backwards)
        for (std::size_t i = numbers.size(); i-- > 0;)
            numbers.push_back(0 - numbers[i]);
    std::ranges::sort(numbers);
    // not std::ranges::unique, whose result clang 14 cannot build with GCC 12's library
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
}

// The stored value of the near plane. None where the encoding has none.
std::optional<float> near_code(const Camera& camera, const DepthForm& form, Storage storage) {
    if (is_metric(camera.encoding) || camera.encoding == Encoding::median)
        return std::nullopt;
    const double end =
        camera
            .depth_range[form.farther * static_cast<float>(camera.depth_range[1] - camera.depth_range[0]) > 0 ? 0 : 1] *
        storage_max(storage);
    return static_cast<float>(is_float(storage) ? end : std::round(end));
}

// How many pixels hold a number, and between which values all others with a depth lie.
struct Others {
    std::size_t count = 0, surfaces = 0;
    double least = std::numeric_limits<double>::infinity(), greatest = -least;
};

Others others_than(float number, const Subject& subject) {
    Others found;
    subject.each([&](const HostDepth& values, const HostFloats& z) {
        std::size_t i = 0;
        const auto width = static_cast<std::size_t>(z.width);
        visit_values(values, [&](float value, std::uint32_t) {
            const float depth = row_of(z, static_cast<int>(i / width))[i % width];
            ++i;
            if (value == number)
                ++found.count;
            else if (std::isfinite(depth)) {
                ++found.surfaces;
                found.least = std::min(found.least, static_cast<double>(value));
                found.greatest = std::max(found.greatest, static_cast<double>(value));
            }
        });
    });
    return found;
}

// Of values that are not below 0.
bool stands_apart(double number, Others others, bool has_depth, bool is_float, bool is_scattered) {
    const double range = others.greatest - others.least;
    if (number < 0 && !has_depth) // which no length is
        return true;
    if (number > others.greatest)
        return number >= (is_round(number) && !is_scattered ? round_apart : apart) * others.greatest;
    if (number == 0 && !has_depth) // all that is seen is larger
        return others.least > std::max(above_nothing * others.greatest, is_float ? 0.0 : 8.0);
    return number < others.least &&
           (others.least - number > apart_of_range * range || (number > 0 && apart * number <= others.least));
}

// A number that many pixels hold, and what tells whether it is a depth.
struct SharedNumber {
    double stored, z; // z is its depth, if it has one
    bool has_depth, is_far_disparity, is_scattered, is_listed;
    bool are_below; // are all others 0 at most?
    Others others;  // counted forwards
    std::size_t count, pixels;

    bool are_at_least(double part) const { return static_cast<double>(count) >= part * static_cast<double>(pixels); }
    std::string holders() const { return text(percent(count, pixels), " of the pixels hold "); }
};

// None where few pixels hold it, and where it is said, or told elsewhere, what it means.
std::optional<SharedNumber> shared_number(const Subject& subject, const DepthForm& form, const Rays& rays,
                                          std::size_t i) {
    const Camera& camera = subject.camera;
    const SharedNumbers& shared = subject.numbers;
    const bool floats = is_float(subject.storage);
    const float number_here = shared.numbers[i];
    if (shared.counts[i] < least_pixels ||
        !(static_cast<double>(shared.counts[i]) > many_of_a_number * static_cast<double>(shared.pixels)))
        return std::nullopt;
    SharedNumber found{};
    found.stored = static_cast<double>(number_here);
    found.z = static_cast<double>(view_depth(form, rays, 0.5 * camera.width, 0.5 * camera.height, found.stored));
    const StoredKind kind = kind_of(form, number_here, bits_of_value(number_here, subject.storage));
    found.is_far_disparity = camera.encoding == Encoding::inverse && !floats && !camera.background && number_here == 0;
    const float ahead = camera.scale < 0 ? -number_here : number_here;
    const bool as_sky = floats && camera.encoding != Encoding::inverse && // which `sky_doubt` tells
                        (ahead == 65504 || ahead >= 1e9f);
    found.has_depth =
        number_here >= form.lowest && number_here <= form.highest && found.z > static_cast<double>(form.least_depth);
    const bool is_said = kind == StoredKind::missing || (kind == StoredKind::background && !found.is_far_disparity);
    if (is_said || as_sky || (!found.has_depth && ahead > 0))
        return std::nullopt;
    found.is_listed =
        !is_metric(camera.encoding) || std::ranges::binary_search(numbers_without_depth(camera.scale < 0), number_here);
    found.others = others_than(number_here, subject);
    Others& others = found.others;
    found.are_below = is_metric(camera.encoding) && others.greatest <= 0;
    if (found.are_below)
        others = {others.count, others.surfaces, -others.greatest, -others.least};
    // Of a sample of few pixels, rows tell more.
    const bool is_of_rows = others.count < least_pixels;
    found.count = is_of_rows ? shared.counts[i] : others.count;
    found.pixels = is_of_rows ? shared.pixels : subject.look.pixels;
    found.is_scattered = 2 * shared.pairs[i] < shared.counts[i] ||
                         (shared.alone[i] >= least_pixels &&
                          static_cast<double>(shared.alone[i]) > many_alone * static_cast<double>(shared.pixels));
    // Something small that is seen straight on may be nearer than all else.
    const bool may_be_near = found.has_depth && !found.is_scattered && counts_distances(camera.encoding) &&
                             (camera.scale < 0) == found.are_below && std::abs(found.stored) < others.least;
    const double many = may_be_near                                   ? many_before_all
                        : !found.has_depth && !found.is_far_disparity ? many_without_depth
                        : found.is_listed                             ? many_of_a_number
                                                                      : many_at_an_end;
    // Of other numbers than programs are known for, those that people write as the end of a range stand for what lies beyond.
    const bool is_an_end = form.perspective && counts_distances(camera.encoding) && found.z >= least_end &&
                           is_written(std::abs(found.stored)) && std::abs(found.stored) > others.greatest;
    return others.surfaces > 0 && found.are_at_least(many) && (found.is_listed || !found.has_depth || is_an_end)
               ? std::optional(found)
               : std::nullopt;
}

// The number as what was not measured, or as nothing at all.
std::vector<Cure> cures_of(double value) {
    return {{{{"missing", value}}, "if nothing was measured there"},
            {{{"background", value}}, {}, text("if nothing is there, \"background\": ", number(value, 9))}};
}

std::optional<Finding> near_plane_doubt(const SharedNumber& found, const Subject& subject, float farther) {
    const Camera& camera = subject.camera;
    const Others& others = found.others;
    const double gap = farther > 0 ? others.least - found.stored : found.stored - others.greatest;
    if (!found.are_at_least(many_at_the_near) || subject.look.background > 0 ||
        !(gap > near_gap * (others.greatest - others.least) || found.are_at_least(many_before_all)))
        return std::nullopt;
    const bool is_window = camera.encoding == Encoding::window, is_parallel = !camera.projection.is_perspective();
    const Key turned{"depth_range", std::array{camera.depth_range[1], camera.depth_range[0]}};
    Cure cure{{turned}, "if that is the sky, the values count the other way"};
    if (is_window && is_parallel && found.z > static_cast<double>(subject.look.nearest)) {
        const Projection& projection = camera.projection;
        const auto end_at = [m = projection.matrix_in_opengl_axes()](long double clip) {
            return static_cast<double>((m(2, 3) - clip) / m(2, 2));
        };
        cure = {{{"orthographic", std::array{end_at(projection.clip_far()), end_at(projection.clip_near())}}, turned},
                "if that is the sky, \"near\" and \"far\" are exchanged"};
    } else if (is_window && !is_parallel) {
        cure.when = "if that is the sky, \"reversed\" is the wrong way round";
    } else if (camera.encoding == Encoding::linear && camera.near_plane && camera.far_plane) {
        cure = {{{"near", *camera.far_plane}, {"far", *camera.near_plane}}, "if that is the sky, near is white"};
    }
    return Finding{
        Fault::number,
        text(found.holders(), number(found.stored), ", which is the near plane, and nothing lies just behind it"),
        {cure, cures_of(found.stored).front()}};
}

std::optional<Finding> no_distance_doubt(const SharedNumber& found, const SharedNumbers& shared, std::size_t i,
                                         bool floats) {
    const Others& others = found.others;
    const double value = found.are_below ? -found.stored : found.stored;
    // A wall that is seen straight on has one depth, too. A slanted one has steps where its codes are coarse.
    const bool may_be_wall = found.has_depth && !found.is_far_disparity && !found.is_scattered &&
                             many_steps * shared.gradual < shared.constant &&
                             2 * shared.constant >= std::min(shared.pairs[i], shared.pixels - shared.counts[i]) &&
                             std::abs(found.stored) < std::min(65504.0, no_wall * others.greatest);
    if (may_be_wall ||
        (!found.is_far_disparity && !stands_apart(value, others, found.has_depth, floats, found.is_scattered)))
        return std::nullopt;
    const std::string key = number(found.stored, 17);
    const double unit = found.stored / static_cast<double>(raw_kinect_none);
    if ((unit == 1 || unit == 8) && !floats) {
        const double scale = -351.3 * unit, offset = -1092.5 * unit;
        if (others.greatest <= unit * static_cast<double>(raw_kinect_highest))
            return Finding{
                Fault::number,
                text(found.holders(), key, ", and no other value is above ", number(others.greatest),
                     ", as in the raw 11 bits of a Kinect", unit == 8 ? " that are shifted by three" : ""),
                {{{{"encoding", Encoding::inverse}, {"scale", scale}, {"offset", offset}, {"missing", found.stored}},
                  "if it is one, which makes metres"},
                 {{{"missing", found.stored}}, "otherwise"}}};
        if (unit == 8)
            return std::nullopt;
    }
    Finding finding{Fault::number,
                    text(found.holders(), key, ", which stands apart from all other values, ",
                         number(found.are_below ? -others.greatest : others.least, 4), " to ",
                         number(found.are_below ? -others.least : others.greatest, 4), ", and counts as ",
                         found.is_far_disparity ? "infinitely far"
                         : found.has_depth      ? text("a depth of ", number(found.z, 4))
                                                : "no depth at all"),
                    cures_of(found.stored)};
    if (!found.is_listed && found.has_depth) {
        finding.cause += "; distances may be cut off there";
        finding.cures = {{{{"background_from", found.stored}}, "if nothing is there"}, cures_of(found.stored).front()};
    }
    return finding;
}

} // namespace

SharedNumbers::SharedNumbers(const Camera& camera, const HostDepth& stored)
    : form_(depth_form(straightened(camera), stored.storage)), are_integers_(!is_float(stored.storage)),
      counts_distances_(form_.perspective && counts_distances(camera.encoding)) {
    if (is_metric(camera.encoding)) {
        numbers = numbers_without_depth(camera.scale < 0);
        for (const float end : shared_ends(stored))
            if (!std::ranges::binary_search(numbers, end))
                numbers.insert(std::ranges::upper_bound(numbers, end), end);
    } else if (const auto code = near_code(camera, form_, stored.storage))
        numbers = {*code};
    const bool is_near_end = camera.encoding == Encoding::window; // where most surfaces are
    if (!is_metric(camera.encoding) && !is_near_end)
        borders.least_gap = static_cast<float>(0.2 * storage_max(stored.storage) *
                                               std::abs(camera.depth_range[1] - camera.depth_range[0]));
    counts.resize(numbers.size());
    pairs.resize(numbers.size());
    alone.resize(numbers.size());
    for (const float number : numbers)
        marks_.set(mark_of(number));
}

void SharedNumbers::count(float value, float left, float right, float& before) {
    const bool is_pair = value == left;
    ++pixels;
    const auto found = marks_[mark_of(value)] ? std::ranges::lower_bound(numbers, value) : numbers.end();
    if (found != numbers.end() && *found == value) {
        const auto i = static_cast<std::size_t>(found - numbers.begin());
        ++counts[i];
        pairs[i] += is_pair;
        alone[i] += !is_pair && value != right;
    } else {
        constant += is_pair && value == before;
        const auto is_next = [&](float other) { return std::abs(value - other) == 1; };
        gradual += are_integers_ && (is_next(left) || is_next(before));
    }
    before = value;
}

void SharedNumbers::add_some(const HostDepth& row, int step) {
    before_.resize(static_cast<std::size_t>(row.width), std::numeric_limits<float>::quiet_NaN());
    for (int x = 1; x < row.width; x += step) {
        float three[3]{}, *next = three;
        const int pixels = std::min(3, row.width - (x - 1));
        visit_values(part_of(row, x - 1, 0, pixels, 1), [&](float value, std::uint32_t) { *next++ = value; });
        count(three[1], three[0], three[pixels - 1], before_[static_cast<std::size_t>(x)]);
    }
}

void SharedNumbers::add(const HostDepth& row) {
    std::vector<LineBorders::Value> values;
    values.reserve(static_cast<std::size_t>(row.width));
    before_.resize(static_cast<std::size_t>(row.width), std::numeric_limits<float>::quiet_NaN());
    visit_values(row, [&](float value, std::uint32_t bits) {
        values.push_back(LineBorders::value_of(form_, counts_distances_, value, bits));
    });
    for (std::size_t x = 0; x < values.size(); ++x) // what is cut off at an end goes on there
        count(values[x].first, x > 0 ? values[x - 1].first : NAN, values[std::min(x + 1, values.size() - 1)].first,
              before_[x]);
    borders.add(values, form_, counts_distances_);
}

LineBorders SharedNumbers::borders_of_columns(const Subject& subject) const {
    constexpr int most_columns = 128;
    const HostDepth& values = subject.whole;
    const int width = values.width, across = 1 + width / most_columns;
    std::vector<std::vector<LineBorders::Value>> columns(static_cast<std::size_t>((width + across - 1) / across));
    for (int y = 0; y < values.height; ++y) // for the sake of caches
        for (int x = 0; x < width; x += across)
            visit_values(part_of(values, x, y, 1, 1), [&](float value, std::uint32_t bits) {
                columns[static_cast<std::size_t>(x / across)].push_back(
                    LineBorders::value_of(form_, counts_distances_, value, bits));
            });
    LineBorders found{.least_gap = borders.least_gap};
    for (const auto& column : columns)
        found.add(column, form_, counts_distances_);
    return found;
}

LineBorders::Value LineBorders::value_of(const DepthForm& form, bool counts_distances, float value,
                                         std::uint32_t bits) {
    const bool is_ahead = !counts_distances || value * form.farther > 0; // the others have no depth, named or not
    return {value, kind_of(form, value, bits) != StoredKind::depth || !is_ahead};
}

void LineBorders::add(std::span<const Value> values, const DepthForm& form, bool counts_distances) {
    if (std::ranges::none_of(values, &Value::second))
        return;
    const auto look_from = [&](std::size_t side, const auto& at) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            std::size_t depths = 0;
            while (at(i).second && depths < ring_px + 1 && i + depths + 1 < values.size() && !at(i + depths + 1).second)
                ++depths;
            if (depths == 0)
                continue;
            const float number = at(i).first;
            if (i >= 2 && at(i - 1).second && at(i - 1).first == at(i - 2).first) {
                ++of_background.count;
                const float before = at(i - 1).first, behind = at(i + 1).first;
                of_background.filtered += (number - before) * (behind - number) > 0;
            }
            // How far a pixel behind the border is on the way to the surface that rests so many pixels behind it.
            const auto way = [&](std::size_t rest, std::size_t k) {
                return (at(i + k).first - number) / (at(i + rest).first - number);
            };
            const auto is_border = [&](std::size_t rest, float least) {
                const auto rests = [&](std::size_t k) { return std::abs(way(rest, k) - 1) <= least; };
                return depths > rest && std::isfinite(at(i + rest).first - number) && rests(rest - 1) &&
                       rests(rest + 1);
            };
            // A rounded surface turns away at its silhouette, but not as far as to the middle between it and the sky; and those that are
            // near to the end of a range may.
            const auto is_between = [](float part) { return part > 0.1f && part < 0.65f; };
            if (is_border(blend_px, 0.02f) && std::abs(at(i + blend_px).first - number) >= least_gap) {
                ++blended[side].count;
                blended[side].filtered += is_between(way(blend_px, 1));
                if (std::abs(number) >= far_off_times * std::abs(at(i + blend_px).first)) {
                    ++far_off.count;
                    far_off.filtered += is_between(way(blend_px, 1));
                }
            }
            if (is_border(ring_px, 0.05f)) {
                bool swings = false;
                for (std::size_t k = 2; k + 2 < ring_px; ++k)
                    swings |= way(ring_px, k) > 1.03f;
                ++swinging[side].count;
                swinging[side].filtered += swings && is_between(way(ring_px, 1));
            }
            // Cubic filters overshoot: from a number that stands for far away they may lead past 0 within a few pixels.
            if (counts_distances && depths < blend_px && i + depths + 1 < values.size() && std::isfinite(number)) {
                const float beyond = at(i + depths + 1).first / number;
                if (number * form.farther > 0 && beyond < -0.005f && beyond > -0.2f &&
                    is_between(at(i + depths).first / number)) {
                    ++swinging[side].count;
                    ++swinging[side].filtered;
                }
            }
        }
    };
    look_from(0, [&](std::size_t i) { return values[i]; });
    look_from(1, [&](std::size_t i) { return values[values.size() - 1 - i]; });
}

std::optional<Finding> special_number_doubt(const Subject& subject) {
    const DepthForm form = depth_form(straightened(subject.camera), subject.storage);
    const Rays rays = is_along_ray(form) ? camera_rays(subject.camera) : Rays{};
    for (std::size_t i = 0; i < subject.numbers.numbers.size(); ++i)
        if (const auto found = shared_number(subject, form, rays, i))
            if (const auto doubt = is_metric(subject.camera.encoding)
                                       ? no_distance_doubt(*found, subject.numbers, i, is_float(subject.storage))
                                       : near_plane_doubt(*found, subject, form.farther))
                return doubt;
    return std::nullopt;
}

std::optional<Finding> filtered_doubt(const Subject& subject) {
    const Encoding encoding = subject.camera.encoding;
    if (!subject.camera.projection.is_perspective() &&
        (encoding == Encoding::inverse || encoding == Encoding::inverse_range))
        return std::nullopt; // which have surfaces behind the camera, whose values are no codes
    const double many = is_metric(encoding) ? many_filtered : many_filtered_buffer;
    const auto are_many = [&](const FilteredBorders& borders) {
        return static_cast<double>(borders.filtered) > many * static_cast<double>(borders.count);
    };
    std::optional<FilteredBorders> told;
    const auto look_at = [&](const LineBorders& borders) {
        const FilteredBorders& far_off = borders.far_off;
        if (borders.of_background.filtered >= least_filtered && are_many(borders.of_background))
            told = borders.of_background;
        if (far_off.filtered >= least_of_far &&
            static_cast<double>(far_off.filtered) > many_of_far * static_cast<double>(far_off.count))
            told = far_off;
        for (const auto& sides : {borders.blended, borders.swinging}) {
            const FilteredBorders all{sides[0].count + sides[1].count, sides[0].filtered + sides[1].filtered};
            // Something narrow casts its shadow on one side.
            if (!told && all.filtered >= least_filtered && are_many(all) &&
                std::ranges::all_of(sides,
                                    [&](const auto& side) { return side.count < least_of_side || are_many(side); }))
                told = all;
        }
    };
    look_at(subject.numbers.borders);
    if (!told && subject.closely != Closely::some && subject.look.surfaces() < subject.look.pixels)
        look_at(subject.numbers.borders_of_columns(subject));
    if (!told)
        return std::nullopt;
    return Finding{Fault::filtered,
                   text("beside pixels without depth ", percent(told->filtered, told->count),
                        " of the values lie between theirs and the surface's, which are no depths: it was filtered or "
                        "resized, or a renderer has averaged it"),
                   {},
                   "resize with the nearest pixel (cv::INTER_NEAREST) and render depth without antialiasing, or make "
                   "its edges hard again (--edges sharpen)"};
}

// Edges that ramp over some pixels, as no surface makes them.
std::optional<Finding> soft_edges_doubt(const Subject& subject) {
    if (subject.closely == Closely::some)
        return std::nullopt;
    constexpr int most_lines = 48; // rows, and columns
    constexpr float part = 0.05f;  // of 1/z, or of the range of z
    const HostDepth& whole = subject.whole;
    const bool inverse = subject.camera.lens || subject.camera.projection.is_perspective();
    const float least = inverse ? 0 : part * (subject.look.farthest - subject.look.nearest);
    EdgeCounts edges;
    const auto count = [&](const HostDepth& line, int x, int y, int across, int down) {
        std::vector<float> nearness, distances;
        visit_values(line, [&](float value, std::uint32_t bits) {
            const float z = distances.emplace_back(subject.depth(x, y, value, bits));
            nearness.push_back(inverse ? 1 / z : -z);
            x += across;
            y += down;
        });
        edges.add(nearness, least, inverse ? part : 0);
        edges.add_distances(distances);
    };
    for (int y = 0; y < whole.height; y += 1 + whole.height / most_lines)
        count(part_of(whole, 0, y, whole.width, 1), 0, y, 1, 0);
    for (int x = 0; x < whole.width; x += 1 + whole.width / most_lines)
        count(part_of(whole, x, 0, 1, whole.height), x, 0, 0, 1);
    const bool are_soft = edges.are_soft() && edges.soft >= 6 * edges.hard;
    const bool are_means = edges.are_means() && counts_distances(subject.camera.encoding); // mist is always filtered
    if (!are_soft && !are_means)
        return std::nullopt;
    const auto [some, others] = are_soft ? std::pair(edges.soft, edges.hard) : std::pair(edges.means, edges.clean);
    return Finding{Fault::filtered,
                   text(percent(some, some + others),
                        are_soft
                            ? " of its edges are ramps of some pixels, as in depth that was averaged, enlarged, or "
                              "made by a network"
                            : " of its edges are means of both sides, as a renderer makes them that filters depth "
                              "like light"),
                   {},
                   "--edges sharpen makes them hard"};
}

} // namespace fathom
