#pragma once

#include "description/operations.hpp"

#include <functional>
#include <initializer_list>
#include <map>
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

/// Adds options as they are described, but for results, and for those that the program has in another way. `set` gets values that the
/// description accepts.
void add_described_options(CLI::App& app, const std::vector<description::Option>& options, const SetOption& set,
                           const std::string& group, std::initializer_list<std::string_view> otherwise);

/// The same for a struct, whose values are the defaults.
template <typename Options>
void add_described_options(CLI::App& app, Options& options, const std::string& group,
                           std::initializer_list<std::string_view> otherwise = {}) {
    add_described_options(
        app, description::options_of(options),
        [&options](const description::Option& option, const description::Value& value) { option.set(options, value); },
        group, otherwise);
}

/// Throws: UsageError for options of an operation that exclude each other, or need another.
void check_together(const CLI::App& app, const description::Operation& operation);

/// What the description says of an option that the program has in its own way, then `more`.
std::string described_words(const std::vector<description::Option>& options, const std::string& option,
                            const std::string& more = "");

/// Adds an option for each result that may be asked for beside the first one: the file that it goes to, by its name.
void add_result_options(CLI::App& app, const description::Operation& operation,
                        std::map<std::string, std::string>& files);

} // namespace fathom::cli
