// The program that does every image strip by strip which it can, in strips of a few rows.
#include "shot/strip_limits.hpp"

namespace fathom::cli {

const StripLimits strip_limits{.whole_pixels = 0, .strip_bytes = 16 << 10};

} // namespace fathom::cli
