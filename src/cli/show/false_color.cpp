// Pictures of what people cannot see: depth and masks in false color, normals, light.
#include "false_color.hpp"

#include "io/color_encoding.hpp"
#include "io/exr/depth_channels.hpp"
#include "io/formats.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

constexpr double infinity = std::numeric_limits<double>::infinity();

using description::Content;

// The channel that is shown of a result: of positions the last one, the depth, says most.
std::string channel_of(const Content& content) {
    const std::string channels = content.channels;
    return channels.substr(channels.rfind(' ') + 1);
}

bool is_values(const Content& content) {
    return content.of == Content::Of::lengths || content.of == Content::Of::fractions;
}

// What channels of the program's own results hold, in the order in which they are looked for: first the first results of
// operations, what is made of depth before depth.
std::vector<Content> find_known() {
    std::vector<Content> first, others;
    const auto add = [](std::vector<Content>& known, const Content& content) {
        if (is_values(content) && std::ranges::find(known, channel_of(content), channel_of) == known.end())
            known.push_back(content);
    };
    for (const description::Operation& operation : description::operations()) {
        const std::shared_ptr<void> call = operation.make(nullptr);
        const auto add_results = [&] {
            const std::vector<description::Result> results = operation.results_of(call.get(), {});
            add(first, results.front().content);
            for (const description::Result& result : results)
                add(others, result.content);
        };
        add_results();
        for (const description::Option& option : operation.options) // some of which choose what it holds
            for (std::size_t i = 0; i < option.choices().size(); ++i) {
                operation.set(call.get(), option, i);
                add_results();
            }
    }
    std::ranges::reverse(first);
    std::ranges::stable_sort(first, {},
                             [](const Content& each) { return channel_of(each).find('.') != std::string::npos; });
    for (const Content& other : others)
        add(first, other);
    return first;
}

const std::vector<Content>& known_channels() {
    static const std::vector<Content> known = find_known();
    return known;
}

bool has(const std::vector<Channel>& channels, const std::string& name) {
    return std::ranges::any_of(channels, [&](const Channel& channel) { return channel.name == name; });
}

cv::Mat floats(const cv::Mat& image, double factor = 1) {
    if (image.depth() == CV_32F && factor == 1)
        return image;
    cv::Mat converted;
    image.convertTo(converted, CV_32F, factor);
    return converted;
}

// Values, and what is known of a channel of this name.
Viewed values_called(const std::string& channel, const cv::Mat& values) {
    Viewed viewed{.kind = Viewed::Kind::values, .image = values, .name = channel};
    for (const Content& each : known_channels())
        if (channel == channel_of(each)) {
            viewed.unit = each.unit;
            viewed.from_0_to_1 = each.of == Content::Of::fractions;
        }
    return viewed;
}

Viewed values_of(const fs::path& file, const std::string& channel) {
    const DepthFile read = read_depth(file, {.channel = channel});
    return values_called(read.channel, floats(read.values));
}

Viewed normals_of(const fs::path& file, const std::string& layer) {
    return {
        .kind = Viewed::Kind::normals, .image = read_normals(file, layer), .name = layer.empty() ? "normals" : layer};
}

Viewed picture_in(const fs::path& file, const std::string& layer) {
    return {.kind = Viewed::Kind::picture,
            .image = read_picture(file, {.layer = layer}).color,
            .name = layer.empty() ? "R, G, B" : layer};
}

