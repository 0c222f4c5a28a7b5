#pragma once

#include "terminal/exit.hpp"

#include <functional>
#include <span>

namespace CLI {
class App;
}

namespace fathom::cli {

/// One command of the program. commands/NAME.cpp defines `extern const Command NAME_command`; src/cli/CMakeLists.txt lists the
/// names.
struct Command {
    const char* name;
    const char* summary; ///< one line, shown in the list of commands
    const char* notes;   ///< shown below the options: an example, what is worth knowing

    /// Adds the command's options; what it returns runs the command once they are parsed, and gives the exit code.
    std::function<int()> (*configure)(CLI::App& app);
};

/// All of them, in the order of the list in src/cli/CMakeLists.txt.
std::span<const Command* const> commands();

} // namespace fathom::cli
