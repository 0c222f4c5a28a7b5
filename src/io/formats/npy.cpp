// NumPy's arrays in files: NPY 1.0 to 3.0, see numpy.lib.format. Rows and columns, and perhaps channels in the order R, G, B, A.
#include "io/formats.hpp"
#include "io/memory.hpp"

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include <zlib.h>

namespace fathom::io {
namespace {

constexpr std::string_view magic = "\x93NUMPY";

/// A type of elements, as NumPy names it: a letter and the number of bytes.
struct Type {
    std::string_view name;
    int depth; ///< OpenCV's; none for integers of 64 bits

    std::size_t bytes() const { return static_cast<std::size_t>(name[1] - '0'); }
    bool is_signed() const { return name[0] == 'i'; }
};
constexpr int none = -1;
constexpr Type types[] = {{"f2", CV_16F}, {"f4", CV_32F}, {"f8", CV_64F}, {"b1", CV_8U},
                          {"u1", CV_8U},  {"u2", CV_16U}, {"u4", CV_32S}, {"u8", none},
                          {"i1", CV_8S},  {"i2", CV_16S}, {"i4", CV_32S}, {"i8", none}};

struct Layout {
    const Type* type = nullptr;
    bool swapped = false; ///< are the bytes of an element?
    bool columns_first = false;
    int rows = 0, cols = 0, channels = 1;

