// TIFF. OpenCV decodes; the directory is walked here first, because a file whose strips lie beyond its end must be
// refused, and because OpenCV 4.6 knows neither unsigned 32-bit samples (what a D24 buffer is) nor half floats.
// Source: TIFF 6.0, section 2; the BigTIFF design of libtiff.
#include "formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>

namespace fathom::io {
namespace {

enum Tag : std::uint16_t {
    image_width = 256,
    image_length = 257,
    bits_per_sample = 258,
    compression = 259,
    photometric = 262,
    strip_offsets = 273,
    samples_per_pixel = 277,
    rows_per_strip = 278,
    strip_byte_counts = 279,
    inverse_depth = 284,
    tile_offsets = 324,
    tile_byte_counts = 325,
    extra_samples = 338,
    sample_format = 339
};
enum SampleFormat : std::uint16_t { unsigned_integer = 1, signed_integer = 2, ieee_float = 3 };

template <typename T>
void append(Bytes& bytes, T value) {
    const auto raw = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
    bytes.insert(bytes.end(), raw.begin(), raw.end());
}

/// The first directory of a TIFF.
class Directory {
public:
    Directory(const std::filesystem::path& file, Bytes& bytes)
        : file_(file), bytes_(bytes), little_(bytes[0] == 'I'), big_(get(2, 2) == 43) {
        const std::size_t at = get(big_ ? 8 : 4, big_ ? 8 : 4);
        const std::size_t count = get(at, big_ ? 8 : 2);
        const std::size_t entry = big_ ? 20 : 12;
        if (count > bytes_.size() / entry)
            damaged();
        get(at + (big_ ? 8 : 2) + count * entry,
            big_ ? 8 : 4); // where the next directory would be: the end of this one
        for (std::size_t i = 0; i < count; ++i) {
            const auto e = at + (big_ ? 8 : 2) + i * entry;
            const auto size = size_of(get(e + 2, 2));
            const auto n = get(e + 4, big_ ? 8 : 4);
            const auto inlined = std::size_t{big_ ? 8u : 4u};
            if (size == 0 || n > bytes_.size())
                continue; // a private tag that is nobody's business here, or nonsense in one that is asked for below
            const auto values = e + (big_ ? 12 : 8);
            fields_[static_cast<std::uint16_t>(get(e, 2))] = {size * n <= inlined ? values : get(values, inlined), n,
                                                              size};
        }
    }

    std::size_t count(Tag tag) const { return fields_.contains(tag) ? fields_.at(tag).count : 0; }

    std::uint64_t value(Tag tag, std::size_t index, std::uint64_t otherwise) const {
        if (index >= count(tag))
            return otherwise;
        const auto& field = fields_.at(tag);
        return get(field.at + index * field.size, field.size);
    }

    void replace(Tag tag, std::uint16_t value) {
        const auto& field = fields_.at(tag);
        for (std::size_t i = 0; i < field.count; ++i) {
            bytes_.at(field.at + i * field.size + (little_ ? 0 : 1)) = static_cast<unsigned char>(value & 0xff);
            bytes_.at(field.at + i * field.size + (little_ ? 1 : 0)) = static_cast<unsigned char>(value >> 8);
        }
    }

    /// Do all strips or tiles lie inside the file, and are there as many as the image needs?
    void check_extent() const {
        const auto width = value(image_width, 0, 0), height = value(image_length, 0, 0);
        check_size(file_, static_cast<long long>(width), static_cast<long long>(height));
        const bool tiled = count(tile_offsets) > 0;
        const auto offsets = tiled ? tile_offsets : strip_offsets;
        const auto counts = tiled ? tile_byte_counts : strip_byte_counts;
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < count(offsets); ++i) {
            const auto at = value(offsets, i, 0), size = value(counts, i, 0);
            if (at > bytes_.size() || size > bytes_.size() - at)
                damaged();
            sum += size;
        }
        const auto bits = value(bits_per_sample, 0, 1) * value(samples_per_pixel, 0, 1);
        if (sum == 0 || (value(compression, 0, 1) == 1 && sum < width * height * bits / 8))
            damaged();
    }

private:
    struct Field {
        std::size_t at = 0, count = 0, size = 0;
    };

    static std::size_t size_of(std::uint64_t type) {
        switch (type) {
        case 1:
            return 1; // BYTE
        case 3:
            return 2; // SHORT
        case 4:
            return 4; // LONG
        case 16:
            return 8; // LONG8
        default:
            return 0;
        }
    }

    std::uint64_t get(std::size_t at, std::size_t size) const {
        if (at > bytes_.size() || size > bytes_.size() - at)
            damaged();
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i)
            value = value << 8 | bytes_[little_ ? at + size - 1 - i : at + i];
        return value;
    }

    [[noreturn]] void damaged() const {
        refuse(file_,
               "is damaged or cut short: its TIFF directory points beyond what is there; write or copy it again");
    }

    const std::filesystem::path& file_;
    Bytes& bytes_;
    bool little_;
    bool big_;
    std::map<std::uint16_t, Field> fields_;
};

} // namespace

