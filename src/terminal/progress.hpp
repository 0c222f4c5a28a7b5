#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace fathom::cli {

/// How a run over several inputs tells how far it is.
enum class ProgressKind { automatic, openjd, off };

/// How far a run is: a bar on a terminal, or the lines that a session of Open Job Description understands.
/// Source of those: the specification "How Jobs Are Run", <https://github.com/OpenJobDescription/openjd-specifications>.
class Progress {
public:
    /// `quiet` runs have no bar.
    Progress(ProgressKind kind, std::size_t count, bool quiet);
    ~Progress() { hide(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Makes place for other lines.
    void hide();

    /// One more input is done, and its lines are printed.
    void advance();

private:
    std::size_t count_, done_ = 0;
    bool bar_ = false, openjd_ = false, shown_ = false;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), first_ = {};
};

/// "0:48", "1:02:03".
std::string in_minutes(double seconds);

} // namespace fathom::cli
