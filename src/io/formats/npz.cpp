// Archives of NumPy's arrays: NPZ, a ZIP file whose members are NPY files, stored or deflated. Names only tell members apart,
// and nothing is unpacked but the array that is asked for, up to the size that its own header has.
// Source: PKWARE, APPNOTE.TXT 6.3.10; numpy.savez.
#include "io/formats.hpp"
#include "io/memory.hpp"

#include <opencv2/core.hpp>

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <string_view>

namespace fathom::io {
namespace {

constexpr std::string_view local_magic = "PK\x03\x04", central_magic = "PK\x01\x02", end_magic = "PK\x05\x06",
                           end64_magic = "PK\x06\x06", place64_magic = "PK\x06\x07";
constexpr std::uint64_t in_extra = 0xffffffff; ///< where a number of 4 bytes is too small, an extra field has 8

struct Member {
    std::string name;
    bool is_encrypted = false;
    std::uint64_t method = 0, sum = 0, packed = 0, size = 0, offset = 0;
};

/// The numbers of an archive, which are little-endian.
class Archive {
public:
    Archive(const std::filesystem::path& file, const Bytes& bytes) : file_(file), bytes_(bytes) {}

    [[noreturn]] void refuse_damage() const {
        refuse(file_, "is a damaged or truncated archive; save or copy it again");
    }

    std::span<const unsigned char> part(std::uint64_t at, std::uint64_t count) const {
        if (at > bytes_.size() || count > bytes_.size() - at)
            refuse_damage();
        return std::span(bytes_).subspan(at, count);
    }
    std::string_view text(std::uint64_t at, std::uint64_t count) const {
        const auto found = part(at, count);
        return {reinterpret_cast<const char*>(found.data()), found.size()};
    }
    std::uint64_t number(std::uint64_t at, unsigned count) const {
        std::uint64_t value = 0;
        for (unsigned i = 0; i < count; ++i)
            value |= std::uint64_t{part(at, count)[i]} << (8 * i);
        return value;
    }
    void expect(std::uint64_t at, std::string_view magic) const {
        if (text(at, magic.size()) != magic)
            refuse_damage();
    }

    std::vector<Member> members() const;
    Bytes unpacked(const Member& member, std::uint64_t most) const;

private:
    /// Where the list of members begins, and how many there are.
    std::pair<std::uint64_t, std::uint64_t> directory() const;
    Member member(std::uint64_t at) const;
    std::span<const unsigned char> packed(const Member& member) const;

