#include "figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace fathom::bench {
namespace {

Cell if_any(double value) {
    return value > 0 ? Cell(value) : Cell();
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
    return error;
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

Table table_of(const Device& device, const std::vector<Figures>& rows, Clock clock) {
    Table table(device, {"operation", "method",        "kind",      "storage",   "scene",       "width",  "height",
                         "radius_px", "clock",         "runs",      "ms",        "ms_q25",      "ms_q75", "floor",
                         "floor_ms",  "time_to_floor", "unit",      "mean",      "rms",         "p99",    "worst",
                         "points",    "scene_mean",    "scene_rms", "scene_p99", "scene_worst", "bytes"});
    for (const Figures& row : rows)
        table.add(cells(row, clock));
    return table;
}

} // namespace fathom::bench
