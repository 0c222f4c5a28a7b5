// The command line of `fathom`: its commands, and what the arguments ask for.
#include "program.hpp"

#include "command.hpp"
#include "help.hpp"
#include "operation.hpp"

#include "cli/options/described.hpp"

#include <CLI/CLI.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::cli {
namespace {

constexpr const char* exit_codes = R"(Exit codes:
  0    done
  1    some input failed; the others were done
  2    wrong usage; nothing was done
  3    no OpenCL device as asked for, or one whose driver compiles no kernels
  130  interrupted (Ctrl-C) after the inputs in work; no half-written file is left
  143  the same after SIGTERM, 129 after SIGHUP, and 141 if nobody reads what is printed)";

constexpr const char* exit_codes_in_short =
    "Exit codes: 0 done, 1 some input failed, 2 wrong usage, 3 no such device, 130, 143, 129 and 141 interrupted.";

// `--help all` as CLI11 has it.
std::vector<const char*> with_all_help(int argc, const char* const* argv) {
    std::vector<const char*> words(argv, argv + argc);
    for (std::size_t i = 1; i + 1 < words.size(); ++i) {
        const std::string_view flag = words[i];
        if ((flag == "--help" || flag == "-h") && words[i + 1] == std::string_view("all")) {
            words[i] = "--help-all";
            words.erase(words.begin() + static_cast<std::ptrdiff_t>(i) + 1);
        }
    }
    return words;
}

} // namespace

Program::Program()
    : app_(
          std::make_unique<CLI::App>("fathom: exact post-processing of depth images, on any OpenCL device", "fathom")) {
    app_->formatter(help_layout());
    app_->set_help_flag("-h,--help", "print this help, or that of a command");
    app_->set_help_all_flag("--help-all");
    app_->set_version_flag("--version", "fathom " FATHOM_VERSION, "print the version");
    app_->require_subcommand(1);
    app_->footer("Example:\n  fathom linearize frame.exr --camera camera.json -o frame.z.exr\n\n" +
                 std::string(exit_codes));
    const auto add = [&](const char* name, const char* summary, const char* notes, const auto& configure,
                         const description::Operation* operation = nullptr) {
        CLI::App* app = app_->add_subcommand(name, summary);
        app->set_help_flag("-h,--help", "print this help");
        app->footer(notes + std::string("\n\n") + exit_codes_in_short);
        app->parse_complete_callback([this, app, operation, run = configure(*app)] {
            if (operation)
                check_together(*app, *operation);
            action_ = run;
        });
    };
    std::vector<const Command*> own(commands().begin(), commands().end());
    for (const description::Operation& operation : description::operations()) {
        const std::string name = spelled(operation.name).substr(2);
        const auto command = std::ranges::find(own, name, &Command::name);
        if (command != own.end()) {
            add((*command)->name, (*command)->summary, (*command)->notes, (*command)->configure, &operation);
            own.erase(command);
        } else {
            add(
                name.c_str(), operation.summary, operation.notes,
                [&](CLI::App& app) { return configure_operation(app, operation); }, &operation);
        }
    }
    for (const Command* command : own)
        add(command->name, command->summary, command->notes, command->configure);
}

Program::~Program() = default;

std::function<int()> Program::parse(int argc, const char* const* argv) {
    try {
        const std::vector<const char*> words = with_all_help(argc, argv);
        app_->parse(static_cast<int>(words.size()), words.data());
    } catch (const CLI::Success&) { // --help, --version
        return [this, wanted = std::current_exception()] {
            try {
                std::rethrow_exception(wanted);
            } catch (const CLI::Success& success) {
                std::ostringstream said;
                const int code = app_->exit(success, said, said);
                fmt::print("{}", said.str()); // std::cout would forget why it could not be written
                return code;
            }
        };
    } catch (const CLI::ParseError& error) {
        throw UsageError(explain(*app_, error));
    }
    return action_;
}

} // namespace fathom::cli
