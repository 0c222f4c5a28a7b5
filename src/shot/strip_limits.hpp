#pragma once

#include <cstddef>

namespace fathom::cli {

/// How images are done that need not fit into memory.
struct StripLimits {
    std::size_t
        whole_pixels; ///< images of more are done strip by strip where their files can be; so are those beyond --memory
    std::size_t strip_bytes; ///< what the images of a strip take, if --memory says no less
};

/// The program's own; a test links others.
extern const StripLimits strip_limits;

} // namespace fathom::cli
