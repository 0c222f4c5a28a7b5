// PNG. libpng accepts files that end too early and prints on stderr. So every chunk is checked against its own sum
// first, and libpng is given only the chunks that make the picture (PNG specification, section 5.3).
#include "metadata.hpp"

#include "io/formats.hpp"

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

/// What a compressed chunk holds; nothing where it is damaged or larger than any profile.
Bytes inflated(View compressed) {
    constexpr std::size_t largest = 1u << 24;
    for (std::size_t size = 4 * compressed.size() + 1024; size <= largest; size *= 4) {
        Bytes content(size);
        uLongf length = size;
        const int result =
            uncompress(content.data(), &length, compressed.data(), static_cast<uLong>(compressed.size()));
        content.resize(length);
        if (result == Z_OK)
            return content;
        if (result != Z_BUF_ERROR)
            break;
    }
    return {};
}

Bytes deflated(View content) {
    uLongf length = compressBound(static_cast<uLong>(content.size()));
    Bytes compressed(length);
    compress(compressed.data(), &length, content.data(), static_cast<uLong>(content.size()));
    compressed.resize(length);
    return compressed;
}

void append_chunk(Bytes& file, std::string_view type, View content) {
    const auto number = [&](std::size_t value) {
        for (const int shift : {24, 16, 8, 0})
            file.push_back(static_cast<unsigned char>(value >> shift));
    };
    number(content.size());
    const std::size_t from = file.size();
    file.insert(file.end(), type.begin(), type.end());
    file.insert(file.end(), content.begin(), content.end());
    number(crc32_z(0, file.data() + from, file.size() - from));
}

} // namespace

void read_png_metadata(const Bytes& bytes, PictureFile& picture) {
    std::optional<double> gamma;
    bool srgb = false;
    for (auto rest = std::span(bytes).subspan(signature.size()); rest.size() >= 12;) {
        const std::size_t length = big_endian(rest);
        const std::string_view type(reinterpret_cast<const char*>(rest.data()) + 4, 4);
        if (type == "IEND" || length > rest.size() - 12) // anything may follow the picture
            break;
        const View content = rest.subspan(8, length);
        srgb |= type == "sRGB";
        if (type == "gAMA" && length == 4)
            gamma = big_endian(content) / 100000.0;
        if (type == "eXIf")
            picture.exif.assign(content.begin(), content.end());
        if (type == "iCCP") { // a name, a zero, the method of compression
            const auto zero = std::find(content.begin(), content.end(), 0);
            const auto name = static_cast<std::size_t>(zero - content.begin());
            if (name + 2 < content.size())
                picture.icc = inflated(content.subspan(name + 2));
        }
        rest = rest.subspan(length + 12);
    }
    if (srgb)
        picture.encoding = ColorEncoding::srgb;
    else if (gamma && picture.icc.empty())
        picture.encoding = std::abs(*gamma - 1) < 0.01 ? ColorEncoding::linear : ColorEncoding::srgb;
}

std::optional<cv::Mat> read_png(const std::filesystem::path& file, const Bytes& bytes) {
    if (bytes.size() < signature.size() || !std::equal(signature.begin(), signature.end(), bytes.begin()))
        return std::nullopt;

    Bytes picture(signature.begin(), signature.end());
    picture.reserve(bytes.size());
    cv::Size size;
    std::uint64_t pixel_bits = 0, compressed = 0;
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
        if (type == "IHDR" && length == 13) {
            static constexpr std::uint64_t channels[] = {1, 0, 3, 1, 2, 0, 4, 0}; // by the type of colour
            const std::uint32_t width = big_endian(chunk.subspan(8)), height = big_endian(chunk.subspan(12));
            check_size(file, width, height);
            size = {static_cast<int>(width), static_cast<int>(height)};
            pixel_bits = chunk[16] * channels[chunk[17] % std::size(channels)];
        }
        if (type == "IDAT")
            compressed += length;
        if (type == "IHDR" || type == "PLTE" || type == "IDAT" || type == "IEND")
            picture.insert(picture.end(), chunk.begin(), chunk.end());
        rest = rest.subspan(chunk.size());
    }
    const bool packed = pixel_bits > 0 && pixel_bits < 8; // several pixels in a byte
    check_holds(file, size, packed ? 1 : pixel_bits / 8, compressed,
                expansion::deflate * (packed ? 8 / pixel_bits : 1));
    return decode_with_opencv(file, picture);
}

Bytes png_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    Bytes pixels;
    if (!cv::imencode(".png", bgr, pixels))
        throw Error("OpenCV cannot write a PNG");
    const auto front = static_cast<std::ptrdiff_t>(signature.size() + 25); // behind IHDR
    Bytes file(pixels.begin(), pixels.begin() + front);
    if (!format.icc.empty()) {
        static constexpr std::array<unsigned char, 5> head{'I', 'C', 'C', 0, 0};
        Bytes content(head.begin(), head.end());
        const Bytes compressed = deflated(format.icc);
        content.insert(content.end(), compressed.begin(), compressed.end());
        append_chunk(file, "iCCP", content);
    } else if (format.encoding == ColorEncoding::linear) {
        append_chunk(file, "gAMA", std::array<unsigned char, 4>{0, 1, 0x86, 0xa0}); // 100000
    } else {
        append_chunk(file, "sRGB", std::array<unsigned char, 1>{0}); // perceptual
    }
    if (!format.exif.empty())
        append_chunk(file, "eXIf", format.exif);
    file.insert(file.end(), pixels.begin() + front, pixels.end());
    return file;
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
