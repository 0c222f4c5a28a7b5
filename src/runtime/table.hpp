#pragma once

#include <fathom/image.hpp>

#include <vector>

namespace fathom::runtime {

/// Numbers of 32 bits, or structs of them, for kernels to read. A CPU device reads `values` themselves: finish before
/// they go.
template <typename Value>
Image table(const Device& device, Element element, const std::vector<Value>& values) {
    static_assert(sizeof(Value) % 4 == 0);
    return Image::from_host(device, element, values.data(), {static_cast<int>(values.size() * sizeof(Value) / 4), 1});
}

} // namespace fathom::runtime
