// Frames of pipes. Each becomes a file in memory with NumPy's header, so that every reader and every option takes it.
#include "work.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <iterator>
#include <new>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace fathom::shot {
namespace {

constexpr const char* input_name = "standard input";

// Of version 1: the magic, the length of what follows, and a dict that ends at a multiple of 64 bytes.
std::string numpy_header(const io::RawFormat& format, cv::Size size) {
    std::string dict =
        fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}{}), }}",
                    format.bits == 8    ? "|u1"
                    : format.bits == 16 ? "<u2"
                                        : "<f4",
                    size.height, size.width, format.channels == 1 ? "" : fmt::format(", {}", format.channels));
    constexpr std::size_t before = 10, unit = 64;
    dict.resize((before + dict.size() + unit) / unit * unit - before, ' ');
    dict.back() = '\n';
    return "\x93NUMPY" + std::string{1, 0, static_cast<char>(dict.size() & 255), static_cast<char>(dict.size() >> 8)} +
           dict;
}

} // namespace

bool Inputs::is_pipe(const std::string& name) const {
    struct stat status;
    return name == standard_stream ||
           (pipe_size && ::stat(name.c_str(), &status) == 0 &&
            (S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode) || S_ISCHR(status.st_mode)));
}

/// A frame of a pipe as a file in memory, which is read like any other.
class FrameFile {
public:
    const std::string name; ///< for messages

    /// Throws: Error where there is no memory for it.
    FrameFile(std::string named, const io::RawFormat& format, cv::Size size)
        : name(std::move(named)), number_(::memfd_create("frame", MFD_CLOEXEC)) {
        const std::string header = numpy_header(format, size);
        bytes_ = header.size() + static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) *
                                     static_cast<std::size_t>(format.channels * format.bits / 8);
        const bool sized = number_ >= 0 && ::ftruncate(number_, static_cast<off_t>(bytes_)) == 0;
        mapped_ = sized ? ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, number_, 0) : MAP_FAILED;
        if (mapped_ == MAP_FAILED) {
            const int error = errno;
            if (number_ >= 0)
                ::close(number_);
            throw Error(fmt::format("{}: there is no memory for {} bytes: {}", name, bytes_, io::reason(error)));
        }
        auto* const first = static_cast<unsigned char*>(mapped_);
        std::ranges::copy(header, first);
        pixels = {first + header.size(), first + bytes_};
    }
    ~FrameFile() {
        ::munmap(mapped_, bytes_);
        ::close(number_);
    }
    FrameFile(const FrameFile&) = delete;
    FrameFile& operator=(const FrameFile&) = delete;

    std::filesystem::path path() const { return fmt::format("/proc/self/fd/{}", number_); }

    std::span<unsigned char> pixels; ///< where they belong

private:
    int number_;
    void* mapped_ = nullptr;
    std::size_t bytes_ = 0;
};

std::string Job::shown(std::string words) const {
    for (const std::shared_ptr<FrameFile>& frame : frames) {
        const std::string path = frame->path();
        for (std::size_t at = 0; (at = words.find(path, at)) != std::string::npos; at += frame->name.size())
            words.replace(at, path.size(), frame->name);
    }
    return words;
}

struct Pipes::Source {
    std::string argument, name; // as it was given, and for messages
    const io::RawFormat* format;
    std::ptrdiff_t companion; // -1: the depth
    int number = -1;
    std::size_t filled = 0; // bytes of the frame that is read
    bool ended = false;

    ~Source() {
        if (number > STDERR_FILENO)
            ::close(number);
    }

    // Reads what there is.
    void read(std::span<unsigned char> pixels) {
        const auto count =
            ::read(number, pixels.data() + filled, std::min<std::size_t>(pixels.size() - filled, 1 << 30));
        if (count < 0 && errno != EINTR && errno != EAGAIN)
            throw Error(fmt::format("{}: cannot be read: {}", name, io::reason(errno)));
        ended = count == 0;
        filled += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    }
};

