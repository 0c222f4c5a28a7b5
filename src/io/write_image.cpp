// Results and pictures into files; the extension says which format.
#include "formats.hpp"
#include "replace_files.hpp"

#include "io/formats/codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <new>
#include <set>

namespace fathom {
namespace {

using io::extension_of;
using io::refuse;

void check_channels(const std::filesystem::path& file, const cv::Mat& image, std::initializer_list<int> allowed) {
    if (std::find(allowed.begin(), allowed.end(), image.channels()) != allowed.end())
        return;
    std::string list;
    for (const int channels : allowed)
        list += (list.empty() ? "" : " or ") + std::to_string(channels);
    refuse(file, "a " + extension_of(file) + " has " + list + " channels, the image has " +
                     std::to_string(image.channels()) + "; write an .exr");
}

std::vector<std::string> channel_names(const std::filesystem::path& file, const cv::Mat& image,
                                       const WriteOptions& options) {
    if (options.channels.empty() && image.channels() == 1)
        return {"Z", "Y"};
    const std::set<std::string> names(options.channels.begin(), options.channels.end());
    if (static_cast<int>(names.size()) < image.channels() || names.size() != options.channels.size() ||
        names.contains(""))
        refuse(file, "an .exr needs a name of its own for each of the " + std::to_string(image.channels()) +
                         " channels; " + std::to_string(names.size()) + " are given");
    return options.channels;
}

io::Bytes encoded(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options, bool is_color) {
    const auto in_file_order = [&] { return is_color ? io::swap_red_and_blue(image) : image; };
    const auto extension = extension_of(file);
    if (extension == ".exr") {
        WriteOptions named = options;
        named.channels = channel_names(file, image, options);
        return io::exr_bytes(file, image, named);
    }
    if (extension == ".npy")
        return io::npy_bytes(image, is_color);
    if (extension == ".tif") {
        check_channels(file, image, {1, 3, 4});
        return io::tiff_bytes(is_color ? image : io::swap_red_and_blue(image)); // whose channels OpenCV swaps
    }
    if (extension == ".pfm") {
        check_channels(file, image, {1, 3});
        return io::pfm_bytes(image, is_color);
    }
    if (extension == ".ply") {
        check_channels(file, image, {3, 4});
        return io::ply_bytes(file, in_file_order(), options.normals, options.colors);
    }
    if (extension == ".png") {
        check_channels(file, image, {1, 3, 4});
        if (!options.png_scale)
            refuse(file, "a .png holds 0 to 1 in 16 bits, these values have no such range; "
                         "give a scale (--png-scale) or write .exr, .tif, .pfm or .npy");
        if (!std::isfinite(*options.png_scale) || !std::isfinite(options.png_offset))
            refuse(file, "the scale of a .png is " + std::to_string(*options.png_scale) + ", its offset " +
                             std::to_string(options.png_offset) + "; both must be finite");
        const cv::Mat codes = io::png_codes(image, *options.png_scale, options.png_offset);
        return io::png_bytes(is_color ? codes : io::swap_red_and_blue(codes));
    }
    refuse(file, "the extension \"" + extension +
                     "\" is none that can be written; use .exr, .tif, .pfm, .npy, .png or .ply, "
                     "and for a picture .jpg or .hdr as well");
}

/// What `encode` returns, or a refusal that names the file.
template <typename Encode>
auto described_failure(const std::filesystem::path& file, const Encode& encode) {
    try {
        return encode();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        refuse(file, "there is not memory enough to write it; write a smaller part of the image");
    } catch (const std::exception& error) {
        refuse(file, std::string("cannot be written: ") + error.what() + "; check what it is made of, and its disk");
    }
}

/// `is_color`: the image is B, G, R, and a file that is no EXR R, G, B.
io::Bytes bytes_of_values(const ImageFile& given, bool is_color = false) {
    const auto& file = given.file;
    const cv::Mat& image = given.image;
    if (image.empty() || image.dims != 2 || image.depth() != CV_32F)
        refuse(file, "only images of 32-bit floats can be written; convert it first");
    return described_failure(file, [&] { return encoded(file, image, given.options, is_color); });
}

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

/// The bytes of a picture where its format is not that of plain floats, which `bytes_of_values` writes: then nothing.
std::optional<io::Bytes> picture_bytes(const std::filesystem::path& file, const Picture& picture) {
    const std::string type = extension_of(file);
    const PictureFormat format = format_for(file, picture.format);
    if (type == ".hdr")
        return io::radiance_bytes(opaque(file, picture.color));
    if (format.bits == 32 || (type != ".jpg" && type != ".png" && type != ".tif"))
        return std::nullopt;
    cv::Mat encoded = type == ".jpg" ? opaque(file, picture.color).clone() : picture.color.clone();
    io::unpremultiply(encoded);
    io::from_linear(encoded, format.encoding);
    const cv::Mat codes = codes_of(encoded, format.bits);
    return type == ".jpg"   ? io::jpeg_bytes(codes, format)
           : type == ".png" ? io::png_bytes(codes, format)
                            : io::tiff_bytes(codes, format);
}

void name_colors(ImageFile& picture) {
    const int channels = picture.image.channels();
    if (channels != 3 && channels != 4)
        refuse(picture.file, "a picture has 3 or 4 channels (B, G, R, alpha), the image has " +
                                 std::to_string(channels) + "; write it with write_image");
    if (picture.options.channels.empty()) {
        picture.options.channels = {"R", "G", "B", "A"};
        picture.options.channels.resize(static_cast<std::size_t>(channels));
    }
}

io::Bytes bytes_of_color(ImageFile picture) {
    name_colors(picture);
    if (picture.format && picture.image.depth() == CV_32F) {
        const auto bytes = described_failure(picture.file, [&] {
            return picture_bytes(picture.file, {picture.image, *picture.format});
        });
        if (bytes)
            return *bytes;
    }
    std::vector<std::string>& names = picture.options.channels;
    if (extension_of(picture.file) == ".exr") // whose channels have names
        for (std::size_t i = 0; i + 2 < names.size(); i += static_cast<std::size_t>(picture.image.channels()))
            std::swap(names[i], names[i + 2]);
    return bytes_of_values(picture, true);
}

io::Bytes bytes_of(const ImageFile& image) {
    return image.kind == ImageKind::color ? bytes_of_color(image) : bytes_of_values(image);
}

} // namespace

void write_image(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options) {
    write_images({{file, image, options}});
}

void write_color(const std::filesystem::path& file, const cv::Mat& color, const WriteOptions& options) {
    write_images({{file, color, options, ImageKind::color}});
}

void write_images(const std::vector<ImageFile>& images) {
    io::write_images_and(images, {});
}

void io::write_images_and(const std::vector<ImageFile>& images, const LastFile& last) {
    std::vector<NewFile> files;
    for (const ImageFile& image : images)
        files.push_back({image.file, bytes_of(image)});
    replace_files(files, last);
}

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
    const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
    return {whole.data, whole.data + whole.total() * whole.elemSize()};
}

void write_picture(const std::filesystem::path& file, const Picture& picture) {
    write_images({{.file = file, .image = picture.color, .kind = ImageKind::color, .format = picture.format}});
}

} // namespace fathom
