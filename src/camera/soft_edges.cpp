// Depth that ramps from one surface to another over a few pixels, as that of networks, averaged and upsampled depth does.
//
// Along the line across an edge 1/z rises from a far level to a near one, and a pixel of the ramp is of one of both sides: of the one
// that most of the pixels around it with its colour are, and first of the one whose level is closer. What is narrower than the ramp
// is wide, such as a post, has lost a part of its height: a filter keeps the area below the line, so that
//   height = area / width,  with the width from the picture: the sum of how far each colour is from the far side's to the post's
// and no more than a box as wide as the image's typical ramp takes away.

#include "camera/photograph.hpp"

#include "quantile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

namespace fathom {
namespace {

constexpr float flat = 0.3f;       // of a ramp's steepest slope: where less begins, its level is reached
constexpr float nearer = 0.3f;     // of a step, from which on a pixel is first taken for the near side,
constexpr float most_near = 0.45f; // and of the weights around it, from which on it is of that side
constexpr int votes = 4, vote_px = 3;
constexpr float alike = 0.1f;       // a difference of colours from 0 to 1
constexpr float contrast = 0.1f;    // from which on colours tell two surfaces apart
constexpr float box = 1.4f;         // times what a box as wide as the ramp takes away from the height of a post,
constexpr float most_height = 3;    // times what is left of it
constexpr std::size_t level_px = 5; // a level that is as long is a surface
constexpr std::size_t few_edges = 32;
constexpr int line_px = 10; // pixels, the widest half of a ramp

using Color = std::array<float, 3>;

float difference(const Color& one, const Color& other) {
    const auto square = [&](std::size_t c) { return (one[c] - other[c]) * (one[c] - other[c]); };
    return square(0) + square(2) + square(1); // the same for blue first
}

template <typename T>
T mean(T one, T other, float part) {
    return one + part * (other - one);
}

Color mean(const Color& one, const Color& other, float part) {
    return {mean(one[0], other[0], part), mean(one[1], other[1], part), mean(one[2], other[2], part)};
}

// Both sides that a pixel of a ramp may be of.
struct Ramp {
    float near = 0, far = 0;
    float width = 0; ///< of a ramp between two surfaces; 0 where one of both is thin
    bool is_near = false;

    explicit operator bool() const { return near > far; }
};

class SoftEdges {
public:
    SoftEdges(const HostFloats& nearness, const HostFloats& color, float least, float least_part)
        : width_(nearness.width), height_(nearness.height), least_(least), least_part_(least_part),
          nearness_(nearness.data, nearness.data + size()) {
        for (int y = 0; y < color.height && color.data; ++y)
            for (int x = 0; x < color.width; ++x)
                color_.push_back(seen_color(color, x, y));
    }

    bool are_soft() const {
        EdgeCounts counts;
        std::vector<float> column(static_cast<std::size_t>(height_));
        for (int y = 0; y < height_; ++y)
            counts.add(std::span(nearness_).subspan(at(0, y), static_cast<std::size_t>(width_)), least_, least_part_);
        for (int x = 0; x < width_; ++x) {
            for (int y = 0; y < height_; ++y)
                column[static_cast<std::size_t>(y)] = nearness_[at(x, y)];
            counts.add(column, least_, least_part_);
        }
        return counts.are_soft();
    }

    std::vector<float> sharpened(const InRows& in_rows) {
        slopes_ = products_of_slopes();
        const float typical = typical_width();
        std::vector<Ramp> ramps(size());
        std::vector<float> made = nearness_, next;
        const auto for_each_ramp = [&](const auto& visit) {
            in_rows(height_, [&](int begin, int end) {
                for (int y = begin; y < end; ++y)
                    for (int x = 0; x < width_; ++x)
                        visit(x, y, ramps[at(x, y)]);
            });
        };
        for_each_ramp([&](int x, int y, Ramp& ramp) {
            if ((ramp = ramp_at(x, y, typical)))
                made[at(x, y)] = ramp.is_near ? ramp.near : ramp.far;
        });
        for (int i = 0; i < votes && !color_.empty(); ++i) { // else they would end what is thin
            next = made;
            for_each_ramp([&](int x, int y, const Ramp& ramp) {
                if (ramp)
                    next[at(x, y)] = is_near(x, y, made, (ramp.near + ramp.far) / 2) ? ramp.near : ramp.far;
            });
            std::swap(made, next);
        }
        return made;
    }

private:
    static constexpr std::size_t samples = 2 * line_px + 1, here = line_px;
    using Line = std::array<float, samples>;
    using Way = std::array<float, 2>;
    using Products = std::array<float, 3>; // of slopes along rows and columns: of the former, of both, of the latter