Viewed from_exr(const fs::path& file, const std::vector<Channel>& channels, const std::string& wanted) {
    if (!wanted.empty()) {
        if (has(channels, wanted + ".R"))
            return picture_in(file, wanted);
        if (has(channels, wanted + ".X"))
            if (auto normals = io::if_any([&] { return normals_of(file, wanted); }))
                return *normals;
        if (has(channels, wanted + ".X") && !has(channels, wanted))
            io::refuse(file,
                       fmt::format("layer \"{0}\" has three values a pixel, which are no normals; show one of them: "
                                   "--channel {0}.X, {0}.Y or {0}.Z",
                                   wanted));
        return values_of(file, wanted);
    }
    for (const Content& each : known_channels())
        if (has(channels, channel_of(each)))
            return values_of(file, channel_of(each));
    if (has(channels, "N.X"))
        return normals_of(file, "N");
    if (!io::depth_channels(file).empty())
        return values_of(file, "");
    if (auto picture = io::if_any([&] { return picture_in(file, ""); }))
        return *picture;
    if (auto normals = io::if_any([&] { return normals_of(file, ""); }))
        return *normals;
    if (channels.size() == 1)
        return values_of(file, channels.front().name);
    io::refuse(file, "has no channel that says what it is; name one or its layer with --channel: " +
                         io::listed(channels, &Channel::name));
}

bool any_negative(const cv::Mat& vectors) {
    for (int y = 0; y < vectors.rows; ++y) {
        const auto* row = vectors.ptr<float>(y);
        if (std::any_of(row, row + vectors.cols * vectors.channels(), [](float value) { return value < 0; }))
            return true;
    }
    return false;
}

Viewed from_plain(const fs::path& file, const std::string& wanted) {
    io::check_readable(file);
    if (!wanted.empty())
        io::refuse_layer(file, wanted);
    const std::optional<cv::Mat> image = io::within_memory(file, [&] { return io::read_plain(file); });
    if (!image || (image->channels() != 1 && image->depth() != CV_32F))
        return picture_in(file, wanted);
    if (image->channels() == 1)
        return {.kind = Viewed::Kind::values,
                .image = floats(*image),
                .name = image->depth() == CV_8U    ? "codes of 8 bits"
                        : image->depth() == CV_16U ? "codes of 16 bits"
                                                   : "stored values"};
    if (any_negative(*image))
        if (auto normals = io::if_any([&] { return normals_of(file, ""); }))
            return *normals;
    return picture_in(file, "");
}

bool is_invalid(const Viewed& viewed, const float* pixel, int channels) {
    switch (viewed.kind) {
    case Viewed::Kind::values:
        return !(pixel[0] > -std::numeric_limits<float>::infinity());
    case Viewed::Kind::normals:
        return pixel[0] == 0 && pixel[1] == 0 && pixel[2] == 0;
    case Viewed::Kind::picture:
        return !std::all_of(pixel, pixel + channels, [](float value) { return std::isfinite(value); });
    }
    return false;
}

bool is_background(const Viewed& viewed, const float* pixel) {
    return viewed.kind == Viewed::Kind::values && pixel[0] == std::numeric_limits<float>::infinity();
}

// Bits of information in the color of a pixel, of 64 colors.
double entropy(const std::vector<double>& sample, const ColorRange& range) {
    constexpr int bins = 64;
    std::array<double, bins> counts{};
    for (const double value : sample) {
        const double bin = range.place(value) * bins; // NaN where a logarithm has no place
        ++counts[bin > 0 ? static_cast<std::size_t>(std::min(bin, bins - 1.0)) : 0];
    }
    double bits = 0;
    for (const double count : counts)
        if (count > 0)
            bits -= count / static_cast<double>(sample.size()) * std::log2(count / static_cast<double>(sample.size()));
    return bits;
}

// Both ends differ, so that every value has a place.
void widen(ColorRange& range) {
    if (range.high > range.low)
        return;
    const double half = range.low == 0 ? 0.5 : std::abs(range.low) / 2;
    range.low -= half;
    range.high += half;
}

// Of sorted values.
double percentile(const std::vector<double>& sample, double fraction) {
    return sample[static_cast<std::size_t>(std::round(fraction * static_cast<double>(sample.size() - 1)))];
}

ColorRange range_on(ColorScale scale, const Statistics& of) {
    constexpr double rare = 0.005, stretched = 3;
    const ColorRange whole{scale, of.least, of.greatest},
        middle{scale, percentile(of.sample, rare), percentile(of.sample, 1 - rare)};
    const double part = whole.place(middle.high) - whole.place(middle.low);
    return middle.high > middle.low && part * stretched < 1 ? middle : whole;
}

