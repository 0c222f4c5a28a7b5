// Which file holds depth, and as what. The content decides, not the file's extension.
#include "formats.hpp"

#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace fathom {
namespace io {
namespace {

/// Are four bytes those of a float, in any order? Fractions and colours are not: floats that are lengths have nearly the same sign and
/// exponent everywhere, and their mantissa bends at powers of two.
class FloatBytes {
public:
    /// Looks at B, G, R and A.
    void add(const cv::Mat& bgra);

    bool are_floats() const;

private:
    struct Order {
        std::vector<std::uint32_t> lengths; ///< bits, without the sign
        std::size_t others = 0, negative = 0, pairs = 0, smooth = 0;
        Bends bends = {};

        bool is_of_floats(std::size_t seen) const;
    };
    std::array<Order, 4> orders_ = {};
    std::size_t seen_ = 0;
};

/// Places among B, G, R and A of the bytes of a number, from the lowest on: R, G, B, A and B, G, R, A in both byte orders.
constexpr std::array<std::array<int, 4>, 4> places{{{2, 1, 0, 3}, {3, 0, 1, 2}, {0, 1, 2, 3}, {3, 2, 1, 0}}};

std::uint32_t bits_of(const cv::Vec4b& bytes, const std::array<int, 4>& place) {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i)
        bits |= std::uint32_t{bytes[place[static_cast<std::size_t>(i)]]} << (8 * i);
    return bits;
}

bool is_length(float value) {
    return std::abs(value) > 1e-3f && std::abs(value) < 1e6f;
}

/// What is written where nothing is.
bool is_no_length(float value) {
    return !std::isfinite(value) || value == 0 || std::abs(value) >= 1e9f;
}

void FloatBytes::add(const cv::Mat& bgra) {
    constexpr int step = 4;
    std::vector<std::uint32_t> line;
    for (std::size_t i = 0; i < places.size(); ++i) {
        Order& order = orders_[i];
        const auto bits = [&](int x, int y) { return bits_of(bgra.at<cv::Vec4b>(y, x), places[i]); };
        const auto add_bends = [&] {
            for (std::uint32_t& each : line)
                each &= 0x7fffffff;
            order.bends.add(line, 23);
            line.clear();
        };
        for (int y = 0; y < bgra.rows; y += step) {
            float before = std::nanf("");
            for (int x = 0; x < bgra.cols; ++x) {
                line.push_back(bits(x, y));
                const auto value = std::bit_cast<float>(line.back());
                if (is_length(value)) {
                    if (x % step == 0) {
                        order.lengths.push_back(line.back() & 0x7fffffff);
                        order.negative += value < 0;
                    }
                    if (is_length(before)) {
                        ++order.pairs;
                        order.smooth += std::abs(value - before) <= 0.05f * std::abs(value);
                    }
                } else if (x % step == 0)
                    order.others += !is_no_length(value);
                before = value;
            }
            add_bends();
        }
        for (int x = 0; x < bgra.cols; x += step) {
            for (int y = 0; y < bgra.rows; ++y)
                line.push_back(bits(x, y));
            add_bends();
        }
    }
    seen_ += static_cast<std::size_t>((bgra.rows + step - 1) / step) *
             static_cast<std::size_t>((bgra.cols + step - 1) / step);
}

bool FloatBytes::Order::is_of_floats(std::size_t seen) const {
    const std::size_t count = lengths.size();
    constexpr std::size_t least = 16;
    if (count < least || 20 * count < seen || 50 * others > count || // but for a few that are wrong
        (50 * negative > count && 50 * (count - negative) > count) || 10 * smooth < 7 * pairs)
        return false;
    std::vector<std::uint32_t> sorted = lengths;
    const auto quantile = [&](std::size_t rank) {
        std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(rank));
        return sorted[rank];
    };
    const std::uint32_t low = quantile(count / 100), high = quantile(count - 1 - count / 100);
    // Lengths of one scene, which would be nearly one fraction, unless it rises alike below and above powers of two.
    return std::bit_cast<float>(high) > 1.25f * std::bit_cast<float>(low) &&
           static_cast<double>(high) < 1.1 * static_cast<double>(low) &&
           (bends.of_numbers < 4 || bends.of_numbers <= 2 * bends.of_floats);
}

