#pragma once

#include <fathom/device.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace fathom {
#pragma GCC visibility push(default)

/// How a device rounds, as a kernel found it. A driver's own flags may be wrong, and say nothing of vectors.
struct DeviceArithmetic {
    /// How far the worst result lies from the correctly rounded one, in units in its last place: 0 if all are right.
    std::uint64_t division_ulp = 0, sqrt_ulp = 0, fma_ulp = 0;
    bool denormals = true; ///< are they kept, as operands and as results?
    /// The same of double, where the device has it: are all results the correctly rounded ones?
    std::optional<bool> fp64 = {};

    /// Does everything round as IEEE 754 says? Then all operations give the bits that they give on every such device that has
    /// double if this one has, and the errors that their headers state hold.
    bool exact() const;
};

/// Tries 2^20 hard cases on the device: quotients and square roots as close to the middle between two floats as there are,
/// products that cancel, and denormals. Takes less than a second, and the first time as long as the driver compiles.
/// Throws: Error from the driver.
DeviceArithmetic probe_arithmetic(const Device& device);

/// "exact", "exact, without double", or what is not: "division 2 ulp, denormals become 0".
std::string to_string(const DeviceArithmetic& arithmetic);

#pragma GCC visibility pop
} // namespace fathom
