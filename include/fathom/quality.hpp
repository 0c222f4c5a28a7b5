#pragma once

namespace fathom {

/// How much work `ssao` and `dof` spend on a pixel: the first is the quickest, the last has the smallest errors.
enum class Quality { fast, balanced, accurate };

} // namespace fathom
