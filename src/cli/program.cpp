// The command line of `fathom`: its commands, what the arguments ask for, `--help`, and what is said instead of it when the
// arguments are wrong.
#include "program.hpp"

#include "command.hpp"
#include "operation.hpp"

#include "cli/options/described.hpp"
#include "description/check.hpp"
#include "terminal/messages.hpp"

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::cli {
namespace {

struct Row {
    std::string term, meaning;
};

// A terminal is at least that wide, and a longer term has its meaning below it.
constexpr std::size_t columns = 80, longest_term = 24;

// The words of a meaning in lines of one width.
std::string below_each_other(const std::string& meaning, std::size_t indent) {
    const std::size_t most = columns - indent;
    const std::string next = '\n' + std::string(indent, ' ');
    std::string text;
    for (std::string line : CLI::detail::split(meaning, new_line)) {
        text += text.empty() ? "" : next;
        std::size_t column = 0;
        std::ranges::replace(line, '\n', ' ');
        for (const std::string& word : CLI::detail::split(line, ' ')) {
            const bool fits = column + 1 + word.size() <= most;
            text += column == 0 ? "" : fits ? " " : next;
            column = column > 0 && fits ? column + 1 + word.size() : word.size();
            text += word;
        }
    }
    return text;
}

struct Section {
    std::string title;
    std::vector<Row> rows;
};

// All sections share the width of their first column.
std::string aligned(const std::vector<Section>& sections) {
    std::size_t width = 0;
    for (const Section& section : sections)
        for (const Row& row : section.rows)
            width = std::max(width, std::min(row.term.size(), longest_term));
    std::string text;
    for (const Section& section : sections) {
        text += "\n" + section.title + ":\n";
        for (const Row& row : section.rows)
            text += fmt::format("  {:<{}}{}{}\n", row.term, width,
                                row.term.size() > width ? '\n' + std::string(width + 4, ' ') : "  ",
                                below_each_other(row.meaning, width + 4));
    }
    return text;
}

std::string term(const CLI::Option& option) {
    if (option.get_positional())
        return option.get_single_name() + (option.get_expected_max() > 1 ? "..." : "");
    std::string names = option.get_snames().empty() ? "    " : "-" + option.get_snames().front();
    if (!option.get_lnames().empty())
        names += (option.get_snames().empty() ? "--" : ", --") + option.get_lnames().front();
    if (option.get_expected_max() > 0)
        names += " " + option.get_type_name();
    return names;
}

bool takes_frames(const CLI::App& app) {
    return app.get_option_no_throw("--frames") != nullptr;
}

// The options that every operation has, which are the commands that take frames.
std::set<const CLI::Option*> shared_options(const CLI::App& app) {
    std::set<const CLI::Option*> shared;
    if (!takes_frames(app))
        return shared;
    const auto operations = app.get_parent()->get_subcommands([](const CLI::App* each) { return takes_frames(*each); });
    for (const CLI::Option* option : app.get_options())
        if (std::ranges::all_of(operations, [&](const CLI::App* each) {
                return each->get_option_no_throw(option->get_name()) != nullptr;
            }))
            shared.insert(option);
    return shared;
}

// Without these no operation can be called.
bool is_essential(const CLI::Option& option) {
    return option.get_required() || option.get_name() == "--camera" || option.get_name() == "--preset";
}

// Commands first, then what an operation requires of its own, then options in their groups: those of the operation before those
// that all operations share, and --help last.
std::vector<Section> sections_of(const CLI::App& app, bool all) {
    std::vector<Section> sections;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (sections.empty())
            sections.push_back({"Commands", {}});
        sections.front().rows.push_back({command->get_name(), command->get_description()});
    }
    const std::set<const CLI::Option*> shared = shared_options(app);
    std::set<std::string> shared_groups;
    for (const CLI::Option* option : shared)
        shared_groups.insert(option->get_group());
    const auto rank = [&](const CLI::Option& option) {
        const std::string& group = option.get_group();
        return group == "Options" ? 2 : shared_groups.contains(group) ? 1 : 0;
    };
    std::vector<const CLI::Option*> options = app.get_options();
    std::ranges::stable_sort(
        options, {}, [&](const CLI::Option* option) { return std::pair(rank(*option), !option->get_required()); });
    for (const CLI::Option* option : options) {
        const bool own = takes_frames(app) && rank(*option) == 0;
        const std::string group = own && option->get_required() ? "Required" : option->get_group();
        const bool general = group == "Options";
        const bool left_out = !all && !general && shared.contains(option) && !is_essential(*option);
        if (left_out || option == app.get_help_all_ptr())
            continue;
        auto section = std::ranges::find(sections, group, &Section::title);
        if (section == sections.end())
            section = sections.insert(section, {group, {}});
        section->rows.push_back({term(*option), option->get_description()});
    }
    return sections;
}

std::string usage(const CLI::App& app, const std::string& name) {
    std::string text = app.get_parent() ? app.get_parent()->get_name() + " " + app.get_name() : name + " COMMAND";
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional())
            text += option->get_required() || takes_frames(app) ? " " + term(*option) : " [" + term(*option) + "]";
        else if (option->get_required())
            text += (option->get_snames().empty() ? " --" + option->get_lnames().front()
                                                  : " -" + option->get_snames().front()) +
                    " " + option->get_type_name();
    }
    return text + " [options]";
}

class HelpLayout : public CLI::FormatterBase {
public:
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        const bool all = mode == CLI::AppFormatMode::All;
        std::string text = app->get_description() + "\n\nUsage: " + usage(*app, name) + "\n" +
                           aligned(sections_of(*app, all)) + "\n" + app->get_footer() + "\n";
        if (!all && takes_frames(*app))
            text += "fathom " + app->get_name() +
                    " --help all also shows the options that all operations share: of frames, files, reports and "
                    "devices.\n";
        return text;
    }
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

// What to do without the options that version 0.2 had.
std::string cure_for_removed(const std::string& option) {
    if (option == "--share" || option == "--lease")
        return "give each machine a --frames range of its own, as docs/farms.md shows";
    if (option == "--openjd-frames")
        return "give the range to --frames with x for each colon, as in 1-9x2";
    if (option == "--rotate" || option == "--sharp" || option == "--transition" || option == "--tile")
        return "it is called " + (option == "--rotate" ? "--rotation-degrees" : option + "-px");
    if (option == "--tiles")
        return "give a file each to --tile-min-coc and --tile-max-coc";
    return {};
}

std::string unknown(const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
    const std::string meant = nearest(name, known);
    return name + ": unknown " + kind + "; " + (meant.empty() ? "try --help" : "did you mean " + meant + "?");
}

} // namespace

std::shared_ptr<CLI::FormatterBase> help_layout() {
    return std::make_shared<HelpLayout>();
}

std::string explain(const CLI::App& program, const CLI::ParseError& error) {
    const CLI::App& command = chosen(program);
    // An unknown option is reported first, because it causes other errors: its value was taken for an input, or the
    // option that was meant is missing.
    for (const std::string& extra : command.remaining())
        if (extra.size() > 1 && extra.front() == '-') {
            const std::string option = extra.substr(0, extra.find('=')), cure = cure_for_removed(option);
            return cure.empty() ? unknown("option", option, option_names(command))
                                : option + ": is no option any more; " + cure;
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
                [&](CLI::App& app) { return configure_operation(app, std::make_shared<OperationTask>(operation)); },
                &operation);
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
