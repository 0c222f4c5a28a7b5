// When images are done strip by strip: beyond frames of 8K, and so that gigapixels need no more memory than such a frame.
#include "strip_limits.hpp"

namespace fathom::cli {

const StripLimits strip_limits{.whole_pixels = std::size_t{1} << 25, .strip_bytes = std::size_t{64} << 20};

} // namespace fathom::cli
