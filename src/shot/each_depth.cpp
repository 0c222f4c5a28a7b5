// The loop that all operations on depth images share: each input is read, looked at, computed and written.
#include "each_depth.hpp"

#include "pipes.hpp"
#include "telling.hpp"

#include "camera/form.hpp"
#include "io/floats_on_host.hpp"
#include "io/formats.hpp"
#include "terminal/exit.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <limits>
#include <set>
#include <utility>

namespace fathom::shot {
namespace {

using io::floats_on_host, io::on_host;

// Adds the seconds of its own life.
class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// What `make` gives or throws, for whoever asks later.
template <typename Make>
auto later(Make make) {
    std::packaged_task<decltype(make())()> task(std::move(make));
    task();
    return task.get_future().share();
}

// The image that a camera file is of: the depth, or its picture, which sees the same in other pixels.
cv::Size size_for(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture) {
    const bool of_picture = picture && cv::Size(file.camera.width, file.camera.height) == *picture;
    return of_picture ? *picture : windows.display;
}

// The camera of the pixels that were read.
Camera camera_of(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture) {
    const cv::Size size = size_for(file, windows, picture);
    Camera camera = camera_for(file, size.width, size.height);
    camera.width = windows.display.width;
    camera.height = windows.display.height;
    const cv::Rect& part = windows.data;
    return has_overscan(windows) ? cropped(camera, part.x, part.y, part.width, part.height) : camera;
}

// As a lens focuses: along the view axis, or along the ray where that axis means little.
cv::Mat distances(const StoredDepth& stored) {
    const Along along = has_plane_in_focus(stored.camera) ? Along::axis : Along::ray;
    return floats_on_host(stored.image, 1, [&](const Image& z) { linearize(stored, z, {.as = along}); });
}

// Overscan is computed, too, unless a file beside the depth cannot hold it.
bool takes_overscan(const Job& job) {
    return std::ranges::all_of(job.companions, is_exr);
}

// Another channel that could be the depth, where none was named.
std::vector<std::string> channel_doubts(const std::filesystem::path& file, const std::string& named,
                                        const std::string& taken) {
    if (!named.empty() || taken.empty())
        return {};
    std::vector<std::string> others = io::depth_channels(file);
    std::erase(others, taken);
    if (others.empty())
        return {};
    return {fmt::format("channel \"{}\" is taken, but {} could be depth, too; name the right one with --channel", taken,
                        one_of(others))};
}

// Images of a TIFF beside the first.
std::vector<std::string> page_doubts(int pages) {
    if (pages == 1)
        return {};
    return {fmt::format("has {} pages, and the first is taken; save the right one alone, for instance with tiffsplit",
                        pages)};
}

Held held(const std::string& channel, const Look& look, const Camera& camera) {
    const auto end = [&](float z) { return look.surfaces() > 0 ? json_number(z) : nlohmann::ordered_json(); };
    return {channel,
            in_words(look, has_plane_in_focus(camera) ? "z" : "distance"),
            {{"nearest", end(look.nearest)},
             {"farthest", end(look.farthest)},
             {"background", look.background},
             {"invalid", look.invalid}}};
}

Held held(const io::RelativeInput& input) {
    return {input.channel,
            in_words(input),
            {{"stored", {{"min", json_number(input.look.nearest)}, {"max", json_number(input.look.farthest)}}},
             {"invalid", input.look.invalid}}};
}

// In full floats 65504 is the sky only where nothing lies beyond it.
void settle_sky(Camera& camera, const cv::Mat& values) {
    if (!camera.background_from_largest_half || values.type() != CV_32FC1)
        return;
    const bool has_farther = std::any_of(values.begin<float>(), values.end<float>(),
                                         [](float value) { return value > 65504 && value < 1e10f; });
    if (has_farther) {
        camera.background_from_largest_half = false;
        camera.background_from = 1e10;
    }
}

std::string nothing_left(const DepthOptions& options) {
    std::string said =
        "no pixel is left that counts and has a depth; choose other --ignore and --valid (fathom inspect "
        "shows the depths that there are)";
    if (!options.ignore.empty() && !options.ignore_below)
        said += "; if " + options.ignore +
                " is an alpha or a confidence, add --ignore-below: all that is not 0 in it does not count";
    return said;
}

// The steps of an input. Only `compute` goes from input to input in order; the others see nothing but their own.
class Steps {
public:
    explicit Steps(Task& task) : task_(task) {}

