// Relative depth. With 1/z = A + B v the circle of a thin lens, k (1 - S/z), is affine in v: blur_px (v_focus - v).
// So no camera is needed, and an orthographic one with z affine in v stands in, whose circle g z - k is that line.

#include "camera/photograph.hpp"
#include "require.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <limits>
#include <vector>

namespace fathom {
namespace {

constexpr float far_away = std::numeric_limits<float>::infinity();

// Distances, along paths through pixels of the same code, to the edge of the next code above and below.
struct ToEdges {
    float up = far_away, down = far_away;
};

// The image as codes, -1 where a value is none, with the distances.
class Steps {
public:
    Steps(std::span<const float> values, int width, int height, double step)
        : width_(width), height_(height), codes_(values.size(), -1), distances_(values.size()) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double code = static_cast<double>(values[i]) / step;
            if (std::abs(code - std::round(code)) < 1e-3 && code >= 0 && code < 1e6)
                codes_[i] = static_cast<int>(std::round(code));
        }
        find_edges();
        for (int pass = 0; pass < passes && spread(); ++pass) {
        }
        widths_.resize(values.size());
        find_widths();
    }

    // Where a pixel lies between its code's two edges: -1/2 at the lower one, 1/2 at the upper one. With one edge alone, as
    // far from it as the next step is wide; 0 where that is not known either.
    double within(std::size_t i) const {
        const ToEdges& d = distances_[i];
        if (codes_[i] < 0)
            return 0;
        if (d.up < far_away && d.down < far_away)
            return 0.5 * static_cast<double>(d.down - d.up) / static_cast<double>(d.down + d.up);
        const double side = d.up < far_away ? 1 : -1, width = static_cast<double>(std::abs(widths_[i]));
        if (!(width > 0))
            return 0;
        const bool ends_at_border = widths_[i] > 0;
        const double away = 0.5 - static_cast<double>(std::min(d.up, d.down)) / width;
        return side * std::max(away, ends_at_border ? -0.5 : 0.0);
    }

    // Evens out what is left where steps are about a pixel wide: means over pairs of pixels on either side, which keep a plane.
    // Pairs whose pixels an edge of two codes lies between do not count. `within` are places within the codes' steps.
    void even_out(std::vector<double>& within) const {
        std::vector<double> next(within.size());
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const std::size_t i = at(x, y);
                double sum = within[i];
                int count = 1;
                for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}})
                    for (int k = 1;
                         k <= reach && joined(x, y, k * dx, k * dy, dx, dy) && joined(x, y, -k * dx, -k * dy, -dx, -dy);
                         ++k) {
                        const std::size_t a = at(x + k * dx, y + k * dy), b = at(x - k * dx, y - k * dy);
                        sum += within[a] + (codes_[a] - codes_[i]) + within[b] + (codes_[b] - codes_[i]);
                        count += 2;
                    }
                next[i] = codes_[i] < 0 ? 0 : std::clamp(sum / count, -0.5, 0.5);
            }
        within.swap(next);
    }

