// fathom dof
#include "description/dof.hpp"
#include "description/lens.hpp"

#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/lens.hpp"
#include "cli/options/picture.hpp"
#include "io/floats_on_host.hpp"
#include "shot/each_depth.hpp"

#include <fathom/dof.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace fathom::cli {
namespace {

struct DofArguments : DepthOptions {
    LensArguments lens;
    DofOptions dof;
    bool explain = false;
    PictureOptions picture;
    double highlights = 1;
    DepthRepair repair;
    std::optional<std::string> clean_plate, clean_plate_depth;
    std::optional<Packing> packing; // of the depths, as the camera file says
};

// "circle" or 0, a polygon's corners, or "ellipse:" and its height over its width; nothing otherwise.
std::optional<Aperture> shape_of(const std::string& text, const std::vector<description::Option>& described) {
    const auto set = [&](const char* name, const std::string& value, DofOptions& dof) {
        const auto option = std::ranges::find(described, std::string(name), &description::Option::name);
        const std::optional<description::Value> parsed = parse(*option, value);
        if (parsed)
            option->set(dof, *parsed);
        return parsed.has_value();
    };
    constexpr std::string_view ellipse = "ellipse:";
    DofOptions dof;
    if (text == "circle")
        return dof.aperture;
    const bool good =
        text.starts_with(ellipse) ? set("ratio", text.substr(ellipse.size()), dof) : set("blades", text, dof);
    return good ? std::optional(dof.aperture) : std::nullopt;
}

void add_blur_options(CLI::App& app, DofOptions& dof) {
    const std::vector<description::Option> described = description::options_of(dof);
    const auto limits = [&](const char* name) { // of the interval
        description::Range range = std::ranges::find(described, std::string(name), &description::Option::name)->range;
        range.beside.reset();
        return range.limits();
    };
    const std::string corners = limits("blades"), ratios = limits("ratio");
    app.add_option_function<std::string>(
           "--aperture",
           [&dof, described](const std::string& text) {
               const Aperture shape = *shape_of(text, described);
               dof.aperture.blades = shape.blades;
               dof.aperture.ratio = shape.ratio;
           },
           fmt::format(
               "shape of the aperture: a circle (default), a regular polygon of\nN corners, {}, or an ellipse R "
               "times as high as wide, {}\n(an anamorphic lens: 2)",
               corners, ratios))
        ->type_name("circle|N|ellipse:R")
        ->check(CLI::Validator(
            [described, corners, ratios](std::string& text) {
                return shape_of(text, described)
                           ? std::string()
                           : fmt::format("'{}' will not do; it is circle, a whole number from {}, or ellipse:R with R "
                                         "from {}",
                                         text, corners, ratios);
            },
            ""))
        ->group("Blur");
    add_described_options(app, dof, "Blur", {"blades", "ratio"});
}

DepthFile clean_plate_depth_of(const std::filesystem::path& file, const DofArguments& options, const Job& job) {
    DepthFile depth;
    try {
        if (!options.clean_plate_depth && list_channels(file).size() < 2) // which are the picture's
            throw Error(file.native() + ": holds a picture only");
        depth = read_depth(
            file, {.channel = options.channel, .packing = options.packing, .overscan = has_overscan(job.windows)});
    } catch (const Error& error) {
        if (options.clean_plate_depth)
            throw;
        throw Error(fmt::format("{}; a clean plate whose file holds no depth needs --clean-plate-depth", error.what()));
    }
    check_same_pixels(file, depth, job);
    return depth;
}

Images read_images(const DofArguments& options, const Job& job) {
    Images images{.picture = picture_of(job.companions.front(), options.picture, job)};
    if (options.clean_plate) {
        const std::filesystem::path& file = job.companions[1];
        images.clean_plate = picture_of(file, options.picture, job);
        if (images.clean_plate.color.size() != images.picture.color.size())
            check_same_size(file, images.clean_plate.color.size(), job);
        const int of_plate = images.clean_plate.color.channels(), of_picture = images.picture.color.channels();
        if (of_plate != of_picture)
            throw Error(fmt::format("{}: has {} channels, but {} has {}; both must have an alpha, or none",
                                    file.native(), of_plate, job.companions.front().native(), of_picture));
        images.other_depth = clean_plate_depth_of(job.companions[2], options, job);
    }
    return images;
}

Picture blur(const DofArguments& options, const StoredDepth& stored, Loaded& frame) {
    explain_method(fathom::Operation::dof, stored, frame, options.dof.quality, options.explain);
    Images images = frame.images.get(); // read by the device until the result is there
    if (options.highlights > 1)         // once for each width that is tried
        images.picture.color = images.picture.color.clone();
    restore_highlights(images.picture, options.highlights); // which may change from frame to frame
    restore_highlights(images.clean_plate, options.highlights);
    Picture picture = images.picture;
    const cv::Mat color = picture.color;
    DofOptions asked = options.dof;
    if (options.clean_plate) {
        const Device& device = stored.image.device();
        const DepthFile& depth = images.other_depth;
        asked.clean_plate = {to_device(device, images.clean_plate.color),
                             {to_device(device, depth.values), stored.camera, depth.storage}};
    }
    const CircleOfConfusion circle = circle_of(options.lens, stored, frame);
    const StoredDepth depths = repaired(stored, options.repair, options.lens);
    const Image sharp = to_device(stored.image.device(), color);
    picture.color = floats_on_host(sharp, color.channels(),
                                   [&](const Image& result) { dof(depths, sharp, result, circle, asked); });
    return picture;
}

void add_clean_plate_options(CLI::App& app, DofArguments& options) {
    const std::vector<description::Option> described = description::options_of(options.dof);
    app.add_option("--clean-plate", options.clean_plate, described_words(described, "--clean-plate"))
        ->type_name("IMAGE")
        ->group("Picture");
    app.add_option("--clean-plate-depth", options.clean_plate_depth,
                   described_words(described, "--clean-plate-depth", " (default: the clean plate's own file)"))
        ->type_name("DEPTH")
        ->group("Picture");
}

std::function<int()> configure_dof(CLI::App& app) {
    const Product product = picture_product("dof");
    const auto options = std::make_shared<DofArguments>();
    add_depth_options(app, *options, product);
    add_picture_options(app, options->picture, "the sharp picture");
    add_clean_plate_options(app, *options);
    add_lens_options(app, options->lens);
    add_blur_options(app, options->dof);
    add_explain(app, options->explain, "Blur");
    app.add_option("--highlights", options->highlights,
                   "how many times brighter than white a white is taken to be, which\n"
                   "a photograph has cut off (" +
                       description::highlights.limits() + "; default: 1; try 1.05 for a JPEG)")
        ->type_name("X")
        ->check(is_in(description::highlights))
        ->group("Blur");
    add_described_options(app, options->repair, "Blur");
    add_relative_options(app);
    options->camera.or_relative = true;
    return [=] {
        RelativeSource& relative = options->relative;
        relative.picture = 0; // of the companions
        relative.color_layer = options->picture.color_layer;
        complete(options->lens, relative, options->camera);
        More more;
        use_picture(more, options->picture);
        if (options->clean_plate) {
            options->camera.first_for([&](const ImportedCamera& camera) { options->packing = camera.packing; });
            more.companions.push_back({"--clean-plate", *options->clean_plate});
            more.companions.push_back(
                {"--clean-plate-depth", options->clean_plate_depth.value_or(*options->clean_plate)});
        }
        more.read = [options](const Job& job) { return read_images(*options, job); };
        more.length_doubts = [options](const StoredDepth& stored, const Subject& subject, const Job& job) {
            return blur_doubts(options->lens, stored, job, subject, options->dof.sky, options->dof.max_coc_px);
        };
        return each_depth(*options, product, more, [&](const StoredDepth& stored, Loaded& frame) {
            return std::vector<Result>{blur(*options, stored, frame)};
        });
    };
}

} // namespace

