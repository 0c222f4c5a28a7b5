// Commands of operations as their descriptions have them: options, images and results; the lens, or the blur of relative depth in
// its place; and the methods that --max-error chooses.
#include "operation.hpp"

#include "camera/photograph.hpp"
#include "cli/options.hpp"
#include "description/lens.hpp"
#include "doubts/lengths.hpp"
#include "io/floats_on_host.hpp"
#include "text.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/dof.hpp>
#include <fathom/error.hpp>
#include <fathom/linearize.hpp>
#include <fathom/supersampled.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace fathom::cli {
namespace {

using description::Content;
using description::Kind;
using description::Option;

constexpr description::Range supersamplings = description::whole(1, most_supersampled);

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

// Throws: Error where an image from another file is not of the depth's size.
void check_same_size(const std::filesystem::path& file, cv::Size size, const Job& job,
                     const char* wanted = "be of the same size") {
    if (const cv::Size depth = job.windows.data.size(); size != depth)
        io::refuse(file, fmt::format("is {}, but {} is {}; both must {}", io::described(size), job.input.native(),
                                     io::described(depth), wanted));
}

// Throws: Error where another depth image does not lie where the depth does.
void check_same_pixels(const std::filesystem::path& file, const DepthFile& other, const Job& job) {
    check_same_size(file, other.values.size(), job);
    if (other.windows != job.windows)
        throw Error(fmt::format("{}: has other data and display windows than {}; write both with the same ones",
                                file.native(), job.input.native()));
}

// Throws: Error where the ratio of width to height is not that of the depth, by more than a pixel of the smaller one.
void check_same_view(const std::filesystem::path& file, cv::Size size, const Job& job) {
    const cv::Size depth = job.windows.data.size();
    if (!have_same_ratio(size.width, size.height, depth.width, depth.height))
        check_same_size(file, size, job, "show the same, with the same ratio of width to height");
}

// Unit vectors as a file of this name holds them: in a .png ½n + ½ would make grey of (0, 0, 0), which is none, so it
// becomes NaN, which is black there.
cv::Mat directions_for(const std::filesystem::path& file, cv::Mat directions) {
    if (extension_of(file) == ".png")
        for (int y = 0; y < directions.rows; ++y)
            for (int x = 0; x < directions.cols; ++x)
                if (auto& n = directions.at<cv::Vec3f>(y, x); n == cv::Vec3f(0, 0, 0))
                    n = cv::Vec3f::all(std::numeric_limits<float>::quiet_NaN());
    return directions;
}

// The windows that the picture is to have: none where it has another size than the depth.
std::optional<Windows> windows_for(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    if (!is_exr(file) || has_overscan(job.windows))
        return job.windows;
    const Windows held = io::exr_windows(file, color_channels(file, options.layer).front());
    return held.display == job.windows.display ? std::optional(job.windows) : std::nullopt;
}

// Reads a picture of the depth's view, whose size may be another one.
// Throws: Error for a file that is none, or one of another ratio of width to height.
Picture read_color(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    Picture picture = read_picture(
        file, {.layer = options.layer, .encoding = options.encoding, .windows = windows_for(file, options, job)});
    check_same_view(file, picture.color.size(), job);
    return picture;
}

// Throws: Error where two pictures of a view are not of one size, or where only one of them has an alpha.
void check_same_channels(const std::filesystem::path& file, const Picture& other, const Picture& picture,
                         const Job& job) {
    if (other.color.size() != picture.color.size())
        check_same_size(file, other.color.size(), job);
    if (other.color.channels() != picture.color.channels())
        throw Error(fmt::format("{}: has {} channels, but {} has {}; both must have an alpha, or none", file.native(),
                                other.color.channels(), job.companions.front().native(), picture.color.channels()));
}

// Reads a length for each pixel, as CV_32F.
// Throws: Error for integers, and for an image of another size.
cv::Mat read_lengths(const std::filesystem::path& file, const Job& job) {
    const DepthFile read = read_depth(file, {.overscan = has_overscan(job.windows)});
    check_same_pixels(file, read, job);
    if (read.storage != Storage::float32 && read.storage != Storage::float16)
        throw Error(file.native() + ": holds integers, but a thickness is a float in scene units; save it as float");
    cv::Mat lengths;
    read.values.convertTo(lengths, CV_32F);
    return lengths;
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
double depth_under(const LensArguments::Pixel& pixel, const StoredDepth& stored, const Windows& windows,
                   const LensArguments::Pixel& given) {
    const auto [x, y] = pixel_in(windows, pixel, "--focus-at");
    try {
        return depth_at(stored, x, y);
    } catch (const std::invalid_argument&) {
        throw Error(fmt::format("--focus-at: pixel {},{} is invalid; choose one that has a depth", given.x, given.y));
    }
}

// Adds the options of the lens, of the circle instead of it, and of relative depth.
void add_lens_options(CLI::App& app, LensArguments& lens, const description::Option& circle) {
    const std::vector<description::Option>& options = description::operation<description::DofCall>().lens;
    add_described_options(app, lens, options, "Lens");
    add_described_options(
        app, {circle},
        [&lens](const description::Option&, const description::Value& value) {
            const auto& its = std::get<CircleOfConfusion>(value);
            lens.circle = {static_cast<double>(its.k), static_cast<double>(its.g)};
        },
        "Lens");
    for (const description::Option& option : options)
        if (description::is_of_relative(option))
            app.get_option(spelled(option))->group("Relative depth");
    for (const char* other : {"--camera", "--preset", "--image", "--node", "--undistorted", "--valid"})
        app.get_option("--relative")->excludes(other);
}

// Takes what is read of relative depth from the lens, and what the lens lacks from the camera. Refuses relative depth without a
// blur or a focus, and a lens that is still incomplete or impossible. Where each input has a camera of its own, that waits until
// it is read.
// Throws: UsageError, and Error for the camera file.
void complete(LensArguments& lens, DepthOptions& options) {
    options.relative = lens.relative;
    if (lens.relative) {
        options.relative_options = relative_options(lens);
        options.relative_options.edges = options.edges.value_or(Edges::sharpen);
        return complete(lens, {}, relative_camera(1, 1, *lens.relative).projection, "the camera");
    }
    if (!options.camera.of_headers()) // shows early what all cameras lack
        options.camera.first_for([&](const ImportedCamera& read) {
            LensArguments of_first = lens;
            complete(of_first, read.lens, read.camera.projection, options.camera.name());
        });
}

// The circle of an input, whose own camera may complete the lens, and whose image gives the focus if the lens focuses on a pixel.
// Pixels are counted in the display window, which the sensor has, too.
// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_of(const LensArguments& given, const StoredDepth& stored, const Job& job, int factor) {
    if (given.circle)
        return circle_for(supersampled(given, factor), stored);
    const Windows small = smaller(job.windows, factor); // in whose pixels people count
    if (given.focus_at)
        pixel_in(small, *given.focus_at, "--focus-at");
    if (given.focus_along)
        pixel_in(small, given.focus_along->pixel, "--focus-along");
    LensArguments lens = within(job.windows, supersampled(lens_of(given, job), factor));
    if (lens.focus_at && lens.relative) // all of whose pixels are the image's
        depth_under(*lens.focus_at, stored, job.windows, *given.focus_at);
    else if (const auto pixel = std::exchange(lens.focus_at, std::nullopt))
        lens.focus = depth_under(*pixel, stored, job.windows, *given.focus_at);
    try {
        return circle_for(lens, stored);
    } catch (const std::invalid_argument& error) { // of the lens, not of the camera file
        throw Error(fmt::format("the lens does not fit: {}", error.what()));
    }
}

} // namespace

