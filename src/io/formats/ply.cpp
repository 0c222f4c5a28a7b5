// Positions as a point cloud: PLY, binary, the lowest byte first (Turk 1994). Normals are nx, ny, nz, colours red, green
// and blue of 8 bits, as all readers know them.
#include "io/formats.hpp"

#include <opencv2/core.hpp>

#include <cmath>
#include <string>

namespace fathom::io {
namespace {

bool is_point(const float* p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

void check(const std::filesystem::path& file, const cv::Mat& attribute, const cv::Mat& positions, const char* what) {
    if (attribute.depth() != CV_32F || attribute.channels() < 3 || attribute.size() != positions.size())
        refuse(file, std::string("its ") + what + " must be 3 floats for each of the " + described(positions.size()) +
                         " positions");
}

/// The colours of pixels as codes from 0 to 255, in the order B, G, R.
cv::Mat color_codes(const cv::Mat& colors) {
    cv::Mat light = colors.clone(), codes;
    unpremultiply(light);
    from_linear(light, ColorEncoding::srgb);
    cv::patchNaNs(light, 0);
    cv::min(light, cv::Scalar::all(1), light); // also infinity, which no integer is
    light.convertTo(codes, CV_8U, 255);        // rounds, and ends at 0 and 255
    return codes;
}

template <typename Value>
void put(Bytes& bytes, const Value* values) {
    const auto* begin = reinterpret_cast<const unsigned char*>(values);
    bytes.insert(bytes.end(), begin, begin + 3 * sizeof(Value));
}

} // namespace

Bytes ply_bytes(const std::filesystem::path& file, const cv::Mat& positions, const cv::Mat& normals,
                const cv::Mat& colors) {
    if (!normals.empty())
        check(file, normals, positions, "normals");
    if (!colors.empty())
        check(file, colors, positions, "colours");
    const cv::Mat codes = colors.empty() ? cv::Mat() : color_codes(colors);
    const auto for_each_point = [&](const auto& use) {
        for (int y = 0; y < positions.rows; ++y)
            for (int x = 0; x < positions.cols; ++x)
                if (const float* p = positions.ptr<float>(y) + x * positions.channels(); is_point(p))
                    use(p, x, y);
    };
    std::size_t count = 0;
    for_each_point([&](const float*, int, int) { ++count; });
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
                         "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!normals.empty())
        header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!colors.empty())
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    header += "end_header\n";
    Bytes bytes(header.begin(), header.end());
    bytes.reserve(header.size() + count * ((normals.empty() ? 3 : 6) * sizeof(float) + (colors.empty() ? 0 : 3)));
    for_each_point([&](const float* p, int x, int y) {
        put(bytes, p);
        if (!normals.empty())
            put(bytes, normals.ptr<float>(y) + x * normals.channels());
        if (!codes.empty()) {
            const unsigned char* bgr = codes.ptr(y) + x * codes.channels();
            const unsigned char rgb[] = {bgr[2], bgr[1], bgr[0]};
            put(bytes, rgb);
        }
    });
    return bytes;
}

} // namespace fathom::io
