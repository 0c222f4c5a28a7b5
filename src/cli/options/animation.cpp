// --animate. An animated option is given anew for each frame, as if it stood on a command line of its own.
#include "animation.hpp"

#include "cli/command.hpp"
#include "sequence/frame_values.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>

namespace fathom::cli {
namespace {

void give(CLI::Option& option, const std::string& value) {
    option.clear();
    option.add_result(value);
    option.run_callback();
}

// What an operation computes may change. Which files there are, and how they are read, may not: --relative-range and
// --focus-range change the depth as it is read.
bool can_change(const CLI::Option& option) {
    const auto is_one = [](const std::string& name, const std::vector<std::string>& names) {
        return std::ranges::find(names, name) != names.end();
    };
    return option.get_expected_max() == 1 && !option.get_positional() &&
           (option.get_name() == "--blur-px" ||
            !is_one(option.get_group(), {"Input", "Picture", "Distance", "Positions", "Frames", "Output", "Report",
                                         "Device", "Relative depth", "Options"}));
}

CLI::Option& option_called(CLI::App& app, const std::string& name) {
    std::vector<std::string> known;
    for (CLI::Option* option : app.get_options())
        if (can_change(*option)) {
            known.push_back(option->get_name().substr(2));
            if (known.back() == name)
                return *option;
        }
    if (known.empty())
        throw UsageError(
            fmt::format("--animate: {} has no option that changes from frame to frame; leave it out", app.get_name()));
    const std::string meant = nearest(name, known);
    throw UsageError(fmt::format("--animate: '{}' is no option that changes from frame to frame; {}", name,
                                 meant.empty() ? "it is " + one_of(known) : "did you mean " + meant + "?"));
}

Animation animation_of(CLI::App& app, const std::string& text) {
    const std::size_t sign = text.find('=');
    std::string name = text.substr(0, sign);
    name.erase(0, std::min(name.find_first_not_of('-'), name.size()));
    if (sign == std::string::npos || name.empty() || sign + 1 == text.size())
        throw UsageError("--animate: '" + text + "' will not do; it is NAME=FILE, as in focus=focus.csv");
    std::ranges::replace(name, '_', '-');
    CLI::Option& option = option_called(app, name);
    if (option.count() > 0)
        throw UsageError(fmt::format("--animate: {} is given already; give it once", option.get_name()));
    const std::string file = text.substr(sign + 1);
    Animation animation{.option = option.get_name(),
                        .file = file,
                        .values = sequence::read_frame_values(file, name),
                        .give = [&option](const std::string& value) { give(option, value); }};
    for (const auto& [frame, value] : animation.values)
        try {
            animation.give(value);
        } catch (const CLI::ParseError& error) {
            throw Error(fmt::format("{}: frame {}: {}", file, frame, error.what()));
        }
    animation.give(animation.values.begin()->second); // until the first frame says otherwise
    return animation;
}

} // namespace

void add_animate_options(CLI::App& app, DepthOptions& options) {
    CLI::Option* const animate =
        app.add_option_function<std::vector<std::string>>(
               "--animate",
               [&app, &options](const std::vector<std::string>& all) {
                   for (const std::string& each : all)
                       options.animations.push_back(animation_of(app, each));
               },
               "an option whose value changes: FILE holds a line\nFRAME,VALUE for each frame, or JSON "
               "(docs/sequences.md)")
            ->type_name("NAME=FILE")
            ->allow_extra_args(false)
            ->group("Frames");
    app.add_flag("--interpolate", options.interpolate, "fills the frames between two lines of --animate, evenly")
        ->needs(animate)
        ->group("Frames");
}

} // namespace fathom::cli