    // What all other steps need. `apart`: the device waits while files are read.
    void use(const Device& device, bool apart) {
        device_ = device;
        apart_ = apart;
        if (task_.resume)
            records_.emplace(task_, device);
    }

    void read(Work& work) const {
        const Stopwatch watch(work.times.read);
        Job& frame = work.frame;
        if (!frame.missing.empty())
            throw Error(
                fmt::format("{}: is not there, so that frame {} cannot be done; --missing skip leaves such frames out",
                            frame.missing.native(), *frame.frame));
        work.kept = is_finished(work);
        if (work.kept)
            return;
        if (!work.loaded)
            load(work);
        if (!apart_)
            examine(work);
    }

    // The part of `read` that needs no device: may come before it, without records.
    void load(Work& work) const {
        work.loaded = true;
        Job& frame = work.frame;
        if (is_relative()) {
            work.read.relative = relative_depth(task_, frame);
            work.read.depth = std::exchange(work.read.relative->depth, {{}, Storage::float32, {}});
        } else {
            frame.camera = task_.camera.read_for(frame.read_as());
            work.read.depth = read_depth(frame.input, read_options(work));
            if (work.read.depth.storage != Storage::float32) // on which the unit may depend
                frame.camera = task_.camera.read_for(frame.read_as(), work.read.depth.storage);
        }
        const DepthFile& depth = work.read.depth;
        frame.windows = depth.windows;
        frame.channel = depth.channel;
        const Job& job = frame;
        work.read.option_doubts = later([&] { return task_.doubts(job); });
        frame.images = later([&] { return task_.read(job); });
        work.read.picture_size = picture_size(work);
        work.read.seen = is_relative() ? relative_camera(depth.values.cols, depth.values.rows, *task_.relative.order)
                                       : camera_of(*frame.camera, depth.windows, work.read.picture_size);
        settle_sky(work.read.seen, depth.values);
        if (work.read.picture_size && task_.made_of)
            frame.windows = {{{0, 0}, *work.read.picture_size}, *work.read.picture_size};
        work.source = source_of(task_, frame, depth);
        work.windows = result_windows(task_, frame);
        check_append(work);
        if (is_relative())
            return;
        work.read.channel_doubts = depth.channel.empty() ? page_doubts(depth.pages)
                                                         : channel_doubts(frame.input, task_.channel, depth.channel);
        if (const auto doubt = io::ray_channel_doubt(depth.channel, work.read.seen))
            work.read.channel_doubts.push_back(*doubt);
    }

    void compute(Work& work) {
        if (work.kept)
            return;
        Job& frame = work.frame;
        for (std::size_t i = 0; i < frame.values.size(); ++i)
            task_.animations[i].give(frame.values[i]);
        if (apart_) {
            const Stopwatch watch(work.times.read);
            examine(work);
        }
        const Stopwatch watch(work.times.compute);
        work.doubtful_values = warn_once(work, frame.input, work.examined->value_doubts);
        bool doubtful_camera = false;
        if (!is_relative()) {
            warn_once(work, frame.input, work.read.channel_doubts);
            doubtful_camera |= warn_once(work, frame.camera_name, frame.camera->warnings);
            doubtful_camera |= warn_once(work, frame.camera_name, work.examined->camera_doubts);
        }
        warn_once(work, frame.input, work.read.option_doubts.get());
        if (!work.doubtful_values && !doubtful_camera) // or one mistake would be told twice
            warn_once(work, frame.input, task_.length_doubts(work.examined->stored, work.examined->subject, frame));
        work.examined->z.release();
        work.examined->small.release();
        work.results = at_any_width(device_, [&] { return task_.make(work.examined->stored, frame); });
        work.examined.reset();
        frame.images = {};
        work.read.depth.values.release();
    }

    void write(Work& work) const {
        if (work.kept)
            return;
        const Stopwatch watch(work.times.write);
        const Job& frame = work.frame;
        const bool is_cut = work.windows != frame.windows;
        for (std::size_t i = 0; i < task_.outputs.size() && (is_cut || has_overscan(work.windows)); ++i) {
            Made& result = work.results[i];
            if (is_cut) {
                result.part = work.windows.data - frame.windows.data.tl();
                result.image = result.image(*result.part).clone();
            }
            fit(result.image, work.windows, frame.outputs[i], task_.outputs[i].product.kind);
            result.size = result.image.size();
        }
        if (!work.doubtful_values)
            warn(work, frame.input, png_doubts(task_, frame, work.results));
        for (std::size_t i = 0; i < task_.outputs.size(); ++i)
            warn(work, frame.outputs[i], metadata_doubts(frame.outputs[i], work.results[i]));
        prepare_folders(task_, frame);
        std::vector<ImageFile> files = files_of(task_, frame, work.results, work.source);
        if (task_.output == standard_stream) {
            work.raw = io::raw_bytes(files.front(), result_format(task_));
            files.erase(files.begin());
        }
        io::write_images_and(files, records_ ? records_->file_of(work.record, frame) : io::LastFile{});
    }