Pipes::Pipes(const DepthOptions& options) {
    const std::vector<Output>& outputs = options.outputs;
    const std::vector<Companion>& companions = options.companions;
    const Inputs& inputs = options.inputs;
    const auto add = [&](const std::string& argument, const io::RawFormat& format, std::ptrdiff_t companion) {
        if (argument == standard_stream &&
            std::ranges::any_of(sources_, [](const auto& other) { return other->argument == standard_stream; }))
            throw UsageError("-: standard input is named twice; give one of the two as a named pipe or as files");
        sources_.push_back(std::make_unique<Source>(
            Source{argument, argument == standard_stream ? input_name : argument, &format, companion}));
    };
    of_depth_ = inputs.is_piped();
    if (of_depth_)
        add(inputs.arguments.front(), *inputs.pipe_format, -1);
    for (std::size_t i = 0; i < companions.size(); ++i) {
        if (!inputs.is_pipe(companions[i].source))
            continue;
        if (!companions[i].pixels)
            throw UsageError(fmt::format("{}: {} is a pipe, which the depth and --color alone may be; give files",
                                         companions[i].option, companions[i].source));
        add(companions[i].source, *companions[i].pixels, static_cast<std::ptrdiff_t>(i));
    }
    const auto stdout_named = std::ranges::find(outputs, standard_stream, &Output::target);
    if (!any() && stdout_named == outputs.end()) {
        if (inputs.pipe_size)
            throw UsageError("--size: is that of a pipe's frames, and there is no pipe; leave it out");
        return;
    }
    if (any() && !inputs.pipe_size)
        throw UsageError(fmt::format("{}: raw frames do not say how large they are; give --size WIDTHxHEIGHT",
                                     sources_.front()->argument));
    size_ = inputs.pipe_size.value_or(cv::Size());
    for (std::size_t i = 0; i < outputs.size(); ++i)
        if (outputs[i].target == standard_stream && i > 0)
            throw UsageError(outputs[i].option + ": only -o goes to standard output; give a file");
    if (stdout_named != outputs.end()) {
        result_format(options);
        if (isatty(STDOUT_FILENO))
            throw UsageError(
                "-o -: standard output is a terminal, and raw pixels are nothing for it; send it to a file "
                "or a program");
    }
    if (options.resume || options.append)
        throw UsageError(
            fmt::format("{}: does not go with pipes; leave it out", options.resume ? "--resume" : "--append"));
    if (inputs.skip_missing)
        throw UsageError("--missing: nobody knows which frames of a pipe are missing; leave it out");
    if (of_depth_ && options.progress == ProgressKind::openjd)
        throw UsageError("--progress openjd: nobody knows how many frames a pipe has; leave it out");
    if (of_depth_ && options.relative && inputs.pipe_format->bits == 32 && !options.relative_options.range)
        throw UsageError("--relative-range: missing; the range of a pipe's floats is not known before all have come");
}

Pipes::~Pipes() = default;

