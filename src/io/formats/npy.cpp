// NumPy's arrays in files: NPY 1.0 to 3.0, see numpy.lib.format. Rows and columns, and perhaps channels in the order R, G, B, A.
#include "io/formats.hpp"
#include "io/memory.hpp"

#include <opencv2/core.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <memory>
#include <set>
#include <string_view>
#include <utility>

#include <zlib.h>

namespace fathom::io {
namespace {

constexpr std::string_view magic = "\x93NUMPY";

struct Type;

struct Layout {
    const Type* type = nullptr;
    bool little_endian = true; ///< the order of these bytes
    bool columns_first = false;
    int rows = 0, cols = 0, channels = 1;

    /// Where an element lies, counted in elements.
    std::size_t place(int row, int col, int channel) const {
        const auto y = static_cast<std::size_t>(row), x = static_cast<std::size_t>(col),
                   c = static_cast<std::size_t>(channel), height = static_cast<std::size_t>(rows),
                   width = static_cast<std::size_t>(cols), depth = static_cast<std::size_t>(channels);
        return columns_first ? (c * width + x) * height + y : (y * width + x) * depth + c;
    }
};

/// The text behind a key of the header, which is a Python dictionary.
std::string_view value_of(const std::filesystem::path& file, std::string_view header, const std::string& key) {
    for (const char quote : {'\'', '"'}) {
        const std::string name = quote + key + quote;
        if (const auto at = header.find(name); at != std::string_view::npos) {
            const auto begin = header.find_first_not_of(" :", at + name.size());
            if (begin != std::string_view::npos)
                return header.substr(begin);
        }
    }
    refuse(file, "is a NumPy array without \"" + key + "\" in its header; it is damaged, save it again");
}

void read_shape(const std::filesystem::path& file, std::string_view text, Layout& layout) {
    const std::string shape(text.substr(0, text.find(')') + 1));
    std::vector<long long> sizes;
    for (const char* at = shape.data(); at < shape.data() + shape.size();) {
        long long size = 0;
        const auto [end, error] = std::from_chars(at, shape.data() + shape.size(), size);
        if (end != at)
            sizes.push_back(error == std::errc{} ? size : std::numeric_limits<long long>::max());
        at = end == at ? at + 1 : end;
    }
    const auto has_channels = [&] { return sizes.size() == 3 && (sizes[2] == 1 || sizes[2] == 3 || sizes[2] == 4); };
    while ((sizes.size() > 3 || (sizes.size() == 3 && !has_channels())) && sizes[0] == 1) // as networks make them
        sizes.erase(sizes.begin());
    if (sizes.size() != 2 && !has_channels())
        refuse(file, "is a NumPy array of shape " + shape +
                         ", which is no image; save one of rows × columns, or of rows × columns × 3");
    check_size(file, sizes[1], sizes[0]);
    layout.rows = static_cast<int>(sizes[0]);
    layout.cols = static_cast<int>(sizes[1]);
    layout.channels = sizes.size() == 3 ? static_cast<int>(sizes[2]) : 1;
}

/// The element at a place of the data, in this machine's byte order.
template <typename Element>
Element element_at(const unsigned char* data, std::size_t place, bool swapped) {
    unsigned char bytes[sizeof(Element)];
    std::memcpy(bytes, data + place * sizeof(Element), sizeof(Element));
    if (swapped)
        std::reverse(std::begin(bytes), std::end(bytes));
    return std::bit_cast<Element>(bytes);
}

/// The image, each element converted by `convert`, and in OpenCV's order: that of the file is R, G, B.
template <typename Element, typename Held>
cv::Mat converted(const Layout& layout, const unsigned char* data, int type, const auto& convert) {
    cv::Mat image(layout.rows, layout.cols, type);
    const bool swapped = layout.little_endian != is_little_endian;
    for (int y = 0; y < image.rows; ++y) {
        for (int x = 0; x < image.cols; ++x)
            for (int c = 0; c < layout.channels; ++c)
                image.ptr<Held>(y)[x * layout.channels + c] =
                    convert(element_at<Element>(data, layout.place(y, x, c), swapped), x, y);
        swap_red_and_blue_of_row(image, y);
    }
    return image;
}

/// Integers of 8, 16 or 32 bits, which hold all that was stored.
template <typename Element, typename Held, int depth>
cv::Mat integers(const std::filesystem::path& file, const Layout& layout, const unsigned char* data) {
    return converted<Element, Held>(
        layout, data, CV_MAKETYPE(depth, layout.channels), [&](Element value, int x, int y) {
            if (std::cmp_less(value, 0) ||
                std::cmp_greater(value, std::numeric_limits<std::make_unsigned_t<Held>>::max()))
                refuse(file, "pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") holds " +
                                 std::to_string(value) +
                                 ", which is no depth of 32 bits; save floats (array.astype(\"float32\"))");
            return static_cast<Held>(value);
        });
}

/// Floats, doubles of which are rounded.
template <typename Element>
cv::Mat floats(const std::filesystem::path&, const Layout& layout, const unsigned char* data) {
    return converted<Element, float>(layout, data, CV_32FC(layout.channels),
                                     [](Element value, int, int) { return static_cast<float>(value); });
}

/// Half floats of depth as they are; those of a picture as floats.
cv::Mat halves(const std::filesystem::path&, const Layout& layout, const unsigned char* data) {
    const cv::Mat held = converted<std::uint16_t, std::uint16_t>(layout, data, CV_16FC(layout.channels),
                                                                 [](std::uint16_t bits, int, int) { return bits; });
    cv::Mat floats;
    if (layout.channels > 1)
        held.convertTo(floats, CV_32F);
    return layout.channels > 1 ? floats : held;
}

/// As codes, or as floats where some are below 0.
cv::Mat signed_shorts(const std::filesystem::path& file, const Layout& layout, const unsigned char* data) {
    bool negative = false;
    const cv::Mat values =
        converted<std::int16_t, float>(layout, data, CV_32FC(layout.channels), [&](std::int16_t value, int, int) {
            negative |= value < 0;
            return static_cast<float>(value);
        });
    return negative ? values : integers<std::int16_t, std::uint16_t, CV_16U>(file, layout, data);
}

/// A type of elements, as NumPy names it: a letter and the number of bytes.
struct Type {
    std::string_view name;
    cv::Mat (*read)(const std::filesystem::path& file, const Layout& layout, const unsigned char* data);

