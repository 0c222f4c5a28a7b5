// TIFF, with libtiff. Samples are read as they are, or as libtiff turns them into R, G and B of 8 bits: palettes, YCbCr,
// inks, white that is 0.
#include "io/formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <span>
#include <string_view>

namespace fathom::io {
namespace {

/// What libtiff reads from or writes to, and the errors that it reported.
struct Stream {
    std::span<const unsigned char> in = {};
    int file = -1; ///< is read instead of `in`
    MemorySink* out = nullptr;
    std::uint64_t size = 0;
    std::uint64_t at = 0;
    int unreadable = 0;              ///< why the system did not read, once it did not
    bool cut_short = false;          ///< something was to be read that is not there, which libtiff forgives in places
    std::string error = {};          ///< libtiff's first
    std::exception_ptr failure = {}; ///< of `out`, which libtiff cannot throw

    /// As many bytes as are there.
    std::uint64_t read(void* target, std::uint64_t wanted, std::uint64_t from) {
        const auto there = std::min(wanted, size - std::min(from, size));
        std::uint64_t done = there;
        if (file >= 0)
            for (done = 0; done < there;) {
                const auto got =
                    ::pread(file, static_cast<char*>(target) + done, there - done, static_cast<off_t>(from + done));
                if (got < 0 && errno == EINTR)
                    continue;
                if (got < 0)
                    unreadable = errno;
                if (got <= 0)
                    break;
                done += static_cast<std::uint64_t>(got);
            }
        else if (there > 0)
            std::memcpy(target, in.data() + from, there);
        cut_short |= done < wanted;
        return done;
    }
};

Stream& stream_of(thandle_t handle) {
    return *static_cast<Stream*>(handle);
}

tmsize_t read_stream(thandle_t handle, void* target, tmsize_t size) {
    Stream& stream = stream_of(handle);
    const auto there = stream.read(target, static_cast<std::uint64_t>(size), stream.at);
    stream.at += there;
    return static_cast<tmsize_t>(there);
}

tmsize_t write_stream(thandle_t handle, void* source, tmsize_t size) {
    Stream& stream = stream_of(handle);
    try {
        stream.out->write({static_cast<const unsigned char*>(source), static_cast<std::size_t>(size)}, stream.at);
    } catch (...) {
        stream.failure = std::current_exception();
        return -1;
    }
    stream.at += static_cast<std::uint64_t>(size);
    stream.size = std::max(stream.size, stream.at);
    return size;
}

toff_t seek_stream(thandle_t handle, toff_t offset, int whence) {
    Stream& stream = stream_of(handle);
    return stream.at = offset + (whence == SEEK_CUR ? stream.at : whence == SEEK_END ? stream.size : 0);
}

int close_stream(thandle_t) {
    return 0;
}

toff_t size_of_stream(thandle_t handle) {
    return stream_of(handle).size;
}

int keep_error(TIFF*, void* stream, const char*, const char* format, va_list arguments) {
    std::array<char, 256> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    if (auto& error = stream_of(stream).error; error.empty())
        error = text.data();
    return 1; // libtiff does not print it
}

int ignore_warning(TIFF*, void* stream, const char* from, const char*, va_list) {
    stream_of(stream).cut_short |=
        from && std::string_view(from) == "JPEGPreDecode"; // of fewer pixels than there should be
    return 1;
}

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

Tiff open(Stream& stream, const char* mode) {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &stream);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, &stream);
    return {TIFFClientOpenExt("", mode, &stream, read_stream, write_stream, seek_stream, close_stream, size_of_stream,
                              nullptr, nullptr, options.get()),
            TIFFClose};
}