    // The bytes of the images that an input holds until it is written: of what was read, of its results and of their files.
    std::size_t bytes(const Work& work) const {
        if (work.kept) { // was not read, but says for all how much one takes
            Work other;
            other.frame = work.frame;
            try {
                load(other);
            } catch (...) { // nobody knows, so that frames are done one by one
                return std::numeric_limits<std::size_t>::max();
            }
            return bytes(other);
        }
        const auto of = [](const cv::Mat& image) { return image.total() * image.elemSize(); };
        std::size_t sum = of(work.read.depth.values);
        try {
            const Images& images = work.frame.images.get();
            sum += of(images.picture.color) + of(images.clean_plate.color) + of(images.other_depth.values) +
                   of(images.normals) + of(images.thickness);
        } catch (...) { // is told when the frame is computed
        }
        std::size_t values = 1;                      // a pixel: what it looks at
        for (const Output& output : task_.outputs) { // the result and its file
            const std::vector<std::string>& channels = output.product.channels;
            values += channels.size() + known_names(channels, task_.append).size();
        }
        return sum + values * sizeof(float) * work.read.depth.values.total();
    }

private:
    bool is_relative() const { return task_.relative.order.has_value(); }

    // Asks for the times of what the input is read from before it is read: a file that changes meanwhile has another one next time.
    bool is_finished(Work& work) const {
        if (!records_)
            return false;
        if (!is_relative())
            work.frame.camera = task_.camera.read_for(work.frame.read_as());
        work.record = records_->of(work.frame);
        return records_->is_finished(work.record, work.frame);
    }

    // The size of the picture, if it is another than the depth's.
    std::optional<cv::Size> picture_size(const Work& work) const {
        const cv::Size depth = work.read.depth.windows.data.size();
        cv::Size size = depth;
        bool has_plate = false;
        try {
            const Images& images = work.frame.images.get();
            if (!images.picture.color.empty())
                size = images.picture.color.size();
            has_plate = !images.clean_plate.color.empty();
        } catch (...) { // is told when the frame is computed
        }
        if (size == depth || is_relative())
            return std::nullopt;
        const char* of_one_size = has_overscan(work.read.depth.windows) ? "the depth has overscan"
                                  : has_plate                           ? "a clean plate is given"
                                                                        : nullptr;
        if (of_one_size)
            throw Error(fmt::format(
                "{}: is {} × {}, but its picture is {} × {}; {}, so that both must be of the same size",
                work.frame.input.native(), depth.width, depth.height, size.width, size.height, of_one_size));
        return size;
    }

    // Depth gets the size of its picture, along the picture's edges. The camera maps the whole image, whatever its pixels are.
    void bring_up(Work& work) const {
        const cv::Mat& color = work.frame.images.get().picture.color;
        if (work.read.seen.lens)
            throw Error(fmt::format(
                "{}: its camera has a lens, and depth gets the size of its picture along straight rays only; give "
                "a picture of the depth's size",
                work.frame.input.native()));
        Camera camera = work.read.seen;
        camera.width = color.cols;
        camera.height = color.rows;
        work.examined->small = work.read.depth.values; // which the subject refers to
        work.read.depth.values = io::distances_along_edges(work.examined->z, color, camera.projection.is_perspective());
        work.read.depth.storage = Storage::float32;
        work.examined->stored = ViewDepth{to_device(device_, work.read.depth.values), camera}.stored();
    }

    ReadOptions read_options(const Work& work) const {
        return {.channel = task_.channel,
                .packing = work.frame.camera->packing,
                .overscan = takes_overscan(work.frame),
                .as_counted = is_metric(work.frame.camera->camera.encoding),
                .memory = task_.memory};
    }

