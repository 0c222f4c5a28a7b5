// where_it_fails FOLDER [REGIME...]: sweeps every regime, or those named, until methods break, and writes what was found:
// errors.csv, with the bounds, and boundaries.csv. bench/plot draws them, docs/make-where-it-fails does it all.

#include "regimes/regime.hpp"
#include "table.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

using namespace fathom::regimes;
using fathom::bench::Table;

namespace {

void add(const Regime& regime, Table& points, Table& boundaries) {
    for (const Panel& panel : regime.panels)
        for (const Curve& curve : panel.curves)
            for (const Point& point : curve.points)
                points.add({regime.name, regime.parameter, panel.quantity, curve.name, point.parameter, point.error,
                            point.bound});
    for (const Boundary& b : regime.boundaries)
        boundaries.add({regime.name, regime.parameter, b.quantity, b.curve, b.limit, b.holds, b.breaks, b.why});
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc < 2) {
        std::fputs("usage: where_it_fails FOLDER [REGIME...]\n", stderr);
        return 2;
    }
    try {
        const std::filesystem::path folder = argv[1];
        std::filesystem::create_directories(folder);
        const std::vector<std::string> wanted(argv + 2, argv + argc);
        const fathom::Device device = fathom::Device::open("cpu");
        Table points(device, {"regime", "parameter", "quantity", "curve", "value", "error", "bound"});
        Table boundaries(device, {"regime", "parameter", "quantity", "curve", "limit", "holds", "breaks", "why"});
        for (const Sweep& sweep : sweeps()) {
            if (!wanted.empty() && std::ranges::find(wanted, sweep.name) == wanted.end())
                continue;
            const auto start = std::chrono::steady_clock::now();
            add(sweep.run(device), points, boundaries);
            const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
            std::printf("%-20s %5.1f s\n", sweep.name, taken.count());
        }
        points.write_csv(folder / "errors.csv");
        boundaries.write_csv(folder / "boundaries.csv");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "where_it_fails: %s\n", error.what());
        return 1;
    }
}
