// fathom steady
#include "cli/options.hpp"
#include "io/floats_on_host.hpp"
#include "io/relative_input.hpp"
#include "io/replace_files.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

namespace fathom::cli {
namespace {

struct SteadyArguments {
    Inputs inputs;
    std::string output, channel;
};

int write_ranges(const SteadyArguments& options) {
    if (extension_of(options.output) != ".csv")
        throw UsageError(options.output + ": ranges are written as .csv; name it so");
    std::vector<Input> inputs = options.inputs.all();
    if (options.inputs.is_piped())
        throw UsageError(inputs.front().file + ": is a pipe, and all frames are compared; give files");
    if (const auto shots = options.inputs.shots(); shots.size() != 1 || shots.front().inputs.size() != inputs.size())
        throw UsageError(
            fmt::format("{}: is no shot of several frames, or is more than one; give the name of the frames "
                        "of one, as in shot.####.png, between quotation marks",
                        options.inputs.arguments.front()));
    std::ranges::sort(inputs, {}, &Input::frame);
    catch_interrupts();
    std::vector<ShotFrame> frames;
    std::vector<std::size_t> of_input; // which of them has its range
    for (const Input& input : inputs) {
        stop_if_interrupted();
        const cv::Mat values = io::read_relative_input(input.file, options.channel).depth.values;
        try {
            frames.push_back(shot_frame(io::on_host(values)));
        } catch (const std::invalid_argument& error) {
            complain(
                fmt::format("warning: {}: {}; it gets the range of the frame beside it", input.file, error.what()));
        }
        of_input.push_back(frames.empty() ? 0 : frames.size() - 1);
    }
    if (frames.empty())
        throw Error(inputs.front().file + ": has no depth in any frame; is it the right shot?");
    const std::vector<SteadyRange> ranges = steady_ranges(frames);
    std::string text = "frame,relative_range\n", cuts;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const auto& [least, greatest, is_first] = ranges[of_input[i]];
        text += fmt::format("{},\"{:.9g},{:.9g}\"\n", *inputs[i].frame, least, greatest);
        if (i > 0 && is_first && of_input[i] != of_input[i - 1])
            cuts += fmt::format("{}{}", cuts.empty() ? ", cuts before " : ", ", *inputs[i].frame);
    }
    io::replace_files(std::array{io::NewFile{options.output, {text.begin(), text.end()}}});
    fmt::print("{}  {} frames{}; --animate relative-range={} takes it\n", options.output, inputs.size(), cuts,
               options.output);
    return done;
}

std::function<int()> configure_steady(CLI::App& app) {
    const auto options = std::make_shared<SteadyArguments>();
    add_option(app, "Input", "DEPTH", "DEPTH", options->inputs.arguments,
               "relative depth of a shot: 'shot.####.png', or a folder of frames with numbers")
        ->required();
    add_channel_option(app, options->channel);
    add_frames_option(app, options->inputs);
    add_option(app, "Output", "-o,--output", "OUT.csv", options->output, "the ranges of all frames")->required();
    return [options] { return write_ranges(*options); };
}

} // namespace

extern const Command steady_command{
    .name = "steady",
    .summary = "Finds ranges under which relative depth of a shot does not flicker.",
    .notes =
        R"(A network that sees one frame at a time gives each a scale and an offset of its own, so that a blur by its depth
flickers. This compares the frames and writes a range for each, which --animate hands to dof and dof-masks. What keeps its
distance keeps its value then. At a cut it starts anew. Frames are compared pixel by pixel: where all of the picture moves
fast, less is certain. Nothing is steadied within a frame, such as edges that waver.

Example:
  fathom steady 'depth.####.png' -o range.csv
  fathom dof 'depth.####.png' --relative high-is-near --color 'rgb.####.jpg' -o 'blurred.####.jpg' --blur-px 24 \
      --focus-at 620,410 --animate relative-range=range.csv)",
    .configure = configure_steady,
};

} // namespace fathom::cli
