// What the readers of depth, colours and normals share.
#include "formats.hpp"

#include <algorithm>
#include <cctype>

namespace fathom::io {

std::optional<cv::Mat> read_plain(const std::filesystem::path& file, const std::string& layer) {
    if (!layer.empty())
        refuse(file,
               "is no OpenEXR file and has no layer \"" + layer + "\"; leave it out (--color-layer of the program)");
    const Bytes bytes = read_file(file);
    for (const auto read : {read_png, read_tiff, read_netpbm})
        if (auto image = read(file, bytes))
            return image;
    return std::nullopt;
}

cv::Mat read_exr_floats(const std::filesystem::path& file, const std::vector<std::string>& channels, const char* what) {
    std::vector<cv::Mat> parts;
    for (const std::string& channel : channels) {
        const DepthFile part = read_exr(file, {.channel = channel, .packing = {}});
        if (part.storage != Storage::float32 && part.storage != Storage::float16)
            refuse(file, "channel \"" + channel + "\" holds integers; " + what + " are floats");
        part.values.convertTo(parts.emplace_back(), CV_32F);
    }
    cv::Mat image;
    cv::merge(parts, image);
    return image;
}

std::optional<int> place_of(const std::string& layer, std::initializer_list<std::string> known) {
    const std::string name = lower(layer);
    const auto place = std::find_if(known.begin(), known.end(), [&](const std::string& each) {
        return name == each || (!each.empty() && name.ends_with("." + each));
    });
    return place == known.end() ? std::nullopt : std::optional(static_cast<int>(place - known.begin()));
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

std::string described(const cv::Mat& image) {
    static constexpr const char* types[] = {"unsigned 8-bit", "signed 8-bit", "unsigned 16-bit", "signed 16-bit",
                                            "32-bit integer", "32-bit float", "64-bit float",    "16-bit float"};
    const auto channels = std::to_string(image.channels()) + (image.channels() == 1 ? " channel" : " channels");
    return std::string(types[image.depth()]) + " with " + channels;
}

} // namespace fathom::io
