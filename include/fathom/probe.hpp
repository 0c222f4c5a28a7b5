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
    bool separate_products = true; ///< are a product and a sum rounded twice, where no fused product is asked for?
    bool denormals = true;         ///< are they kept, as operands and as results?
    bool signed_zeros = true;      ///< does a 0 have the sign that IEEE 754 gives it, where no denormal became 0?
    /// The same of double, where the device has it: are all results the correctly rounded ones?
    std::optional<bool> fp64 = {};

    /// Does everything round as IEEE 754 says? Then all operations give the bits that they give on every such device that has
    /// double if this one has, and the errors that their headers state hold.
    bool exact() const;
};

/// The most by which the results of a device that is not exact were seen to differ from those of one that is, with some room:
/// scripts/test-devices fails beyond them. They were measured where quotients are 1 unit in the last place off, where square
/// roots are, and where a * b + c is rounded once. linearize and unproject correct their quotients by what these leave over, so
/// that their errors stay those of their headers plus this. fog and dof are fractions of the brightest value, normals are unit
/// vectors, and coc is in pixels. One sector of ssao more or less is a part in some hundreds. Where only denormals become 0,
/// numbers are the same, except where a stored depth or a result is one. Nothing is stated of pixels of dof beside
/// an edge that is decided otherwise, and through lenses of normals and ssao, which creases decide.
namespace inexact {
inline constexpr double linearize_ulp = 1, unproject_ulp = 1;  ///< units in the last place
inline constexpr double distance_error_through_lens = 0x1p-22; ///< of both through lenses, of the distance
inline constexpr double normals_error = 1e-6, ssao_error = 2e-3, dof_masks_error = 1e-4, dof_error = 3e-6,
                        fog_error = 1e-6;
} // namespace inexact

/// Tries 2^20 hard cases on the device: quotients and square roots that lie all but in the middle between two floats,
/// products that cancel, denormals, and zeros of both signs. Takes less than a second, and the first time as long as the
/// driver compiles.
/// Throws: Error from the driver.
DeviceArithmetic probe_arithmetic(const Device& device);

/// "exact", "exact, without double", or what is not: "division 2 ulp, denormals become 0".
std::string to_string(const DeviceArithmetic& arithmetic);

#pragma GCC visibility pop
} // namespace fathom
