// The data of the page of a report.
#include "data.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

namespace fathom::cli {
namespace {

double rounded(double value) {
    return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr);
}

// One word for a shell.
std::string quoted(const std::string& word) {
    constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%+,-./:=@_";
    if (!word.empty() && word.find_first_not_of(plain) == word.npos)
        return word;
    std::string text = "'";
    for (const char c : word)
        text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

// A line for each key, and for each row of a matrix.
std::string laid_out(const Json& object) {
    const auto compact = [](const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); };
    std::string text;
    for (const auto& [key, value] : object.items()) {
        text += fmt::format("{}\n  {}: ", text.empty() ? "{" : ",", compact(key));
        const bool matrix = value.is_array() && !value.empty() && value.front().is_array();
        for (std::size_t i = 0; matrix && i < value.size(); ++i)
            text += (i > 0 ? ",\n    " : "[\n    ") + compact(value[i]);
        text += matrix ? "]" : compact(value);
    }
    return text.empty() ? "{}" : text + "\n}";
}

} // namespace

std::string plain_text(const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string hex_of(const cv::Vec3b& color) {
    return fmt::format("#{:02x}{:02x}{:02x}", color[2], color[1], color[0]);
}

Json layer_json(const Layer& layer, ColorMap map) {
    constexpr int letters_beside_a_bar = 44, stops = 33;
    Json json{
        {"name", layer.first.name}, {"meaning", meaning_of(layer.first, layer.range)}, {"unit", layer.first.unit}};
    if (layer.first.kind != Viewed::Kind::values)
        return json;
    json["ticks"] = Json::array();
    for (const Tick& tick : ticks_of(layer.range, letters_beside_a_bar))
        json["ticks"].push_back({{"place", tick.place}, {"label", tick.label}});
    for (int i = 0; i < stops; ++i)
        json["colors"].push_back(hex_of(colors_of(map)[static_cast<std::size_t>(i * 255 / (stops - 1))]));
    return json;
}

Json statistics_json(const Shown& shown) {
    const Statistics& found = shown.found;
    Json json{{"pixels", found.pixels}, {"invalid", found.invalid}};
    if (found.background > 0)
        json["background"] = found.background;
    if (found.any())
        json.update({{"least", rounded(found.least)},
                     {"greatest", rounded(found.greatest)},
                     {"p1", rounded(percentile(found.sample, 0.01))},
                     {"p50", rounded(percentile(found.sample, 0.5))},
                     {"p99", rounded(percentile(found.sample, 0.99))}});
    if (!shown.histogram.empty())
        json["histogram"] = shown.histogram;
    return json;
}

Json run_json(const Json& run) {
    std::string command;
    Json facts = Json::object();
    for (const auto& [key, value] : run.items()) {
        if (key == "command" && value.is_array())
            for (const Json& word : value)
                command += (command.empty() ? "" : " ") + quoted(plain_text(word));
        else if (key == "command")
            command = plain_text(value);
        else
            facts[key] = plain_text(value);
    }
    return {{"command", command}, {"facts", facts}};
}

void add_line(Json& frame, const Json& line, Cameras& cameras) {
    for (const char* key : {"status", "error", "missing"})
        if (const std::string text = text_of(line, key); !text.empty())
            frame[key] = text;
    for (const char* key :
         {"seconds", "read_seconds", "compute_seconds", "write_seconds", "nearest", "farthest", "invalid", "held"})
        if (const auto value = line.find(key); value != line.end() && value->is_number())
            frame[key] = value->is_number_float() ? Json(rounded(value->get<double>())) : *value;
    if (const auto warnings = line.find("warnings"); warnings != line.end() && warnings->is_array())
        for (const Json& warning : *warnings)
            frame["warnings"].push_back(plain_text(warning));
    if (const auto camera = line.find("camera"); camera != line.end() && camera->is_object()) {
        const std::string text = laid_out(*camera);
        const auto [at, is_new] = cameras.known.try_emplace(text, cameras.texts.size());
        if (is_new)
            cameras.texts.push_back(text);
        frame["camera"] = at->second;
    }
}

} // namespace fathom::cli
