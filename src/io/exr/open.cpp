// Opens OpenEXR files. Attributes in their headers say how long they are, and OpenEXR 3.1 takes as much memory before it reads
// them: up to 2 GiB for a file of a few bytes. It also reads on where a value ends, not where its length says. So the lengths
// are compared with the values and with the file first.
// Source: OpenEXR file layout, "Component Two: Version Field" and "Component Three: Header".
#include "open.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfVersion.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <system_error>

namespace fathom::io {
namespace {

class HeaderReader {
public:
    explicit HeaderReader(const std::filesystem::path& file)
        : file_(file), stream_(file, std::ios::binary), size_(size_of_file(file)) {}

    std::uint64_t at() const { return at_; }
    std::uint64_t size() const { return size_; }

    std::uint32_t number() {
        std::array<unsigned char, 4> bytes{};
        take(bytes.size());
        stream_.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
        check();
        return static_cast<std::uint32_t>(little_endian(bytes));
    }
    /// The text up to a zero.
    std::string name() {
        constexpr int most = 50'000; // thousands of parts; a file is opened several times, and OpenEXR compares all
        if (++names_ > most)
            refuse(file_,
                   "has over " + std::to_string(most) +
                       " names of attributes, types and channels; it is damaged, or has to be written with fewer");
        std::string text;
        for (;;) {
            take(1);
            const int c = stream_.get();
            check();
            if (c <= 0)
                return text;
            text += static_cast<char>(c);
        }
    }
    void skip(std::uint64_t size) {
        take(size);
        stream_.seekg(static_cast<std::streamoff>(size), std::ios::cur);
        check();
    }
    [[noreturn]] void refuse_damaged() const {
        refuse(file_,
               "is damaged or cut short: the sizes in its header contradict each other; render or copy it again");
    }

private:
    void check() const {
        if (!stream_ && !stream_.eof())
            refuse_read(file_, errno == 0 ? EIO : errno);
    }
    void take(std::uint64_t size) {
        if (size > size_ - at_)
            refuse_damaged();
        at_ += size;
    }

    const std::filesystem::path& file_;
    std::ifstream stream_;
    std::uint64_t size_, at_ = 0;
    int names_ = 0;
};

/// Bytes of the values that have a fixed size. OpenEXR reads so many, whatever the header says.
std::optional<std::uint64_t> size_of(const std::string& type) {
    static const std::map<std::string, std::uint64_t> sizes{{"box2f", 16},
                                                            {"box2i", 16},
                                                            {"chromaticities", 32},
                                                            {"compression", 1},
                                                            {"deepImageState", 1},
                                                            {"double", 8},
                                                            {"envmap", 1},
                                                            {"float", 4},
                                                            {"int", 4},
                                                            {"keycode", 28},
                                                            {"lineOrder", 1},
                                                            {"m33d", 72},
                                                            {"m33f", 36},
                                                            {"m44d", 128},
                                                            {"m44f", 64},
                                                            {"rational", 8},
                                                            {"tiledesc", 9},
                                                            {"timecode", 8},
                                                            {"v2d", 16},
                                                            {"v2f", 8},
                                                            {"v2i", 8},
                                                            {"v3d", 24},
                                                            {"v3f", 12},
                                                            {"v3i", 12}};
    const auto found = sizes.find(type);
    return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

void check_attribute(HeaderReader& header, const std::string& type) {
    const std::uint64_t size = header.number(), end = header.at() + size;
    if (header.at() + size > header.size() || size_of(type).value_or(size) != size)
        header.refuse_damaged();
    if (type == "chlist") {
        constexpr std::uint64_t description = 16; // bytes behind the name
        while (!header.name().empty())
            header.skip(description);
        if (header.at() != end)
            header.refuse_damaged();
    } else if (type == "preview") {
        const std::uint64_t width = header.number(), height = header.number();
        if (size < 8 || (size - 8) % 4 != 0 ||
            (width == 0 ? size != 8 : (size - 8) / 4 % width != 0 || (size - 8) / 4 / width != height))
            header.refuse_damaged();
    } else if (type == "stringvector") {
        while (header.at() < end)
            header.skip(header.number());
        if (header.at() != end)
            header.refuse_damaged();
    } else if (type == "floatvector" && size % 4 != 0) {
        header.refuse_damaged();
    }
    header.skip(end - header.at());
}

void check_header(const std::filesystem::path& file) {
    HeaderReader header(file);
    header.number(); // magic number
    const bool several_parts = Imf::isMultiPart(static_cast<int>(header.number()));
    for (bool first = true;; first = false) {
        std::string name = header.name();
        if (name.empty() && (!several_parts || !first))
            return; // no more headers
        for (; !name.empty(); name = header.name())
            check_attribute(header, header.name());
        if (!several_parts)
            return;
    }
}

} // namespace

std::uint64_t size_of_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(file, error);
    if (error)
        refuse_read(file, error.value());
    return size;
}

std::string exr_reason(const std::string& what) {
    const auto quoted = what.rfind("\". ");
    return quoted == std::string::npos ? what : what.substr(quoted + 3);
}

Imf::MultiPartInputFile open_exr(const std::filesystem::path& file) {
    check_header(file);
    return Imf::MultiPartInputFile(file.c_str());
}

void check_tiles(const std::filesystem::path& file, const Imf::MultiPartInputFile& exr) {
    constexpr double always = 1 << 24; // bytes; a renderer may have one size of tiles for all images
    for (int part = 0; part < exr.parts(); ++part) {
        const Imf::Header& header = exr.header(part);
        if (!header.hasTileDescription())
            continue;
        double pixel_bytes = 0;
        for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
            pixel_bytes += c.channel().type == Imf::HALF ? 2 : 4;
        const Imath::Box2i& window = header.dataWindow();
        const double pixels = (1.0 + window.max.x - window.min.x) * (1.0 + window.max.y - window.min.y);
        const Imf::TileDescription& tile = header.tileDescription();
        if (pixel_bytes * tile.xSize * tile.ySize > std::max(always, pixel_bytes * pixels))
            refuse(file,
                   "has tiles of " + std::to_string(tile.xSize) + " x " + std::to_string(tile.ySize) +
                       " pixels, more than the whole image; it is damaged, or has to be written with smaller tiles");
    }
}

} // namespace fathom::io
