// What libFuzzer calls. FATHOM_FUZZ_TARGET says which target it is.
#include "targets.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

const fathom::fuzz::Target& target() {
    static const fathom::fuzz::Target& wanted = []() -> const fathom::fuzz::Target& {
        const char* name = std::getenv("FATHOM_FUZZ_TARGET");
        const auto* found = fathom::fuzz::find_target(name ? name : "");
        if (!found) {
            std::fprintf(stderr, "FATHOM_FUZZ_TARGET: %s is no target\n", name ? name : "(nothing)");
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
    target().run({data, size});
    return 0;
}
