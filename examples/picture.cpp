// A picture that a person can look at: stored depth in grey, view depth in false colour, positions as RGB. Each channel is
// stretched from its least to its greatest finite value; invalid pixels stay dark.
// Visibility (occlusion) is shown as it is, 0 black and 1 white, and normals as ½n + ½; the weights near, focus and far are
// red, green and blue, and a linear picture (colour) is encoded for a screen, cut off at white.
// A result that leaves its range is refused: visibility and weights lie between 0 and 1, normals have length 1 or 0, and a blurred
// picture or one in fog lies between the least and the greatest of the colours of PICTURE within REACH pixels, and R, G, B.

#include <fathom/error.hpp>
#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <iostream>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Color = std::array<double, 3>; // R, G, B in 0..1

/// One channel with the range that is shown.
struct Channel {
    cv::Mat values;
    float least = std::numeric_limits<float>::infinity();
    float greatest = -std::numeric_limits<float>::infinity();
    bool has_infinity = false;

    double share(int y, int x) const { return (values.at<float>(y, x) - least) / (greatest - least); }
};

Channel read(const std::string& file, const std::string& name) {
    Channel channel;
    fathom::read_depth(file, {.channel = name, .packing = {}}).values.convertTo(channel.values, CV_32F);
    for (float& value : cv::Mat_<float>(channel.values)) {
        if (!std::isfinite(value)) {
            channel.has_infinity |= std::isinf(value);
            value = std::numeric_limits<float>::quiet_NaN();
            continue;
        }
        channel.least = std::min(channel.least, value);
        channel.greatest = std::max(channel.greatest, value);
    }
    return channel;
}

/// Near is warm and bright, far is cold and dark; equal steps of t look equally large.
Color false_color(double t) {
    static constexpr std::array<Color, 7> knots{{{0.99, 0.96, 0.75},
                                                 {0.99, 0.75, 0.35},
                                                 {0.94, 0.45, 0.27},
                                                 {0.75, 0.23, 0.42},
                                                 {0.47, 0.16, 0.54},
                                                 {0.21, 0.17, 0.50},
                                                 {0.07, 0.12, 0.30}}};
    const double place = std::clamp(t, 0.0, 1.0) * (knots.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(place), knots.size() - 2);
    const double part = place - static_cast<double>(i);
    Color color;
    for (std::size_t c = 0; c < 3; ++c) {
        color[c] = knots[i][c] + part * (knots[i + 1][c] - knots[i][c]);
    }
    return color;
}

// IEC 61966-2-1.
double encoded(double linear) {
    const double value = std::clamp(linear, 0.0, 1.0);
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;
}

Color color_at(const std::string& kind, const std::vector<Channel>& channels, int y, int x) {
    const double t = channels[0].share(y, x);
    if (kind == "stored" || kind == "occlusion") {
        return {t, t, t};
    }
    if (kind == "depth") {
        return false_color(t);
    }
    const Color color{t, channels[1].share(y, x), channels[2].share(y, x)};
    return kind == "colour" ? Color{encoded(color[0]), encoded(color[1]), encoded(color[2])} : color;
}

constexpr double rounding = 1e-5; // of the largest number that a result is made of

/// Refuses a channel whose pixels do not lie between those of two images.
void check(const cv::Mat& values, const cv::Mat& least, const cv::Mat& greatest, bool may_be_invalid,
           const std::string& what) {
    for (int y = 0; y < values.rows; ++y) {
        for (int x = 0; x < values.cols; ++x) {
            const double value = values.at<float>(y, x), low = least.at<float>(y, x), high = greatest.at<float>(y, x);
            const double slack = rounding * std::max(std::abs(low), std::abs(high));
            if (std::isnan(value) ? !may_be_invalid : value < low - slack || value > high + slack) {
                throw fathom::Error(what + " is " + std::to_string(value) + " at " + std::to_string(x) + ", " +
                                    std::to_string(y) + ", where it can be " + std::to_string(low) + " to " +
                                    std::to_string(high));
            }
        }
    }
}

