// Colours out of files: the picture of a renderer's layers, or an image.
#include "formats.hpp"

#include <algorithm>

namespace fathom {
namespace {

using io::refuse;

bool has(const std::vector<Channel>& channels, const std::string& name) {
    return std::any_of(channels.begin(), channels.end(), [&](const Channel& channel) { return channel.name == name; });
}

/// Names of layers with channels R, G and B; empty for channels without a layer.
std::vector<std::string> layers_of(const std::vector<Channel>& channels) {
    std::vector<std::string> layers;
    for (const Channel& channel : channels) {
        const auto dot = channel.name.rfind('.');
        const std::string front = dot == std::string::npos ? "" : channel.name.substr(0, dot + 1);
        if (channel.name == front + "R" && has(channels, front + "G") && has(channels, front + "B"))
            layers.push_back(front.empty() ? "" : front.substr(0, dot));
    }
    return layers;
}

/// How well a layer's name says that it is the picture, 0 the best; nothing when it does not say so.
std::optional<int> rank(const std::string& layer) {
    return io::place_of(layer, {"", "combined", "beauty", "rgba", "rgb", "color", "colour"});
}

// The layer whose name ends so after a view's name, or that the named channel belongs to.
std::string like(const std::string& name, const std::vector<std::string>& layers) {
    for (const std::string& layer : layers)
        if (!layer.empty() && (layer.ends_with("." + name) || name.starts_with(layer + ".")))
            return layer;
    return {};
}

std::string choose(const std::filesystem::path& file, const std::vector<Channel>& channels, const std::string& wanted) {
    const std::vector<std::string> layers = layers_of(channels);
    const std::string* best = nullptr;
    for (const std::string& layer : layers) {
        if (wanted.empty() ? rank(layer) && (!best || *rank(layer) < *rank(*best)) : layer == wanted)
            best = &layer;
    }
    if (!best && wanted.empty() && layers.size() == 1)
        best = &layers.front();
    if (best)
        return *best;
    if (layers.empty())
        refuse(file, "has no channels R, G and B, so no picture; it has " + io::listed(channels, &Channel::name));
    const std::string list =
        io::listed(layers, [](const std::string& layer) { return layer.empty() ? "R, G, B without a layer" : layer; });
    if (wanted.empty())
        refuse(file, "has no layer that is named like a picture (Combined, beauty); say which it is (--color-layer): " +
                         list);
    const std::string meant = like(wanted, layers);
    refuse(file, "has no layer \"" + wanted + "\" with channels R, G and B" +
                     (meant.empty() ? "; it has " + list : ", but " + meant + "; name that one"));
}

cv::Mat from_exr(const std::filesystem::path& file, const std::string& wanted) {
    const std::vector<Channel> channels = list_channels(file);
    const std::string layer = choose(file, channels, wanted), front = layer.empty() ? "" : layer + ".";
    std::vector<std::string> names{front + "B", front + "G", front + "R"};
    if (has(channels, front + "A"))
        names.push_back(front + "A");
    return io::read_exr_floats(file, names, "colours");
}

cv::Mat from_picture(const std::filesystem::path& file, const cv::Mat& image) {
    const bool codes = image.depth() == CV_8U || image.depth() == CV_16U;
    if ((image.channels() != 3 && image.channels() != 4) || (!codes && image.depth() != CV_32F))
        refuse(file,
               "is " + io::described(image) +
                   ", which is no picture; one has channels R, G, B and may have an alpha, in 8 or 16 bits or float");
    cv::Mat color;
    image.convertTo(color, CV_32F);
    const float largest = image.depth() == CV_8U ? 255.0f : image.depth() == CV_16U ? 65535.0f : 1.0f;
    for (int y = 0; y < color.rows && codes; ++y) {
        float* row = color.ptr<float>(y);
        for (int x = 0; x < color.cols * color.channels(); ++x)
            row[x] /= largest;
    }
    return color;
}

cv::Mat read(const std::filesystem::path& file, const std::string& layer) {
    if (io::begins_like_exr(file))
        return from_exr(file, layer);
    if (const auto image = io::read_plain(file, layer))
        return from_picture(file, *image);
    refuse(file, "is no picture, or its beginning is damaged; pictures are read from .exr, .tif, .pfm and .png");
}

} // namespace

cv::Mat read_color(const std::filesystem::path& file, const std::string& layer) {
    io::check_readable(file);
    return io::within_memory(file, [&] { return read(file, layer); });
}

} // namespace fathom
