// fathom unproject
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/picture.hpp"
#include "io/floats_on_host.hpp"
#include "shot/each_depth.hpp"

#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>
#include <fathom/unproject.hpp>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

namespace fathom::cli {
namespace {

struct UnprojectArguments : DepthOptions {
    UnprojectOptions unproject;
    PictureOptions picture;
    bool normals = false;
};

Result points(const UnprojectArguments& options, const StoredDepth& stored, const Loaded& frame) {
    Result result = floats_on_host(stored.image, options.unproject.channels,
                                   [&](const Image& points) { unproject(stored, points, options.unproject); });
    if (!options.picture.color.empty())
        cv::resize(frame.images.get().picture.color, result.colors, result.size, 0, 0, cv::INTER_AREA);
    if (options.normals)
        result.normals = to_mat(normals(stored, {.space = options.unproject.space}));
    return result;
}

std::function<int()> configure_unproject(CLI::App& app) {
    description::UnprojectCall call;
    const auto& operation = description::operation<description::UnprojectCall>();
    Product product = product_of(operation, operation.results_of(&call, {}).front());
    product.extensions.insert(product.extensions.begin() + 1, ".ply");
    const auto options = std::make_shared<UnprojectArguments>();
    UnprojectOptions& unprojection = options->unproject;
    constexpr const char* group = description::UnprojectCall::said.group;
    add_depth_options(app, *options, product);
    add_described_options(app, unprojection, group);
    add_picture_options(app, options->picture, "colours of the points of a .ply");
    app.get_option("--color")->required(false);
    app.add_flag("--normals", options->normals, "a .ply also holds the points' normals")->group(group);
    return [options, product] {
        const std::string extension = options->format.empty() ? extension_of(options->output) : options->format;
        const bool colored = !options->picture.color.empty();
        if (extension != ".ply" && (colored || options->normals))
            throw UsageError(fmt::format("{}: only a .ply holds {}; write one (for several inputs: --format ply)",
                                         options->output, colored ? "colours of points" : "normals of points"));
        More more;
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
    .summary = description::UnprojectCall::said.summary,
    .notes = description::UnprojectCall::said.notes,
    .configure = configure_unproject,
};

} // namespace fathom::cli
