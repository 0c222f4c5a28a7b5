// fathom normals
#include "command.hpp"
#include "each_depth.hpp"
#include "floats_on_host.hpp"
#include "max_error.hpp"

#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>

namespace fathom::cli {
namespace {

struct NormalsArguments : DepthOptions {
    NormalsOptions normals; // without its method
    NormalMethod method = NormalMethod::automatic;
    std::optional<double> max_error; // instead
    bool explain = false;
};

std::function<int()> configure_normals(CLI::App& app) {
    const Product product{.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"},
                          .channels = {"N.X", "N.Y", "N.Z"},
                          .png_scale = 0.5,
                          .png_offset = 0.5};
    const auto options = std::make_shared<NormalsArguments>();
    NormalsOptions& normal = options->normals;
    add_depth_options(app, *options, product);
    add_enum_option(app, "--method", options->method,
                    {{"automatic", NormalMethod::automatic},
                     {"neighbours", NormalMethod::neighbours},
                     {"least-squares", NormalMethod::least_squares}},
                    "how slopes are found: from neighbours on the same surface, or\n"
                    "from a plane fitted to a window, for quantised depth.\n"
                    "automatic (default) fits for 16 bits and fewer, and for noise")
        ->group("Normals");
    add_max_error(app, options->max_error, options->explain, "mean degrees", {"--method"}, "Normals");
    app.add_option("--noise", normal.noise,
                   "standard deviation of a sensor's noise over the depth, such as\n"
                   "9e-4: planes are fitted to wider windows (default: 0)")
        ->type_name("R")
        ->check(is_a_number("number from 0 to less than 1", [](double r) { return r >= 0 && r < 1; }))
        ->excludes("--max-error")
        ->group("Normals");
    app.add_option("--tolerance", normal.tolerance,
                   "how far depth may be off, in half steps of its storage\n"
                   "(default: 1)")
        ->type_name("T")
        ->check(is_a_number("number above 0", [](double t) { return t > 0; }))
        ->group("Normals");
    add_enum_option(app, "--space", normal.space, {{"view", Space::view}, {"world", Space::world}},
                    "axes of the normals: the camera's (default) or the world's.\n"
                    "World needs \"view\" in the camera file")
        ->group("Output");
    return [options, product] {
        return each_depth(
            *options, product, {.halo = normals_reach_noise}, [&](const StoredDepth& stored, Loaded& frame) {
                explain_method(fathom::Operation::normals, stored, frame, options->max_error, options->explain);
                NormalsOptions asked = options->normals;
                asked.method = method_or(options->max_error, options->method);
                return std::vector<Result>{directions_for(
                    frame.outputs.front(),
                    floats_on_host(stored.image, 3, [&](const Image& result) { normals(stored, result, asked); }))};
            });
    };
}

} // namespace

extern const Command normals_command{
    .name = "normals",
    .summary = "Turns stored depth into surface normals, in the camera's axes or the world's.",
    .notes =
        R"(The result is three float32 a pixel. Normals have length 1 and point towards the camera. An EXR holds them as
N.X N.Y N.Z. Invalid and background pixels have 0 0 0. A .png holds ½n + ½ in 16 bits, and black for no normal.

Example:
  fathom normals frame.exr --camera camera.json -o frame.normals.exr --space world)",
    .configure = configure_normals,
};

} // namespace fathom::cli
