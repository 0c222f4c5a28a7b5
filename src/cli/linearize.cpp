// fathom linearize
#include "command.hpp"
#include "each_depth.hpp"

#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

namespace fathom::cli {
namespace {

struct Options : DepthOptions {
    LinearizeOptions linearize;
};

std::function<int()> configure(CLI::App& app) {
    const Product product{.extensions = {".exr", ".tif", ".pfm", ".png"}, .channels = {"Z"}};
    const auto options = std::make_shared<Options>();
    add_depth_options(app, *options, product);
    add_enum_option(app, "--background", options->linearize.background,
                    {{"inf", Background::inf}, {"decode", Background::decode}, {"nan", Background::nan}},
                    "what pixels with nothing in them become: infinity (default),\nthe far plane's distance, or NaN")
        ->group("Output");
    return [options, product] {
        return each_depth(*options, product, [&](const StoredDepth& stored) {
            return to_mat(linearize(stored, options->linearize).image);
        });
    };
}

} // namespace

extern const Command linearize_command{
    .name = "linearize",
    .summary = "Turns stored depth into exact distance along the view axis.",
    .notes = R"(The result is float32, in scene units, positive in front of the eye, rows in the order of the input;
an EXR holds it as channel Z. Values that cannot be depth become NaN.

Example:
  fathom linearize frame.exr --camera camera.json -o frame.z.exr
  fathom linearize shots/*.png --camera camera.json -o depth/ --format tif)",
    .configure = configure,
};

} // namespace fathom::cli
