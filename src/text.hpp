#pragma once

#include <cmath>
#include <cstddef>
#include <locale>
#include <sstream>
#include <string>

namespace fathom {

/// One message from its parts, with the numbers of the C locale whatever the host's is. The core library does without a
/// formatting library.
template <typename... Part>
std::string text(const Part&... parts) {
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    (stream << ... << parts);
    return stream.str();
}

/// A size in a message: "640 x 480".
struct ImageSize {
    int width, height;

    friend std::ostream& operator<<(std::ostream& stream, const ImageSize& size) {
        return stream << size.width << " x " << size.height;
    }
};

/// A part of a whole: "25 %", "0.3 %".
inline std::string percent(std::size_t part, std::size_t whole) {
    const double share = 100 * static_cast<double>(part) / static_cast<double>(whole);
    if (part == 0 || share >= 1)
        return text(std::llround(share), " %");
    return share < 0.1 ? "under 0.1 %" : text(std::round(10 * share) / 10, " %");
}

} // namespace fathom
