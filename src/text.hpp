#pragma once

#include <sstream>
#include <string>

namespace fathom {

/// One message from its parts. The core library does without a formatting library.
template <typename... Part>
std::string text(const Part&... parts) {
    std::ostringstream stream;
    (stream << ... << parts);
    return stream.str();
}

} // namespace fathom
