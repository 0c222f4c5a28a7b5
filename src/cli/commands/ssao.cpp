// fathom ssao
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "doubts/lengths.hpp"
#include "io/floats_on_host.hpp"
#include "io/formats.hpp"
#include "shot/each_depth.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/lens.hpp>
#include <fathom/opencv.hpp>
#include <fathom/ssao.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace fathom::cli {
namespace {

struct SsaoArguments : DepthOptions, description::SsaoCall {
    bool explain = false;
    bool has_world = false; // is the world known from the first camera's view?
    bool told = false;      // that a file's own normals count, which is said once
    std::optional<std::string> normals, thickness_map, back_depth;
    std::optional<Packing> packing;          // of the depths, as the camera file says
    std::map<std::string, std::string> more; // files of other results, by their names
};

// Not before main: it would have nobody to catch a lack of memory.
const description::Operation& described_ssao() {
    return description::operation<description::SsaoCall>();
}

void add_occlusion_options(CLI::App& app, SsaoArguments& options) {
    description::SsaoCall& described = options;
    add_described_options(app, described, described_ssao().group);
    app.add_flag_callback(
           "--full-resolution",
           [&sampling = options.options.sampling] {
               description::in<&Sampling::half_resolution>(sampling).make(sampling) = false;
           },
           "compute all pixels, whatever the quality chooses")
        ->excludes("--half-resolution", "--max-error")
        ->group(described_ssao().group);
    add_explain(app, options.explain, described_ssao().group);
}

// The radius that a camera file of this name has.
double default_radius(const CameraFile& camera, const std::string& name) {
    try {
        return description::default_radius(camera.lens, name, "--radius");
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
}

double radius_of(const SsaoArguments& options, const Job& job) {
    return options.radius > 0 ? options.radius : default_radius(*job.own_camera, job.camera_file.native());
}

// A region of the display window as one of the image.
std::optional<Region> region_in(const Windows& windows, const std::optional<Region>& region) {
    if (!region)
        return std::nullopt;
    const cv::Rect& data = windows.data;
    const Region& wanted = *region;
    const auto inside = [](int first, int count, int of_data, int pixels) {
        return first >= of_data && first - of_data <= pixels - count;
    };
    if (!inside(wanted.x, wanted.width, data.x, data.width) || !inside(wanted.y, wanted.height, data.y, data.height))
        throw Error(fmt::format("--region {},{},{},{} reaches beyond the image of {}; choose a part of it", wanted.x,
                                wanted.y, wanted.width, wanted.height, extent(data)));
    return Region{wanted.x - data.x, wanted.y - data.y, wanted.width, wanted.height};
}

constexpr const char* no_normals = "none";

// The channels of Blender's normals beside the depth that was read, which are the world's. Empty without them.
std::vector<std::string> normal_pass(const SsaoArguments& options, const Job& job) {
    const bool has_world = job.own_camera ? job.own_camera->camera.view.has_value() : options.has_world;
    const bool of_blender = job.channel.ends_with(".Depth.Z") || job.channel.ends_with(".Depth.V");
    if (options.normals || !has_world || !of_blender)
        return {};
    std::vector<std::string> names;
    for (const Channel& channel : list_channels(job.input))
        for (const char* axis : {"X", "Y", "Z"})
            if (channel.name ==
                    job.channel.substr(0, job.channel.size() - std::string_view("Depth.Z").size()) + "Normal." + axis &&
                (channel.type == "half" || channel.type == "float"))
                names.push_back(channel.name);
    return names.size() == 3 ? names
                             : std::vector<std::string>{}; // in the order of the file's, which is that of letters
}

bool gives_normals(const SsaoArguments& options) {
    return options.normals && options.normals != no_normals;
}

cv::Mat read_thickness(const std::filesystem::path& file, const Job& job) {
    const DepthFile read = read_depth(file, {.overscan = has_overscan(job.windows)});
    check_same_pixels(file, read, job);
    if (read.storage != Storage::float32 && read.storage != Storage::float16)
        throw Error(file.native() + ": holds integers, but a thickness is a float in scene units; save it as float");
    cv::Mat thickness;
    read.values.convertTo(thickness, CV_32F);
    return thickness;
}

constexpr const char* channel_of_backs = "ZBack";

// Where solids end: the file's channel of that name, in any layer, or depth as the input holds it.
DepthFile read_backs(const std::filesystem::path& file, const SsaoArguments& options, const Job& job) {
    ReadOptions asked{.channel = options.channel, .packing = options.packing, .overscan = has_overscan(job.windows)};
    const std::vector<Channel> channels = list_channels(file);
    const auto named = std::ranges::find_if(channels, [](const Channel& channel) {
        return channel.name.substr(channel.name.rfind('.') + 1) == channel_of_backs;
    });
    if (named != channels.end())
        asked.channel = named->name;
    else if (std::error_code none; std::filesystem::equivalent(file, job.input, none))
        throw Error(fmt::format("{}: has no channel {}, and is the depth image itself; --back-depth needs a file of "
                                "where solids end",
                                file.native(), channel_of_backs));
    DepthFile depth = read_depth(file, asked);
    check_same_pixels(file, depth, job);
    return depth;
}

Images read_images(const SsaoArguments& options, const Job& job) {
    Images images;
    if (gives_normals(options)) {
        const std::filesystem::path& file = job.companions.front();
        images.normals = read_normals(file, {}, job.windows);
        check_same_size(file, images.normals.size(), job);
    } else if (const std::vector<std::string> pass = normal_pass(options, job); !pass.empty()) {
        images.normals = io::read_exr_floats(job.input, pass, "normals", job.windows);
    }
    const std::size_t next = gives_normals(options) ? 1 : 0;
    if (options.thickness_map)
        images.thickness = read_thickness(job.companions[next], job);
    if (options.back_depth)
        images.other_depth = read_backs(job.companions[next], options, job);
    return images;
}

// Visibility, then what else was asked for, in the order of the options.
std::vector<Result> occlude(SsaoArguments& options, const StoredDepth& stored, Loaded& frame) {
    const std::optional<Region> region = region_in(frame.windows, options.options.region);
    explain_method(fathom::Operation::ssao, stored, frame, options.options.sampling, options.explain);
    description::SsaoCall call = options;
    call.radius = radius_of(options, frame);
    call.options.region = region;
    const Images& images = frame.images.get();
    if (!images.normals.empty())
        call.options.normals = to_device(stored.image.device(), images.normals);
    if (!images.normals.empty() && !options.normals) {
        call.options.normals_space = Space::world;
        if (!std::exchange(options.told, true) && options.report != Report::nothing)
            frame.said.push_back(
                fmt::format("{}: its pass of normals counts; to have normals from the depth alone, say "
                            "--normals none",
                            frame.input.native()));
    }
    if (options.thickness_map)
        call.options.thickness = to_device(stored.image.device(), images.thickness);
    if (options.back_depth)
        call.options.thickness = StoredDepth{to_device(stored.image.device(), images.other_depth.values), stored.camera,
                                             images.other_depth.storage};
    std::vector<Result> results = run(described_ssao(), &call, stored, frame);
    for (Result& result : results)
        if (region)
            result.part = cv::Rect(region->x, region->y, region->width, region->height);
    return results;
}

std::function<int()> configure_ssao(CLI::App& app) {
    const auto options = std::make_shared<SsaoArguments>();
    description::SsaoCall& call = *options;
    const Product visibility = product_of(described_ssao(), described_ssao().results_of(&call, {}).front());
    add_depth_options(app, *options, visibility);
    add_occlusion_options(app, *options);
    app.add_option(
           "--normals", options->normals,
           described_words(
               described_ssao().options, "--normals",
               ". EXR, PNG, TIFF or PFM, as `fathom normals` writes them. Blender's pass beside the depth is taken "
               "by itself, if the camera file has a view; none leaves it out"))
        ->type_name("FILE|none")
        ->group("Input");
    app.add_option("--thickness-map", options->thickness_map,
                   described_words(described_ssao().options, "--thickness-map"))
        ->type_name("FILE")
        ->group("Input");
    app.add_option("--back-depth", options->back_depth,
                   described_words(described_ssao().options, "--back-depth",
                                   fmt::format(". Of an EXR the channel {}, if it has one; the file is stored as the "
                                               "depth is otherwise",
                                               channel_of_backs)))
        ->type_name("FILE")
        ->group("Input");
    add_result_options(app, described_ssao(), options->more);

    return [=] {
        if (!(options->radius > 0)) {
            options->camera.first_for([&](const ImportedCamera& camera) {
                const double of_first = default_radius(camera, options->camera.name());
                if (!options->camera.is_pattern()) // or each frame's camera has its own
                    options->radius = of_first;
            });
        }
        options->camera.first_for(
            [&](const ImportedCamera& camera) { options->has_world = camera.camera.view.has_value(); });
        More more;
        if (gives_normals(*options))
            more.companions.push_back({"--normals", *options->normals});
        if (options->thickness_map)
            more.companions.push_back({"--thickness-map", *options->thickness_map});
        if (options->back_depth) {
            options->camera.first_for([&](const ImportedCamera& camera) { options->packing = camera.packing; });
            more.companions.push_back({"--back-depth", *options->back_depth});
        }
        more.outputs = outputs_of(described_ssao(), static_cast<description::SsaoCall*>(options.get()), options->more);
        more.read = [options](const Job& job) { return read_images(*options, job); };
        more.length_doubts = [options](const StoredDepth&, const Subject& subject, const Job& job) {
            return radius_doubts(subject, radius_of(*options, job));
        };
        return each_depth(*options, visibility, more,
                          [&](const StoredDepth& stored, Loaded& frame) { return occlude(*options, stored, frame); });
    };
}

} // namespace

extern const Command ssao_command{
    .name = "ssao",
    .summary = description::SsaoCall::said.summary,
    .notes =
        R"(The result is visibility, from 1 (open) to 0 (blocked). Multiply ambient light by it. An EXR holds it as channel
AO, a .png in 16 bits as round(value × 65535). The background has 1. Invalid pixels have NaN, and 0 in a .png. A bent
normal has the EXR channels N.X N.Y N.Z. A .png of it holds ½n + ½, and black for none.

With several inputs, OUT and every FILE above are folders, in which each input keeps its own name. If one file of an
input cannot be written, none of that input's files is replaced. docs/ambient-occlusion.md explains the method.

Example:
  fathom ssao frame.exr --camera camera.json -o frame.ao.png --radius 0.5
  fathom ssao shots/*.exr --camera camera.json -o ao/ --radius 0.5 --quality accurate --thickness inf)",
    .configure = configure_ssao,
};

} // namespace fathom::cli
