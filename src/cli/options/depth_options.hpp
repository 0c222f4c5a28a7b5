#pragma once

#include "cli/command.hpp"
#include "description/range.hpp"
#include "shot/options.hpp"

#include <CLI/CLI.hpp>

#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace fathom::cli {

/// Adds an option to a group of the help. `target`: what it sets, or what is called with its text or its number.
template <typename Target>
CLI::Option* add_option(CLI::App& app, const char* group, const char* name, const std::string& type, Target&& target,
                        const std::string& words) {
    CLI::Option* option;
    if constexpr (std::is_invocable_v<Target, std::string>)
        option = app.add_option_function<std::string>(name, target, words);
    else if constexpr (std::is_invocable_v<Target, double>)
        option = app.add_option_function<double>(name, target, words);
    else
        option = app.add_option(name, target, words);
    return option->type_name(type)->group(group);
}

/// Adds the options of `DepthOptions` for what comes out.
void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product);

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description);
/// Those options of a camera that choose among the cameras of a file.
void add_import_options(CLI::App& app, CameraOption& camera);
void add_channel_option(CLI::App& app, std::string& channel);
void add_device_options(CLI::App& app, DeviceOption& device);

/// Adds the format of a pipe's frames, which have so many channels or more. `what` says of which frames.
void add_raw_format_option(CLI::App& app, const char* name, const io::RawFormat*& format, int least_channels,
                           const char* what);

/// Refuses a value that is none of `names`, listing them.
CLI::Validator is_one_of(const std::vector<std::string>& names);

/// Refuses what is no finite number or is not accepted; `kind` says in words what is: "number above 0".
CLI::Validator is_in(const description::Range& range);

/// Numbers between commas; none when there are others than `count`, or one is no number or not finite.
std::vector<double> numbers_in(const std::string& text, std::size_t count);

/// The pixels that an image has of the display window, in words: "4 × 3", or "4 × 3 from pixel 1,2 on".
std::string extent(const cv::Rect& data);

/// Adds an option whose value is one of a few names.
template <typename Value>
CLI::Option* add_enum_option(CLI::App& app, const std::string& name, Value& value,
                             const std::vector<std::pair<std::string, Value>>& choices,
                             const std::string& description) {
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& choice : choices)
        names.push_back(choice.first);
    const auto choose = [&value, choices](const std::string& text) {
        for (const auto& choice : choices)
            if (choice.first == text)
                value = choice.second;
    };
    return app.add_option_function<std::string>(name, choose, description)
        ->type_name(CLI::detail::join(names, "|"))
        ->check(is_one_of(names));
}

} // namespace fathom::cli
