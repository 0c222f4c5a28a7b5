// Races in kernels, which no sanitizer sees in code that the driver compiles: every operation has the same bits a thousand
// times over.
#include "catch.hpp"
#include "operations.hpp"

#include <fathom/device.hpp>

using namespace fathom;

TEST_CASE("repeats: every operation has the same bits a thousand times over", "[repeats]") {
    constexpr int times = 1000;
    const auto small = std::pair(operations::width, operations::height);
    std::tie(operations::width, operations::height) = std::pair(200, 120); // many groups run side by side in every pass
    const Device device = Device::open("cpu");
    for (const operations::Operation& operation : operations::all()) {
        const auto first = operation.run(device);
        int different = 0;
        for (int i = 1; i < times; ++i)
            different += operation.run(device) != first;
        INFO(operation.name);
        CHECK(different == 0);
    }
    std::tie(operations::width, operations::height) = small;
}
