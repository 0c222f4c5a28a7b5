// `--help`, and what is said instead of it when the arguments are wrong.
#include "help.hpp"

#include "terminal/messages.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace fathom::cli {
namespace {

struct Row {
    std::string term, meaning;
};

std::string indented(const std::string& text, std::size_t columns) {
    std::string result;
    for (const char c : text) {
        result += c;
        if (c == '\n')
            result.append(columns, ' ');
    }
    return result;
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
            width = std::max(width, row.term.size());
    std::string text;
    for (const Section& section : sections) {
        text += "\n" + section.title + ":\n";
        for (const Row& row : section.rows)
            text += fmt::format("  {:<{}}  {}\n", row.term, width, indented(row.meaning, width + 4));
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

// Commands first, then the options in their groups; the general ones (--help) come last, wherever they were added.
std::vector<Section> sections_of(const CLI::App& app) {
    std::vector<Section> sections;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (sections.empty())
            sections.push_back({"Commands", {}});
        sections.front().rows.push_back({command->get_name(), command->get_description()});
    }
    for (const bool general : {false, true})
        for (const CLI::Option* option : app.get_options()) {
            const std::string& group = option->get_group();
            if ((group == "Options") != general)
                continue;
            auto section = std::find_if(sections.begin(), sections.end(),
                                        [&](const Section& each) { return each.title == group; });
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
            text += " " + term(*option);
        else if (option->get_required())
            text += (option->get_snames().empty() ? " --" + option->get_lnames().front()
                                                  : " -" + option->get_snames().front()) +
                    " " + option->get_type_name();
    }
    return text + " [options]";
}

class Layout : public CLI::FormatterBase {
public:
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode) const override {
        return app->get_description() + "\n\nUsage: " + usage(*app, name) + "\n" + aligned(sections_of(*app)) + "\n" +
               app->get_footer() + "\n";
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
    return {};
}

std::string unknown(const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
    const std::string meant = nearest(name, known);
    return name + ": unknown " + kind + "; " + (meant.empty() ? "try --help" : "did you mean " + meant + "?");
}

} // namespace

std::shared_ptr<CLI::FormatterBase> help_layout() {
    return std::make_shared<Layout>();
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
    return command.get_name() + ": " + error.what() + "; try fathom " + command.get_name() + " --help";
}

} // namespace fathom::cli
