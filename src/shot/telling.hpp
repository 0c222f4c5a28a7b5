#pragma once

#include "each_depth.hpp"

#include "doubts/look.hpp"
#include "io/relative_input.hpp"
#include "io/replace_files.hpp"
#include "operations/invalid_value.hpp"
#include "terminal/messages.hpp"

#include <fathom/device.hpp>
#include <fathom/io.hpp>
#include <fathom/relative.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <exception>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <vector>

namespace fathom::shot {

using terminal::in_words;

/// An input's relative depth.
struct RelativeDepth {
    DepthFile depth{
        {}, Storage::float32, {}}; ///< floats from 0 to 1, made smooth, and of the picture's size if there is one
    io::RelativeInput input;       ///< before that
    std::vector<std::string> doubts = {}; ///< what is probably wrong with its values, a sentence each with the cure
};

/// Gives each job of relative depth the range of the floats of its whole shot, which is read for it unless it is given, so that a frame does not depend on
/// which frames are done with it. Files that cannot be read do not count. Says the ranges in words, a line for each shot.
/// Throws: Interrupted.
std::vector<std::string> find_ranges(const DepthOptions& options, std::vector<Job>& jobs);

/// Throws: Error.
RelativeDepth relative_depth(const DepthOptions& options, const Job& job);

/// "values 3 to 250, 0 of 9600 pixels invalid": for the line about a result.
std::string in_words(const io::RelativeInput& input);

/// Seconds that the steps of an input took. It waits between them, which does not count.
struct Times {
    double read = 0, compute = 0, write = 0;

    double whole() const { return read + compute + write; }
};

/// What the depth holds, for the line about a result and for --json.
struct Held {
    std::string channel, words;
    nlohmann::ordered_json members;
};

/// What was read of an input. The images in it go when the input is computed.
struct ReadInput {
    DepthFile depth{{}, Storage::float32, {}};
    std::optional<InvalidValue> invalid;   ///< of pixels that do not count, if there may be some
    std::optional<RelativeDepth> relative; ///< all but its depth
    Camera seen;                           ///< by the pixels
    std::optional<cv::Size> picture_size;  ///< if it is another than the depth's
    std::vector<std::string> channel_doubts;
    std::shared_future<std::vector<std::string>> option_doubts;
};

/// What was found in it. It goes when the input is computed.
struct Examined {
    StoredDepth stored;
    cv::Mat z;     ///< what it decodes to
    cv::Mat small; ///< the depth before it was brought to the picture's size
    Subject subject;
    std::vector<std::string> value_doubts, camera_doubts;
};

/// An input between the steps, and its results until they are written and told.
struct Work {
    Job frame;
    Times times;
    bool loaded = false;
    bool kept = false;             ///< Do the results lie there already?
    nlohmann::ordered_json record; ///< of a run with records
    ReadInput read;
    std::optional<Examined> examined;
    Held held;
    bool doubtful_values = false;
    std::optional<ExrSource> source;
    Windows windows; ///< of the results
    std::vector<Made> results;
    io::Bytes raw = {}; ///< of the result that goes to standard output
};

/// What makes the results of each frame: a line of JSON beside the first of them, with the sizes and times of all files. A frame
/// whose line says what a run finds need not be made again.
class Records {
public:
    /// Options are those of the command line now, before a frame has changed the animated ones.
    Records(const DepthOptions& options, const Device& device);

    /// All that makes the results of a frame, before they are made.
    nlohmann::ordered_json of(const Job& job) const;

    /// Are all results of the frame those that were made of this?
    bool is_finished(const nlohmann::ordered_json& record, const Job& job) const;

    /// The file with the line, of what the results will be.
    io::LastFile file_of(const nlohmann::ordered_json& record, const Job& job) const;

private:
    const DepthOptions& options_;
    nlohmann::ordered_json common_; ///< of all frames
};

/// Where the line of a frame lies whose first result this is: OUT.fathom.json.
std::filesystem::path record_of(const std::filesystem::path& file);

/// A device for records: its name, and its driver's.
std::string device_class(const Device& device);

/// The hash of the text of all kernels.
std::string kernels_hash();

/// A file of JSON lines that several runs and processes may append to: each line is one write.
class RunLog {
public:
    /// Without a name nothing is written; "-" is stdout. Throws: Error for a file that cannot be written, or that holds something else.
    explicit RunLog(const std::string& file);

    /// The first line of a run; `more` is what only the run knows. The line has the command line, the version, the host and
    /// the time, too.
    void begin(const nlohmann::ordered_json& more);

    /// A frame's line. A disk that is full is told once, and ends the log; see `complete`.
    void add(const nlohmann::ordered_json& line);

    bool complete() const { return complete_; } ///< has every line been written?

private:
    std::string file_;
    std::ofstream stream_;
    bool complete_ = true;
    bool is_cut_ = false; ///< has a full disk left a part of a line?
};

/// What the program was started with, for the first line.
void remember_command_line(int argc, char** argv);

/// What is said on stdout, which a log there has for itself.
/// Throws: UsageError where two kinds of lines are to stand there.
Report report_of(const DepthOptions& options);

/// A line of JSON for an input that failed, if such lines are wanted.
void announce_failure(Report report, const Job& job, const std::string& error);

/// Tells how a run goes: lines on stdout, errors and a bar on stderr, and the log.
class Telling {
public:
    /// Begins the log. An empty one would say of no run, so that everything that ends a run comes before.
    /// Throws: Error for a log that cannot be written.
    Telling(const DepthOptions& options, const std::vector<Job>& jobs, const Device& device);

    /// Says for people what holds for all jobs.
    void begin(const std::vector<std::string>& lines) const;

    /// One of the jobs is done, and so are all before it.
    void tell(std::size_t job, const Work& work, const std::exception_ptr& failure);

    /// Names the inputs that failed, once no more will.
    void sum_up();

    /// Tells of what was left out at the end. Gives whether everything was done and told.
    bool finish();

private:
    void tell_left_out(std::size_t end);

    const DepthOptions& options_;
    const std::vector<Job>& jobs_;
    Report said_;
    std::size_t count_; // that are not left out
    RunLog log_;
    Progress progress_;
    std::size_t told_ = 0; // jobs of which the user has heard
    std::vector<std::string> failed_;
};

} // namespace fathom::shot
