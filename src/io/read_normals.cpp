// Normals out of files: renderers' layers, and pictures of them.
#include "formats.hpp"

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

using io::Layer, io::refuse;

constexpr double least_length = 1e-3; // shorter vectors have no direction

Layer choose(const std::filesystem::path& file, const std::string& wanted) {
    const std::vector<Channel> channels = list_channels(file);
    const std::vector<Layer> layers = io::layers_of(channels, {"XYZ", "xyz", "RGB", "rgb"});
    const Layer* best = io::layer_of(layers, wanted, {"n", "normal", "normals"});
    if (!best && wanted.empty() && layers.size() == 1 && channels.size() == 3)
        best = &layers.front();
    if (!best)
        refuse(file, "has no layer " +
                         (wanted.empty() ? "that is named like normals (N, Normal)" : "\"" + wanted + "\"") +
                         " with channels X, Y and Z; it has " + io::listed(channels, &Channel::name));
    return *best;
}

cv::Mat from_picture(const std::filesystem::path& file, const cv::Mat& image) {
    if (!io::has_colors(image))
        refuse(file, "is " + io::described(image) +
                         ", which holds no normals; they are three channels x, y, z: float, or ½n + ½ in 8 or 16 bits");
    cv::Mat normals(image.size(), CV_32FC3), floats;
    image.convertTo(floats, CV_32F);
    const int pairs[] = {2, 0, 1, 1, 0, 2}; // x is the red channel, OpenCV's last; an alpha says nothing
    cv::mixChannels(&floats, 1, &normals, 1, pairs, 3);
    if (image.depth() != CV_32F) {
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

// A vector without a length is no normal. Others keep theirs, which says whether a renderer took a mean over an edge. Pictures and
// positions have three channels, too, but their lengths are anything.
void clear_none(const std::filesystem::path& file, cv::Mat& normals) {
    constexpr double few = 0.25, near_one = 0.2; // a renderer's mean over a pixel at an edge is shorter
    std::size_t vectors = 0, others = 0;
    for (auto& n : cv::Mat_<cv::Vec3f>(normals)) {
        const double length = std::hypot(n[0], n[1], n[2]);
        const bool is_vector = length > least_length && std::isfinite(length);
        vectors += is_vector;
        others += is_vector && std::abs(length - 1) > near_one;
        if (!is_vector)
            n = cv::Vec3f(0, 0, 0);
    }
    if (static_cast<double>(others) > few * static_cast<double>(vectors))
        refuse(file, "holds " + std::to_string(vectors) + " vectors, " + std::to_string(others) +
                         " of which have lengths unlike 1; normals have length 1, so it is a picture or positions");
}

cv::Mat read(const std::filesystem::path& file, const std::string& layer, const std::optional<Windows>& windows) {
    if (io::begins_like_exr(file))
        return io::read_exr_floats(file, choose(file, layer).channels, "normals", windows);
    if (!layer.empty())
        io::refuse_layer(file, layer);
    const cv::Mat image = io::read_image(file, {"normals", ".exr, .tif, .pfm, .npy and .png"}).image;
    io::check_fills(file, image.size(), windows);
    return from_picture(file, image);
}

} // namespace

cv::Mat read_normals(const std::filesystem::path& file, const std::string& layer,
                     const std::optional<Windows>& windows) {
    return io::within_memory(file, [&] {
        cv::Mat normals = read(file, layer, windows);
        clear_none(file, normals);
        return normals;
    });
}

} // namespace fathom
