#pragma once

#include <nlohmann/json.hpp>

#include <string>

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
};

/// What the program was started with, for the first line.
void remember_command_line(int argc, char** argv);

} // namespace fathom::cli
