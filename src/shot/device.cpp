// The device of a run, and how many threads work beside it.
#include "options.hpp"

#include "io/formats.hpp"
#include "shot/record.hpp"

#include <fathom/exr.hpp>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <opencv2/core/utility.hpp>

#include <algorithm>
#include <cstdlib>
#include <thread>

namespace fathom::cli {
namespace {

// Large images go back to the system when they are freed, in place of being kept for the next frame.
void give_back_images() {
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_MMAP_MAX, 65536);
#endif
}

int cores() {
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

} // namespace

void DeviceOption::prepare(std::size_t memory) const {
    if (threads > 0) {
        const std::string count = std::to_string(threads);
        setenv("POCL_MAX_PTHREAD_COUNT", count.c_str(), 1); // PoCL to 4
        setenv("POCL_CPU_MAX_CU_COUNT", count.c_str(), 1);  // PoCL from 5
    }
    runtime::compile_apart(kernels_hash()); // before there are threads that may hold a lock
    if (memory > 0)
        give_back_images();
    set_exr_threads(threads);
    if (threads > 0) // oneTBB warns of more than there are
        cv::setNumThreads(std::min(threads, cores()));
}

std::shared_mutex& vector_widths() {
    static std::shared_mutex all;
    return all;
}

Device DeviceOption::open(std::size_t memory) const {
    constexpr std::size_t least_memory = std::size_t{64} << 20; // so that any SIZE does for small images
    return Device::open(wanted, {.memory_budget = memory > 0 ? std::max(memory, least_memory) : 0});
}

bool DeviceOption::takes_turns(const Device& opened) const {
    return opened.info().cpu && threads > 0 && threads < cores();
}

void DeviceOption::share_among(std::size_t files) const {
    const int at_once = static_cast<int>(std::clamp<std::size_t>(files, 1, static_cast<std::size_t>(threads)));
    io::set_exr_pool(threads - at_once);
    cv::setNumThreads(threads / at_once);
}

} // namespace fathom::cli
