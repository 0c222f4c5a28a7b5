#pragma once

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
#include <memory>
#include <tuple>
#include <vector>

namespace fathom::description {

/// The operations, in the order of `fathom --help`.
using Calls = std::tuple<LinearizeCall, UnprojectCall, NormalsCall, SsaoCall, DofMasksCall, DofCall, FogCall>;

/// An operation for whoever calls it without knowing it.
struct Operation : Said {
    std::vector<Option> options;                     ///< images among them
    std::vector<Option> lens = {};                   ///< of the `LensArguments` that make the circle, if it takes one
    std::shared_ptr<void> (*make)(const void* like); ///< a call, whose options are those of another, or the defaults
    std::vector<Result> (*results_of)(void*, const StoredDepth&);
    void (*run)(const void*, const StoredDepth&, const Launch&);
    Reach (*reach)(const void*, const Tile&); ///< of a call; none of one whose reach depends on what the depth shows

    void set(void* call, const Option& option, const Value& value) const {
        option.set_field(static_cast<char*>(call) + option.offset, value);
    }
};

template <typename Call>
Operation operation_of() {
    Operation made{Call::said,
                   options_of(Call{}),
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
    if (LensArguments lens; std::ranges::count(made.options, Kind::lens, &Option::kind) > 0)
        describe(List(&lens, made.lens), lens);
    return made;
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
