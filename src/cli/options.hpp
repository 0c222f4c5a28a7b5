#pragma once

#include "cli/program.hpp"
#include "description/operations.hpp"
#include "shot/shot.hpp"

#include <CLI/CLI.hpp>

#include <type_traits>

namespace fathom::cli {

using namespace shot;
using nlohmann::ordered_json;

/// Begins a line of an option's meaning. Others end where they are full.
inline constexpr char new_line = '\v';

/// Refuses a value that is none of `names`, listing them.
CLI::Validator is_one_of(const std::vector<std::string>& names);

/// Refuses what is no finite number or is not accepted; `kind` says in words what is: "number above 0".
CLI::Validator is_in(const description::Range& range);

/// The pixels that an image has of the display window, in words: "4 × 3", or "4 × 3 from pixel 1,2 on".
std::string extent(const cv::Rect& data);

/// Adds an option to a group of the help. `target`: what it sets, or what is called with its text.
template <typename Target>
CLI::Option* add_option(CLI::App& app, const char* group, const std::string& name, const std::string& type,
                        Target&& target, const std::string& words) {
    CLI::Option* option;
    if constexpr (std::is_invocable_v<Target, std::string>)
        option = app.add_option_function<std::string>(name, target, words);
    else
        option = app.add_option(name, target, words);
    return option->type_name(type)->group(group);
}

/// The same of what `read` makes of its text. Where that is nothing, the option is refused, and `what` says what will do.
template <typename Target, typename Read>
CLI::Option* add_read_option(CLI::App& app, const char* group, const std::string& name, const std::string& type,
                             Target& target, const Read& read, const std::string& what, const std::string& words) {
    const auto check = [read, what](std::string& text) {
        return read(text) ? std::string() : "'" + text + "' will not do; it is " + what;
    };
    const auto set = [read, &target](const std::string& text) { target = *read(text); };
    return add_option(app, group, name, type, set, words)->check(CLI::Validator(check, ""));
}

/// The same of one that is one of a few names.
template <typename Value>
CLI::Option* add_enum_option(CLI::App& app, const char* group, const std::string& name, Value& value,
                             const std::vector<std::pair<std::string, Value>>& choices, const std::string& words) {
    std::vector<std::string> names;
    for (const auto& choice : choices)
        names.push_back(choice.first);
    const auto choose = [&value, choices](const std::string& text) {
        value = std::ranges::find(choices, text, &std::pair<std::string, Value>::first)->second;
    };
    return add_option(app, group, name, CLI::detail::join(names, "|"), choose, words)->check(is_one_of(names));
}

/// The same of one without a value. `target`: what becomes true, or what is called.
template <typename Target>
CLI::Option* add_flag(CLI::App& app, const char* group, const std::string& name, Target&& target,
                      const std::string& words) {
    if constexpr (std::is_invocable_v<Target>)
        return app.add_flag_callback(name, target, words)->group(group);
    else
        return app.add_flag(name, target, words)->group(group);
}

/// Adds the options of `DepthOptions` for what comes out.
void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product);

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description);
/// Those options of a camera that choose among the cameras of a file.
void add_import_options(CLI::App& app, CameraOption& camera);
void add_frames_option(CLI::App& app, Inputs& inputs);
void add_channel_option(CLI::App& app, std::string& channel);
void add_device_options(CLI::App& app, DeviceOption& device);

/// Adds the format of a pipe's frames, which have so many channels or more. `what` says of which frames.
void add_raw_format_option(CLI::App& app, const char* name, const io::RawFormat*& format, int least_channels,
                           const char* what);

/// The program's option for a described one: another where a hook stands for it, and none where files say it.
std::string spelled(std::string_view name);
std::string spelled(const description::Option& option);

/// What the value of an option looks like where it shares the program's option with another: "ellipse:R".
std::string value_spelled(const description::Option& option);

using SetOption = std::function<void(const description::Option&, const description::Value&)>;

/// Adds options as they are described, but for images, results, and those that the program has in another way. `set` gets values that
/// the description accepts. Options that share one of the program's are set back when another of them is given.
void add_described_options(CLI::App& app, const std::vector<description::Option>& options, const SetOption& set,
                           const std::string& group);

/// The same for a struct.
template <typename Options>
void add_described_options(CLI::App& app, Options& options, const std::vector<description::Option>& described,
                           const std::string& group) {
    add_described_options(
        app, described,
        [&options](const description::Option& option, const description::Value& value) { option.set(options, value); },
        group);
}

/// What a text gives an option; nothing if the description does not accept it.
std::optional<description::Value> parse(const description::Option& option, const std::string& text);

/// Throws: UsageError for options of an operation that exclude each other, or need another.
void check_together(const CLI::App& app, const description::Operation& operation);

} // namespace fathom::cli
