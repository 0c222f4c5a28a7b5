// Options of the program from the descriptions of the operations.
#include "described.hpp"

#include <CLI/CLI.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>

namespace fathom::cli {
namespace {

using description::Option;
using description::Value;

constexpr std::size_t help_columns = 66; // of an option's meaning

std::optional<Value> read(const Option& option, const std::string& text) {
    if (double number = 0; option.kind == Option::Kind::number && CLI::detail::lexical_cast(text, number))
        return number;
    if (option.kind == Option::Kind::choice) {
        const auto found = std::ranges::find(option.choices, text, [](const char* name) { return std::string(name); });
        if (found != option.choices.end())
            return static_cast<std::size_t>(found - option.choices.begin());
    }
    if (option.kind == Option::Kind::three) {
        const std::vector<std::string> parts = CLI::detail::split(text, ',');
        std::array<double, 3> numbers{};
        bool good = parts.size() == numbers.size();
        for (std::size_t i = 0; good && i < numbers.size(); ++i)
            good = CLI::detail::lexical_cast(parts[i], numbers[i]);
        if (good)
            return numbers;
    }
    return std::nullopt;
}

using Options = std::vector<Option>; // of one name, which exclude each other

const Option* option_for(const Options& options, const std::string& text) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return parse(one, text).has_value(); });
    return its == options.end() ? nullptr : &*its;
}

std::string type_name(const Option& option) {
    if (option.kind == Option::Kind::choice)
        return fmt::format("{}", fmt::join(option.choices, "|"));
    if (option.kind == Option::Kind::three)
        return option.three == description::Three::color ? "R,G,B" : "X,Y,Z";
    return option.range.whole || option.range.few[0] ? "N" : option.range.infinite ? "X|inf" : "X";
}

std::string refusal(const Options& options, const std::string& text) {
    const Option& option = options.front();
    if (option_for(options, text))
        return "";
    if (options.size() > 1)
        return fmt::format("'{}' will not do; it is {}, or {}", text, option.accepted(), options[1].accepted());
    if (option.kind == Option::Kind::choice)
        return fmt::format("'{}' is unknown; it is {}", text, option.accepted());
    if (option.kind == Option::Kind::three)
        return fmt::format("'{}' will not do; it is three numbers {}{}", text, type_name(option),
                           option.three == description::Three::direction ? ", one of which is not 0" : "");
    double number = 0;
    const bool is_number = option.kind == Option::Kind::number && CLI::detail::lexical_cast(text, number);
    return fmt::format("'{}' will not do; it is {}", text,
                       is_number ? option.range.instead_of(number) : option.accepted());
}

std::string wrapped(const std::string& text) {
    std::string lines;
    std::size_t column = 0;
    for (const std::string& word : CLI::detail::split(text, ' ')) {
        const bool fits = column + 1 + word.size() <= help_columns;
        lines += column == 0 ? "" : fits ? " " : "\n";
        column = column > 0 && fits ? column + 1 + word.size() : word.size();
        lines += word;
    }
    return lines;
}

std::string meaning(const Option& option) {
    std::string more = option.kind == Option::Kind::number ? option.range.limits() : "";
    if (option.by_default)
        more += (more.empty() ? "default: " : "; default: ") + *option.by_default;
    const std::string text = more.empty() ? option.words : fmt::format("{} ({})", option.words, more);
    return wrapped(text);
}

CLI::Option* add(CLI::App& app, const Options& options, const SetOption& set) {
    const Option& option = options.front();
    const std::string name = spelled(option.name);
    std::string types, words = meaning(option);
    for (const Option& one : options) {
        types += (types.empty() ? "" : "|") + type_name(one);
        if (&one != &option)
            words += "\n" + wrapped(fmt::format("{}: {}", type_name(one), one.words));
    }
    if (option.kind == Option::Kind::flag)
        return app.add_flag_callback(
            name, [option, set] { set(option, true); }, words);
    CLI::Option* added =
        app.add_option_function<std::string>(
               name,
               [options, set](const std::string& text) {
                   const Option& its = *option_for(options, text);
                   set(its, *parse(its, text));
               },
               words)
            ->type_name(types)
            ->check(CLI::Validator([options](std::string& text) { return refusal(options, text); }, ""));
    return option.by_default ? added : added->required();
}

} // namespace

std::optional<Value> parse(const Option& option, const std::string& text) {
    const std::optional<Value> value = read(option, text);
    return value && option.accepts(*value) ? value : std::nullopt;
}

std::string spelled(std::string_view named) {
    static const std::map<std::string_view, std::string> others{
        {"alpha", ""},       {"channels", ""},     {"blades", "--aperture"}, {"ratio", "--aperture"},
        {"near_weight", ""}, {"focus_weight", ""}, {"far_weight", ""},       {"as_", "--as"}};
    if (const auto other = others.find(named); other != others.end())
        return other->second;
    std::string name = "--" + std::string(named);
    std::ranges::replace(name, '_', '-');
    return name;
}

std::string spelled(const Option& option) {
    if (option.kind == Option::Kind::depth && option.alternative && spelled(option.name) == "--thickness")
        return "--back-depth";
    return spelled(option.name) + (option.kind == Option::Kind::lengths ? "-map" : "");
}

void add_described_options(CLI::App& app, const std::vector<Option>& options, const SetOption& set,
                           const std::string& group, std::initializer_list<std::string_view> otherwise) {
    std::vector<Options> named;
    for (const Option& option : options) {
        if (option.kind >= Option::Kind::result || spelled(option.name).empty() ||
            std::ranges::find(otherwise, std::string_view(option.name)) != otherwise.end())
            continue;
        if (named.empty() || std::string_view(named.back().front().name) != option.name)
            named.emplace_back();
        named.back().push_back(option);
    }
    std::vector<CLI::Option*> added;
    for (const Options& own : named) {
        added.push_back(add(app, own, set)->group(group));
        for (std::size_t i = 0; i + 1 < added.size(); ++i)
            if (own.front().excludes(named[i].front()))
                added.back()->excludes(added[i]);
    }
}

std::string described_words(const std::vector<Option>& options, const std::string& option, const std::string& more) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return spelled(one) == option; });
    return wrapped(its->words + more);
}

void add_result_options(CLI::App& app, const description::Operation& operation,
                        std::map<std::string, std::string>& files) {
    for (const Option& option : operation.options)
        if (option.kind == Option::Kind::result && !spelled(option.name).empty())
            app.add_option_function<std::string>(
                   spelled(option.name),
                   [&files, name = std::string(option.name)](const std::string& file) { files[name] = file; },
                   wrapped(fmt::format("also write {}", option.words)))
                ->type_name("FILE")
                ->group("Output");
}

} // namespace fathom::cli