    std::uint64_t elements() const { return std::uint64_t(rows) * std::uint64_t(cols) * std::uint64_t(channels); }
    std::uint64_t bytes() const { return elements() * type->bytes(); }
};

/// The text behind a key of the header, which is a Python dictionary.
std::string_view value_of(const std::filesystem::path& file, std::string_view header, const std::string& key) {
    const std::string name = "'" + key + "'";
    const auto at = header.find(name);
    const auto begin = at == header.npos ? at : header.find_first_not_of(" :", at + name.size());
    if (begin == header.npos)
        refuse(file, "is a NumPy array without \"" + key + "\" in its header; it is damaged, save it again");
    return header.substr(begin);
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

void read_type(const std::filesystem::path& file, std::string_view text, Layout& layout) {
    const std::string type(text.substr(0, text.find_first_of(",}")));
    const bool known = text.size() > 4 && text[0] == '\'' && text[4] == '\'';
    layout.swapped = known && text[1] == '>';
    layout.type = std::ranges::find(types, known ? text.substr(2, 2) : "", &Type::name);
    if (layout.type == std::end(types))
        refuse(file, "is a NumPy array of " + type + "; save floats, or integers (array.astype(\"float32\"))");
}

/// The layout of an array, and where its data begin. `bytes`: at least its header.
std::pair<Layout, std::size_t> layout_of(const std::filesystem::path& file, const Bytes& bytes) {
    const auto part = [&](std::size_t at, std::size_t count) {
        if (at > bytes.size() || count > bytes.size() - at)
            refuse(file, "ends within its header; write or copy it again");
        return View(bytes).subspan(at, count);
    };
    const std::uint64_t version = little_endian(part(magic.size(), 1));
    if (version < 1 || version > 3)
        refuse(file, "is a NumPy array of format " + std::to_string(version) + "; 1 to 3 are read, save it again");
    const std::size_t before = magic.size() + 2, length_bytes = version == 1 ? 2 : 4, at = before + length_bytes;
    const std::size_t length = little_endian(part(before, length_bytes));
    const std::string_view header = text_of(part(at, length));
    Layout layout;
    read_type(file, value_of(file, header, "descr"), layout);
    read_shape(file, value_of(file, header, "shape"), layout);
    layout.columns_first = value_of(file, header, "fortran_order").starts_with("True");
    if (layout.columns_first && layout.channels > 1)
        refuse(file, "is a NumPy array of channels in Fortran's order; save numpy.ascontiguousarray(array)");
    return {layout, at + length};
}

[[noreturn]] void refuse_value(const std::filesystem::path& file, cv::Point pixel, std::int64_t value) {
    refuse(file, "pixel (" + std::to_string(pixel.x) + ", " + std::to_string(pixel.y) + ") holds " +
                     std::to_string(value) + ", which is no depth of 32 bits; save floats (array.astype(\"float32\"))");
}

/// Integers of 64 bits that fit into 32.
cv::Mat narrowed(const std::filesystem::path& file, const unsigned char* data, int rows, int cols,
                 const Layout& layout) {
    cv::Mat image(rows, cols, CV_32SC(layout.channels));
    for (int y = 0; y < rows; ++y)
        for (int i = 0; i < cols * layout.channels; ++i, data += sizeof(std::int64_t)) {
            std::array<unsigned char, sizeof(std::int64_t)> bytes{};
            std::copy_n(data, bytes.size(), bytes.begin());
            if (layout.swapped)
                std::ranges::reverse(bytes);
            const auto value = std::bit_cast<std::int64_t>(bytes);
            if (value < 0 || value > std::numeric_limits<std::uint32_t>::max())
                refuse_value(file, {i / layout.channels, y}, value);
            image.ptr<std::uint32_t>(y)[i] = static_cast<std::uint32_t>(value);
        }
    return image;
}

/// A copy of what other programs' files hold, too: codes without a sign, halves, floats. Doubles are rounded; signed numbers of 16 bits become
/// floats where some are below 0, and so do halves of pictures.
cv::Mat as_held(const std::filesystem::path& file, const cv::Mat& image, const Type& type) {
    cv::Mat held;
    double least = 0;
    cv::Point where;
    if (type.is_signed() && type.depth != none)
        cv::minMaxLoc(image.reshape(1), &least, nullptr, &where);
    if (least < 0 && image.depth() != CV_16S)
        refuse_value(file, {where.x / image.channels(), where.y}, static_cast<std::int64_t>(least));
    if (image.depth() == CV_64F || least < 0 || (image.depth() == CV_16F && image.channels() > 1))
        image.convertTo(held, CV_32F);
    else if (image.depth() == CV_8S || image.depth() == CV_16S)
        image.convertTo(held, image.depth() == CV_8S ? CV_8U : CV_16U);
    else
        held = image.clone();
    for (int y = 0; y < held.rows; ++y)
        swap_red_and_blue_of_row(held, y);
    return held;
}

} // namespace

std::optional<cv::Mat> read_npy(const std::filesystem::path& file, const Bytes& bytes) {
    if (!text_of(bytes).starts_with(magic))
        return std::nullopt;
    const auto [layout, at] = layout_of(file, bytes);
    check_holds(file, {layout.cols, layout.rows}, layout.type->bytes() * static_cast<std::size_t>(layout.channels),
                bytes.size() - at, 1);
    const int rows = layout.columns_first ? layout.cols : layout.rows,
              cols = layout.columns_first ? layout.rows : layout.cols;
    cv::Mat image = layout.type->depth == none ? narrowed(file, bytes.data() + at, rows, cols, layout)
                                               : cv::Mat(rows, cols, CV_MAKETYPE(layout.type->depth, layout.channels),
                                                         const_cast<unsigned char*>(bytes.data() + at));
    if (layout.swapped && layout.type->depth != none) {
        image = image.clone();
        for (unsigned char* each = image.data; each != image.dataend; each += layout.type->bytes())
            std::reverse(each, each + layout.type->bytes());
    }
    return as_held(file, layout.columns_first ? cv::Mat(image.t()) : image, *layout.type);
}

Bytes npy_bytes(const cv::Mat& image, bool is_color) {
    std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(image.rows) + ", " +
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

constexpr std::string_view local_magic = "PK\x03\x04", central_magic = "PK\x01\x02", end_magic = "PK\x05\x06";

struct Member {
    std::string name;
    std::uint64_t flags, method, sum, packed, size, offset;
};

/// The numbers of an archive, which are little-endian.
class Archive {
public:
    Archive(const std::filesystem::path& file, const Bytes& bytes) : file_(file), bytes_(bytes) {}

    [[noreturn]] void refuse_damage() const {
        refuse(file_, "is a damaged or truncated archive; save or copy it again");
    }

    std::vector<Member> members() const;
    /// The first `most` bytes of a member.
    Bytes unpacked(const Member& member, std::uint64_t most) const;

private:
    View part(std::uint64_t at, std::uint64_t count) const {
        if (at > bytes_.size() || count > bytes_.size() - at)
            refuse_damage();
        return View(bytes_).subspan(at, count);
    }
    std::string_view text(std::uint64_t at, std::uint64_t count) const { return text_of(part(at, count)); }
    std::uint64_t number(std::uint64_t at, unsigned count) const { return little_endian(part(at, count)); }

    const std::filesystem::path& file_;
    const Bytes& bytes_;
};

std::vector<Member> Archive::members() const {
    constexpr std::uint64_t wide = 0xffffffff, many = 0xffff; // numbers that ZIP64 has elsewhere
    const std::size_t end = text(0, bytes_.size()).rfind(end_magic);
    if (end == std::string_view::npos || bytes_.size() - end < 22)
        refuse_damage();
    const std::uint64_t count = number(end + 10, 2);
    std::uint64_t at = number(end + 16, 4);
    bool is_wide = count == many || at == wide;
    std::vector<Member> all;
    for (std::uint64_t i = 0; i < count && !is_wide; ++i) {
        if (text(at, central_magic.size()) != central_magic)
            refuse_damage();
        const Member& found = all.emplace_back(Member{std::string(text(at + 46, number(at + 28, 2))), number(at + 8, 2),
                                                      number(at + 10, 2), number(at + 16, 4), number(at + 20, 4),
                                                      number(at + 24, 4), number(at + 42, 4)});
        is_wide = found.packed == wide || found.size == wide || found.offset == wide;
        at += 46 + found.name.size() + number(at + 30, 2) + number(at + 32, 2);
    }
    std::vector<std::string_view> names(all.size());
    std::ranges::transform(all, names.begin(), [](const Member& each) { return std::string_view(each.name); });
    std::ranges::sort(names);
    if (const auto twice = std::ranges::adjacent_find(names); twice != names.end())
        refuse(file_, "has two members named \"" + printable(std::string(*twice)) + "\"; write it again");
    if (is_wide)
        refuse(file_, "is an archive of 4 GiB or of 65535 members, which is not read; save the array alone");
    return all;
}

Bytes Archive::unpacked(const Member& member, std::uint64_t most) const {
    if (text(member.offset, local_magic.size()) != local_magic)
        refuse_damage();
    const auto from =
        part(member.offset + 30 + number(member.offset + 26, 2) + number(member.offset + 28, 2), member.packed);
    if (member.method == 0)
        return Bytes(from.begin(),
                     from.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(most, from.size())));
    Bytes bytes = inflated(from, most, -MAX_WBITS);
    if (bytes.size() < most)
        refuse_damage();
    return bytes;
}

std::string called(const Member& member) {
    return printable(std::string_view(member.name).substr(0, member.name.size() - 4)); // without .npy
}

/// What the array's own header says.
Layout layout_in(const std::filesystem::path& file, const Archive& archive, const Member& array) {
    constexpr std::uint64_t longest_header = std::uint64_t{1} << 17;
    if ((array.flags & 1) != 0 || (array.method != 0 && array.method != Z_DEFLATED))
        refuse(file, "array \"" + called(array) +
                         "\" is encrypted, or packed in a way that NumPy does not use; save it "
                         "with numpy.savez_compressed");
    if (array.method == 0 ? array.packed != array.size : array.size / expansion::deflate > array.packed)
        archive.refuse_damage();
    const Bytes head = archive.unpacked(array, std::min(array.size, longest_header));
    if (!text_of(head).starts_with(magic))
        refuse(file, "holds no NumPy array under this name; it is damaged, save it again");
    const auto [layout, at] = layout_of(file, head);
    if (at + layout.bytes() != array.size)
        refuse(file, "array \"" + called(array) + "\" takes " + std::to_string(at + layout.bytes()) +
                         " bytes by its header, and has " + std::to_string(array.size) + "; save it again");
    return layout;
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
        if (const auto size = if_any([&] { return layout_in(file, archive, each); });
            size && size->elements() > most_of_matrix)
            images.push_back(&each);
    if (const auto depth = std::ranges::find(images, "depth", [](const Member* each) { return lower(called(*each)); });
        depth != images.end())
        return **depth;
    if (images.size() != 1 || arrays.size() > most_unpacked)
        refuse(file, "holds several arrays; say which it is (--channel): " + listed(arrays, called));
    return *images.front();
}

} // namespace

std::optional<cv::Mat> read_npz(const std::filesystem::path& file, const Bytes& bytes, const std::string& name,
                                std::size_t memory) {
    const std::string_view begin = text_of(bytes);
    if (!begin.starts_with(end_magic) && !begin.starts_with(local_magic))
        return std::nullopt;
    const Archive archive(file, bytes);
    std::vector<Member> arrays = archive.members();
    std::erase_if(arrays, [](const Member& each) { return !each.name.ends_with(".npy"); });
    const Member& array = chosen(file, archive, arrays, name);
    layout_in(file, archive, array);
    const std::uint64_t most = memory > 0 ? memory : usable_memory();
    if (array.size > most)
        refuse(file, "array \"" + called(array) + "\" takes " + std::to_string(array.size >> 20) + " MiB, and " +
                         std::to_string(most >> 20) + " may be taken; raise --memory, or save a part of it");
    const Bytes unpacked = archive.unpacked(array, array.size);
    if (crc32_z(0, unpacked.data(), unpacked.size()) != array.sum)
        archive.refuse_damage();
    return read_npy(file, unpacked);
}

} // namespace fathom::io
