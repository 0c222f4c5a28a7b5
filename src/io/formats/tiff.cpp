// TIFF 6.0 and BigTIFF. libtiff, behind OpenCV, opens the file first and says what it holds; where OpenCV would take the same numbers
// otherwise, their fields are changed before it reads them.
#include "codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <tiffio.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <new>

namespace fathom::io {
namespace {

/// Compressions that are read, and `expansion` of `check_holds`.
const std::map<std::uint16_t, std::uint64_t> tiff_expansions{
    {COMPRESSION_NONE, 1},
    {COMPRESSION_PACKBITS, 64}, // 128 bytes of 2
    {COMPRESSION_LZW, 2560},    // 3840 bytes of 12 bits
    {COMPRESSION_DEFLATE, expansion::deflate},
    {COMPRESSION_ADOBE_DEFLATE, expansion::deflate},
    {COMPRESSION_LZMA, 1u << 13},  // 273 bytes of 14 decisions, of 0.022 bits each
    {COMPRESSION_ZSTD, 1u << 15}}; // 128 KiB of a block of 4 bytes

/// The libtiff that OpenCV has loaded.
struct LibTiff {
    template <typename Function>
    static Function* function(const char* name) {
        return reinterpret_cast<Function*>(codec_function(name));
    }

    decltype(&TIFFOpen) open = function<decltype(TIFFOpen)>("TIFFOpen");
    decltype(&TIFFClose) close = function<decltype(TIFFClose)>("TIFFClose");
    decltype(&TIFFGetField) get = function<decltype(TIFFGetField)>("TIFFGetField");
    decltype(&TIFFSetField) set = function<decltype(TIFFSetField)>("TIFFSetField");
    decltype(&TIFFReadDirectory) next = function<decltype(TIFFReadDirectory)>("TIFFReadDirectory");
    decltype(&TIFFSetDirectory) select = function<decltype(TIFFSetDirectory)>("TIFFSetDirectory");
    decltype(&TIFFRewriteDirectory) rewrite = function<decltype(TIFFRewriteDirectory)>("TIFFRewriteDirectory");
    decltype(&TIFFGetStrileByteCount) size_of = function<decltype(TIFFGetStrileByteCount)>("TIFFGetStrileByteCount");
    decltype(&TIFFReadRawStrip) read_packed = function<decltype(TIFFReadRawStrip)>("TIFFReadRawStrip");
    decltype(&TIFFReadRawTile) read_packed_tile = function<decltype(TIFFReadRawTile)>("TIFFReadRawTile");
};

/// A TIFF whose first directory can be read and changed. What libtiff says is kept, see `Quiet`.
class OpenTiff {
public:
    OpenTiff(const std::filesystem::path& file, const MemoryFile& memory)
        : file_(file), tiff_(lib_.open(memory.name().c_str(), "r+"), lib_.close) {
        if (!tiff_)
            refuse_damaged();
    }

    /// A field's value, or what it is without the field.
    template <typename Value>
    Value value(std::uint32_t tag, Value otherwise) const {
        lib_.get(tiff_.get(), tag, &otherwise);
        return otherwise;
    }
    /// Likewise a list, whose count has this type.
    template <typename Count, typename Value>
    std::span<const Value> list(std::uint32_t tag) const {
        Count count = 0;
        const Value* values = nullptr;
        return lib_.get(tiff_.get(), tag, &count, &values) == 1 ? std::span(values, count) : std::span<const Value>();
    }
    template <typename... Values>
    void set(std::uint32_t tag, const Values&... values) {
        if (lib_.set(tiff_.get(), tag, values...) != 1)
            refuse_damaged();
        is_changed_ = true;
    }
    /// Others read the changes from here on.
    void write() {
        if (is_changed_ && lib_.rewrite(tiff_.get()) != 1)
            refuse_damaged();
        is_changed_ = false;
    }

    /// Images of full size.
    int pages() {
        constexpr int most = 1000; // to count more tells nobody more
        int count = 1;
        for (int read = 1; read < most && lib_.next(tiff_.get()) == 1; ++read)
            count += (value<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0;
        if (lib_.select(tiff_.get(), 0) != 1)
            refuse_damaged();
        Quiet::tiff_error().clear(); // what lies behind the first page may be anything
        return count;
    }

    /// A strip or tile as it is packed. `left`: bytes of the file that the others leave, of which it takes its own.
    Bytes packed(std::uint32_t number, bool tiled, std::uint64_t& left) const {
        const std::uint64_t size = lib_.size_of(tiff_.get(), number);
        Bytes bytes(size <= left ? size : 0);
        left -= bytes.size();
        const auto read = tiled ? lib_.read_packed_tile : lib_.read_packed;
        if (bytes.empty() ||
            read(tiff_.get(), number, bytes.data(), static_cast<tmsize_t>(size)) != static_cast<tmsize_t>(size))
            refuse_damaged();
        return bytes;
    }

    [[noreturn]] void refuse_damaged() const {
        const std::string& error = Quiet::tiff_error();
        refuse(file_,
               "is damaged or cut short" + (error.empty() ? "" : " (" + error + ")") + "; write or copy it again");
    }

private:
    LibTiff lib_;
    std::filesystem::path file_;
    std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff_;
    bool is_changed_ = false;
};

/// The first image of a TIFF, once it is known that its kind is read and that its pixels can be there.
class FirstImage {
public:
    FirstImage(const std::filesystem::path& file, OpenTiff& tiff, std::uint64_t stored)
        : file_(file), tiff_(tiff), stored_(stored) {
        check_kind();
        check_size_of(width_, height_);
        check_size_of(columns_, rows_);
        if (compression_ == COMPRESSION_DEFLATE || compression_ == COMPRESSION_ADOBE_DEFLATE)
            check_pieces();
    }