std::optional<cv::Mat> read_tiff(const std::filesystem::path& file, const Bytes& content) {
    const auto begins = [&](std::initializer_list<unsigned char> magic) {
        return content.size() >= magic.size() && std::equal(magic.begin(), magic.end(), content.begin());
    };
    if (!begins({'I', 'I', 42, 0}) && !begins({'I', 'I', 43, 0}) && !begins({'M', 'M', 0, 42}) &&
        !begins({'M', 'M', 0, 43}))
        return std::nullopt;

    auto bytes = content;
    Directory directory(file, bytes);
    directory.check_extent();
    const auto bits = directory.value(bits_per_sample, 0, 1);
    const auto format = directory.value(sample_format, 0, unsigned_integer);
    const bool half = bits == 16 && format == ieee_float;
    if (bits != 8 && bits != 16 && bits != 32 && bits != 64)
        refuse(file, "has samples of " + std::to_string(bits) + " bits; save depth as 16-bit or as float");
    if (bits == 16 && format == signed_integer)
        refuse(file, "has signed 16-bit samples; save depth as unsigned 16-bit or as float");
    if (bits == 32 && format == unsigned_integer && directory.count(sample_format) == 0)
        refuse(file,
               "has 32-bit samples without saying of what kind (SampleFormat); save it as signed 32-bit or as float");
    // Same bits, under a name that OpenCV knows.
    if (bits == 32 && format == unsigned_integer)
        directory.replace(sample_format, signed_integer);
    if (half)
        directory.replace(sample_format, unsigned_integer);

    auto image = decode_with_opencv(file, bytes);
    return half ? cv::Mat(image.size(), CV_16FC(image.channels()), image.data, image.step).clone() : image;
}

// One strip, no compression: readable by everything, and OpenCV would turn three float channels into lossy LogLuv.
Bytes tiff_bytes(const cv::Mat& image) {
    struct Entry {
        Tag tag;
        std::uint16_t type;
        std::uint32_t count, value;
    };
    constexpr std::uint16_t is_short = 3, is_long = 4;
    const auto width = static_cast<std::uint32_t>(image.cols), height = static_cast<std::uint32_t>(image.rows);
    const auto channels = static_cast<std::uint32_t>(image.channels());
    const auto row_bytes = width * image.elemSize();
    const auto size = row_bytes * height;
    if (size > 0xffff0000u)
        throw Error("a .tif ends at 4 GiB, the image has " + std::to_string(size >> 20) + " MiB; write an .exr");

    constexpr std::uint32_t grey = 1, rgb = 2, uncompressed = 1, interleaved = 1;
    const bool coloured = channels >= 3;
    std::vector<Entry> entries{
        {image_width, is_long, 1, width},
        {image_length, is_long, 1, height},
        {bits_per_sample, is_short, channels, 32},
        {compression, is_short, 1, uncompressed},
        {photometric, is_short, 1, coloured ? rgb : grey},
        {strip_offsets, is_long, 1, 0},
        {samples_per_pixel, is_short, 1, channels},
        {rows_per_strip, is_long, 1, height},
        {strip_byte_counts, is_long, 1, static_cast<std::uint32_t>(size)},
        {inverse_depth, is_short, 1, interleaved},
    };
    if (channels == 4)
        entries.push_back({extra_samples, is_short, 1, 0});
    entries.push_back({sample_format, is_short, channels, ieee_float});

    // One value a channel is more than an entry holds when there are three: those lists follow the directory.
    auto list = 8 + 2 + 12 * static_cast<std::uint32_t>(entries.size()) + 4;
    const auto list_bytes = 2 * channels;
    const auto pixels = list + (coloured ? 2 * list_bytes : 0);

    Bytes bytes;
    bytes.reserve(pixels + size);
    const auto put16 = [&bytes](std::uint32_t value) { append(bytes, static_cast<std::uint16_t>(value)); };
    const auto put32 = [&bytes](std::uint32_t value) { append(bytes, value); };
    const char order = std::endian::native == std::endian::little ? 'I' : 'M';
    append(bytes, order);
    append(bytes, order);
    put16(42);
    put32(8);
    put16(static_cast<std::uint32_t>(entries.size()));
    for (const auto& entry : entries) {
        put16(entry.tag);
        put16(entry.type);
        put32(entry.count);
        if (entry.count > 1) {
            put32(list);
            list += list_bytes;
        } else if (entry.type == is_short) {
            put16(entry.value);
            put16(0);
        } else {
            put32(entry.tag == strip_offsets ? pixels : entry.value);
        }
    }
    put32(0); // no further directory
    for (const auto& entry : entries)
        for (std::uint32_t i = 0; entry.count > 1 && i < entry.count; ++i)
            put16(entry.value);
    for (int y = 0; y < image.rows; ++y)
        bytes.insert(bytes.end(), image.ptr(y), image.ptr(y) + row_bytes);
    return bytes;
}

} // namespace fathom::io
