#pragma once

#include <csetjmp>

namespace fathom::io {

/// Where the errors of libpng and libjpeg come back to.
struct Jump {
    std::jmp_buf place;
};

/// Whether calls of a C library came to their end. It leaves them by longjmp where it fails, so nothing that lives in
/// `calls` at that time may have a destructor.
template <typename Calls>
bool complete(Jump& jump, const Calls& calls) {
    if (setjmp(jump.place) != 0)
        return false;
    calls();
    return true;
}

} // namespace fathom::io
