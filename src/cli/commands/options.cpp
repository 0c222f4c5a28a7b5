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
    for (const description::Operation& operation : description::operations()) {
        const nlohmann::ordered_json& described =
            json.emplace_back(as_json(operation, [](const description::Option& option) { return spelled(option); }));
        if (in_json)
            continue;
        fmt::print("{}: {}\n", operation.name, operation.summary);
        const auto text = [](const nlohmann::ordered_json& value) { return value.get<std::string>(); };
        for (const nlohmann::ordered_json& option : described["options"])
            fmt::print("    {:<18} {}{}\n", text(option["name"]), text(option["accepted"]),
                       option["default"].is_null() ? "; required" : "; default: " + text(option["default"]));
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
    .notes = R"(Names are those of C++ and Python. The program spells max_error as --max-error.

Example:
  fathom options --json)",
    .configure = configure_options,
};

} // namespace fathom::cli