bool FloatBytes::are_floats() const {
    return std::ranges::any_of(orders_, [&](const Order& order) { return order.is_of_floats(seen_); });
}

} // namespace
} // namespace io

namespace {

using io::described;
using io::refuse;

/// The storage of a matrix in B, G, R order whose channels are packed so; none for a packing of other elements.
std::optional<Storage> of_bgr(Packing packing) {
    if (packing == Packing::rgb_red_low)
        return Storage::bgr8_red_low;
    if (packing == Packing::rgb_red_high)
        return Storage::bgr8_red_high;
    return std::nullopt;
}

/// Floats from 0 to 1 out of four bytes B, G, R, A, which hold more bits than a float does.
cv::Mat of_bgra(const cv::Mat& bgra, bool red_is_lowest) {
    cv::Mat values(bgra.size(), CV_32FC1);
    for (int y = 0; y < bgra.rows; ++y)
        for (int x = 0; x < bgra.cols; ++x) {
            const auto& [b, g, r, a] = bgra.at<cv::Vec4b>(y, x).val;
            const double value =
                red_is_lowest ? ((r / 256.0 + g) / 256 + b) / 256 + a : ((a / 255.0 + b) / 256 + g) / 256 + r;
            values.at<float>(y, x) = static_cast<float>(value / 256);
        }
    return values;
}

/// The same of three or four that count to 255 in base 255.
cv::Mat of_base_255(const cv::Mat& image) {
    cv::Mat values(image.size(), CV_32FC1);
    const int channels = image.channels();
    for (int y = 0; y < image.rows; ++y) {
        const auto* pixel = image.ptr<std::uint8_t>(y);
        for (int x = 0; x < image.cols; ++x, pixel += channels) {
            const double alpha = channels == 4 ? pixel[3] / 255.0 : 0;
            values.at<float>(y, x) = static_cast<float>((((alpha + pixel[0]) / 255 + pixel[1]) / 255 + pixel[2]) / 255);
        }
    }
    return values;
}

/// Values before they went through a curve.
DepthFile before_curve(const std::filesystem::path& file, const DepthFile& depth, double gamma, bool as_counted) {
    if (depth.values.channels() != 1 || depth.values.depth() == CV_32S)
        refuse(file,
               "is packed, and the camera has a \"gamma\", which is for single channels of 8 or 16 bits or floats");
    const double largest = is_float(depth.storage) ? 1 : storage_max(depth.storage);
    cv::Mat values;
    depth.values.convertTo(values, CV_32F, 1 / largest);
    for (int y = 0; y < values.rows; ++y)
        for (float& value : std::span(values.ptr<float>(y), static_cast<std::size_t>(values.cols)))
            if (value > 0 && std::isfinite(value))
                value = static_cast<float>(linear_of(static_cast<double>(value), gamma) * (as_counted ? largest : 1));
    return {values, Storage::float32, {}};
}

/// Are 32-bit integers the bits of floats?
bool are_bits_of_floats(const cv::Mat& codes) {
    io::FloatBytes bytes;
    bytes.add(cv::Mat(codes.size(), CV_8UC4, codes.data, codes.step));
    return bytes.are_floats();
}

/// Codes of 24 bits only: a buffer with a stencil beside its depth must not be decoded as if it had none.
void check_codes(const std::filesystem::path& file, const cv::Mat& codes) {
    for (int y = 0; y < codes.rows; ++y)
        for (int x = 0; x < codes.cols; ++x)
            if (const auto code = static_cast<std::uint32_t>(codes.at<int>(y, x)); code > 0xffffff) {
                if (are_bits_of_floats(codes))
                    refuse(file, "is no depth: its 32-bit integers are the bits of floats; save floats (.exr, .npy or "
                                 ".tif)");
                refuse(file,
                       "pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") holds " + std::to_string(code) +
                           ", more than 24 bits; if depth lies in the high bits say so: \"packing\": "
                           "\"uint24-high\"" +
                           (code > 0x7fffffff ? "; if the number is " +
                                                    std::to_string(static_cast<std::int32_t>(code)) + ", save floats"
                                              : std::string()));
            }
}

