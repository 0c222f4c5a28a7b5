#pragma once

#include "runtime/state.hpp"

#include <vector>

namespace fathom::runtime {

/// Numbers of 32 bits, or structs of them, for kernels to read. They belong to the context and last until the last kernel that
/// reads them has ended, so that nobody waits for that.
struct Table {
    cl::Buffer buffer;
    Element element;
    int count;

    /// As an argument of a device's kernel.
    Image on(const Device& device) const { return Image(device, shared(buffer()), element, {count, 1}); }
};

/// A copy of these values.
template <typename Value>
Table table(const Device& device, Element element, const std::vector<Value>& values) {
    static_assert(sizeof(Value) % 4 == 0);
    const std::size_t size = values.size() * sizeof(Value);
    const auto make = [&] {
        return cl::Buffer(context_of(device), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, size,
                          const_cast<Value*>(values.data()));
    };
    return {ask(device, make, "has no room for a table of ", size, " bytes"), element, static_cast<int>(size / 4)};
}

} // namespace fathom::runtime
