// The loop that all operations on depth images share: each input is read, looked at, computed and written.
#include "work.hpp"

#include "camera/form.hpp"
#include "camera/photograph.hpp"
#include "io/floats_on_host.hpp"
#include "text.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

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

// As a lens focuses: along the view axis, or along the ray where that axis means little.
cv::Mat distances(const StoredDepth& stored) {
    const Along along = has_plane_in_focus(stored.camera) ? Along::axis : Along::ray;
    return floats_on_host(stored.image, 1, [&](const Image& z) { linearize(stored, z, {.as = along}); });
}

// What is probably wrong with which image of the file is taken: another channel could be the depth where none was named, a TIFF has
// more pages, or the name of the channel says that it counts otherwise.
std::vector<std::string> channel_doubts(const Work& work, const std::string& named) {
    const std::string& taken = work.depth.channel;
    std::vector<std::string> said, others;
    if (taken.empty() && work.depth.pages > 1)
        said.push_back(fmt::format("has {} pages, and the first is taken; save the right one alone, for instance with "
                                   "tiffsplit",
                                   work.depth.pages));
    if (!taken.empty() && named.empty())
        others = io::depth_channels(work.frame.input);
    std::erase(others, taken);
    if (!others.empty())
        said.push_back(fmt::format("channel \"{}\" is taken, but {} could be depth, too; name the right one with "
                                   "--channel",
                                   taken, one_of(others)));
    if (const auto doubt = io::ray_channel_doubt(taken, work.seen))
        said.push_back(*doubt);
    if (const auto doubt = near_and_far_doubt(work.seen, work.depth.near_and_far))
        said.push_back(in_words(*doubt));
    return said;
}

// Reads relative depth: floats from 0 to 1, made smooth, and of the picture's size if there is one.
void read_relative(const DepthOptions& options, Work& work) {
    const Job& job = work.frame;
    const io::RelativeInput input = io::read_relative_input(
        job.input, options.channel, ignored_of(options, options.ignore.empty() ? "" : job.companions.back()));
    const cv::Mat stored = input.depth.values;
    const int bits = input.depth.bits;
    work.depth_channel = input.channel;
    work.depth_words = fmt::format("values {} to {}, {}", number(input.look.nearest), number(input.look.farthest),
                                   invalid_in_words(input.look.invalid, input.look.pixels));
    work.depth_members = {
        {"stored", {{"min", json_number(input.look.nearest)}, {"max", json_number(input.look.farthest)}}},
        {"invalid", input.look.invalid}};
    cv::Mat color;
    if (options.made_of_picture)
        color = read_picture(job.companions.front(), {.layer = options.picture.layer, .encoding = {}}).color;
    RelativeOptions read = options.relative_options;
    for (std::size_t i = 0; i < job.values.size(); ++i)
        if (options.animations[i].option == "--relative-range")
            if (const std::vector<double> ends = numbers_in(job.values[i], 2); !ends.empty())
                read.range = {ends[0], ends[1]};
    if (!read.range && bits == 32)
        read.range = job.range;
    const auto in_rows = [](int rows, const std::function<void(int, int)>& work) {
        cv::parallel_for_({0, rows}, [&](const cv::Range& part) { work(part.start, part.end); });
    };
    try {
        RelativeValues made = relative_values(
            on_host(stored), bits, read, color.empty() ? HostFloats{} : on_host(color), "--relative-range", in_rows);
        work.relative_doubts = std::move(made.doubts);
        work.depth.values = cv::Mat(made.height, made.width, CV_32FC1, made.values.data()).clone();
    } catch (const std::invalid_argument& error) {
        throw Error(about(job.input, error.what()));
    }
    work.depth.windows = {{{0, 0}, work.depth.values.size()}, work.depth.values.size()};
}

