// Options of the program from the descriptions of the operations.
#include "described.hpp"

#include "depth_options.hpp"

#include "cli/command.hpp"
#include "terminal/exit.hpp"

#include <CLI/CLI.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>

namespace fathom::cli {
namespace {

using description::Kind;
using description::Option;
using description::Value;

std::optional<Value> read(const Option& option, std::string text) {
    const std::string shared = value_spelled(option), before = shared.substr(0, shared.find(':') + 1);
    if (!text.starts_with(before))
        return std::nullopt;
    text.erase(0, before.size());
    if (shared.starts_with(text + "|")) // the word for none
        text = "0";
    if (double number = 0; option.kind == Kind::number && CLI::detail::lexical_cast(text, number))
        return number;
    const auto found = std::ranges::find(option.choices(), text, [](const char* name) { return std::string(name); });
    if (found != option.choices().end())
        return static_cast<std::size_t>(found - option.choices().begin());
    return value_of(option.kind, numbers_in(text, said_of(option.kind).count()));
}

using Options = std::vector<Option>; // of one name in the program, which exclude each other

const Option* option_for(const Options& options, const std::string& text) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return parse(one, text).has_value(); });
    return its == options.end() ? nullptr : &*its;
}

std::string type_name(const Option& option) {
    if (const std::string shared = value_spelled(option); !shared.empty())
        return shared;
    if (option.kind == Kind::choice)
        return fmt::format("{}", fmt::join(option.choices(), "|"));
    if (const char* parts = said_of(option.kind).parts; *parts)
        return parts;
    return option.is_whole() ? "N" : option.range.infinite ? "X|inf" : "X";
}

// "ellipse:R: " of what shares the program's option.
std::string prefix(const Option& option) {
    const std::string shared = value_spelled(option);
    return shared.empty() ? "" : shared + ": ";
}

std::string refusal(const Options& options, const std::string& text) {
    const Option& option = options.front();
    if (option_for(options, text))
        return "";
    if (options.size() > 1)
        return fmt::format("'{}' will not do; it is {}{}, or {}{}", text, prefix(option), option.accepted(),
                           prefix(options[1]), options[1].accepted());
    if (option.kind == Kind::choice)
        return fmt::format("'{}' is unknown; it is {}", text, option.accepted());
    double number = 0;
    CLI::detail::lexical_cast(text, number);
    return fmt::format("'{}' will not do; it is {}{}", text,
                       said_of(option.kind).count() > 0 ? type_name(option) + ": " : "", option.instead_of(number));
}

std::string meaning(const Option& option) {
    std::string more = option.limits();
    if (!option.required)
        more += (more.empty() ? "default: " : "; default: ") + option.default_in_words();
    return more.empty() ? option.words : fmt::format("{} ({})", option.words, more);
}

CLI::Option* add(CLI::App& app, const Options& options, const SetOption& set) {
    const Option& option = options.front();
    const std::string name = spelled(option.name);
    std::string types, words = meaning(option);
    for (const Option& one : options) {
        types += (types.empty() ? "" : "|") + type_name(one);
        if (&one != &option)
            words += fmt::format("{}{}: {}", new_line, type_name(one), one.words);
    }
    if (option.kind == Kind::flag)
        return app.add_flag_function(
            name, [option, set](std::int64_t yes) { set(option, yes > 0); }, words);
    CLI::Option* added =
        app.add_option_function<std::string>(
               name,
               [options, set](const std::string& text) {
                   const Option& its = *option_for(options, text);
                   for (const Option& other : options)
                       if (other.offset != its.offset)
                           set(other, *other.by_default);
                   set(its, *parse(its, text));
               },
               words)
            ->type_name(types)
            ->check(CLI::Validator([options](std::string& text) { return refusal(options, text); }, ""));
    return added->required(option.required);
}

} // namespace

std::optional<Value> parse(const Option& option, const std::string& text) {
    const std::optional<Value> value = read(option, text);
    return value && option.accepts(*value) ? value : std::nullopt;
}

std::string spelled(std::string_view named) {
    static const std::map<std::string_view, std::string> others{
        {"alpha", ""},       {"channels", ""},     {"blades", "--aperture"}, {"ratio", "--aperture"},
        {"near_weight", ""}, {"focus_weight", ""}, {"far_weight", ""}};
    if (const auto other = others.find(named); other != others.end())
        return other->second;
    std::string name = "--" + std::string(named);
    std::ranges::replace(name, '_', '-');
    return name;
}

std::string spelled(const Option& option) {
    if (option.kind == Kind::depth && option.alternative && spelled(option.name) == "--thickness")
        return "--back-depth";
    return spelled(option.name) + (option.kind == Kind::lengths ? "-map" : "");
}

std::string value_spelled(const Option& option) {
    const std::string_view name = option.name;
    return name == "blades" ? "circle|N" : name == "ratio" ? "ellipse:R" : "";
}

void add_described_options(CLI::App& app, const std::vector<Option>& options, const SetOption& set,
                           const std::string& group) {
    std::vector<Options> named;
    for (const Option& option : options) {
        const std::string name = spelled(option.name);
        if (option.kind >= Kind::result || name.empty())
            continue;
        const auto same = std::ranges::find(named, name, [](const Options& own) { return spelled(own.front().name); });
        (same == named.end() ? named.emplace_back() : *same).push_back(option);
    }
    for (const Options& own : named)
        add(app, own, set)->group(group);
}

void check_together(const CLI::App& app, const description::Operation& operation) {
    std::vector<description::Given> given;
    const auto is_given = [&](std::string_view name) {
        const CLI::Option* added = name.empty() ? nullptr : app.get_option_no_throw(std::string(name));
        return added && added->count() > 0;
    };
    for (const std::vector<Option>* listed : operation.listed())
        for (const Option& option : *listed) {
            const std::string name = spelled(option);
            if (std::ranges::any_of(given, [&](const auto& each) { return spelled(*each.option) == name; }))
                continue; // which takes the values of several
            const bool in_file = option.kind == Kind::depth && !option.needs.empty(); // of the image that it belongs to
            if (!is_given(name) && !(in_file && is_given(spelled(option.needs.front()))))
                continue;
            const CLI::Option* own = app.get_option(name);
            given.push_back({&option, own->count() > 0 ? parse(option, own->as<std::string>()) : std::nullopt});
        }
    const std::string wrong = wrong_together(operation, given, [](const Option& option) { return spelled(option); });
    if (!wrong.empty())
        throw UsageError(wrong);
}

} // namespace fathom::cli
