// fathom dof-masks
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/lens.hpp"
#include "cli/options/picture.hpp"
#include "operations/bands.hpp"
#include "shot/each_depth.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>

namespace fathom::cli {
namespace {

struct DofMasksArguments : DepthOptions {
    LensArguments lens;
    DofMasksOptions masks;
    std::optional<std::size_t> mask; // of `channels`
    PictureOptions picture;
    std::map<std::string, std::string> more; // files of other results, by their names
};

// Not before main: it would have nobody to catch a lack of memory.
const description::Operation& described_masks() {
    return description::operation<description::DofMasksCall>();
}

// The results that go into one file: the circle, and those that have no option. A mask alone is one of them.
std::vector<description::Result> in_one_file(description::DofMasksCall& call, std::optional<std::size_t> mask) {
    std::vector<description::Result> all = described_masks().results_of(&call, {});
    std::erase_if(all,
                  [](const description::Result& result) { return !result.wanted && !spelled(result.name).empty(); });
    for (std::size_t i = 1; i < all.size(); ++i)
        for (const description::Option& option : described_masks().options)
            if (option.name == std::string_view(all[i].name))
                described_masks().set(&call, option, !mask || mask == i);
    return all;
}

const std::vector<std::string>& channels() {
    static const std::vector<std::string> all = [] {
        description::DofMasksCall call{};
        std::vector<std::string> names;
        for (const description::Result& result : in_one_file(call, {}))
            names.emplace_back(result.content.channels);
        return names;
    }();
    return all;
}

// What is written: all masks, which only an EXR holds, or the one that was asked for.
Product product_for(const DofMasksArguments& options) {
    if (!options.mask) {
        const std::string extension = options.format.empty() ? extension_of(options.output) : options.format;
        if (extension == ".tif" || extension == ".pfm" || extension == ".npy" || extension == ".png")
            throw UsageError(fmt::format("{}: a {} holds one mask; choose it with --mask {}, or write .exr",
                                         options.output, extension, CLI::detail::join(channels(), "|")));
        return {.extensions = {".exr"}, .channels = channels(), .layer = "depth"};
    }
    description::DofMasksCall call;
    Product product = product_of(described_masks(), in_one_file(call, {})[*options.mask]);
    product.layer = "depth";
    if (options.png_scale)
        product.png_scale = options.png_scale;
    return product;
}

void merge_into(cv::Mat& all, const std::vector<Image>& images) {
    std::vector<cv::Mat> parts;
    for (const Image& image : images)
        parts.push_back(to_mat(image));
    cv::merge(parts, all);
}

// The mask that was asked for, or all of them as channels. It is made some rows at a time: the masks of a whole image beside
// these channels would take the memory twice.
cv::Mat masks_of(const DofMasksArguments& options, const StoredDepth& stored, const CircleOfConfusion& circle) {
    constexpr std::size_t most_pixels = 1 << 20; // of a band
    const int width = stored.image.width(), height = stored.image.height();
    const auto pixels_of = [=](int, int made) {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(made);
    };
    description::DofMasksCall call{.circle = circle, .options = options.masks};
    const std::vector<description::Result> results = in_one_file(call, options.mask);
    cv::Mat all(height, width, CV_32FC(options.mask ? 1 : static_cast<int>(channels().size())));
    for (const auto& [begin, end, first, last] : bands({0, height, height, {0}, pixels_of}, most_pixels)) {
        call.results = dof_masks(stored.region(0, begin, width, end - begin), circle, call.options);
        cv::Mat part = all.rowRange(begin, end);
        std::vector<Image> each;
        for (const description::Result& result : results)
            each.push_back(*result.image);
        merge_into(part, options.mask ? std::vector{each[*options.mask]} : each);
    }
    return all;
}

// What was asked for beside the masks, in the order of `outputs_of`. It depends on the pixels around each one, so it is made at once.
std::vector<Result> more_masks_of(const DofMasksArguments& options, const StoredDepth& stored,
                                  const CircleOfConfusion& circle, const Loaded& frame) {
    if (options.more.empty())
        return {};
    description::DofMasksCall call{.circle = circle, .options = options.masks};
    outputs_of(described_masks(), &call, options.more);
    std::vector<Result> results = run(described_masks(), &call, stored, frame);
    results.erase(results.begin()); // the circle
    return results;
}

std::function<int()> configure_dof_masks(CLI::App& app) {
    const auto options = std::make_shared<DofMasksArguments>();
    add_depth_options(app, *options, {.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"}, .channels = channels()});
    add_lens_options(app, options->lens);
    add_described_options(app, options->masks, described_masks().group);
    add_picture_options(app, options->picture, "a picture whose size and edges the masks are to have");
    app.get_option("--color")->required(false);
    app.add_option_function<std::string>(
           "--mask",
           [options](const std::string& name) {
               for (std::size_t i = 0; i < channels().size(); ++i)
                   if (channels()[i] == name)
                       options->mask = i;
           },
           "write this mask only, to any type of file")
        ->type_name(CLI::detail::join(channels(), "|"))
        ->check(is_one_of(channels()))
        ->group("Output");
    add_result_options(app, described_masks(), options->more);
    add_relative_options(app);
    options->camera.or_relative = true;
    return [=] {
        complete(options->lens, options->relative, options->camera);
        const Product product = product_for(*options);
        More more;
        if (!options->picture.color.empty()) {
            use_picture(more, options->picture);
            options->relative.picture = more.picture;
            options->relative.color_layer = options->picture.color_layer;
        }
        description::DofMasksCall asked{.options = options->masks};
        more.outputs = outputs_of(described_masks(), &asked, options->more);
        more.length_doubts = [options](const StoredDepth& stored, const Subject& subject, const Job& job) {
            return blur_doubts(options->lens, stored, job, subject, options->masks.sky, options->masks.max_coc_px);
        };
        return each_depth(*options, product, more, [&](const StoredDepth& stored, const Loaded& frame) {
            if (!options->picture.color.empty())
                frame.images.get(); // throws what was wrong with the picture
            const CircleOfConfusion circle = circle_of(options->lens, stored, frame);
            std::vector<Result> results = more_masks_of(*options, stored, circle, frame);
            results.emplace(results.begin(), masks_of(*options, stored, circle));
            return results;
        });
    };
}

} // namespace

extern const Command dof_masks_command{
    .name = "dof-masks",
    .summary = description::DofMasksCall::said.summary,
    .notes =
        R"(An EXR holds four channels. coc is the diameter of the circle of confusion (CoC) in pixels, positive behind the focus.
near, focus and far are weights that sum to 1. Invalid pixels have a CoC of NaN and no weight. A .png of a weight holds
round(value × 65535). The CoC has no such range: it needs --png-scale and loses its negative values.

Give the lens by its focal length and sensor. With one of them the projection gives the other. For an orthographic
camera the CoC grows with the distance from the focus without end (telecentric). --max-coc-px ends it.

With several inputs, OUT and every FILE above are folders. The EXR channels are coc (--max-near-coc), near
(--near-alpha), disocclusion (--disocclusion), mixed (--mixed-pixels), min (--tile-min-coc) and max (--tile-max-coc).
docs/depth-of-field.md explains each mask.

Example:
  fathom dof-masks frame.exr --camera camera.json -o frame.masks.exr --focus-at 640,360 --f-stop 2.8 \
      --focal-length-mm 50 --sensor-mm 36
  fathom dof-masks frame.exr --camera camera.json -o frame.near.png --mask near --focus 7 --f-stop 2 --sensor-mm 36)",
    .configure = configure_dof_masks,
};

} // namespace fathom::cli
