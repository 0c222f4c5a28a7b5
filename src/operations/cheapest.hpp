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

/// What was measured of a method on depth of one storage.
struct Measured {
    std::string operation, storage;
    MeasuredMethod choice;
};

/// The library's methods of ssao, dof and normals in tables of fathom_bench (columns: bench/figures.hpp): the errors of one
/// and the times of the other, the first of each method. What has no time, and what no option stands for, is left out. Pure.
/// Throws: std::invalid_argument for tables without such columns.
std::vector<Measured> measured_methods(std::string_view errors_csv, std::string_view times_csv);

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
