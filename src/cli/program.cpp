// The command line of `fathom`: its commands, what the arguments ask for, `--help`, and what is said instead of it when the
// arguments are wrong.

#include "operation.hpp"
#include "options.hpp"

#include "description/check.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <set>
#include <sstream>

namespace fathom::cli {
namespace {

// The words of a meaning in lines that end where an 80 columns wide terminal does.
std::string below_each_other(const std::string& meaning, std::size_t most) {
    std::string text;
    for (const std::string& line : CLI::detail::split(meaning, new_line)) {
        text += text.empty() ? "" : "\n";
        std::size_t column = 0;
        for (const std::string& word : CLI::detail::split(line, ' ')) {
            const bool fits = column + 1 + word.size() <= most;
            text += column == 0 ? "" : fits ? " " : "\n";
            column = column > 0 && fits ? column + 1 + word.size() : word.size();
            text += word;
        }
    }
    return text;
}

bool is_operation(const CLI::App& app) {
    return app.get_option_no_throw("--help-all") != nullptr;
}

// Options that every operation has, but for those without which none can be called.
std::set<const CLI::Option*> shared_options(const CLI::App& app) {
    std::set<const CLI::Option*> shared;
    if (!is_operation(app))
        return shared;
    const auto operations = app.get_parent()->get_subcommands([](const CLI::App* each) { return is_operation(*each); });
    for (const CLI::Option* option : app.get_options())
        if (const std::string name = option->get_name();
            !option->get_required() && name != "--camera" && name != "--preset" && !name.starts_with("--help") &&
            std::ranges::all_of(operations, [&](const CLI::App* each) { return each->get_option_no_throw(name); }))
            shared.insert(option);
    return shared;
}

// CLI11's, with words in lines, and without the options that all operations share where --help-all does not ask for them.
class HelpLayout : public CLI::Formatter {
public:
    HelpLayout() { column_width(28); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        const bool all = mode == CLI::AppFormatMode::All;
        left_out_ = all ? std::set<const CLI::Option*>() : shared_options(*app);
        std::string text = Formatter::make_help(app, name, CLI::AppFormatMode::Normal);
        for (std::size_t at; (at = text.find("\n\n\n")) != std::string::npos;) // of groups that are left out
            text.erase(at, 1);
        return text;
    }

    std::string make_group(std::string group, bool is_positional,
                           std::vector<const CLI::Option*> options) const override {
        std::erase_if(options, [&](const CLI::Option* option) { return left_out_.contains(option); });
        return options.empty() ? "" : Formatter::make_group(group, is_positional, options);
    }

    std::string make_option_desc(const CLI::Option* option) const override {
        return below_each_other(option->get_description(), 80 - get_column_width());
    }

private:
    mutable std::set<const CLI::Option*> left_out_;
};

const CLI::App& chosen(const CLI::App& program) {
    const std::vector<CLI::App*> commands = program.get_subcommands();
    return commands.empty() ? program : *commands.front();
}

std::vector<std::string> command_names(const CLI::App& program) {
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    return names;
}

std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    return names;
}

std::string unknown(const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
    return name + ": unknown " + kind + "; " + did_you_mean(name, known, "try --help");
}

// What is wrong with the arguments, in one sentence; unknown names come with the nearest known one.
std::string explain(const CLI::App& program, const CLI::ParseError& error) {
    const CLI::App& command = chosen(program);
    // An unknown option is reported first, because it causes other errors: its value was taken for an input, or the
    // option that was meant is missing.
    for (const std::string& extra : command.remaining())
        if (extra.size() > 1 && extra.front() == '-') {
            return unknown("option", extra.substr(0, extra.find('=')), option_names(command));
        }
    if (&command == &program) {
        for (const std::string& extra : program.remaining())
            return unknown("command", extra, command_names(program));
        return "no command given; it is " + one_of(command_names(program)) + ", or --help";
    }
    for (const std::string& extra : command.remaining())
        return extra + ": is one argument too many; try fathom " + command.get_name() + " --help";
    for (const CLI::Option* option : command.get_options())
        if (option->get_expected_max() == 1 && option->count() > 1)
            return option->get_name() + ": is given more than once";
    const std::vector<std::string> said = CLI::detail::split(error.what(), ' ');
    if (error.get_name() == "ExcludesError") // "--one excludes --other"
        return description::excluding(said.front(), said.back());
    if (error.get_name() == "RequiresError") // "--one requires --other"
        return said.front() + ": is of no use without " + said.back();
    return command.get_name() + ": " + error.what() + "; try fathom " + command.get_name() + " --help";
}

constexpr const char* exit_codes = R"(Exit codes:
  0    done
  1    some input failed; the others were done
  2    wrong usage; nothing was done
  3    no OpenCL device as asked for, or one whose driver compiles no kernels
  130  interrupted (Ctrl-C) after the inputs in work; no half-written file is left
  143  the same after SIGTERM, 129 after SIGHUP, and 141 if nobody reads what is printed)";

} // namespace

Program::Program()
    : app_(
          std::make_unique<CLI::App>("fathom: exact post-processing of depth images, on any OpenCL device", "fathom")) {
    app_->formatter(std::make_shared<HelpLayout>());
    app_->set_help_flag("-h,--help", "print this help, or that of a command");
    app_->set_version_flag("--version", "fathom " FATHOM_VERSION, "print the version");
    app_->require_subcommand(1);
    app_->footer("Example:\n  fathom linearize frame.exr --camera camera.json -o frame.z.exr\n\n" +
                 std::string(exit_codes));
    const auto add = [&](const Command& command, const description::Operation* operation) {
        CLI::App* app = app_->add_subcommand(command.name, command.summary);
        app->set_help_flag("-h,--help", "print this help");
        if (operation)
            app->set_help_all_flag("--help-all", "also show the options that all operations share: of frames, files, "
                                                 "reports and devices");
        app->footer(command.notes + std::string("\n\n") + exit_codes);
        app->parse_complete_callback([this, app, operation, run = command.configure(*app)] {
            if (operation)
                check_together(*app, *operation);
            action_ = run;
        });
    };
    for (const description::Operation& operation : description::operations())
        add(command_of(operation), &operation);
    for (const Command* command : {&show_command, &inspect_command, &steady_command, &camera_command, &presets_command,
                                   &options_command, &devices_command})
        add(*command, nullptr);
}

Program::~Program() = default;

std::function<int()> Program::parse(int argc, const char* const* argv) {
    try {
        app_->parse(argc, argv);
    } catch (const CLI::Success& success) { // --help, --version
        std::ostringstream said;
        const int code = app_->exit(success, said, said);
        return [code, said = said.str()] {
            fmt::print("{}", said); // std::cout would forget why it could not be written
            return code;
        };
    } catch (const CLI::ParseError& error) {
        throw UsageError(explain(*app_, error));
    }
    return action_;
}

} // namespace fathom::cli