// "z 0.5 to 12, 3 % background, 96 of 9600 pixels invalid (1 %)": for the line about a result.
std::string in_words(const Look& look, const char* depth) {
    std::string text =
        look.surfaces() == 0 ? "no surface" : fmt::format("{} {:.4g} to {:.4g}", depth, look.nearest, look.farthest);
    if (look.background > 0)
        text += fmt::format(", {} background", percent(look.background, look.pixels));
    return text + ", " + invalid_in_words(look.invalid, look.pixels);
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
    if (!options.ignore.empty() && !options.ignored_by.is_limit())
        said += "; if " + options.ignore +
                " is an alpha or a confidence, add --ignore-below or --ignore-above: all that is not 0 in it does not "
                "count";
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
        if (!frame.missing.empty()) // which is no failure of one that is left out
            throw Error(
                fmt::format("{}: is not there, so that frame {} cannot be done; --missing skip leaves such frames out",
                            frame.missing.native(), *frame.frame));
        work.kept = is_finished(work);
        if (work.kept)
            return;
        if (work.depth.values.empty()) // is not loaded yet
            load(work);
        if (!apart_)
            examine(work);
    }

    // The part of `read` that needs no device: may come before it, without records.
    void load(Work& work) const {
        Job& frame = work.frame;
        if (is_relative()) {
            read_relative(task_, work);
        } else {
            frame.camera = task_.camera.read_for(frame.read_as());
            work.depth = read_depth(frame.input, read_options(work));
            if (work.depth.storage != Storage::float32) // on which the unit may depend
                frame.camera = task_.camera.read_for(frame.read_as(), work.depth.storage);
        }
        const DepthFile& depth = work.depth;
        frame.windows = depth.windows;
        frame.channel = depth.channel;
        const Job& job = frame;
        work.option_doubts = later([&] { return task_.doubts(job); });
        frame.images = later([&] { return task_.read(job); });
        work.picture_size = picture_size(work);
        if (work.picture_size && task_.supersampled > 1)
            throw Error(fmt::format("{}: has another size than its picture; --supersampled needs both in the size of "
                                    "the large frame",
                                    frame.input.native()));
        check_squares(frame.input, depth.windows, task_.supersampled);
        work.seen = is_relative() ? relative_camera(depth.values.cols, depth.values.rows, *task_.relative)
                                  : camera_of(*frame.camera, depth.windows, work.picture_size, task_.supersampled);
        settle_sky(work.seen, depth.values);
        if (work.picture_size && task_.made_of_picture)
            frame.windows = {{{0, 0}, *work.picture_size}, *work.picture_size};
        find_source(task_, work);
        check_append(work);
        check_squares(frame.input, work.windows, task_.supersampled);
        if (!is_relative())
            work.channel_doubts = channel_doubts(work, task_.channel);
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
            warn_once(work, frame.input, work.channel_doubts);
            doubtful_camera |= warn_once(work, frame.camera_name, frame.camera->warnings);
            doubtful_camera |= warn_once(work, frame.camera_name, work.examined->camera_doubts);
        }
        warn_once(work, frame.input, work.option_doubts.get());
        if (!work.doubtful_values && !doubtful_camera) // or one mistake would be told twice
            warn_once(work, frame.input, task_.length_doubts(work.examined->stored, work.examined->subject, frame));
        work.examined->z.release();
        work.examined->small.release();
        work.results = at_any_width(device_, [&] { return task_.make(work.examined->stored, frame); });
        for (Windows* windows : {&frame.windows, &work.windows, work.source ? &work.source->windows : nullptr})
            if (windows && task_.supersampled > 1)
                *windows = smaller(*windows, task_.supersampled);
        if (work.source)
            work.source->is_resized = task_.supersampled > 1;
        work.examined.reset();
        frame.images = {};
        work.depth.values.release();
    }

    void write(Work& work) const {
        if (work.kept)
            return;
        const Stopwatch watch(work.times.write);
        write_results(task_, records_ ? &*records_ : nullptr, work);
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
        std::size_t sum = of(work.depth.values);
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
        return sum + values * sizeof(float) * work.depth.values.total();
    }

