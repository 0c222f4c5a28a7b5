// TIFF 6.0 and BigTIFF. libtiff, behind OpenCV, leaves memory as it is where strips or tiles hold less than they should, and OpenCV
// forgives its errors in 8 bits. So the directory is checked first, and OpenCV is given one of what was checked.
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
#include <set>
#include <vector>

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
        if (next_ == 0 || !seen_.insert(next_).second)
            return false;
        fields_.clear();
        const std::uint64_t count = number(next_, big_ ? 8 : 2), first = next_ + (big_ ? 8 : 2);
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t at = first + i * entry();
            Field field{number(at + 2, 2), number(at + 4, big_ ? 8 : 4), at + (big_ ? 12 : 8)};
            if (field.size() != 0 && field.count > bytes_.size() / field.size())
                field.count = 0; // as if it were not there
            if (field.size() * field.count > (big_ ? 8 : 4))
                field.at = number(field.at, big_ ? 8 : 4);
            if (field.size() != 0 && field.count != 0)
                fields_.emplace(Tag(number(at, 2)), field);
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

    /// A field of a new directory; `bytes` of each of its values.
    struct NewField {
        Tag tag;
        std::uint64_t bytes;
        std::vector<std::uint64_t> values;
    };

    /// Makes these fields, in the order of their tags, the only directory of the file.
    void replace_by(const std::vector<NewField>& fields) {
        const std::uint64_t word = big_ ? 8 : 4;
        Bytes directory;
        append(directory, fields.size(), big_ ? 8 : 2);
        for (const auto& [tag, size, values] : fields) {
            Bytes content;
            for (const std::uint64_t value : values)
                append(content, value, size);
            append(directory, tag, 2);
            append(directory, size == 2 ? TIFF_SHORT : size == 4 ? TIFF_LONG : TIFF_LONG8, 2);
            append(directory, values.size(), word);
            if (content.size() > word) {
                append(directory, bytes_.size(), word);
                bytes_.insert(bytes_.end(), content.begin(), content.end());
                bytes_.resize((bytes_.size() + 1) / 2 * 2); // all begins at even places
            } else {
                content.resize(word);
                directory.insert(directory.end(), content.begin(), content.end());
            }
        }
        append(directory, 0, word); // and no further directory
        bytes_.resize((bytes_.size() + 1) / 2 * 2);
        if (!big_ && bytes_.size() > 0xffffffffu)
            refuse(file_, "has more bytes than the numbers of its kind count; save it as BigTIFF");
        Bytes place;
        append(place, bytes_.size(), word);
        std::ranges::copy(place, bytes_.begin() + (big_ ? 8 : 4));
        bytes_.insert(bytes_.end(), directory.begin(), directory.end());
    }

    std::uint64_t word() const { return big_ ? 8 : 4; }

    View content(Tag tag) const {
        const Field& field = fields_.at(tag);
        value(tag, 0, field.count - 1); // it lies within the file
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

    void append(Bytes& to, std::uint64_t number, std::uint64_t size) const {
        for (std::uint64_t i = 0; i < size; ++i)
            to.push_back(static_cast<unsigned char>(number >> (8 * (little_ ? i : size - 1 - i))));
    }

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
    std::set<std::uint64_t> seen_; // where directories lie
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

    /// Gives OpenCV a directory of what was checked, where halves and unsigned integers go as other numbers, whose bits it has.
    cv::Mat read() {
        const std::uint64_t format = bits_ <= 16 ? SAMPLEFORMAT_UINT : SAMPLEFORMAT_IEEEFP, word = d_.word();
        std::vector<Directories::NewField> fields{{TIFFTAG_IMAGEWIDTH, 4, {width_}},
                                                  {TIFFTAG_IMAGELENGTH, 4, {height_}},
                                                  {TIFFTAG_BITSPERSAMPLE, 2, std::vector(samples_, bits_)},
                                                  {TIFFTAG_COMPRESSION, 2, {compression_}},
                                                  {TIFFTAG_PHOTOMETRIC, 2, {d_.value(TIFFTAG_PHOTOMETRIC, 0)}},
                                                  {TIFFTAG_SAMPLESPERPIXEL, 2, {samples_}},
                                                  {TIFFTAG_PLANARCONFIG, 2, {PLANARCONFIG_CONTIG}},
                                                  {TIFFTAG_PREDICTOR, 2, {d_.value(TIFFTAG_PREDICTOR, PREDICTOR_NONE)}},
                                                  {TIFFTAG_SAMPLEFORMAT, 2, std::vector(samples_, format)}};
        if (tiled_) {
            fields.push_back({TIFFTAG_TILEWIDTH, 4, {columns_}});
            fields.push_back({TIFFTAG_TILELENGTH, 4, {rows_}});
        } else {
            fields.push_back({TIFFTAG_ROWSPERSTRIP, 4, {rows_}});
        }
        fields.push_back({tiled_ ? Tag{TIFFTAG_TILEOFFSETS} : Tag{TIFFTAG_STRIPOFFSETS}, word, offsets_});
        fields.push_back({tiled_ ? Tag{TIFFTAG_TILEBYTECOUNTS} : Tag{TIFFTAG_STRIPBYTECOUNTS}, word, counts_});
        if (samples_ == 4) // of codes libtiff would multiply another alpha in
            fields.push_back({TIFFTAG_EXTRASAMPLES, 2, {EXTRASAMPLE_ASSOCALPHA}});
        if (d_.has(TIFFTAG_COLORMAP)) {
            fields.push_back({TIFFTAG_COLORMAP, 2, {}});
            for (std::uint64_t i = 0; i < d_.count(TIFFTAG_COLORMAP); ++i)
                fields.back().values.push_back(d_.value(TIFFTAG_COLORMAP, 0, i));
        }
        std::ranges::sort(fields, {}, &Directories::NewField::tag);
        const std::uint64_t turned = d_.value(TIFFTAG_ORIENTATION, 1);
        d_.replace_by(fields);
        cv::Mat image = decoded(file_, bytes_, {int(width_), int(height_)});
        if (bits_ > 8 && (image.elemSize1() != bits_ / 8 || std::uint64_t(image.channels()) != samples_))
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
        if (bits_ > 8 &&
            (format_ > SAMPLEFORMAT_IEEEFP || (bits_ == 16 && format_ == SAMPLEFORMAT_INT && samples_ > 1)))
            refuse(file_, "has samples of a kind that is not read (SampleFormat " + std::to_string(format_) +
                              "); save it as unsigned integers or as float");
        if (bits_ == 16 && d_.value(TIFFTAG_PREDICTOR, PREDICTOR_NONE) == PREDICTOR_FLOATINGPOINT)
            refuse(file_, "has halves behind a predictor for floats, which is not read; save it without a predictor");
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
        tiled_ = d_.has(TIFFTAG_TILEWIDTH);
        columns_ = d_.value(TIFFTAG_TILEWIDTH, width_);
        rows_ = tiled_ ? d_.value(TIFFTAG_TILELENGTH, 0) : std::min(d_.value(TIFFTAG_ROWSPERSTRIP, height_), height_);
        check_size_of(columns_, rows_);
        const std::uint64_t across = (width_ + columns_ - 1) / columns_,
                            pieces = across * ((height_ + rows_ - 1) / rows_);
        const Tag offsets = d_.has(TIFFTAG_TILEOFFSETS) && tiled_ ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS,
                  counts = d_.has(TIFFTAG_TILEBYTECOUNTS) && tiled_ ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS;
        if (d_.count(offsets) < pieces)
            d_.refuse_damaged();
        Bytes content;
        for (std::uint64_t i = 0; i < pieces; ++i) {
            const std::uint64_t rows_there = tiled_ ? rows_ : std::min(rows_, height_ - i / across * rows_),
                                bytes = columns_ * rows_there * samples_ * bits_ / 8, at = d_.value(offsets, 0, i);
            if (at > bytes_.size())
                d_.refuse_damaged();
            const std::uint64_t said = i < d_.count(counts) ? d_.value(counts, 0, i) : 0, rest = bytes_.size() - at,
                                count = compression_ == COMPRESSION_NONE ? bytes // libtiff works out a wrong one
                                        : said == 0 && pieces == 1       ? rest
                                                                         : said;
            if (count == 0 || count > rest)
                d_.refuse_damaged();
            offsets_.push_back(at);
            counts_.push_back(count);
            if (compression_ != COMPRESSION_DEFLATE && compression_ != COMPRESSION_ADOBE_DEFLATE)
                continue;
            // libdeflate, which libtiff takes, stops somewhere before the end of a piece that inflates to more than its rows.
            content.resize(bytes);
            const auto found = compare_inflated(View(bytes_).subspan(at, count), content);
            if (found < 0)
                d_.refuse_damaged();
            if (found > 0) {
                const Bytes cut = deflated(content);
                offsets_.back() = bytes_.size();
                counts_.back() = cut.size();
                bytes_.insert(bytes_.end(), cut.begin(), cut.end());
            }
        }
    }

    const std::filesystem::path& file_;
    Bytes& bytes_;
    Directories& d_;
    std::uint64_t width_, height_, bits_, samples_, format_, compression_;
    bool tiled_ = false;
    std::uint64_t columns_ = 0, rows_ = 0; // of a piece
    std::vector<std::uint64_t> offsets_, counts_;
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
    try {
        Directories more = first;
        for (int read = 1; read < most && more.read(); ++read)
            picture.pages += (more.value(TIFFTAG_SUBFILETYPE, 0) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0;
    } catch (const Error&) { // what lies behind the first page may be anything
    }
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
