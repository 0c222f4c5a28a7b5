// fathom dof
#include "description/lens.hpp"

#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/lens.hpp"

#include <fathom/picture.hpp>

namespace fathom::cli {
namespace {

class DofTask : public OwnTask<description::DofCall> {
public:
    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_option(app, operation_.group, "--highlights", "X", highlights_,
                   "how many times brighter than white a white is taken to be, which\n"
                   "a photograph has cut off (" +
                       description::highlights.limits() + "; default: 1; try 1.05 for a JPEG)")
            ->check(is_in(description::highlights));
    }

    std::vector<std::string> length_doubts(const StoredDepth& stored, const Subject& subject,
                                           const Job& job) const override {
        return blur_doubts(lens_, stored, job, subject, call().options.sky, call().options.max_coc_px);
    }

protected:
    void change(Images& images) const override {
        if (highlights_ > 1) // once for each width that is tried
            images.picture.color = images.picture.color.clone();
        restore_highlights(images.picture, highlights_); // which may change from frame to frame
        restore_highlights(images.clean_plate, highlights_);
    }

private:
    double highlights_ = 1;
};

} // namespace

extern const Command dof_command{
    .name = "dof",
    .summary = description::DofCall::said.summary,
    .notes =
        R"(Light is blurred, not codes: see --color-space. The result has the picture's channels and, in a .png or .tif, its
codes: sRGB of 8 bits stay sRGB of 8 bits. A .jpg is sRGB, and .exr, .hdr, .pfm and .npy are linear floats. Invalid
pixels, and colours that are no numbers, take part in nothing. They keep the picture where no blur reaches them.

Give the lens by its focal length and sensor. With one of them the projection gives the other. The camera file may
hold both.

A clean plate is the same view without its near objects, of the same camera and size. Where it lies behind the
picture it shows what the picture hides. Where it shows the same it changes nothing.

With several inputs, OUT, every IMAGE and the clean plate's DEPTH are folders, in which each input keeps its own name.
docs/depth-of-field.md explains the method.

Example:
  fathom dof frame.exr --color frame.exr --camera camera.json -o blurred.exr --focus-at 640,360 --f-stop 2.8 \
      --focal-length-mm 50 --sensor-mm 36
  fathom dof frame.exr --color frame.png --camera camera.json -o blurred.png --focus 7 --f-stop 2 --sensor-mm 36 \
      --aperture 6 --rotation-degrees 15 --quality fast
  fathom dof depth.png --relative high-is-near --color photo.jpg -o blurred.jpg --blur-px 24 --focus-at 620,410)",
    .configure = configure_own<DofTask>,
};

} // namespace fathom::cli
