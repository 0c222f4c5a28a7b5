#pragma once

#include "steps.hpp"

#include "terminal/messages.hpp"

#include <fathom/device.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <exception>
#include <string>
#include <vector>

namespace fathom::cli {

/// A file of JSON lines that several runs and processes may append to: each line is one write.
class RunLog {
public:
    /// Without a name nothing is written; "-" is stdout. Throws: Error for a file that cannot be written, or that holds something else.
    explicit RunLog(const std::string& file);
    ~RunLog();
    RunLog(const RunLog&) = delete;
    RunLog& operator=(const RunLog&) = delete;

    /// The first line of a run; `more` is what only the run knows. The line has the command line, the version, the host and
    /// the time, too.
    void begin(const nlohmann::ordered_json& more);

    /// A frame's line. A disk that is full is told once, and ends the log; see `complete`.
    void add(const nlohmann::ordered_json& line);

    bool complete() const { return complete_; } ///< has every line been written?

private:
    std::string file_;
    int descriptor_ = -1;
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

} // namespace fathom::cli
