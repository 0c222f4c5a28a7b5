// fathom ssao
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "doubts/lengths.hpp"
#include "io/formats.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>
#include <fathom/ssao.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace fathom::cli {
namespace {

constexpr const char *no_normals = "none", *channel_of_backs = "ZBack";

// The radius that a camera file of this name has.
double default_radius(const CameraFile& camera, const std::string& name) {
    try {
        return description::default_radius(camera.lens, name, "--radius");
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
}

// A region of the display window as one of the image.
Region region_in(const Windows& windows, const Region& wanted) {
    const cv::Rect& data = windows.data;
    const auto inside = [](int first, int count, int of_data, int pixels) {
        return first >= of_data && first - of_data <= pixels - count;
    };
    if (!inside(wanted.x, wanted.width, data.x, data.width) || !inside(wanted.y, wanted.height, data.y, data.height))
        throw Error(fmt::format("--region {},{},{},{} reaches beyond the image of {}; choose a part of it", wanted.x,
                                wanted.y, wanted.width, wanted.height, extent(data)));
    return {wanted.x - data.x, wanted.y - data.y, wanted.width, wanted.height};
}

class SsaoTask : public OwnTask<description::SsaoCall> {
public:
    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        const auto more = [&](const char* option, const std::string& words) {
            app.get_option(option)->description(app.get_option(option)->get_description() + words);
        };
        more("--normals",
             ". EXR, PNG, TIFF or PFM, as `fathom normals` writes them. Blender's pass beside the depth is "
             "taken by itself, if the camera file has a view; none leaves it out");
        app.get_option("--normals")->type_name("FILE|none");
        more("--back-depth",
             fmt::format(". Of an EXR the channel {}, if it has one; the file is stored as the depth is "
                         "otherwise",
                         channel_of_backs));
        app.add_flag_callback(
               "--full-resolution",
               [this] {
                   auto& sampling = call().options.sampling;
                   description::in<&Sampling::half_resolution>(sampling).make(sampling) = false;
               },
               "compute all pixels, whatever the quality chooses")
            ->excludes("--half-resolution", "--max-error")
            ->group(operation_.group);
    }

    void prepare() override {
        takes_pass_ = !has_file("--normals");
        if (const auto its = files_.find("--normals"); !takes_pass_ && its->second == no_normals)
            files_.erase(its);
        OwnTask::prepare();
        if (!(call().radius > 0)) // shows early what all cameras lack
            camera.first_for([&](const ImportedCamera& read) { default_radius(read, camera.name()); });
    }

    Images read(const Job& job) const override {
        Images images = OwnTask::read(job);
        if (const std::vector<std::string> pass = normal_pass(job); !pass.empty())
            images.normals = io::read_exr_floats(job.input, pass, "normals", job.windows);
        return images;
    }

    std::vector<std::string> length_doubts(const StoredDepth&, const Subject& subject, const Job& job) const override {
        return radius_doubts(subject, radius_of(job));
    }

    std::vector<Made> make(const StoredDepth& stored, Job& job) override {
        std::vector<Made> made = OwnTask::make(stored, job);
        if (const auto& region = call().options.region)
            for (Made& each : made) {
                const Region part = region_in(job.windows, *region);
                each.part = cv::Rect(part.x, part.y, part.width, part.height);
            }
        return made;
    }

protected:
    // Where solids end: the file's channel of that name, in any layer, or depth as the input holds it.
    DepthFile read_other_depth(const std::filesystem::path& file, const Job& job) const override {
        const std::vector<Channel> channels = list_channels(file);
        const auto named = std::ranges::find_if(channels, [](const Channel& each) {
            return each.name.substr(each.name.rfind('.') + 1) == channel_of_backs;
        });
        if (std::error_code none; named == channels.end() && std::filesystem::equivalent(file, job.input, none))
            throw Error(
                fmt::format("{}: has no channel {}, and is the depth image itself; --back-depth needs a file of "
                            "where solids end",
                            file.native(), channel_of_backs));
        return read_depth(file, {.channel = named == channels.end() ? channel : named->name,
                                 .packing = job.camera->packing,
                                 .overscan = has_overscan(job.windows)});
    }

    void set_for_input(void* call_of_input, const StoredDepth& stored, const Images& images, Job& job) override {
        auto& its = *static_cast<description::SsaoCall*>(call_of_input);
        its.radius = radius_of(job);
        if (its.options.region)
            its.options.region = region_in(job.windows, *its.options.region);
        if (images.normals.empty() || !takes_pass_)
            return;
        its.options.normals = to_device(stored.image.device(), images.normals);
        its.options.normals_space = Space::world;
        if (!std::exchange(told_, true) && report != Report::nothing)
            job.said.push_back(fmt::format("{}: its pass of normals counts; to have normals from the depth alone, say "
                                           "--normals none",
                                           job.input.native()));
    }

private:
    double radius_of(const Job& job) const {
        return call().radius > 0 ? call().radius : default_radius(*job.camera, job.camera_name.native());
    }

    // The channels of Blender's normals beside the depth that was read, which are the world's. Empty without them.
    std::vector<std::string> normal_pass(const Job& job) const {
        const bool of_blender = job.channel.ends_with(".Depth.Z") || job.channel.ends_with(".Depth.V");
        if (!takes_pass_ || !job.camera->camera.view || !of_blender)
            return {};
        const std::string layer = job.channel.substr(0, job.channel.size() - std::string_view("Depth.Z").size());
        std::vector<std::string> names;
        for (const Channel& each : list_channels(job.input)) // in the order of letters
            for (const char* axis : {"X", "Y", "Z"})
                if (each.name == layer + "Normal." + axis && (each.type == "half" || each.type == "float"))
                    names.push_back(each.name);
        return names.size() == 3 ? names : std::vector<std::string>{};
    }

    bool takes_pass_ = true; // of the depth's file
    bool told_ = false;      // that a file's own normals count, which is said once
};

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
    .configure = configure_own<SsaoTask>,
};

} // namespace fathom::cli
