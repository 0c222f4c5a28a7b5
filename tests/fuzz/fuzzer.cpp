// What libFuzzer calls. FATHOM_FUZZ_TARGET says which target it is.
// AddressSanitizer limits each allocation (-malloc_limit_mb). Without it the functions that allocate do so themselves.
#include "targets.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <dlfcn.h>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

#if !__has_feature(address_sanitizer)
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* __libc_calloc(std::size_t count, std::size_t size);
extern "C" void* __libc_realloc(void* old, std::size_t size);
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);

namespace {

/// Ends the run, and libFuzzer keeps the input.
std::size_t limited(std::size_t size) {
    constexpr std::size_t most = 1u << 30;
    if (size <= most)
        return size;
    std::fprintf(stderr, "ERROR: %zu bytes are allocated at once\n", size);
    std::abort();
}

bool libraries_are_limited() {
    return dlsym(RTLD_DEFAULT, "malloc") == reinterpret_cast<void*>(&malloc);
}

} // namespace

// Libraries call them, too, although the build hides what it does not ask to be seen.
#pragma GCC visibility push(default)
extern "C" void* malloc(std::size_t size) {
    return __libc_malloc(limited(size));
}

extern "C" void* calloc(std::size_t count, std::size_t size) {
    std::size_t all;
    return __libc_calloc(count, __builtin_mul_overflow(count, size, &all) ? size : (limited(all), size));
}

extern "C" void* realloc(void* old, std::size_t size) {
    return __libc_realloc(old, limited(size));
}

extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return __libc_memalign(alignment, limited(size));
}

extern "C" void* memalign(std::size_t alignment, std::size_t size) {
    return __libc_memalign(alignment, limited(size));
}

extern "C" int posix_memalign(void** where, std::size_t alignment, std::size_t size) {
    *where = __libc_memalign(alignment, limited(size));
    return *where ? 0 : ENOMEM;
}
#pragma GCC visibility pop
#else
namespace {

bool libraries_are_limited() {
    return true;
}

} // namespace
#endif

namespace {

const fathom::fuzz::Target& target() {
    static const fathom::fuzz::Target& wanted = []() -> const fathom::fuzz::Target& {
        const char* name = std::getenv("FATHOM_FUZZ_TARGET");
        const auto* found = fathom::fuzz::find_target(name ? name : "");
        if (!found) {
            std::fprintf(stderr, "FATHOM_FUZZ_TARGET: %s is no target\n", name ? name : "(nothing)");
            std::exit(2);
        }
        if (!libraries_are_limited()) {
            std::fprintf(stderr, "the limit of allocations does not reach the libraries\n");
            std::exit(2);
        }
        return *found;
    }();
    return wanted;
}

} // namespace

std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
    size = LLVMFuzzerMutate(data, std::min(size, target().largest), std::min(most, target().largest));
    const unsigned broken = 8; // one in so many stays as it is
    if (target().repair && seed % broken != 0) {
        fathom::fuzz::Bytes bytes(data, data + size);
        target().repair(bytes);
        std::copy(bytes.begin(), bytes.end(), data);
    }
    return size;
}

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // Of the processor: -timeout counts seconds of the clock, which others' work makes more.
    constexpr double most = 2;
    const std::clock_t start = std::clock();
    target().run({data, size});
    const double taken = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (taken > most) {
        std::fprintf(stderr, "ERROR: an input takes %.1f s\n", taken);
        std::abort();
    }
    return 0;
}
