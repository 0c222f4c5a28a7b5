// What is peculiar to the commands of some operations: all else is made of their descriptions.
#include "cli/operation.hpp"
#include "cli/options.hpp"
#include "description/lens.hpp"
#include "doubts/lengths.hpp"

#include <fathom/error.hpp>
#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>
#include <fathom/ssao.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>

namespace fathom::cli {
namespace {

// A .ply has points with colours and normals.
class UnprojectTask : public OwnTask<description::UnprojectCall> {
public:
    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_picture_options(app, picture, "colours of the points of a .ply", false);
        add_flag(app, operation_.group, "--normals", normals_, "a .ply also holds the points' normals");
    }

    void prepare() override {
        OwnTask::prepare();
        made_of_picture = false;
        const bool colored = !picture.source.empty();
        if (extension() != ".ply" && (colored || normals_))
            throw UsageError(fmt::format("{}: only a .ply holds {}; write one (for several inputs: --format ply)",
                                         output, colored ? "colours of points" : "normals of points"));
    }

    std::vector<Made> make(const StoredDepth& stored, Job& job) override {
        std::vector<Made> made = OwnTask::make(stored, job);
        Made& points = made.front();
        if (const cv::Mat& color = job.images.get().picture.color; !color.empty())
            cv::resize(color, points.colors, points.size, 0, 0, cv::INTER_AREA);
        if (normals_)
            points.normals = to_mat(normals(stored, {.space = call().options.space}));
        return made;
    }

protected:
    Product product() const override {
        Product product = OwnTask::product();
        product.extensions.insert(product.extensions.begin() + 1, ".ply");
        return product;
    }

private:
    bool normals_ = false;
};

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
        const auto take_all_pixels = [this] {
            auto& sampling = call().options.sampling;
            description::in<&Sampling::half_resolution>(sampling).make(sampling) = false;
        };
        add_flag(app, operation_.group, "--full-resolution", take_all_pixels,
                 "compute all pixels, whatever the quality chooses")
            ->excludes("--half-resolution", "--max-error");
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
    std::string channel_of_other_depth(const std::filesystem::path& file, const Job& job) const override {
        const std::vector<Channel> channels = list_channels(file);
        const auto named = std::ranges::find_if(channels, [](const Channel& each) {
            return each.name.substr(each.name.rfind('.') + 1) == channel_of_backs;
        });
        if (std::error_code none; named == channels.end() && std::filesystem::equivalent(file, job.input, none))
            throw Error(
                fmt::format("{}: has no channel {}, and is the depth image itself; --back-depth needs a file of "
                            "where solids end",
                            file.native(), channel_of_backs));
        return named == channels.end() ? channel : named->name;
    }

    void set_for_input(void* call_of_input, const StoredDepth& stored, const Images& images, const Job& job) override {
        auto& its = *static_cast<description::SsaoCall*>(call_of_input);
        its.radius = radius_of(job);
        if (its.options.region)
            its.options.region = region_in(job.windows, *its.options.region);
        if (images.normals.empty() || !takes_pass_)
            return;
        its.options.normals = to_device(stored.image.device(), images.normals);
        its.options.normals_space = Space::world;
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
};

// The circle, and the weights, which go into one file. One of them alone is written by --mask.
class DofMasksTask : public OwnTask<description::DofMasksCall> {
public:
    DofMasksTask() {
        for (const description::Result& result : operation_.results_of(call_.get(), {}))
            if (result.wanted || spelled(result.name).empty())
                masks_.push_back(result.content.channels);
    }

    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_picture_options(app, picture, "a picture whose size and edges the masks are to have", false);
        add_option(app, "Output", "--mask", CLI::detail::join(masks_, "|"), mask_,
                   "write this mask only, to any type of file")
            ->check(is_one_of(masks_));
    }

    void prepare() override {
        for (const description::Option& option : operation_.options)
            if (option.kind == description::Kind::result && spelled(option).empty())
                operation_.set(call_.get(), option, mask_.empty() || option.name == mask_ + "_weight");
        OwnTask::prepare();
        Product& product = outputs.front().product;
        product.layer = "depth";
        product.channels = masks_;
        if (!mask_.empty()) {
            product.channels = {mask_};
            product.png_scale = mask_ == masks_.front() || png_scale ? png_scale : 1.0;
        } else if (extension() != ".exr" && std::ranges::count(product.extensions, extension()) > 0) {
            throw UsageError(fmt::format("{}: a {} holds one mask; choose it with --mask {}, or write .exr", output,
                                         extension(), CLI::detail::join(masks_, "|")));
        } else {
            product.extensions = {".exr"};
        }
    }

