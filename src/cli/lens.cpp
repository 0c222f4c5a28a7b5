// The lens of `fathom dof-masks` and `fathom dof`.
#include "lens.hpp"

#include "command.hpp"
#include "described.hpp"
#include "messages.hpp"

#include "description/lens.hpp"
#include "text.hpp"

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/linearize.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom::cli {
namespace {

constexpr const char* group = "Lens";

// Numbers between commas; none when there are others than `count`, or one is no number or not finite.
std::vector<double> numbers(const std::string& text, std::size_t count) {
    std::vector<double> values;
    for (const std::string& part : CLI::detail::split(text, ',')) {
        double value;
        if (!CLI::detail::lexical_cast(part, value) || !std::isfinite(value))
            return {};
        values.push_back(value);
    }
    return values.size() == count ? values : std::vector<double>{};
}

bool is_pixel(const std::vector<double>& values) {
    const auto good = [](double n) { return n == std::floor(n) && std::abs(n) < 1e9; }; // negative in overscan
    return values.size() >= 2 && good(values[0]) && good(values[1]);
}

LensOptions::Pixel pixel_of(const std::vector<double>& values) {
    return {static_cast<int>(values[0]), static_cast<int>(values[1])};
}

// An option of numbers between commas.
CLI::Option* add_list(CLI::App& app, const char* name, const char* form, std::size_t count,
                      const std::function<bool(const std::vector<double>&)>& accepted,
                      const std::function<void(const std::vector<double>&)>& take, const char* what,
                      const char* description) {
    const auto check = [=](std::string& text) {
        const std::vector<double> values = numbers(text, count);
        return !values.empty() && accepted(values) ? std::string() : "'" + text + "' will not do; it is " + what;
    };
    return app
        .add_option_function<std::string>(
            name, [=](const std::string& text) { take(numbers(text, count)); }, description)
        ->type_name(form)
        ->check(CLI::Validator(check, ""))
        ->group(group);
}

template <typename Value>
void use_default(std::optional<Value>& value, const std::optional<double>& from_file, const char* key,
                 const std::string& file, bool infinity_will_do) {
    if (value || !from_file)
        return;
    if (!(*from_file > 0) || (std::isinf(*from_file) && !infinity_will_do))
        throw UsageError(
            fmt::format("{}: \"{}\" is {}, which no lens has; it must be above 0", file, key, number(*from_file)));
    value = *from_file;
}

// Where an image begins in the display window, if that is not its first pixel.
std::string first_pixel(const cv::Rect& data) {
    return data.tl() == cv::Point() ? "" : fmt::format(" from pixel {},{} on", data.x, data.y);
}

// A pixel of the display window as one of the image.
LensOptions::Pixel pixel_in(const Windows& windows, const LensOptions::Pixel& pixel, const char* option) {
    const auto& [data, display] = windows;
    if (!data.contains({pixel.x, pixel.y}))
        throw Error(fmt::format("{}: pixel {},{} lies outside the image of {} × {}{}; the last one is {},{}", option,
                                pixel.x, pixel.y, data.width, data.height, first_pixel(data), data.br().x - 1,
                                data.br().y - 1));
    return {pixel.x - data.x, pixel.y - data.y};
}

double focus_of(const LensOptions& lens, const StoredDepth& stored, const Windows& windows) {
    if (lens.focus_at) {
        const auto [x, y] = pixel_in(windows, *lens.focus_at, "--focus-at");
        try {
            return depth_at(stored, x, y);
        } catch (const std::invalid_argument&) {
            throw Error(fmt::format("--focus-at: pixel {},{} is invalid; choose one that has a depth, or say the "
                                    "depth with --focus",
                                    lens.focus_at->x, lens.focus_at->y));
        }
    }
    if (lens.focus_along) {
        const auto [x, y] = pixel_in(windows, lens.focus_along->pixel, "--focus-along");
        return depth_along_ray(stored.camera, x + 0.5, y + 0.5, lens.focus_along->distance);
    }
    return lens.focus.value_or(0);
}

} // namespace

void add_lens_options(CLI::App& app, LensOptions& lens) {
    std::vector<description::Option> described;
    describe_lens(description::List(&lens, described), lens);
    add_described_options(
        app, described,
        [&lens](const description::Option& option, const description::Value& value) { option.set(lens, value); }, group,
        {});
    CLI::Option* focus = app.get_option("--focus");
    CLI::Option* at = add_list(
        app, "--focus-at", "X,Y", 2, is_pixel,
        [&lens](const std::vector<double>& values) { lens.focus_at = pixel_of(values); },
        "a pixel X,Y, two whole numbers",
        "focus on the surface under this pixel, counted from the first\npixel of the image (EXR: of its display "
        "window)");
    CLI::Option* along = add_list(
        app, "--focus-along", "X,Y,D", 3, [](const auto& values) { return is_pixel(values) && values[2] > 0; },
        [&lens](const std::vector<double>& values) {
            lens.focus_along = LensOptions::AlongRay{pixel_of(values), values[2]};
        },
        "a pixel and a distance X,Y,D", "focus on the depth of the point at distance D along a pixel's\nray");
    at->excludes(focus);
    along->excludes(focus)->excludes(at);
    CLI::Option* circle = add_list(
        app, "--circle", "K,G", 2, [](const auto& values) { return values[0] >= 0 && values[1] >= 0; },
        [&lens](const std::vector<double>& values) {
            lens.circle = {values[0], values[1]};
        },
        "two numbers K,G from 0",
        "instead of a lens: the CoC is K - G/z pixels wide, or G z - K\nfor an orthographic camera");
    for (const char* other : {"--focus", "--focus-at", "--focus-along", "--f-stop", "--focal-length-mm", "--sensor-mm"})
        circle->excludes(other);
}

void complete(LensOptions& lens, const CameraOption& camera) {
    camera.first_for([&](const ImportedCamera& read) {
        LensOptions of_first = lens; // which shows early what all cameras lack
        if (!camera.of_headers())
            complete(camera.is_pattern() ? of_first : lens, read, camera.name());
    });
}

void complete(LensOptions& lens, const CameraFile& file, const std::string& camera_file) {
    if (lens.circle)
        return;
    const LensDefaults& defaults = file.lens;
    const bool perspective = file.camera.projection.is_perspective();
    if (!lens.focus_at && !lens.focus_along)
        use_default(lens.focus, defaults.focus, "focus_distance", camera_file, true);
    use_default(lens.f_stop, defaults.f_stop, "f_stop", camera_file, true);
    use_default(lens.focal_length_mm, defaults.focal_length_mm, "lens_mm", camera_file, false);
    use_default(lens.sensor_mm, defaults.sensor_mm, "sensor_mm", camera_file, false);
    const auto missing = [&](const char* option, const char* key, const char* what) {
        throw UsageError(fmt::format("{}: missing, and {} has no \"{}\"; give {}", option, camera_file, key, what));
    };
    if (!lens.f_stop)
        missing("--f-stop", "f_stop", "the f-number");
    if (!lens.focus && !lens.focus_at && !lens.focus_along)
        missing("--focus", "focus_distance", "a length in scene units, or --focus-at X,Y");
    if (!perspective && !lens.focal_length_mm)
        missing("--focal-length-mm", "lens_mm",
                "it: orthographic cameras have no focal length, and the aperture is F over the f-number");
    if (!lens.focal_length_mm && !lens.sensor_mm)
        missing("--focal-length-mm", "lens_mm", "it or --sensor-mm, or both");
    if (perspective && lens.focus && lens.focal_length_mm && *lens.focus * lens.mm_per_unit <= *lens.focal_length_mm)
        throw UsageError(fmt::format("--focus: {} is {} mm, within the focal length of {} mm; focus farther away, or "
                                     "say with --mm-per-unit how long a scene unit is",
                                     number(*lens.focus), number(*lens.focus * lens.mm_per_unit),
                                     number(*lens.focal_length_mm)));
}

CircleOfConfusion circle_for(const LensOptions& lens, const StoredDepth& stored, const Windows& windows) {
    const Camera& camera = stored.camera;
    if (lens.circle) {
        const bool perspective = depth_form(camera, stored.storage).perspective;
        return {(*lens.circle)[0], (*lens.circle)[1], perspective ? camera_rays(camera).centre_depth : 0, !perspective};
    }
    try {
        const double focus = focus_of(lens, stored, windows);
        std::optional<double> sensor_mm = lens.sensor_mm; // of all columns of the image
        if (sensor_mm && windows.data.width != windows.display.width)
            sensor_mm = *sensor_mm * windows.data.width / windows.display.width;
        return circle_of_confusion({.f_stop = *lens.f_stop,
                                    .focus = focus,
                                    .focal_length_mm = lens.focal_length_mm,
                                    .sensor_mm = sensor_mm,
                                    .mm_per_unit = lens.mm_per_unit},
                                   camera);
    } catch (const std::invalid_argument& error) { // of the lens, not of the camera file
        throw Error(fmt::format("the lens does not fit: {}", error.what()));
    }
}

std::vector<std::string> lens_doubts(const LensOptions& lens, const CircleOfConfusion& circle, const Look& look,
                                     Sky sky, double max_coc_px) {
    if (lens.circle)
        return circle_doubts(circle, look, sky, max_coc_px, "is --circle in pixels and scene units?");
    std::vector<std::string> said;
    constexpr double shortest_mm = 0.2; // no lens of a camera and no sensor is so small
    const auto check = [&](const char* option, const std::optional<double>& length) {
        if (length && *length < shortest_mm)
            said.push_back(fmt::format("{}: {} mm is smaller than any; if these are metres, give {}", option,
                                       number(*length), number(*length * 1000)));
    };
    check("--focal-length-mm", lens.focal_length_mm);
    check("--sensor-mm", lens.sensor_mm);
    if (!said.empty())
        return said;
    said = circle_doubts(circle, look, sky, max_coc_px,
                         fmt::format("a scene unit counts as {} mm (--mm-per-unit), and the f-number is {}",
                                     number(lens.mm_per_unit), number(*lens.f_stop)));
    const bool told = lens.focus && !lens.focus_at && !lens.focus_along && std::isfinite(*lens.focus);
    if (said.empty() && told && look.surfaces() > 0 && (circle.k != 0 || circle.g != 0)) {
        const auto nearest = static_cast<double>(look.nearest), farthest = static_cast<double>(look.farthest);
        if (*lens.focus > 2 * farthest && look.background == 0)
            said.push_back(
                fmt::format("the focus of {} lies behind everything: depths run from {:.4g} to {:.4g}; --focus-at "
                            "X,Y focuses on what a pixel shows",
                            number(*lens.focus), nearest, farthest));
        if (*lens.focus < nearest / 2)
            said.push_back(
                fmt::format("the focus of {} lies before everything: depths run from {:.4g} to {:.4g}; --focus-at "
                            "X,Y focuses on what a pixel shows",
                            number(*lens.focus), nearest, farthest));
    }
    return said;
}

std::vector<std::string> circle_doubts(const CircleOfConfusion& circle, const Look& look, Sky sky, double max_coc_px,
                                       const std::string& cure) {
    if (circle.k == 0 && circle.g == 0) // a pinhole
        return {};
    const auto width_at = [&](double z) {
        return std::abs(static_cast<double>(coc_at(circle, static_cast<long double>(z))));
    };
    std::size_t circles = 0, ended = 0;
    double widest = 0;
    if (const double at_sky = width_at(std::numeric_limits<double>::infinity());
        sky == Sky::blur && look.background > 0 && !std::isnan(at_sky)) {
        circles = look.background;
        ended = at_sky > max_coc_px ? circles : 0;
        widest = at_sky;
    }
    // Circles grow to either side of the focus, so that none is wider than those at the ends.
    const double ends[] = {width_at(static_cast<double>(look.nearest)), width_at(static_cast<double>(look.farthest))};
    if (look.surfaces() > 0 && std::max(ends[0], ends[1]) <= max_coc_px) {
        circles += look.surfaces();
        widest = std::max({widest, ends[0], ends[1]});
    } else {
        for (int y = 0; y < look.z.height; ++y)
            for (const float z : row_of(look.z, y)) {
                const double coc = std::isfinite(z) ? width_at(static_cast<double>(z)) : std::nan("");
                if (std::isnan(coc))
                    continue;
                ++circles;
                ended += coc > max_coc_px;
                widest = std::max(widest, coc);
            }
    }
    if (circles > 0 && widest < 1)
        return {fmt::format(
            "no circle of confusion is a pixel wide: the largest has {:.2g}, so that nothing is blurred; {}", widest,
            cure)};
    // A wrong unit of length leaves what is near the focus: up to half of a real image. The default limit cuts off none of it
    // under a right one. A smaller limit is a choice, and a doubtful one where it decides everything.
    const double many = max_coc_px < DofOptions{}.max_coc_px ? 0.95 : 0.5;
    if (static_cast<double>(ended) > many * static_cast<double>(circles))
        return {fmt::format(
            "{} of the circles of confusion are cut off at --max-coc-px {}: they are up to {:.3g} pixels wide; "
            "{}",
            percent(ended, circles), number(max_coc_px), widest, cure)};
    return {};
}

} // namespace fathom::cli