/// The codes that such packed ones hold.
cv::Mat unpacked(const cv::Mat& codes, Packing packing) {
    cv::Mat back(codes.size(), CV_16UC1);
    for (int y = 0; y < codes.rows; ++y)
        std::ranges::transform(std::span(codes.ptr<std::uint16_t>(y), static_cast<std::size_t>(codes.cols)),
                               back.ptr<std::uint16_t>(y),
                               [&](std::uint16_t code) { return unpacked_code(code, packing); });
    return back;
}

cv::Mat three_of(const cv::Mat& image, int first, int second, int third) {
    cv::Mat three(image.size(), CV_8UC3);
    const int pairs[] = {first, 0, second, 1, third, 2};
    cv::mixChannels(&image, 1, &three, 1, pairs, 3);
    return three;
}

cv::Mat first_three(const cv::Mat& image) {
    return three_of(image, 0, 1, 2);
}

constexpr const char* four_bytes =
    "say \"packing\": \"rgba-low-first\" or \"rgba-high-first\" for a fraction in four bytes";
constexpr const char* in_base_255 = "counts to 254 in its lower channels, in base 255, as Unity's EncodeFloatRGBA does";
constexpr const char* bytes_of_floats =
    "the four bytes of floats lie in R, G, B and A, and no number that these pack; save floats (.exr, .npy or .tif)";

/// Packed depth has R, G and B of its own, which change as digits do. A picture of depth has them equal, with more than the two ends
/// of the range, or they change as its colours do.
struct Colors {
    bool is_grey = true, has_steps = false, are_four = false; ///< four: of a packing that has them
    std::size_t pixels = 0, in_alpha = 0;                     // those whose alpha is neither end of its range
    ValueChanges changes = {};
    std::array<std::size_t, 2> change_bits{}; ///< of neighbours, if A is the highest of four bytes, and if R is
    io::FloatBytes floats = {};

