#pragma once

#include "terminal/terminal.hpp"

#include <functional>
#include <memory>

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

using namespace terminal;
using terminal::number;

/// One command of the program, which a file of commands/ defines.
struct Command {
    std::string name;
    const char* summary; ///< one line, shown in the list of commands
    const char* notes;   ///< shown below the options: an example, what is worth knowing

    /// Adds the command's options; what it returns runs the command once they are parsed, and gives the exit code.
    std::function<std::function<int()>(CLI::App& app)> configure;
};

extern const Command show_command, inspect_command, steady_command, camera_command, presets_command, options_command,
    devices_command;

/// The commands and options of `fathom`.
class Program {
public:
    Program();
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// What the arguments ask for; it returns the exit code, and needs the program. Until it is called nothing is written, no
    /// device is opened, and nothing is read but the files of --animate.
    /// Throws: UsageError, in one sentence; Error for a file of --animate.
    std::function<int()> parse(int argc, const char* const* argv);

private:
    std::unique_ptr<CLI::App> app_;
    std::function<int()> action_;
};

} // namespace fathom::cli
