#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
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
/// What malloc keeps for the next image need not be cleared again, so it asks for no place of its own.
inline void* allocate(std::size_t size) {
    constexpr std::size_t places = 16, alignment = 256;      // of what OpenCL's vectors and the caches' lines take
    constexpr std::size_t most_kept = std::size_t{32} << 20; // malloc's DEFAULT_MMAP_THRESHOLD_MAX
    static std::atomic<std::size_t> count = 0;
    const bool large = size >= huge_page;
    const std::size_t begin = alignment * (large ? 1 + 49 * (count++ % places) : 1);
    // All images of a size ask for as much, or malloc would not find what it keeps.
    const std::size_t room = (large ? alignment * (1 + 49 * (places - 1)) : begin) + size;
    const bool kept = room + 2 * alignment < most_kept;
    const std::size_t step = kept ? alignment : huge_page, whole = (room + step - 1) / step * step;
    char* const block = static_cast<char*>(kept ? std::malloc(whole + alignment) : std::aligned_alloc(step, whole));
    if (!block)
        return nullptr;
    const auto up = [&](std::size_t to) { return block + (to - reinterpret_cast<std::uintptr_t>(block) % to) % to; };
    char* const base = up(alignment);
#ifdef __linux__
    // The system clears a huge page as a whole, also where the last one holds a few bytes.
    char* const first = up(huge_page);
    const std::size_t rounding = kept ? 0 : huge_page / 2;
    if (large && first + huge_page <= base + begin + size + rounding)
        madvise(first, static_cast<std::size_t>(base + begin + size + rounding - first) / huge_page * huge_page,
                MADV_HUGEPAGE);
#endif
    void** const memory = reinterpret_cast<void**>(base + begin);
    memory[-1] = block;
    return memory;
}

inline void give_back(void* memory) {
    if (memory)
        std::free(static_cast<void**>(memory)[-1]);
}

} // namespace fathom::runtime
