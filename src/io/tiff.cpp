// TIFF, with libtiff. Depth comes in samples that OpenCV's reader does not know: unsigned 32-bit, which is what a D24 buffer
// is, and half floats. OpenCV decodes the other files (8 bits, palettes) once libtiff has decoded them.
#include "formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>

namespace fathom::io {
namespace {

/// What libtiff reads from or writes to, and the errors that it reported.
struct Stream {
    std::span<const unsigned char> in = {};
    Bytes out = {};
    std::uint64_t at = 0;
    bool cut_short = false; ///< something was to be read that is not there, which libtiff forgives in places
    std::string error = {}; ///< libtiff's first

    std::uint64_t size() const { return in.empty() ? out.size() : in.size(); }
};

Stream& stream_of(thandle_t handle) {
    return *static_cast<Stream*>(handle);
}

tmsize_t read_stream(thandle_t handle, void* target, tmsize_t size) {
    Stream& stream = stream_of(handle);
    const auto wanted = static_cast<std::uint64_t>(size);
    const auto there = std::min(wanted, stream.in.size() - std::min<std::uint64_t>(stream.at, stream.in.size()));
    stream.cut_short |= there < wanted;
    if (there > 0)
        std::memcpy(target, stream.in.data() + stream.at, there);
    stream.at += there;
    return static_cast<tmsize_t>(there);
}

tmsize_t write_stream(thandle_t handle, void* source, tmsize_t size) {
    Stream& stream = stream_of(handle);
    const auto end = stream.at + static_cast<std::uint64_t>(size);
    if (end > stream.out.size())
        stream.out.resize(end);
    std::memcpy(stream.out.data() + stream.at, source, static_cast<std::size_t>(size));
    stream.at = end;
    return size;
}

toff_t seek_stream(thandle_t handle, toff_t offset, int whence) {
    Stream& stream = stream_of(handle);
    return stream.at = offset + (whence == SEEK_CUR ? stream.at : whence == SEEK_END ? stream.size() : 0);
}

int close_stream(thandle_t) {
    return 0;
}

toff_t size_of_stream(thandle_t handle) {
    return stream_of(handle).size();
}

int keep_error(TIFF*, void* stream, const char*, const char* format, va_list arguments) {
    std::array<char, 256> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    if (auto& error = stream_of(stream).error; error.empty())
        error = text.data();
    return 1; // libtiff does not print it
}

int ignore_warning(TIFF*, void*, const char*, const char*, va_list) {
    return 1;
}

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

Tiff open(Stream& stream, const char* mode) {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &stream);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
    return {TIFFClientOpenExt("", mode, &stream, read_stream, write_stream, seek_stream, close_stream, size_of_stream,
                              nullptr, nullptr, options.get()),
            TIFFClose};
}

[[noreturn]] void refuse_damaged(const std::filesystem::path& file, const Stream& stream) {
    refuse(file, "is damaged or cut short" + (stream.error.empty() ? "" : " (" + stream.error + ")") +
                     "; write or copy it again");
}

template <typename Value>
Value field(TIFF* tiff, std::uint32_t tag, Value otherwise) {
    TIFFGetField(tiff, tag, &otherwise);
    return otherwise;
}

/// What the directory says of the image. Unsaid: a format or a photometric interpretation of 0xffff.
struct Directory {
    explicit Directory(TIFF* tiff)
        : width(field(tiff, TIFFTAG_IMAGEWIDTH, std::uint32_t{0})),
          height(field(tiff, TIFFTAG_IMAGELENGTH, std::uint32_t{0})), bits(small(tiff, TIFFTAG_BITSPERSAMPLE, 1)),
          samples(small(tiff, TIFFTAG_SAMPLESPERPIXEL, 1)), format(small(tiff, TIFFTAG_SAMPLEFORMAT, 0xffff)),
          planes(small(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG)),
          photometric(small(tiff, TIFFTAG_PHOTOMETRIC, 0xffff)),
          orientation(small(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT)),
          compression(small(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE)) {}

