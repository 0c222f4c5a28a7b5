// Options of the program from the descriptions of the operations.
#include "described.hpp"

#include "depth_options.hpp"

#include "cli/help.hpp"

#include "terminal/exit.hpp"

#include <CLI/CLI.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace fathom::cli {
namespace {

using description::Kind;
using description::Option;
using description::Value;

std::optional<Value> read(const Option& option, const std::string& text) {
    if (double number = 0; option.kind == Kind::number && CLI::detail::lexical_cast(text, number))
        return number;
    if (option.kind == Kind::choice) {
        const auto found = std::ranges::find(option.choices, text, [](const char* name) { return std::string(name); });
        if (found != option.choices.end())
            return static_cast<std::size_t>(found - option.choices.begin());
    }
    const auto numbers = [&](std::size_t count) {
        return numbers_in(text, count);
    }; // none where they are no such numbers
    if (is_three(option.kind)) {
        if (const auto n = numbers(3); !n.empty())
            return std::array{n[0], n[1], n[2]};
    }
    if (option.kind == Kind::lens) {
        if (const auto n = numbers(2); !n.empty())
            return CircleOfConfusion{n[0], n[1]};
    }
    const auto is_index = [](double x) {
        return x == std::floor(x) && std::abs(x) <= 0x7fffffff;
    }; // negative in overscan
    if (option.kind == Kind::region) {
        if (const auto n = numbers(4); !n.empty() && std::ranges::all_of(n, is_index))
            return Region{static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]),
                          static_cast<int>(n[3])};
    }
    if (option.kind == Kind::pixel || option.kind == Kind::ray) {
        const bool has_distance = option.kind == Kind::ray;
        const auto n = numbers(has_distance ? 3 : 2);
        if (n.empty() || !is_index(n[0]) || !is_index(n[1]))
            return std::nullopt;
        const LensArguments::Pixel pixel{static_cast<int>(n[0]), static_cast<int>(n[1])};
        return has_distance ? Value(LensArguments::AlongRay{pixel, n[2]}) : Value(pixel);
    }
    return std::nullopt;
}

using Options = std::vector<Option>; // of one name, which exclude each other

const Option* option_for(const Options& options, const std::string& text) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return parse(one, text).has_value(); });
    return its == options.end() ? nullptr : &*its;
}

std::string type_name(const Option& option) {
    static const std::map<Kind, const char*> types{
        {Kind::point, "X,Y,Z"}, {Kind::color, "R,G,B"}, {Kind::direction, "X,Y,Z"}, {Kind::pixel, "X,Y"},
        {Kind::ray, "X,Y,D"},   {Kind::lens, "K,G"},    {Kind::region, "X,Y,W,H"}};
    if (option.kind == Kind::choice)
        return fmt::format("{}", fmt::join(option.choices, "|"));
    if (const auto type = types.find(option.kind); type != types.end())
        return type->second;
    return option.is_whole() ? "N" : option.range.infinite ? "X|inf" : "X";
}

std::string refusal(const Options& options, const std::string& text) {
    const Option& option = options.front();
    if (option_for(options, text))
        return "";
    if (options.size() > 1)
        return fmt::format("'{}' will not do; it is {}, or {}", text, option.accepted(), options[1].accepted());
    if (option.kind == Kind::choice)
        return fmt::format("'{}' is unknown; it is {}", text, option.accepted());
    double number = 0;
    const bool is_number = option.kind == Kind::number && CLI::detail::lexical_cast(text, number);
    const bool has_parts = (option.kind >= Kind::point && option.kind <= Kind::lens) || option.kind == Kind::region;
    return fmt::format("'{}' will not do; it is {}{}", text, has_parts ? type_name(option) + ": " : "",
                       is_number ? option.range.instead_of(number) : option.accepted());
}

std::string meaning(const Option& option) {
    std::string more = option.kind == Kind::number ? option.range.limits() : "";
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
                           const std::string& group, std::initializer_list<std::string_view> otherwise) {
    std::vector<Options> named;
    for (const Option& option : options) {
        if ((option.kind >= Kind::result && option.kind != Kind::region) || spelled(option.name).empty() ||
            std::ranges::find(otherwise, std::string_view(option.name)) != otherwise.end())
            continue;
        if (named.empty() || std::string_view(named.back().front().name) != option.name)
            named.emplace_back();
        named.back().push_back(option);
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
    for (const std::vector<Option>* listed : {&operation.lens, &operation.options})
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

std::string described_words(const std::vector<Option>& options, const std::string& option, const std::string& more) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return spelled(one) == option; });
    return its->words + more;
}

void add_result_options(CLI::App& app, const description::Operation& operation,
                        std::map<std::string, std::string>& files) {
    for (const Option& option : operation.options)
        if (option.kind == Kind::result && !spelled(option.name).empty())
            app.add_option_function<std::string>(
                   spelled(option.name),
                   [&files, name = std::string(option.name)](const std::string& file) { files[name] = file; },
                   fmt::format("also write {}", option.words))
                ->type_name("FILE")
                ->group("Output");
}

} // namespace fathom::cli