// Values of 1, 2 and 5 times a power of ten, or multiples of such a value, inside of a range. Those that matter most come
// first.
std::vector<double> round_values(const ColorRange& range, int most) {
    std::vector<double> found;
    const double span = range.high - range.low;
    const bool decades = range.scale != ColorScale::linear && range.high / range.low > 4;
    if (decades) {
        for (const double factor : {1.0, 5.0, 2.0})
            for (double power = std::floor(std::log10(range.low)); power <= std::log10(range.high); ++power)
                if (const double value = factor * std::pow(10, power); value > range.low && value < range.high)
                    found.push_back(value);
        return found;
    }
    double step = std::pow(10, std::floor(std::log10(span / most)));
    for (const double factor : {2.0, 2.5, 2.0})
        if (span / step > most)
            step *= factor;
    const double first = std::ceil(range.low / step);
    for (int i = 0; i <= most && (first + i) * step < range.high; ++i)
        found.push_back((first + i) * step);
    return found;
}

// Text of a legend, in pixels at a scale of 1.
constexpr int letter_width = 8, letter_height = 13; // of a figure
constexpr double letter_scale = 0.4;
const cv::Scalar ink(32, 32, 32);

int width_of(const std::string& text, int scale) {
    return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, letter_scale * scale, scale, nullptr).width;
}

// `at`: the upper left corner.
void draw_text(cv::Mat& image, cv::Point at, const std::string& text, int scale) {
    constexpr int ascent = 10;
    cv::putText(image, text, at + cv::Point(0, ascent * scale), cv::FONT_HERSHEY_SIMPLEX, letter_scale * scale, ink,
                scale, cv::LINE_AA);
}

// As many digits as tell values of the range apart.
std::string label_of(double value, const ColorRange& range) {
    const double largest = std::max(std::abs(range.low), std::abs(range.high)), span = range.high - range.low;
    if (std::abs(value) < span * 1e-9)
        return "0";
    int digits = 3;
    if (range.scale == ColorScale::linear || range.high / range.low < 4)
        digits += std::max(0, static_cast<int>(std::ceil(std::log10(largest / span))));
    if (std::abs(value) < 1e6)
        digits = std::max(digits, static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1);
    return fmt::format("{:.{}g}", value, std::min(digits, 9));
}

} // namespace

Viewed read_viewed(const fs::path& file, const std::string& channel) {
    const std::vector<Channel> channels = list_channels(file);
    return channels.empty() ? from_plain(file, channel) : from_exr(file, channels, channel);
}

Statistics statistics_of(const Viewed& viewed) {
    constexpr std::size_t most = 1u << 16;
    const cv::Mat& image = viewed.image;
    Statistics found{.pixels = image.total(), .least = infinity, .greatest = -infinity};
    std::size_t step = found.pixels / most + 1;
    while (step > 1 && static_cast<std::size_t>(image.cols) % step == 0) // not the same columns again and again
        ++step;
    std::size_t place = 0;
    for (int y = 0; y < image.rows; ++y) {
        const auto* pixel = image.ptr<float>(y);
        for (int x = 0; x < image.cols; ++x, pixel += image.channels(), ++place) {
            const bool background = is_background(viewed, pixel);
            found.background += background;
            if (is_invalid(viewed, pixel, image.channels())) {
                ++found.invalid;
            } else if (viewed.kind == Viewed::Kind::values && !background) {
                const double value = static_cast<double>(*pixel);
                found.least = std::min(found.least, value);
                found.greatest = std::max(found.greatest, value);
                if (place % step == 0)
                    found.sample.push_back(value);
            }
        }
    }
    if (!(found.least <= found.greatest))
        found.least = found.greatest = 0;
    else if (found.sample.empty()) // a few pixels between those of the sample
        found.sample = {found.least, found.greatest};
    std::ranges::sort(found.sample);
    return found;
}

const char* to_string(ColorScale scale) {
    static constexpr const char* names[] = {"linear", "log", "inverse"};
    return names[static_cast<std::size_t>(scale)];
}