    static int small(TIFF* tiff, std::uint32_t tag, std::uint16_t otherwise) { return field(tiff, tag, otherwise); }

    std::uint64_t pixel_bytes() const {
        return static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>(bits / 8);
    }

    std::uint32_t width, height;
    int bits, samples, format, planes, photometric, orientation, compression;
};

void check_samples(const std::filesystem::path& file, const Directory& d) {
    if (d.bits != 8 && d.bits != 16 && d.bits != 32 && d.bits != 64)
        refuse(file, "has samples of " + std::to_string(d.bits) + " bits; save depth as 16-bit or as float");
    if (d.bits == 16 && d.format == SAMPLEFORMAT_INT)
        refuse(file, "has signed 16-bit samples; save depth as unsigned 16-bit or as float");
    if (d.bits == 32 && d.format == 0xffff)
        refuse(file,
               "has 32-bit samples without saying of what kind (SampleFormat); save it as signed 32-bit or as float");
    if (d.bits > 8 && d.samples > 1 && d.planes != PLANARCONFIG_CONTIG) // OpenCV leaves parts of such images unset
        refuse(file, "keeps its channels in separate planes; save them interleaved (PlanarConfiguration 1)");
}

/// Are all strips or tiles there, inside the file? libtiff would read what lies in their place.
bool is_complete(TIFF* tiff, const Directory& d, const Stream& stream) {
    const std::uint32_t pieces = TIFFIsTiled(tiff) ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < pieces; ++i) {
        const std::uint64_t at = TIFFGetStrileOffset(tiff, i), size = TIFFGetStrileByteCount(tiff, i);
        if (size == 0 || at > stream.size() || size > stream.size() - at)
            return false;
        sum += size;
    }
    const bool compressed = d.compression != COMPRESSION_NONE;
    return pieces > 0 && (compressed || sum >= std::uint64_t{d.width} * d.height * d.pixel_bytes());
}

/// See `check_holds`.
std::optional<std::uint64_t> expansion_of(const Directory& d) {
    switch (d.compression) {
    case COMPRESSION_NONE:
        return 1;
    case COMPRESSION_PACKBITS:
        return 64; // 128 bytes of 2
    case COMPRESSION_LZW:
        return 2560; // 3840 bytes of 12 bits
    case COMPRESSION_DEFLATE:
    case COMPRESSION_ADOBE_DEFLATE:
        return expansion::deflate;
    case COMPRESSION_JPEG:
        return 4 * expansion::jpeg; // of up to four channels, of which some may be smaller
    case COMPRESSION_LZMA:
        return 1u << 13; // 273 bytes of 14 decisions, of 0.022 bits each
    case COMPRESSION_ZSTD:
        return 1u << 15; // 128 KiB of a block of 4 bytes
    default:             // LERC and WebP: no bits for pixels that are all the same
        return std::nullopt;
    }
}

/// The type of samples that are read as they are; halves as their bits. None for what OpenCV reads.
std::optional<int> plain_type(const Directory& d) {
    const bool grey = d.photometric <= PHOTOMETRIC_MINISBLACK;
    const bool plain = d.samples == 1 || d.samples == 3 || d.samples == 4;
    const bool is_unsigned = d.format == SAMPLEFORMAT_UINT || d.format == 0xffff,
               is_float = d.format == SAMPLEFORMAT_IEEEFP;
    if (!plain || d.photometric > PHOTOMETRIC_RGB)
        return std::nullopt;
    if (d.bits == 8 && is_unsigned && d.samples >= 3 && !grey && d.planes == PLANARCONFIG_CONTIG)
        return CV_8UC(d.samples); // OpenCV would multiply the alpha in
    if (d.bits == 16 && (is_unsigned || is_float) && (d.samples == 1 || !grey))
        return CV_16UC(d.samples);
    if (d.bits == 32 && (is_unsigned || is_float || d.format == SAMPLEFORMAT_INT))
        return is_float ? CV_32FC(d.samples) : CV_32SC(d.samples);
    return d.bits == 64 && is_float ? std::optional(CV_64FC(d.samples)) : std::nullopt;
}

