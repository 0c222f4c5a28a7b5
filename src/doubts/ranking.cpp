// What stored depth could be, from how it varies over planes, its range and the values that stand apart.
#include <fathom/ranking.hpp>

#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/planes.hpp"
#include "doubts/stored_values.hpp"
#include "quantile.hpp"
#include "require.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace fathom {
namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t least_patches = 12, least_places = 3; // below that, planes have said too little
constexpr double least_flat = 0.15;                         // of the smooth patches, that must be flat
constexpr double most = 0.9, hardly_any = 0.02;             // of the patches, that the right reading fits and fails
constexpr double many = 0.1;                                // of the patches, that every other reading fails
constexpr double many_pixels = 0.001;                       // of the pixels, that make a value stand apart
constexpr double clear_gap = 0.05;                          // of the range, that make a value stand apart
constexpr double scattered = 0.25; // of a value's pixels, that touch others: above that they are holes and no sky
constexpr double thin = 1.2;       // farthest over nearest distance, below which a scene is a relief
constexpr double huge = 1e9;       // no distance
constexpr double largest_half = 65504;
constexpr std::size_t least_limbs = 40; // pixels at rounded silhouettes that tell what is near
constexpr std::size_t clear_majority = 3;

// Pixels that hold one value.
struct Apart {
    double value = 0;
    std::size_t pixels = 0;
    bool stands_apart = false, is_scattered = false;
};

struct Values {
    std::vector<float> all; // NaN where they are not finite, and then where they stand apart
    int width, height;
    double largest_code; // of the storage; 1 for floats
    bool is_float;

    float& at(int x, int y) {
        return all[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
};

struct Range {
    double least = std::numeric_limits<double>::infinity(), greatest = -least;
    std::size_t count = 0;
    double size() const { return greatest - least; }
};

Range range_without(const Values& values, double left_out) {
    Range found;
    for (const float value : values.all)
        if (const auto v = static_cast<double>(value); !std::isnan(v) && v != left_out) {
            found.least = std::min(found.least, v);
            found.greatest = std::max(found.greatest, v);
            ++found.count;
        }
    return found;
}

// Looks at the pixels that hold a value at an end of the range.
Apart look_at(Values& values, double value) {
    Apart found{value};
    std::size_t edges = 0;
    const auto differs = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < values.width && y < values.height &&
               static_cast<double>(values.at(x, y)) != value;
    };
    for (int y = 0; y < values.height; ++y)
        for (int x = 0; x < values.width; ++x)
            if (static_cast<double>(values.at(x, y)) == value) {
                ++found.pixels;
                edges += differs(x - 1, y) || differs(x + 1, y) || differs(x, y - 1) || differs(x, y + 1);
            }
    const Range rest = range_without(values, value);
    const double gap = value > rest.greatest ? value - rest.greatest : rest.least - value;
    const auto pixels = static_cast<double>(found.pixels);
    found.stands_apart =
        rest.count > 0 && found.pixels > 1 &&
        (pixels > many_pixels * static_cast<double>(values.all.size()) || gap > clear_gap * rest.size());
    found.is_scattered = static_cast<double>(edges) > scattered * pixels;
    return found;
}

// A rounded surface turns away at its silhouette: its depth runs ever faster towards that of what lies behind it,
// whatever the encoding. Counts the pixels at which lesser values do so, and greater ones.
struct Limbs {
    std::size_t near_is_less = 0, near_is_more = 0;
};

Limbs limbs_of(Values& values, double rounding) {
    Limbs found;
    const auto runs_over = [&](const double(&v)[5]) { // the edge lies between the last two
        const double first = v[1] - v[0], second = v[2] - v[1], third = v[3] - v[2], jump = v[4] - v[3];
        const double sign = jump < 0 ? -1 : 1;
        return sign * first > 8 * rounding && sign * second > 1.1 * sign * first &&
               sign * third > 1.15 * sign * second && sign * jump > 3 * sign * third;
    };
    const auto look = [&](int x, int y, int dx, int dy) {
        double v[5];
        for (int i = 0; i < 5; ++i)
            v[i] = static_cast<double>(values.at(x + i * dx, y + i * dy));
        if (runs_over(v))
            ++(v[4] > v[3] ? found.near_is_less : found.near_is_more);
        std::reverse(std::begin(v), std::end(v));
        if (runs_over(v))
            ++(v[4] > v[3] ? found.near_is_less : found.near_is_more);
    };
    for (int y = 0; y < values.height; ++y)
        for (int x = 0; x < values.width; ++x) {
            if (x + 4 < values.width)
                look(x, y, 1, 0);
            if (y + 4 < values.height)
                look(x, y, 0, 1);
        }
    return found;
}

double median_of(std::vector<float> values) {
    std::erase_if(values, [](float value) { return std::isnan(value); });
    return values.empty() ? NAN : static_cast<double>(quantile(std::move(values)));
}

enum class Near { unknown, less, more };

// All that is known of an image.
struct Findings {
    Values values;
    Apart zero, top;
    Range range; // of what does not stand apart
    double median = NAN;
    bool infinite = false;
    bool backwards = false; // all values were below 0, and have the other sign here
    Near by_silhouettes = Near::unknown;
    Near near = Near::unknown; // by these, and by a sky if values are affine in the pixel over planes
    PlaneFits planes;

