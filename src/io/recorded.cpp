// Records in files. An EXR has named attributes in its header, a PNG has chunks of text (PNG specification, 11.3.3.2).
#include "recorded.hpp"

#include "formats.hpp"

#include "io/formats/metadata.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string_view>

namespace fs = std::filesystem;

namespace fathom::io {
namespace {

using Span = std::span<const unsigned char>;

constexpr std::size_t png_signature = 8, png_header = 25; // bytes

std::string_view text_of(Span bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint32_t little_endian(Span b) {
    return std::uint32_t{b[3]} << 24 | std::uint32_t{b[2]} << 16 | std::uint32_t{b[1]} << 8 | b[0];
}

/// The text up to the next zero, which is taken from the bytes, too. Nothing: there is none.
std::optional<std::string_view> take_name(Span& bytes) {
    const auto zero = std::ranges::find(bytes, 0);
    if (zero == bytes.end())
        return std::nullopt;
    const auto length = static_cast<std::size_t>(zero - bytes.begin());
    const std::string_view name = text_of(bytes.first(length));
    bytes = bytes.subspan(length + 1);
    return name;
}

/// The value of the attribute in the first header of an EXR.
std::optional<Span> record_of_exr(Span bytes) {
    Span rest = bytes.subspan(std::min<std::size_t>(8, bytes.size())); // magic number and version
    for (;;) {
        const auto name = take_name(rest);
        const auto type = name && !name->empty() ? take_name(rest) : std::nullopt;
        if (!type || rest.size() < 4)
            return std::nullopt;
        const std::size_t size = little_endian(rest);
        rest = rest.subspan(4);
        if (size > rest.size())
            return std::nullopt;
        if (*name == record_name && *type == "string")
            return rest.first(size);
        rest = rest.subspan(size);
    }
}

/// The chunk of a PNG, whole: length, type, keyword, a zero, text and sum.
std::optional<Span> record_of_png(Span bytes) {
    for (Span rest = bytes.subspan(png_signature); rest.size() >= 12;) {
        const std::size_t length = big_endian(rest);
        if (length > rest.size() - 12)
            return std::nullopt;
        const Span chunk = rest.first(length + 12);
        const std::string_view content = text_of(chunk.subspan(4, length + 4));
        if (content.starts_with(std::string("tEXt") + record_name + '\0'))
            return crc32_z(0, chunk.data() + 4, length + 4) == big_endian(chunk.last(4)) ? std::optional(chunk)
                                                                                         : std::nullopt;
        rest = rest.subspan(chunk.size());
    }
    return std::nullopt;
}

} // namespace

std::optional<Bytes> read_if_there(const fs::path& file) {
    std::error_code none;
    if (!is_file(file))
        return std::nullopt;
    std::ifstream stream(file, std::ios::binary);
    const auto size = fs::file_size(file, none);
    if (none) // it has gone meanwhile
        return std::nullopt;
    Bytes bytes(size);
    if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
        return std::nullopt;
    return bytes;
}

fs::path sidecar_of(const fs::path& file) {
    return file.native() + ".fathom.json";
}

bool holds_record(const fs::path& file) {
    const std::string extension = extension_of(file);
    return extension == ".exr" || extension == ".png";
}

std::optional<RecordedFile> find_record(Bytes bytes) {
    constexpr std::string_view exr = "\x76\x2f\x31\x01", png = "\x89PNG\r\n\x1a\n";
    const std::string_view content = text_of(bytes);
    std::optional<Span> value;
    std::size_t head = 0, tail = 0; // of the chunk, around its text
    if (content.starts_with(exr)) {
        value = record_of_exr(bytes);
    } else if (content.starts_with(png)) {
        value = record_of_png(bytes);
        head = 8 + std::string_view(record_name).size() + 1;
        tail = 4;
    }
    if (!value)
        return std::nullopt;
    const auto first = static_cast<std::size_t>(value->data() - bytes.data());
    const std::string record(text_of(value->subspan(head, value->size() - head - tail)));
    const std::size_t last = first + value->size();
    return RecordedFile{.bytes = std::move(bytes), .record = record, .first = first, .last = last};
}

std::optional<RecordedFile> read_recorded(const fs::path& file) {
    auto bytes = read_if_there(file);
    if (!bytes)
        return std::nullopt;
    if (holds_record(file))
        return find_record(std::move(*bytes));
    const auto sidecar = read_if_there(sidecar_of(file));
    if (!sidecar || sidecar->empty() || sidecar->back() != '\n')
        return std::nullopt;
    return RecordedFile{.bytes = std::move(*bytes),
                        .record = std::string(text_of(*sidecar).substr(0, sidecar->size() - 1))};
}

RecordedFile png_with_record(Bytes png, const std::string& record) {
    const std::string content = std::string("tEXt") + record_name + '\0' + record;
    Bytes chunk;
    const auto append = [&](std::size_t value) {
        for (const int shift : {24, 16, 8, 0})
            chunk.push_back(static_cast<unsigned char>(value >> shift));
    };
    append(content.size() - 4);
    chunk.insert(chunk.end(), content.begin(), content.end());
    append(crc32_z(0, chunk.data() + 4, content.size()));
    const std::size_t first = png_signature + png_header;
    png.insert(png.begin() + static_cast<std::ptrdiff_t>(first), chunk.begin(), chunk.end());
    return {.bytes = std::move(png), .record = record, .first = first, .last = first + chunk.size()};
}

} // namespace fathom::io