private:
    bool is_relative() const { return task_.relative.has_value(); }

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
        const cv::Size depth = work.depth.windows.data.size();
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
        const char* of_one_size = has_overscan(work.depth.windows) ? "the depth has overscan"
                                  : has_plate                      ? "a clean plate is given"
                                                                   : nullptr;
        if (of_one_size)
            io::refuse(work.frame.input,
                       fmt::format("is {}, but its picture is {}; {}, so that both must be of the same size",
                                   io::described(depth), io::described(size), of_one_size));
        return size;
    }

    // Depth gets the size of its picture, along the picture's edges. The camera maps the whole image, whatever its pixels are.
    void bring_up(Work& work) const {
        const cv::Mat& color = work.frame.images.get().picture.color;
        if (work.seen.lens)
            throw Error(fmt::format(
                "{}: its camera has a lens, and depth gets the size of its picture along straight rays only; give "
                "a picture of the depth's size",
                work.frame.input.native()));
        Camera camera = work.seen;
        camera.width = color.cols;
        camera.height = color.rows;
        work.examined->small = work.depth.values; // which the subject refers to
        work.depth.values = io::distances_along_edges(work.examined->z, color, camera.projection.is_perspective());
        work.depth.storage = Storage::float32;
        work.examined->stored = ViewDepth{to_device(device_, work.depth.values), camera}.stored();
    }

    ReadOptions read_options(const Work& work) const {
        return {.channel = task_.channel,
                .packing = work.frame.camera->packing,
                .gamma = work.frame.camera->gamma,
                .overscan = std::ranges::all_of(work.frame.companions, is_exr), // others cannot hold it
                .as_counted = is_metric(work.frame.camera->camera.encoding),
                .memory = task_.memory};
    }

    // Finds what pixels hold that do not count. The camera may have to name a code for it that no pixel has.
    void find_invalid_value(Work& work) const {
        if (is_relative() || (task_.ignore.empty() && !task_.valid))
            return;
        InvalidValue& invalid = work.invalid.emplace(work.seen, work.depth.storage);
        if (!invalid.is_open())
            return;
        invalid.see(on_host(work.depth.values, work.depth.storage));
        if (const DepthFile& other = work.frame.images.get().other_depth; other.storage == work.depth.storage)
            invalid.see(on_host(other.values, other.storage));
        invalid.settle(work.seen);
    }

    void ignore(Work& work) const {
        if (task_.ignore.empty() || is_relative()) // whose values have lost them already
            return;
        const cv::Mat ignored = io::ignored(work.frame.companions.back(), task_.ignored_by, work.depth.windows);
        work.invalid->write(work.depth.values.data, on_host(work.depth.values, work.depth.storage),
                            [&](int x, int y) { return ignored.at<uchar>(y, x) != 0; });
    }

    // Bounds are as exact as depths, so that a depth that is written like one lies within.
    void keep_valid(Work& work) const {
        const auto least = static_cast<float>(task_.valid->front()), most = static_cast<float>(task_.valid->back());
        constexpr float background = std::numeric_limits<float>::infinity();
        work.invalid->write(work.depth.values.data, on_host(work.depth.values, work.depth.storage), [&](int x, int y) {
            float& depth = work.examined->z.at<float>(y, x);
            const bool is_out = depth < background && !(depth >= least && depth <= most);
            if (is_out)
                depth = std::numeric_limits<float>::quiet_NaN();
            return is_out;
        });
    }

    // Looks at what was read, while other inputs are computed: the device need not wait for the host's part of it.
    void examine(Work& work) const {
        DepthFile& depth = work.depth;
        work.examined.emplace();
        find_invalid_value(work);
        ignore(work);
        work.examined->stored = {
            .image = to_device(device_, depth.values), .camera = work.seen, .storage = depth.storage};
        work.examined->z = at_any_width(device_, [&] { return distances(work.examined->stored); });
        if (task_.valid) {
            keep_valid(work);
            work.examined->stored.image = to_device(device_, depth.values);
        }
        const HostDepth values = on_host(depth.values, depth.storage);
        const HostFloats z = on_host(work.examined->z);
        work.examined->look.add(z);
        work.examined->subject = Subject(work.seen, values, z, work.is_sampled ? Closely::some : Closely::whole);
        find_doubts(work);
        if (work.picture_size && task_.made_of_picture)
            bring_up(work);
        if (task_.edges == Edges::sharpen && !is_relative())
            sharpen(work);
    }

    void sharpen(Work& work) const {
        StoredDepth& stored = work.examined->stored;
        const Image color = task_.made_of_picture ? to_device(device_, work.frame.images.get().picture.color) : Image();
        cv::Mat changed(stored.image.height(), stored.image.width(), CV_8UC1);
        const Image mask(device_, Element::u8, {changed.cols, changed.rows});
        stored = sharpen_edges(stored, color, mask);
        mask.download(changed.data);
        const auto count = static_cast<std::size_t>(cv::countNonZero(changed));
        work.depth_words += fmt::format(", {} sharpened", percent(count, changed.total()));
        work.depth_members["sharpened"] = count;
    }

    void find_doubts(Work& work) const {
        if (is_relative()) {
            work.examined->value_doubts = work.relative_doubts;
            return;
        }
        const Look& look = work.examined->look;
        const auto end = [&](float z) { return look.surfaces() > 0 ? json_number(z) : nlohmann::ordered_json(); };
        work.depth_channel = work.depth.channel;
        work.depth_words = in_words(look, has_plane_in_focus(work.seen) ? "z" : "distance");
        work.depth_members = {{"nearest", end(look.nearest)},
                              {"farthest", end(look.farthest)},
                              {"background", look.background},
                              {"invalid", look.invalid}};
        if (look.invalid == look.pixels && work.is_sampled) // a sample cannot say why
            work.examined->subject =
                Subject(work.seen, work.examined->subject.whole, on_host(work.examined->z), Closely::whole);
        for (const Finding& finding : doubts(work.examined->subject))
            if (finding.fault != Fault::filtered || task_.edges != Edges::sharpen)
                work.examined->value_doubts.push_back(in_words(finding));
        if (const auto refused = refusal(work.examined->subject);
            refused && (look.invalid == look.pixels || refused->fault != Fault::nothing_measured))
            throw Error(work.invalid && look.invalid == look.pixels ? nothing_left(task_) : in_words(*refused));
        const cv::Size display =
            size_for(*work.frame.camera, work.depth.windows, work.picture_size, task_.supersampled);
        work.examined->camera_doubts = key_doubts(work.frame.camera->text, display.width, display.height);
    }

    void check_append(const Work& work) const {
        if (!task_.append || work.source)
            return;
        const Job& job = work.frame;
        if (is_relative() && !task_.made_of_picture)
            throw Error(
                fmt::format("{}: --append does not go with --relative; leave --append out", job.input.native()));
        throw Error(fmt::format("{}: is no OpenEXR file, and --append adds to one; leave --append out",
                                (task_.made_of_picture ? job.companions.front() : job.input).native()));
    }

    // A camera's mistake is told once for all inputs, and the same of all frames of a pipe once. Gives whether there is one.
    bool warn_once(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) {
        for (const std::string& doubt : said)
            if (const bool is_own = subject == work.frame.input, is_piped = !work.frame.frames.empty();
                task_.strict || (is_own && !is_piped) || told_.insert((is_own ? "" : subject.native()) + doubt).second)
                warn(task_, work, subject, {doubt});
        return !said.empty();
    }

    Task& task_;
    Device device_;
    bool apart_ = false;
    std::optional<Records> records_;
    std::set<std::string> told_; // warnings that are no input's own
};

