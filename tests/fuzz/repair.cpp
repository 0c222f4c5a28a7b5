#include "repair.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace fathom::fuzz {
namespace {

/// Numbers at places of the bytes behind the choice.
class Numbers {
public:
    explicit Numbers(Bytes& input) : bytes_(std::span(input).subspan(std::min<std::size_t>(1, input.size()))) {}

    std::size_t size() const { return bytes_.size(); }
    std::span<unsigned char> bytes() const { return bytes_; }
    std::uint64_t get(std::size_t at, std::size_t count) const {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < count; ++i)
            value = value << 8 | bytes_[at + (big ? i : count - 1 - i)];
        return value;
    }
    void set(std::size_t at, std::size_t count, std::uint64_t value) const {
        for (std::size_t i = 0; i < count; ++i)
            bytes_[at + (big ? count - 1 - i : i)] = static_cast<unsigned char>(value >> 8 * i);
    }

    bool big = false; ///< the byte order

private:
    std::span<unsigned char> bytes_;
};

/// The text up to a zero, and the place behind it; the end where there is no zero.
std::string_view name_at(const Numbers& file, std::size_t& at) {
    const auto rest = file.bytes().subspan(at);
    const auto length = static_cast<std::size_t>(std::ranges::find(rest, 0) - rest.begin());
    at = std::min(at + length + 1, file.size());
    return {reinterpret_cast<const char*>(rest.data()), length};
}

/// What the header of an EXR says about its chunks.
struct ExrHeader {
    std::int64_t left = 0, top = 0, width = 0, height = 0;
    std::int64_t tile_width = 0, tile_height = 0; ///< 0: scan lines
    std::size_t compression = 0;
    bool has_levels = false; ///< images of half the size, whose chunks are not counted here
    std::size_t end = 0;     ///< where the table of chunks begins; 0: there is none
};

ExrHeader header_of(const Numbers& file) {
    ExrHeader header;
    for (std::size_t at = 8; at < file.size();) {
        if (file.bytes()[at] == 0) {
            header.end = at + 1;
            break;
        }
        const std::string_view name = name_at(file, at);
        name_at(file, at);
        if (file.size() - at < 4)
            break;
        const std::uint64_t size = file.get(at, 4);
        at += 4;
        if (size > file.size() - at)
            break;
        const auto number = [&](std::size_t i) {
            return std::int64_t{static_cast<std::int32_t>(file.get(at + 4 * i, 4))};
        };
        if (name == "dataWindow" && size == 16) {
            header.left = number(0);
            header.top = number(1);
            header.width = number(2) - number(0) + 1;
            header.height = number(3) - number(1) + 1;
        } else if (name == "compression" && size == 1) {
            header.compression = file.bytes()[at];
        } else if (name == "tiles" && size == 9) {
            header.tile_width = number(0);
            header.tile_height = number(1);
            header.has_levels = (file.bytes()[at + 8] & 0x0f) != 0;
        }
        at += size;
    }
    return header;
}

} // namespace

void repair_png(Bytes& input) {
    Numbers file(input);
    file.big = true;
    constexpr std::array<unsigned char, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (file.size() < signature.size())
        return;
    std::ranges::copy(signature, file.bytes().begin());
    for (std::size_t at = signature.size(); file.size() - at >= 12;) {
        const std::size_t length = std::min<std::size_t>(file.get(at, 4), file.size() - at - 12);
        file.set(at, 4, length);
        file.set(at + 8 + length, 4, crc32_z(0, file.bytes().data() + at + 4, length + 4));
        at += length + 12;
    }
}