    std::size_t size() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }
    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    float least_step(float near) const { return least_ + least_part_ * std::abs(near); }

    // Between pixels, by the four around.
    template <typename T>
    T between(const std::vector<T>& image, float x, float y) const {
        x = std::clamp(x, 0.0f, static_cast<float>(width_ - 1));
        y = std::clamp(y, 0.0f, static_cast<float>(height_ - 1));
        const int left = std::min(static_cast<int>(x), std::max(width_ - 2, 0)),
                  top = std::min(static_cast<int>(y), std::max(height_ - 2, 0)), right = std::min(left + 1, width_ - 1),
                  bottom = std::min(top + 1, height_ - 1);
        const float across = x - static_cast<float>(left), down = y - static_cast<float>(top);
        return mean(mean(image[at(left, top)], image[at(right, top)], across),
                    mean(image[at(left, bottom)], image[at(right, bottom)], across), down);
    }

    // The direction in which nearness changes most around a pixel, and how much, per pixel: the main axis of the products of slopes.
    std::pair<Way, float> way_across(int x, int y) const {
        const auto [xx, xy, yy] = slopes_[at(x, y)];
        const float apart = std::hypot(xx - yy, 2 * xy), along = xx > yy ? xx - yy + apart : 2 * xy,
                    aside = xx > yy ? 2 * xy : yy - xx + apart, length = std::hypot(along, aside);
        return {length > 0 ? Way{along / length, aside / length} : Way{1, 0}, std::sqrt(xx + yy)};
    }

    // Products of the slopes, means of those around.
    std::vector<Products> products_of_slopes() const {
        std::vector<Products> each(size()), rows(size());
        const auto value = [&](int x, int y) {
            return nearness_[at(std::clamp(x, 0, width_ - 1), std::clamp(y, 0, height_ - 1))];
        };
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const float across = (value(x + 1, y) - value(x - 1, y)) / 2,
                            down = (value(x, y + 1) - value(x, y - 1)) / 2;
                if (!std::isnan(across + down))
                    each[at(x, y)] = {across * across, across * down, down * down};
            }
        const auto blur = [&](const std::vector<Products>& from, std::vector<Products>& to, int dx, int dy) {
            constexpr std::array<float, 5> weights{0.266f, 0.213f, 0.109f, 0.036f,
                                                   0.008f}; // a normal distribution's of 1.5 pixels
            for (int y = 0; y < height_; ++y)
                for (int x = 0; x < width_; ++x)
                    for (int i = -4; i <= 4; ++i) {
                        const Products& other =
                            from[at(std::clamp(x + i * dx, 0, width_ - 1), std::clamp(y + i * dy, 0, height_ - 1))];
                        for (std::size_t k = 0; k < other.size(); ++k)
                            to[at(x, y)][k] += weights[static_cast<std::size_t>(std::abs(i))] * other[k];
                    }
        };
        blur(each, rows, 1, 0);
        each.assign(size(), {});
        blur(rows, each, 0, 1);
        return each;
    }

    Line line_through(int x, int y, const Way& way) const {
        Line line;
        for (int i = -line_px; i <= line_px; ++i)
            line[static_cast<std::size_t>(i + line_px)] =
                between(nearness_, static_cast<float>(x) + way[0] * static_cast<float>(i),
                        static_cast<float>(y) + way[1] * static_cast<float>(i));
        return line;
    }

