#pragma once

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace oracle {

/// Calls `each` with every number below `count`, on all cores.
template <typename Each>
void in_parallel(std::size_t count, const Each& each) {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
        for (std::size_t i = next++; i < count; i = next++)
            each(i);
    };
    std::vector<std::jthread> others;
    for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i)
        others.emplace_back(work);
    work();
}

} // namespace oracle