    // Finds what pixels hold that do not count. The camera may have to name a code for it that no pixel has.
    void find_invalid_value(Work& work) const {
        if (is_relative() || (task_.ignore.empty() && !task_.valid))
            return;
        InvalidValue& invalid = work.read.invalid.emplace(work.read.seen, work.read.depth.storage);
        if (!invalid.is_open())
            return;
        invalid.see(on_host(work.read.depth.values, work.read.depth.storage));
        if (const DepthFile& other = work.frame.images.get().other_depth; other.storage == work.read.depth.storage)
            invalid.see(on_host(other.values, other.storage));
        invalid.settle(work.read.seen);
    }

    void ignore(Work& work) const {
        if (task_.ignore.empty() || is_relative()) // whose values have lost them already
            return;
        const cv::Mat ignored = io::ignored(work.frame.companions.back(), task_.ignore_below, work.read.depth.windows);
        work.read.invalid->write(work.read.depth.values.data, on_host(work.read.depth.values, work.read.depth.storage),
                                 [&](int x, int y) { return ignored.at<uchar>(y, x) != 0; });
    }

    // Bounds are as exact as depths, so that a depth that is written like one lies within.
    void keep_valid(Work& work) const {
        const auto least = static_cast<float>(task_.valid->front()), most = static_cast<float>(task_.valid->back());
        constexpr float background = std::numeric_limits<float>::infinity();
        work.read.invalid->write(work.read.depth.values.data, on_host(work.read.depth.values, work.read.depth.storage),
                                 [&](int x, int y) {
                                     float& depth = work.examined->z.at<float>(y, x);
                                     const bool is_out = depth < background && !(depth >= least && depth <= most);
                                     if (is_out)
                                         depth = std::numeric_limits<float>::quiet_NaN();
                                     return is_out;
                                 });
    }

    // Looks at what was read, while other inputs are computed: the device need not wait for the host's part of it.
    void examine(Work& work) const {
        DepthFile& depth = work.read.depth;
        work.examined.emplace();
        find_invalid_value(work);
        ignore(work);
        work.examined->stored = {
            .image = to_device(device_, depth.values), .camera = work.read.seen, .storage = depth.storage};
        work.examined->z = at_any_width(device_, [&] { return distances(work.examined->stored); });
        if (task_.valid) {
            keep_valid(work);
            work.examined->stored.image = to_device(device_, depth.values);
        }
        const HostDepth values = on_host(depth.values, depth.storage);
        work.examined->subject = Subject(work.read.seen, depth.storage);
        work.examined->subject.add(values, on_host(work.examined->z));
        work.examined->subject.each = [values, &work](const auto& visit) { visit(values, on_host(work.examined->z)); };
        find_doubts(work);
        if (work.read.picture_size && task_.made_of)
            bring_up(work);
    }

    void find_doubts(Work& work) const {
        if (is_relative()) {
            work.held = held(work.read.relative->input);
            work.examined->value_doubts = work.read.relative->doubts;
            return;
        }
        work.held = held(work.read.depth.channel, work.examined->subject.look, work.read.seen);
        work.examined->value_doubts = doubts(work.examined->subject);
        if (const auto refused = refusal(work.examined->subject))
            throw Error(work.read.invalid && work.examined->subject.look.invalid == work.examined->subject.look.pixels
                            ? nothing_left(task_)
                            : *refused);
        const cv::Size display = size_for(*work.frame.camera, work.read.depth.windows, work.read.picture_size);
        work.examined->camera_doubts = key_doubts(work.frame.camera->text, display.width, display.height);
    }

    void check_append(const Work& work) const {
        if (!task_.append || work.source)
            return;
        const Job& job = work.frame;
        if (is_relative() && !task_.made_of)
            throw Error(
                fmt::format("{}: --append does not go with --relative; leave --append out", job.input.native()));
        throw Error(fmt::format("{}: is no OpenEXR file, and --append adds to one; leave --append out",
                                (task_.made_of ? job.companions[*task_.made_of] : job.input).native()));
    }

    void warn(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) const {
        for (const std::string& doubt : said) {
            const std::string line = fmt::format("{}: {}", subject.native(), doubt);
            if (task_.strict)
                throw Error(line);
            work.frame.said.push_back("warning: " + line);
        }
    }

    // A camera's mistake is told once for all inputs, and the same of all frames of a pipe once. Gives whether there is one.
    bool warn_once(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) {
        for (const std::string& doubt : said)
            if (const bool is_own = subject == work.frame.input, is_piped = !work.frame.frames.empty();
                task_.strict || (is_own && !is_piped) || told_.insert((is_own ? "" : subject.native()) + doubt).second)
                warn(work, subject, {doubt});
        return !said.empty();
    }

