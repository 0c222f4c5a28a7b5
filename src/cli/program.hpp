#pragma once

#include <functional>
#include <memory>

namespace CLI {
class App;
}

namespace fathom::cli {

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
