// JPEG, with libjpeg-turbo. It fills what is missing with grey, so a file without its end is refused first.
// Segments: ITU-T T.81, B.1.1. A profile lies in segments of its own, see ICC.1:2022, B.4.
#include "codec_calls.hpp"
#include "metadata.hpp"

#include "io/formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <cstdio> // jpeglib.h takes it for granted
#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <string_view>

namespace fathom::io {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view exif_name = "Exif\0\0"sv, icc_name = "ICC_PROFILE\0"sv;
constexpr unsigned char app1 = 0xe1, app2 = 0xe2, start_of_scan = 0xda;
constexpr std::string_view frames = "\xc0\xc1\xc2\xc3\xc5\xc6\xc7\xc9\xca\xcb\xcd\xce\xcf",
                           arithmetic_frames = "\xc9\xca\xcb\xcd\xce\xcf";
constexpr std::size_t longest_segment = 65533;        // bytes behind the length
constexpr std::size_t icc_head = icc_name.size() + 2; // and the number of this part, and of all

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

/// libjpeg's errors, which come back to `jump`, and its remarks, which are not printed.
struct JpegErrors : jpeg_error_mgr {
    JpegErrors() {
        jpeg_std_error(this);
        error_exit = [](j_common_ptr codec) { std::longjmp(static_cast<JpegErrors*>(codec->err)->jump.place, 1); };
        emit_message = [](j_common_ptr codec, int) {
            if (codec->err->msg_code == JWRN_JPEG_EOF)
                codec->err->error_exit(codec);
        };
    }
    Jump jump;
};

/// B, G and R, also of grey. Inks are taken off the light of the black one, as Adobe's files have them: inverted.
cv::Mat jpeg_pixels(const std::filesystem::path& file, const Bytes& bytes) {
    JpegErrors errors;
    jpeg_decompress_struct codec{};
    codec.err = &errors;
    const std::unique_ptr<jpeg_decompress_struct, decltype(&jpeg_destroy_decompress)> end(&codec,
                                                                                          jpeg_destroy_decompress);
    cv::Mat image;
    const bool is_complete = complete(errors.jump, [&] {
        jpeg_create_decompress(&codec);
        jpeg_mem_src(&codec, bytes.data(), bytes.size());
        jpeg_read_header(&codec, TRUE);
        codec.out_color_space = codec.num_components == 4 ? JCS_CMYK : JCS_EXT_BGR;
        jpeg_start_decompress(&codec);
        image.create(static_cast<int>(codec.output_height), static_cast<int>(codec.output_width),
                     CV_8UC(codec.output_components));
        while (codec.output_scanline < codec.output_height) {
            JSAMPROW row = image.ptr(static_cast<int>(codec.output_scanline));
            jpeg_read_scanlines(&codec, &row, 1);
        }
    });
    if (!is_complete)
        refuse_undecoded(file);
    if (image.channels() == 3)
        return image;
    cv::Mat bgr(image.size(), CV_8UC3);
    std::transform(image.begin<cv::Vec4b>(), image.end<cv::Vec4b>(), bgr.begin<cv::Vec3b>(), [](const cv::Vec4b& inks) {
        const auto light = [&](int ink) {
            return static_cast<unsigned char>(inks[3] - ((255 - inks[ink]) * inks[3] >> 8));
        };
        return cv::Vec3b(light(2), light(1), light(0));
    });
    return bgr;
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
        if (segment->marker == app2 && begins(segment->content, icc_name) && segment->content.size() > icc_head)
            picture.icc.insert(picture.icc.end(), segment->content.begin() + icc_head, segment->content.end());
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
    picture.image = jpeg_pixels(file, bytes);
    return picture;
}

Bytes jpeg_bytes(const cv::Mat& bgr, const PictureFormat& format, int quality) {
    constexpr int most = 65500; // rows and columns, of libjpeg
    if (bgr.cols > most || bgr.rows > most)
        throw Error("a .jpg has at most 65500 rows and columns, the picture is " + std::to_string(bgr.cols) + " x " +
                    std::to_string(bgr.rows) + "; write a .png or .exr");
    static_assert(most_exif_of_jpeg + exif_name.size() == longest_segment);
    const bool has_profile = !format.icc.empty() && format.icc.size() <= 255 * (longest_segment - icc_head);
    JpegErrors errors;
    jpeg_compress_struct codec{};
    codec.err = &errors;
    const std::unique_ptr<jpeg_compress_struct, decltype(&jpeg_destroy_compress)> end(&codec, jpeg_destroy_compress);
    unsigned char* file = nullptr;
    unsigned long size = 0;
    const bool is_complete = complete(errors.jump, [&] {
        jpeg_create_compress(&codec);
        jpeg_mem_dest(&codec, &file, &size);
        codec.image_width = static_cast<JDIMENSION>(bgr.cols);
        codec.image_height = static_cast<JDIMENSION>(bgr.rows);
        codec.input_components = 3;
        codec.in_color_space = JCS_EXT_BGR;
        jpeg_set_defaults(&codec);
        jpeg_set_quality(&codec, quality, TRUE);
        jpeg_start_compress(&codec, TRUE);
        if (!format.exif.empty()) {
            jpeg_write_m_header(&codec, app1, static_cast<unsigned>(exif_name.size() + format.exif.size()));
            for (const char each : exif_name)
                jpeg_write_m_byte(&codec, each);
            for (const unsigned char each : format.exif)
                jpeg_write_m_byte(&codec, each);
        }
        if (has_profile)
            jpeg_write_icc_profile(&codec, format.icc.data(), static_cast<unsigned>(format.icc.size()));
        while (codec.next_scanline < codec.image_height) {
            JSAMPROW row = const_cast<JSAMPROW>(bgr.ptr(static_cast<int>(codec.next_scanline)));
            jpeg_write_scanlines(&codec, &row, 1);
        }
        jpeg_finish_compress(&codec);
    });
    if (!is_complete)
        throw Error("libjpeg cannot write a JPEG of " + described(bgr.size()) + " pixels");
    const std::unique_ptr<unsigned char, decltype(&std::free)> held(file, std::free);
    return {file, file + size};
}

} // namespace fathom::io
