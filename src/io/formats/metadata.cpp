// Exif's orientation (Exif 2.32, tag 274: a TIFF directory) and the curves of a colour profile (ICC.1:2022).
// Data that ends too early says nothing.
#include "codecs.hpp"

#include <algorithm>
#include <string_view>

namespace fathom::io {
namespace {

/// Reads numbers of either byte order; nothing beyond the end.
struct ExifReader {
    View bytes;
    bool little = false;

    std::optional<std::uint32_t> number(std::size_t at, std::size_t count) const {
        if (at > bytes.size() || bytes.size() - at < count)
            return std::nullopt;
        const View part = bytes.subspan(at, count);
        return static_cast<std::uint32_t>(little ? little_endian(part) : big_endian(part));
    }
    bool has(std::size_t at, std::string_view text) const {
        return text_of(bytes.subspan(std::min(at, bytes.size()))).starts_with(text);
    }
};

/// Where the value of Exif's orientation stands.
std::optional<std::size_t> place_of_orientation(View exif, ExifReader& reader) {
    reader = {exif, false};
    reader.little = reader.has(0, "II");
    const auto first = reader.number(4, 4);
    if (!first || !(reader.little || reader.has(0, "MM")))
        return std::nullopt;
    const auto entries = reader.number(*first, 2).value_or(0);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t entry = std::size_t{*first} + 2 + 12 * i;
        if (reader.number(entry, 2) == 274u && reader.number(entry + 8, 2))
            return entry + 8;
    }
    return std::nullopt;
}

/// Is a curve of a profile the line from 0 to 1? A `curv` without entries or of gamma 1, or a `para` of gamma 1.
bool is_straight(const ExifReader& profile, std::size_t at) {
    if (profile.has(at, "curv")) {
        const auto count = profile.number(at + 8, 4);
        return count == 0u || (count == 1u && profile.number(at + 12, 2) == 0x100u);
    }
    return profile.has(at, "para") && profile.number(at + 8, 2) == 0u && profile.number(at + 12, 4) == 0x10000u;
}

} // namespace

bool is_linear_profile(View icc) {
    const ExifReader profile{icc};
    const auto tags = std::min(profile.number(128, 4).value_or(0), 1024u);
    int straight = 0;
    for (std::size_t i = 0; i < tags; ++i) {
        const std::size_t tag = 132 + 12 * i;
        for (const std::string_view curve : {"rTRC", "gTRC", "bTRC"})
            if (profile.has(tag, curve))
                straight += is_straight(profile, profile.number(tag + 4, 4).value_or(0));
    }
    return straight == 3;
}

bool is_rgb_profile(View icc) {
    return ExifReader{icc}.has(16, "RGB ");
}

int orientation_of(View exif) {
    ExifReader reader{};
    const auto place = place_of_orientation(exif, reader);
    const auto value = place ? reader.number(*place, 2).value_or(1) : 1;
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

void set_upright(Bytes& exif) {
    ExifReader reader{};
    if (const auto place = place_of_orientation(exif, reader)) {
        exif[*place] = reader.little ? 1 : 0;
        exif[*place + 1] = reader.little ? 0 : 1;
    }
}

} // namespace fathom::io
