#pragma once

#include "description/operations.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <string>
#include <string_view>

/// What describes operations to other programs, which make panels and nodes from it.
namespace fathom::description {

inline const char* to_string(Kind kind) {
    static constexpr const char* names[] = {"number",     "choice",  "flag",  "three numbers", "result", "picture",
                                            "directions", "lengths", "depth", "region",        "lens"};
    return names[static_cast<std::size_t>(kind)];
}

inline nlohmann::ordered_json as_json(const Operation& operation, const Option& option,
                                      const std::vector<Option>& others) {
    nlohmann::ordered_json json{{"name", option.name},
                                {"kind", to_string(option.kind)},
                                {"accepted", option.accepted()},
                                {"words", option.words}};
    const bool is_required = !option.by_default && option.kind != Kind::lens; // which other options make, too
    if (!is_required)
        json["default"] = option.by_default.value_or("that of the lens");
    else
        json["default"] = nullptr;
    json["choices"] = option.choices;
    const auto end = [](double value) {
        return std::isinf(value) ? nlohmann::ordered_json(value > 0 ? "inf" : "-inf") : nlohmann::ordered_json(value);
    };
    if (option.range.few[0]) {
        for (const std::optional<double>& number : option.range.few)
            if (number)
                json["values"].push_back(*number);
    } else if (option.kind == Kind::number) {
        json["whole"] = option.range.whole;
        json["least"] = end(option.range.least);
        json["least_excluded"] = option.range.least_excluded;
        json["most"] = end(option.range.most);
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

inline nlohmann::ordered_json as_json(const Result& result) {
    const bool is_light = result.content.of == Content::Of::light;
    return {{"name", result.name},
            {"element", is_light ? "that of the picture" : "float32"},
            {"size", is_light ? "that of the picture" : result.shape.sides},
            {"channels", is_light ? 0 : result.shape.layout.channels},
            {"always", result.wanted},
            {"words", result.words}};
}

/// `spelled` is what the program calls an option, if that is to be said, too.
inline nlohmann::ordered_json as_json(const Operation& operation,
                                      const std::function<std::string(const Option&)>& spelled = {}) {
    nlohmann::ordered_json options = nlohmann::ordered_json::array(), results = options;
    for (const std::vector<Option>* listed : {&operation.lens, &operation.options})
        for (const Option& option : *listed)
            if (auto& json = options.emplace_back(as_json(operation, option, *listed)); spelled)
                json["program"] = spelled(option);
    for (const Result& result : operation.results_of(operation.make(nullptr).get(), {}))
        results.push_back(as_json(result));
    return {{"name", operation.name}, {"summary", operation.summary}, {"options", options}, {"results", results}};
}

} // namespace fathom::description
