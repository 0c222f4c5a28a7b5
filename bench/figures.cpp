#include "figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

namespace fathom::bench {
namespace {

Cell if_any(double value) {
    return value > 0 ? Cell(value) : Cell();
}

constexpr int resamples = 1000;

// At one place: the errors of all methods, resampled alike.
void compare(Table& table, const std::vector<const Figures*>& rows) {
    const std::size_t points = rows.front()->squares.size();
    std::vector<std::vector<double>> errors(rows.size());
    std::mt19937 random(1);
    std::vector<double> drawn(points);
    for (int i = 0; i < resamples; ++i) {
        std::vector<std::size_t> chosen;
        for (std::size_t k = 0; k < points; ++k)
            chosen.push_back(random() % points);
        for (std::size_t m = 0; m < rows.size(); ++m) {
            std::ranges::transform(chosen, drawn.begin(), [&](std::size_t k) { return rows[m]->squares[k]; });
            errors[m].push_back(common_rms(drawn));
        }
    }
    const auto is_preset = [](const std::string& name) {
        return name == "fast" || name == "balanced" || name == "accurate";
    };
    for (std::size_t m = 0; m < rows.size(); ++m)
        for (std::size_t other = 0; other < rows.size() && is_preset(rows[m]->method); ++other) {
            if (other == m || rows[other]->method.ends_with(constant_suffix))
                continue;
            std::vector<double> ratios;
            for (std::size_t i = 0; i < errors[m].size(); ++i)
                ratios.push_back(errors[other][i] / errors[m][i]);
            const Figures& f = *rows[m];
            const double least = quantile(ratios, 0.025);
            if (least < 1 || is_preset(rows[other]->method))
                table.add({f.operation, f.method, f.storage, f.scene, 1.0 * f.width, 1.0 * f.height,
                           if_any(f.radius_px), rows[other]->method,
                           common_rms(rows[other]->squares) / common_rms(f.squares), least, quantile(ratios, 0.975)});
        }
}

std::vector<Cell> cells(const Figures& f, Clock clock) {
    std::vector<Cell> row{f.operation, f.method,      f.kind,         f.storage,
                          f.scene,     1.0 * f.width, 1.0 * f.height, if_any(f.radius_px)};
    const bool timed = !f.seconds.empty();
    const double ms = 1e3 * median(f.seconds);
    const std::vector<Cell> times{clock == Clock::wall ? "wall" : "processor",
                                  1.0 * static_cast<double>(f.seconds.size()),
                                  ms,
                                  1e3 * quantile(f.seconds, 0.25),
                                  1e3 * quantile(f.seconds, 0.75),
                                  f.floor,
                                  if_any(1e3 * f.floor_seconds),
                                  f.floor_seconds > 0 ? Cell(1e-3 * ms / f.floor_seconds) : Cell()};
    for (const Cell& time : times)
        row.push_back(timed ? time : Cell());
    const bool judged = f.error.has_value();
    const Deviation error = f.error.value_or(Deviation{});
    for (const Cell& cell : std::vector<Cell>{error.unit, error.mean, error.rms, error.p99, error.worst,
                                              1.0 * static_cast<double>(error.points)})
        row.push_back(judged ? cell : Cell());
    const Deviation in_scene = f.scene_error.value_or(Deviation{});
    for (const double each : {in_scene.mean, in_scene.rms, in_scene.p99, in_scene.worst})
        row.push_back(f.scene_error ? Cell(each) : Cell());
    row.push_back(if_any(f.bytes));
    row.push_back(judged ? Cell(error.common) : Cell());
    return row;
}

} // namespace

Deviation summary(std::string unit, const std::vector<double>& errors) {
    Deviation error{.unit = std::move(unit), .points = errors.size()};
    if (errors.empty())
        return error;
    std::vector<double> sizes;
    for (const double each : errors) {
        error.mean += each;
        error.rms += each * each;
        sizes.push_back(std::abs(each));
    }
    const auto count = static_cast<double>(errors.size());
    error.mean /= count;
    error.rms = std::sqrt(error.rms / count);
    error.p99 = quantile(sizes, 0.99);
    error.worst = *std::ranges::max_element(sizes);
    for (double& each : sizes)
        each *= each;
    error.common = common_rms(std::move(sizes));
    return error;
}

double common_rms(std::vector<double> squares) {
    const auto kept = static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(squares.size()));
    if (kept == 0)
        return 0;
    std::nth_element(squares.begin(), squares.begin() + kept - 1, squares.end());
    return std::sqrt(std::accumulate(squares.begin(), squares.begin() + kept, 0.0) / static_cast<double>(kept));
}

void print_row(const Figures& row) {
    const std::string name = row.operation + ' ' + row.method;
    std::printf("%-39s %-8s %-9s %5d x %-5d", name.c_str(), row.storage.c_str(), row.scene.c_str(), row.width,
                row.height);
    std::printf(row.radius_px > 0 ? " %6.0f px" : "          ", row.radius_px);
    if (!row.seconds.empty())
        std::printf(" %10.3f ms (%.3f-%.3f), %8.3g x floor, %6.0f MB", 1e3 * median(row.seconds),
                    1e3 * quantile(row.seconds, 0.25), 1e3 * quantile(row.seconds, 0.75),
                    median(row.seconds) / row.floor_seconds, 1e-6 * row.bytes);
    if (row.error)
        std::printf(" %10.3g %s rms, mean %+.3g, 99%% %.3g, worst %.3g, %zu points", row.error->rms,
                    row.error->unit.c_str(), row.error->mean, row.error->p99, row.error->worst, row.error->points);
    if (row.scene_error)
        std::printf("; the scene itself %.3g rms, mean %+.3g, 99%% %.3g, worst %.3g", row.scene_error->rms,
                    row.scene_error->mean, row.scene_error->p99, row.scene_error->worst);
    std::printf("\n");
    std::fflush(stdout);
}

Table pairs_of(const Device& device, const std::vector<Figures>& rows) {
    Table table(device, {"operation", "method", "storage", "scene", "width", "height", "radius_px", "other", "ratio",
                         "least", "most"});
    std::map<std::tuple<std::string, std::string, double>, std::vector<const Figures*>> places;
    for (const Figures& row : rows)
        if (!row.squares.empty())
            places[{row.operation, row.scene, row.radius_px}].push_back(&row);
    for (const auto& [place, methods] : places)
        compare(table, methods);
    return table;
}

Table table_of(const Device& device, const std::vector<Figures>& rows, Clock clock) {
    Table table(device, {"operation", "method",        "kind",      "storage",   "scene",       "width",  "height",
                         "radius_px", "clock",         "runs",      "ms",        "ms_q25",      "ms_q75", "floor",
                         "floor_ms",  "time_to_floor", "unit",      "mean",      "rms",         "p99",    "worst",
                         "points",    "scene_mean",    "scene_rms", "scene_p99", "scene_worst", "bytes",  "common"});
    for (const Figures& row : rows)
        table.add(cells(row, clock));
    return table;
}

} // namespace fathom::bench
