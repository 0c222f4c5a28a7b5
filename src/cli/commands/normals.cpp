// fathom normals
#include "description/normals.hpp"

#include "cli/command.hpp"
#include "cli/options/described.hpp"
#include "cli/options/max_error.hpp"
#include "io/floats_on_host.hpp"
#include "shot/each_depth.hpp"

#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>

namespace fathom::cli {
namespace {

struct NormalsArguments : DepthOptions {
    NormalsOptions normals;
    bool explain = false;
};

std::function<int()> configure_normals(CLI::App& app) {
    const Product product{.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"},
                          .channels = {"N.X", "N.Y", "N.Z"},
                          .png_scale = 0.5,
                          .png_offset = 0.5};
    const auto options = std::make_shared<NormalsArguments>();
    add_depth_options(app, *options, product);
    add_described_options(app, options->normals, "Normals");
    app.get_option("--noise")->excludes(app.get_option("--max-error"));
    add_explain(app, options->explain, "Normals");
    return [options, product] {
        return each_depth(
            *options, product, {.halo = normals_reach_noise}, [&](const StoredDepth& stored, Loaded& frame) {
                explain_method(fathom::Operation::normals, stored, frame, options->normals.method, options->explain);
                return std::vector<Result>{
                    directions_for(frame.outputs.front(), floats_on_host(stored.image, 3, [&](const Image& result) {
                                       normals(stored, result, options->normals);
                                   }))};
            });
    };
}

} // namespace

extern const Command normals_command{
    .name = "normals",
    .summary = description::normals_summary,
    .notes =
        R"(The result is three float32 a pixel. Normals have length 1 and point towards the camera. An EXR holds them as
N.X N.Y N.Z. Invalid and background pixels have 0 0 0. A .png holds ½n + ½ in 16 bits, and black for no normal.

Example:
  fathom normals frame.exr --camera camera.json -o frame.normals.exr --space world)",
    .configure = configure_normals,
};

} // namespace fathom::cli
