// Radiance pictures (.hdr): rows of R, G, B and the exponent that they share, each in runs of its own.
//   light = byte · 2^(e − 136), and 0 where e = 0
// Source: Ward, "Real Pixels", Graphics Gems II (1991), and "File formats" of Radiance's manual. A light is the lower end
// of its step there and here, so that 1 stays 1. EXPOSURE is not applied, and runs of before 1991 are not known.
#include "metadata.hpp"

#include "io/formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace fathom::io {
namespace {

constexpr std::string_view format_line = "FORMAT=32-bit_rle_rgbe";
constexpr int longest_run = 127, longest_list = 128;

bool may_have_runs(int width) {
    return width >= 8 && width <= 0x7fff;
}

void append_runs(Bytes& file, View row) {
    const auto run_at = [&](std::size_t x) {
        const auto end = row.begin() + static_cast<std::ptrdiff_t>(std::min(row.size(), x + longest_run));
        const auto begin = row.begin() + static_cast<std::ptrdiff_t>(x);
        return static_cast<std::size_t>(std::find_if(begin, end, [&](auto each) { return each != *begin; }) - begin);
    };
    for (std::size_t x = 0; x < row.size();) {
        std::size_t count = run_at(x);
        if (count > 2) {
            file.insert(file.end(), {static_cast<unsigned char>(128 + count), row[x]});
        } else {
            for (count = 1; x + count < row.size() && count < longest_list && run_at(x + count) < 4;)
                ++count;
            file.push_back(static_cast<unsigned char>(count));
            const View list = row.subspan(x, count);
            file.insert(file.end(), list.begin(), list.end());
        }
        x += count;
    }
}

} // namespace

std::optional<cv::Mat> read_radiance(const std::filesystem::path& file, const Bytes& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!text.starts_with("#?RADIANCE") && !text.starts_with("#?RGBE"))
        return std::nullopt;
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
        is_known |= each == format_line;
    long long width = 0, height = 0;
    if (!is_known || std::sscanf(std::string(line()).c_str(), "-Y %lld +X %lld", &height, &width) != 2)
        refuse_undecoded(file);
    check_size(file, width, height);
    constexpr std::uint64_t pixels_a_byte = 16; // a run of 127 takes two bytes in each of four channels
    const cv::Size size(static_cast<int>(width), static_cast<int>(height));
    check_holds(file, size, 1, bytes.size(), pixels_a_byte);

    View rest = View(bytes).subspan(at);
    const auto take = [&](std::size_t count) {
        if (count > rest.size())
            refuse_undecoded(file);
        const View taken = rest.first(count);
        rest = rest.subspan(count);
        return taken;
    };
    std::array<float, 256> unit{};
    for (int e = 1; e < 256; ++e)
        unit[static_cast<std::size_t>(e)] = std::ldexp(1.0f, e - 136);
    cv::Mat image(size, CV_32FC3), codes(4, size.width, CV_8U);
    const auto columns = static_cast<std::size_t>(width);
    bool runs = may_have_runs(size.width);
    for (int y = 0; y < image.rows; ++y) {
        runs = runs && rest.size() >= 4 && rest[0] == 2 && rest[1] == 2 && rest[2] < 128; // not behind a row without
        if (!runs) {
            codes = cv::Mat(size.width, 4, CV_8U, const_cast<unsigned char*>(take(4 * columns).data())).t();
        } else if (const View head = take(4); (std::size_t{head[2]} << 8 | head[3]) != columns) {
            refuse_undecoded(file);
        }
        for (std::size_t i = 0; runs && i < 4 * columns;) {
            const std::size_t code = take(1)[0], count = code > 128 ? code - 128 : code;
            if (count == 0 || count > columns - i % columns)
                refuse_undecoded(file);
            if (code > 128)
                std::fill_n(codes.data + i, count, take(1)[0]);
            else
                std::ranges::copy(take(count), codes.data + i);
            i += count;
        }
        for (int x = 0; x < image.cols; ++x)
            for (int c = 0; c < 3; ++c)
                image.at<cv::Vec3f>(y, x)[2 - c] = codes.at<unsigned char>(c, x) * unit[codes.at<unsigned char>(3, x)];
    }
    return image;
}

Bytes radiance_bytes(const cv::Mat& bgr) {
    const std::string head = "#?RGBE\n" + std::string(format_line) + "\n\n-Y " + std::to_string(bgr.rows) + " +X " +
                             std::to_string(bgr.cols) + "\n";
    Bytes file(head.begin(), head.end());
    cv::Mat codes(4, bgr.cols, CV_8U);
    for (int y = 0; y < bgr.rows; ++y) {
        for (int x = 0; x < bgr.cols; ++x) {
            cv::Vec3f light = bgr.at<cv::Vec3f>(y, x);
            for (float& each : light.val) // it holds no negative values, NaN or infinity
                each = each > 0 ? std::min(each, 1e38f) : 0.0f;
            int exponent = -128;
            if (const float most = *std::ranges::max_element(light.val); most >= 1e-32f)
                std::frexp(most, &exponent);
            const float scale = exponent == -128 ? 0.0f : std::ldexp(1.0f, 8 - exponent);
            for (int c = 0; c < 3; ++c)
                codes.at<unsigned char>(c, x) = static_cast<unsigned char>(light[2 - c] * scale);
            codes.at<unsigned char>(3, x) = static_cast<unsigned char>(exponent + 128);
        }
        if (!may_have_runs(bgr.cols)) {
            const cv::Mat pixels = codes.t();
            file.insert(file.end(), pixels.datastart, pixels.dataend);
            continue;
        }
        file.insert(file.end(),
                    {2, 2, static_cast<unsigned char>(bgr.cols >> 8), static_cast<unsigned char>(bgr.cols & 255)});
        for (int c = 0; c < 4; ++c)
            append_runs(file, {codes.ptr(c), codes.ptr(c) + bgr.cols});
    }
    return file;
}

} // namespace fathom::io
