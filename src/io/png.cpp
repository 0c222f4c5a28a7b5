// PNG. libpng accepts files that end too early and prints on stderr. So every chunk is checked against its own sum
// first, and libpng is given only the chunks that make the picture (PNG specification, section 5.3).
#include "formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace fathom::io {
namespace {

constexpr std::array<unsigned char, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

std::uint32_t big_endian(std::span<const unsigned char> b) {
    return std::uint32_t{b[0]} << 24 | std::uint32_t{b[1]} << 16 | std::uint32_t{b[2]} << 8 | b[3];
}

} // namespace

std::optional<cv::Mat> read_png(const std::filesystem::path& file, const Bytes& bytes) {
    if (bytes.size() < signature.size() || !std::equal(signature.begin(), signature.end(), bytes.begin()))
        return std::nullopt;

    Bytes picture(signature.begin(), signature.end());
    picture.reserve(bytes.size());
    std::string_view type;
    auto rest = std::span(bytes).subspan(signature.size());
    while (type != "IEND") {
        const std::size_t length = rest.size() < 12 ? 0 : big_endian(rest);
        if (rest.size() < 12 || rest.size() - 12 < length)
            refuse(file, "ends in the middle of the picture; write or copy it again");
        const auto chunk = rest.first(length + 12);
        if (crc32_z(0, chunk.data() + 4, length + 4) != big_endian(chunk.last(4)))
            refuse(file, "is damaged: a check sum of its PNG chunks does not match; write or copy it again");
        type = {reinterpret_cast<const char*>(chunk.data()) + 4, 4};
        if (type == "IHDR" && length == 13)
            check_size(file, big_endian(chunk.subspan(8)), big_endian(chunk.subspan(12)));
        if (type == "IHDR" || type == "PLTE" || type == "IDAT" || type == "IEND")
            picture.insert(picture.end(), chunk.begin(), chunk.end());
        rest = rest.subspan(chunk.size());
    }
    return decode_with_opencv(file, picture);
}

Bytes png_bytes(const cv::Mat& image, double scale, double offset) {
    cv::Mat codes(image.size(), CV_16UC(image.channels()));
    for (int y = 0; y < image.rows; ++y) {
        const auto* in = image.ptr<float>(y);
        std::transform(in, in + image.cols * image.channels(), codes.ptr<std::uint16_t>(y), [=](float value) {
            const double code = std::round((value * scale + offset) * 65535);
            return static_cast<std::uint16_t>(code > 0 ? std::min(code, 65535.0) : 0); // NaN: 0
        });
    }
    Bytes bytes;
    if (!cv::imencode(".png", swap_red_and_blue(codes), bytes))
        throw Error("OpenCV cannot write a PNG");
    return bytes;
}

} // namespace fathom::io
