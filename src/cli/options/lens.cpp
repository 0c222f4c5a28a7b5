// The lens of `fathom dof-masks` and `fathom dof`, and the blur of relative depth in its place.
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
#include <fathom/linearize.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace fathom::cli {
namespace {

constexpr const char* group = "Lens";

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
    if (lens.focus_along)
        lens.focus_along->pixel = pixel_in(windows, lens.focus_along->pixel, "--focus-along");
    if (lens.sensor_mm && windows.data.width != windows.display.width)
        lens.sensor_mm = *lens.sensor_mm * windows.data.width / windows.display.width;
    return lens;
}

// How messages name the program's options, and the camera.
LensWords lens_words(const std::string& camera = "the camera") {
    return {.camera = camera, .option = [](const std::string& option) { return spelled(option); }};
}

void complete(LensArguments& lens, const LensDefaults& defaults, const Projection& projection,
              const std::string& camera) {
    try {
        lens = completed(lens, defaults, projection, lens_words(camera));
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
}

// The lens for an input whose own camera may complete it.
LensArguments lens_of(LensArguments lens, const Job& job) {
    if (job.camera)
        complete(lens, job.camera->lens, job.camera->camera.projection, job.camera_name.native());
    return lens;
}

// The depth of the surface at --focus-at.
double depth_under(const LensArguments::Pixel& pixel, const StoredDepth& stored, const Windows& windows) {
    const auto [x, y] = pixel_in(windows, pixel, "--focus-at");
    try {
        return depth_at(stored, x, y);
    } catch (const std::invalid_argument&) {
        throw Error(fmt::format("--focus-at: pixel {},{} is invalid; choose one that has a depth", pixel.x, pixel.y));
    }
}

} // namespace

void add_lens_options(CLI::App& app, LensArguments& lens, const description::Option& circle) {
    const std::vector<description::Option>& options = description::operation<description::DofCall>().lens;
    add_described_options(app, lens, options, group);
    add_described_options(
        app, {circle},
        [&lens](const description::Option&, const description::Value& value) {
            const auto& its = std::get<CircleOfConfusion>(value);
            lens.circle = {static_cast<double>(its.k), static_cast<double>(its.g)};
        },
        group);
    for (const description::Option& option : options)
        if (description::is_of_relative(option))
            app.get_option(spelled(option))->group("Relative depth");
    for (const char* other : {"--camera", "--preset", "--image", "--node", "--undistorted", "--valid"})
        app.get_option("--relative")->excludes(other);
}

void complete(LensArguments& lens, RelativeSource& relative, const CameraOption& camera) {
    relative.order = lens.relative;
    if (lens.relative) {
        relative.options = relative_options(lens);
        return complete(lens, {}, relative_camera(1, 1, *lens.relative).projection, "the camera");
    }
    if (!camera.of_headers()) // shows early what all cameras lack
        camera.first_for([&](const ImportedCamera& read) {
            LensArguments of_first = lens;
            complete(of_first, read.lens, read.camera.projection, camera.name());
        });
}

CircleOfConfusion circle_of(const LensArguments& given, const StoredDepth& stored, const Job& job) {
    if (given.circle)
        return circle_for(given, stored);
    LensArguments lens = within(job.windows, lens_of(given, job));
    if (lens.focus_at && lens.relative) // all of whose pixels are the image's
        depth_under(*lens.focus_at, stored, job.windows);
    else if (const auto pixel = std::exchange(lens.focus_at, std::nullopt))
        lens.focus = depth_under(*pixel, stored, job.windows);
    try {
        return circle_for(lens, stored);
    } catch (const std::invalid_argument& error) { // of the lens, not of the camera file
        throw Error(fmt::format("the lens does not fit: {}", error.what()));
    }
}

std::vector<std::string> blur_doubts(const LensArguments& lens, const StoredDepth& stored, const Job& job,
                                     const Subject& subject, Sky sky, double max_coc_px) {
    return lens_doubts(subject, lens_of(lens, job), circle_of(lens, stored, job), sky, max_coc_px, lens_words());
}

} // namespace fathom::cli
