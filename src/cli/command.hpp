#pragma once

#include <functional>
#include <span>
#include <stdexcept>

namespace CLI {
class App;
}

namespace fathom::cli {

/// What the program says to the shell. An interrupt is 128 plus the signal's number: 130 for Ctrl-C.
enum ExitCode : int { done = 0, input_failed = 1, wrong_usage = 2, no_device = 3 };

/// One command of the program. NAME.cpp defines `extern const Command NAME_command`; src/cli/CMakeLists.txt lists the names.
struct Command {
    const char* name;
    const char* summary; ///< one line, shown in the list of commands
    const char* notes;   ///< shown below the options: an example, what is worth knowing

    /// Adds the command's options; what it returns runs the command once they are parsed, and gives the exit code.
    std::function<int()> (*configure)(CLI::App& app);
};

/// Those of src/cli/CMakeLists.txt, in its order. Other operations have the commands that their descriptions make.
std::span<const Command* const> commands();

/// The arguments contradict each other or the files that are there. Nothing was done yet.
class UsageError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

} // namespace fathom::cli
