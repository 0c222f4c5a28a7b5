#pragma once

#include "description/range.hpp"

#include <fathom/linearize.hpp>

/// What a photograph's blur takes beside the options of `dof`: `restore_highlights` and `grow_foreground`.
namespace fathom::description {

inline constexpr Range highlights = from(1);
inline constexpr Range grown_pixels = whole(0, most_grown_pixels);

} // namespace fathom::description
