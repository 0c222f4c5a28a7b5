// Formats whose headers are texts: portable float maps and grey maps, which hold depth for Middlebury's, ICL's and many other tools,
// Radiance's pictures, and COLMAP's maps. Float maps are read here rather than with OpenCV, which divides by their scale (everyone else ignores its
// magnitude; its sign is the byte order) and so changes the values.
// Source: Debevec's PFM notes; netpbm's pgm(5); "File formats" of Radiance's manual.
#include "codecs.hpp"

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>

namespace fathom::io {
namespace {

bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// The header's next word; comments run from # to the end of a line.
std::string_view word(std::string_view text, std::size_t& at) {
    while (at < text.size() && (is_space(text[at]) || text[at] == '#'))
        at = text[at] == '#' ? std::min(text.find('\n', at), text.size()) : at + 1;
    const auto begin = at;
    while (at < text.size() && !is_space(text[at]))
        ++at;
    return text.substr(begin, at - begin);
}

template <typename T>
T number(const std::filesystem::path& file, std::string_view word) {
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
        std::string shown(word.substr(0, 32));
        std::replace_if(
            shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
        refuse(file, "is damaged: its header has \"" + shown + "\" where a number belongs; write it again");
    }
    return value;
}

void swap_bytes(unsigned char* row, std::size_t elements, std::size_t size) {
    for (std::size_t i = 0; i < elements; ++i)
        std::reverse(row + i * size, row + (i + 1) * size);
}

/// Size and scale of a map; of a grey map the scale is its largest value.
struct MapHeader {
    cv::Size size;
    double scale;
    std::size_t pixels; ///< where these begin, behind the last word and exactly one space
};

MapHeader map_header(const std::filesystem::path& file, std::string_view text) {
    std::size_t at = 2;
    const auto width = number<long long>(file, word(text, at)), height = number<long long>(file, word(text, at));
    check_size(file, width, height);
    const auto scale = number<double>(file, word(text, at));
    return {{static_cast<int>(width), static_cast<int>(height)}, scale, std::min(at + 1, text.size())};
}

} // namespace

std::optional<cv::Mat> read_pfm(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view text = text_of(bytes), magic = text.substr(0, 3);
    if (magic.size() < 3 || !is_space(magic[2]) || (!magic.starts_with("Pf") && !magic.starts_with("PF")))
        return std::nullopt;
    const MapHeader header = map_header(file, text);
    const int type = CV_32FC(magic[1] == 'F' ? 3 : 1);
    check_holds(file, header.size, static_cast<std::size_t>(CV_ELEM_SIZE(type)), bytes.size() - header.pixels, 1);
    cv::Mat image(header.size, type);
    const std::size_t row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
    for (int y = 0; y < image.rows; ++y) {
        const int at_row = image.rows - 1 - y; // they begin at the bottom
        auto* row = image.ptr(at_row);
        std::memcpy(row, bytes.data() + header.pixels + static_cast<std::size_t>(y) * row_bytes, row_bytes);
        if (!(header.scale < 0))
            swap_bytes(row, row_bytes / 4, 4);
        swap_red_and_blue_of_row(image, at_row); // the file's order is R, G, B
    }
    return image;
}

std::optional<cv::Mat> read_pgm(const std::filesystem::path& file, const Bytes& bytes, bool as_counted) {
    const std::string_view text = text_of(bytes);
    if (text.size() < 3 || !is_space(text[2]) || !text.starts_with("P5"))
        return std::nullopt;
    const auto [size, scale, begin] = map_header(file, text);
    if (!(scale >= 1 && scale <= 65535 && scale == std::floor(scale)))
        refuse(file, "counts to " + std::to_string(static_cast<long long>(scale > 0 ? std::min(scale, 1e9) : 0)) +
                         ", but a grey map counts to 1 to 65535; write it again");
    if (scale > 255 && scale != 65535 && !as_counted)
        refuse(file,
               "counts to " + std::to_string(static_cast<long long>(scale)) +
                   ", but only 16-bit codes that count to 65535 are fractions of a range; stretch them to that range, "
                   "or say that they are lengths (\"encoding\": \"view-z\", \"scale\")");
    if (scale < 255 && !as_counted)
        refuse(file, "counts to " + std::to_string(static_cast<long long>(scale)) +
                         ", but 8-bit codes are taken to count to 255; stretch them to that range");
    const int type = scale > 255 ? CV_16UC1 : CV_8UC1;
    check_holds(file, size, static_cast<std::size_t>(CV_ELEM_SIZE(type)), bytes.size() - begin, 1);
    cv::Mat map(size, type);
    std::memcpy(map.data, bytes.data() + begin, map.total() * map.elemSize());
    if (scale > 255)
        swap_bytes(map.data, map.total(), 2);
    double most = 0;
    cv::minMaxLoc(map, nullptr, &most);
    if (most > scale)
        refuse(file,
               "is damaged: a code is " + std::to_string(std::llround(most)) + ", beyond the largest; write it again");
    return map;
}

PictureFile read_radiance(const std::filesystem::path& file, Bytes& bytes) {
    const std::string_view text = text_of(bytes);
    std::size_t at = 0;
    const auto line = [&] {
        const std::size_t begin = at, end = text.find('\n', at);
        if (end == text.npos)
            refuse_undecoded(file);
        at = end + 1;
        return text.substr(begin, end - begin);
    };
    bool is_known = false;
    for (std::string_view each = line(); !each.empty(); each = line())
        is_known |= each == "FORMAT=32-bit_rle_rgbe";
    long long width = 0, height = 0;
    if (!is_known || std::sscanf(std::string(line()).c_str(), "-Y %lld +X %lld", &height, &width) != 2)
        refuse_undecoded(file);
    check_size(file, width, height);
    constexpr std::uint64_t pixels_a_byte = 16; // a run of 127 takes two bytes in each of four channels
    check_holds(file, {static_cast<int>(width), static_cast<int>(height)}, 1, bytes.size(), pixels_a_byte);
    const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " +
                               std::to_string(width) + "\n"; // OpenCV cuts longer lines in two
    Bytes plain(header.begin(), header.end());
    plain.insert(plain.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
    return {.image = decoded(file, plain, {static_cast<int>(width), static_cast<int>(height)})};
}

// OpenCV writes these through a file in /tmp, and does not tell when that is full. Pixels are not packed: none looks like the beginning
// of a run, because its largest number is 128 or more, or all are 0.
Bytes radiance_bytes(const cv::Mat& bgr) {
    const std::string head = std::string("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y ") + std::to_string(bgr.rows) + " +X " +
                             std::to_string(bgr.cols) + "\n";
    Bytes file(head.begin(), head.end());
    file.reserve(file.size() + 4 * bgr.total());
    for (int y = 0; y < bgr.rows; ++y)
        for (int x = 0; x < bgr.cols; ++x) {
            cv::Vec3f light = bgr.at<cv::Vec3f>(y, x);
            for (float& each : light.val) // it holds no negative values, NaN or infinity
                each = each > 0 ? std::min(each, 1e38f) : 0.0f;
            int exponent = -128;
            if (const float most = *std::ranges::max_element(light.val); most >= 1e-32f)
                std::frexp(most, &exponent);
            const float scale = exponent == -128 ? 0.0f : std::ldexp(1.0f, 8 - exponent);
            for (int c = 0; c < 3; ++c)
                file.push_back(static_cast<unsigned char>(light[2 - c] * scale));
            file.push_back(static_cast<unsigned char>(exponent + 128));
        }
    return file;
}

Bytes pfm_bytes(const cv::Mat& image, bool is_color) {
    const auto header = std::string(image.channels() == 1 ? "Pf" : "PF") + "\n" + std::to_string(image.cols) + " " +
                        std::to_string(image.rows) + "\n-1.0\n";
    const auto row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
    Bytes bytes(header.begin(), header.end());
    bytes.reserve(header.size() + row_bytes * static_cast<std::size_t>(image.rows));
    for (int y = image.rows - 1; y >= 0; --y) {
        const cv::Mat row = is_color ? swap_red_and_blue(image.row(y)) : image.row(y);
        bytes.insert(bytes.end(), row.ptr(), row.ptr() + row_bytes);
    }
    return bytes;
}

// COLMAP's depth and normal maps, *.geometric.bin and *.photometric.bin: "WIDTH&HEIGHT&CHANNELS&", then little-endian floats,
// row by row, one channel after the other. Source: COLMAP, src/colmap/mvs/mat.h.

std::optional<cv::Mat> read_colmap_map(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view text = text_of(bytes);
    std::array<long long, 3> sizes{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (long long& size : sizes) {
        const auto [next, error] = std::from_chars(at, end, size);
        if (error != std::errc() || next == end || *next != '&' || size < 0)
            return std::nullopt;
        at = next + 1;
    }
    const auto [width, height, channels] = sizes;
    check_size(file, width, height);
    if (channels != 1 && channels != 3)
        refuse(file,
               "is a map of COLMAP with " + std::to_string(channels) + " channels; depth has 1, and normals have 3");
    const cv::Size size(static_cast<int>(width), static_cast<int>(height));
    const std::size_t plane_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4;
    const std::size_t there = static_cast<std::size_t>(end - at),
                      needed = plane_bytes * static_cast<std::size_t>(channels);
    if (there != needed)
        refuse(file, (there < needed ? "ends too early: " : "is damaged: ") + described(size) + " pixels have " +
                         std::to_string(needed) + " bytes, and it has " + std::to_string(there) +
                         "; write or copy it again");
    std::vector<cv::Mat> planes;
    for (long long c = 0; c < channels; ++c, at += plane_bytes) {
        cv::Mat& plane = planes.emplace_back(size, CV_32FC1);
        std::memcpy(plane.data, at, plane_bytes);
    }
    std::ranges::reverse(planes); // x, y, z in OpenCV's order
    cv::Mat image;
    cv::merge(planes, image);
    return image;
}

} // namespace fathom::io
