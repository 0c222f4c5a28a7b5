// TIFF 6.0 and BigTIFF. libtiff, behind OpenCV, leaves memory as it is where strips or tiles hold less than they should, and OpenCV
// forgives its errors in 8 bits. So the directory is checked first, and changed in the bytes where OpenCV takes it otherwise.
#include "codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <tiff.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <memory>

namespace fathom::io {
namespace {

using Tag = std::uint16_t;

/// Compressions that are read, and `expansion` of `check_holds`.
const std::map<std::uint64_t, std::uint64_t> tiff_expansions{
    {COMPRESSION_NONE, 1},
    {COMPRESSION_PACKBITS, 64}, // 128 bytes of 2
    {COMPRESSION_LZW, 2560},    // 3840 bytes of 12 bits
    {COMPRESSION_DEFLATE, expansion::deflate},
    {COMPRESSION_ADOBE_DEFLATE, expansion::deflate},
    {COMPRESSION_LZMA, 1u << 13},  // 273 bytes of 14 decisions, of 0.022 bits each
    {COMPRESSION_ZSTD, 1u << 15}}; // 128 KiB of a block of 4 bytes

/// Directories of a file, one at a time.
class Directories {
public:
    Directories(const std::filesystem::path& file, Bytes& bytes)
        : file_(file), bytes_(bytes), little_(bytes.at(0) == 'I'), big_(bytes.at(little_ ? 2 : 3) == 43) {
        next_ = big_ ? number(8, 8) : number(4, 4);
    }

    /// Reads the next one. There may be none.
    bool read() {
        if (next_ == 0)
            return false;
        fields_.clear();
        const std::uint64_t count = number(next_, big_ ? 8 : 2), first = next_ + (big_ ? 8 : 2);
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t at = first + i * entry();
            Field field{number(at + 2, 2), number(at + 4, big_ ? 8 : 4), at + (big_ ? 12 : 8)};
            if (field.size() != 0 && field.count > bytes_.size() / field.size())
                refuse_damaged();
            if (field.size() * field.count > (big_ ? 8 : 4))
                field.at = number(field.at, big_ ? 8 : 4);
            if (!fields_.emplace(Tag(number(at, 2)), field).second)
                refuse_damaged(); // the same one twice
        }
        next_ = number(first + count * entry(), big_ ? 8 : 4);
        return true;
    }

    bool has(Tag tag) const { return fields_.contains(tag); }
    std::uint64_t count(Tag tag) const { return has(tag) ? fields_.at(tag).count : 0; }

    /// One of a field's values, or what it is without the field.
    std::uint64_t value(Tag tag, std::uint64_t otherwise, std::uint64_t i = 0) const {
        if (!has(tag))
            return otherwise;
        const Field& field = fields_.at(tag);
        if (i >= field.count || field.size() == 0)
            refuse_damaged();
        return number(field.at + i * field.size(), field.size());
    }

    /// The value that all samples have.
    std::uint64_t value_of_all(Tag tag, std::uint64_t otherwise) const {
        const std::uint64_t first = value(tag, otherwise);
        for (std::uint64_t i = 1; i < count(tag); ++i)
            if (value(tag, 0, i) != first)
                refuse(file_, "has samples of different kinds; save them all alike");
        return first;
    }

    void set_all(Tag tag, std::uint64_t to) {
        for (std::uint64_t i = 0; i < count(tag); ++i)
            set(tag, i, to);
    }

    void set(Tag tag, std::uint64_t i, std::uint64_t to) {
        value(tag, 0, i); // it lies within the file
        const Field& field = fields_.at(tag);
        for (std::uint64_t byte = 0; byte < field.size(); ++byte)
            bytes_[field.at + i * field.size() + (little_ ? byte : field.size() - 1 - byte)] =
                static_cast<unsigned char>(to >> (8 * byte));
    }

    View content(Tag tag) const {
        const Field& field = fields_.at(tag);
        if (field.count > 0)
            value(tag, 0, field.count - 1);
        return View(bytes_).subspan(field.at, field.count * field.size());
    }

    [[noreturn]] void refuse_damaged() const { refuse(file_, "is damaged or cut short; write or copy it again"); }

private:
    struct Field {
        std::uint64_t type, count, at;

