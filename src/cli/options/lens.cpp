// The lens of `fathom dof-masks` and `fathom dof`.
#include "lens.hpp"

#include "depth_options.hpp"
#include "described.hpp"

#include "cli/command.hpp"
#include "description/lens.hpp"
#include "terminal/messages.hpp"
#include "text.hpp"

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom::cli {
namespace {

constexpr const char* group = "Lens";
constexpr double sky_depth = std::numeric_limits<double>::infinity();

bool is_pixel(const std::vector<double>& values) {
    const auto good = [](double n) { return n == std::floor(n) && std::abs(n) < 1e9; }; // negative in overscan
    return values.size() >= 2 && good(values[0]) && good(values[1]);
}

LensArguments::Pixel pixel_of(const std::vector<double>& values) {
    return {static_cast<int>(values[0]), static_cast<int>(values[1])};
}

// A pixel of the display window as one of the image.
LensArguments::Pixel pixel_in(const Windows& windows, const LensArguments::Pixel& pixel, const char* option) {
    const auto& [data, display] = windows;
    if (!data.contains({pixel.x, pixel.y}))
        throw Error(fmt::format("{}: pixel {},{} lies outside the image of {}; the last one is {},{}", option, pixel.x,
                                pixel.y, extent(data), data.br().x - 1, data.br().y - 1));
    return {pixel.x - data.x, pixel.y - data.y};
}

// The lens for an image's own pixels and its part of the sensor.
LensArguments within(const Windows& windows, LensArguments lens) {
    if (lens.focus_at)
        lens.focus_at = pixel_in(windows, *lens.focus_at, "--focus-at");
    if (lens.focus_along)
        lens.focus_along->pixel = pixel_in(windows, lens.focus_along->pixel, "--focus-along");
    if (lens.sensor_mm && windows.data.width != windows.display.width)
        lens.sensor_mm = *lens.sensor_mm * windows.data.width / windows.display.width;
    return lens;
}

// NaN where there is none.
double width_at(const CircleOfConfusion& circle, double z) {
    return std::abs(static_cast<double>(coc_at(circle, static_cast<long double>(z))));
}

} // namespace

void add_lens_options(CLI::App& app, LensArguments& lens) {
    add_described_options(app, lens, group);
    CLI::Option* focus = app.get_option("--focus");
    CLI::Option* at = add_numbers_option(
        app, "--focus-at", "X,Y", 2, is_pixel,
        [&lens](const std::vector<double>& values) { lens.focus_at = pixel_of(values); },
        "a pixel X,Y, two whole numbers",
        "focus on the surface under this pixel, counted from the first\npixel of the image (EXR: of its display "
        "window)");
    CLI::Option* along = add_numbers_option(
        app, "--focus-along", "X,Y,D", 3, [](const auto& values) { return is_pixel(values) && values[2] > 0; },
        [&lens](const std::vector<double>& values) {
            lens.focus_along = LensArguments::AlongRay{pixel_of(values), values[2]};
        },
        "a pixel and a distance X,Y,D", "focus on the depth of the point at distance D along a pixel's\nray");
    CLI::Option* circle = add_numbers_option(
        app, "--circle", "K,G", 2, [](const auto& values) { return values[0] >= 0 && values[1] >= 0; },
        [&lens](const std::vector<double>& values) {
            lens.circle = {values[0], values[1]};
        },
        "two numbers K,G from 0",
        "instead of a lens: the CoC is K - G/z pixels wide, or G z - K\nfor an orthographic camera");
    at->excludes(focus)->group(group);
    along->excludes(focus)->excludes(at)->group(group);
    circle->group(group);
    for (const char* other : {"--focus", "--focus-at", "--focus-along", "--f-stop", "--focal-length-mm", "--sensor-mm"})
        circle->excludes(other);
}

void complete(LensArguments& lens, const CameraOption& camera) {
    camera.first_for([&](const ImportedCamera& read) {
        LensArguments of_first = lens; // which shows early what all cameras lack
        if (!camera.of_headers())
            complete(camera.is_pattern() ? of_first : lens, read, camera.name());
    });
}

void complete(LensArguments& lens, const CameraFile& file, const std::string& name) {
    try {
        lens = completed(lens, file.lens, file.camera.projection,
                         {.camera = name, .option = [](const std::string& option) { return spelled(option); }});
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
}

CircleOfConfusion circle_for(const LensArguments& given, const StoredDepth& stored, const Windows& windows) {
    if (given.circle)
        return fathom::circle_for(given, stored);
    LensArguments lens = within(windows, given);
    if (lens.focus_at) {
        try {
            lens.focus = focus_of(lens, stored);
        } catch (const std::invalid_argument&) {
            throw Error(fmt::format("--focus-at: pixel {},{} is invalid; choose one that has a depth, or say the "
                                    "depth with --focus",
                                    given.focus_at->x, given.focus_at->y));
        }
        lens.focus_at.reset();
    }
    try {
        return fathom::circle_for(lens, stored);
    } catch (const std::invalid_argument& error) { // of the lens, not of the camera file
        throw Error(fmt::format("the lens does not fit: {}", error.what()));
    }
}

double widest_coc(const CircleOfConfusion& circle, const Look& look, Sky sky) {
    double widest = 0;
    const auto add = [&](double z) { widest = std::max(widest, width_at(circle, z)); };
    if (look.surfaces() >
        0) { // Circles grow to either side of the focus, so that none is wider than those at the ends.
        add(static_cast<double>(look.nearest));
        add(static_cast<double>(look.farthest));
    }
    if (sky == Sky::blur && look.background > 0)
        add(sky_depth);
    return widest;
}

std::vector<std::string> lens_doubts(const LensArguments& lens, const CircleOfConfusion& circle, const Subject& subject,
                                     Sky sky, double max_coc_px) {
    const Look& look = subject.look;
    if (lens.circle)
        return circle_doubts(circle, subject, sky, max_coc_px, "is --circle in pixels and scene units?");
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
    said = circle_doubts(circle, subject, sky, max_coc_px,
                         fmt::format("a scene unit counts as {} mm (--mm-per-unit), and the f-number is {}",
                                     number(lens.mm_per_unit), number(*lens.f_stop)));
    const bool told = lens.focus && !lens.focus_at && !lens.focus_along && std::isfinite(*lens.focus);
    if (said.empty() && told && look.surfaces() > 0 && (circle.k != 0 || circle.g != 0)) {
        const auto nearest = static_cast<double>(look.nearest), farthest = static_cast<double>(look.farthest);
        const bool behind = *lens.focus > 2 * farthest && look.background == 0;
        if (behind || *lens.focus < nearest / 2)
            said.push_back(
                fmt::format("the focus of {} lies {} everything: depths run from {:.4g} to {:.4g}; --focus-at "
                            "X,Y focuses on what a pixel shows",
                            number(*lens.focus), behind ? "behind" : "before", nearest, farthest));
    }
    return said;
}

std::vector<std::string> circle_doubts(const CircleOfConfusion& circle, const Subject& subject, Sky sky,
                                       double max_coc_px, const std::string& cure) {
    if (circle.k == 0 && circle.g == 0) // a pinhole
        return {};
    const Look& look = subject.look;
    const double widest = widest_coc(circle, look, sky);
    const std::size_t blurred_sky = sky == Sky::blur ? look.background : 0, circles = look.surfaces() + blurred_sky;
    std::size_t ended = width_at(circle, sky_depth) > max_coc_px ? blurred_sky : 0;
    if (widest_coc(circle, look, Sky::sharp) > max_coc_px)
        subject.each([&](const HostDepth&, const HostFloats& z) {
            for (int y = 0; y < z.height; ++y)
                for (const float depth : row_of(z, y))
                    ended += std::isfinite(depth) && width_at(circle, static_cast<double>(depth)) > max_coc_px;
        });
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