    /// `highest`: the three bytes that count most.
    void add(const cv::Mat& image, const cv::Mat& bgr, const cv::Mat& highest, Storage storage) {
        if (image.channels() == 4)
            floats.add(image);
        pixels += bgr.total();
        for (int y = 0; y < bgr.rows; ++y) {
            for (int x = 0; x < bgr.cols && is_grey; ++x) {
                const auto& pixel = bgr.at<cv::Vec3b>(y, x);
                is_grey = pixel[0] == pixel[1] && pixel[1] == pixel[2];
                has_steps |= pixel[0] != 0 && pixel[0] != 255;
            }
            for (int x = 0; x < image.cols && image.channels() == 4; ++x) {
                const auto& pixel = image.at<cv::Vec4b>(y, x);
                in_alpha += pixel[3] != 0 && pixel[3] != 255;
                if (x == 0)
                    continue;
                const auto change = [before = image.at<cv::Vec4b>(y, x - 1), &pixel](const std::array<int, 4>& order) {
                    std::int64_t sum = 0;
                    for (const int i : order)
                        sum = 256 * sum + pixel[i] - before[i];
                    return static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(std::abs(sum))));
                };
                change_bits[0] += change({3, 0, 1, 2});
                change_bits[1] += change({2, 1, 0, 3});
            }
            if (y % std::max(1, bgr.rows / 256) == 0)
                changes.add({highest.ptr(y), highest.cols, 1, highest.step, storage});
        }
    }

    /// A few pixels at edges may have a part of an alpha.
    bool alpha_counts() const { return 10 * in_alpha > pixels; }

    void check(const std::filesystem::path& file, const ReadOptions& options) const {
        if (is_grey && has_steps && pixels > 64)
            refuse(file, "has R = G = B in every pixel: it is a grey picture of depth and holds no packed 24 bits; "
                         "save raw depth");
        if (floats.are_floats())
            refuse(file, std::string("is no depth: ") + bytes_of_floats);
        if (changes.are_of_a_picture(!options.as_counted))
            refuse(file,
                   "has bytes that change like the colours of a picture, and not like packed depth; depth that is "
                   "shown in colours cannot be decoded: save raw depth");
        if (changes.are_of_base_255())
            refuse(file, std::string(in_base_255) + "; say \"packing\": \"base-255\"");
        if (const auto [low, high] = change_bits; are_four && pixels > 1024 &&
                                                  10 * std::min(low, high) < 9 * std::max(low, high) &&
                                                  (low < high) != (options.packing == Packing::rgba_red_low))
            refuse(file, std::string("changes smoothly only if ") + (low < high ? "A" : "R") +
                             " is the highest of its four bytes; say \"packing\": \"rgba-" +
                             (low < high ? "low" : "high") + "-first\", or name three.js's other release");
        if (alpha_counts() && !are_four)
            refuse(file,
                   std::string("has an alpha between 0 and 255, so that R, G and B are not all that a pixel holds; ") +
                       four_bytes);
    }
};

/// What makes depth of an image whose type holds none.
std::string cure_for(const cv::Mat& image) {
    if (image.depth() != CV_8U)
        return "save depth as one channel of 16-bit or 24-bit integers or of float";
    if (image.channels() < 3)
        return "save depth as 16-bit integers or as float, or say that it is depth and no picture (\"packing\": "
               "\"uint8\")";
    bool is_picture = true; // whichever of its bytes were the highest
    const cv::Mat bgr = first_three(image);
    const char* order = nullptr;
    for (const Storage storage : {Storage::bgr8_red_low, Storage::bgr8_red_high}) {
        Colors colors;
        colors.add(image, bgr, bgr, storage);
        if (colors.floats.are_floats())
            return bytes_of_floats;
        is_picture &= (colors.is_grey && colors.has_steps) || colors.changes.are_of_a_picture();
        if (colors.alpha_counts() && !is_picture)
            return four_bytes;
        if (colors.changes.are_turned_round())
            order = storage == Storage::bgr8_red_low ? "high" : "low";
    }
    if (is_picture)
        return "a picture of depth cannot be decoded: save raw depth";
    cv::Mat used;
    cv::reduce(bgr.reshape(1, static_cast<int>(bgr.total())), used, 0, cv::REDUCE_MAX);
    if (order && cv::countNonZero(used) == 2)
        return "it has 16 bits in two of its channels: save depth as one channel of 16-bit integers";
    return text("if it packs 24 bits into R, G and B, say so in the camera file (\"packing\": \"rgb-",
                order ? order : "low", "-first\"",
                order ? ")" : ", or \"rgb-high-first\" where red is the highest byte)");
}

