#pragma once

#include <fathom/cheapest.hpp>
#include <fathom/dof.hpp>
#include <fathom/normals.hpp>
#include <fathom/ssao.hpp>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fathom {

/// A method's error on depth of one storage, in the scene where it is greatest, and its time.
struct Measured {
    std::string_view operation, storage, method;
    double error;
    std::string_view scene;
    double ns_per_pixel;
    std::string_view device;
};

/// The library's methods of ssao, dof and normals.
std::span<const Measured> measured_methods();

/// The methods of one operation with their errors on depth of this storage. If none were measured, with the largest
/// error of any storage. Pure: no device.
std::vector<MeasuredMethod> measured_for(std::span<const Measured> measured, std::string_view operation,
                                         std::string_view storage);

/// The fastest of the methods within the error, and of equally fast ones the most exact; nothing if there is none.
/// Pure: no device.
std::optional<MeasuredMethod> cheapest_method(std::span<const MeasuredMethod> methods, double max_error);

/// The options with the method that their `MaxError` chooses in its place.
/// Throws: std::invalid_argument for noise, and as `cheapest_method`.
SsaoOptions chosen(const Tile& tile, SsaoOptions options);
DofOptions chosen(const Tile& tile, DofOptions options);
NormalsOptions chosen(const Tile& tile, NormalsOptions options);

} // namespace fathom
