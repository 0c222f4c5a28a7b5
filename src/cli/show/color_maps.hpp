#pragma once

#include <opencv2/core/matx.hpp>

#include <array>

namespace CLI {
class App;
}

namespace fathom::cli {

/// Colors for values from the least to the greatest.
enum class ColorMap { viridis, turbo, grey };

/// Its 256 colors, B, G, R.
const std::array<cv::Vec3b, 256>& colors_of(ColorMap map);

const char* to_string(ColorMap map);

/// Adds --map.
void add_map_option(CLI::App& app, ColorMap& map);

} // namespace fathom::cli