        /// Bytes of a value that is an integer; 0 of others.
        std::uint64_t size() const {
            static constexpr std::uint64_t sizes[] = {0, 1, 1, 2, 4, 0, 1, 1, 2, 4, 0, 0, 0, 4, 0, 0, 8, 8, 8};
            return type < std::size(sizes) ? sizes[type] : 0;
        }
    };

    std::uint64_t entry() const { return big_ ? 20 : 12; }

    std::uint64_t number(std::uint64_t at, std::uint64_t size) const {
        if (at > bytes_.size() || bytes_.size() - at < size)
            refuse_damaged();
        std::uint64_t number = 0;
        for (std::uint64_t i = 0; i < size; ++i)
            number = number << 8 | bytes_[at + (little_ ? size - 1 - i : i)];
        return number;
    }

    const std::filesystem::path& file_;
    Bytes& bytes_;
    bool little_, big_;
    std::uint64_t next_ = 0;
    std::map<Tag, Field> fields_;
};

/// Whether deflated bytes stand for fewer bytes than `content` has, which is filled, for as many, or for more: -1, 0 or 1.
int compare_inflated(View packed, Bytes& content) {
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK)
        throw std::bad_alloc();
    const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
    stream.next_in = const_cast<unsigned char*>(packed.data());
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(packed.size(), std::numeric_limits<uInt>::max()));
    const auto fill = [&](unsigned char* to, std::size_t size) {
        stream.next_out = to;
        stream.avail_out = static_cast<uInt>(size);
        inflate(&stream, Z_NO_FLUSH);
        return stream.avail_out == 0;
    };
    unsigned char one_more = 0;
    return !fill(content.data(), content.size()) ? -1 : fill(&one_more, 1) ? 1 : 0;
}

/// The image of a directory, once it is known that its pixels are there.
class FirstImage {
public:
    FirstImage(const std::filesystem::path& file, Bytes& bytes, Directories& directory)
        : file_(file), bytes_(bytes), d_(directory), width_(d_.value(TIFFTAG_IMAGEWIDTH, 0)),
          height_(d_.value(TIFFTAG_IMAGELENGTH, 0)), bits_(d_.value_of_all(TIFFTAG_BITSPERSAMPLE, 1)),
          samples_(d_.value(TIFFTAG_SAMPLESPERPIXEL, 1)), format_(d_.value_of_all(TIFFTAG_SAMPLEFORMAT, 0)),
          compression_(d_.value(TIFFTAG_COMPRESSION, COMPRESSION_NONE)) {
        check_kind();
        check_pieces();
    }

    cv::Mat read() {
        const std::uint64_t turned = d_.value(TIFFTAG_ORIENTATION, 1);
        d_.set_all(TIFFTAG_ORIENTATION, 1); // which OpenCV turns in some kinds
        if (bits_ == 8)
            d_.set_all(TIFFTAG_EXTRASAMPLES, EXTRASAMPLE_ASSOCALPHA); // libtiff would multiply another alpha in
        else // OpenCV has the bits of halves and of unsigned integers if they go as other numbers
            d_.set_all(TIFFTAG_SAMPLEFORMAT, bits_ == 16 ? SAMPLEFORMAT_UINT : SAMPLEFORMAT_IEEEFP);
        cv::Mat image = decoded(file_, bytes_);
        const bool as_said = image.elemSize1() == bits_ / 8 && std::uint64_t(image.channels()) == samples_;
        if (image.size() != cv::Size(int(width_), int(height_)) || (bits_ > 8 && !as_said))
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
        return upright(image, turned <= 8 ? int(turned) : 1);
    }

private:
    void check_kind() const {
        const std::uint64_t colors = d_.value(TIFFTAG_PHOTOMETRIC, 0xffff);
        if (colors == 0xffff)
            d_.refuse_damaged();
        if (!tiff_expansions.contains(compression_))
            refuse(file_, "has compression " + std::to_string(compression_) +
                              ", which is not read in a TIFF (JPEG, WebP and LERC among others); save it with Deflate");
        if (bits_ != 8 && bits_ != 16 && bits_ != 32 && bits_ != 64)
            refuse(file_, "has samples of " + std::to_string(bits_) + " bits; save depth as 16-bit or as float");
        if (bits_ == 64 && format_ != SAMPLEFORMAT_IEEEFP)
            refuse(file_, "has integers of 64 bits; save depth as integers of 16 bits or as float");
        if (bits_ == 32 && format_ == 0)
            refuse(file_, "has 32-bit samples without saying of what kind (SampleFormat); save it as signed 32-bit or "
                          "as float");
        if (samples_ > 1 && d_.value(TIFFTAG_PLANARCONFIG, 1) != PLANARCONFIG_CONTIG) // OpenCV takes one for all
            refuse(file_, "keeps its channels in separate planes; save them interleaved (PlanarConfiguration 1)");
        if (colors > (bits_ == 8 ? PHOTOMETRIC_PALETTE : PHOTOMETRIC_RGB) || samples_ < 1 || samples_ == 2 ||
            samples_ > 4)
            refuse(file_, "has " + std::to_string(samples_) + " samples a pixel of colours that are not read (" +
                              std::to_string(colors) + "); save it as R, G and B, or as one channel");
        if (d_.value(TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) != FILLORDER_MSB2LSB)
            refuse(file_, "has the bits of its bytes in reverse order (FillOrder 2); save it again");
    }