double ColorRange::place(double value) const {
    if (scale == ColorScale::linear)
        return (value - low) / (high - low);
    if (value <= 0)
        return 0;
    return scale == ColorScale::logarithmic ? std::log(value / low) / std::log(high / low)
                                            : (1 / low - 1 / value) / (1 / low - 1 / high);
}

std::string ColorRange::fault() const {
    if (!std::isfinite(low) || !std::isfinite(high) || !(high > low))
        return fmt::format("{} to {} is no range; it is MIN:MAX, two finite numbers that ascend", number(low),
                           number(high));
    if (scale != ColorScale::linear && !(low > 0))
        return fmt::format("a {} scale needs values above 0, and the range begins at {}; give --range, or --scale "
                           "linear",
                           to_string(scale), number(low));
    return {};
}

ColorRange choose_range(const Statistics& of, bool from_0_to_1, const RangeWish& wish) {
    constexpr double worth_it = 0.5; // bits
    ColorRange range;
    if (wish.ends)
        return {wish.scale.value_or(ColorScale::linear), (*wish.ends)[0], (*wish.ends)[1]};
    if (wish.scale && of.any()) {
        range = range_on(*wish.scale, of);
    } else if (of.any() && !from_0_to_1) {
        range = range_on(ColorScale::linear, of);
        double best = entropy(of.sample, range) + worth_it;
        for (const ColorScale scale : {ColorScale::logarithmic, ColorScale::inverse})
            if (of.least > 0 && of.greatest > of.least) {
                const ColorRange other = range_on(scale, of);
                if (const double bits = entropy(of.sample, other); bits > best) {
                    best = bits;
                    range = other;
                }
            }
    }
    widen(range);
    return range;
}

std::vector<Tick> ticks_of(const ColorRange& range, int letters_a_line) {
    const double letter = 1.0 / letters_a_line;
    const auto width = [&](const std::string& label) { return static_cast<double>(label.size()) * letter; };
    std::vector<Tick> ticks{{0, label_of(range.low, range)}, {1, label_of(range.high, range)}};
    std::vector<std::pair<double, double>> taken{{0, width(ticks[0].label)}, {1 - width(ticks[1].label), 1}};
    for (const double value : round_values(range, std::max(2, letters_a_line / 10))) {
        const Tick tick{range.place(value), label_of(value, range)};
        const double begin = tick.place - width(tick.label) / 2 - letter,
                     end = tick.place + width(tick.label) / 2 + letter;
        if (std::ranges::any_of(taken, [&](const auto& other) { return begin < other.second && end > other.first; }))
            continue;
        taken.emplace_back(begin, end);
        ticks.push_back(tick);
    }
    std::ranges::sort(ticks, {}, &Tick::place);
    return ticks;
}

cv::Mat false_color(const Viewed& viewed, const ColorRange& range, ColorMap map) {
    const auto& colors = colors_of(map);
    cv::Mat light = viewed.image;
    if (viewed.kind == Viewed::Kind::picture) {
        light = viewed.image.clone();
        for (int y = 0; y < light.rows; ++y) { // what the encoding does with NaN does not matter
            auto* row = light.ptr<float>(y);
            std::transform(row, row + light.cols * light.channels(), row,
                           [](float value) { return value > 0 ? std::min(value, 1.0f) : 0.0f; });
        }
        io::from_linear(light, ColorEncoding::srgb);
    }
    const auto code = [](double value) {
        return static_cast<unsigned char>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    };
    cv::Mat picture(viewed.image.size(), CV_8UC3);
    for (int y = 0; y < picture.rows; ++y) {
        const auto *pixel = viewed.image.ptr<float>(y), *shown = light.ptr<float>(y);
        for (int x = 0; x < picture.cols; ++x, pixel += viewed.image.channels(), shown += light.channels()) {
            auto& color = picture.at<cv::Vec3b>(y, x);
            if (is_invalid(viewed, pixel, viewed.image.channels()))
                color = cv::Vec3b(invalid_color.data());
            else if (is_background(viewed, pixel))
                color = cv::Vec3b(background_color.data());
            else if (viewed.kind == Viewed::Kind::values)
                color = colors[static_cast<std::size_t>(
                    std::clamp(range.place(static_cast<double>(*pixel)) * 256, 0.0, 255.0))];
            else
                for (int c = 0; c < 3; ++c) // x is red, which comes last
                    color[c] = viewed.kind == Viewed::Kind::picture
                                   ? code(static_cast<double>(shown[c]))
                                   : code(0.5 * static_cast<double>(pixel[2 - c]) + 0.5);
        }
    }
    return picture;
}