    // How the best of some shapes fits; none where planes told nothing.
    ShapeFit best_of(const std::vector<Shape>& shapes) const {
        ShapeFit best;
        best.fails = planes.patches;
        for (const ShapeFit& fit : planes.shapes)
            if (std::ranges::find(shapes, fit.shape) != shapes.end() && fit.fits > best.fits)
                best = fit;
        return best;
    }

    double part(std::size_t patches) const {
        return planes.patches == 0 ? 0 : static_cast<double>(patches) / static_cast<double>(planes.patches);
    }
    double part(const std::vector<Shape>& shapes) const { return part(best_of(shapes).fits); }

    double parameter(Shape shape) const {
        for (const ShapeFit& fit : planes.shapes)
            if (fit.shape == shape)
                return fit.parameter;
        return NAN;
    }

    double sign() const { return backwards ? -1 : 1; }
    bool in_unit_range() const { return values.is_float && !backwards && range.least >= 0 && range.greatest <= 1; }
};

// What is affine in the pixel over planes.
enum class Kind { unknown, value, reciprocal, over_ray, times_ray, exponent, panorama, curve };

struct KindShapes {
    Kind kind;
    std::vector<Shape> shapes;
    const char* words;
};

const std::vector<KindShapes>& kinds() {
    static const std::vector<KindShapes> all{
        {Kind::value, {Shape::affine}, "v (depth buffers, inverse depth, orthographic cameras)"},
        {Kind::reciprocal,
         {Shape::reciprocal, Shape::offset, Shape::reversed_offset},
         "1/(v + c) (distance along the axis)"},
        {Kind::over_ray, {Shape::ray}, "|ray|/v (distance along the ray)"},
        {Kind::times_ray, {Shape::inverse_ray}, "|ray| · v (inverse distance along the ray)"},
        {Kind::exponent, {Shape::logarithmic, Shape::exponential}, "exp(v) (logarithmic and exponential depth)"},
        {Kind::panorama, {Shape::panorama}, "1/v on the sphere (a picture of all directions)"},
        {Kind::curve, {Shape::display}, "1/(w + c), v = w through the curve of sRGB"},
    };
    return all;
}

// The one kind that fits nearly all patches, where each other one clearly fails many.
Kind kind_of(const Findings& found) {
    const PlaneFits& planes = found.planes;
    if (planes.patches < least_patches || planes.places < least_places ||
        static_cast<double>(planes.patches) < least_flat * static_cast<double>(planes.smooth))
        return Kind::unknown;
    Kind kind = Kind::unknown;
    ShapeFit winner;
    for (const KindShapes& each : kinds())
        if (const ShapeFit best = found.best_of(each.shapes);
            !best.at_limit && found.part(best.fits) >= most && best.fits > winner.fits) {
            kind = each.kind;
            winner = best;
        }
    if (found.part(winner.fails) > hardly_any)
        return Kind::unknown;
    for (const KindShapes& each : kinds()) {
        const ShapeFit best = found.best_of(each.shapes);
        const bool is_refuted =
            best.fails >= std::max(least_patches, 10 * winner.fails) && found.part(best.fails) >= many;
        const bool is_simpler = each.kind == Kind::curve && kind != Kind::exponent; // which bends as little as it likes
        if (each.kind != kind && !best.at_limit && !is_refuted && !is_simpler) // at its limit it is a simpler shape
            return Kind::unknown;
    }
    return kind;
}

// The file's keys for values that stand apart, with a comma before each.
std::string apart_keys(const Findings& found, bool zero_is_missing) {
    std::string keys;
    if (found.zero.stands_apart)
        keys += zero_is_missing ? ", \"missing\": 0" : ", \"background\": 0";
    if (found.top.stands_apart)
        keys += text(", \"background_from\": ", found.backwards ? "-" : "",
                     found.top.value >= 1e9 ? "1e9" : text(std::llround(found.top.value)));
    return keys;
}

const std::string assumed_view = R"("perspective": {"fov_y_deg": 60)";

std::string file(const std::string& keys) {
    return "{" + keys + "}";
}

Guess window_guess(const Findings& found, bool reversed) {
    return {Family::window_affine,
            reversed ? "depth-buffer values, reversed: 1 is the near plane"
                     : "depth-buffer values: 0 is the near plane",
            found.part({Shape::affine}),
            file(assumed_view + R"(, "near": 0.1, "far": )" +
                 (reversed ? R"("infinity", "reversed": true}, "clip_z": "zero-to-one")" : "100}") +
                 R"(, "encoding": "window")"),
            reversed ? "the angle of view, near, far and clip_z; an orthographic camera is possible, too"
                     : "the angle of view, near and far; an orthographic camera is possible, too"};
}

// How long a stored unit plausibly is: scene units are taken to be metres.
std::pair<std::string, double> plausible_unit(const Findings& found) {
    if (found.values.largest_code == 0xffffff)
        return {"CARLA's 1000 m/(2²⁴ − 1) is plausible", 1000.0 / 0xffffff};
    if (found.values.is_float ? found.median > 300 : found.median >= 200)
        return {"millimetres are plausible", 0.001};
    if (found.values.is_float)
        return {"metres are plausible", 1};
    return {"the unit is unknown", 1};
}

std::string scale_key(const Findings& found, double scale) {
    return found.sign() * scale == 1 ? std::string() : ", \"scale\": " + number(found.sign() * scale, 17);
}

Guess planar_guess(const Findings& found) {
    const double metric = found.part({Shape::reciprocal}), offset = found.part({Shape::offset}),
                 reversed = found.part({Shape::reversed_offset});
    const double fits = found.part({Shape::reciprocal, Shape::offset, Shape::reversed_offset});
    if (found.planes.patches > 0 && metric < fits - hardly_any) {
        // z is proportional to v + c, or to c - v where near is white: what v = 0 and the largest code mean, up to a factor
        const bool is_white_near = reversed > offset;
        const double largest = found.range.greatest;
        const bool is_long = // lengths, not 0 to 1
            found.backwards || (found.values.is_float && largest > found.values.largest_code);
        const double code = is_long ? largest : found.values.largest_code,
                     c = largest *
                         (is_white_near ? 1 + found.parameter(Shape::reversed_offset) : found.parameter(Shape::offset)),
                     at_code = is_white_near ? c - code : c + code, unit = 100 / std::max(c, at_code);
        const std::string range =
            is_long ? text(R"(, "depth_range": [0, )", found.sign() * code, "]") + apart_keys(found, false) : "";
        return {Family::planar,
                is_white_near ? "distance along the view axis, counted from a far plane"
                              : "distance along the view axis, counted from a near plane",
                fits,
                file(assumed_view +
                     text(R"(}, "encoding": "linear", "near": )", unit * c, R"(, "far": )",
                          unit * std::max(at_code, 1e-3 * c)) +
                     range),
                "the angle of view and the unit; near/far is measured"};
    }
    const auto [unit, scale] = plausible_unit(found);
    return {Family::planar, "distance along the view axis; " + unit, fits,
            file(assumed_view + R"(}, "encoding": "view-z")" + scale_key(found, scale) +
                 apart_keys(found, !found.values.is_float)),
            scale == 1 ? "the angle of view" : "the angle of view and the scale"};
}

Guess orthographic_guess(const Findings& found) {
    const auto [unit, scale] = plausible_unit(found);
    return {Family::planar, "distance along the view axis of an orthographic camera; " + unit,
            found.part({Shape::affine}),
            file(R"("orthographic": {"left": -1, "right": 1, "bottom": -1, "top": 1, "near": 0, "far": 100}, )"
                 R"("encoding": "view-z")" +
                 scale_key(found, scale) + apart_keys(found, !found.values.is_float)),
            "the six sides of the view, and the unit"};
}

Guess radial_guess(const Findings& found, bool is_measured) {
    const auto [unit, scale] = plausible_unit(found);
    const double degrees = is_measured ? 2 * std::atan(found.parameter(Shape::ray)) * 180 / std::numbers::pi : 60;
    return {Family::radial, "distance along the ray; " + unit, found.part({Shape::ray}),
            file(text(R"("perspective": {"fov_x_deg": )", std::round(100 * degrees) / 100,
                      R"(}, "encoding": "ray-distance")") +
                 scale_key(found, scale) + apart_keys(found, !found.values.is_float)),
            is_measured ? "the scale; the angle of view is measured, with the axis in the middle"
                        : "the angle of view"};
}

Guess panorama_guess(const Findings& found) {
    const auto [unit, scale] = plausible_unit(found);
    return {Family::radial, "distance along the ray of a picture of all directions (equirectangular); " + unit,
            found.part({Shape::panorama}),
            file(R"("lens": {"model": "equirectangular"}, "encoding": "ray-distance")" + scale_key(found, scale) +
                 apart_keys(found, !found.values.is_float)),
            "the scale"};
}

Guess inverse_guess(const Findings& found, bool along_ray = false) {
    return {Family::inverse, along_ray ? "inverse distance along the ray" : "inverse distance: disparity, or 1/z",
            found.part({along_ray ? Shape::inverse_ray : Shape::affine}),
            file(assumed_view + R"(}, "encoding": "inverse")" + (along_ray ? R"(, "along": "ray")" : "") +
                 text(R"(, "scale": )", found.sign(), R"(, "offset": 0)") +
                 (found.zero.stands_apart && !found.values.is_float ? R"(, "missing": 0)" : "") +
                 (found.infinite && !found.backwards ? R"(, "missing": "infinity")" : "")),
            "the angle of view, scale (baseline × focal length in pixels) and offset"};
}

Guess logarithmic_guess(const Findings& found) {
    const double logarithmic = found.part({Shape::logarithmic}), exponential = found.part({Shape::exponential});
    const bool is_exponential = exponential > logarithmic;
    // v = log(z/n)/log(f/n), or log(C z + 1)/log(C f + 1): the parameter is the logarithm, for the largest value
    const double parameter = found.parameter(is_exponential ? Shape::exponential : Shape::logarithmic);
    const double ratio = std::isnan(parameter)
                             ? 1000
                             : std::exp(std::min(parameter / found.range.greatest * found.values.largest_code, 50.0));
    return {
        Family::other, is_exponential ? "exponential depth" : "logarithmic depth", std::max(logarithmic, exponential),
        file(assumed_view + (is_exponential ? text(R"(}, "encoding": "exponential", "near": 0.1, "far": )", 0.1 * ratio)
                                            : text(R"(}, "encoding": "logarithmic", "log_c": 1, "far": )", ratio - 1))),
        is_exponential ? "the angle of view and near; far/near is measured"
                       : "the angle of view and log_c; log_c × far is measured"};
}

Guess curved_guess(const Findings& found) {
    const double p = found.parameter(Shape::display);
    return {Family::planar, "distance along the view axis through the curve of a display (sRGB)",
            found.part({Shape::display}),
            file(assumed_view +
                 text(R"(}, "encoding": "linear", "near": )", 100 * p / (1 + p), R"(, "far": 100, "gamma": "srgb")")),
            "the angle of view and the unit; near/far is measured"};
}

Guess median_guess(const Findings& found) {
    return {Family::other, "median depth, z/(z + m)", found.part({Shape::reciprocal}),
            file(assumed_view + R"(}, "encoding": "median", "median": 1)"), "the angle of view and the median m"};
}

// What is near, from what stands apart as a sky does, and from silhouettes.
void find_near(Findings& found, std::vector<std::string>& evidence) {
    const double rounding = found.values.is_float ? 0x1p-23 * found.range.greatest : 1;
    const Limbs limbs = limbs_of(found.values, rounding);
    const bool less = limbs.near_is_less >= least_limbs && limbs.near_is_less > clear_majority * limbs.near_is_more;
    const bool more = limbs.near_is_more >= least_limbs && limbs.near_is_more > clear_majority * limbs.near_is_less;
    if (less || more)
        evidence.push_back(text("rounded silhouettes say that ", less ? "less" : "more", " is nearer, at ",
                                less ? limbs.near_is_less : limbs.near_is_more, " pixels against ",
                                less ? limbs.near_is_more : limbs.near_is_less));
    found.by_silhouettes = less ? Near::less : more ? Near::more : Near::unknown;
    const bool sky_above = found.top.stands_apart && !found.top.is_scattered,
               sky_below = found.zero.stands_apart && !found.zero.is_scattered;
    const bool says_less = less || (sky_above && !sky_below), says_more = more || (sky_below && !sky_above);
    if (says_less != says_more)
        found.near = says_less ? Near::less : Near::more;
}

Findings findings_of(const HostDepth& stored, std::vector<std::string>& evidence) {
    Findings found;
    Values& values = found.values;
    values.width = stored.width;
    values.height = stored.height;
    values.is_float = is_float(stored.storage);
    values.largest_code = storage_max(stored.storage);
    visit_values(stored, [&](float value, std::uint32_t) {
        found.infinite |= std::isinf(value);
        values.all.push_back(std::isfinite(value) ? value : not_a_number);
    });
    Range all = range_without(values, NAN);
    if (all.count == 0)
        return found;
    found.backwards = all.least < 0 && all.greatest <= 0;
    if (found.backwards) {
        evidence.emplace_back("no value is above 0: they count backwards, which a scale below 0 says");
        for (float& value : values.all)
            value = -value;
        all = range_without(values, NAN);
    }
    if (all.least == 0)
        found.zero = look_at(values, 0);
    const bool is_top = all.greatest == values.largest_code || all.greatest >= huge || all.greatest == largest_half;
    if (is_top)
        found.top = look_at(values, all.greatest);
    for (const Apart& apart : {found.zero, found.top})
        if (apart.stands_apart)
            evidence.push_back(text(apart.pixels, " pixels (", percent(apart.pixels, values.all.size()), ") hold ",
                                    apart.value,
                                    apart.is_scattered ? ", scattered like holes" : ", together like a sky"));
    for (float& value : values.all) // such values are often no depth, even where they are few
        if (const auto v = static_cast<double>(value); v == 0 || (is_top && v == all.greatest) || v >= huge)
            value = not_a_number;
    found.range = range_without(values, NAN);
    if (found.range.count == 0)
        return found;
    found.median = median_of(values.all);
    find_near(found, evidence);
    const double relative_step = stored.storage == Storage::float32 ? 0x1p-23 : values.is_float ? 0x1p-10 : 0;
    found.planes = fit_planes(values.all, values.width, values.height, {values.is_float ? 0.0 : 1.0, relative_step});
    return found;
}

// What is nearer under the assumption that the picture is upright and shows a floor.
void look_at_floor(Findings& found, std::vector<std::string>& evidence) {
    const auto rows = static_cast<std::ptrdiff_t>(found.values.height / 4) * found.values.width;
    const double upper = median_of({found.values.all.begin(), found.values.all.begin() + rows}),
                 lower = median_of({found.values.all.end() - rows, found.values.all.end()});
    if (upper != lower && std::isfinite(upper - lower))
        evidence.push_back(text("plausible only: values are ", lower < upper ? "less" : "greater",
                                " at the bottom, where floors are near"));
}

// Readings of values that are affine in the pixel over planes; the first is right if `decided`.
std::vector<Guess> affine_guesses(const Findings& found, bool& decided) {
    const Guess window = window_guess(found, false), reversed = window_guess(found, true),
                orthographic = orthographic_guess(found), inverse = inverse_guess(found);
    decided = true;
    if (found.range.least < 0) { // heights, which an orthographic camera sees
        decided = found.near == Near::less;
        return {orthographic};
    }
    if (found.values.is_float && !found.in_unit_range()) {
        if (found.near == Near::less)
            return {orthographic};
        decided = found.near == Near::more;
        return decided ? std::vector{inverse} : std::vector{inverse, orthographic};
    }
    const bool sky_above = found.top.stands_apart && !found.top.is_scattered;
    if (found.near == Near::less && sky_above)
        return {window};
    if (!found.values.is_float && found.near != Near::less && found.zero.stands_apart && found.zero.is_scattered)
        return {inverse};
    if (found.near == Near::less && found.values.largest_code == 0xffffff) // what graphics cards store, and no sensor
        return {window};
    if (found.near != Near::more && found.range.least > 0 && found.range.greatest < thin * found.range.least &&
        found.range.greatest > 0.9 * found.values.largest_code) // anything else would be a relief at the range's end
        return {window, reversed};
    decided = false;
    if (found.near == Near::less)
        return {window, orthographic};
    if (found.near == Near::more)
        return {reversed, inverse};
    return found.values.is_float ? std::vector{window, reversed, inverse} : std::vector{inverse, window, orthographic};
}

// Readings where planes do not decide: by range, type and what is near alone.
std::vector<Guess> plausible_guesses(const Findings& found) {
    const Guess window = window_guess(found, found.by_silhouettes == Near::more), planar = planar_guess(found),
                radial = radial_guess(found, false), inverse = inverse_guess(found);
    const bool may_be_window =
        found.in_unit_range() || (!found.backwards && found.top.value == found.values.largest_code);
    std::vector<Guess> guesses;
    if (found.range.least < 0)
        return {orthographic_guess(found), planar};
    if (found.by_silhouettes != Near::more)
        guesses = {planar, radial};
    if (found.by_silhouettes != Near::less)
        guesses.push_back(inverse);
    if (may_be_window) // floats from 0 to 1 are mostly depth buffers, and integers mostly distances
        guesses.insert(guesses.begin() + (found.in_unit_range() ? 0 : 1), window);
    return guesses;
}

// Gives the readings of a kind of values. Is the first of them right?
bool make_guesses(Kind kind, const Findings& found, Ranking& ranking) {
    bool decided = true;
    switch (kind) {
    case Kind::unknown:
        ranking.guesses = plausible_guesses(found);
        return false;
    case Kind::value:
        ranking.guesses = affine_guesses(found, decided);
        return decided;
    case Kind::reciprocal:
        ranking.guesses = {planar_guess(found)};
        if (found.in_unit_range() && found.part({Shape::reciprocal}) >= most) {
            decided = false;
            ranking.evidence.emplace_back("median depth, z/(z + m), lies between 0 and 1 and has the same planes");
            ranking.guesses.push_back(median_guess(found));
        }
        return decided;
    case Kind::over_ray:
        ranking.guesses = {radial_guess(found, true)};
        return true;
    case Kind::panorama:
        ranking.guesses = {panorama_guess(found)};
        return true;
    case Kind::times_ray:
        ranking.guesses = {inverse_guess(found, true)};
        return found.by_silhouettes == Near::more;
    case Kind::exponent:
        ranking.guesses = {logarithmic_guess(found)};
        break;
    case Kind::curve:
        ranking.guesses = {curved_guess(found)};
        return false;
    }
    return true;
}

} // namespace

