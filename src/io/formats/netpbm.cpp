// Portable float maps and 16-bit portable grey maps, which hold depth for Middlebury's, ICL's and many other tools.
// Read here rather than with OpenCV, which divides by the scale of a float map (everyone else ignores its magnitude;
// its sign is the byte order) and so changes the values.
// Source: Debevec's PFM notes; netpbm's pgm(5).
#include "io/formats.hpp"

#include <opencv2/core.hpp>

#include <algorithm>
#include <charconv>
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

[[noreturn]] void refuse_beyond(const std::filesystem::path& file, double code) {
    refuse(file,
           "is damaged: a code is " + std::to_string(std::llround(code)) + ", beyond the largest; write it again");
}

/// The codes of a grey map that is a text.
cv::Mat codes_in(const std::filesystem::path& file, std::string_view text, cv::Size size, double largest) {
    check_holds(file, size, 2, text.size(), 1); // a figure and a blank each
    cv::Mat codes(size, CV_16UC1);
    std::size_t at = 0;
    for (std::uint16_t& code : cv::Mat_<std::uint16_t>(codes)) {
        const auto found = number<unsigned>(file, word(text, at));
        if (found > largest)
            refuse_beyond(file, found);
        code = static_cast<std::uint16_t>(found);
    }
    if (largest <= 255)
        codes.convertTo(codes, CV_8U);
    return codes;
}

} // namespace

std::optional<cv::Mat> read_netpbm(const std::filesystem::path& file, const Bytes& bytes, bool as_counted) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::size_t at = 0;
    const auto magic = text.substr(0, 3);
    if (magic.size() < 3 || !is_space(magic[2]) ||
        (!magic.starts_with("Pf") && !magic.starts_with("PF") && !magic.starts_with("P5") && !magic.starts_with("P2")))
        return std::nullopt;

    at = 2;
    const bool floats = magic[1] != '5' && magic[1] != '2';
    const auto width = number<long long>(file, word(text, at));
    const auto height = number<long long>(file, word(text, at));
    check_size(file, width, height);
    const auto scale = number<double>(file, word(text, at)); // of a grey map: its largest value
    if (!floats && !(scale >= 1 && scale <= 65535))
        refuse(file, "counts to " + std::to_string(static_cast<long long>(scale > 0 ? std::min(scale, 1e9) : 0)) +
                         ", but a grey map counts to 1 to 65535; write it again");
    if (!floats && scale > 255 && scale != 65535 && !as_counted)
        refuse(file,
               "counts to " + std::to_string(static_cast<long long>(std::min(scale, 1e9))) +
                   ", but only 16-bit codes that count to 65535 are fractions of a range; stretch them to that range, "
                   "or say that they are lengths (\"encoding\": \"view-z\", \"scale\")");
    if (!floats && !(scale >= (as_counted ? 1 : 255))) // or no number
        refuse(file, "counts to " + std::to_string(static_cast<long long>(scale > 0 ? scale : 0)) +
                         ", but 8-bit codes are taken to count to 255; stretch them to that range");
    if (magic[1] == '2')
        return codes_in(file, text.substr(at), {static_cast<int>(width), static_cast<int>(height)}, scale);
    ++at; // exactly one space ends the header

    const int type = floats ? CV_32FC(magic[1] == 'F' ? 3 : 1) : scale > 255 ? CV_16UC1 : CV_8UC1;
    const bool file_little = floats && scale < 0;
    const auto row_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(CV_ELEM_SIZE(type));
    if (at > bytes.size() || (bytes.size() - at) / row_bytes < static_cast<std::size_t>(height))
        refuse(file, "ends too early: " + std::to_string(width) + " x " + std::to_string(height) +
                         " pixels do not fit into " + std::to_string(bytes.size()) + " bytes; write or copy it again");

    cv::Mat image(static_cast<int>(height), static_cast<int>(width), type);
    for (int y = 0; y < image.rows; ++y) {
        const int at_row = floats ? image.rows - 1 - y : y; // float maps begin at the bottom
        auto* row = image.ptr(at_row);
        std::memcpy(row, bytes.data() + at + static_cast<std::size_t>(y) * row_bytes, row_bytes);
        if (image.elemSize1() > 1 && file_little != is_little_endian)
            swap_bytes(row, row_bytes / image.elemSize1(), image.elemSize1());
        swap_red_and_blue_of_row(image, at_row); // the file's order is R, G, B
    }
    if (double most = 0; !floats && scale < (scale > 255 ? 65535 : 255)) {
        cv::minMaxLoc(image, nullptr, &most);
        if (most > scale)
            refuse_beyond(file, most);
    }
    return image;
}

Bytes pfm_bytes(const cv::Mat& image, bool is_color) {
    const auto header = std::string(image.channels() == 1 ? "Pf" : "PF") + "\n" + std::to_string(image.cols) + " " +
                        std::to_string(image.rows) + "\n" + (is_little_endian ? "-1.0" : "1.0") + "\n";
    const auto row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
    Bytes bytes(header.begin(), header.end());
    bytes.reserve(header.size() + row_bytes * static_cast<std::size_t>(image.rows));
    for (int y = image.rows - 1; y >= 0; --y) {
        const cv::Mat row = is_color ? swap_red_and_blue(image.row(y)) : image.row(y);
        bytes.insert(bytes.end(), row.ptr(), row.ptr() + row_bytes);
    }
    return bytes;
}

} // namespace fathom::io