void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what, bool required) {
    add_option(app, "Picture", "--color", "IMAGE", options.source,
               what + ": EXR, JPEG, PNG, TIFF, HDR or PFM. It shows what the depth shows, which may have another size")
        ->required(required);
    add_option(app, "Picture", "--color-layer", "NAME", options.layer,
               "EXR layer that holds the picture (default: R, G, B, or *.Combined, *.beauty, or the only one)");
    add_raw_format_option(app, "--color-format", options.pixels, 3, "of a picture in a pipe");
    add_enum_option(app, "Picture", "--color-space", options.encoding,
                    {{"auto", std::nullopt}, {"linear", ColorEncoding::linear}, {"srgb", ColorEncoding::srgb}},
                    "how the picture counts light. auto (default): JPEG and integers are sRGB unless the file says "
                    "linear, floats are linear");
}

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
    const auto add_file = [&](const char* group, const Option& option, const char* type, const std::string& words) {
        const std::string name = spelled(option);
        add_option(
            app, group, name, type, [this, name](const std::string& file) { files_[name] = file; }, words);
    };
    add_depth_options(app, *this, product());
    if (sharp_)
        add_picture_options(app, picture, sharp_->words, true);
    for (const Option& option : operation_.options)
        if (option.is_image() && &option != sharp_)
            add_file(sharp_ ? "Picture" : "Input", option, option.kind == Kind::picture ? "IMAGE" : "FILE",
                     option.words +
                         std::string(picture_of(operation_, option) ? " (default: that of its picture's file)" : ""));
    if (operation_.supersample)
        add_option(app, "Input", "--supersampled", "N", supersampled,
                   "the depth and the picture are of a frame N times as large each way as the results, each pixel of "
                   "which is the mean of N x N (" +
                       supersamplings.limits() + ")")
            ->check(is_in(supersamplings));
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
            add_file("Output", option, "FILE", fmt::format("also write {}", option.words));
    if (measured(operation_.name))
        add_flag(app, operation_.group, "--explain", explain_, "print on stderr what --max-error chose, and its error")
            ->needs(app.get_option("--max-error"));
    camera.or_relative = circle_ != nullptr;
}

