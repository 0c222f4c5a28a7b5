#pragma once

#include "description/check.hpp"
#include "description/dof.hpp"
#include "description/dof_masks.hpp"
#include "description/fog.hpp"
#include "description/lens.hpp"
#include "description/linearize.hpp"
#include "description/normals.hpp"
#include "description/option.hpp"
#include "description/ssao.hpp"
#include "description/unproject.hpp"

#include <fathom/lens_arguments.hpp>
#include <fathom/tiles.hpp>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace fathom::description {

/// The operations, in the order of `fathom --help`.
using Calls = std::tuple<LinearizeCall, UnprojectCall, NormalsCall, SsaoCall, DofMasksCall, DofCall, FogCall>;

/// An option that was given, and its value if it is no image.
struct Given {
    const Option* option;
    std::optional<Value> value = {};
};

/// An operation for whoever calls it without knowing it.
struct Operation : Said {
    std::vector<Option> options;                     ///< images among them
    std::vector<Option> lens = {};                   ///< of the `LensArguments` that make the circle, if it takes one
    std::vector<Option> repair = {};                 ///< of the `DepthRepair` before it, if there is one
    std::shared_ptr<void> (*make)(const void* like); ///< a call, whose options are those of another, or the defaults
    std::vector<Result> (*results_of)(void*, const StoredDepth&);
    void (*run)(const void*, const StoredDepth&, const Launch&);
    Reach (*reach)(const void*, const Tile&); ///< of a call; none of one whose reach depends on what the depth shows
    /// Turns lengths in pixels into those of a frame so many times as large; none of one whose results are not averaged.
    void (*supersample)(void*, int factor) = nullptr;

    /// All of them.
    std::array<const std::vector<Option>*, 3> listed() const { return {&lens, &options, &repair}; }

    void set(void* call, const Option& option, const Value& value) const {
        option.set_field(static_cast<char*>(call) + option.offset, value);
    }
};

/// Fills in which options need and exclude others: images of one field belong together, and other fields of one variant do not, even
/// those of one name.
inline void relate(Operation& operation) {
    std::vector<Option*> all;
    for (std::vector<Option>* listed : {&operation.lens, &operation.options, &operation.repair})
        for (Option& one : *listed) {
            all.push_back(&one);
            for (const Option& other : *listed)
                if (&one != &other && one.offset == other.offset) {
                    if (one.alternative == other.alternative && one.is_image() && other.is_image())
                        one.needs.push_back(other.name);
                    else if (one.alternative != other.alternative)
                        one.excludes.push_back(other.name);
                }
        }
    const auto add = [&](const auto& relations, std::vector<std::string_view> Option::*list, bool mutual) {
        for (const Relation& relation : relations)
            for (const char* other : relation.others)
                for (Option* option : all) {
                    if (other && option->name == std::string_view(relation.option))
                        (option->*list).emplace_back(other);
                    if (other && mutual && option->name == std::string_view(other))
                        (option->*list).emplace_back(relation.option);
                }
    };
    add(operation.needing, &Option::needs, false);
    add(operation.excluding, &Option::excludes, true);
    if (!operation.lens.empty()) {
        add(lens_needing, &Option::needs, false);
        add(lens_excluding, &Option::excludes, true);
    }
    for (Option* option : all)
        option->excludes.erase(std::unique(option->excludes.begin(), option->excludes.end()), option->excludes.end());
}

/// What is wrong with options that are given together; empty if nothing is. `spelled` gives their names in messages.
inline std::string wrong_together(const Operation& operation, const std::vector<Given>& given,
                                  const std::function<std::string(const Option&)>& spelled) {
    for (const Given& one : given)
        for (const Given& other : given)
            if (one.option != other.option && std::ranges::count(one.option->excludes, other.option->name) > 0)
                return excluding(spelled(*other.option), spelled(*one.option));
    for (const auto& [option, value_given] : given) {
        std::vector<std::string> needs;
        bool has_one = option->needs.empty();
        for (const std::string_view need : option->needs) {
            const std::string_view name = need.substr(0, need.find('=')), value = need.substr(name.size());
            has_one = has_one || std::ranges::any_of(given, [&](const Given& each) {
                          return each.option->name == name &&
                                 (value.empty() ||
                                  each.option->choices()[std::get<std::size_t>(*each.value)] == value.substr(1));
                      });
            for (const std::vector<Option>* listed : operation.listed())
                if (const auto its = std::ranges::find(*listed, name, &Option::name); its != listed->end())
                    needs.push_back(text(spelled(*its), value));
        }
        if (!has_one)
            return text(spelled(*option), ": is of no use without ", in_words(needs));
    }
    return "";
}

template <typename Call>
Operation operation_of() {
    Operation made{Call::said,
                   options_of(Call{}),
                   {},
                   {},
                   [](const void* like) {
                       return std::shared_ptr<void>(like ? std::make_shared<Call>(*static_cast<const Call*>(like))
                                                         : std::make_shared<Call>());
                   },
                   [](void* call, const StoredDepth& stored) {
                       return description::results_of(*static_cast<Call*>(call), stored);
                   },
                   [](const void* call, const StoredDepth& stored, const Launch& launch) {
                       static_cast<const Call*>(call)->run(stored, launch);
                   },
                   {}};
    Call call;
    for (const Result& result : description::results_of(call, {}))
        for (Option& option : made.options)
            if (option.kind == Kind::result && option.name == std::string_view(result.name))
                option.words = result.words;
    if constexpr (requires(const Tile& tile, const Call& call) { fathom::reach(tile, call.options); })
        made.reach = [](const void* call, const Tile& tile) {
            return fathom::reach(tile, static_cast<const Call*>(call)->options);
        };
    if constexpr (requires(Call & call) { call.supersample(1); })
        made.supersample = [](void* call, int factor) { static_cast<Call*>(call)->supersample(factor); };
    if (LensArguments lens; std::ranges::count(made.options, Kind::lens, &Option::kind) > 0)
        describe(List(&lens, made.lens), lens);
    if (DepthRepair repair; made.repairs)
        describe(List(&repair, made.repair), repair);
    relate(made);
    return made;
}

/// Is it of relative depth alone?
inline bool is_of_relative(const Option& option) {
    constexpr std::string_view relative = "relative";
    return option.name == relative || std::ranges::count(option.needs, relative) > 0;
}

inline const std::vector<Operation>& operations() {
    static const auto all = std::apply(
        [](const auto&... calls) { return std::vector{operation_of<std::remove_cvref_t<decltype(calls)>>()...}; },
        Calls{});
    return all;
}

/// The operation of a call.
template <typename Call>
const Operation& operation() {
    const std::string_view name = Call::said.name; // of which each translation unit may have a copy
    return *std::ranges::find(operations(), name, &Operation::name);
}

} // namespace fathom::description
