// Positions as a point cloud: PLY, binary, in the machine's byte order (Turk 1994).
#include "formats.hpp"

#include <opencv2/core.hpp>

#include <bit>
#include <cmath>
#include <string>

namespace fathom::io {
namespace {

template <typename Use>
void for_each_point(const cv::Mat& positions, Use use) {
    for (int y = 0; y < positions.rows; ++y)
        for (int x = 0; x < positions.cols; ++x) {
            const auto* p = positions.ptr<float>(y) + x * positions.channels();
            if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))
                use(reinterpret_cast<const unsigned char*>(p));
        }
}

} // namespace

Bytes ply_bytes(const cv::Mat& positions) {
    std::size_t count = 0;
    for_each_point(positions, [&](const unsigned char*) { ++count; });
    const std::string order = std::endian::native == std::endian::little ? "little" : "big";
    const auto header = "ply\nformat binary_" + order + "_endian 1.0\nelement vertex " + std::to_string(count) +
                        "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    Bytes bytes(header.begin(), header.end());
    bytes.reserve(header.size() + count * 3 * sizeof(float));
    for_each_point(positions, [&](const unsigned char* p) { bytes.insert(bytes.end(), p, p + 3 * sizeof(float)); });
    return bytes;
}

} // namespace fathom::io
