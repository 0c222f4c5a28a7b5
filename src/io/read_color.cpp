// Colours out of files: the picture of a renderer's layers, or an image.
#include "formats.hpp"

#include "io/formats/codecs.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

namespace fathom {
namespace {

using io::Layer, io::PictureFile;
using io::refuse;

Layer choose(const std::filesystem::path& file, const std::vector<Channel>& channels, const std::string& wanted) {
    std::vector<Layer> layers = io::layers_of(channels, {"RGB"});
    std::erase_if(layers, [](const Layer& layer) { return layer.channels[0].starts_with('.'); }); // no layer's, nor R
    if (wanted.empty()) // results that --append has written for Blender
        std::erase_if(layers, [](const Layer& layer) { return layer.name.starts_with("Fathom."); });
    const Layer* best = io::layer_of(layers, wanted, {"", "combined", "beauty", "rgba", "rgb", "color", "colour"});
    if (!best && wanted.empty() && layers.size() == 1)
        best = &layers.front();
    if (best)
        return *best;
    if (layers.empty())
        refuse(file, "has no channels R, G and B, so no picture; it has " + io::listed(channels, &Channel::name));
    const std::string list = io::listed(
        layers, [](const Layer& layer) { return layer.name.empty() ? "R, G, B without a layer" : layer.name; });
    if (wanted.empty())
        refuse(file, "has no layer that is named like a picture (Combined, beauty); say which it is (--color-layer): " +
                         list);
    refuse(file, "has no layer \"" + wanted + "\" with channels R, G and B; it has " + list);
}

void check_picture(const std::filesystem::path& file, const cv::Mat& image) {
    if (!io::has_colors(image))
        refuse(file,
               "is " + io::described(image) +
                   ", which is no picture; one has channels R, G, B and may have an alpha, in 8 or 16 bits or float" +
                   (image.channels() == 1 ? "; is it depth?" : ""));
}

cv::Mat as_floats(const cv::Mat& image) {
    if (image.depth() == CV_32F)
        return image;
    cv::Mat color;
    image.convertTo(color, CV_32F);
    const float largest = image.depth() == CV_8U ? 255.0f : 65535.0f;
    for (int y = 0; y < color.rows; ++y) {
        float* row = color.ptr<float>(y);
        for (int x = 0; x < color.cols * color.channels(); ++x)
            row[x] /= largest;
    }
    return color;
}

PictureFile any_image(const std::filesystem::path& file, const ReadPictureOptions& options) {
    if (io::begins_like_exr(file)) {
        std::vector<std::string> channels = color_channels(file, options.layer);
        std::swap(channels[0], channels[2]); // OpenCV's order
        return {.image = io::read_exr_floats(file, channels, "colours", options.windows),
                .primaries = io::exr_primaries(file, channels.front())};
    }
    if (!options.layer.empty())
        io::refuse_layer(file, options.layer);
    return io::read_image(file, {"a picture", ".exr, .jpg, .png, .tif, .hdr, .npy and .pfm", true});
}

PictureFile read_picture_file(const std::filesystem::path& file, const ReadPictureOptions& options) {
    PictureFile picture = io::within_memory(file, [&] { return any_image(file, options); });
    if (picture.image.type() == CV_8UC1) // a grey photograph; 16 bits and floats of one channel are mostly depth
        cv::merge(std::vector<cv::Mat>(3, picture.image), picture.image);
    check_picture(file, picture.image);
    return picture;
}

} // namespace

std::vector<std::string> color_channels(const std::filesystem::path& file, const std::string& wanted) {
    const std::vector<Channel> channels = list_channels(file);
    const Layer layer = choose(file, channels, wanted);
    std::vector<std::string> names = layer.channels;
    const std::string alpha = layer.name.empty() ? "A" : layer.name + ".A";
    if (std::ranges::find(channels, alpha, &Channel::name) != channels.end())
        names.push_back(alpha);
    return names;
}

cv::Mat read_color(const std::filesystem::path& file, const std::string& layer) {
    return as_floats(read_picture_file(file, {.layer = layer}).image);
}

Picture read_picture(const std::filesystem::path& file, const ReadPictureOptions& options) {
    PictureFile held = read_picture_file(file, options);
    held.image = io::upright(held.image, io::orientation_of(held.exif));
    if (!io::begins_like_exr(file))
        io::check_fills(file, held.image.size(), options.windows);
    const int depth = held.image.depth();
    const bool codes = depth != CV_32F;
    Picture picture;
    picture.format.bits = depth == CV_8U ? 8 : depth == CV_16U ? 16 : 32;
    const ColorEncoding of_type =
        !codes || io::is_linear_profile(held.icc) ? ColorEncoding::linear : ColorEncoding::srgb;
    picture.format.encoding = options.encoding.value_or(held.encoding.value_or(of_type));
    picture.color = as_floats(held.image);
    io::set_upright(held.exif);
    if (io::is_rgb_profile(held.icc)) // which a grey one would not fit
        picture.format.icc = std::move(held.icc);
    else
        picture.format.incomplete = !held.icc.empty();
    picture.format.incomplete |= held.has_more;
    picture.format.primaries = std::move(held.primaries);
    picture.format.exif = std::move(held.exif);
    const bool straight = held.straight_alpha.value_or(codes);
    const bool encoded = picture.format.encoding != ColorEncoding::linear;
    if (encoded && !straight) // the codes are multiplied, and not the light
        io::unpremultiply(picture.color);
    io::to_linear(picture.color, picture.format.encoding);
    if (encoded || straight)
        io::premultiply(picture.color);
    return picture;
}

} // namespace fathom
