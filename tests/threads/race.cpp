// Two threads that use the library rightly, and share a number wrongly: ThreadSanitizer has to say so, whatever cmake/tsan.supp
// keeps it from saying about drivers.

#include "operations.hpp"

#include <fathom/fathom.hpp>

#include <cstdio>
#include <thread>

int shared_by_mistake = 0;

int main() {
    const fathom::Device device = fathom::Device::open("cpu");
    const auto call = [&] {
        for (int i = 0; i < 20; ++i)
            shared_by_mistake += static_cast<int>(operations::all().front().run(device).size());
    };
    std::thread first(call), second(call);
    first.join();
    second.join();
    std::printf("%d bytes\n", shared_by_mistake);
}