    Ramp ramp_at(int x, int y, float typical) const {
        constexpr float hardly = 0.1f; // of an edge's step, for a pixel
        const float own = nearness_[at(x, y)];
        auto [way, change] = way_across(x, y);
        if (!(change > hardly * least_step(own)))
            return {};
        Line line = line_through(x, y, way);
        if (line[here + 1] < line[here - 1]) { // towards what is near
            std::ranges::reverse(line);
            way = {-way[0], -way[1]};
        }
        std::array<float, samples - 1> slope;
        for (std::size_t i = 0; i + 1 < samples; ++i)
            slope[i] = line[i + 1] - line[i];
        float steepest = 0;
        for (std::size_t i = here; i > 0 && slope[i - 1] > 0; --i)
            steepest = std::max(steepest, slope[i - 1]);
        for (std::size_t i = here; i + 1 < samples && slope[i] > 0; ++i)
            steepest = std::max(steepest, slope[i]);
        if (!(steepest > 0))
            return {};
        const float level = flat * steepest;
        const auto fall = [&](std::size_t i) { // to where the far level begins
            while (i > 0 && slope[i - 1] > level)
                --i;
            return i;
        };
        const auto climb = [&](std::size_t i, float sign) { // to where the next level begins
            while (i + 1 < samples && sign * slope[i] > level)
                ++i;
            return i;
        };
        // The pixel may lie on a short level itself: on top of something thin, or in a gap.
        std::size_t foot = here, top = climb(here, 1);
        while (foot > 0 && here - foot < level_px && slope[foot - 1] <= level)
            --foot;
        foot = fall(foot == 0 || here - foot == level_px ? here : foot);
        if (top == here && foot == here) {
            std::size_t i = here;
            while (i + 1 < samples && i - here < level_px && std::abs(slope[i]) <= level)
                ++i;
            if (i + 1 < samples && i - here < level_px && slope[i] > level)
                top = climb(i, 1);
        }
        if (foot == 0 || top + 1 == samples || std::abs(slope[foot - 1]) > level)
            return {};
        const float step = line[top] - line[foot];
        if (!(step > least_step(line[top])))
            return {};
        // Is what is near so thin that it ends on the line, too?
        std::size_t back = top;
        while (back + 1 < samples && back - top < level_px && std::abs(slope[back]) <= level)
            ++back;
        const std::size_t end = climb(back, -1);
        const bool is_thin = end > back && end + 1 < samples && line[back] - line[end] > flat * step;
        if (!is_thin && top <= foot + 1)
            return {};
        const float away = static_cast<float>(here) - static_cast<float>(foot);
        Ramp ramp{.near = line[top],
                  .far = is_thin ? mean(line[foot], line[end], away / static_cast<float>(end - foot))
                                 : line[foot] + slope[foot - 1] * away,
                  .width = is_thin ? 0 : step / steepest};
        ramp.is_near = own >= mean(ramp.far, line[top], nearer);
        if (is_thin)
            ramp.near = height_of(line, foot, (top + back) / 2, end, {x, y}, way, ramp, typical);
        return ramp;
    }

    // The level that something thin had, from the area below the line and its width in the picture.
    float height_of(const Line& line, std::size_t foot, std::size_t top, std::size_t end,
                    const std::array<int, 2>& pixel, const Way& way, const Ramp& ramp, float typical) const {
        if (color_.empty())
            return ramp.near;
        const auto color_at = [&](std::size_t i) {
            const float on = static_cast<float>(i) - static_cast<float>(here);
            return between(color_, static_cast<float>(pixel[0]) + way[0] * on,
                           static_cast<float>(pixel[1]) + way[1] * on);
        };
        const Color beside = color_at(foot - 1), own = color_at(top);
        const float apart = difference(beside, own);
        if (!(apart > contrast * contrast))
            return ramp.near;
        float area = 0, width = 0;
        for (std::size_t i = foot; i <= end; ++i) {
            const Color color = color_at(i);
            area +=
                line[i] - mean(line[foot], line[end], static_cast<float>(i - foot) / static_cast<float>(end - foot));
            // By the law of cosines, the part of the way from one colour to the other.
            width += std::clamp((apart + difference(color, beside) - difference(color, own)) / (2 * apart), 0.0f, 1.0f);
        }
        const float left = ramp.near - ramp.far, most = std::min(most_height, box * typical / width);
        return width > 0.5f ? ramp.far + std::clamp(area / width, left, std::max(left, left * most)) : ramp.near;
    }

