// A shot of relative depth in which each frame has a scale and an offset of its own, as networks that see one frame at a time give it:
// a v + b is to make one depth of all. For two frames with v_j = α v_i + β that is
//   log a_i - log a_j = log α,  b_i - b_j = a_j β
// which is solved by least squares over frames that are 1, 2, 4, 8 and so on apart, so that errors of neighbours do not add up.
#include <fathom/relative.hpp>

#include "camera/photograph.hpp"
#include "quantile.hpp"
#include "require.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace fathom {
namespace {

constexpr int across = 64, down = 48; // cells, whose means have little noise
constexpr std::size_t few_cells = 16;
constexpr double cut =
    0.5; // of how much a frame's values differ, on average: what the frame before it does not explain at a cut
constexpr double alien =
    0.2; // the same of the median, and of what most values differ: frames that say nothing of each other
constexpr int rounds = 8;

// How a frame follows from another one: y = slope x + offset, but for a part that is not explained: of the median, whatever moves,
// and of the mean.
struct Line {
    static constexpr double all = std::numeric_limits<double>::infinity();
    double slope = 1, offset = 0, unexplained = all, unexplained_mean = all;
};

// The line is the same whichever of two frames comes first: its slope is the quotient of how far both spread where they fit.
Line line_of(const std::vector<double>& frame, const std::vector<double>& next) {
    std::vector<std::pair<double, double>> both;
    std::vector<double> slopes, spread, rest;
    for (std::size_t i = 0; i < frame.size(); ++i)
        if (std::isfinite(frame[i] + next[i]))
            both.emplace_back(frame[i], next[i]);
    if (both.size() < few_cells)
        return {};
    std::ranges::sort(both);
    const std::size_t third = both.size() / 3;
    for (std::size_t low = 0, high = both.size() - third; low < third; ++low, ++high)
        if (const double run = both[high].first - both[low].first; run > 0)
            slopes.push_back((both[high].second - both[low].second) / run);
    for (const auto& [x, y] : both)
        spread.push_back(y);
    // Of a wall that fills most of the frame half of the values differ by noise alone.
    const double middle = quantile(spread),
                 range = std::max((quantile(spread, 0.95) - quantile(spread, 0.05)) / 2, 1e-12);
    double away = 1e-12;
    for (const double y : spread)
        away += std::abs(y - middle);
    Line line{slopes.empty() ? 0 : quantile(slopes)};
    if (!(line.slope > 0))
        return {};
    for (const auto& [x, y] : both)
        rest.push_back(y - line.slope * x);
    line.offset = quantile(rest);
    for (int round = 0; round <= rounds; ++round) {
        rest.clear();
        for (const auto& [x, y] : both)
            rest.push_back(std::abs(y - line.slope * x - line.offset));
        const double typical = quantile(rest);
        line.unexplained = typical / range;
        line.unexplained_mean = std::accumulate(rest.begin(), rest.end(), 0.0) / away;
        const double most = std::max(7 * typical, 1e-7 * range); // Tukey's weights
        double sum = 0, mean_x = 0, mean_y = 0, xx = 0, yy = 0;
        const auto weight = [&](std::size_t i) {
            const double part = rest[i] / most;
            return part < 1 ? (1 - part * part) * (1 - part * part) : 0;
        };
        for (std::size_t i = 0; i < both.size(); ++i) {
            sum += weight(i);
            mean_x += weight(i) * both[i].first;
            mean_y += weight(i) * both[i].second;
        }
        mean_x /= sum;
        mean_y /= sum;
        for (std::size_t i = 0; i < both.size(); ++i) {
            xx += weight(i) * (both[i].first - mean_x) * (both[i].first - mean_x);
            yy += weight(i) * (both[i].second - mean_y) * (both[i].second - mean_y);
        }
        if (!(xx > 0 && yy > 0))
            break;
        line.slope = std::sqrt(yy / xx);
        line.offset = mean_y - line.slope * mean_x;
    }
    return line;
}

struct Pair {
    std::size_t one, other;
    Line line;
};

// Numbers x of which x_one - x_other is about a value for each pair. Their mean is 0, but for little.
Eigen::VectorXd solved(std::size_t count, const std::vector<Pair>& pairs, const auto& value_of) {
    constexpr double held = 1e-9;
    const auto size = static_cast<Eigen::Index>(count);
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (Eigen::Index i = 0; i < size; ++i)
        entries.emplace_back(i, i, held);
    for (const Pair& pair : pairs) {
        const auto i = static_cast<Eigen::Index>(pair.one), j = static_cast<Eigen::Index>(pair.other);
        const double weight = 1 / (1e-4 + pair.line.unexplained * pair.line.unexplained), value = value_of(pair);
        for (const auto& [row, column, sign] : {std::tuple{i, i, 1}, {j, j, 1}, {i, j, -1}, {j, i, -1}})
            entries.emplace_back(row, column, sign * weight);
        right[i] += weight * value;
        right[j] -= weight * value;
    }
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
}

// Values count from the middle of their frame, so that what is wrong with a slope moves them little.
struct Frame {
    std::vector<double> cells;
    double middle = 0, least, greatest;