private:
    static constexpr int reach = 3; // pixels on either side
    // Is the pixel (dx, dy) away inside the image, and at most one code away from the one before it?
    bool joined(int x, int y, int dx, int dy, int step_x, int step_y) const {
        if (!inside(x + dx, y + dy))
            return false;
        const int there = codes_[at(x + dx, y + dy)], before = codes_[at(x + dx - step_x, y + dy - step_y)];
        return there >= 0 && before >= 0 && std::abs(there - before) <= 1;
    }

    static constexpr int passes = 4; // each of them covers all paths that turn at most twice

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

    // An edge lies half a pixel from the pixels on both sides.
    void find_edges() {
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x)
                for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
                    const std::size_t i = at(x, y);
                    if (codes_[i] < 0 || !inside(x + dx, y + dy))
                        continue;
                    const int other = codes_[at(x + dx, y + dy)];
                    if (other == codes_[i] + 1)
                        distances_[i].up = 0.5f;
                    else if (other >= 0 && other == codes_[i] - 1)
                        distances_[i].down = 0.5f;
                }
    }

    // Plateaus with one edge only: the width of the step beyond it, if that has two. Negative where the plateau is wider than
    // that: then it is flat, and not the part of a slope that the image's border or another object has cut off.
    void find_widths() {
        std::vector<char> seen(codes_.size());
        std::vector<std::size_t> plateau;
        for (std::size_t first = 0; first < codes_.size(); ++first) {
            const ToEdges& d = distances_[first];
            if (seen[first] || codes_[first] < 0 || (d.up == far_away) == (d.down == far_away))
                continue;
            plateau.assign(1, first);
            seen[first] = 1;
            double sum = 0, farthest = 0;
            int count = 0;
            for (std::size_t next = 0; next < plateau.size(); ++next) {
                const std::size_t i = plateau[next];
                const int x = static_cast<int>(i % static_cast<std::size_t>(width_)),
                          y = static_cast<int>(i / static_cast<std::size_t>(width_));
                farthest = std::max(farthest, static_cast<double>(std::min(distances_[i].up, distances_[i].down)));
                for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
                    if (!inside(x + dx, y + dy))
                        continue;
                    const std::size_t j = at(x + dx, y + dy);
                    if (codes_[j] == codes_[i]) {
                        if (!seen[j])
                            plateau.push_back(j);
                        seen[j] = 1;
                    } else if (const ToEdges& other = distances_[j]; std::abs(codes_[j] - codes_[i]) == 1 &&
                                                                     codes_[j] >= 0 && other.up < far_away &&
                                                                     other.down < far_away) {
                        sum += static_cast<double>(other.up + other.down);
                        ++count;
                    }
                }
            }
            if (count == 0)
                continue;
            const double width = sum / count;
            for (const std::size_t i : plateau)
                widths_[i] = static_cast<float>(farthest <= 1.25 * width ? width : -width);
        }
    }

    // Two sweeps of a chamfer with the steps of a pixel and of a knight: 1, sqrt 2, sqrt 5. Has anything become less?
    bool spread() {
        bool changed = false;
        const auto from = [&](int x, int y, int dx, int dy, float length) {
            if (!inside(x + dx, y + dy))
                return;
            const std::size_t i = at(x, y), j = at(x + dx, y + dy);
            if (codes_[i] != codes_[j])
                return;
            for (float ToEdges::*side : {&ToEdges::up, &ToEdges::down})
                if (const float way = distances_[j].*side + length; way < distances_[i].*side) {
                    distances_[i].*side = way;
                    changed = true;
                }
        };
        static const float two = std::sqrt(2.0f), five = std::sqrt(5.0f);
        const auto visit = [&](int x, int y, int s) { // s: 1 takes from above and the left, -1 from below and the right
            from(x, y, -s, 0, 1);
            from(x, y, 0, -s, 1);
            from(x, y, -s, -s, two);
            from(x, y, s, -s, two);
            from(x, y, -2 * s, -s, five);
            from(x, y, 2 * s, -s, five);
            from(x, y, -s, -2 * s, five);
            from(x, y, s, -2 * s, five);
        };
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x)
                visit(x, y, 1);
            for (int x = width_ - 1; x >= 0; --x)
                from(x, y, 1, 0, 1);
        }
        for (int y = height_ - 1; y >= 0; --y) {
            for (int x = width_ - 1; x >= 0; --x)
                visit(x, y, -1);
            for (int x = 0; x < width_; ++x)
                from(x, y, -1, 0, 1);
        }
        return changed;
    }

    int width_, height_;
    std::vector<int> codes_;
    std::vector<ToEdges> distances_;
    std::vector<float> widths_;
};

