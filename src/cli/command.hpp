#pragma once

#include "terminal/exit.hpp"

#include <functional>
#include <memory>
#include <span>
#include <string>

namespace CLI {
class App;
} // namespace CLI

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

/// Those of src/cli/CMakeLists.txt, in its order. Other operations have the commands that their descriptions make.
std::span<const Command* const> commands();

/// Begins a line of an option's meaning. Others end where they are full.
inline constexpr char new_line = '\v';

} // namespace fathom::cli
