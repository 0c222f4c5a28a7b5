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

/// What was measured of a method on depth of one storage, in the scene where its error is greatest.
struct Measured {
    std::string_view operation, storage, method;
    double error;
    std::string_view scene;
    double ns_per_pixel;
    std::string_view device;
};

/// The library's methods of ssao, dof and normals.
std::span<const Measured> measured_methods();

/// Of one operation, what is known of each method on depth of this storage; if there is nothing, the worst of any. Pure.
std::vector<MeasuredMethod> choices(std::span<const Measured> measured, std::string_view operation,
                                    std::string_view storage);

/// The least time among those within the error, and among equals the least error; nothing if there are none. Pure.
std::optional<MeasuredMethod> cheapest_method(std::span<const MeasuredMethod> choices, double max_error);

/// The options that `max_error` stands for, without it.
/// Throws: std::invalid_argument where they also say themselves what it is to choose, and as `cheapest_method`.
SsaoOptions chosen(const StoredDepth& stored, SsaoOptions options);
DofOptions chosen(const StoredDepth& stored, DofOptions options);
NormalsOptions chosen(const StoredDepth& stored, NormalsOptions options);

} // namespace fathom
