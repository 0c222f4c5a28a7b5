// fathom fog
#include "description/fog.hpp"

#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "cli/options/picture.hpp"
#include "shot/each_depth.hpp"

#include <fathom/fog.hpp>
#include <fathom/opencv.hpp>

#include <utility>

namespace fathom::cli {
namespace {

struct FogArguments : DepthOptions {
    FogOptions fog{.density = 0}; // --density is required
    PictureOptions picture;
};

void add_fog_options(CLI::App& app, FogOptions& fog) {
    add_described_options(app, fog, "Fog");
    for (const char* option : {"--reference-height", "--up"})
        app.get_option(option)->needs(app.get_option("--height-falloff"));
}

Picture fogged(const FogArguments& options, const StoredDepth& stored, const Loaded& frame) {
    Picture picture = frame.images.get().picture;
    FogOptions asked = options.fog;
    std::swap(asked.fog_color[0], asked.fog_color[2]); // a matrix is B, G, R
    const cv::Mat color = picture.color;               // read by the device until the result is there
    picture.color = to_mat(fog(stored, to_device(stored.image.device(), color), asked));
    return picture;
}

std::function<int()> configure_fog(CLI::App& app) {
    const Product product = picture_product("fog");
    const auto options = std::make_shared<FogArguments>();
    add_depth_options(app, *options, product);
    add_picture_options(app, options->picture, "the clear picture");
    add_fog_options(app, options->fog);
    return [=] {
        More more{.halo = 0};
        use_picture(more, options->picture);
        return each_depth(*options, product, more, [&](const StoredDepth& stored, const Loaded& frame) {
            return std::vector<Result>{fogged(*options, stored, frame)};
        });
    };
}

} // namespace

extern const Command fog_command{
    .name = "fog",
    .summary = description::fog_summary,
    .notes = R"(Each pixel becomes color (1 - f) + fog color f with f = 1 - exp(-density distance). The distance is that
along the ray, in scene units. Under --height-falloff the density is integrated along the ray in closed form.

Fog covers light, not codes: see --color-space. An alpha stays as it is. A pixel with an invalid depth keeps its
colour. With several inputs, IMAGE and OUT are folders. The picture and the result of an input have its name there.

Example:
  fathom fog frame.exr --color frame.exr --camera camera.json -o foggy.exr --density 0.02
  fathom fog frame.exr --color frame.png --camera camera.json -o foggy.png --density 0.1 --height-falloff 0.5 \
      --up 0,0,1 --fog-color 0.7,0.7,0.75)",
    .configure = configure_fog,
};

} // namespace fathom::cli
