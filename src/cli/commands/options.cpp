// fathom options
#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "description/as_json.hpp"
#include "terminal/messages.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <string>

namespace fathom::cli {
namespace {

void print_operations(bool in_json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    const auto program = [](const description::Option& option) {
        const std::string value = value_spelled(option);
        return spelled(option) + (value.empty() ? "" : " " + value);
    };
    for (const description::Operation& operation : description::operations()) {
        json.push_back(as_json(operation, program));
        if (in_json)
            continue;
        fmt::print("{}: {}\n", operation.name, operation.summary);
        for (const std::vector<description::Option>* listed : operation.listed())
            for (const description::Option& option : *listed)
                fmt::print("    {:<18} {:<20} {}; {}; {}\n", option.name, program(option), option.words,
                           option.accepted(), option.required ? "required" : "default: " + option.default_in_words());
    }
    if (in_json)
        print_json({{"version", FATHOM_VERSION}, {"operations", json}});
}

std::function<int()> configure_options(CLI::App& app) {
    const auto json = std::make_shared<bool>(false);
    app.add_flag("--json", *json, "print one line of JSON, from which other programs can make their own panels");
    return [json] {
        print_operations(*json);
        return done;
    };
}

} // namespace

extern const Command options_command{
    .name = "options",
    .summary = "Lists the options of each operation: what they accept, and what they are by default.",
    .notes =
        R"(Each option is shown as C++ and Python name it, then as the program spells it, unless a file says it there.
With --json a default is a number, a word, yes or no, or a list; default_words has it in words. An option is of no use
without one of those that it needs (space=world is one with this value), and refused beside one that it excludes: one
that excludes its own name takes values of several kinds, of which you give one. program_takes is what the program
accepts, where a file may bring the depth that belongs to a picture.

Example:
  fathom options --json)",
    .configure = configure_options,
};

} // namespace fathom::cli