// Reads the first input while the driver is loaded, which takes as long, if as many threads may work as there are.
std::future<void> read_ahead(const DepthOptions& options, const Steps& steps, const Job& job, Work& first) {
    if (options.resume || options.device.threads > 0 || !job.missing.empty())
        return {};
    first.frame = job;
    // Where the system has no more threads, it is read when it is asked for.
    return std::async(std::launch::async | std::launch::deferred, [&steps, &first] {
        const Stopwatch watch(first.times.read);
        steps.load(first);
    });
}

// Tells once what is wrong with the cameras of all inputs.
void check_cameras(const DepthOptions& options, const std::vector<Job>& jobs) {
    try {
        if (!options.relative)
            options.camera.read();
    } catch (const Error& error) {
        std::ranges::for_each(jobs, [&](const Job& job) { announce_failure(options.report, job, error.what()); });
        throw;
    }
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
    const Report report = report_of(task);
    Pipes pipes(task);
    std::vector<Job> jobs = plan(task); // of piped depth the first
    check_cameras(task, jobs);
    catch_interrupts();
    task.device.prepare(task.memory);
    const std::vector<std::string> ranges = pipes.of_depth() ? std::vector<std::string>() : find_ranges(task, jobs);
    const auto wanted =
        static_cast<std::size_t>(std::ranges::find(jobs, false, &Job::left_out) - jobs.begin()); // the first one
    Steps steps(task);
    Work first;
    std::future<void> reading = pipes.any() ? std::future<void>() : read_ahead(task, steps, jobs[wanted], first);
    const Device device = task.device.open(task.memory);
    const bool apart = task.device.takes_turns(device);
    const std::size_t most = pipes.of_depth() ? std::numeric_limits<std::size_t>::max() : jobs.size();
    if (apart)
        task.device.share_among(most);
    pipes.open();
    steps.use(device, apart);
    Telling telling(task, report, jobs, device, ranges);
    const std::size_t begun = for_each_frame<Work>(
        most,
        {.read =
             [&](std::size_t n, Work& work) {
                 if (n == wanted && reading.valid()) {
                     reading.wait();
                     work = std::move(first);
                     reading.get(); // what it threw
                 } else {
                     Job& job = work.frame;
                     job = pipes.of_depth()
                               ? plan_frame(task, {jobs.front().input.native(), static_cast<Frame>(n) + 1, 0})
                               : jobs[n];
                     if (pipes.any())
                         pipes.give(n, job);
                 }
                 work.is_sampled = n != wanted && !task.strict && work.frame.in_sequence;
                 steps.read(work);
             },
         .compute = [&](std::size_t, Work& work) { steps.compute(work); },
         .write = [&](std::size_t, Work& work) { steps.write(work); },
         .report =
             [&](std::size_t n, Work& work, const std::exception_ptr& failure) {
                 telling.tell(work, failure);
                 if (task.output == standard_stream)
                     print_result(pipes, n, work, failure);
             },
         .bytes = [&](const Work& work) { return steps.bytes(work); }},
        {.threads = task.device.threads, .apart = apart, .memory = task.memory, .stop = [&] {
             return is_interrupted() || (pipes.any() && !pipes.next());
         }});
    std::size_t told = begun;
    if (!pipes.of_depth() &&
        std::ranges::all_of(jobs.begin() + static_cast<std::ptrdiff_t>(begun), jobs.end(), &Job::left_out))
        for (; told < jobs.size(); ++told) { // nothing of them was to be made
            Work left_out;
            left_out.frame = jobs[told];
            telling.tell(left_out, nullptr);
        }
    const bool complete = telling.sum_up();
    if (told < most)
        stop_if_interrupted();
    pipes.check_end(most);
    return complete ? done : input_failed;
}

} // namespace fathom::shot