const char* to_string(Family family) {
    constexpr std::array names{"window-affine", "planar", "radial", "inverse", "other"};
    return names.at(static_cast<std::size_t>(family));
}

Ranking rank_encodings(const HostDepth& stored) {
    require(stored.width > 0 && stored.height > 0, "rank_encodings: an image of ", stored.width, " x ", stored.height,
            " pixels holds nothing");
    Ranking ranking;
    Findings found = findings_of(stored, ranking.evidence);
    if (found.range.count == 0 || !(found.range.size() > 0)) {
        ranking.evidence.emplace_back("no two pixels differ");
        return ranking;
    }
    const UnsaidDoubts doubts = unsaid_doubts(stored, found.backwards, found.top.stands_apart ? found.top.value : NAN);
    if (doubts.bits) {
        ranking.evidence = {in_words(*doubts.bits)};
        return ranking;
    }
    Kind kind = kind_of(found);
    if (found.backwards && kind == Kind::exponent) // which no camera has
        kind = Kind::unknown;
    if (found.planes.patches == 0)
        ranking.evidence.emplace_back("no flat patch tells the readings apart");
    else {
        ranking.evidence.push_back(text(found.planes.patches, " of ", found.planes.smooth, " smooth patches are flat"));
        for (const KindShapes& each : kinds())
            if (const auto share = std::llround(100 * found.part(each.shapes)); share > 0)
                ranking.evidence.push_back(text("over ", share, " % of these ", each.words, " is affine in the pixel"));
    }
    const bool decided = make_guesses(kind, found, ranking);
    look_at_floor(found, ranking.evidence);
    if (doubts.number)
        ranking.evidence.push_back("as distances, " + in_words(*doubts.number));
    if (decided)
        ranking.family = ranking.guesses.front().family;
    return ranking;
}

} // namespace fathom
