// fathom options
#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "description/operations.hpp"
#include "terminal/messages.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <string_view>

namespace fathom::cli {
namespace {

using description::Option;

const char* to_string(description::Kind kind) {
    static constexpr const char* names[] = {"number",     "choice",  "flag",  "three numbers", "result", "picture",
                                            "directions", "lengths", "depth", "region",        "lens"};
    return names[static_cast<std::size_t>(kind)];
}

nlohmann::ordered_json as_json(const description::Operation& operation, const Option& option,
                               const std::vector<Option>& others) {
    nlohmann::ordered_json json{{"name", option.name},
                                {"program", spelled(option)},
                                {"kind", to_string(option.kind)},
                                {"accepted", option.accepted()},
                                {"words", option.words}};
    json["default"] = option.by_default ? nlohmann::ordered_json(*option.by_default) : nlohmann::ordered_json();
    json["choices"] = option.choices;
    if (option.range.few[0]) {
        for (const std::optional<double>& number : option.range.few)
            if (number)
                json["values"].push_back(*number);
    } else if (option.kind == Option::Kind::number) {
        json["whole"] = option.range.whole;
        json["least"] = json_number(option.range.least);
        json["least_excluded"] = option.range.least_excluded;
        json["most"] = json_number(option.range.most);
        json["most_excluded"] = option.range.most_excluded;
        json["infinite"] = option.range.infinite;
        if (option.range.beside)
            json["beside"] = *option.range.beside;
    }
    json["needs"] = json["excludes"] = nlohmann::ordered_json::array();
    const std::string_view name = option.name;
    for (const auto& [one, other] : operation.needing)
        if (one && one == name)
            json["needs"].push_back(other);
    for (const Option& other : others)
        if (option.excludes(other) && name != other.name)
            json["excludes"].push_back(other.name);
    for (const auto& [one, other] : operation.excluding)
        if (one && (one == name || other == name))
            json["excludes"].push_back(one == name ? other : one);
    return json;
}

nlohmann::ordered_json as_json(const description::Result& result) {
    const bool is_light = result.content.of == description::Content::Of::light;
    return {{"name", result.name},
            {"element", is_light ? "that of the picture" : "float32"},
            {"size", is_light ? "that of the picture" : result.shape.sides},
            {"channels", is_light ? 0 : result.shape.layout.channels},
            {"always", result.wanted},
            {"words", result.words}};
}

void print_operations(bool in_json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const description::Operation& operation : description::operations()) {
        nlohmann::ordered_json options = nlohmann::ordered_json::array(), results = options;
        if (!in_json)
            fmt::print("{}: {}\n", operation.name, operation.summary);
        for (const std::vector<Option>* listed : {&operation.lens, &operation.options})
            for (const Option& option : *listed) {
                options.push_back(as_json(operation, option, *listed));
                if (!in_json)
                    fmt::print("    {:<18} {}{}\n", option.name, option.accepted(),
                               option.by_default ? "; default: " + *option.by_default : "; required");
            }
        for (const description::Result& result : operation.results_of(operation.make(nullptr).get(), {}))
            results.push_back(as_json(result));
        json.push_back(
            {{"name", operation.name}, {"summary", operation.summary}, {"options", options}, {"results", results}});
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