    const std::filesystem::path& file_;
    const Bytes& bytes_;
};

std::pair<std::uint64_t, std::uint64_t> Archive::directory() const {
    constexpr std::size_t fixed = 22, longest_comment = 65535;
    const std::string_view all(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    const std::size_t end = all.rfind(end_magic);
    if (end == all.npos || all.size() - end < fixed || all.size() - end > fixed + longest_comment)
        refuse_damage();
    std::uint64_t count = number(end + 10, 2), begin = number(end + 16, 4);
    if (end >= 20 && text(end - 20, 4) == place64_magic) {
        const std::uint64_t end64 = number(end - 20 + 8, 8);
        expect(end64, end64_magic);
        count = number(end64 + 32, 8);
        begin = number(end64 + 48, 8);
    }
    return {begin, count};
}

Member Archive::member(std::uint64_t at) const {
    expect(at, central_magic);
    Member found{.name = std::string(text(at + 46, number(at + 28, 2))),
                 .is_encrypted = (number(at + 8, 2) & 1) != 0,
                 .method = number(at + 10, 2),
                 .sum = number(at + 16, 4),
                 .packed = number(at + 20, 4),
                 .size = number(at + 24, 4),
                 .offset = number(at + 42, 4)};
    std::uint64_t extra = at + 46 + found.name.size();
    for (const std::uint64_t end = extra + number(at + 30, 2); extra + 4 <= end;) {
        const std::uint64_t kind = number(extra, 2), next = extra + 4 + number(extra + 2, 2);
        extra += 4;
        for (std::uint64_t* const value : {&found.size, &found.packed, &found.offset})
            if (kind == 1 && *value == in_extra && extra + 8 <= next) {
                *value = number(extra, 8);
                extra += 8;
            }
        extra = next;
    }
    return found;
}

std::vector<Member> Archive::members() const {
    auto [at, count] = directory();
    std::vector<Member> all;
    std::set<std::string> names;
    for (; count > 0; --count) {
        all.push_back(member(at));
        if (!names.insert(all.back().name).second)
            refuse(file_, "has two members named \"" + printable(all.back().name) + "\"; write it again");
        at += 46 + number(at + 28, 2) + number(at + 30, 2) + number(at + 32, 2);
    }
    return all;
}

std::span<const unsigned char> Archive::packed(const Member& member) const {
    expect(member.offset, local_magic);
    return part(member.offset + 30 + number(member.offset + 26, 2) + number(member.offset + 28, 2), member.packed);
}

/// The first `most` bytes of a member.
Bytes Archive::unpacked(const Member& member, std::uint64_t most) const {
    const auto from = packed(member);
    if (member.method == 0)
        return Bytes(from.begin(),
                     from.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(most, from.size())));
    Bytes bytes(most);
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) // without a header of its own
        throw std::bad_alloc();
    const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
    constexpr std::size_t piece = std::size_t{1} << 30; // zlib counts in 32 bits
    std::size_t taken = 0, given = 0;
    for (int status = Z_OK; status == Z_OK && given < bytes.size();) {
        stream.next_in = const_cast<unsigned char*>(from.data() + taken);
        stream.next_out = bytes.data() + given;
        const std::size_t in = std::min(piece, from.size() - taken), out = std::min(piece, bytes.size() - given);
        stream.avail_in = static_cast<uInt>(in);
        stream.avail_out = static_cast<uInt>(out);
        status = inflate(&stream, Z_NO_FLUSH);
        taken += in - stream.avail_in;
        given += out - stream.avail_out;
    }
    if (given < bytes.size())
        refuse_damage();
    return bytes;
}

std::string called(const Member& member) {
    return printable(std::string_view(member.name).substr(0, member.name.size() - 4)); // without .npy
}

std::string what_is(const Member& member) {
    return "array \"" + called(member) + "\" ";
}

/// The size of an array by its own header.
ArraySize size_of(const std::filesystem::path& file, const Archive& archive, const Member& array) {
    constexpr std::uint64_t longest_header = std::uint64_t{1} << 17;
    if (array.is_encrypted || (array.method != 0 && array.method != Z_DEFLATED))
        refuse(file, what_is(array) + "is encrypted, or packed in a way that NumPy does not use; save it with "
                                      "numpy.savez_compressed");
    if (array.method == 0 ? array.packed != array.size : array.size / expansion::deflate > array.packed)
        archive.refuse_damage();
    return npy_size(file, archive.unpacked(array, std::min(array.size, longest_header)));
}

/// The array of a name. Without one the only image among them, or the one that is called depth.
const Member& chosen(const std::filesystem::path& file, const Archive& archive, const std::vector<Member>& arrays,
                     const std::string& wanted) {
    constexpr std::uint64_t most_of_matrix = 16; // numbers, which are a camera's
    constexpr std::size_t most_unpacked = 1000;  // whose headers are unpacked
    if (arrays.empty())
        refuse(file, "is an archive without a NumPy array; save one with numpy.savez_compressed");
    if (!wanted.empty()) {
        const auto found = std::ranges::find_if(
            arrays, [&](const Member& each) { return each.name == wanted || each.name == wanted + ".npy"; });
        if (found == arrays.end())
            refuse(file, "has no array \"" + printable(wanted) + "\"; it has " + listed(arrays, called) +
                             ", which --channel can name");
        return *found;
    }
    if (arrays.size() == 1)
        return arrays.front();
    std::vector<const Member*> images;
    for (const Member& each : std::span(arrays).first(std::min(arrays.size(), most_unpacked)))
        if (const auto size = if_any([&] { return size_of(file, archive, each); });
            size && size->pixels > most_of_matrix)
            images.push_back(&each);
    if (const auto depth = std::ranges::find(images, "depth", [](const Member* each) { return lower(called(*each)); });
        depth != images.end())
        return **depth;
    if (images.size() != 1 || arrays.size() > most_unpacked)
        refuse(file, "holds several arrays; say which it is (--channel): " + listed(arrays, called));
    return *images.front();
}

} // namespace

bool is_npz(const Bytes& head) {
    const std::string_view begin(reinterpret_cast<const char*>(head.data()), head.size());
    return begin.starts_with(end_magic) || begin.starts_with(local_magic);
}

std::optional<cv::Mat> read_npz(const std::filesystem::path& file, const Bytes& bytes, const std::string& name,
                                std::size_t memory) {
    if (!is_npz(bytes))
        return std::nullopt;
    const Archive archive(file, bytes);
    std::vector<Member> arrays = archive.members();
    std::erase_if(arrays, [](const Member& each) { return !each.name.ends_with(".npy"); });
    const Member& array = chosen(file, archive, arrays, name);
    const std::string what = what_is(array);
    const std::uint64_t needed = size_of(file, archive, array).bytes;
    if (needed != array.size)
        refuse(file, what + "takes " + std::to_string(needed) + " bytes by its header, and has " +
                         std::to_string(array.size) + "; save it again");
    const std::uint64_t most = memory > 0 ? memory : usable_memory();
    if (needed > most)
        refuse(file, what + "takes " + std::to_string(needed >> 20) + " MiB, and " + std::to_string(most >> 20) +
                         " may be taken; raise --memory, or save a part of it");
    const Bytes unpacked = archive.unpacked(array, needed);
    if (crc32_z(0, unpacked.data(), unpacked.size()) != array.sum)
        archive.refuse_damage();
    return read_npy(file, unpacked);
}

} // namespace fathom::io
