// PNG. libpng accepts files that end too early. So every chunk is checked against its own sum first, and libpng is given
// only the chunks that make the picture (PNG specification, section 5.3).
#include "codec_calls.hpp"
#include "metadata.hpp"

#include "io/formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>
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

/// libpng's structures for one file, whose errors come back to `jump`. Nothing is printed.
struct Png {
    explicit Png(bool reads)
        : is_read(reads),
          png((reads ? png_create_read_struct : png_create_write_struct)(PNG_LIBPNG_VER_STRING, &jump, leave, ignore)),
          info(png_create_info_struct(png)) {
        if (!info)
            throw std::bad_alloc();
    }
    Png(const Png&) = delete;
    Png& operator=(const Png&) = delete;
    ~Png() { is_read ? png_destroy_read_struct(&png, &info, nullptr) : png_destroy_write_struct(&png, &info); }

    [[noreturn]] static void leave(png_structp png, png_const_charp) {
        std::longjmp(static_cast<Jump*>(png_get_error_ptr(png))->place, 1);
    }
    static void ignore(png_structp, png_const_charp) {}
    static void take(png_structp png, png_bytep to, std::size_t count) {
        View& rest = *static_cast<View*>(png_get_io_ptr(png));
        if (count > rest.size())
            png_error(png, "the end");
        std::memcpy(to, rest.data(), count);
        rest = rest.subspan(count);
    }
    static void append(png_structp png, png_bytep from, std::size_t count) {
        auto& file = *static_cast<Bytes*>(png_get_io_ptr(png));
        bool kept = true;
        try { // no exception may pass libpng
            file.insert(file.end(), from, from + count);
        } catch (const std::bad_alloc&) {
            kept = false;
        }
        if (!kept)
            png_error(png, "memory");
    }

    Jump jump;
    bool is_read;
    png_structp png;
    png_infop info;
};

/// Samples of a byte or two, without palettes; grey has three channels where it has an alpha.
cv::Mat png_pixels(const std::filesystem::path& file, View chunks) {
    Png codec(true);
    cv::Mat image;
    const bool is_complete = complete(codec.jump, [&] {
        png_set_read_fn(codec.png, &chunks, Png::take);
        png_read_info(codec.png, codec.info);
        png_set_expand(codec.png);
        if (png_get_color_type(codec.png, codec.info) == PNG_COLOR_TYPE_GRAY_ALPHA)
            png_set_gray_to_rgb(codec.png);
        png_set_bgr(codec.png);
        if (is_little_endian)
            png_set_swap(codec.png);
        const int passes = png_set_interlace_handling(codec.png);
        png_read_update_info(codec.png, codec.info);
        image.create(static_cast<int>(png_get_image_height(codec.png, codec.info)),
                     static_cast<int>(png_get_image_width(codec.png, codec.info)),
                     CV_MAKETYPE(png_get_bit_depth(codec.png, codec.info) == 16 ? CV_16U : CV_8U,
                                 png_get_channels(codec.png, codec.info)));
        for (int pass = 0; pass < passes; ++pass)
            for (int y = 0; y < image.rows; ++y)
                png_read_row(codec.png, image.ptr(y), nullptr);
        png_read_end(codec.png, nullptr);
    });
    if (!is_complete)
        refuse_undecoded(file);
    return image;
}

struct PngChunk {
    const char* type;
    View content; ///< empty: it is left out
};

/// With OpenCV's filter and compression, which suit speed.
Bytes as_png(const cv::Mat& bgr, std::initializer_list<PngChunk> chunks) {
    Png codec(false);
    Bytes file;
    const bool is_complete = complete(codec.jump, [&] {
        png_set_write_fn(codec.png, &file, Png::append, [](png_structp) {});
        png_set_filter(codec.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
        png_set_compression_level(codec.png, Z_BEST_SPEED);
        png_set_compression_strategy(codec.png, Z_RLE);
        const int type = bgr.channels() == 1   ? PNG_COLOR_TYPE_GRAY
                         : bgr.channels() == 3 ? PNG_COLOR_TYPE_RGB
                                               : PNG_COLOR_TYPE_RGB_ALPHA;
        png_set_IHDR(codec.png, codec.info, static_cast<png_uint_32>(bgr.cols), static_cast<png_uint_32>(bgr.rows),
                     8 * static_cast<int>(bgr.elemSize1()), type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        png_write_info(codec.png, codec.info);
        for (const auto& [name, content] : chunks)
            if (!content.empty())
                png_write_chunk(codec.png, reinterpret_cast<png_const_bytep>(name), content.data(), content.size());
        png_set_bgr(codec.png);
        if (is_little_endian)
            png_set_swap(codec.png);
        for (int y = 0; y < bgr.rows; ++y)
            png_write_row(codec.png, bgr.ptr(y));
        png_write_end(codec.png, nullptr);
    });
    if (!is_complete)
        throw Error("libpng cannot write a PNG of " + described(bgr.size()) + " pixels");
    return file;
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
    return png_pixels(file, picture);
}

Bytes png_bytes(const cv::Mat& bgr) {
    return as_png(bgr, {});
}

Bytes png_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    static constexpr std::array<unsigned char, 4> gamma_of_1{0, 1, 0x86, 0xa0}; // 100000
    static constexpr std::array<unsigned char, 1> perceptual{0};
    if (format.icc.empty())
        return as_png(bgr, {format.encoding == ColorEncoding::linear ? PngChunk{"gAMA", gamma_of_1}
                                                                     : PngChunk{"sRGB", perceptual},
                            {"eXIf", format.exif}});
    Bytes profile{'I', 'C', 'C', 0, 0};
    const Bytes compressed = deflated(format.icc);
    profile.insert(profile.end(), compressed.begin(), compressed.end());
    return as_png(bgr, {{"iCCP", profile}, {"eXIf", format.exif}});
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

Bytes png_bytes(const cv::Mat& image, double scale, double offset) {
    return as_png(swap_red_and_blue(png_codes(image, scale, offset)), {});
}

} // namespace fathom::io
