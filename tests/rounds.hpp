#pragma once

#include "description/operations.hpp"

#include <fathom/fathom.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

/// Options of any operation that is described, in four rounds.
namespace fathom::rounds {

inline constexpr double most_coc = 12;
inline constexpr double as_it_is = std::numeric_limits<double>::quiet_NaN();

/// What numbers are set to: in turn, one value for each round. Others are 0.3, or above their least, in one of them, and 0.1 in
/// the rest if they have no default.
inline const std::map<std::string, std::array<double, 3>> numbers{
    {"slices", {as_it_is, 2, as_it_is}},
    {"samples", {as_it_is, 5, as_it_is}},
    {"growth", {as_it_is, 8, as_it_is}},
    {"jitter", {as_it_is, as_it_is, 4}},
    {"thickness", {as_it_is, 0.1, std::numeric_limits<double>::infinity()}},
    {"tolerance", {as_it_is, 2, as_it_is}},
    {"seed", {as_it_is, 9, as_it_is}},
    {"noise", {as_it_is, as_it_is, 1e-3}},
    {"channels", {as_it_is, 4, as_it_is}},
    {"transition_px", {as_it_is, 0, 2}},
    {"tile_px", {as_it_is, 7, as_it_is}},
    {"blades", {as_it_is, 5, as_it_is}},
    {"rotation_degrees", {as_it_is, 20, as_it_is}},
    {"ratio", {as_it_is, as_it_is, 1.5}},
    {"start", {as_it_is, 2, as_it_is}},
    {"max_opacity", {as_it_is, as_it_is, 0.5}},
};

/// Sets options to those of one of four rounds: as they are, with every result; then so that three rounds have each choice of
/// each option.
template <typename Set>
void set(const std::vector<description::Option>& all, std::size_t round, const Set& set) {
    using description::Option;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Option& option = all[i];
        if (std::string(option.name) == "max_error") // stands for one of the methods
            continue;
        if (option.kind == description::Kind::result)
            set(option, round == 0 || (round + i) % 2 == 0);
        else if (option.kind == description::Kind::number) {
            const auto known = numbers.find(option.name);
            if (option.name == std::string("max_coc_px")) // the reach follows from it
                set(option, most_coc);
            else if (known == numbers.end() && (round == 2 || option.required))
                set(option, option.range.holds(0.1) ? (round == 2 ? 0.3 : 0.1) : option.range.least + 1);
            else if (known != numbers.end() && round > 0 && !std::isnan(known->second[round - 1]))
                set(option, known->second[round - 1]);
        } else if (option.kind == description::Kind::choice && round > 0)
            set(option, (round - 1 + i) % option.choices().size());
        else if (option.kind == description::Kind::flag && round > 1)
            set(option, round == 2);
        else if (option.kind >= description::Kind::point && option.kind <= description::Kind::direction && round > 1)
            set(option, std::array{0.1, 0.9, 0.2});
    }
}

/// A call of an operation with the options of a round, and what it cannot do without.
inline std::shared_ptr<void> call_of(const description::Operation& operation, std::size_t round, const Image& color,
                                     const CircleOfConfusion& lens, double radius) {
    const std::shared_ptr<void> call = operation.make(nullptr);
    const auto give = [&](const description::Option& option, const description::Value& value) {
        operation.set(call.get(), option, value);
    };
    set(operation.options, round, give);
    for (const description::Option& option : operation.options)
        if (option.name == std::string_view("color"))
            give(option, color);
        else if (option.name == std::string_view("radius"))
            give(option, radius);
        else if (option.kind == description::Kind::lens)
            give(option, lens);
    return call;
}

/// Gives a call an image for each result that it is asked for, and returns those results.
inline std::vector<description::Result> with_images(const description::Operation& operation, void* call,
                                                    const StoredDepth& stored,
                                                    const std::function<Image(const description::Shape&)>& make) {
    std::vector<description::Result> results = operation.results_of(call, stored);
    std::erase_if(results, [](const description::Result& result) { return !result.wanted; });
    for (const description::Result& result : results)
        *result.image = make(result.shape);
    return results;
}

} // namespace fathom::rounds
