// Relative depth for `fathom dof` and `fathom dof-masks`.
#include "relative.hpp"

#include "depth_options.hpp"

#include "cli/command.hpp"
#include "terminal/messages.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/error.hpp>
#include <fathom/linearize.hpp>

#include <fmt/format.h>

namespace fathom::cli {
namespace {

constexpr const char* relative_group = "Relative depth";
constexpr description::Range blurs = description::from(0);

} // namespace

void add_relative_options(CLI::App& app, RelativeOptions& relative) {
    CLI::Option* order = add_option(
                             app, relative_group, "--relative", "high-is-near|low-is-near",
                             [&relative](const std::string& text) {
                                 relative.order =
                                     text == "high-is-near" ? RelativeOrder::high_is_near : RelativeOrder::low_is_near;
                             },
                             "the depth has no unit and needs no camera: 8 or 16 bits, or\n"
                             "floats, as neural networks give it. Says which values are near")
                             ->check(is_one_of({"high-is-near", "low-is-near"}));
    for (const char* other : {"--camera", "--preset", "--image", "--node", "--undistorted", "--focus", "--focus-along",
                              "--f-stop", "--focal-length-mm", "--sensor-mm", "--mm-per-unit", "--circle", "--valid"})
        order->excludes(other);
    add_option(app, relative_group, "--blur-px", "N", relative.blur_px,
               "max CoC in pixels, which the nearest value has if the farthest is in focus, or the other way round (" +
                   blurs.limits() + ")")
        ->check(is_in(blurs))
        ->needs(order);
    add_numbers_option(
        app, "--focus-range", "A,B", 2, [](const auto& n) { return n[0] >= 0 && n[0] <= n[1] && n[1] <= 1; },
        [&relative](const auto& n) {
            relative.focus_range = FocusRange{n[0], n[1]};
        },
        "two numbers A,B with 0 <= A <= B <= 1", "all of these values are in focus, instead of --focus-at")
        ->needs(order)
        ->excludes("--focus-at")
        ->group(relative_group);
    add_numbers_option(
        app, "--relative-range", "A,B", 2, [](const auto& n) { return n[0] < n[1]; },
        [&relative](const auto& n) {
            relative.range = {n[0], n[1]};
        },
        "two numbers A,B with A < B",
        "stored values that are 0 and 1 (default: floats' own least and\ngreatest; all that integers can hold)")
        ->needs(order)
        ->group(relative_group);
}

void check_relative(const RelativeOptions& relative, const LensArguments& lens) {
    if (!relative.blur_px)
        throw UsageError(
            "--blur-px: missing; say with it how many pixels wide the largest blur is, as in --blur-px 24");
    if (!lens.focus_at && !relative.focus_range)
        throw UsageError(
            "--focus-at: missing; say with --focus-at X,Y which pixel is in focus, or with --focus-range A,B "
            "which values are");
}

namespace {

// The lens for an input whose own camera may complete it.
LensArguments lens_of(LensArguments lens, const Job& job) {
    if (job.own_camera)
        complete(lens, *job.own_camera, (job.camera_file.empty() ? job.input : job.camera_file).native());
    return lens;
}

CircleOfConfusion relative_circle_for(const RelativeOptions& relative, const StoredDepth& stored,
                                      const LensArguments& lens, const Windows& windows) {
    if (!lens.focus_at)
        return relative_circle(*relative.blur_px, relative.focus_range->low, *relative.order);
    const double z = depth_under(*lens.focus_at, stored, windows);
    return relative_circle(*relative.blur_px, *relative.order == RelativeOrder::high_is_near ? 1 - z : z,
                           *relative.order);
}

} // namespace

CircleOfConfusion circle_of(const RelativeOptions& relative, const LensArguments& lens, const StoredDepth& stored,
                            const Job& job) {
    return relative.order ? relative_circle_for(relative, stored, lens, job.windows)
                          : circle_for(lens_of(lens, job), stored, job.windows);
}

double widest_circle(const LensArguments& lens, const Tile& image, const Look& look, Sky sky, const Job& job) {
    const StoredDepth stored{.image = {}, .camera = image.camera, .storage = image.storage};
    return widest_shown(circle_of({}, lens, stored, job), look, sky);
}

std::vector<std::string> blur_doubts(const RelativeOptions& relative, const LensArguments& lens,
                                     const StoredDepth& stored, const Job& job, const Subject& subject, Sky sky,
                                     double max_coc_px) {
    const CircleOfConfusion circle = circle_of(relative, lens, stored, job);
    if (!relative.order)
        return lens_doubts(subject, lens_of(lens, job), circle, sky, max_coc_px, lens_words());
    if (relative.focus_range)
        return {}; // all may be in focus
    return circle_doubts(subject, circle, sky, max_coc_px, fmt::format("--blur-px is {}", number(*relative.blur_px)),
                         lens_words());
}

} // namespace fathom::cli
