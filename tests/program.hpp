#pragma once

#include "io_files.hpp"
#include "matrices.hpp"
#include "places.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <csignal>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/// The program `fathom` as a person starts it, and small inputs for it.
namespace fathom::test {

using Arguments = std::vector<std::string>;

inline Arguments joined(Arguments arguments, const Arguments& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

inline constexpr unsigned patience_s = 120; // a run that takes longer hangs

/// A folder of its own for each test: inputs lie in it, results belong into out/.
class Folder : TempFolder {
public:
    Folder() { fs::create_directory(path() / "out"); }

    std::string operator/(const std::string& name) const { return (path() / name).string(); }

    std::vector<std::string> results() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::recursive_directory_iterator(path() / "out"))
            names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }
};

inline std::string content(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

inline void write(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
}

struct Surroundings {
    rlim_t largest_file = RLIM_INFINITY; // bytes: what a full disk looks like to a program
    std::string out = {};                // where stdout goes; empty: kept
    Arguments before = {};               // of another program that starts it: `strace`, or `env` with variables
    std::string program = places::program;
    unsigned patience_s = test::patience_s;
};

struct Outcome {
    int code; // 128 + signal when it was killed
    std::string out, err;
    long peak_mib = 0;            // of its resident memory
    double processor_seconds = 0; // of all its threads
};

/// A run of the program, its streams going to files.
class Run {
public:
    explicit Run(const Arguments& arguments, const Surroundings& surroundings = {}) {
        keeps_out_ = surroundings.out.empty();
        out_ = keeps_out_ ? streams_ / "stdout" : surroundings.out;
        err_ = streams_ / "stderr";
        std::vector<char*> argv;
        Arguments all = joined(joined(surroundings.before, {surroundings.program}), arguments);
        for (std::string& argument : all)
            argv.push_back(argument.data());
        argv.push_back(nullptr);
        child_ = fork();
        if (child_ == 0) {
            const rlimit limit{surroundings.largest_file, surroundings.largest_file};
            setrlimit(RLIMIT_FSIZE, &limit);
            alarm(surroundings.patience_s);
            redirect(out_, STDOUT_FILENO);
            redirect(err_, STDERR_FILENO);
            execvp(argv[0], argv.data());
            _exit(126);
        }
    }
    ~Run() {
        if (child_ <= 0)
            return;
        send(SIGKILL);
        outcome();
    }
    Run(const Run&) = delete;
    Run& operator=(const Run&) = delete;

    void send(int signal) const { kill(child_, signal); }
    pid_t process() const { return child_; }
    std::string out() const { return keeps_out_ ? content(out_) : ""; }
    std::string err() const { return content(err_); }

    bool is_running() const {
        siginfo_t info{};
        return waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
    }

    /// Waits for its end.
    Outcome outcome() {
        int status = 0;
        rusage usage{};
        wait4(std::exchange(child_, 0), &status, 0, &usage);
        const auto seconds = [](const timeval& time) {
            return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
        };
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), out(), err(), usage.ru_maxrss >> 10,
                seconds(usage.ru_utime) + seconds(usage.ru_stime)};
    }

private:
    static void redirect(const std::string& file, int stream) {
        const int opened = open(file.c_str(), O_WRONLY | O_CREAT, 0666);
        dup2(opened, stream);
        close(opened);
    }

    Folder streams_;
    bool keeps_out_; // a device has no content to look at
    std::string out_, err_;
    pid_t child_;
};

inline Outcome run(const Arguments& arguments, const Surroundings& surroundings = {}) {
    return Run(arguments, surroundings).outcome();
}

/// Does the program not start by another one, as `strace`? Then a test says what it skips.
inline bool is_missing(const Arguments& before, const std::string& what) {
    const bool missing = run({"--version"}, {.before = before}).code != 0;
    if (missing)
        WARN("skipped: " << what);
    return missing;
}

inline void check_done(const Outcome& outcome) {
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(outcome.err.empty());
}

inline Outcome check_done(const Arguments& arguments, const Surroundings& surroundings = {}) {
    const Outcome outcome = run(arguments, surroundings);
    check_done(outcome);
    return outcome;
}

/// One line on stderr that names what is wrong. Of several inputs a last line counts those that failed.
inline void check_refused(const Outcome& outcome, int code, const std::string& named) {
    INFO("stderr: " << outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.err.starts_with("fathom: "));
    CHECK(outcome.err.ends_with('\n'));
    CHECK(contains(outcome.err, named));
    const std::size_t end = outcome.err.find('\n');
    const std::string rest = outcome.err.substr(end == std::string::npos ? outcome.err.size() : end + 1);
    if (rest.empty())
        return;
    CHECK(code == 1);
    CHECK(rest.starts_with("fathom: 1 of "));
    CHECK(contains(rest, " inputs failed: "));
    CHECK(rest.find('\n') == rest.size() - 1);
}

/// What the program says of arguments that it does not understand; nothing if it would begin its work. It is asked in this
/// process, which takes less than a start.
std::string usage_refusal(const Arguments& arguments);

inline void check_refused(const Arguments& arguments, int code, const std::string& named) {
    if (const std::string said = code == 2 ? usage_refusal(arguments) : ""; !said.empty()) {
        INFO(said);
        CHECK(contains(said, named));
    } else {
        check_refused(run(arguments), code, named);
    }
}

inline constexpr int width = 48, height = 32;

inline std::string camera_file(const Folder& folder, const std::string& more = {}) {
    const std::string file = folder / "camera.json";
    write(file, R"({"perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 0.5, "far": 100})" + more + "}");
    return file;
}

/// A ramp of depths, a background pixel in its corner.
inline cv::Mat ramp(int columns = width, int rows = height) {
    return filled(columns, rows, [&](int x, int y) {
        return static_cast<float>(y * columns + x + 1) / static_cast<float>(rows * columns);
    });
}

/// The ramp as the type that the extension stands for: 16-bit integers in .png, floats elsewhere.
inline std::string depth_file(const Folder& folder, const std::string& name, const cv::Mat& depth = ramp()) {
    const std::string file = folder / name;
    if (fs::path(name).extension() == ".png") {
        cv::imwrite(file, converted(depth, CV_16U, 65535));
    } else {
        write_image(file, depth, {.channels = {"Z"}, .png_scale = {}});
    }
    return file;
}

/// What a file's channel holds, untouched.
inline cv::Mat channel(const std::string& file, const std::string& name = {}) {
    return read_depth(file, {.channel = name, .packing = {}}).values;
}

} // namespace fathom::test