void check(const std::vector<Channel>& channels, const std::string& kind, const std::string& input) {
    const cv::Mat first = channels[0].values, zeros = cv::Mat::zeros(first.size(), CV_32F), ones = zeros + 1;
    if (std::ranges::any_of(channels, &Channel::has_infinity)) {
        throw fathom::Error(input + ": a value is infinite");
    }
    if (kind == "normals") {
        cv::Mat length;
        cv::sqrt(first.mul(first) + channels[1].values.mul(channels[1].values) +
                     channels[2].values.mul(channels[2].values),
                 length);
        length.setTo(1, length == 0); // where there is no surface
        check(length, ones, ones, true, input + ": the length of a normal");
        return;
    }
    for (const Channel& channel : channels) {
        check(channel.values, zeros, ones, true, input + ": a value");
    }
    if (kind == "masks") {
        cv::Mat sum = first + channels[1].values + channels[2].values;
        sum.setTo(1, sum == 0); // where there is no circle
        check(sum, ones, ones, true, input + ": the sum of the weights");
    }
}

/// `sources`: PICTURE REACH [R G B].
void check_colors(const std::vector<Channel>& channels, const std::vector<std::string>& names, const std::string& input,
                  const std::vector<std::string>& sources) {
    const int side = 2 * std::stoi(sources[1]) + 1;
    const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
    for (std::size_t c = 0; c < channels.size(); ++c) {
        cv::Mat least, greatest;
        const Channel source = read(sources[0], names[c]);
        cv::erode(source.values, least, square);
        cv::dilate(source.values, greatest, square);
        if (sources.size() > 2) {
            least = cv::min(least, std::stod(sources[2 + c]));
            greatest = cv::max(greatest, std::stod(sources[2 + c]));
        }
        check(channels[c].values, least, greatest, false, input + ": " + names[c]);
    }
}

void run(const std::string& kind, const std::string& input, const std::string& output,
         const std::vector<std::string>& sources) {
    std::vector<Channel> channels;
    const std::map<std::string, std::vector<std::string>> known{
        {"stored", {""}},
        {"depth", {""}},
        {"occlusion", {"AO"}},
        {"positions", {"P.X", "P.Y", "P.Z"}},
        {"normals", {"N.X", "N.Y", "N.Z"}},
        {"masks", {"near", "focus", "far"}},
        {"colour", {"R", "G", "B"}},
    };
    const auto found = known.find(kind);
    if (found == known.end()) {
        throw std::invalid_argument("kind: '" + kind +
                                    "' is none of stored, depth, positions, normals, occlusion, masks, colour");
    }
    for (const std::string& name : found->second) {
        channels.push_back(read(input, name));
        if (kind == "stored" || kind == "depth" || kind == "positions") {
            continue;
        }
        channels.back().least = kind == "normals" ? -1 : 0;
        channels.back().greatest = 1;
    }
    if (kind == "normals" || kind == "occlusion" || kind == "masks") {
        check(channels, kind, input);
    }
    if (!sources.empty()) {
        check_colors(channels, found->second, input, sources);
    }
    cv::Mat picture(channels[0].values.size(), CV_8UC3, cv::Scalar(32, 24, 24));
    for (int y = 0; y < picture.rows; ++y) {
        for (int x = 0; x < picture.cols; ++x) {
            const auto color = color_at(kind, channels, y, x);
            if (std::ranges::all_of(color, [](double c) { return std::isfinite(c); })) {
                for (int c = 0; c < 3; ++c) {
                    picture.at<cv::Vec3b>(y, x)[2 - c] =
                        cv::saturate_cast<uchar>(255 * color[static_cast<std::size_t>(c)]);
                }
            }
        }
    }
    if (!cv::imwrite(output, picture)) {
        throw fathom::Error(output + ": cannot be written");
    }
    std::cout << output << ':';
    for (const auto& channel : channels) {
        std::cout << "  " << channel.least << " to " << channel.greatest;
    }
    std::cout << '\n';
}

} // namespace

int main(int argc, char* argv[]) {
    const std::vector<std::string> sources(argv + std::min(argc, 4), argv + argc);
    if (argc < 4 || !(sources.empty() || sources.size() == 2 || sources.size() == 5)) {
        std::cerr << "usage: picture stored|depth|positions|normals|occlusion|masks INPUT OUTPUT.png\n"
                     "       picture colour INPUT OUTPUT.png [PICTURE REACH [R G B]]\n";
        return 2;
    }
    try {
        run(argv[1], argv[2], argv[3], sources);
    } catch (const std::exception& error) {
        std::cerr << "picture: " << error.what() << '\n';
        return 1;
    }
}