[[noreturn]] void refuse_damaged(const std::filesystem::path& file, const Stream& stream) {
    if (stream.unreadable != 0)
        refuse_read(file, stream.unreadable);
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
    if (d.bits == 64 && d.format != SAMPLEFORMAT_IEEEFP)
        refuse(file, "has integers of 64 bits; save depth as integers of 16 bits or as float");
    if (d.bits == 32 && d.format == 0xffff)
        refuse(file,
               "has 32-bit samples without saying of what kind (SampleFormat); save it as signed 32-bit or as float");
    if (d.compression == COMPRESSION_PIXARLOG)
        refuse(file, "is packed with PixarLog, which libtiff unpacks to other values each time; save it with Deflate");
    if (d.bits > 8 && d.samples > 1 && d.planes != PLANARCONFIG_CONTIG) // of which libtiff reads one at a time
        refuse(file, "keeps its channels in separate planes; save them interleaved (PlanarConfiguration 1)");
}

/// Are all strips or tiles there, inside the file? libtiff would read what lies in their place.
bool is_complete(TIFF* tiff, const Directory& d, const Stream& stream) {
    const std::uint32_t pieces = TIFFIsTiled(tiff) ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < pieces; ++i) {
        const std::uint64_t at = TIFFGetStrileOffset(tiff, i), size = TIFFGetStrileByteCount(tiff, i);
        if (size == 0 || at > stream.size || size > stream.size - at)
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

/// The type of samples that are read as they are; halves as their bits. None for what libtiff turns into colours.
std::optional<int> plain_type(const Directory& d) {
    const bool grey = d.photometric <= PHOTOMETRIC_MINISBLACK;
    const bool plain = d.samples == 1 || d.samples == 3 || d.samples == 4;
    const bool is_unsigned = d.format == SAMPLEFORMAT_UINT || d.format == 0xffff,
               is_float = d.format == SAMPLEFORMAT_IEEEFP;
    if (!plain || d.photometric > PHOTOMETRIC_RGB)
        return std::nullopt;
    if (d.bits == 8 && is_unsigned && d.samples == 1 && d.photometric == PHOTOMETRIC_MINISBLACK)
        return CV_8UC1;
    if (d.bits == 8 && is_unsigned && d.samples >= 3 && !grey && d.planes == PLANARCONFIG_CONTIG)
        return CV_8UC(d.samples); // libtiff would multiply the alpha in
    if (d.bits == 16 && (is_unsigned || is_float) && (d.samples == 1 || !grey))
        return CV_16UC(d.samples);
    if (d.bits == 16 && d.format == SAMPLEFORMAT_INT && d.samples == 1)
        return CV_16SC1;
    if (d.bits == 32 && (is_unsigned || is_float || d.format == SAMPLEFORMAT_INT))
        return is_float ? CV_32FC(d.samples) : CV_32SC(d.samples);
    return d.bits == 64 && is_float ? std::optional(CV_64FC(d.samples)) : std::nullopt;
}

/// An open TIFF with its directory.
struct OpenTiff {
    OpenTiff(const std::filesystem::path& name, Stream& from)
        : file(name), stream(from), tiff(open(from, "r")), directory((check_open(), tiff.get())) {
        check_size(file, directory.width, directory.height);
        check_samples(file, directory);
        if (directory.photometric == 0xffff || !is_complete(tiff.get(), directory, stream))
            refuse_damaged(file, stream);
        check_holds({static_cast<int>(directory.width), static_cast<int>(directory.height)});
        // libdeflate stops somewhere before the end of a strip or tile that inflates to more than its rows, and libtiff says
        // nothing of it.
        if (directory.compression == COMPRESSION_DEFLATE || directory.compression == COMPRESSION_ADOBE_DEFLATE)
            TIFFSetField(tiff.get(), TIFFTAG_DEFLATE_SUBCODEC, DEFLATE_SUBCODEC_ZLIB);
    }

    /// Can the file hold an image, or a tile, of this size?
    void check_holds(cv::Size size) const {
        io::check_holds(file, size, directory.pixel_bytes(), stream.size, expansion_of(directory));
    }

    void check_open() const {
        if (!tiff || stream.cut_short)
            refuse_damaged(file, stream);
    }

    const std::filesystem::path& file;
    Stream& stream;
    Tiff tiff;
    Directory directory;
};

/// Do strips and tiles say themselves how large they are? Of smaller ones libtiff leaves the rest unwritten.
bool has_own_sizes(const Directory& d) {
    return d.compression == COMPRESSION_JPEG || d.compression == COMPRESSION_WEBP;
}

/// Reads samples as they are.
class Reader {
public:
    /// `pattern`: what memory is filled with before.
    Reader(const OpenTiff& from, int type, unsigned char pattern = unwritten)
        : file_(from.file), stream_(from.stream), tiff_(from.tiff.get()),
          height_(static_cast<int>(from.directory.height)), width_(static_cast<int>(from.directory.width)), type_(type),
          pattern_(pattern), tiled_(TIFFIsTiled(tiff_)),
          is_raw_(from.directory.compression == COMPRESSION_NONE &&
                  Directory::small(tiff_, TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) == FILLORDER_MSB2LSB) {
        if (tiled_) {
            const std::uint32_t width = field(tiff_, TIFFTAG_TILEWIDTH, 0u),
                                height = field(tiff_, TIFFTAG_TILELENGTH, 0u);
            check_size(file_, width, height);
            from.check_holds({static_cast<int>(width), static_cast<int>(height)});
            tile_ = filled(static_cast<int>(height), static_cast<int>(width));
        } else {
            const auto all = static_cast<std::uint32_t>(height_);
            strip_rows_ = static_cast<int>(std::clamp(field(tiff_, TIFFTAG_ROWSPERSTRIP, all), 1u, all));
        }
    }

    cv::Mat read() {
        cv::Mat image = filled(height_, width_);
        const bool read = tiled_ ? read_tiles(image) : read_strips(image);
        if (!read || stream_.cut_short)
            refuse_damaged(file_, stream_);
        return image;
    }

private:
    cv::Mat filled(int rows, int columns) const {
        cv::Mat image(rows, columns, type_);
        if (!is_raw_)
            std::memset(image.data, pattern_, image.total() * image.elemSize());
        return image;
    }

    bool read_strips(cv::Mat& image) {
        for (int y = 0, strip = 0; y < height_; y += strip_rows_) {
            cv::Mat part = image.rowRange(y, std::min(y + strip_rows_, height_));
            if (!read_strip(strip++, part))
                return false;
        }
        return true;
    }

    bool read_strip(int strip, cv::Mat& part) {
        const auto size = bytes_of(part);
        return TIFFReadEncodedStrip(tiff_, static_cast<std::uint32_t>(strip), part.data, size) == size;
    }

    bool read_tiles(cv::Mat& image) {
        for (int y = 0, row = 0; y < height_; y += tile_.rows) {
            cv::Mat part = image.rowRange(y, std::min(y + tile_.rows, height_));
            if (!read_row_of_tiles(row++, part))
                return false;
        }
        return true;
    }

    bool read_row_of_tiles(int row, cv::Mat& part) {
        const auto across = static_cast<std::uint32_t>((width_ + tile_.cols - 1) / tile_.cols);
        const auto size = bytes_of(tile_);
        std::uint32_t i = static_cast<std::uint32_t>(row) * across;
        for (int x = 0; x < width_; x += tile_.cols) {
            if (TIFFReadEncodedTile(tiff_, i++, tile_.data, size) != size)
                return false;
            const cv::Rect seen(0, 0, std::min(tile_.cols, width_ - x), part.rows);
            tile_(seen).copyTo(part(seen + cv::Point(x, 0)));
        }
        return true;
    }

    static tmsize_t bytes_of(const cv::Mat& image) { return static_cast<tmsize_t>(image.total() * image.elemSize()); }

    const std::filesystem::path& file_;
    Stream& stream_;
    TIFF* tiff_;
    int height_, width_, type_;
    unsigned char pattern_;
    bool tiled_, is_raw_;
    int strip_rows_ = 0;
    cv::Mat tile_;
};

/// Samples as OpenCV has them. Signed ones of 16 bits are floats, which hold them all.
cv::Mat in_order(const cv::Mat& samples, const Directory& directory) {
    if (samples.type() == CV_16SC1) {
        cv::Mat floats;
        samples.convertTo(floats, CV_32F);
        return floats;
    }
    const cv::Mat image = swap_red_and_blue(samples);
    const bool half = directory.bits == 16 && directory.format == SAMPLEFORMAT_IEEEFP;
    return half ? cv::Mat(image.size(), CV_16FC(image.channels()), image.data, image.step).clone() : image;
}

bool begins_like_tiff(std::string_view bytes) {
    using namespace std::string_view_literals;
    const std::string_view magic = bytes.substr(0, 4);
    return magic == "II\x2a\0"sv || magic == "II\x2b\0"sv || magic == "MM\0\x2a"sv || magic == "MM\0\x2b"sv;
}

void read_metadata_of(TIFF* tiff, PictureFile& picture) {
    std::uint16_t count = 0;
    std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff, TIFFTAG_EXTRASAMPLES, &count, &kinds) && count > 0) {
        if (kinds[0] == EXTRASAMPLE_ASSOCALPHA || kinds[0] == EXTRASAMPLE_UNASSALPHA)
            picture.straight_alpha = kinds[0] == EXTRASAMPLE_UNASSALPHA;
    }
    std::uint32_t size = 0;
    void* profile = nullptr;
    if (TIFFGetField(tiff, TIFFTAG_ICCPROFILE, &size, &profile)) {
        const auto* first = static_cast<const unsigned char*>(profile);
        picture.icc.assign(first, first + size);
    }
    toff_t directory = 0;
    picture.has_more = TIFFGetField(tiff, TIFFTAG_EXIFIFD, &directory) == 1;
}

