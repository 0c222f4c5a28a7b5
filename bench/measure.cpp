#include "measure.hpp"

#include <algorithm>
#include <numeric>
#include <random>

namespace fathom::bench {

std::vector<std::vector<double>> measured(const Device& device, const std::vector<Work>& work, int rounds, Clock clock,
                                          int warm_up) {
    std::vector<std::vector<double>> samples(work.size());
    std::vector<std::size_t> order(work.size());
    std::iota(order.begin(), order.end(), 0);
    std::mt19937 random(7);
    for (int round = -warm_up; round < rounds; ++round) {
        std::shuffle(order.begin(), order.end(), random);
        for (const std::size_t i : order) {
            const Work& each = work[i];
            if (round != -1 && round % each.every != 0)
                continue;
            if (each.before)
                each.before();
            const double time = seconds(clock, [&] {
                each.run();
                device.finish();
            });
            if (round >= 0)
                samples[i].push_back(time);
            if (each.after)
                each.after();
        }
    }
    return samples;
}

int rounds_between(const Device& device, const Work& work, int rounds, double limit) {
    const int least = std::min(3, rounds);
    double time = 0;
    for (int i = 0; i < 2 && time * least <= limit; ++i) { // the first one may compile kernels
        if (work.before)
            work.before();
        time = seconds(Clock::wall, [&] {
            work.run();
            device.finish();
        });
        if (work.after)
            work.after();
    }
    const int runs = std::clamp(static_cast<int>(limit / std::max(time, 1e-9)), least, rounds);
    return (rounds + runs - 1) / runs;
}

} // namespace fathom::bench
