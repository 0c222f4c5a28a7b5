// Which depth images the arguments stand for, and where results go. Everything that can be refused before the first file is read
// is refused here.
#include "work.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <set>
#include <sstream>

namespace fathom::shot {

using sequence::FramePattern;

const std::vector<Input>& Inputs::all() const {
    if (all_.empty())
        for (const std::string& argument : arguments)
            if (arguments.size() == 1 || !argument.ends_with(record_ending)) // of a shell's *
                add(argument);
    if (all_.empty() && !arguments.empty())
        throw Error(arguments.front() + ": is a record of --resume, and no image; name the results");
    return all_;
}

std::vector<Inputs::Shot> Inputs::shots() const {
    using Alike = std::pair<std::optional<std::size_t>, std::string>; // the source, and the names
    std::map<Alike, std::vector<std::size_t>> found;
    for (std::size_t i = 0; i < all().size(); ++i) {
        const auto& [file, frame, source] = all()[i];
        const bool is_of_one = source && !there_[*source].empty();
        const auto pattern = is_of_one ? std::nullopt : FramePattern::of(file);
        found[{source, is_of_one ? "" : pattern ? pattern->first.beside_number() : file}].push_back(i);
    }
    std::vector<Shot> shots;
    for (const auto& [alike, inputs] : found) {
        const std::optional<std::size_t> source = alike.first;
        Shot shot{source ? there_[*source] : std::map<Frame, std::string>{}, inputs};
        if (shot.files.empty() && inputs.size() > 1) {
            std::vector<std::string> names;
            for (const std::size_t i : inputs)
                names.push_back(all_[i].file);
            if (const auto common = FramePattern::common(names))
                shot.files = source ? common->second : common->first.files();
        }
        if (shot.files.size() > 1)
            shots.push_back(std::move(shot));
    }
    return shots;
}

void Inputs::add(const std::string& argument) const {
    if (io::is_folder(argument)) {
        add_files(argument, sequence::depth_files_in(argument));
    } else if (const auto pattern = FramePattern::in(argument); pattern && !io::is_there(argument)) {
        const std::map<Frame, std::string> files = pattern->files();
        if (files.empty())
            throw Error(argument + ": no frame of this name is there; check the folder, and how many figures the "
                                   "numbers have (%04d and #### mean four)");
        add_sequence(*pattern, files);
    } else if (sequence::has_glob(argument) && !io::is_there(argument)) {
        add_files(argument, sequence::matching_files(argument));
    } else if (is_pipe(argument)) {
        if (frames || arguments.size() > 1)
            throw UsageError(frames ? "--frames: a pipe has the frames that come, from 1 on; leave it out"
                                    : argument + ": is a pipe, beside which there can be no other depth");
        all_.push_back({argument, 1});
    } else {
        if (frames)
            throw UsageError(fmt::format("--frames: chooses from a sequence, and {} is a file; give the name of all "
                                         "frames, as in shot.####.exr, between quotation marks",
                                         argument));
        all_.push_back({argument, frame_of(argument)});
    }
}

void Inputs::add_files(const std::string& argument, std::vector<std::string> files) const {
    const bool had_some = !files.empty();
    std::erase_if(files, [](const std::string& file) { // which Fathom has laid beside a result
        return file.ends_with(show_ending) || file.ends_with(record_ending);
    });
    const auto has = [&](const char* name) { return std::filesystem::exists(std::filesystem::path(argument) / name); };
    if (files.empty() && (has(".zarray") || has(".zgroup") || has("zarr.json")))
        throw Error(
            argument +
            ": holds arrays, and zarr is no image; save the array that holds depth as .npy (zarr.open and numpy.save)");
    if (files.empty())
        throw Error(argument + (had_some ? ": holds only what Fathom has laid beside results; name the results"
                                         : ": stands for no image; check the name"));
    const auto common = FramePattern::common(files);
    if (frames && !common)
        throw UsageError(fmt::format("--frames: {} holds more than one sequence; give the name of one, as in "
                                     "shot.####.exr",
                                     argument));
    if (common)
        return add_sequence(common->first, common->second);
    for (const std::string& file : files)
        all_.push_back({file, frame_of(file), there_.size()});
    there_.emplace_back();
}

void Inputs::add_sequence(const FramePattern& pattern, const std::map<Frame, std::string>& files) const {
    if (frames)
        for (const Frame frame : *frames)
            all_.push_back({pattern.name(frame), frame, there_.size()});
    else
        for (const auto& [frame, file] : files)
            all_.push_back({file, frame, there_.size()});
    there_.push_back(files);
}

std::optional<Frame> frame_of(const std::string& file) {
    const auto pattern = FramePattern::of(file);
    return pattern ? std::optional(pattern->second) : std::nullopt;
}

std::optional<FramePattern> pattern_in(const std::string& name) {
    return io::is_there(name) ? std::nullopt : FramePattern::in(name);
}

std::string named(const FramePattern& pattern, const std::string& option, const Input& input) {
    if (!input.frame)
        throw UsageError(fmt::format("{}: its name holds no frame, which {} {} needs; give it a number, as in "
                                     "shot.0001.exr",
                                     input.file, option, pattern.text()));
    return pattern.name(*input.frame);
}

namespace {

namespace fs = std::filesystem;

bool is_known(const std::string& extension, const std::vector<std::string>& extensions) {
    return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

// The pattern of an output: a single input that was named itself goes into a file of just this name.
std::optional<FramePattern> pattern_of(const DepthOptions& options, const Output& output) {
    const bool is_file =
        !output.target.ends_with('/') && is_known(extension_of(output.target), output.product.extensions);
    return is_file && options.inputs.is_sequence() ? pattern_in(output.target) : std::nullopt;
}

bool is_folder(const DepthOptions& options, const Output& output) {
    return output.target != standard_stream && (output.target.ends_with('/') || io::is_folder(output.target) ||
                                                (options.inputs.all().size() > 1 && !pattern_of(options, output)));
}

void check_target(const DepthOptions& options, const Output& output) {
    const std::vector<std::string>& extensions = output.product.extensions;
    const fs::path out = output.target;
    const auto check_type = [&] {
        const std::string extension = extension_of(out);
        if (!is_known(extension, extensions))
            throw UsageError(fmt::format("{}: {} is no type of result; it is {} (a folder ends with /)", out.native(),
                                         extension.empty() ? "a name without extension" : extension,
                                         one_of(extensions)));
    };
    if (output.beside)
        return;
    if (out.empty())
        throw UsageError(output.option + ": the name is empty; give a file or a folder");
    if (output.target == standard_stream)
        return;
    if (is_folder(options, output)) {
        if (io::is_there(out) && !io::is_folder(out))
            throw UsageError(out.native() + ": is a file; several inputs need a folder");
        const bool is_new = !io::is_there(out) && !output.target.ends_with('/');
        if (is_new && pattern_in(output.target))
            check_type();
        if (is_new && is_known(extension_of(out), extensions))
            throw UsageError(fmt::format("{}: {} inputs cannot go into one file; give a folder ({}/)", out.native(),
                                         options.inputs.all().size(), out.native()));
    } else {
        check_type();
        if (options.inputs.is_piped() && !pattern_of(options, output))
            throw UsageError(fmt::format("{}: a pipe has several frames, each of which needs a file; give a name with "
                                         "####, or a folder",
                                         out.native()));
        if (!options.format.empty() && options.format != extension_of(out))
            throw UsageError(out.native() + ": its extension contradicts --format " + options.format.substr(1) +
                             "; leave one of them out");
    }
}

fs::path place(const DepthOptions& options, const Output& output, const Input& input) {
    fs::path file = output.target;
    if (output.beside)
        file = fs::path(input.file).replace_extension(output.product.extensions.front());
    else if (is_folder(options, output))
        file /=
            (options.inputs.is_piped() ? fmt::format("{:04}", *input.frame) : fs::path(input.file).stem().native()) +
            (options.format.empty() ? output.product.extensions.front() : options.format);
    else if (const auto pattern = pattern_of(options, output))
        file = named(*pattern, output.option, input);
    const bool exr = extension_of(file) == ".exr" || output.option != "-o";
    if (!exr && options.append)
        throw UsageError(file.native() + ": --append adds channels to an EXR; write .exr");
    if (!exr && (options.half || options.compression))
        throw UsageError(
            fmt::format("{}: {} is for .exr; leave it out", file.native(), options.half ? "--half" : "--compression"));
    if (extension_of(file) == ".png" && !options.png_scale && !output.product.png_scale)
        throw UsageError(file.native() + ": PNG holds 0 to 1 only; give --png-scale or write .exr, .tif, .pfm or .npy");
    return file;
}

using Key = std::pair<const Frame, std::string>;

// The value of a frame between two others: as far between theirs as the frame is. The option itself may refuse it, as one that
// takes whole numbers.
std::string between(const Animation& animation, const Key& before, const Key& after, Frame frame) {
    if (before.second == after.second)
        return before.second;
    const std::vector<double> from = numbers_in(before.second), to = numbers_in(after.second);
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (from.empty() || from.size() != to.size() || !std::ranges::all_of(from, is_finite) ||
        !std::ranges::all_of(to, is_finite))
        throw Error(fmt::format("{}: {} of frame {}: nothing lies between '{}' and '{}'; give the frame a line",
                                animation.file, animation.option, frame, before.second, after.second));
    const double part = static_cast<double>(frame - before.first) / static_cast<double>(after.first - before.first);
    std::vector<double> values(from.size());
    std::ranges::transform(from, to, values.begin(), [=](double a, double b) { return std::lerp(a, b, part); });
    const std::string value = fmt::format("{}", fmt::join(values, ","));
    animation.give(value); // which the option may refuse, such as one that takes whole numbers
    animation.give(animation.values.begin()->second); // until the first frame says otherwise
    return value;
}

std::string value_for(const Animation& animation, const Input& input, bool interpolate) {
    if (!input.frame)
        throw UsageError(fmt::format("{}: its name holds no frame, which --animate needs; give it a number, as in "
                                     "shot.0001.exr",
                                     input.file));
    const std::map<Frame, std::string>& values = animation.values;
    const auto next = values.lower_bound(*input.frame);
    if (next != values.end() && next->first == *input.frame)
        return next->second;
    if (interpolate && next != values.begin() && next != values.end())
        return between(animation, *std::prev(next), *next, *input.frame);
    throw Error(fmt::format("{}: has no {} for frame {} ({}); give every frame a line, or let --interpolate fill those "
                            "between two",
                            animation.file, animation.option, *input.frame, input.file));
}

void refuse_replacing(const std::vector<Job>& jobs) {
    std::set<fs::path> read;
    for (const Job& job : jobs) {
        read.insert({io::whole_path(job.input), io::whole_path(job.camera_name)});
        std::ranges::transform(job.companions, std::inserter(read, read.end()), io::whole_path);
    }
    for (const Job& job : jobs)
        for (const fs::path& output : job.outputs)
            if (output != standard_stream && read.contains(io::whole_path(output)))
                throw UsageError(output.native() + ": is one of the files to read; write elsewhere");
}

// The file of an input's companion. If there is none, the name that it should have: reading that reports the missing file.
// Throws: UsageError where several inputs would share one, and where a pattern needs a frame that the input has not.
fs::path companion_of(const DepthOptions& options, const Companion& companion, const Input& input) {
    if (companion.source.empty())
        throw UsageError(companion.option + ": the name is empty; give a file or a folder");
    if (options.inputs.is_pipe(companion.source))
        return companion.source;
    if (options.inputs.is_piped() && !pattern_in(companion.source))
        throw UsageError(fmt::format("{}: '{}' does not say which of a pipe's frames it belongs to; give a name with "
                                     "####, or a pipe",
                                     companion.option, companion.source));
    if (!io::is_folder(companion.source)) {
        if (const auto pattern = pattern_in(companion.source))
            return named(*pattern, companion.option, input);
        if (options.inputs.all().size() > 1)
            throw UsageError(
                fmt::format("{}: '{}' is no folder, and {} inputs need one, in which each finds its own name",
                            companion.option, companion.source, options.inputs.all().size()));
        return companion.source;
    }
    const fs::path like = fs::path(companion.source) / fs::path(input.file).stem();
    for (const char* extension : {".exr", ".tif", ".tiff", ".pfm", ".npy", ".png", ".jpg", ".jpeg", ".hdr"})
        if (fs::path file = fs::path(like).concat(extension); io::is_there(file))
            return file;
    return fs::path(like).concat(".exr");
}

using Ends = std::optional<std::array<double, 2>>;

// The range of the floats of all these files; none of integers, whose range is that of their bits.
Ends range_of(const std::map<Frame, std::string>& files, const DepthOptions& options) {
    Ends range;
    for (const auto& [frame, file] : files) {
        stop_if_interrupted();
        try {
            const fs::path mask =
                options.ignore.empty() ? "" : companion_of(options, {"--ignore", options.ignore}, {file, frame});
            const Ends own = io::range_of_floats(file, options.channel, ignored_of(options, mask));
            if (!own)
                return std::nullopt;
            range = range ? Ends({std::min((*range)[0], (*own)[0]), std::max((*range)[1], (*own)[1])}) : own;
        } catch (const Error&) { // is told when the turn of this file comes
        }
    }
    return range && (*range)[0] < (*range)[1] ? range : std::nullopt;
}

// The number that `--relative-range` would be given.
double as_written(double value) {
    return std::stod(fmt::format("{}", static_cast<float>(value)));
}

} // namespace

io::Ignored ignored_of(const DepthOptions& options, const fs::path& mask) {
    if (options.ignore.empty())
        return {};
    return [&options, mask](cv::Size size) { return io::ignored(mask, options.ignored_by, {{{0, 0}, size}, size}); };
}

std::vector<double> numbers_in(const std::string& text, std::optional<std::size_t> count) {
    std::vector<double> numbers;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        char* end = nullptr;
        numbers.push_back(static_cast<double>(std::strtold(part.c_str(), &end)));
        if (part.empty() || end != part.c_str() + part.size())
            return {};
    }
    return !count || numbers.size() == *count ? numbers : std::vector<double>{};
}

Windows smaller(const Windows& windows, int factor) {
    const auto& [data, display] = windows;
    return {{data.tl() / factor, data.size() / factor}, display / factor};
}

bool has_overscan(const Windows& windows) {
    return windows.data != cv::Rect({0, 0}, windows.display);
}

Job plan_frame(const DepthOptions& options, const Input& input) {
    Job job;
    job.input = input.file;
    job.frame = input.frame;
    job.in_sequence = input.source.has_value();
    for (const Companion& companion : options.companions)
        job.companions.push_back(companion_of(options, companion, input));
    job.camera_name = options.camera.of_headers()   ? input.file
                      : options.camera.file.empty() ? options.camera.name()
                                                    : options.camera.file_for(input);
    std::vector<fs::path> needed;
    if (job.in_sequence && job.frame && !options.inputs.is_piped()) {
        needed.push_back(job.input);
        std::ranges::remove_copy(job.companions, std::back_inserter(needed), standard_stream);
        if (options.camera.is_pattern())
            needed.push_back(job.camera_name);
    }
    if (const auto missing = std::ranges::find_if_not(needed, io::is_there); missing != needed.end())
        job.missing = *missing;
    job.left_out = !job.missing.empty() && options.inputs.skip_missing;
    if (!job.missing.empty())
        return job;
    for (const Animation& animation : options.animations)
        job.values.push_back(value_for(animation, input, options.interpolate));
    for (const Output& output : options.outputs)
        job.outputs.push_back(place(options, output, input));
    return job;
}

std::vector<Job> plan(const DepthOptions& options) {
    for (const Output& output : options.outputs)
        check_target(options, output);
    std::vector<Job> jobs;
    std::map<fs::path, std::string> taken;
    if (!options.log.empty())
        taken.emplace(io::whole_path(options.log), "--log");
    for (const Input& input : options.inputs.all()) {
        const Job& job = jobs.emplace_back(plan_frame(options, input));
        for (std::size_t i = 0; i < job.outputs.size(); ++i) {
            const bool is_only = options.outputs.size() == 1;
            const std::string what = is_only ? input.file : options.outputs[i].option + " of " + input.file;
            const auto [first, is_new] = taken.emplace(io::whole_path(job.outputs[i]), what);
            if (!is_new && options.outputs[i].target != standard_stream)
                throw UsageError(fmt::format("{}: would be written for {} and for {}; {}", job.outputs[i].native(),
                                             first->second, what,
                                             is_only ? "do them one by one" : "write one elsewhere"));
        }
    }
    if (std::ranges::none_of(jobs, [](const Job& job) { return job.missing.empty(); }))
        throw Error(fmt::format("{}: is not there, and {}; check the name, the number of figures and --frames",
                                jobs.front().missing.native(),
                                jobs.size() == 1
                                    ? "no other frame was asked for"
                                    : fmt::format("none of the {} frames has all its files", jobs.size())));
    refuse_replacing(jobs);
    return jobs;
}

void prepare_folders(const DepthOptions& options, const Job& job) {
    for (std::size_t i = 0; i < options.outputs.size(); ++i) {
        const fs::path& file = job.outputs[i];
        const fs::path folder = file.parent_path();
        std::error_code error;
        if (folder.empty() || io::is_folder(folder))
            continue;
        if (!is_folder(options, options.outputs[i]) && !pattern_of(options, options.outputs[i]))
            throw Error(fmt::format("{}: its folder does not exist; create {} first", file.native(), folder.native()));
        fs::create_directories(folder, error);
        if (error)
            io::refuse_making(folder, "cannot be made", error.value(), "choose another folder");
    }
}

std::vector<std::string> find_ranges(const DepthOptions& options, std::vector<Job>& jobs) {
    if (!options.relative || options.relative_options.range)
        return {};
    std::vector<std::string> said;
    for (const auto& [files, inputs] : options.inputs.shots()) {
        Ends range = range_of(files, options);
        if (!range)
            continue;
        range = {as_written((*range)[0]), as_written((*range)[1])};
        for (const std::size_t i : inputs)
            jobs[i].range = range;
        said.push_back(fmt::format("{0} to {1}  values {2} to {3} become 0 to 1 (--relative-range {2},{3})",
                                   files.begin()->second, files.rbegin()->second, (*range)[0], (*range)[1]));
    }
    return said;
}

} // namespace fathom::shot
