// Tables of false color, which are OpenCV's: viridis (van der Walt, Smith 2015) and turbo (Mikhailov 2019).
#include "color_maps.hpp"

#include "cli/options/depth_options.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <numeric>

namespace fathom::cli {
namespace {

using Colors = std::array<cv::Vec3b, 256>;

Colors greys() {
    Colors colors;
    for (std::size_t i = 0; i < colors.size(); ++i)
        colors[i] = cv::Vec3b::all(static_cast<unsigned char>(i));
    return colors;
}

Colors mapped(cv::ColormapTypes map) {
    cv::Mat_<unsigned char> codes(1, 256);
    std::iota(codes.begin(), codes.end(), static_cast<unsigned char>(0));
    cv::Mat row;
    cv::applyColorMap(codes, row, map);
    Colors colors;
    std::copy(row.begin<cv::Vec3b>(), row.end<cv::Vec3b>(), colors.begin());
    return colors;
}

} // namespace

const std::array<cv::Vec3b, 256>& colors_of(ColorMap map) {
    static const Colors all[] = {mapped(cv::COLORMAP_VIRIDIS), mapped(cv::COLORMAP_TURBO), greys()};
    return all[static_cast<std::size_t>(map)];
}

const char* to_string(ColorMap map) {
    static constexpr const char* names[] = {"viridis", "turbo", "grey"};
    return names[static_cast<std::size_t>(map)];
}

void add_map_option(CLI::App& app, ColorMap& map) {
    add_enum_option(app, "--map", map,
                    {{"viridis", ColorMap::viridis}, {"turbo", ColorMap::turbo}, {"grey", ColorMap::grey}},
                    "colours of values (default: viridis, whose steps look equal)")
        ->group("Output");
}

} // namespace fathom::cli
