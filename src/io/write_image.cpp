// Results into files; the extension says which format.
#include "formats.hpp"
#include "replace_files.hpp"

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
            return io::picture_bytes(picture.file, {picture.image, *picture.format});
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

} // namespace fathom
