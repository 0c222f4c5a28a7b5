#pragma once

#include "shot/inputs.hpp"
#include "terminal/messages.hpp"

#include <functional>
#include <memory>
#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

using namespace shot;
using namespace terminal;
using terminal::number;

/// One command of the program, which commands/NAME.cpp defines. Operations that have none are made from their descriptions alone.
struct Command {
    const char* name;
    const char* summary; ///< one line, shown in the list of commands
    const char* notes;   ///< shown below the options: an example, what is worth knowing

    /// Adds the command's options; what it returns runs the command once they are parsed, and gives the exit code.
    std::function<int()> (*configure)(CLI::App& app);
};

extern const Command unproject_command, ssao_command, dof_masks_command, dof_command, show_command, inspect_command,
    camera_command, presets_command, options_command, devices_command;

/// Begins a line of an option's meaning. Others end where they are full.
inline constexpr char new_line = '\v';

} // namespace fathom::cli