    explicit Frame(const ShotFrame& frame) : cells(frame.cells), least(frame.least), greatest(frame.greatest) {
        std::vector<double> known;
        std::ranges::copy_if(cells, std::back_inserter(known), [](double value) { return std::isfinite(value); });
        if (!known.empty())
            middle = quantile(std::move(known));
        for (double& value : cells)
            value -= middle;
    }
};

// Frames without a cut between them.
void make_steady(std::span<const Frame> frames, std::span<SteadyRange> ranges) {
    std::vector<Pair> pairs;
    for (std::size_t apart = 1; apart < frames.size(); apart *= 2)
        for (std::size_t i = 0; i + apart < frames.size(); i += std::max<std::size_t>(1, apart / 4))
            if (const Line line = line_of(frames[i].cells, frames[i + apart].cells);
                line.unexplained < alien || apart == 1)
                pairs.push_back({i, i + apart, line});
    const Eigen::VectorXd log_a =
        solved(frames.size(), pairs, [](const Pair& pair) { return std::log(pair.line.slope); });
    const auto a = [&](std::size_t i) { return std::exp(log_a[static_cast<Eigen::Index>(i)]); };
    const Eigen::VectorXd b =
        solved(frames.size(), pairs, [&](const Pair& pair) { return a(pair.other) * pair.line.offset; });
    double least = std::numeric_limits<double>::infinity(), greatest = -least;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        least = std::min(least, a(i) * (frames[i].least - frames[i].middle) + b[static_cast<Eigen::Index>(i)]);
        greatest = std::max(greatest, a(i) * (frames[i].greatest - frames[i].middle) + b[static_cast<Eigen::Index>(i)]);
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const auto stored = [&](double value) {
            return (value - b[static_cast<Eigen::Index>(i)]) / a(i) + frames[i].middle;
        };
        ranges[i] = {stored(least), stored(greatest), i == 0};
    }
}

} // namespace

ShotFrame shot_frame(const HostFloats& stored) {
    require(stored.data && stored.width > 0 && stored.height > 0 && stored.channels == 1,
            "a frame of depth must have pixels, of one channel");
    ShotFrame frame{std::vector<double>(static_cast<std::size_t>(across * down)),
                    std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    const auto each = [&](const auto& visit) {
        for (int y = 0; y < stored.height; ++y)
            for (int x = 0; x < stored.width; ++x)
                if (const double value = *pixel_at(stored, x, y); std::isfinite(value))
                    visit(x, y, value);
    };
    std::size_t pixels = 0;
    each([&](int, int, double value) {
        ++pixels;
        frame.least = std::min(frame.least, value);
        frame.greatest = std::max(frame.greatest, value);
    });
    // Many pixels at an end were cut off there, as a sky is, and follow no scale.
    std::array<std::size_t, 2> at_end{};
    each([&](int, int, double value) {
        at_end[0] += value == frame.least;
        at_end[1] += value == frame.greatest;
    });
    const bool is_cut_off = 2 * (at_end[0] + at_end[1]) < 2 * pixels - pixels / 5; // or nothing would be left
    const auto is_end = [&](double value) {
        return is_cut_off && ((value == frame.least && 50 * at_end[0] > pixels) ||
                              (value == frame.greatest && 50 * at_end[1] > pixels));
    };
    std::vector<double> counts(frame.cells.size());
    each([&](int x, int y, double value) {
        if (is_end(value))
            return;
        const std::size_t row = static_cast<std::size_t>(y) * down / static_cast<std::size_t>(stored.height),
                          column = static_cast<std::size_t>(x) * across / static_cast<std::size_t>(stored.width);
        frame.cells[row * across + column] += value;
        ++counts[row * across + column];
    });
    require(frame.least < frame.greatest, "all values are the same, so that nothing is nearer than anything else");
    std::ranges::transform(frame.cells, counts, frame.cells.begin(), std::divides<>()); // NaN in empty cells
    return frame;
}

std::vector<SteadyRange> steady_ranges(std::span<const ShotFrame> shot) {
    const std::vector<Frame> frames(shot.begin(), shot.end());
    std::vector<SteadyRange> ranges(frames.size());
    for (std::size_t first = 0, i = 1; i <= frames.size(); ++i)
        if (i == frames.size() || !(line_of(frames[i - 1].cells, frames[i].cells).unexplained_mean < cut)) {
            make_steady(std::span(frames).subspan(first, i - first), std::span(ranges).subspan(first, i - first));
            first = i;
        }
    return ranges;
}

} // namespace fathom
