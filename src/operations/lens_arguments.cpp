// The lens of arguments, of the camera's defaults and of an image: what the program and Python take.

#include <fathom/lens_arguments.hpp>

#include "camera/circle_form.hpp"
#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/lens.hpp"
#include "description/option.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"

#include <fathom/linearize.hpp>

#include <algorithm>
#include <cmath>
#include <iomanip>

namespace fathom {
namespace {

// Seven digits, which tell any two lengths apart that a message is about.
std::string seven_digits(double value) {
    return text(std::setprecision(7), value);
}

// Refuses what says the lens in two ways.
void check_exclusions(const LensArguments& lens, const std::function<std::string(const std::string&)>& spelled) {
    std::vector<std::string_view> given;
    const auto add = [&](const char* name, const auto& field, const description::Accepts&, const auto&...) {
        bool is_given = false;
        if constexpr (requires { field.has_value(); })
            is_given = field.has_value();
        else
            is_given = field != LensArguments{}.mm_per_unit;
        if (is_given)
            given.emplace_back(name);
    };
    description::describe(add, lens);
    description::describe_circle(add, lens.circle);
    for (const auto& [option, others] : description::lens_excluding)
        for (const char* other : others)
            if (other && std::ranges::count(given, option) > 0 && std::ranges::count(given, other) > 0)
                throw std::invalid_argument(description::excluding(spelled(option), spelled(other)));
}

} // namespace

LensArguments completed(LensArguments lens, const LensDefaults& defaults, const Projection& projection,
                        const LensWords& words) {
    const auto option = [&](const char* name) { return words.option(name); };
    const bool elsewhere = lens.focus_at || lens.focus_along;
    const bool is_empty = !elsewhere && !lens.focus && !lens.f_stop && !lens.focal_length_mm && !lens.sensor_mm;
    check_exclusions(lens, words.option);
    if (lens.circle)
        return lens;
    if (lens.relative) {
        require(lens.blur_px.has_value(), option("blur_px"),
                ": missing; say with it how many pixels wide the largest blur is, for instance 24");
        require(lens.focus_at || lens.focus_range, option("focus_at"), ": missing; say with ", option("focus_at"),
                " X,Y which pixel is in focus, or with ", option("focus_range"), " A,B which values are");
        return lens;
    }
    static const std::vector<description::Option> described = description::options_of(LensArguments{});
    const auto use_default = [&](std::optional<double>& value, const std::optional<double>& from_camera,
                                 const char* name, const char* key) {
        if (value || !from_camera)
            return;
        const auto& its = *std::ranges::find(described, std::string_view(name), &description::Option::name);
        require(its.accepts(*from_camera), words.camera, ": \"", key, "\" is ", seven_digits(*from_camera),
                "; it must be ", its.instead_of(*from_camera));
        value = from_camera;
    };
    if (!elsewhere)
        use_default(lens.focus, defaults.focus, "focus", "focus_distance");
    use_default(lens.f_stop, defaults.f_stop, "f_stop", "f_stop");
    use_default(lens.focal_length_mm, defaults.focal_length_mm, "focal_length_mm", "lens_mm");
    use_default(lens.sensor_mm, defaults.sensor_mm, "sensor_mm", "sensor_mm");
    const auto need = [&](bool given, const char* name, const char* key, const std::string& what) {
        require(given, option(name), ": missing, and ", words.camera, " has no \"", key, "\"; give ", what,
                is_empty ? ", or " + option("circle") + " instead of a lens" : "");
    };
    const bool perspective = projection.is_perspective();
    need(lens.f_stop.has_value(), "f_stop", "f_stop", "the f-number");
    need(lens.focus || elsewhere, "focus", "focus_distance",
         "a length in scene units, or " + option("focus_at") + " X,Y");
    need(perspective || lens.focal_length_mm, "focal_length_mm", "lens_mm",
         "it: orthographic cameras have no focal length, and the aperture is F over the f-number");
    need(lens.focal_length_mm || lens.sensor_mm, "focal_length_mm", "lens_mm",
         "it or " + option("sensor_mm") + ", or both");
    if (perspective && lens.focus && lens.focal_length_mm) {
        const double focus_mm = *lens.focus * lens.mm_per_unit;
        require(!(focus_mm <= *lens.focal_length_mm), option("focus"), ": ", seven_digits(*lens.focus), " is ",
                seven_digits(focus_mm), " mm, within the focal length of ", seven_digits(*lens.focal_length_mm),
                " mm; focus farther away, or say with ", option("mm_per_unit"), " how long a scene unit is");
    }
    return lens;
}

RelativeOptions relative_options(const LensArguments& lens) {
    describe_relative(description::Check{}, lens);
    const auto& range = lens.focus_range;
    return {.range = lens.relative_range,
            .focus_range = range ? std::optional(FocusRange{(*range)[0], (*range)[1]}) : std::nullopt,
            .order = lens.relative.value_or(RelativeOrder::high_is_near)};
}

double focus_of(const LensArguments& lens, const StoredDepth& stored) {
    if (lens.focus_at) {
        const auto [x, y] = *lens.focus_at;
        check_pixel("focus_at", size_of(stored.image), x, y);
        return depth_at(stored, x, y);
    }
    if (lens.focus_along) {
        const auto& [pixel, distance] = *lens.focus_along;
        require(description::ray_distance.holds(distance), "focus_along = (", pixel.x, ", ", pixel.y, ", ", distance,
                ") must be ", in_words(description::Kind::ray));
        check_pixel("focus_along", {stored.camera.width, stored.camera.height}, pixel.x, pixel.y);
        return depth_along_ray(stored.camera, pixel.x + 0.5, pixel.y + 0.5, distance);
    }
    require(lens.focus.has_value(), "the lens has no focus");
    return *lens.focus;
}

CircleOfConfusion circle_for(const LensArguments& lens, const StoredDepth& stored) {
    describe_relative(description::Check{}, lens);
    check_exclusions(lens, LensWords{}.option);
    if (lens.relative) {
        require(lens.blur_px.has_value(), "the lens has no blur_px");
        const bool falls = *lens.relative == RelativeOrder::high_is_near;
        if (lens.focus_range)
            return relative_circle(*lens.blur_px, lens.focus_range->front(), *lens.relative);
        const double z = focus_of(lens, stored);
        return relative_circle(*lens.blur_px, falls ? 1 - z : z, *lens.relative);
    }
    if (lens.circle) {
        const DepthForm form = depth_form(straightened(stored.camera), stored.storage);
        const CircleOfConfusion circle{(*lens.circle)[0], (*lens.circle)[1],
                                       form.perspective ? straight_rays(stored.camera).centre_depth : 0,
                                       !form.perspective};
        check_circle(circle, form);
        return circle;
    }
    require(lens.f_stop.has_value(), "the lens has no f_stop");
    return circle_of_confusion({.f_stop = *lens.f_stop,
                                .focus = focus_of(lens, stored),
                                .focal_length_mm = lens.focal_length_mm,
                                .sensor_mm = lens.sensor_mm,
                                .mm_per_unit = lens.mm_per_unit},
                               stored.camera);
}

StoredDepth repaired(const StoredDepth& stored, const DepthRepair& repair) {
    describe(description::Check{}, repair);
    const StoredDepth depth = repair.invalid == DepthRepair::Invalid::fill ? fill_invalid(stored) : stored;
    return repair.grow_foreground > 0 ? grow_foreground(depth, repair.grow_foreground) : depth;
}

// The depth at one pixel, as where a lens focuses.

double depth_at(const StoredDepth& stored, int x, int y) {
    check_pixel("pixel", size_of(stored.image), x, y);
    float depth;
    linearize(stored.region(x, y, 1, 1), {.as = has_plane_in_focus(stored.camera) ? Along::axis : Along::ray})
        .image.download(&depth);
    require(!std::isnan(depth), "pixel (", x, ", ", y, ") is invalid: it has no depth to focus on");
    return static_cast<double>(depth);
}

} // namespace fathom