    std::size_t bytes() const { return static_cast<std::size_t>(name[1] - '0'); }
};
constexpr Type types[] = {{"f2", halves},
                          {"f4", floats<float>},
                          {"f8", floats<double>},
                          {"b1", integers<std::uint8_t, std::uint8_t, CV_8U>},
                          {"u1", integers<std::uint8_t, std::uint8_t, CV_8U>},
                          {"u2", integers<std::uint16_t, std::uint16_t, CV_16U>},
                          {"u4", integers<std::uint32_t, std::int32_t, CV_32S>},
                          {"u8", integers<std::uint64_t, std::int32_t, CV_32S>},
                          {"i1", integers<std::int8_t, std::uint8_t, CV_8U>},
                          {"i2", signed_shorts},
                          {"i4", integers<std::int32_t, std::int32_t, CV_32S>},
                          {"i8", integers<std::int64_t, std::int32_t, CV_32S>}};

void read_type(const std::filesystem::path& file, std::string_view text, Layout& layout) {
    const std::string type(text.substr(0, text.find_first_of(",}")));
    const bool known = text.size() > 4 && (text[0] == '\'' || text[0] == '"') && text[4] == text[0] &&
                       std::string_view("<>=|").find(text[1]) != std::string_view::npos;
    const std::string_view name = known ? text.substr(2, 2) : "";
    const Type* found = std::ranges::find(types, name, &Type::name);
    if (found == std::end(types))
        refuse(file, "is a NumPy array of " + type + "; save floats, or integers (array.astype(\"float32\"))");
    layout.type = found;
    layout.little_endian = text[1] == '<' || (text[1] != '>' && is_little_endian);
}

/// The layout of an array, and where its data begin. `bytes`: at least its header.
std::pair<Layout, std::size_t> layout_of(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto byte = [&](std::size_t at) { return at < bytes.size() ? std::size_t{bytes[at]} : 0; };
    const std::size_t version = byte(magic.size());
    if (version < 1 || version > 3)
        refuse(file, "is a NumPy array of format " + std::to_string(version) + "; 1 to 3 are read, save it again");
    std::size_t at = magic.size() + 2, length = byte(at) | byte(at + 1) << 8;
    at += 2;
    if (version > 1) {
        length |= byte(at) << 16 | byte(at + 1) << 24;
        at += 2;
    }
    if (at > bytes.size() || length > bytes.size() - at)
        refuse(file, "ends within its header; write or copy it again");
    const std::string_view header = text.substr(at, length);
    Layout layout;
    read_type(file, value_of(file, header, "descr"), layout);
    read_shape(file, value_of(file, header, "shape"), layout);
    layout.columns_first = value_of(file, header, "fortran_order").starts_with("True");
    return {layout, at + length};
}

/// Elements of an array.
std::size_t elements(const Layout& layout) {
    return layout.place(layout.rows - 1, layout.cols - 1, layout.channels - 1) + 1;
}

bool is_npy(const Bytes& bytes) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with(magic);
}

} // namespace

