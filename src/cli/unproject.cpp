// fathom unproject
#include "command.hpp"
#include "each_depth.hpp"
#include "floats_on_host.hpp"
#include "picture.hpp"

#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>
#include <fathom/unproject.hpp>

#include <fmt/format.h>

#include <cmath>

namespace fathom::cli {
namespace {

struct UnprojectArguments : DepthOptions {
    UnprojectOptions unproject;
    PictureOptions picture;
    bool normals = false;
};

// Three finite numbers "X,Y,Z"; what is wrong with them otherwise.
std::string parse_point(const std::string& text, Eigen::Vector3d& point) {
    const std::vector<std::string> parts = CLI::detail::split(text, ',');
    bool good = parts.size() == 3;
    for (std::size_t i = 0; good && i < 3; ++i) {
        double& value = point[static_cast<Eigen::Index>(i)];
        good = CLI::detail::lexical_cast(parts[i], value) && std::isfinite(value);
    }
    return good ? "" : "'" + text + "' is no point; it is three numbers X,Y,Z";
}

Result points(const UnprojectArguments& options, const StoredDepth& stored, const Loaded& frame) {
    Result result = floats_on_host(stored.image, options.unproject.channels,
                                   [&](const Image& points) { unproject(stored, points, options.unproject); });
    if (!frame.companions.empty())
        result.colors = frame.images.get().picture.color;
    if (options.normals)
        result.normals = to_mat(normals(stored, {.space = options.unproject.space}));
    return result;
}

std::function<int()> configure_unproject(CLI::App& app) {
    const Product product{.extensions = {".exr", ".ply", ".tif", ".pfm", ".npy", ".png"},
                          .channels = {"P.X", "P.Y", "P.Z"}};
    const auto options = std::make_shared<UnprojectArguments>();
    UnprojectOptions& unprojection = options->unproject;
    add_depth_options(app, *options, product);
    CLI::Option* space =
        add_enum_option(app, "--space", unprojection.space, {{"view", Space::view}, {"world", Space::world}},
                        "axes of the positions: the camera's (default) or the world's.\n"
                        "World needs \"view\" in the camera file");
    CLI::Option* origin = app.add_option_function<std::string>(
        "--origin", [&](const std::string& text) { parse_point(text, unprojection.origin); },
        "makes positions relative to this point of the world (default:\n"
        "0,0,0). A point in the scene keeps floats exact. Needs\n--space world");
    origin->type_name("X,Y,Z")->needs(space)->check(CLI::Validator(
        [](std::string& text) {
            Eigen::Vector3d ignored;
            return parse_point(text, ignored);
        },
        ""));
    CLI::Option* background =
        add_enum_option(app, "--background", unprojection.background,
                        {{"nan", Background::nan}, {"inf", Background::inf}, {"decode", Background::decode}},
                        "background pixels have no position (nan or inf; default), or lie\non the far plane (decode)");
    add_picture_options(app, options->picture, "colours of the points of a .ply");
    app.get_option("--color")->required(false);
    CLI::Option* with_normals = app.add_flag("--normals", options->normals, "a .ply also holds the points' normals");
    for (CLI::Option* option : {space, origin, background, with_normals})
        option->group("Output");
    return [options, product, origin] {
        if (origin->count() > 0 && options->unproject.space == Space::view)
            throw UsageError("--origin: a point of the world, without meaning in --space view; say --space world");
        const std::string extension = options->format.empty() ? extension_of(options->output) : options->format;
        const bool colored = !options->picture.color.empty();
        if (extension != ".ply" && (colored || options->normals))
            throw UsageError(fmt::format("{}: only a .ply holds {}; write one (for several inputs: --format ply)",
                                         options->output, colored ? "colours of points" : "normals of points"));
        More more{.halo = 0};
        if (colored) {
            more.companions.push_back({"--color", options->picture.color});
            more.read = [options](const Job& job) {
                return Images{.picture = picture_of(job.companions.front(), options->picture, job)};
            };
        }
        return each_depth(*options, product, more, [&](const StoredDepth& stored, const Loaded& frame) {
            return std::vector<Result>{points(*options, stored, frame)};
        });
    };
}

} // namespace

extern const Command unproject_command{
    .name = "unproject",
    .summary = "Turns stored depth into exact positions, in the camera's axes or the world's.",
    .notes =
        R"(The result is three float32 a pixel in scene units. An EXR holds them as P.X P.Y P.Z. Pixels without a position
are NaN. A PLY leaves them out. It may have the points' colours (--color, sRGB of 8 bits) and --normals.

Example:
  fathom unproject frame.exr --camera camera.json -o points.ply --space world)",
    .configure = configure_unproject,
};

} // namespace fathom::cli
