#pragma once

#include <cstddef>
#include <cstdlib>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace fathom::runtime {

constexpr std::size_t huge_page = std::size_t{2} << 20;

/// Memory for the rows of an image, to be given back by std::free; null where there is none. What is as large as a huge page lies
/// in such pages, where the system hands them out to those that ask: writing to new memory then takes a fraction of the time,
/// and kernels that read far around their pixels wait less for the translation of addresses.
inline void* allocate(std::size_t size) {
    constexpr std::size_t alignment = 64;
    const std::size_t step = size < huge_page ? alignment : huge_page;
    void* const memory = std::aligned_alloc(step, (size + step - 1) / step * step);
#ifdef __linux__
    if (memory && step == huge_page)
        madvise(memory, size, MADV_HUGEPAGE);
#endif
    return memory;
}

} // namespace fathom::runtime