    /// Changes what OpenCV would take otherwise.
    void prepare() {
        if (bits_ == 16 && format_ == SAMPLEFORMAT_IEEEFP) // which OpenCV refuses; the bits stay the same
            tiff_.set(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
        if (bits_ == 32 && format_ == SAMPLEFORMAT_UINT) // likewise
            tiff_.set(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
        if (is_padded_)
            tiff_.set(TIFFTAG_IMAGELENGTH, height_there());
        if (turned_ != ORIENTATION_TOPLEFT)
            tiff_.set(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
        if (samples_ == 4 && bits_ == 8) { // libtiff would multiply another alpha in
            constexpr std::uint16_t associated = EXTRASAMPLE_ASSOCALPHA;
            tiff_.set(TIFFTAG_EXTRASAMPLES, 1, &associated);
        }
        tiff_.write();
    }

    cv::Mat read(const MemoryFile& memory) const {
        cv::Mat image = decoded(file_, memory, {int(width_), int(height_there())}).rowRange(0, int(height_));
        if (bits_ > 8 && (image.elemSize1() != bits_ / 8u || image.channels() != samples_))
            refuse_undecoded(file_);
        const auto as = [&](int depth) {
            return cv::Mat(image.size(), CV_MAKETYPE(depth, image.channels()), image.data, image.step).clone();
        };
        if (bits_ == 16 && format_ == SAMPLEFORMAT_IEEEFP)
            image = as(CV_16F);
        else if (bits_ == 16 && format_ == SAMPLEFORMAT_INT)
            as(CV_16S).convertTo(image, CV_32F); // which holds them all
        else if (bits_ == 32 && format_ != SAMPLEFORMAT_IEEEFP)
            image = as(CV_32S);
        return upright(image, turned_);
    }

private:
    void check_kind() const {
        const bool has_kind = bits_ == 8 ? true
                              : bits_ == 16
                                  ? format_ <= SAMPLEFORMAT_IEEEFP && (format_ != SAMPLEFORMAT_INT || samples_ == 1)
                              : bits_ == 32 ? format_ >= SAMPLEFORMAT_UINT && format_ <= SAMPLEFORMAT_IEEEFP
                                            : bits_ == 64 && format_ == SAMPLEFORMAT_IEEEFP;
        if (!has_kind)
            refuse(file_, "has samples of " + std::to_string(bits_) + " bits and of SampleFormat " +
                              std::to_string(format_) +
                              ", which are not read; save depth as 16-bit unsigned integers or as float");
        if (bits_ == 16 && tiff_.value<std::uint16_t>(TIFFTAG_PREDICTOR, PREDICTOR_NONE) == PREDICTOR_FLOATINGPOINT)
            refuse(file_, "has halves behind a predictor for floats, which is not read; save it without a predictor");
        if (!tiff_expansions.contains(compression_))
            refuse(file_, "has compression " + std::to_string(compression_) +
                              ", which is not read in a TIFF (JPEG, WebP and LERC among others); save it with Deflate");
        if (samples_ > 1 && tiff_.value<std::uint16_t>(TIFFTAG_PLANARCONFIG, 1) != PLANARCONFIG_CONTIG)
            refuse(file_, "keeps its channels in separate planes; save them interleaved (PlanarConfiguration 1)");
        const auto colors = tiff_.value<std::uint16_t>(TIFFTAG_PHOTOMETRIC, 0xffff);
        if (colors > (bits_ == 8 ? PHOTOMETRIC_PALETTE : PHOTOMETRIC_RGB) || samples_ < 1 || samples_ == 2 ||
            samples_ > 4)
            refuse(file_, "has " + std::to_string(samples_) + " samples a pixel of colours that are not read (" +
                              std::to_string(colors) + "); save it as R, G and B, or as one channel");
        if (tiff_.value<std::uint16_t>(TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) != FILLORDER_MSB2LSB)
            refuse(file_, "has the bits of its bytes in reverse order (FillOrder 2); save it again");
    }

    /// Can the file hold an image, or a piece, of this size?
    void check_size_of(std::uint32_t width, std::uint32_t height) const {
        check_size(file_, width, height);
        check_holds(file_, {int(width), int(height)}, samples_ * bits_ / 8u, stored_, tiff_expansions.at(compression_));
    }

    /// Some writers fill the last strip with rows below the image.
    std::uint32_t height_there() const { return is_padded_ ? (height_ + rows_ - 1) / rows_ * rows_ : height_; }

    /// libdeflate, which libtiff takes, stops somewhere before the end of a piece that inflates to more than its rows, and leaves memory
    /// as it is.
    void check_pieces() {
        const std::uint32_t across = (width_ + columns_ - 1) / columns_,
                            pieces = across * ((height_ + rows_ - 1) / rows_);
        std::uint64_t left = stored_; // pieces that share bytes would take long
        for (std::uint32_t i = 0; i < pieces; ++i) {
            const std::uint32_t rows_there = tiled_ ? rows_ : std::min(rows_, height_ - i * rows_);
            const std::uint64_t row = std::uint64_t{columns_} * samples_ * bits_ / 8,
                                held = inflated(tiff_.packed(i, tiled_, left), row * rows_ + 1, MAX_WBITS).size();
            is_padded_ = rows_there < rows_ && held == row * rows_;
            if (held > row * rows_there && !is_padded_)
                refuse(file_, std::string("has a ") + (tiled_ ? "tile" : "strip") +
                                  " with more rows than belong there, which is not read behind Deflate; save it "
                                  "again, or with LZW");
        }
    }

    const std::filesystem::path& file_;
    OpenTiff& tiff_;
    std::uint64_t stored_; // bytes of the file
    std::uint32_t width_ = tiff_.value<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0),
                  height_ = tiff_.value<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
    bool tiled_ = tiff_.value<std::uint32_t>(TIFFTAG_TILEWIDTH, 0) > 0;
    std::uint32_t columns_ = tiff_.value(TIFFTAG_TILEWIDTH, width_), // of a strip or tile
        rows_ = tiled_ ? tiff_.value<std::uint32_t>(TIFFTAG_TILELENGTH, 0)
                       : std::min(tiff_.value(TIFFTAG_ROWSPERSTRIP, height_), height_);
    std::uint16_t bits_ = tiff_.value<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1),
                  samples_ = tiff_.value<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1),
                  format_ = tiff_.value<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, 0),
                  compression_ = tiff_.value<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE),
                  turned_ = tiff_.value<std::uint16_t>(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    bool is_padded_ = false;
};

} // namespace

cv::Mat upright(cv::Mat image, int orientation) {
    constexpr int none = 2, flips[] = {none, none, 1, -1, 0, none, 1, -1, 0}; // as cv::flip has them
    if (orientation < 1 || orientation > 8)
        return image;
    if (orientation >= 5) // rows and columns have changed places
        image = image.t();
    if (flips[orientation] != none)
        cv::flip(image, image, flips[orientation]);
    return image;
}

PictureFile read_tiff(const std::filesystem::path& file, Bytes& bytes) {
    const MemoryFile memory(file, bytes);
    const std::uint64_t stored = bytes.size();
    Bytes().swap(bytes);
    PictureFile picture;
    std::optional<Quiet> quiet(std::in_place);
    OpenTiff tiff(file, memory);
    picture.pages = tiff.pages();
    const auto extra = tiff.list<std::uint16_t, std::uint16_t>(TIFFTAG_EXTRASAMPLES);
    if (!extra.empty() && extra[0] != EXTRASAMPLE_UNSPECIFIED)
        picture.straight_alpha = extra[0] == EXTRASAMPLE_UNASSALPHA;
    const View profile = tiff.list<std::uint32_t, unsigned char>(TIFFTAG_ICCPROFILE);
    picture.icc.assign(profile.begin(), profile.end());
    picture.has_more = tiff.value<std::uint64_t>(TIFFTAG_EXIFIFD, 0) > 0;
    FirstImage image(file, tiff, stored);
    image.prepare();
    quiet.reset();
    picture.image = image.read(memory);
    return picture;
}

Bytes tiff_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    constexpr std::uint64_t longest = 0xffff0000u; // offsets of 32 bits, and room for the directory
    if (bgr.total() * bgr.elemSize() + format.icc.size() > longest)
        throw Error("a .tif has less than 4 GiB, and this one had more; write an .exr or .npy");
    Bytes bytes = encoded(".tif", bgr, {cv::IMWRITE_TIFF_COMPRESSION, COMPRESSION_NONE});
    if (bgr.channels() < 4 && format.icc.empty())
        return bytes;
    const MemoryFile memory("a .tif", bytes);
    Bytes().swap(bytes);
    const Quiet here;
    OpenTiff tiff("a .tif", memory);
    if (bgr.channels() == 4) {
        const std::uint16_t alpha = bgr.depth() == CV_32F ? EXTRASAMPLE_UNSPECIFIED : EXTRASAMPLE_UNASSALPHA;
        tiff.set(TIFFTAG_EXTRASAMPLES, 1, &alpha);
    }
    if (!format.icc.empty())
        tiff.set(TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(format.icc.size()), format.icc.data());
    tiff.write();
    return read_file(memory.name(), longest + (1 << 16));
}

} // namespace fathom::io
