#pragma once

#include <fathom/cheapest.hpp>
#include <fathom/dof.hpp>
#include <fathom/normals.hpp>
#include <fathom/ssao.hpp>

#include <span>
#include <string_view>
#include <vector>

namespace fathom {

/// A method's error on depth of one storage, in the scene where it is greatest.
struct Measured {
    std::string_view operation, storage, method;
    double error;
    std::string_view scene;
};

/// The library's methods of ssao, dof and normals, those of an operation and a storage from the cheapest to the dearest.
std::span<const Measured> measured_methods();

/// The methods of one operation in that order with their errors on depth of this storage. If none were measured, with the largest
/// error of any storage. Pure: no device.
std::vector<MeasuredMethod> measured_for(std::span<const Measured> measured, std::string_view operation,
                                         std::string_view storage);

/// The options with the method that their `MaxError` chooses in its place.
/// Throws: std::invalid_argument for noise, and as `cheapest_method`.
SsaoOptions chosen(const Tile& tile, SsaoOptions options);
DofOptions chosen(const Tile& tile, DofOptions options);
NormalsOptions chosen(const Tile& tile, NormalsOptions options);

} // namespace fathom