// The one channel of pixels, or R where R = G = B; an alpha does not count.
std::vector<float> one_channel(const HostFloats& image) {
    require(image.data && image.width > 0 && image.height > 0, "has no pixels");
    require(image.channels == 1 || image.channels == 3 || image.channels == 4, "has ", image.channels,
            " channels; depth without a unit has one, or R = G = B");
    std::vector<float> values;
    values.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* pixel = pixel_at(image, x, y);
            require(image.channels == 1 ||
                        !(pixel[0] < pixel[1] || pixel[0] > pixel[1] || pixel[0] < pixel[2] || pixel[0] > pixel[2]),
                    "has colours, as at pixel (", x, ", ", y,
                    "): it is a picture, or depth painted with a colour map, which cannot be undone; save the depth in "
                    "grey");
            values.push_back(*pixel);
        }
    return values;
}

void check_bits(int bits) {
    require(bits == 8 || bits == 16 || bits == 32, "bits = ", bits, " must be 8, 16 or 32");
}

// An edge is a part of the range from 0 to 1.
void sharpen(RelativeValues& of, RelativeOrder order, const HostFloats& color, const InRows& in_rows) {
    constexpr float least = 0.03f;
    const float sign = order == RelativeOrder::high_is_near ? 1 : -1;
    std::vector<float> nearness(of.values);
    for (float& value : nearness)
        value *= sign;
    nearness = sharpened_edges({nearness.data(), of.width, of.height}, color, least, 0, in_rows);
    for (std::size_t i = 0; i < nearness.size(); ++i)
        of.values[i] = std::isnan(of.values[i]) ? of.values[i] : std::clamp(sign * nearness[i], 0.0f, 1.0f);
}

std::optional<std::string> doubt_of(std::span<const float> values, int bits, const std::string& range_option) {
    constexpr double little = 0.1; // of 0 to 1
    if (bits == 32 && std::ranges::any_of(values, [](float value) { return value > 0 && value < 1; }))
        return std::nullopt; // floats go from 0 to 1
    const auto [least, most] = ends_of(values);
    if (!(least < most))
        return "all its values are the same, so nothing is nearer than anything else; is it the right file?";
    if (bits == 32 || most - least >= little)
        return std::nullopt;
    return text("its values take ", std::setprecision(2), 100 * (most - least), " % of what ", bits,
                " bits hold, so that little is blurred; say with ", range_option,
                " which codes are nearest and farthest");
}

} // namespace

std::array<double, 2> ends_of(std::span<const float> values) {
    std::array<float, 2> ends{far_away, -far_away};
    for (const float value : values)
        if (std::isfinite(value))
            ends = {std::min(ends[0], value), std::max(ends[1], value)};
    return {static_cast<double>(ends[0]), static_cast<double>(ends[1])};
}

Camera relative_camera(int width, int height, RelativeOrder order) {
    Camera camera;
    camera.projection = orthographic({0, static_cast<double>(width), 0, static_cast<double>(height)}, {0, 1});
    camera.width = width;
    camera.height = height;
    camera.encoding = Encoding::linear;
    camera.near_plane = 0;
    camera.far_plane = 1;
    if (order == RelativeOrder::high_is_near)
        camera.depth_range = {1, 0};
    camera.background = std::numeric_limits<double>::quiet_NaN(); // none
    return camera;
}

CircleOfConfusion relative_circle(double blur_px, double v_focus, RelativeOrder order) {
    require(std::isfinite(blur_px) && blur_px >= 0, "blur_px = ", blur_px, " must be finite and 0 or greater");
    require(v_focus >= 0 && v_focus <= 1, "v_focus = ", v_focus, " must lie between 0 and 1");
    const long double z = order == RelativeOrder::high_is_near ? 1 - static_cast<long double>(v_focus) : v_focus;
    return {blur_px * z, blur_px, 0, true};
}

double flatten_range(std::span<float> values, FocusRange range) {
    require(range.low >= 0 && range.low <= range.high && range.high <= 1, "focus range ", range.low, " to ", range.high,
            " must satisfy 0 <= low <= high <= 1");
    for (float& value : values) {
        const auto v = static_cast<double>(value);
        value = static_cast<float>(v > range.high ? v - (range.high - range.low) : std::min(v, range.low)); // NaN stays
    }
    return range.low;
}