ArraySize npy_size(const std::filesystem::path& file, const Bytes& head) {
    if (!is_npy(head))
        refuse(file, "holds no NumPy array under this name; it is damaged, save it again");
    const auto [layout, at] = layout_of(file, head);
    return {at + elements(layout) * layout.type->bytes(), elements(layout)};
}

std::optional<cv::Mat> read_npy(const std::filesystem::path& file, const Bytes& bytes) {
    if (!is_npy(bytes))
        return std::nullopt;
    const auto [layout, at] = layout_of(file, bytes);
    if ((bytes.size() - at) / layout.type->bytes() < elements(layout))
        refuse(file, "ends too early: " + described(cv::Size(layout.cols, layout.rows)) + " pixels do not fit into " +
                         std::to_string(bytes.size()) + " bytes; write or copy it again");
    return layout.type->read(file, layout, bytes.data() + at);
}

Bytes npy_bytes(const cv::Mat& image, bool is_color) {
    std::string header = std::string("{'descr': '") + (is_little_endian ? '<' : '>') +
                         "f4', 'fortran_order': False, 'shape': (" + std::to_string(image.rows) + ", " +
                         std::to_string(image.cols);
    if (image.channels() > 1)
        header += ", " + std::to_string(image.channels());
    header += "), }";
    const std::size_t before = magic.size() + 4;
    header.resize((before + header.size() + 1 + 63) / 64 * 64 - before - 1, ' '); // the data begin at a multiple of 64
    header += '\n';
    Bytes bytes(magic.begin(), magic.end());
    for (const std::size_t value : {std::size_t{1}, std::size_t{0}, header.size() & 0xff, header.size() >> 8})
        bytes.push_back(static_cast<unsigned char>(value));
    bytes.insert(bytes.end(), header.begin(), header.end());
    const auto row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
    bytes.reserve(bytes.size() + row_bytes * static_cast<std::size_t>(image.rows));
    for (int y = 0; y < image.rows; ++y) {
        const cv::Mat row = is_color ? swap_red_and_blue(image.row(y)) : image.row(y);
        bytes.insert(bytes.end(), row.ptr(), row.ptr() + row_bytes);
    }
    return bytes;
}

// Archives of NumPy's arrays: NPZ, a ZIP file whose members are NPY files, stored or deflated. Names only tell members apart,
// and nothing is unpacked but the array that is asked for, up to the size that its own header has.
// Source: PKWARE, APPNOTE.TXT 6.3.10; numpy.savez.

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