    // Half of the ramps between surfaces are wider, of those on some rows.
    float typical_width() const {
        constexpr int every = 4;
        std::vector<float> widths;
        for (int y = every / 2; y < height_; y += every)
            for (int x = 0; x < width_; ++x)
                if (const Ramp ramp = ramp_at(x, y, 0); ramp && ramp.width > 0)
                    widths.push_back(ramp.width);
        return widths.empty() ? 1 : quantile(std::move(widths));
    }

    // Do more of the pixels around one, and with its colour, lie on the near side?
    bool is_near(int x, int y, const std::vector<float>& now, float half_way) const {
        float near = 0, all = 0;
        for (int j = std::max(y - vote_px, 0); j <= std::min(y + vote_px, height_ - 1); ++j)
            for (int i = std::max(x - vote_px, 0); i <= std::min(x + vote_px, width_ - 1); ++i) {
                const auto away = static_cast<float>((i - x) * (i - x) + (j - y) * (j - y));
                const float other = difference(color_[at(i, j)], color_[at(x, y)]),
                            weight = std::exp(-other / (2 * alike * alike) - away / 12);
                if (std::isnan(now[at(i, j)]))
                    continue;
                all += weight;
                near += now[at(i, j)] >= half_way ? weight : 0;
            }
        return near >= most_near * all;
    }

    int width_, height_;
    float least_, least_part_;
    std::vector<float> nearness_;
    std::vector<Color> color_;
    std::vector<Products> slopes_ = {};
};

} // namespace

void EdgeCounts::add(std::span<const float> line, float least, float least_part) {
    for (const float sign : {1.0f, -1.0f}) {
        const auto slope = [&](std::size_t i) { return sign * (line[i + 1] - line[i]); };
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
            const std::size_t first = i;
            std::size_t steepest = i;
            for (; i + 1 < line.size() && slope(i) > 0; ++i)
                steepest = slope(i) > slope(steepest) ? i : steepest;
            if (i == first)
                continue;
            std::size_t low = steepest, high = steepest + 1;
            while (low > first && slope(low - 1) > flat * slope(steepest))
                --low;
            while (high < i && slope(high) > flat * slope(steepest))
                ++high;
            const float step = std::abs(line[high] - line[low]), top = std::max(line[high], line[low]);
            const bool has_sides =
                low > 0 && high + 1 < line.size() && std::isfinite(line[low - 1]) && std::isfinite(line[high + 1]);
            if (has_sides && high - low <= line_px && step > least + least_part * std::abs(top)) // more is a floor
                ++(high - low > 1 ? soft : hard);
        }
    }
}

bool EdgeCounts::are_soft() const {
    return soft > 3 * hard && soft >= few_edges; // hills with noise have two of three
}

std::vector<float> sharpened_edges(const HostFloats& nearness, const HostFloats& color, float least, float least_part,
                                   const InRows& in_rows) {
    SoftEdges edges(nearness, color, least, least_part);
    return edges.are_soft() ? edges.sharpened(in_rows) : std::vector<float>();
}

std::vector<float> sharpened_distances(const HostFloats& z, bool inverse, const HostFloats& color,
                                       const InRows& in_rows) {
    constexpr float part = 0.03f; // of 1/z, or of the range of z
    const std::size_t size = static_cast<std::size_t>(z.width) * static_cast<std::size_t>(z.height);
    std::vector<float> nearness(z.data, z.data + size);
    float least = 0;
    if (inverse) {
        for (float& value : nearness)
            value = 1 / value;
    } else {
        const auto [nearest, farthest] = ends_of(nearness);
        least = part * (static_cast<float>(farthest) - static_cast<float>(nearest));
        for (float& value : nearness) // a background is no ramp's end
            value = std::isfinite(value) ? -value : std::numeric_limits<float>::quiet_NaN();
    }
    std::vector<float> made =
        sharpened_edges({nearness.data(), z.width, z.height}, color, least, inverse ? part : 0, in_rows);
    for (std::size_t i = 0; i < made.size(); ++i)
        made[i] = made[i] == nearness[i] || std::isnan(nearness[i]) ? z.data[i] // with all of its bits
                  : inverse                                         ? 1 / std::max(made[i], 0.0f)
                                                                    : -made[i];
    return made;
}

} // namespace fathom