/// A file that stays open while its directories are read.
class OpenFile {
public:
    explicit OpenFile(const std::filesystem::path& file) : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
        struct stat status;
        if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0)
            refuse_read(file, errno);
        stream = {.file = descriptor_, .size = static_cast<std::uint64_t>(status.st_size)};
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    ~OpenFile() { ::close(descriptor_); }

    Stream stream;

private:
    int descriptor_;
};

/// What libtiff makes 8 bits of: B, G, R with an alpha where there is a fourth sample, or grey.
cv::Mat read_colors(const OpenTiff& from) {
    const Directory& d = from.directory;
    const bool grey = d.photometric <= PHOTOMETRIC_MINISBLACK;
    const int channels = grey ? 1 : d.photometric == PHOTOMETRIC_PALETTE ? 3 : d.samples;
    cv::Mat colors(static_cast<int>(d.height), static_cast<int>(d.width), CV_32SC1);
    // Where the orientation that is asked for is the file's, libtiff turns nothing.
    if (!TIFFReadRGBAImageOriented(from.tiff.get(), d.width, d.height, colors.ptr<std::uint32_t>(), d.orientation, 1) ||
        from.stream.cut_short)
        refuse_damaged(from.file, from.stream);
    const bool loses_bits = d.bits > 8 && d.photometric <= PHOTOMETRIC_RGB && d.samples != 2;
    if (channels == 2 || d.samples > 4 || loses_bits || d.photometric == PHOTOMETRIC_LOGLUV)
        refuse_undecoded(from.file);
    cv::Mat image(colors.size(), CV_8UC(channels));
    for (int y = 0; y < image.rows; ++y) {
        auto* to = image.ptr(y);
        for (const std::uint32_t color :
             std::span(colors.ptr<std::uint32_t>(y), static_cast<std::size_t>(colors.cols))) {
            const std::uint32_t bgra[] = {TIFFGetB(color), TIFFGetG(color), TIFFGetR(color), TIFFGetA(color)};
            for (int c = 0; c < channels; ++c)
                *to++ = static_cast<unsigned char>(bgra[c]);
        }
    }
    return image;
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
    if (!begins_like_tiff({reinterpret_cast<const char*>(bytes.data()), bytes.size()}))
        return std::nullopt;
    Stream stream{.in = bytes, .size = bytes.size()};
    const OpenTiff tiff(file, stream);
    const auto type = plain_type(tiff.directory);
    if (!type)
        return upright(read_colors(tiff), tiff.directory.orientation);
    const cv::Mat image = Reader(tiff, *type).read();
    if (has_own_sizes(tiff.directory)) {
        const cv::Mat again = Reader(tiff, *type, static_cast<unsigned char>(~unwritten)).read();
        if (std::memcmp(image.data, again.data, image.total() * image.elemSize()) != 0)
            refuse_damaged(file, stream);
    }
    return in_order(upright(image, tiff.directory.orientation), tiff.directory);
}

