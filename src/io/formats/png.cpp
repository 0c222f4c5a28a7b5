// PNG. libpng accepts files that end too early. So every chunk is checked against its own sum first, and OpenCV is given only the
// chunks that make the picture (PNG specification, section 5.3); it does not tell what the others say.
#include "codecs.hpp"

#include <opencv2/core.hpp>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

namespace fathom::io {
namespace {

constexpr std::uint64_t largest_profile = 1u << 24;                            // bytes
constexpr std::size_t png_signature = 8, png_header = png_signature + 12 + 13; // bytes; IHDR is the first chunk

Bytes deflated(View content) {
    uLongf length = compressBound(static_cast<uLong>(content.size()));
    Bytes compressed(length);
    compress(compressed.data(), &length, content.data(), static_cast<uLong>(content.size()));
    compressed.resize(length);
    return compressed;
}

/// A chunk of this type; nothing where it is empty.
Bytes png_chunk(std::string_view type, View content) {
    const std::size_t size = content.size();
    if (size == 0)
        return {};
    Bytes bytes(4 + type.size() + size + 4);
    const auto put = [&](std::size_t at, std::size_t number) {
        for (std::size_t i = 0; i < 4; ++i)
            bytes[at + i] = static_cast<unsigned char>(number >> (24 - 8 * i));
    };
    put(0, size);
    std::ranges::copy(type, bytes.begin() + 4);
    std::ranges::copy(content, bytes.begin() + 8);
    put(8 + size, crc32_z(0, bytes.data() + 4, 4 + size));
    return bytes;
}

/// Keeps the number of a text whose keyword says near or far ("Near", "zfar", "far_plane").
void read_text(std::string_view text, std::array<std::optional<double>, 2>& near_and_far) {
    std::string keyword(text.substr(0, text.find('\0')));
    std::ranges::transform(keyword, keyword.begin(),
                           [](unsigned char c) { return c | 0x20; }); // of letters the small ones
    if (keyword.size() >= text.size())
        return;
    std::istringstream number{std::string(text.substr(keyword.size() + 1))};
    number.imbue(std::locale::classic());
    double value = 0;
    if (!(number >> value) || !(number >> std::ws).eof() || keyword.find("nearest") != keyword.npos)
        return;
    for (const std::size_t i : {0, 1})
        if (keyword.find(i == 0 ? "near" : "far") != keyword.npos)
            near_and_far.at(i) = value;
}

} // namespace

PictureFile read_png(const std::filesystem::path& file, Bytes& bytes) {
    PictureFile picture;
    std::optional<double> gamma;
    bool srgb = false, has_profile = false;
    Bytes kept(bytes.begin(), bytes.begin() + png_signature);
    cv::Size size;
    std::uint64_t pixel_bits = 0, compressed = 0;
    std::string_view type;
    for (auto rest = View(bytes).subspan(png_signature); type != "IEND";) {
        const std::size_t length = rest.size() < 12 ? 0 : big_endian(rest.first(4));
        if (rest.size() < 12 || rest.size() - 12 < length)
            refuse(file, "ends in the middle of the picture; write or copy it again");
        const View chunk = rest.first(length + 12), content = chunk.subspan(8, length);
        if (crc32_z(0, chunk.data() + 4, length + 4) != big_endian(chunk.last(4)))
            refuse(file, "is damaged: a check sum of its PNG chunks does not match; write or copy it again");
        type = text_of(chunk.subspan(4, 4));
        if (type == "IHDR" && length == 13) {
            static constexpr std::uint64_t channels[] = {1, 0, 3, 1, 2, 0, 4, 0}; // by the type of colour
            const auto width = static_cast<long long>(big_endian(content.first(4))),
                       height = static_cast<long long>(big_endian(content.subspan(4, 4)));
            check_size(file, width, height);
            size = {static_cast<int>(width), static_cast<int>(height)};
            pixel_bits = content[8] * channels[content[9] % std::size(channels)];
        }
        if (type == "IDAT")
            compressed += length;
        if (type == "IHDR" || type == "PLTE" || type == "IDAT" || type == "IEND")
            kept.insert(kept.end(), chunk.begin(), chunk.end());
        srgb |= type == "sRGB";
        if (type == "gAMA" && length == 4)
            gamma = static_cast<double>(big_endian(content)) / 100000.0;
        if (type == "tEXt")
            read_text(text_of(content), picture.near_and_far);
        if (type == "eXIf")
            picture.exif.assign(content.begin(), content.end());
        if (type == "iCCP") { // a name, a zero, the method of compression
            const auto name = static_cast<std::size_t>(std::ranges::find(content, 0) - content.begin());
            if (name + 2 < content.size() && !std::exchange(has_profile, true))
                picture.icc = inflated(content.subspan(name + 2), largest_profile, MAX_WBITS);
        }
        rest = rest.subspan(chunk.size());
    }
    if (srgb)
        picture.encoding = ColorEncoding::srgb;
    else if (gamma && picture.icc.empty())
        picture.encoding = std::abs(*gamma - 1) < 0.01 ? ColorEncoding::linear : ColorEncoding::srgb;
    const bool packed = pixel_bits > 0 && pixel_bits < 8; // several pixels in a byte
    check_holds(file, size, packed ? 1 : pixel_bits / 8, compressed,
                expansion::deflate * (packed ? 8 / pixel_bits : 1));
    bytes = std::move(kept);
    picture.image = decoded(file, bytes, size);
    return picture;
}

Bytes png_bytes(const cv::Mat& bgr, const std::optional<PictureFormat>& format) {
    static constexpr std::array<unsigned char, 4> gamma_of_1{0, 1, 0x86, 0xa0}; // 100000
    static constexpr std::array<unsigned char, 1> perceptual{0};
    Bytes file = encoded(".png", bgr), more;
    if (!format)
        return file;
    if (!format->icc.empty()) {
        Bytes profile{'I', 'C', 'C', 0, 0};
        const Bytes compressed = deflated(format->icc);
        profile.insert(profile.end(), compressed.begin(), compressed.end());
        more = png_chunk("iCCP", profile);
    } else {
        more =
            format->encoding == ColorEncoding::linear ? png_chunk("gAMA", gamma_of_1) : png_chunk("sRGB", perceptual);
    }
    const Bytes exif = png_chunk("eXIf", format->exif);
    more.insert(more.end(), exif.begin(), exif.end());
    file.insert(file.begin() + png_header, more.begin(), more.end());
    return file;
}

cv::Mat png_codes(const cv::Mat& image, double scale, double offset) {
    cv::Mat codes(image.size(), CV_16UC(image.channels()));
    for (int y = 0; y < image.rows; ++y) {
        const auto* in = image.ptr<float>(y);
        std::transform(in, in + image.cols * image.channels(), codes.ptr<std::uint16_t>(y), [=](float value) {
            const double code = std::round((value * scale + offset) * 65535);
            return static_cast<std::uint16_t>(code > 0 ? std::min(code, 65535.0) : 0); // NaN: 0
        });
    }
    return codes;
}

} // namespace fathom::io
