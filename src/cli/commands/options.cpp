// fathom options
#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "description/operations.hpp"
#include "terminal/messages.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace fathom::cli {
namespace {

using description::Operation;
using description::Option;

const char* to_string(Option::Kind kind) {
    switch (kind) {
    case Option::Kind::number:
        return "number";
    case Option::Kind::choice:
        return "choice";
    case Option::Kind::flag:
        return "flag";
    case Option::Kind::result:
        return "result";
    case Option::Kind::three:
        break;
    }
    return "three numbers";
}

nlohmann::ordered_json as_json(const Option& option, const std::vector<Option>& others) {
    nlohmann::ordered_json json{{"name", option.name},
                                {"program", spelled(option.name)},
                                {"kind", to_string(option.kind)},
                                {"accepted", option.accepted()},
                                {"words", option.words}};
    json["default"] = option.by_default ? nlohmann::ordered_json(*option.by_default) : nlohmann::ordered_json();
    json["choices"] = option.choices;
    if (option.kind == Option::Kind::number && !option.range.few[0]) {
        json["whole"] = option.range.whole;
        json["least"] = json_number(option.range.least);
        json["least_excluded"] = option.range.least_excluded;
        json["most"] = json_number(option.range.most);
        json["most_excluded"] = option.range.most_excluded;
        json["infinite"] = option.range.infinite;
    }
    json["excludes"] = nlohmann::ordered_json::array();
    for (const Option& other : others)
        if (option.excludes(other))
            json["excludes"].push_back(other.name);
    return json;
}

void print_operations(bool in_json) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const Operation& operation : description::operations()) {
        nlohmann::ordered_json options = nlohmann::ordered_json::array();
        if (!in_json)
            fmt::print("{}: {}\n", operation.name, operation.summary);
        for (const Option& option : operation.options) {
            options.push_back(as_json(option, operation.options));
            if (!in_json)
                fmt::print("    {:<18} {}{}\n", option.name, option.accepted(),
                           option.by_default ? "; default: " + *option.by_default : "; required");
        }
        all.push_back({{"name", operation.name}, {"summary", operation.summary}, {"options", options}});
    }
    if (in_json)
        print_json({{"version", FATHOM_VERSION}, {"operations", all}});
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
