#pragma once

#include "description/operations.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <string>

/// What describes operations to other programs, which make panels and nodes from it.
namespace fathom::description {

inline nlohmann::ordered_json as_json(double number, bool whole) {
    if (std::isinf(number))
        return number > 0 ? "inf" : "-inf";
    return whole ? nlohmann::ordered_json(static_cast<long long>(number)) : nlohmann::ordered_json(number);
}

inline nlohmann::ordered_json default_of(const Option& option) {
    if (!option.by_default)
        return nullptr;
    if (const auto* number = std::get_if<double>(&*option.by_default))
        return as_json(*number, option.is_whole());
    if (const auto* yes = std::get_if<bool>(&*option.by_default))
        return *yes;
    if (const auto* three = std::get_if<std::array<double, 3>>(&*option.by_default))
        return *three;
    return option.default_in_words();
}

inline nlohmann::ordered_json as_json(const Option& option) {
    nlohmann::ordered_json json{{"name", option.name},
                                {"kind", said_of(option.kind).name},
                                {"accepted", option.accepted()},
                                {"words", option.words},
                                {"required", option.required},
                                {"default", default_of(option)},
                                {"default_words", option.default_in_words()},
                                {"choices", std::vector(option.choices().begin(), option.choices().end())}};
    const Range& range = option.range;
    if (range.few[0]) {
        for (const std::optional<double>& number : range.few)
            if (number)
                json["values"].push_back(as_json(*number, true));
    } else if (option.kind == Kind::number) {
        json["whole"] = range.whole;
        json["least"] = as_json(range.least, range.whole);
        json["least_excluded"] = range.least_excluded;
        json["most"] = as_json(range.most, range.whole);
        json["most_excluded"] = range.most_excluded;
        json["infinite"] = range.infinite;
        if (range.beside)
            json["beside"] = as_json(*range.beside, range.whole);
    }
    json["needs"] = option.needs;
    json["excludes"] = option.excludes;
    return json;
}

inline nlohmann::ordered_json as_json(const Result& result) {
    const bool is_light = result.content.of == Content::Of::light;
    const Range& range = result.content.range;
    return {{"name", result.name},
            {"element", is_light ? "that of the picture" : "float32"},
            {"size", is_light ? "that of the picture" : result.shape.sides},
            {"channels", is_light ? 0 : result.shape.layout.channels},
            {"always", result.wanted},
            {"least", as_json(range.least, false)},
            {"most", as_json(range.most, false)},
            {"range_words", result.content.range_words},
            {"words", result.words}};
}

/// `spelled` is what the program calls an option, if that is to be said, too.
inline nlohmann::ordered_json as_json(const Operation& operation,
                                      const std::function<std::string(const Option&)>& spelled = {}) {
    nlohmann::ordered_json options = nlohmann::ordered_json::array(), results = options;
    for (const std::vector<Option>* listed : operation.listed())
        for (const Option& option : *listed)
            if (auto& json = options.emplace_back(as_json(option)); spelled) {
                json["program"] = spelled(option);
                json["program_takes"] = option.is_image() || option.kind == Kind::result ? "a file"
                                        : option.kind == Kind::flag ? "nothing, or =yes or =no" // behind its name
                                                                    : option.accepted();
            }
    for (const Result& result : operation.results_of(operation.make(nullptr).get(), {}))
        results.push_back(as_json(result));
    return {{"name", operation.name}, {"summary", operation.summary}, {"options", options}, {"results", results}};
}

} // namespace fathom::description