bool read_strips(TIFF* tiff, cv::Mat& image) {
    const auto all = static_cast<std::uint32_t>(image.rows);
    const auto rows = std::clamp(field(tiff, TIFFTAG_ROWSPERSTRIP, all), 1u, all);
    for (std::uint32_t y = 0, strip = 0; y < all; y += rows, ++strip) {
        const auto size = static_cast<tmsize_t>(std::min(rows, all - y) * image.step);
        if (TIFFReadEncodedStrip(tiff, strip, image.ptr(static_cast<int>(y)), size) != size)
            return false;
    }
    return true;
}

void check_tiles(const std::filesystem::path& file, TIFF* tiff, const Directory& d, std::uint64_t stored) {
    const std::uint32_t width = field(tiff, TIFFTAG_TILEWIDTH, 0u), height = field(tiff, TIFFTAG_TILELENGTH, 0u);
    check_size(file, width, height);
    check_holds(file, cv::Size(static_cast<int>(width), static_cast<int>(height)), d.pixel_bytes(), stored,
                expansion_of(d));
}

bool read_tiles(TIFF* tiff, cv::Mat& image) {
    const std::uint32_t width = field(tiff, TIFFTAG_TILEWIDTH, 0u), height = field(tiff, TIFFTAG_TILELENGTH, 0u);
    cv::Mat tile(static_cast<int>(height), static_cast<int>(width), image.type());
    const auto size = static_cast<tmsize_t>(tile.total() * tile.elemSize());
    std::uint32_t i = 0;
    for (int y = 0; y < image.rows; y += tile.rows)
        for (int x = 0; x < image.cols; x += tile.cols) {
            if (TIFFReadEncodedTile(tiff, i++, tile.data, size) != size)
                return false;
            const cv::Rect seen(0, 0, std::min(tile.cols, image.cols - x), std::min(tile.rows, image.rows - y));
            tile(seen).copyTo(image(seen + cv::Point(x, y)));
        }
    return true;
}

bool can_be_decoded(TIFF* tiff, const Directory& d) {
    std::vector<std::uint32_t> pixels(std::size_t{d.width} * d.height);
    return TIFFReadRGBAImage(tiff, d.width, d.height, pixels.data(), 1);
}

} // namespace

cv::Mat upright(cv::Mat image, int orientation) {
    constexpr int none = 2, flips[] = {none, none, 1, -1, 0, none, 1, -1, 0}; // as cv::flip has them
    if (orientation < 1 || orientation > 8)
        return image;
    if (orientation >= ORIENTATION_LEFTTOP) // rows and columns have changed places
        image = image.t();
    if (flips[orientation] != none)
        cv::flip(image, image, flips[orientation]);
    return image;
}

std::optional<cv::Mat> read_tiff(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view magic(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 4));
    using namespace std::string_view_literals;
    if (magic != "II\x2a\0"sv && magic != "II\x2b\0"sv && magic != "MM\0\x2a"sv && magic != "MM\0\x2b"sv)
        return std::nullopt;
    Stream stream{.in = bytes};
    const Tiff tiff = open(stream, "r");
    if (!tiff || stream.cut_short)
        refuse_damaged(file, stream);
    const Directory directory(tiff.get());
    check_size(file, directory.width, directory.height);
    check_samples(file, directory);
    if (directory.photometric == 0xffff || !is_complete(tiff.get(), directory, stream))
        refuse_damaged(file, stream);
    const cv::Size size(static_cast<int>(directory.width), static_cast<int>(directory.height));
    check_holds(file, size, directory.pixel_bytes(), bytes.size(), expansion_of(directory));
    const bool tiled = TIFFIsTiled(tiff.get());
    if (tiled)
        check_tiles(file, tiff.get(), directory, bytes.size());

    const auto type = plain_type(directory);
    if (!type) {
        if (!can_be_decoded(tiff.get(), directory) || stream.cut_short)
            refuse_damaged(file, stream);
        return decode_with_opencv(file, bytes);
    }
    cv::Mat image(size, *type);
    const bool read = tiled ? read_tiles(tiff.get(), image) : read_strips(tiff.get(), image);
    if (!read || stream.cut_short)
        refuse_damaged(file, stream);
    image = swap_red_and_blue(upright(image, directory.orientation));
    const bool half = directory.bits == 16 && directory.format == SAMPLEFORMAT_IEEEFP;
    return half ? cv::Mat(image.size(), CV_16FC(image.channels()), image.data, image.step).clone() : image;
}

