#pragma once

namespace fathom {
#pragma GCC visibility push(default)

/// How much work `ssao` and `dof` spend on a pixel: the first is the quickest, the last has the smallest errors.
enum class Quality { fast, balanced, accurate };

#pragma GCC visibility pop
} // namespace fathom
