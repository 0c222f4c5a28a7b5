// Commands of operations as their descriptions have them: options, images and results; and the methods that --max-error chooses.
#include "operation.hpp"

#include "command.hpp"

#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/images.hpp"
#include "cli/options/lens.hpp"
#include "io/floats_on_host.hpp"
#include "terminal/messages.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <utility>

namespace fathom::cli {
namespace {

using description::Content;
using description::Kind;
using description::Option;

std::optional<fathom::Operation> measured(const std::string& name) {
    for (const fathom::Operation each : {fathom::Operation::ssao, fathom::Operation::dof, fathom::Operation::normals})
        if (fathom::to_string(each) == name)
            return each;
    return std::nullopt;
}

// Checks that some method meets an input's --max-error. On request says on one line of stderr which method that is, and its error.
void explain_method(fathom::Operation operation, const StoredDepth& stored, Job& job, double max_error, bool explain) {
    MeasuredMethod cheapest;
    try {
        cheapest = cheapest_method(operation, stored, max_error);
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what(), option = "max_error = ";
        throw Error(message.starts_with(option) ? "--max-error " + message.substr(option.size()) : message);
    }
    if (explain)
        job.said.push_back(fmt::format("{}: {} {}: error up to {} (in the scene {})", job.input.native(),
                                       fathom::to_string(operation), cheapest.method, number(cheapest.error),
                                       cheapest.scene));
}

// The picture whose image an option belongs to: that of a clean plate's depth.
const Option* picture_of(const description::Operation& operation, const Option& option) {
    for (const Option& other : operation.options)
        if (other.kind == Kind::picture && std::ranges::count(option.needs, other.name) > 0)
            return &other;
    return nullptr;
}

// What a file of a result holds.
Product product_of(const description::Operation& operation, const description::Result& result) {
    if (result.content.of == Content::Of::light)
        return {.extensions = {".exr", ".tif", ".pfm", ".npy", ".png", ".jpg", ".hdr"},
                .channels = {"R", "G", "B", "A"},
                .png_scale = 1,
                .kind = ImageKind::color,
                .layer = operation.layer};
    Product product{.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"},
                    .channels = CLI::detail::split(result.content.channels, ' '),
                    .layer = operation.layer};
    if (result.content.of == Content::Of::fractions)
        product.png_scale = 1;
    if (result.content.of == Content::Of::directions)
        product.png_scale = product.png_offset = 0.5;
    return product;
}

} // namespace

OperationTask::OperationTask(const description::Operation& operation)
    : operation_(operation), call_(operation.make(nullptr)) {
    for (const Option& option : operation.options) {
        if (option.kind == Kind::picture && option.required)
            sharp_ = &option;
        if (option.kind == Kind::lens)
            circle_ = &option;
        if (option.kind == Kind::color)
            set(option, option.by_default.value());
    }
}

void OperationTask::set(const Option& option, description::Value value) {
    if (option.kind == Kind::color) { // a matrix is B, G, R
        auto& color = std::get<std::array<double, 3>>(value);
        std::swap(color[0], color[2]);
    }
    if (option.name == std::string_view("max_error"))
        max_error_ = std::get<double>(value);
    operation_.set(call_.get(), option, value);
}

Product OperationTask::product() const {
    return product_of(operation_, operation_.results_of(call_.get(), {}).front());
}

void OperationTask::add_options(CLI::App& app) {
    add_depth_options(app, *this, product());
    if (sharp_)
        add_picture_options(app, picture, sharp_->words);
    add_images(app);
    if (circle_)
        add_lens_options(app, lens_, *circle_);
    std::vector<Option> own = operation_.options;
    std::erase_if(own, [](const Option& option) { return option.kind == Kind::lens; }); // which the lens stands for
    add_described_options(
        app, own, [this](const Option& option, const description::Value& value) { set(option, value); },
        operation_.group);
    add_described_options(app, repair_, operation_.repair, operation_.group);
    for (const Option& option : operation_.options)
        if (option.kind == Kind::result && !spelled(option).empty())
            add_option(app, "Output", spelled(option).c_str(), "FILE", file_for(option),
                       fmt::format("also write {}", option.words));
    if (measured(operation_.name))
        app.add_flag("--explain", explain_, "print on stderr what --max-error chose, and its error")
            ->needs(app.get_option("--max-error"))
            ->group(operation_.group);
    camera.or_relative = circle_ != nullptr;
}

std::function<void(const std::string&)> OperationTask::file_for(const Option& option) {
    return [this, name = spelled(option)](const std::string& file) { files_[name] = file; };
}

void OperationTask::add_images(CLI::App& app) {
    for (const Option& option : operation_.options)
        if (option.is_image() && &option != sharp_)
            add_option(app, sharp_ ? "Picture" : "Input", spelled(option).c_str(),
                       option.kind == Kind::picture ? "IMAGE" : "FILE", file_for(option),
                       option.words +
                           std::string(picture_of(operation_, option) ? " (default: that of its picture's file)" : ""));
}

void OperationTask::prepare() {
    if (circle_)
        complete(lens_, relative, camera);
    for (const Option& option : operation_.options)
        if (option.kind == Kind::result && has_file(spelled(option)))
            operation_.set(call_.get(), option, true);
    outputs = {{"-o", output, product()}};
    for (const description::Result& result : operation_.results_of(call_.get(), {}))
        if (const auto file = files_.find(spelled(result.name)); file != files_.end()) {
            Product own = product_of(operation_, result);
            if (!own.png_scale) // it has no --png-scale of its own
                std::erase(own.extensions, ".png");
            own.layer = "";
            outputs.push_back({file->first, file->second, own});
        }
    if (has_picture()) {
        companions.push_back({"--color", picture.source, picture.pixels});
        made_of = 0;
    }
    for (const Option& option : operation_.options) {
        if (!option.is_image() || &option == sharp_)
            continue;
        const Option* const of_picture = picture_of(operation_, option);
        auto file = files_.find(spelled(option));
        if (file == files_.end() && of_picture && option.kind == Kind::depth)
            file = files_.find(spelled(*of_picture));
        if (file == files_.end())
            continue;
        companions.push_back({spelled(option), file->second});
        images_.push_back(&option);
    }
}

DepthFile OperationTask::read_other_depth(const std::filesystem::path& file, const Job& job) const {
    return read_depth(file, {.channel = channel,
                             .packing = job.camera ? job.camera->packing : std::nullopt,
                             .overscan = has_overscan(job.windows)});
}

Images OperationTask::read(const Job& job) const {
    Images images;
    std::size_t next = 0;
    if (has_picture())
        images.picture = picture_of(job.companions[next++], picture, job);
    for (const Option* const option : images_) {
        const std::filesystem::path& file = job.companions[next++];
        if (option->kind == Kind::picture) {
            images.clean_plate = picture_of(file, picture, job);
            check_same_channels(file, images.clean_plate, images.picture, job);
        } else if (option->kind == Kind::directions) {
            images.normals = read_normals(file, {}, job.windows);
            check_same_size(file, images.normals.size(), job);
        } else if (option->kind == Kind::lengths) {
            images.thickness = read_lengths(file, job);
        } else {
            const bool of_picture = !has_file(spelled(*option)); // whose file then holds it, too
            try {
                if (of_picture && list_channels(file).size() < 2) // which are the picture's
                    throw Error(file.native() + ": holds a picture only");
                images.other_depth = read_other_depth(file, job);
            } catch (const Error& error) {
                if (!of_picture)
                    throw;
                throw Error(
                    fmt::format("{}; a picture whose file holds no depth needs {}", error.what(), spelled(*option)));
            }
            check_same_pixels(file, images.other_depth, job);
        }
    }
    return images;
}

std::vector<std::string> OperationTask::doubts(const Job& job) const {
    return made_of ? picture_doubts(picture, job) : std::vector<std::string>{};
}

std::vector<Made> OperationTask::make(const StoredDepth& stored, Job& job) {
    if (max_error_ > 0)
        explain_method(*measured(operation_.name), stored, job, max_error_, explain_);
    const std::shared_ptr<void> call = operation_.make(call_.get());
    Images images = job.images.get(); // read by the device until the results are there
    change(images);
    const Device& device = stored.image.device();
    const auto set_image = [&](const Option& option, const description::Value& value) {
        operation_.set(call.get(), option, value);
    };
    if (sharp_)
        set_image(*sharp_, to_device(device, images.picture.color));
    for (const Option* const option : images_)
        if (option->kind == Kind::depth)
            set_image(*option, StoredDepth{to_device(device, images.other_depth.values), stored.camera,
                                           images.other_depth.storage});
        else
            set_image(*option, to_device(device, option->kind == Kind::picture      ? images.clean_plate.color
                                                 : option->kind == Kind::directions ? images.normals
                                                                                    : images.thickness));
    if (circle_)
        set_image(*circle_, circle_of(lens_, stored, job));
    set_for_input(call.get(), stored, images, job);
    return results(call.get(), operation_.repairs ? repaired(stored, repair_, lens_) : stored, job);
}

std::vector<Made> OperationTask::results(void* call, const StoredDepth& stored, const Job& job) const {
    const std::vector<description::Result> described = operation_.results_of(call, stored);
    std::vector<std::optional<io::FloatsOnHost>> made(described.size());
    for (std::size_t i = 0; i < described.size(); ++i)
        if (const Layout& layout = described[i].shape.layout; described[i].wanted)
            *described[i].image =
                made[i].emplace(stored.image.device(), cv::Size(layout.width, layout.height), layout.channels).image();
    operation_.run(call, stored, {});
    std::vector<Made> all;
    for (std::size_t i = 0; i < described.size(); ++i) {
        if (!made[i])
            continue;
        const bool has_directions = described[i].content.of == Content::Of::directions;
        all.emplace_back(has_directions ? directions_for(job.outputs[all.size()], made[i]->mat()) : made[i]->mat());
        if (described[i].content.of == Content::Of::light)
            all.back().format = job.images.get().picture.format;
    }
    return all;
}

std::function<int()> configure_operation(CLI::App& app, const std::shared_ptr<OperationTask>& task) {
    task->add_options(app);
    return [task] {
        task->prepare();
        return each_depth(*task);
    };
}

} // namespace fathom::cli
