// fathom dof-masks
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/images.hpp"
#include "cli/options/lens.hpp"

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>

namespace fathom::cli {
namespace {

// The circle, and the weights, which go into one file. One of them alone is written by --mask.
class DofMasksTask : public OwnTask<description::DofMasksCall> {
public:
    DofMasksTask() {
        for (const description::Result& result : operation_.results_of(call_.get(), {}))
            if (result.wanted || spelled(result.name).empty())
                masks_.push_back(result.content.channels);
    }

    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_picture_options(app, picture, "a picture whose size and edges the masks are to have");
        app.get_option("--color")->required(false);
        add_option(app, "Output", "--mask", CLI::detail::join(masks_, "|"), mask_,
                   "write this mask only, to any type of file")
            ->check(is_one_of(masks_));
    }

    void prepare() override {
        for (const description::Option& option : operation_.options)
            if (option.kind == description::Kind::result && spelled(option).empty())
                operation_.set(call_.get(), option, mask_.empty() || option.name == mask_ + "_weight");
        OwnTask::prepare();
        const std::string extension = format.empty() ? extension_of(output) : format;
        Product& product = outputs.front().product;
        product.layer = "depth";
        product.channels = masks_;
        if (!mask_.empty()) {
            product.channels = {mask_};
            product.png_scale = mask_ == masks_.front() || png_scale ? png_scale : 1.0;
        } else if (extension != ".exr" && std::ranges::count(product.extensions, extension) > 0) {
            throw UsageError(fmt::format("{}: a {} holds one mask; choose it with --mask {}, or write .exr", output,
                                         extension, CLI::detail::join(masks_, "|")));
        } else {
            product.extensions = {".exr"};
        }
    }

    std::vector<Made> make(const StoredDepth& stored, Job& job) override {
        std::vector<Made> made = OwnTask::make(stored, job);
        const auto others = made.begin() + static_cast<std::ptrdiff_t>(mask_.empty()             ? masks_.size()
                                                                       : mask_ == masks_.front() ? 1
                                                                                                 : 2);
        std::vector<cv::Mat> masks;
        for (auto each = mask_.empty() ? made.begin() : others - 1; each != others; ++each)
            masks.push_back(each->image);
        cv::Mat merged;
        cv::merge(masks, merged);
        made.erase(made.begin(), others);
        made.emplace(made.begin(), merged);
        return made;
    }

    std::vector<std::string> length_doubts(const StoredDepth& stored, const Subject& subject,
                                           const Job& job) const override {
        return blur_doubts(lens_, stored, job, subject, call().options.sky, call().options.max_coc_px);
    }

private:
    std::vector<std::string> masks_;
    std::string mask_; // empty: all
};

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
    .configure = configure_own<DofMasksTask>,
};

} // namespace fathom::cli
