#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace fathom::runtime {

constexpr std::size_t huge_page = std::size_t{2} << 20;

/// Memory for the rows of an image, to be given back by `give_back`; null where there is none. What is as large as a huge page lies
/// in such pages, where the system hands them out to those that ask: writing to new memory then takes a fraction of the time,
/// and kernels that read far around their pixels wait less for the translation of addresses. Each begins at another place of
/// its page, since images that begin at the same one share the same sets of the caches: `dof_masks` took 1.4 times as long.
inline void* allocate(std::size_t size) {
    constexpr std::size_t places = 16, alignment = 256; // of what OpenCL's vectors and the caches' lines take
    static std::atomic<std::size_t> count = 0;
    const bool large = size >= huge_page;
    const std::size_t begin = alignment * (large ? 1 + 49 * (count++ % places) : 1),
                      step = large ? huge_page : alignment, whole = (begin + size + step - 1) / step * step;
    char* const base = static_cast<char*>(std::aligned_alloc(step, whole));
    if (!base)
        return nullptr;
#ifdef __linux__
    // The system clears a huge page as a whole, also where the last one holds a few bytes.
    if (large)
        madvise(base, (begin + size + huge_page / 2) / huge_page * huge_page, MADV_HUGEPAGE);
#endif
    void** const memory = reinterpret_cast<void**>(base + begin);
    memory[-1] = base;
    return memory;
}

inline void give_back(void* memory) {
    if (memory)
        std::free(static_cast<void**>(memory)[-1]);
}

} // namespace fathom::runtime
