// Pictures into files: light becomes what the format holds.
#include "formats.hpp"

#include "io/formats/metadata.hpp"

#include <opencv2/core.hpp>

#include <cmath>

namespace fathom {
namespace {

/// Codes of 8 or 16 bits: cut off at 0 and 1, 0 for NaN.
cv::Mat codes_of(const cv::Mat& color, int bits) {
    const double largest = bits == 8 ? 255 : 65535;
    cv::Mat codes(color.size(), CV_MAKETYPE(bits == 8 ? CV_8U : CV_16U, color.channels()));
    const auto fill = [&]<typename Code>(Code) {
        for (int y = 0; y < color.rows; ++y)
            std::transform(color.ptr<float>(y), color.ptr<float>(y) + color.cols * color.channels(), codes.ptr<Code>(y),
                           [largest](float value) {
                               return static_cast<Code>(value > 0 ? std::min<double>(value, 1) * largest + 0.5 : 0);
                           });
    };
    if (bits == 8)
        fill(std::uint8_t{});
    else
        fill(std::uint16_t{});
    return codes;
}

/// The picture without its alpha, which must be 1 everywhere.
cv::Mat opaque(const std::filesystem::path& file, const cv::Mat& color) {
    if (color.channels() == 3)
        return color;
    cv::Mat bgr(color.size(), CV_32FC3);
    for (int y = 0; y < color.rows; ++y)
        for (int x = 0; x < color.cols; ++x) {
            const auto& pixel = color.at<cv::Vec4f>(y, x);
            if (std::abs(pixel[3] - 1) > 0x1p-9f)
                io::refuse(file, "pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") has an alpha of " +
                                     std::to_string(pixel[3]) + ", which " +
                                     (file.has_extension() ? "a " + io::extension_of(file) : "a raw frame") +
                                     " does not hold; write a .png, .tif or .exr");
            bgr.at<cv::Vec3f>(y, x) = {pixel[0], pixel[1], pixel[2]};
        }
    return bgr;
}

} // namespace

PictureFormat format_for(const std::filesystem::path& file, const PictureFormat& format) {
    const std::string type = io::extension_of(file);
    PictureFormat result = format;
    if (type == ".jpg") {
        result.encoding = ColorEncoding::srgb;
        result.bits = 8;
        if (result.exif.size() > io::most_exif_of_jpeg)
            result.exif.clear();
    } else if (type == ".png") {
        result.bits = format.bits == 32 ? 16 : format.bits;
    } else if (type == ".tif" && format.bits < 32) {
        result.exif.clear();
    } else {
        return {};
    }
    if (result.encoding != format.encoding)
        result.icc.clear(); // whose curves are the other ones
    return result;
}

bool loses_metadata(const std::filesystem::path& file, const PictureFormat& format) {
    const PictureFormat kept = format_for(file, format);
    return kept.icc.size() < format.icc.size() || kept.exif.size() < format.exif.size();
}

std::optional<cv::Mat> io::picture_codes(const std::filesystem::path& file, const cv::Mat& color,
                                         const PictureFormat& format) {
    const std::string type = io::extension_of(file);
    if (format.bits == 32 || (type != ".jpg" && type != ".png" && type != ".tif"))
        return std::nullopt;
    cv::Mat encoded = type == ".jpg" ? opaque(file, color).clone() : color.clone();
    unpremultiply(encoded);
    from_linear(encoded, format.encoding);
    return codes_of(encoded, format.bits);
}

std::optional<io::Bytes> io::picture_bytes(const std::filesystem::path& file, const Picture& picture) {
    const std::string type = io::extension_of(file);
    const PictureFormat format = format_for(file, picture.format);
    if (type == ".hdr")
        return radiance_bytes(opaque(file, picture.color));
    const auto pixels = picture_codes(file, picture.color, format);
    if (!pixels)
        return std::nullopt;
    return type == ".jpg"   ? jpeg_bytes(*pixels, format)
           : type == ".png" ? png_bytes(*pixels, format)
                            : tiff_bytes(*pixels, format);
}

io::Bytes io::raw_bytes(const ImageFile& given, const RawFormat& format) {
    cv::Mat pixels = given.image;
    if (given.kind == ImageKind::color) {
        pixels = opaque(given.file, pixels);
        if (format.bits == 8) {
            const bool has_codes = given.format && given.format->bits < 32;
            pixels = pixels.clone();
            from_linear(pixels, has_codes ? given.format->encoding : ColorEncoding::srgb);
            pixels = codes_of(pixels, format.bits);
        }
        pixels = swap_red_and_blue(pixels);
    } else if (format.bits == 16) {
        pixels = png_codes(pixels, given.options.png_scale.value(), given.options.png_offset);
    }
    Bytes bytes(pixels.total() * pixels.elemSize());
    for (int y = 0; y < pixels.rows; ++y)
        std::copy_n(pixels.ptr(y), static_cast<std::size_t>(pixels.cols) * pixels.elemSize(),
                    bytes.data() +
                        static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.cols) * pixels.elemSize());
    return bytes;
}

void write_picture(const std::filesystem::path& file, const Picture& picture) {
    write_images({{.file = file, .image = picture.color, .kind = ImageKind::color, .format = picture.format}});
}

} // namespace fathom
