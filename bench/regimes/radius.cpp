// The radius of ambient occlusion from half a pixel to the image's width: a floor beside a wall, seen from straight above.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/regime.hpp"
#include "regimes/walls.hpp"

#include <cmath>
#include <limits>

namespace fathom::regimes {
namespace {

constexpr int width = 320, height = 96, foot = 80; // the wall's top covers the columns before its foot
constexpr const char* off = "error of visibility, rms";

// A pixel is a unit wide. The wall is twice as high as the radius is long.
std::vector<float> view_depth_of(double radius) {
    std::vector<float> depth(width * height);
    for (std::size_t i = 0; i < depth.size(); ++i)
        depth[i] = i % width < foot ? 1.0f : static_cast<float>(1 + 2 * radius);
    return depth;
}

double off_by(const Device& device, const std::vector<float>& depth, double radius, const SsaoOptions& options) {
    Camera camera =
        camera_over(orthographic({-width / 2.0, width / 2.0, -height / 2.0, height / 2.0}, {0.5, 1e4}), width, height);
    camera.encoding = Encoding::view_z;
    const auto visibility = images::floats(ssao(images::stored_of(device, depth, camera), radius, options).visibility);
    double sum = 0;
    int columns = 0;
    for (int x = foot; x < width && x + 0.5 - foot < std::max(radius, 1.0); ++x, ++columns)
        sum += std::pow(static_cast<double>(visibility[static_cast<std::size_t>(height / 2 * width + x)]) -
                            beside_wall((x + 0.5 - foot) / radius),
                        2);
    return std::sqrt(sum / columns);
}

} // namespace

Regime radius_of_occlusion(const Device& device) {
    Regime regime{"radius", "radius, pixels"};
    struct Way {
        const char* name;
        Quality quality;
        Border border;
    };
    for (const Way& way : {Way{"fast", Quality::fast, Border::clamp}, Way{"balanced", Quality::balanced, Border::clamp},
                           Way{"accurate", Quality::accurate, Border::clamp},
                           Way{"balanced, border open", Quality::balanced, Border::open}})
        for (const double radius : {0.5,  0.7,  1.0,  1.4,  2.0,  2.8,  4.0,   5.7,   8.0,   11.0,
                                    16.0, 23.0, 32.0, 45.0, 64.0, 91.0, 128.0, 181.0, 256.0, 320.0}) {
            SsaoOptions options{.sampling = Sampling{.quality = way.quality}};
            options.thickness = std::numeric_limits<double>::infinity();
            options.border = way.border;
            regime.panel(off).curve(way.name).points.push_back(
                {radius, off_by(device, view_depth_of(radius), radius, options)});
        }
    regime.boundaries = {
        {off, "fast", 0.06, 8, 5.8, "measured", none, 0.7},
        {off, "balanced", 0.03, 11, 8.1, "measured", none, 0.7},
        {off, "accurate", 0.03, 8, 5.8, "measured", none, 0.7},
        {off, "balanced, border open", 0.03, 91, 128, "measured", 11, none},
    };
    return regime;
}

} // namespace fathom::regimes