void OperationTask::prepare() {
    if (circle_)
        complete(lens_, *this);
    if (supersampled > 1 && append)
        throw UsageError("--append: the results of --supersampled have fewer pixels than their input; leave one of "
                         "them out");
    if (const std::string refused = supersample(operation_.make(call_.get()).get()); !refused.empty())
        throw UsageError(refused); // early
    if (const int grown = repair_.grow_foreground * supersampled; grown > most_grown_pixels)
        throw UsageError(fmt::format("--grow-foreground: {} pixels of the result are {} of the frame; give {} or less",
                                     repair_.grow_foreground, grown, most_grown_pixels / supersampled));
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
        made_of_picture = true;
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

std::string OperationTask::supersample(void* call) const {
    try {
        if (supersampled > 1)
            operation_.supersample(call, supersampled);
        return "";
    } catch (const std::invalid_argument& error) {
        std::string message = error.what();
        std::replace(message.begin(), std::ranges::find(message, ' '), '_', '-');
        return "--" + message;
    }
}

Images OperationTask::read(const Job& job) const {
    Images images;
    std::size_t next = 0;
    if (has_picture())
        images.picture = read_color(job.companions[next++], picture, job);
    for (const Option* const option : images_) {
        const std::filesystem::path& file = job.companions[next++];
        if (option->kind == Kind::picture) {
            images.clean_plate = read_color(file, picture, job);
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
                images.other_depth = read_depth(file, {.channel = channel_of_other_depth(file, job),
                                                       .packing = job.camera ? job.camera->packing : std::nullopt,
                                                       .gamma = job.camera ? job.camera->gamma : std::nullopt,
                                                       .overscan = has_overscan(job.windows)});
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
    if (!made_of_picture || picture.encoding != ColorEncoding::linear)
        return {};
    const std::filesystem::path& file = job.companions.front();
    const PictureFormat format =
        read_picture(file, {.layer = picture.layer, .windows = windows_for(file, picture, job)}).format;
    if (format.bits != 8 || format.encoding == ColorEncoding::linear)
        return {};
    return {fmt::format("--color-space linear: {} holds 8 bits, which are sRGB where the file does not say otherwise; "
                        "leave the option out",
                        file.native())};
}

std::vector<std::string> OperationTask::blur_doubts(const StoredDepth& stored, const Job& job, const Subject& subject,
                                                    Sky sky, double max_coc_px) const {
    CircleOfConfusion circle = circle_of(lens_, stored, job, supersampled); // in the frame's pixels
    if (supersampled > 1)
        max_coc_px = std::min(max_coc_px, DofOptions{}.max_coc_px / supersampled);
    circle.k = static_cast<double>(circle.k) / supersampled;
    circle.g = static_cast<double>(circle.g) / supersampled;
    return lens_doubts(subject, lens_of(lens_, job), circle, sky, max_coc_px, lens_words());
}

std::vector<Made> OperationTask::make(const StoredDepth& stored, Job& job) {
    if (max_error_ > 0)
        explain_method(*measured(operation_.name), stored, job, max_error_, explain_);
    const std::shared_ptr<void> call = operation_.make(call_.get());
    if (const std::string refused = supersample(call.get()); !refused.empty()) // of an option that changes
        throw Error(refused);
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
        set_image(*circle_, circle_of(lens_, stored, job, supersampled));
    set_for_input(call.get(), stored, images, job);
    DepthRepair repair = repair_;
    repair.grow_foreground *= supersampled;
    return results(call.get(), operation_.repairs ? repaired(stored, repair) : stored, job);
}

std::vector<Made> OperationTask::results(void* call, const StoredDepth& stored, const Job& job) const {
    const std::vector<description::Result> described = operation_.results_of(call, stored);
    const Device& device = stored.image.device();
    std::vector<std::optional<io::FloatsOnHost>> made(described.size());
    for (std::size_t i = 0; i < described.size(); ++i)
        if (const Layout& layout = described[i].shape.layout; described[i].wanted) {
            *described[i].image =
                made[i].emplace(device, cv::Size(layout.width, layout.height) / supersampled, layout.channels).image();
            if (supersampled > 1)
                *described[i].image = Image(device, Element::f32, {layout.width, layout.height, layout.channels});
        }
    operation_.run(call, stored, {});
    std::vector<Made> all;
    for (std::size_t i = 0; i < described.size(); ++i) {
        if (!made[i])
            continue;
        const bool has_directions = described[i].content.of == Content::Of::directions;
        if (supersampled > 1)
            average_squares(*described[i].image, made[i]->image(), has_directions);
        all.emplace_back(has_directions ? directions_for(job.outputs[all.size()], made[i]->mat()) : made[i]->mat());
        if (described[i].content.of == Content::Of::light)
            all.back().format = job.images.get().picture.format;
    }
    return all;
}

} // namespace fathom::cli