void smooth_steps(std::span<float> values, int width, int height, double step) {
    require(width > 0 && height > 0 &&
                values.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
            values.size(), " values are not those of ", width, " x ", height, " pixels");
    require(std::isfinite(step) && step > 0, "step = ", step, " must be a number above 0");
    const Steps steps(values, width, height, step);
    std::vector<double> within(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        within[i] = steps.within(i);
    for (int i = 0; i < 2; ++i)
        steps.even_out(within);
    for (std::size_t i = 0; i < values.size(); ++i)
        if (within[i] != 0) // what is stored from 0 to 1 stays there
            values[i] = std::clamp(values[i] + static_cast<float>(within[i] * step), std::min(values[i], 0.0f),
                                   std::max(values[i], 1.0f));
}

void to_fractions(std::span<float> values, int bits, const std::optional<std::array<double, 2>>& range) {
    check_bits(bits);
    if (range)
        require((*range)[0] < (*range)[1], "cannot be brought from ", (*range)[0], " to ", (*range)[1],
                "; the range's first end must be the lesser one");
    const std::array<double, 2> ends = ends_of(values);
    require(range || ends[0] <= ends[1], "has no value that is a number; is it the right file?");
    if (bits < 32 && !range) {
        for (float& value : values)
            value /= bits == 8 ? 255.0f : 65535.0f;
        return;
    }
    const auto [low, high] = range.value_or(ends);
    require(std::isfinite(low) && std::isfinite(high), "cannot be brought from ", low, " to ", high,
            "; both ends of the range must be finite");
    for (float& value : values)
        if (!std::isnan(value)) {
            const double above = static_cast<double>(value) - low;
            value = high > low ? static_cast<float>(std::clamp(above / (high - low), 0.0, 1.0)) : above > 0 ? 1 : 0;
        }
}

RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options,
                               const HostFloats& color, const std::string& range_option, const InRows& in_rows) {
    RelativeValues result{one_channel(stored), stored.width, stored.height};
    constexpr double codes = 255;
    const auto smooth = [&] { smooth_steps(result.values, result.width, result.height, 1 / codes); };
    if (bits == 8 && options.range) { // the steps are those of the codes all the same
        for (float& value : result.values)
            value /= static_cast<float>(codes);
        smooth();
        for (float& value : result.values)
            value *= static_cast<float>(codes);
    }
    to_fractions(result.values, bits, options.range);
    if (bits == 8 && !options.range)
        smooth();
    if (!options.range)
        if (const auto doubt = doubt_of(result.values, bits, range_option))
            result.doubts.push_back(*doubt);
    if (color.data) {
        constexpr double other_ratio = 0.01;
        const double aspect = static_cast<double>(color.width) / color.height * stored.height / stored.width;
        require(std::abs(aspect - 1) <= other_ratio, "is ", stored.width, " x ", stored.height, ", but its picture is ",
                color.width, " x ", color.height, "; both must show the same, with the same ratio of width to height");
        if (color.width != stored.width || color.height != stored.height) {
            const EdgeUpsampling upsampling({result.values.data(), stored.width, stored.height}, color);
            std::vector<float> fine(static_cast<std::size_t>(color.width) * static_cast<std::size_t>(color.height));
            in_rows(color.height, [&](int begin, int end) {
                upsampling.rows(begin, end,
                                fine.data() + static_cast<std::size_t>(begin) * static_cast<std::size_t>(color.width));
            });
            result = {std::move(fine), color.width, color.height, std::move(result.doubts)};
        }
    }
    if (options.edges == Edges::sharpen)
        sharpen(result, options.order, color, in_rows);
    if (options.focus_range) {
        if (bits == 32 && !result.doubts.empty()) // one value, of which nobody knows where it lies: it is in focus
            for (float& value : result.values)
                value = std::max(value, static_cast<float>(options.focus_range->low));
        flatten_range(result.values, *options.focus_range);
    }
    return result;
}

RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options,
                               const HostFloats& color, const std::string& range_option) {
    return relative_values(stored, bits, options, color, range_option, in_threads);
}

} // namespace fathom
