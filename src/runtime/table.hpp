#pragma once

#include "runtime/state.hpp"

#include <algorithm>
#include <type_traits>
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

inline constexpr std::size_t most_kept_bytes = std::size_t{256} << 20;

/// What an earlier call on this context made from the same `key`, or what `make` makes of it now: tables that kernels read.
/// A key is a plain struct without padding. What was used last is kept, up to 256 MB of it or an eighth of the device's budget.
template <typename Value, typename Key, typename Make>
std::shared_ptr<const Value> kept(const Device& device, const Key& key, const Make& make) {
    static_assert(std::has_unique_object_representations_v<Key>);
    const std::size_t budget = device.options().memory_budget;
    const std::size_t most_bytes = budget > 0 ? std::min(budget / 8, most_kept_bytes) : most_kept_bytes;
    const std::string name = std::string(Value::name) + std::string(reinterpret_cast<const char*>(&key), sizeof(key));
    Context& context = *device.state().shared;
    auto& list = context.kept;
    const auto find = [&] {
        const auto found = std::ranges::find(list, name, &Kept::key);
        if (found != list.end())
            list.splice(list.begin(), list, found);
        return found != list.end();
    };
    auto lock = locked(context.kept_mutex);
    if (!find()) {
        lock.unlock(); // others need not wait for what is made
        const std::shared_ptr<const Value> made = make();
        lock.lock();
        if (!find()) // or another thread was faster
            list.push_front({name, made->bytes(), made});
        std::size_t bytes = 0;
        const auto too_many = std::find_if(std::next(list.begin()), list.end(),
                                           [&](const Kept& each) { return (bytes += each.bytes) > most_bytes; });
        list.erase(too_many, list.end());
    }
    return std::static_pointer_cast<const Value>(list.front().value);
}

} // namespace fathom::runtime
