#pragma once

#include "description/operations.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

/// The program's option for a described one: another where a hook stands for it, and none where files say it.
std::string spelled(std::string_view name);
std::string spelled(const description::Option& option);

/// What the value of an option looks like where it shares the program's option with another: "ellipse:R".
std::string value_spelled(const description::Option& option);

/// What a text gives an option; nothing if the description does not accept it.
std::optional<description::Value> parse(const description::Option& option, const std::string& text);

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

/// Throws: UsageError for options of an operation that exclude each other, or need another.
void check_together(const CLI::App& app, const description::Operation& operation);

} // namespace fathom::cli
