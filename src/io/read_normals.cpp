// Normals out of files: renderers' layers, and pictures of them.
#include "formats.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <new>

namespace fathom {
namespace {

using io::refuse;

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

/// Three channels of an EXR that belong together.
struct Layer {
    std::string name; ///< what stands before the last dot; empty for channels without one
    std::array<std::string, 3> channels;
};

// All layers with channels X, Y, Z or R, G, B, in any case.
std::vector<Layer> layers_of(const std::vector<Channel>& channels) {
    std::vector<Layer> layers;
    for (const Channel& first : channels) {
        const auto dot = first.name.rfind('.');
        const std::string front = dot == std::string::npos ? "" : first.name.substr(0, dot + 1);
        for (const char* ends : {"XYZ", "xyz", "RGB", "rgb"}) {
            Layer layer{front.substr(0, front.empty() ? 0 : dot), {}};
            bool complete = first.name == front + ends[0];
            for (std::size_t i = 0; i < 3; ++i) {
                layer.channels[i] = front + ends[i];
                complete = complete && std::any_of(channels.begin(), channels.end(), [&](const Channel& channel) {
                               return channel.name == layer.channels[i];
                           });
            }
            if (complete)
                layers.push_back(layer);
        }
    }
    return layers;
}

/// How well a layer's name says that it is normals, 0 the best; nothing when it does not say so.
std::optional<int> rank(const Layer& layer) {
    const std::string name = lower(layer.name);
    int place = 0;
    for (const char* known : {"n", "normal", "normals"}) {
        if (name == known || name.ends_with(std::string(".") + known))
            return place;
        ++place;
    }
    return std::nullopt;
}

std::string listed(const std::vector<Channel>& channels) {
    constexpr std::size_t most = 24;
    std::string list;
    for (std::size_t i = 0; i < std::min(channels.size(), most); ++i)
        list += (i ? ", " : "") + channels[i].name;
    return channels.size() > most ? list + ", and " + std::to_string(channels.size() - most) + " more" : list;
}

Layer choose(const std::filesystem::path& file, const std::string& wanted) {
    const std::vector<Channel> channels = list_channels(file);
    const std::vector<Layer> layers = layers_of(channels);
    const Layer* best = nullptr;
    for (const Layer& layer : layers) {
        if (wanted.empty() ? rank(layer) && (!best || *rank(layer) < *rank(*best)) : layer.name == wanted)
            best = &layer;
    }
    if (!best && wanted.empty() && layers.size() == 1 && channels.size() == 3)
        best = &layers.front();
    if (!best && !wanted.empty())
        refuse(file, "has no layer \"" + wanted + "\" with channels X, Y and Z; it has " + listed(channels));
    if (!best)
        refuse(file, "has no layer that is named like normals (N, Normal) with channels X, Y and Z; it has " +
                         listed(channels));
    return *best;
}

cv::Mat from_exr(const std::filesystem::path& file, const std::string& layer) {
    std::array<cv::Mat, 3> parts;
    const Layer chosen = choose(file, layer);
    for (std::size_t i = 0; i < 3; ++i) {
        const DepthFile part = io::read_exr(file, {.channel = chosen.channels[i], .packing = {}});
        if (part.storage != Storage::float32 && part.storage != Storage::float16)
            refuse(file, "channel \"" + chosen.channels[i] + "\" holds integers; normals are floats");
        part.values.convertTo(parts[i], CV_32F);
    }
    cv::Mat normals;
    cv::merge(parts.data(), parts.size(), normals);
    return normals;
}

cv::Mat from_picture(const std::filesystem::path& file, const cv::Mat& image) {
    const bool codes = image.depth() == CV_8U || image.depth() == CV_16U;
    if ((image.channels() != 3 && image.channels() != 4) || (!codes && image.depth() != CV_32F))
        refuse(file, "is " + io::described(image) +
                         ", which holds no normals; they are three channels x, y, z: float, or ½n + ½ in 8 or 16 bits");
    cv::Mat normals(image.size(), CV_32FC3), floats;
    image.convertTo(floats, CV_32F);
    const int pairs[] = {0, 0, 1, 1, 2, 2}; // an alpha says nothing
    cv::mixChannels(&floats, 1, &normals, 1, pairs, 3);
    if (codes) {
        // ½ itself lies between two codes; black is no normal.
        const float largest = image.depth() == CV_8U ? 255.0f : 65535.0f;
        for (int y = 0; y < normals.rows; ++y)
            for (int x = 0; x < normals.cols; ++x)
                if (auto& n = normals.at<cv::Vec3f>(y, x); n != cv::Vec3f(0, 0, 0))
                    for (int i = 0; i < 3; ++i)
                        n[i] = 2 * n[i] / largest - 1;
    }
    return normals;
}

// Files round, and renderers average over a pixel: lengths are made 1, and what has none is none.
void make_unit(cv::Mat& normals) {
    constexpr double least = 1e-3;
    for (int y = 0; y < normals.rows; ++y) {
        for (int x = 0; x < normals.cols; ++x) {
            auto& n = normals.at<cv::Vec3f>(y, x);
            const double length = std::hypot(n[0], n[1], n[2]);
            const bool good = length > least && std::isfinite(length);
            for (int i = 0; i < 3; ++i)
                n[i] = good ? static_cast<float>(n[i] / length) : 0.0f;
        }
    }
}

cv::Mat read(const std::filesystem::path& file, const std::string& layer) {
    if (io::begins_like_exr(file))
        return from_exr(file, layer);
    if (!layer.empty())
        refuse(file, "is no OpenEXR file and has no layer \"" + layer + "\"; leave the layer out");
    const auto bytes = io::read_file(file);
    for (const auto read_format : {io::read_png, io::read_tiff, io::read_netpbm})
        if (const auto image = read_format(file, bytes))
            return from_picture(file, *image);
    refuse(file, "is no image that holds normals, or its beginning is damaged; "
                 "they are read from .exr, .tif, .pfm and .png");
}

} // namespace

cv::Mat read_normals(const std::filesystem::path& file, const std::string& layer) {
    io::check_readable(file);
    try {
        cv::Mat normals = read(file, layer);
        make_unit(normals);
        return normals;
    } catch (const std::bad_alloc&) {
        refuse(file, "asks for more memory than there is; it is damaged or too large");
    } catch (const cv::Exception&) {
        refuse(file, "asks for more memory than there is; it is damaged or too large");
    }
}

} // namespace fathom