/// An image as depth, if its type and the packing that the camera file speaks of agree.
DepthFile interpreted(const std::filesystem::path& file, const cv::Mat& image, std::optional<Packing> packing,
                      Colors& colors) {
    const auto refuse_packing = [&](const char* needs) {
        refuse(file, "is " + described(image) + ", but the packing \"" + to_string(*packing) + "\" needs " + needs +
                         "; the camera file or the preset is that of other depth");
    };
    if (packing == Packing::rgba_red_low || packing == Packing::rgba_red_high) {
        if (image.type() != CV_8UC4)
            refuse_packing("four 8-bit channels");
        const bool red_is_lowest = packing == Packing::rgba_red_low;
        colors.are_four = true;
        cv::Mat alpha;
        cv::extractChannel(image, alpha, 3);
        double low = 0, high = 0;
        cv::minMaxLoc(alpha, &low, &high);
        const cv::Mat bgr = first_three(image);
        colors.add(image, bgr, red_is_lowest && low < high ? three_of(image, 3, 0, 1) : bgr,
                   red_is_lowest ? Storage::bgr8_red_low : Storage::bgr8_red_high);
        return {of_bgra(image, red_is_lowest), Storage::float32, {}};
    }
    if (packing == Packing::base_255) {
        if (image.depth() != CV_8U || image.channels() < 3)
            refuse_packing("three or four 8-bit channels");
        return {of_base_255(image), Storage::float32, {}};
    }
    if (packing == Packing::uint16_rotated || packing == Packing::uint16_swapped || packing == Packing::uint13) {
        if (image.type() != CV_16UC1)
            refuse_packing("one channel of 16-bit integers");
        return {unpacked(image, *packing), Storage::uint16, {}};
    }
    if (packing == Packing::uint8) {
        if (image.depth() != CV_8U)
            refuse_packing("8-bit channels");
        return {io::only_channel(file, image), Storage::uint8, {}}; // some simulators write R = G = B
    }
    if (const auto storage = packing ? of_bgr(*packing) : std::nullopt) {
        if (image.depth() != CV_8U || image.channels() < 3)
            refuse_packing("three 8-bit channels");
        const cv::Mat bgr = first_three(image); // simulators like to add an alpha channel that says nothing
        colors.add(image, bgr, bgr, *storage);
        return {bgr, *storage, {}};
    }
    if (!packing && image.channels() >= 3 && image.depth() != CV_8U) // some programs write R = G = B
        if (const auto grey = io::if_any([&] { return io::only_channel(file, image); }))
            return interpreted(file, *grey, packing, colors);
    if (image.depth() == CV_64F) {
        cv::Mat floats;
        image.convertTo(floats, CV_32F);
        return interpreted(file, floats, packing, colors);
    }
    if (image.channels() == 1) {
        if (packing && image.type() != CV_32SC1)
            refuse_packing("32-bit integers");
        if (image.type() == CV_32FC1)
            return {image, Storage::float32, {}};
        if (image.type() == CV_16FC1)
            return {image, Storage::float16, {}};
        if (image.type() == CV_16UC1)
            return {image, Storage::uint16, {}};
        if (image.type() == CV_32SC1 && packing == Packing::uint24_high)
            return {image, Storage::uint24_high, {}};
        if (image.type() == CV_32SC1) {
            check_codes(file, image);
            return {image, Storage::uint24, {}};
        }
    }
    refuse(file, "is " + described(image) + ", which holds no depth; " + cure_for(image));
}

} // namespace

DepthFile read_depth(const std::filesystem::path& file, const ReadOptions& options) {
    constexpr io::Wanted wanted{"depth", ".exr, .tif, .pfm, .npy, .npz, COLMAP's .bin, 16-bit .png and 16-bit .pgm"};
    return io::within_memory(file, [&] {
        Colors colors;
        const bool is_exr = io::begins_like_exr(file);
        DepthFile depth;
        if (is_exr) {
            depth = io::read_exr(file, {options.channel}, {.overscan = options.overscan}).front();
        } else {
            const io::PictureFile held = io::read_image(file, wanted, options);
            depth = {held.image,       {}, {}, {{{0, 0}, held.image.size()}, held.image.size()}, held.pages,
                     held.near_and_far};
        }
        DepthFile decoded = interpreted(file, depth.values, options.packing, colors);
        if (options.gamma)
            decoded = before_curve(file, decoded, *options.gamma, options.as_counted);
        depth.values = decoded.values;
        depth.storage = decoded.storage;
        if (!is_exr)
            colors.check(file, options);
        return depth;
    });
}

} // namespace fathom
