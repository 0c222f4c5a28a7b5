// Preloaded into a program: lets one allocation fail, the first from number $FATHOM_FAILS_AT on that no OpenCL driver asks for.
// What drivers make of theirs is not ours.
#include <dlfcn.h>
#include <execinfo.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(std::size_t);                // NOLINT: the C library's
void* __libc_calloc(std::size_t, std::size_t);   // NOLINT
void* __libc_realloc(void*, std::size_t);        // NOLINT
void* __libc_memalign(std::size_t, std::size_t); // NOLINT
}

namespace {

std::atomic<unsigned long> count = 0, fails_at = 0;
thread_local bool inside = false;

[[gnu::constructor]] void begin() {
    std::array<void*, 2> first{};
    backtrace(first.data(), first.size()); // which allocates once
    const char* const number = std::getenv("FATHOM_FAILS_AT");
    fails_at = number ? std::strtoul(number, nullptr, 10) : 0;
}

bool is_of_driver() {
    std::array<void*, 60> places{};
    const int found = backtrace(places.data(), places.size());
    return std::any_of(places.begin(), places.begin() + found, [](void* place) {
        Dl_info info;
        if (!dladdr(place, &info) || !info.dli_fname)
            return false;
        constexpr const char* drivers[] = {"pocl", "LLVM", "OpenCL", "clang", "ld-linux"};
        return std::any_of(std::begin(drivers), std::end(drivers),
                           [&](const char* name) { return std::strstr(info.dli_fname, name) != nullptr; });
    });
}

bool fails() {
    const unsigned long from = fails_at;
    if (inside || from == 0 || ++count < from)
        return false;
    inside = true;
    const bool now = !is_of_driver() && fails_at.exchange(0) != 0;
    inside = false;
    if (now)
        errno = ENOMEM;
    return now;
}

} // namespace

extern "C" {

[[gnu::visibility("default")]] void* malloc(std::size_t size) {
    return fails() ? nullptr : __libc_malloc(size);
}
[[gnu::visibility("default")]] void* calloc(std::size_t number, std::size_t size) {
    return fails() ? nullptr : __libc_calloc(number, size);
}
[[gnu::visibility("default")]] void* realloc(void* old, std::size_t size) {
    return fails() ? nullptr : __libc_realloc(old, size);
}
[[gnu::visibility("default")]] void* memalign(std::size_t alignment, std::size_t size) {
    return fails() ? nullptr : __libc_memalign(alignment, size);
}
[[gnu::visibility("default")]] void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return memalign(alignment, size);
}
[[gnu::visibility("default")]] int posix_memalign(void** place, std::size_t alignment, std::size_t size) {
    *place = memalign(alignment, size);
    return *place ? 0 : ENOMEM;
}
}
