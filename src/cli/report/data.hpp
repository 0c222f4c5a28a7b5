#pragma once

#include "log.hpp"
#include "pictures.hpp"

#include <cstddef>
#include <map>
#include <string>

namespace fathom::cli {

/// A color, B, G, R, as the page has it.
std::string hex_of(const cv::Vec3b& color);

/// A layer with the legend of its map.
Json layer_json(const Layer& layer, ColorMap map);

Json statistics_json(const Shown& shown);

/// A run's command and its facts.
Json run_json(const Json& run);

/// A string itself, anything else as JSON.
std::string plain_text(const Json& value);

/// Cameras of all frames, each once.
struct Cameras {
    Json texts = Json::array();
    std::map<std::string, std::size_t> known = {};
};

/// Adds to a frame what the log says of it, as far as the page has a place for it.
void add_line(Json& frame, const Json& line, Cameras& cameras);

} // namespace fathom::cli