extern const Command dof_command{
    .name = "dof",
    .summary = description::DofCall::said.summary,
    .notes =
        R"(Light is blurred, not codes: see --color-space. The result has the picture's channels and, in a .png or .tif, its
codes: sRGB of 8 bits stay sRGB of 8 bits. A .jpg is sRGB, and .exr, .hdr, .pfm and .npy are linear floats. Invalid
pixels, and colours that are no numbers, take part in nothing. They keep the picture where no blur reaches them.

Give the lens by its focal length and sensor. With one of them the projection gives the other. The camera file may
hold both.

A clean plate is the same view without its near objects, of the same camera and size. Where it lies behind the
picture it shows what the picture hides. Where it shows the same it changes nothing.

With several inputs, OUT, every IMAGE and the clean plate's DEPTH are folders, in which each input keeps its own name.
docs/depth-of-field.md explains the method.

Example:
  fathom dof frame.exr --color frame.exr --camera camera.json -o blurred.exr --focus-at 640,360 --f-stop 2.8 \
      --focal-length-mm 50 --sensor-mm 36
  fathom dof frame.exr --color frame.png --camera camera.json -o blurred.png --focus 7 --f-stop 2 --sensor-mm 36 \
      --aperture 6 --rotation-degrees 15 --quality fast
  fathom dof depth.png --relative high-is-near --color photo.jpg -o blurred.jpg --blur-px 24 --focus-at 620,410)",
    .configure = configure_dof,
};

} // namespace fathom::cli