int tiff_pages(const std::filesystem::path& file) {
    constexpr int most = 1000; // to count more tells nobody more
    std::array<char, 4> begin{};
    std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
    if (!begins_like_tiff({begin.data(), begin.size()}))
        return 1;
    OpenFile from(file);
    const Tiff tiff = open(from.stream, "r");
    int pages = 1;
    while (tiff && pages < most && TIFFReadDirectory(tiff.get()) == 1)
        pages += (field(tiff.get(), TIFFTAG_SUBFILETYPE, 0u) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0;
    return pages;
}

void read_tiff_metadata(const Bytes& bytes, PictureFile& picture) {
    Stream stream{.in = bytes, .size = bytes.size()};
    if (const Tiff tiff = open(stream, "r"))
        read_metadata_of(tiff.get(), picture);
}

namespace {

// An image of one strip is readable by everything. A larger one has several, of which a program need not read all.
constexpr std::size_t most_in_one_strip = std::size_t{128} << 20, bytes_of_a_strip = std::size_t{8} << 20;
constexpr std::uint64_t end_of_classic = 0xffff0000u; // offsets of 32 bits, and room for the directory

} // namespace

Bytes tiff_bytes(const cv::Mat& image, const PictureFormat& format) {
    MemorySink memory(image);
    Stream stream{.out = &memory};
    const auto check = [&](bool written) {
        if (stream.failure)
            std::rethrow_exception(stream.failure);
        if (!written)
            throw Error("libtiff cannot write it: " + stream.error);
    };
    const std::size_t row = image.elemSize() * static_cast<std::size_t>(image.cols),
                      all = row * static_cast<std::size_t>(image.rows);
    const int strip_rows =
        all <= most_in_one_strip ? image.rows : std::max(static_cast<int>(bytes_of_a_strip / row), 1);
    Tiff tiff = open(stream, all > end_of_classic ? "w8" : "w");
    check(tiff != nullptr);
    const auto set = [&](std::uint32_t tag, auto... value) {
        if (!TIFFSetField(tiff.get(), tag, value...))
            throw Error("libtiff does not take field " + std::to_string(tag) + ": " + stream.error);
    };
    set(TIFFTAG_IMAGEWIDTH, image.cols);
    set(TIFFTAG_IMAGELENGTH, image.rows);
    set(TIFFTAG_BITSPERSAMPLE, 8 * static_cast<int>(image.elemSize1()));
    set(TIFFTAG_SAMPLEFORMAT, image.depth() == CV_32F ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    set(TIFFTAG_SAMPLESPERPIXEL, image.channels());
    set(TIFFTAG_PHOTOMETRIC, image.channels() >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    set(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    set(TIFFTAG_ROWSPERSTRIP, strip_rows);
    const std::uint16_t alpha = image.depth() == CV_32F ? EXTRASAMPLE_UNSPECIFIED : EXTRASAMPLE_UNASSALPHA;
    if (image.channels() == 4)
        set(TIFFTAG_EXTRASAMPLES, 1, &alpha);
    if (!format.icc.empty())
        set(TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(format.icc.size()), format.icc.data());
    std::uint32_t number = 0;
    for (int y = 0; y < image.rows; y += strip_rows) {
        const cv::Mat part = image.rowRange(y, std::min(y + strip_rows, image.rows));
        const cv::Mat strip = part.isContinuous() ? part : part.clone();
        const auto size = static_cast<tmsize_t>(strip.total() * strip.elemSize());
        check(TIFFWriteEncodedStrip(tiff.get(), number++, strip.data, size) == size);
    }
    check(TIFFWriteDirectory(tiff.get()));
    tiff.reset();
    check(true);
    return std::move(memory.bytes);
}

} // namespace fathom::io
