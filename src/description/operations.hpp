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

#include <string>
#include <vector>

namespace fathom::description {

/// An operation with all of its options.
struct Operation {
    const char* name;
    const char* summary;
    std::vector<Option> options;
};

/// The seven operations, in the order of `fathom --help`.
inline std::vector<Operation> operations() {
    const auto with_lens = [](std::vector<Option> options) {
        std::vector<Option> lens;
        Lens defaults{.f_stop = 0, .focus = 0};
        describe_lens(List(&defaults, lens), defaults);
        lens.insert(lens.end(), options.begin(), options.end());
        return lens;
    };
    return {
        {"linearize", linearize_summary, options_of(LinearizeOptions{})},
        {"unproject", unproject_summary, options_of(UnprojectOptions{})},
        {"normals", normals_summary, options_of(NormalsOptions{})},
        {"ssao", ssao_summary, options_of(SsaoArguments{})},
        {"dof_masks", dof_masks_summary, with_lens(options_of(DofMasksOptions{}))},
        {"dof", dof_summary, with_lens(options_of(DofOptions{}))},
        {"fog", fog_summary, options_of(FogOptions{.density = 0})},
    };
}

} // namespace fathom::description