void repair_tiff(Bytes& input) {
    Numbers file(input);
    constexpr std::size_t least = 16 + 8 + 20 + 8;
    if (file.size() < least)
        return;
    file.big = file.bytes()[0] == 'M';
    file.set(0, 2, file.big ? 0x4d4d : 0x4949);
    const bool is_bigtiff = file.get(2, 2) == 43;
    const std::size_t word = is_bigtiff ? 8 : 4, count_bytes = is_bigtiff ? 8 : 2, entry = is_bigtiff ? 20 : 12;
    const std::size_t head = is_bigtiff ? 16 : 8, first = head - word;
    if (is_bigtiff)
        file.set(4, 4, file.big ? 0x80000 : 8); // bytes of an offset, and 0
    else
        file.set(2, 2, 42);
    if (file.get(first, word) < head || file.get(first, word) > file.size() - count_bytes - entry - word)
        file.set(first, word, head);
    const auto directory = static_cast<std::size_t>(file.get(first, word));
    const std::size_t entries =
        std::min<std::size_t>(file.get(directory, count_bytes), (file.size() - directory - count_bytes - word) / entry);
    file.set(directory, count_bytes, entries);
    file.set(directory + count_bytes + entry * entries, word, 0); // there is no other image
    constexpr std::uint64_t long_type = 4, long8_type = 16;
    constexpr std::uint64_t strips = 273, tiles = 324, strip_sizes = 279, tile_sizes = 325;
    std::uint64_t offset = 0;
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t at = directory + count_bytes + entry * i, value = at + entry - word;
        const std::uint64_t tag = file.get(at, 2), type = file.get(at + 2, 2);
        const std::size_t bytes = type == long_type ? 4 : is_bigtiff && type == long8_type ? 8 : 0;
        if (bytes == 0 || file.get(at + 4, word) != 1)
            continue;
        if (tag == strips || tag == tiles) {
            offset = std::min<std::uint64_t>(file.get(value, bytes), file.size() - 1);
            file.set(value, bytes, offset);
        } else if (tag == strip_sizes || tag == tile_sizes) {
            file.set(value, bytes, std::clamp<std::uint64_t>(file.get(value, bytes), 1, file.size() - offset));
        }
    }
}

void repair_exr(Bytes& input) {
    const Numbers file(input);
    if (file.size() < 9)
        return;
    file.set(0, 4, 0x01312f76);
    constexpr std::uint64_t deep = 0x800, several_parts = 0x1000;
    if (file.get(4, 4) & (deep | several_parts))
        return;
    const ExrHeader header = header_of(file);
    static constexpr std::int64_t lines_of[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256}; // of a chunk, by the compression
    if (header.end == 0 || header.has_levels || header.width < 1 || header.height < 1 ||
        header.compression >= std::size(lines_of))
        return;
    const bool tiled = header.tile_width > 0 && header.tile_height > 0;
    const std::int64_t lines = tiled ? header.tile_height : lines_of[header.compression];
    const std::int64_t across = tiled ? (header.width + header.tile_width - 1) / header.tile_width : 1;
    const std::int64_t down = (header.height + lines - 1) / lines;
    const std::size_t head = tiled ? 20 : 8; // of a chunk, its size is the last number
    const std::size_t most = (file.size() - header.end) / (8 + head);
    if (static_cast<std::uint64_t>(down) > most || static_cast<std::uint64_t>(across) > most ||
        static_cast<std::uint64_t>(across * down) > most)
        return;
    const auto chunks = static_cast<std::size_t>(across * down);
    std::size_t at = header.end + 8 * chunks;
    for (std::size_t i = 0; i < chunks && file.size() - at >= head; ++i) {
        const auto column = static_cast<std::int64_t>(i) % across, row = static_cast<std::int64_t>(i) / across;
        file.set(header.end + 8 * i, 8, at);
        if (tiled) {
            for (const auto& [place, value] :
                 {std::pair{0, column}, {4, row}, {8, std::int64_t{0}}, {12, std::int64_t{0}}})
                file.set(at + static_cast<std::size_t>(place), 4, static_cast<std::uint64_t>(value));
        } else {
            file.set(at, 4, static_cast<std::uint64_t>(header.top + row * lines));
        }
        const std::size_t behind = file.size() - at - head, kept = (chunks - i - 1) * head;
        const std::size_t size = std::min<std::size_t>(file.get(at + head - 4, 4), behind > kept ? behind - kept : 0);
        file.set(at + head - 4, 4, size);
        at += head + size;
    }
}

} // namespace fathom::fuzz