    std::vector<Made> make(const StoredDepth& stored, Job& job) override {
        std::vector<Made> made = OwnTask::make(stored, job);
        if (!mask_.empty()) {
            if (mask_ != masks_.front())
                made.erase(made.begin()); // the circle
            return made;
        }
        const auto others = made.begin() + static_cast<std::ptrdiff_t>(masks_.size());
        std::vector<cv::Mat> masks;
        std::transform(made.begin(), others, std::back_inserter(masks), [](const Made& each) { return each.image; });
        cv::merge(masks, made.front().image);
        made.erase(made.begin() + 1, others);
        return made;
    }

private:
    std::vector<std::string> masks_;
    std::string mask_; // empty: all
};

class DofTask : public OwnTask<description::DofCall> {
public:
    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_option(app, operation_.group, "--highlights", "X", highlights_,
                   "how many times brighter than white a white is taken to be, which a photograph has cut off (" +
                       description::highlights.limits() + "; default: 1; try 1.05 for a JPEG)")
            ->check(is_in(description::highlights));
    }

protected:
    void change(Images& images) const override {
        if (highlights_ > 1) // once for each width that is tried
            images.picture.color = images.picture.color.clone();
        restore_highlights(images.picture, highlights_); // which may change from frame to frame
        restore_highlights(images.clean_plate, highlights_);
    }

private:
    double highlights_ = 1;
};

constexpr const char* ssao_notes =
    R"(The result is visibility, from 1 (open) to 0 (blocked). Multiply ambient light by it. An EXR holds it as channel
AO, a .png in 16 bits as round(value × 65535). The background has 1. Invalid pixels have NaN, and 0 in a .png. A bent
normal has the EXR channels N.X N.Y N.Z. A .png of it holds ½n + ½, and black for none.

With several inputs, OUT and every FILE above are folders, in which each input keeps its own name. If one file of an
input cannot be written, none of that input's files is replaced. docs/ambient-occlusion.md explains the method.

Example:
  fathom ssao frame.exr --camera camera.json -o frame.ao.png --radius 0.5
  fathom ssao shots/*.exr --camera camera.json -o ao/ --radius 0.5 --quality accurate --thickness inf)";

constexpr const char* dof_masks_notes =
    R"(An EXR holds four channels. coc is the diameter of the circle of confusion (CoC) in pixels, positive behind the focus.
near, focus and far are weights that sum to 1. Invalid pixels have a CoC of NaN and no weight. A .png of a weight holds
round(value × 65535). The CoC has no such range: it needs --png-scale and loses its negative values.

Give the lens by its focal length and sensor. With one of them the projection gives the other. For an orthographic
camera the CoC grows with the distance from the focus without end (telecentric). --max-coc-px ends it.

With several inputs, OUT and every FILE above are folders. The EXR channels are coc (--max-near-coc), near
(--near-alpha), disocclusion (--disocclusion), mixed (--mixed-pixels), min (--tile-min-coc) and max (--tile-max-coc).
docs/depth-of-field.md explains each mask.

Example:
  fathom dof-masks frame.exr --camera camera.json -o frame.masks.exr --focus-at 640,360 --f-stop 2.8 \
      --focal-length-mm 50 --sensor-mm 36
  fathom dof-masks frame.exr --camera camera.json -o frame.near.png --mask near --focus 7 --f-stop 2 --sensor-mm 36)";

constexpr const char* dof_notes =
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
  fathom dof depth.png --relative high-is-near --color photo.jpg -o blurred.jpg --blur-px 24 --focus-at 620,410)";

// What runs an operation, and what its help says below the options.
std::pair<std::shared_ptr<OperationTask>, const char*> task_of(const description::Operation& operation) {
    const std::string_view name = operation.name;
    if (name == "unproject")
        return {std::make_shared<UnprojectTask>(), operation.notes};
    if (name == "ssao")
        return {std::make_shared<SsaoTask>(), ssao_notes};
    if (name == "dof_masks")
        return {std::make_shared<DofMasksTask>(), dof_masks_notes};
    if (name == "dof")
        return {std::make_shared<DofTask>(), dof_notes};
    return {std::make_shared<OperationTask>(operation), operation.notes};
}

} // namespace

Command command_of(const description::Operation& operation) {
    const auto [task, notes] = task_of(operation);
    return {.name = spelled(operation.name).substr(2),
            .summary = operation.summary,
            .notes = notes,
            .configure = [task = task](CLI::App& app) {
                task->add_options(app);
                return [task] {
                    task->prepare();
                    return each_depth(*task);
                };
            }};
}

} // namespace fathom::cli