void Pipes::open() {
    for (const auto& source : sources_) {
        // Without waiting: whoever writes may wait until another pipe is opened.
        source->number = source->argument == standard_stream
                             ? STDIN_FILENO
                             : ::open(source->argument.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
        if (source->number < 0)
            throw Error(fmt::format("{}: cannot be opened: {}", source->name, io::reason(errno)));
        constexpr int large = 1 << 20;
        static_cast<void>(::fcntl(source->number, F_SETPIPE_SZ, large)); // fewer turns, where it is allowed
    }
}

bool Pipes::next() {
    if (!failure_.empty())
        return false;
    Frame frame;
    for (const auto& source : sources_) {
        source->filled = 0;
        frame.push_back(
            std::make_shared<FrameFile>(fmt::format("{}, frame {}", source->name, count_ + 1), *source->format, size_));
    }
    const auto is_whole = [&](std::size_t i) { return sources_[i]->filled == frame[i]->pixels.size(); };
    for (;;) { // whoever writes several pipes fills them in an order of its own
        std::vector<pollfd> open;
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < sources_.size(); ++i)
            if (!sources_[i]->ended && !is_whole(i)) {
                open.push_back({sources_[i]->number, POLLIN, 0});
                which.push_back(i);
            }
        if (open.empty())
            break;
        constexpr int milliseconds = 100;
        ::poll(open.data(), open.size(), milliseconds);
        if (stopped_ || is_interrupted())
            return false;
        for (std::size_t i = 0; i < open.size(); ++i)
            if (open[i].revents != 0)
                sources_[which[i]]->read(frame[which[i]]->pixels);
    }
    const Source *whole = nullptr, *ended = nullptr;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        const Source& source = *sources_[i];
        (source.ended ? ended : whole) = &source;
        if (source.ended && source.filled > 0 && failure_.empty())
            failure_ =
                fmt::format("{}: ends within frame {}, of which {} of {} bytes are there; check --size and the "
                            "pixel format ({})",
                            source.name, count_ + 1, source.filled, frame[i]->pixels.size(), source.format->name);
    }
    if (whole && ended && failure_.empty())
        failure_ = fmt::format("{}: has no frame {}, but {} has", ended->name, count_ + 1, whole->name);
    if (ended)
        return false;
    const std::lock_guard lock(mutex_);
    waiting_.emplace(count_++, std::move(frame));
    return true;
}

void Pipes::give(std::size_t frame, Job& job) {
    const std::lock_guard lock(mutex_);
    const auto its = waiting_.find(frame);
    job.frames = std::move(its->second);
    waiting_.erase(its);
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        const std::ptrdiff_t companion = sources_[i]->companion;
        (companion < 0 ? job.input : job.companions[static_cast<std::size_t>(companion)]) = job.frames[i]->path();
    }
}

void Pipes::check_end(std::size_t expected) {
    const auto ended = std::ranges::find(sources_, true, [](const auto& source) { return source->ended; });
    if (failure_.empty() && !of_depth_ && count_ < expected && ended != sources_.end())
        failure_ =
            fmt::format("{}: has no frame {}, but there are {} depth images", (*ended)->name, count_ + 1, expected);
    if (failure_.empty() && any() && !of_depth_ && count_ == expected && next())
        failure_ =
            fmt::format("{}: has more frames than there are depth images ({})", sources_.front()->name, expected);
    if (!failure_.empty())
        throw Error(failure_);
    if (of_depth_ && count_ == 0 && !is_interrupted())
        throw Error(
            fmt::format("{}: ends before the first frame; check the program that writes it", sources_.front()->name));
}

const io::RawFormat& result_format(const DepthOptions& options) {
    const Product& product = options.outputs.front().product;
    const bool is_color = product.kind == ImageKind::color;
    const int channels = is_color ? 3 : static_cast<int>(product.channels.size());
    std::string name = options.format.empty() ? "" : options.format.substr(1);
    if (name.empty() && is_color) { // that of the picture
        name = "rgb24";
        for (const Companion& companion : options.companions)
            if (companion.pixels && options.inputs.is_pipe(companion.source))
                name = companion.pixels->name;
    } else if (name.empty()) {
        name = channels == 1 ? "grayf32le" : "rgbf32le";
    }
    if (channels != 1 && channels != 3)
        throw UsageError(fmt::format("-o -: raw frames have one channel or three, and this result {}{}", channels,
                                     options.command == "dof-masks" ? "; choose one with --mask" : ""));
    std::vector<std::string> fitting;
    for (const io::RawFormat& format : io::raw_formats) {
        if (format.channels != channels || (!is_color && format.bits == 8))
            continue;
        fitting.emplace_back(format.name);
        if (name != format.name)
            continue;
        if (format.bits == 16 && !product.png_scale && !options.png_scale)
            throw UsageError("--format gray16le: codes hold 0 to 1 only; give --png-scale, or write grayf32le");
        return format;
    }
    throw UsageError(fmt::format("--format {}: is none of this result's raw formats; it is {}", name, one_of(fitting)));
}

} // namespace fathom::shot