std::string meaning_of(const Viewed& viewed, const ColorRange& range) {
    switch (viewed.kind) {
    case Viewed::Kind::values: {
        const std::string unit = viewed.unit.empty() ? "" : " [" + viewed.unit + "]";
        const std::string scale =
            range.scale == ColorScale::linear ? "" : fmt::format(", {} scale", to_string(range.scale));
        return viewed.name + unit + scale;
    }
    case Viewed::Kind::normals:
        return viewed.name + ": (n + 1) / 2, x red, y green, z blue";
    case Viewed::Kind::picture:
        return viewed.name + ": sRGB";
    }
    return {};
}

cv::Mat with_legend(const cv::Mat& picture, const Viewed& viewed, const Statistics& found, const ColorRange& range,
                    ColorMap map) {
    constexpr int least_width = 40 * letter_width, pad = 10, bar_height = 14, gap = 5;
    const int scale = std::max(1, std::min(picture.rows, picture.cols) / 540);
    const int width = std::max(picture.cols, least_width * scale), line = (letter_height + gap) * scale;
    const bool has_bar = viewed.kind == Viewed::Kind::values, has_marks = found.invalid > 0 || found.background > 0;
    const int bar = has_bar ? (bar_height + gap) * scale + line : 0;
    cv::Mat whole(picture.rows + 2 * pad * scale + bar + line * (has_marks ? 2 : 1), width, CV_8UC3,
                  cv::Scalar(250, 250, 250));
    picture.copyTo(whole(cv::Rect((width - picture.cols) / 2, 0, picture.cols, picture.rows)));

    int y = picture.rows + pad * scale;
    const int left = pad * scale, inside = width - 2 * left;
    if (has_bar) {
        const cv::Mat colors(cv::Mat(colors_of(map)).reshape(3, 1));
        cv::Mat place = whole(cv::Rect(left, y, inside, bar_height * scale));
        cv::resize(colors, place, place.size(), 0, 0, cv::INTER_NEAREST);
        y += bar_height * scale;
        for (const Tick& tick : ticks_of(range, inside / (letter_width * scale))) {
            const int at = left + static_cast<int>(tick.place * (inside - scale)), wide = width_of(tick.label, scale);
            whole(cv::Rect(at, y, scale, 3 * scale)).setTo(ink);
            draw_text(whole, {std::clamp(at - wide / 2, left, left + inside - wide), y + gap * scale}, tick.label,
                      scale);
        }
        y += gap * scale + line;
    }
    std::string meaning = meaning_of(viewed, range);
    for (std::size_t cut = meaning.size(); width_of(meaning, scale) > inside; --cut)
        meaning = meaning.substr(0, cut) + "...";
    draw_text(whole, {left, y}, meaning, scale);
    y += line;
    int x = left;
    const auto mark = [&](std::size_t count, const std::array<unsigned char, 3>& color, const char* name) {
        if (count == 0)
            return;
        const std::string text = fmt::format("{} {}", count, name);
        whole(cv::Rect(x, y + scale, 11 * scale, 11 * scale)).setTo(cv::Scalar(color[0], color[1], color[2]));
        draw_text(whole, {x + 16 * scale, y}, text, scale);
        x += (16 + 2 * letter_width) * scale + width_of(text, scale);
    };
    mark(found.invalid, invalid_color, "invalid");
    mark(found.background, background_color, "background");
    return whole;
}

} // namespace fathom::cli