    Task& task_;
    Device device_;
    bool apart_ = false;
    std::optional<Records> records_;
    std::set<std::string> told_; // warnings that are no input's own
};

// Reads the first input while the driver is loaded, which takes as long, if as many threads may work as there are.
std::future<void> read_ahead(const DepthOptions& options, const Steps& steps, const std::vector<Job>& jobs,
                             const std::vector<std::size_t>& wanted, Work& first) {
    if (options.resume || options.device.threads > 0 || wanted.empty() || !jobs[wanted.front()].missing.empty())
        return {};
    first.frame = jobs[wanted.front()];
    // Where the system has no more threads, it is read when it is asked for.
    return std::async(std::launch::async | std::launch::deferred, [&steps, &first] {
        const Stopwatch watch(first.times.read);
        steps.load(first);
    });
}

// Tells once what is wrong with the cameras of all inputs.
void check_cameras(const DepthOptions& options, const std::vector<Job>& jobs) {
    std::vector<Input> read_as(jobs.size());
    std::ranges::transform(jobs, read_as.begin(), &Job::read_as);
    try {
        if (!options.relative.order)
            options.camera.read(std::move(read_as));
    } catch (const Error& error) {
        std::ranges::for_each(jobs, [&](const Job& job) { announce_failure(options.report, job, error.what()); });
        throw;
    }
}

// Those that are not left out.
std::vector<std::size_t> wanted_among(const std::vector<Job>& jobs) {
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < jobs.size(); ++i)
        if (!jobs[i].left_out)
            wanted.push_back(i);
    return wanted;
}

// Gives the result of -o - to whoever reads it.
void print_result(Pipes& pipes, std::size_t n, const Work& work, const std::exception_ptr& failure) {
    if (failure) {
        pipes.stop();
        throw Error(fmt::format("standard output: ends before frame {}, which failed", n + 1));
    }
    print_bytes(work.raw);
}

} // namespace

int each_depth(Task& task) {
    if (!task.ignore.empty())
        task.companions.push_back({"--ignore", task.ignore}); // behind those that the command knows
    static_cast<void>(report_of(task));                       // refuses what contradicts itself
    Pipes pipes(task);
    std::vector<Job> jobs = plan(task); // of piped depth the first
    check_cameras(task, jobs);
    catch_interrupts();
    task.device.prepare(task.memory);
    const std::vector<std::string> ranges = pipes.of_depth() ? std::vector<std::string>() : find_ranges(task, jobs);
    const std::vector<std::size_t> wanted = wanted_among(jobs);
    Steps steps(task);
    Work first;
    std::future<void> reading = pipes.any() ? std::future<void>() : read_ahead(task, steps, jobs, wanted, first);
    const Device device = task.device.open(task.memory);
    const bool apart = task.device.takes_turns(device);
    const std::size_t most = pipes.of_depth() ? std::numeric_limits<std::size_t>::max() : wanted.size();
    if (apart)
        task.device.share_among(pipes.of_depth() ? most : jobs.size());
    pipes.open();
    steps.use(device, apart);
    Telling telling(task, jobs, device);
    telling.begin(ranges);
    const std::size_t begun = for_each_frame<Work>(
        most,
        {.read =
             [&](std::size_t n, Work& work) {
                 if (n == 0 && reading.valid()) {
                     reading.wait();
                     work = std::move(first);
                     reading.get(); // what it threw
                 } else {
                     Job& job = work.frame;
                     job = pipes.of_depth() ? plan_frame(task, static_cast<Frame>(n) + 1) : jobs[wanted[n]];
                     if (pipes.any())
                         pipes.give(n, job);
                 }
                 steps.read(work);
             },
         .compute = [&](std::size_t, Work& work) { steps.compute(work); },
         .write = [&](std::size_t, Work& work) { steps.write(work); },
         .report =
             [&](std::size_t n, Work& work, const std::exception_ptr& failure) {
                 telling.tell(pipes.of_depth() ? n : wanted[n], work, failure);
                 if (task.output == standard_stream)
                     print_result(pipes, n, work, failure);
             },
         .bytes = [&](const Work& work) { return steps.bytes(work); }},
        {.threads = task.device.threads, .apart = apart, .memory = task.memory, .stop = [&] {
             return is_interrupted() || (pipes.any() && !pipes.next());
         }});
    telling.sum_up();
    if (begun < most)
        stop_if_interrupted();
    pipes.check_end(most);
    return telling.finish() ? done : input_failed;
}

} // namespace fathom::shot
