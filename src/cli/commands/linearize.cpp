// fathom linearize
#include "description/linearize.hpp"

#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "io/floats_on_host.hpp"
#include "shot/each_depth.hpp"

#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

namespace fathom::cli {
namespace {

struct LinearizeArguments : DepthOptions {
    LinearizeOptions linearize;
};

std::function<int()> configure_linearize(CLI::App& app) {
    const Product product{.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"}, .channels = {"Z"}, .layer = "linear"};
    const auto options = std::make_shared<LinearizeArguments>();
    add_depth_options(app, *options, product);
    add_described_options(app, options->linearize, "Output");
    return [options, product] {
        return each_depth(*options, product, [&](const StoredDepth& stored) {
            return floats_on_host(stored.image, 1, [&](const Image& z) { linearize(stored, z, options->linearize); });
        });
    };
}

} // namespace

extern const Command linearize_command{
    .name = "linearize",
    .summary = description::linearize_summary,
    .notes =
        R"(The result is float32 in scene units, positive in front of the camera. Rows keep the order of the input. An EXR
holds it as channel Z. Invalid values become NaN.

Example:
  fathom linearize frame.exr --camera camera.json -o frame.z.exr
  fathom linearize shots/*.png --camera camera.json -o depth/ --format tif)",
    .configure = configure_linearize,
};

} // namespace fathom::cli