void read_tiff_metadata(const Bytes& bytes, PictureFile& picture) {
    Stream stream{.in = bytes};
    const Tiff tiff = open(stream, "r");
    if (!tiff)
        return;
    std::uint16_t count = 0;
    std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff.get(), TIFFTAG_EXTRASAMPLES, &count, &kinds) && count > 0) {
        if (kinds[0] == EXTRASAMPLE_ASSOCALPHA || kinds[0] == EXTRASAMPLE_UNASSALPHA)
            picture.straight_alpha = kinds[0] == EXTRASAMPLE_UNASSALPHA;
    }
    std::uint32_t size = 0;
    void* profile = nullptr;
    if (TIFFGetField(tiff.get(), TIFFTAG_ICCPROFILE, &size, &profile)) {
        const auto* first = static_cast<const unsigned char*>(profile);
        picture.icc.assign(first, first + size);
    }
    toff_t directory = 0;
    picture.has_more = TIFFGetField(tiff.get(), TIFFTAG_EXIFIFD, &directory) == 1;
}

Bytes tiff_bytes(const cv::Mat& image) {
    return tiff_bytes(image, {});
}

// One strip, no compression: readable by everything, and OpenCV would turn three float channels into lossy LogLuv.
Bytes tiff_bytes(const cv::Mat& image, const PictureFormat& format) {
    cv::Mat pixels = image.isContinuous() ? image : image.clone();
    const auto size = pixels.total() * pixels.elemSize();
    if (size > 0xffff0000u)
        throw Error("a .tif ends at 4 GiB, the image has " + std::to_string(size >> 20) + " MiB; write an .exr");
    Stream stream;
    {
        const Tiff tiff = open(stream, "w");
        const auto set = [&](std::uint32_t tag, auto... value) {
            if (!TIFFSetField(tiff.get(), tag, value...))
                throw Error("libtiff does not take field " + std::to_string(tag) + ": " + stream.error);
        };
        set(TIFFTAG_IMAGEWIDTH, pixels.cols);
        set(TIFFTAG_IMAGELENGTH, pixels.rows);
        set(TIFFTAG_BITSPERSAMPLE, 8 * static_cast<int>(pixels.elemSize1()));
        set(TIFFTAG_SAMPLEFORMAT, pixels.depth() == CV_32F ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
        set(TIFFTAG_SAMPLESPERPIXEL, pixels.channels());
        set(TIFFTAG_PHOTOMETRIC, pixels.channels() >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
        set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        set(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
        set(TIFFTAG_ROWSPERSTRIP, pixels.rows);
        const std::uint16_t alpha = pixels.depth() == CV_32F ? EXTRASAMPLE_UNSPECIFIED : EXTRASAMPLE_UNASSALPHA;
        if (pixels.channels() == 4)
            set(TIFFTAG_EXTRASAMPLES, 1, &alpha);
        if (!format.icc.empty())
            set(TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(format.icc.size()), format.icc.data());
        const auto written = TIFFWriteEncodedStrip(tiff.get(), 0, pixels.data, static_cast<tmsize_t>(size));
        if (written != static_cast<tmsize_t>(size) || !TIFFWriteDirectory(tiff.get()))
            throw Error("libtiff cannot write it: " + stream.error);
    }
    return stream.out;
}

} // namespace fathom::io
