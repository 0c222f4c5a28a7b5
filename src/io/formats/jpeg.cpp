// JPEG. libjpeg fills what is missing with grey, so a file without its end is refused first.
// Segments: ITU-T T.81, B.1.1. A profile lies in segments of its own, see ICC.1:2022, B.4.
#include "codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <string_view>

namespace fathom::io {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view exif_name = "Exif\0\0"sv, icc_name = "ICC_PROFILE\0"sv;
constexpr unsigned char end_of_image = 0xd9, start_of_scan = 0xda, app1 = 0xe1, app2 = 0xe2;
constexpr std::string_view frame_markers = "\xc0\xc1\xc2\xc3\xc5\xc6\xc7\xc9\xca\xcb\xcd\xce\xcf",
                           arithmetic_markers = "\xc9\xca\xcb\xcd\xce\xcf";
constexpr std::size_t longest_segment = 65533;        // bytes behind the length
constexpr std::size_t icc_head = icc_name.size() + 2; // and the number of this part, and of all

void append_segment(Bytes& bytes, unsigned char marker, std::string_view name, View content) {
    const std::size_t length = 2 + name.size() + content.size();
    bytes.insert(bytes.end(),
                 {0xff, marker, static_cast<unsigned char>(length >> 8), static_cast<unsigned char>(length)});
    bytes.insert(bytes.end(), name.begin(), name.end());
    bytes.insert(bytes.end(), content.begin(), content.end());
}

/// The end of the codes of a scan: at a marker that is no restart.
std::size_t end_of_codes(View bytes, std::size_t at) {
    const auto is_marker = [&] {
        return bytes[at] == 0xff && bytes[at + 1] != 0 && bytes[at + 1] != 0xff &&
               (bytes[at + 1] < 0xd0 || bytes[at + 1] > 0xd7);
    };
    while (at + 1 < bytes.size() && !is_marker())
        ++at;
    return at;
}

} // namespace

PictureFile read_jpeg(const std::filesystem::path& file, Bytes& bytes) {
    PictureFile picture;
    const auto cut_short = [&] { refuse(file, "ends in the middle of the picture; write or copy it again"); };
    cv::Size size;
    bool arithmetic = false;
    const View all(bytes);
    for (std::size_t at = 2;;) {
        while (at + 1 < all.size() && all[at] == 0xff && all[at + 1] == 0xff) // fill bytes
            ++at;
        if (at + 2 > all.size() || all[at] != 0xff)
            cut_short();
        const unsigned char marker = all[at + 1];
        if (marker == end_of_image)
            break;
        const std::size_t length = at + 4 > all.size() ? 0 : big_endian(all.subspan(at + 2, 2));
        if (length < 2 || length > all.size() - at - 2)
            cut_short();
        const View content = all.subspan(at + 4, length - 2);
        at += 2 + length;
        if (marker == app1 && text_of(content).starts_with(exif_name) && picture.exif.empty())
            picture.exif.assign(content.begin() + exif_name.size(), content.end());
        if (marker == app2 && text_of(content).starts_with(icc_name) && content.size() > icc_head)
            picture.icc.insert(picture.icc.end(), content.begin() + icc_head, content.end());
        const auto number = [&](std::size_t i) { return static_cast<int>(big_endian(content.subspan(i, 2))); };
        const auto is_one_of = [&](std::string_view markers) {
            return markers.find(static_cast<char>(marker)) != markers.npos;
        };
        if (is_one_of(frame_markers) && content.size() >= 6) {
            check_size(file, number(3), number(1));
            size = {number(3), number(1)};
            arithmetic |= is_one_of(arithmetic_markers);
        }
        if (marker == start_of_scan)
            at = end_of_codes(all, at);
    }
    check_holds(file, size, 1, bytes.size(), arithmetic ? std::nullopt : std::optional(expansion::jpeg));
    picture.image = decoded(file, bytes, size);
    return picture;
}

Bytes jpeg_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    constexpr int most = 65500; // rows and columns, of libjpeg
    if (bgr.cols > most || bgr.rows > most)
        throw Error("a .jpg has at most 65500 rows and columns, the picture is " + std::to_string(bgr.cols) + " x " +
                    std::to_string(bgr.rows) + "; write a .png or .exr");
    static_assert(most_exif_of_jpeg + exif_name.size() == longest_segment);
    Bytes file = encoded(".jpg", bgr, {cv::IMWRITE_JPEG_QUALITY, 95}), more;
    if (!format.exif.empty())
        append_segment(more, app1, exif_name, format.exif);
    constexpr std::size_t part = longest_segment - icc_head;
    const std::size_t parts = (format.icc.size() + part - 1) / part;
    for (std::size_t i = 0; i < parts && parts <= 255; ++i) {
        const std::string name = std::string(icc_name) + static_cast<char>(i + 1) + static_cast<char>(parts);
        append_segment(more, app2, name,
                       View(format.icc).subspan(i * part, std::min(part, format.icc.size() - i * part)));
    }
    const std::size_t behind_jfif = 4 + big_endian(View(file).subspan(4, 2));
    file.insert(file.begin() + static_cast<std::ptrdiff_t>(behind_jfif), more.begin(), more.end());
    return file;
}

} // namespace fathom::io
