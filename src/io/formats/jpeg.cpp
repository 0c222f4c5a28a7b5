// JPEG, with OpenCV. libjpeg fills what is missing with grey, so a file without its end is refused first.
// Segments: ITU-T T.81, B.1.1. A profile lies in segments of its own, see ICC.1:2022, B.4.
#include "metadata.hpp"

#include "io/formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/imgcodecs.hpp>

#include <array>
#include <string_view>

namespace fathom::io {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view exif_name = "Exif\0\0"sv, icc_name = "ICC_PROFILE\0"sv;
constexpr unsigned char app0 = 0xe0, app1 = 0xe1, app2 = 0xe2, start_of_scan = 0xda;
constexpr std::string_view frames = "\xc0\xc1\xc2\xc3\xc5\xc6\xc7\xc9\xca\xcb\xcd\xce\xcf",
                           arithmetic_frames = "\xc9\xca\xcb\xcd\xce\xcf";
constexpr int quality = 95;
constexpr std::size_t longest_segment = 65533; // bytes behind the length

struct Segment {
    unsigned char marker;
    View content; ///< behind the length
    std::size_t end;
};

bool begins(View content, std::string_view name) {
    return content.size() >= name.size() &&
           std::equal(name.begin(), name.end(), content.begin(),
                      [](char a, unsigned char b) { return a == static_cast<char>(b); });
}

/// The segment at a place; none where the file ends or makes no sense.
std::optional<Segment> segment_at(View file, std::size_t at) {
    while (at + 1 < file.size() && file[at] == 0xff && file[at + 1] == 0xff) // fill bytes
        ++at;
    if (at + 4 > file.size() || file[at] != 0xff)
        return std::nullopt;
    const std::size_t length = std::size_t{file[at + 2]} << 8 | file[at + 3];
    if (length < 2 || at + 2 + length > file.size())
        return std::nullopt;
    return Segment{file[at + 1], file.subspan(at + 4, length - 2), at + 2 + length};
}

void append(Bytes& file, unsigned char marker, std::initializer_list<View> parts) {
    std::size_t length = 2;
    for (const View part : parts)
        length += part.size();
    file.insert(file.end(),
                {0xff, marker, static_cast<unsigned char>(length >> 8), static_cast<unsigned char>(length)});
    for (const View part : parts)
        file.insert(file.end(), part.begin(), part.end());
}

View as_bytes(std::string_view text) {
    return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

} // namespace

std::optional<PictureFile> read_jpeg(const std::filesystem::path& file, const Bytes& bytes) {
    if (bytes.size() < 3 || bytes[0] != 0xff || bytes[1] != 0xd8 || bytes[2] != 0xff)
        return std::nullopt;
    PictureFile picture;
    cv::Size size;
    bool arithmetic = false;
    const auto cut_short = [&] { refuse(file, "ends in the middle of the picture; write or copy it again"); };
    std::size_t at = 2;
    for (;;) {
        const auto segment = segment_at(bytes, at);
        if (!segment)
            cut_short();
        at = segment->end;
        if (segment->marker == app1 && begins(segment->content, exif_name) && picture.exif.empty())
            picture.exif.assign(segment->content.begin() + exif_name.size(), segment->content.end());
        const std::size_t head = icc_name.size() + 2; // and the number of this part, and of all
        if (segment->marker == app2 && begins(segment->content, icc_name) && segment->content.size() > head)
            picture.icc.insert(picture.icc.end(), segment->content.begin() + static_cast<std::ptrdiff_t>(head),
                               segment->content.end());
        const auto number = [&](std::size_t i) { return segment->content[i] << 8 | segment->content[i + 1]; };
        const auto is_one_of = [&](std::string_view markers) {
            return markers.find(static_cast<char>(segment->marker)) != markers.npos;
        };
        if (is_one_of(frames) && segment->content.size() >= 6) {
            check_size(file, number(3), number(1));
            size = {number(3), number(1)};
            arithmetic = is_one_of(arithmetic_frames);
        }
        if (segment->marker == start_of_scan)
            break;
    }
    static constexpr std::array<unsigned char, 2> end{0xff, 0xd9};
    const auto scan = bytes.begin() + static_cast<std::ptrdiff_t>(at); // before it a thumbnail may end
    if (std::search(scan, bytes.end(), end.begin(), end.end()) == bytes.end())
        cut_short();
    check_holds(file, size, 1, bytes.size() - at, arithmetic ? std::nullopt : std::optional(expansion::jpeg));
    picture.image = decode_with_opencv(file, bytes);
    return picture;
}

Bytes jpeg_bytes(const cv::Mat& bgr, const PictureFormat& format) {
    constexpr int most = 65500; // rows and columns, of libjpeg
    if (bgr.cols > most || bgr.rows > most)
        throw Error("a .jpg has at most 65500 rows and columns, the picture is " + std::to_string(bgr.cols) + " x " +
                    std::to_string(bgr.rows) + "; write a .png or .exr");
    Bytes pixels;
    if (!cv::imencode(".jpg", bgr, pixels, {cv::IMWRITE_JPEG_QUALITY, quality}))
        throw Error("OpenCV cannot write a JPEG");
    const auto first = segment_at(pixels, 2);
    const std::size_t front = first && first->marker == app0 ? first->end : 2;
    Bytes file(pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(front));
    static_assert(most_exif_of_jpeg + exif_name.size() == longest_segment);
    if (!format.exif.empty())
        append(file, app1, {as_bytes(exif_name), format.exif});
    const std::size_t longest = longest_segment - icc_name.size() - 2;
    const std::size_t parts = (format.icc.size() + longest - 1) / longest;
    for (std::size_t i = 0; i < parts && parts < 256; ++i) {
        const std::array<unsigned char, 2> number{static_cast<unsigned char>(i + 1), static_cast<unsigned char>(parts)};
        append(file, app2,
               {as_bytes(icc_name), number,
                View(format.icc).subspan(i * longest, std::min(longest, format.icc.size() - i * longest))});
    }
    file.insert(file.end(), pixels.begin() + static_cast<std::ptrdiff_t>(front), pixels.end());
    return file;
}

} // namespace fathom::io
