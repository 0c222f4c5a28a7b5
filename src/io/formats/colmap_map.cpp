// COLMAP's depth and normal maps, *.geometric.bin and *.photometric.bin: "WIDTH&HEIGHT&CHANNELS&", then little-endian floats,
// row by row, one channel after the other. Source: COLMAP, src/colmap/mvs/mat.h.
#include "io/formats.hpp"

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string_view>

namespace fathom::io {

std::optional<cv::Mat> read_colmap_map(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::array<long long, 3> sizes{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (long long& size : sizes) {
        const auto [next, error] = std::from_chars(at, end, size);
        if (error != std::errc() || next == end || *next != '&' || size < 0)
            return std::nullopt;
        at = next + 1;
    }
    const auto [width, height, channels] = sizes;
    check_size(file, width, height);
    if (channels != 1 && channels != 3)
        refuse(file,
               "is a map of COLMAP with " + std::to_string(channels) + " channels; depth has 1, and normals have 3");
    const cv::Size size(static_cast<int>(width), static_cast<int>(height));
    const std::size_t plane_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4;
    const std::size_t there = static_cast<std::size_t>(end - at),
                      needed = plane_bytes * static_cast<std::size_t>(channels);
    if (there != needed)
        refuse(file, (there < needed ? "ends too early: " : "is damaged: ") + described(size) + " pixels have " +
                         std::to_string(needed) + " bytes, and it has " + std::to_string(there) +
                         "; write or copy it again");
    std::vector<cv::Mat> planes;
    for (long long c = 0; c < channels; ++c, at += plane_bytes) {
        cv::Mat& plane = planes.emplace_back(size, CV_32FC1);
        std::memcpy(plane.data, at, plane_bytes);
        for (std::size_t i = 0; i < plane_bytes && !is_little_endian; i += 4)
            std::reverse(plane.data + i, plane.data + i + 4);
    }
    std::ranges::reverse(planes); // x, y, z in OpenCV's order
    cv::Mat image;
    cv::merge(planes, image);
    return image;
}

} // namespace fathom::io