    /// Can the file hold an image, or a piece, of this size?
    void check_size_of(std::uint64_t width, std::uint64_t height) const {
        constexpr std::uint64_t beyond = 1u << 31; // all that is refused
        check_codec_size(file_, static_cast<long long>(std::min(width, beyond)),
                         static_cast<long long>(std::min(height, beyond)));
        check_holds(file_, {int(width), int(height)}, samples_ * bits_ / 8, bytes_.size(),
                    tiff_expansions.at(compression_));
    }

    /// Strips or tiles lie in the file and are as long as they should be.
    void check_pieces() {
        check_size_of(width_, height_);
        const bool tiled = d_.has(TIFFTAG_TILEWIDTH);
        const std::uint64_t columns = d_.value(TIFFTAG_TILEWIDTH, width_),
                            rows = tiled ? d_.value(TIFFTAG_TILELENGTH, 0)
                                         : std::min(d_.value(TIFFTAG_ROWSPERSTRIP, height_), height_);
        check_size_of(columns, rows);
        const std::uint64_t across = (width_ + columns - 1) / columns, pieces = across * ((height_ + rows - 1) / rows);
        const Tag offsets = tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS,
                  counts = tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS;
        if (d_.count(offsets) < pieces || d_.count(counts) < pieces)
            d_.refuse_damaged();
        Bytes content;
        for (std::uint64_t i = 0; i < pieces; ++i) {
            const std::uint64_t rows_there = tiled ? rows : std::min(rows, height_ - i / across * rows),
                                bytes = columns * rows_there * samples_ * bits_ / 8, at = d_.value(offsets, 0, i),
                                count = d_.value(counts, 0, i);
            const bool packed = compression_ != COMPRESSION_NONE;
            const std::uint64_t stored = packed ? count : bytes;
            if (stored == 0 || at > bytes_.size() || stored > bytes_.size() - at)
                d_.refuse_damaged();
            if (!packed)
                d_.set(counts, i, bytes); // a wrong one would be refused
            if (compression_ != COMPRESSION_DEFLATE && compression_ != COMPRESSION_ADOBE_DEFLATE)
                continue;
            // libdeflate, which libtiff takes, stops somewhere before the end of a piece that inflates to more than its rows.
            content.resize(bytes);
            const auto found = compare_inflated(View(bytes_).subspan(at, count), content);
            if (found < 0)
                d_.refuse_damaged();
            if (found > 0) {
                const Bytes cut = deflated(content);
                d_.set(offsets, i, bytes_.size());
                d_.set(counts, i, cut.size());
                bytes_.insert(bytes_.end(), cut.begin(), cut.end());
            }
        }
    }

    const std::filesystem::path& file_;
    Bytes& bytes_;
    Directories& d_;
    std::uint64_t width_, height_, bits_, samples_, format_, compression_;
};

