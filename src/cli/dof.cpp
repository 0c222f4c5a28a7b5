// fathom dof
#include "codecs.hpp"
#include "command.hpp"
#include "each_depth.hpp"
#include "lens.hpp"

#include <fathom/dof.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <cmath>

namespace fathom::cli {
namespace {

struct Options : DepthOptions {
    LensOptions lens;
    DofOptions dof;
    std::string colour, colour_layer;
};

constexpr int most_blades = 64;

// "circle", or a polygon's corners; none of both otherwise.
std::optional<int> blades_of(const std::string& text) {
    int corners;
    if (text == "circle")
        return 0;
    if (CLI::detail::lexical_cast(text, corners) && corners >= 3 && corners <= most_blades)
        return corners;
    return std::nullopt;
}

void add_blur_options(CLI::App& app, DofOptions& dof) {
    app.add_option_function<std::string>(
           "--aperture", [&dof](const std::string& text) { dof.aperture.blades = *blades_of(text); },
           "the hole that light comes through: a circle (default), or a\nregular polygon of N corners, 3 to 64")
        ->type_name("circle|N")
        ->check(CLI::Validator(
            [](std::string& text) {
                return blades_of(text) ? std::string()
                                       : "'" + text + "' will not do; it is circle or a whole number from 3 to 64";
            },
            ""))
        ->group("Blur");
    const auto add = [&](const char* name, const char* value, const CLI::Validator& check, auto& target,
                         const char* description) {
        app.add_option(name, target, description)->type_name(value)->check(check)->group("Blur");
    };
    add("--rotate", "DEG", is_a_number("number", [](double) { return true; }), dof.aperture.rotation_degrees,
        "turns the polygon counter-clockwise; at 0 a corner is on top\nof what is behind the focus (default: 0)");
    add_choice(app, "--quality", dof.quality,
               {{"fast", BlurQuality::fast}, {"default", BlurQuality::standard}, {"accurate", BlurQuality::accurate}},
               "how finely circles are told apart and drawn (default: default);\naccurate also keeps which part of the "
               "lens edges leave open")
        ->group("Blur");
    add_choice(app, "--sky", dof.sky, {{"blur", Sky::blur}, {"sharp", Sky::sharp}, {"exclude", Sky::exclude}},
               "the background: infinitely far (default), in focus, or left out\nlike what is no surface")
        ->group("Blur");
    add("--largest", "PX", is_a_number("number from 1 to 512", [](double px) { return px >= 1 && px <= 512; }),
        dof.largest_px, "no circle is larger, on either side of the focus (default: 512)");
}

cv::Mat blur(const Options& options, const StoredDepth& stored, const Job& job) {
    const std::filesystem::path& file = job.companions.front();
    cv::Mat colour;
    {
        const StderrSilenced silenced;
        colour = read_colour(file, options.colour_layer);
    }
    const int width = stored.image.width(), height = stored.image.height();
    if (colour.cols != width || colour.rows != height)
        throw Error(fmt::format("{}: is {} × {}, but {} is {} × {}; both must be of the same size", file.native(),
                                colour.cols, colour.rows, job.input.native(), width, height));
    DofOptions asked = options.dof;
    asked.circle = circle_for(options.lens, stored);
    return to_mat(dof(stored, to_device(stored.image.device(), colour), asked));
}

std::function<int()> configure(CLI::App& app) {
    const Product product{
        .endings = {".exr", ".tif", ".pfm", ".png"}, .channels = {"R", "G", "B", "A"}, .png_scale = 1};
    const auto options = std::make_shared<Options>();
    add_depth_options(app, *options, product);
    app.add_option("--color", options->colour, "the sharp picture, of the depth's size: EXR, PNG, TIFF or PFM")
        ->type_name("IMAGE")
        ->required()
        ->group("Input");
    app.add_option("--color-layer", options->colour_layer,
                   "EXR layer that holds it\n(default: R, G, B, or *.Combined, *.beauty, or the only one)")
        ->type_name("NAME")
        ->group("Input");
    add_lens_options(app, options->lens);
    add_blur_options(app, options->dof);
    return [=] {
        complete(options->lens, options->camera);
        More more;
        more.companions.push_back({"--color", options->colour});
        return each_depth(*options, product, more, [&](const StoredDepth& stored, const Job& job) {
            return std::vector{blur(*options, stored, job)};
        });
    };
}

} // namespace

const Command dof_command{
    .name = "dof",
    .summary = "Blurs a picture as a lens focused on one depth does: depth of field.",
    .notes =
        R"(The picture is taken to be linear, its alpha (if it has one) multiplied in; codes of 8 and 16 bits count from
0 to 1. The result has its channels, as floats: an EXR holds R G B, and A; a .png 16 bits, cut off at 0 and 1. What
is no surface, or has a colour that is no number, takes part in nothing.

The lens: from its focal length and sensor, or with one of them the other from the projection, or from the camera
file. Circles larger than --largest are made that large.

With several inputs IMAGE and OUT are folders, and each input finds and leaves its own name there. What is computed:
docs/depth-of-field.md.

Example:
  fathom dof frame.exr --color frame.exr --camera camera.json -o blurred.exr --focus-at 640,360 --f-stop 2.8 \
      --focal-length-mm 50 --sensor-mm 36
  fathom dof frame.exr --color frame.png --camera camera.json -o blurred.png --focus 7 --f-stop 2 --sensor-mm 36 \
      --aperture 6 --rotate 15 --quality fast)",
    .configure = configure,
};

} // namespace fathom::cli