/// Adds fields to a TIFF that OpenCV wrote on this machine, in a directory behind all that there is: bytes of no type, or a short.
void add_tiff_fields(Bytes& bytes, const std::map<Tag, Bytes>& fields) {
    const auto put = [&](std::size_t at, auto number) {
        bytes.resize(std::max(bytes.size(), at + sizeof number));
        std::memcpy(bytes.data() + at, &number, sizeof number);
    };
    std::uint32_t old = 0;
    std::uint16_t count = 0;
    std::memcpy(&old, bytes.data() + 4, 4);
    std::memcpy(&count, bytes.data() + old, 2);
    std::map<Tag, std::array<unsigned char, 12>> entries;
    for (std::size_t i = 0; i < count; ++i) {
        Tag tag = 0;
        std::memcpy(&tag, bytes.data() + old + 2 + 12 * i, 2);
        std::memcpy(entries[tag].data(), bytes.data() + old + 2 + 12 * i, 12);
    }
    for (const auto& [tag, content] : fields) {
        const bool is_short = content.size() == 2;
        const std::size_t entry = bytes.size();
        put(entry, tag);
        put(entry + 2, is_short ? std::uint16_t{TIFF_SHORT} : std::uint16_t{TIFF_UNDEFINED});
        put(entry + 4, is_short ? 1u : static_cast<std::uint32_t>(content.size()));
        put(entry + 8, static_cast<std::uint32_t>(entry));
        if (content.size() <= 4)
            std::ranges::copy(content, bytes.begin() + static_cast<std::ptrdiff_t>(entry + 8));
        std::memcpy(entries[tag].data(), bytes.data() + entry, 12);
        bytes.resize(entry);
        if (content.size() > 4)
            bytes.insert(bytes.end(), content.begin(), content.end());
        bytes.resize((bytes.size() + 1) / 2 * 2); // all begins at even places
    }
    put(4, static_cast<std::uint32_t>(bytes.size()));
    put(bytes.size(), static_cast<std::uint16_t>(entries.size()));
    for (const auto& [tag, entry] : entries)
        bytes.insert(bytes.end(), entry.begin(), entry.end());
    put(bytes.size(), std::uint32_t{0}); // and no further directory
}

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
    constexpr int most = 1000; // to count more tells nobody more
    PictureFile picture;
    Directories first(file, bytes);
    if (!first.read())
        first.refuse_damaged();
    for (Directories more = first; picture.pages < most && more.read();)
        picture.pages += (more.value(TIFFTAG_SUBFILETYPE, 0) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0;
    const std::uint64_t kind = first.value(TIFFTAG_EXTRASAMPLES, 0);
    if (kind == EXTRASAMPLE_ASSOCALPHA || kind == EXTRASAMPLE_UNASSALPHA)
        picture.straight_alpha = kind == EXTRASAMPLE_UNASSALPHA;
    if (first.has(TIFFTAG_ICCPROFILE)) {
        const View profile = first.content(TIFFTAG_ICCPROFILE);
        picture.icc.assign(profile.begin(), profile.end());
    }
    picture.has_more = first.has(TIFFTAG_EXIFIFD);
    picture.image = FirstImage(file, bytes, first).read();
    return picture;
}

Bytes tiff_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    constexpr std::uint64_t longest = 0xffff0000u; // offsets of 32 bits, and room for the directory
    if (bgr.total() * bgr.elemSize() + format.icc.size() > longest)
        throw Error("a .tif has less than 4 GiB, and this one had more; write an .exr or .npy");
    Bytes bytes = encoded(".tif", bgr, {cv::IMWRITE_TIFF_COMPRESSION, COMPRESSION_NONE});
    using Byte = Bytes::value_type;
    std::map<Tag, Bytes> more;
    if (bgr.channels() == 4)
        more[TIFFTAG_EXTRASAMPLES] = {
            bgr.depth() == CV_32F ? Byte{EXTRASAMPLE_UNSPECIFIED} : Byte{EXTRASAMPLE_UNASSALPHA}, 0};
    if (!format.icc.empty())
        more[TIFFTAG_ICCPROFILE] = format.icc;
    if (!more.empty())
        add_tiff_fields(bytes, more);
    return bytes;
}

} // namespace fathom::io
