// The cheapest method that meets a tolerance, from a table of measured errors in the order of cost.

#include "operations/cheapest.hpp"

#include "description/check.hpp"
#include "operations/parameters.hpp"
#include "operations/ssao/ssao_method.hpp"

#include <algorithm>

namespace fathom {
namespace {

template <typename Value, std::size_t count>
std::optional<Value> named(std::string_view method, const std::pair<const char*, Value> (&names)[count]) {
    for (const auto& [name, value] : names)
        if (method == name)
            return value;
    return std::nullopt;
}

constexpr std::string_view half_resolution = ", half resolution"; // follows the name of the method at full resolution

std::optional<Quality> quality_named(std::string_view method) {
    return named<Quality>(method,
                          {{"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}});
}

// The sampling that stands for a method of the table: a preset, or "2 x 16" for 2 slices of 16 samples.
Sampling sampling_named(const std::string& method) {
    Sampling sampling;
    const std::string of = method.substr(0, method.find(half_resolution));
    if (of != method)
        sampling.half_resolution = true;
    if (const auto quality = quality_named(of)) {
        sampling.quality = *quality;
        return sampling;
    }
    std::istringstream words(of);
    std::string by;
    words >> sampling.slices.emplace() >> by >> sampling.samples.emplace();
    return sampling;
}

constexpr const char* operations[] = {"ssao", "dof", "normals"};

} // namespace

std::vector<MeasuredMethod> measured_for(std::span<const Measured> measured, std::string_view operation,
                                         std::string_view storage) {
    const bool has_storage = std::ranges::any_of(
        measured, [&](const Measured& m) { return m.operation == operation && m.storage == storage; });
    std::vector<MeasuredMethod> list;
    for (const Measured& m : measured) {
        if (m.operation != operation || (has_storage && m.storage != storage))
            continue;
        const MeasuredMethod method{std::string(m.method), m.error, std::string(m.scene)};
        const auto known = std::ranges::find(list, m.method, &MeasuredMethod::method);
        if (known == list.end())
            list.push_back(method);
        else if (known->error < m.error)
            *known = method;
    }
    return list;
}

const char* to_string(Operation operation) {
    return operations[static_cast<int>(operation)];
}

MeasuredMethod cheapest_method(Operation operation, const Tile& tile, double max_error) {
    description::Check{}("operation", operation, {"ssao", "dof", "normals"});
    description::Check{}("max_error", max_error, description::tolerated_error);
    const Storage rounding = is_coarse(tile) ? Storage::uint16 : tile.storage;
    std::vector<MeasuredMethod> list = measured_for(measured_methods(), to_string(operation), to_string(rounding));
    const PixelLattice half = pixel_lattice(tile, 2);
    if (half.width == 0 || half.height == 0) // the tile is a single odd row or column
        std::erase_if(list, [](const MeasuredMethod& each) { return each.method.ends_with(half_resolution); });
    const auto found = std::ranges::find_if(list, [&](const MeasuredMethod& each) { return each.error <= max_error; });
    if (found != list.end())
        return *found;
    const MeasuredMethod& best = *std::ranges::min_element(list, {}, &MeasuredMethod::error);
    throw std::invalid_argument(text("max_error = ", max_error, " is met by none of the measured methods of ",
                                     to_string(operation), ": the best, ", best.method, ", is off by ", best.error,
                                     " in the scene that it is worst in, ", best.scene));
}

SsaoOptions chosen(const Tile& tile, SsaoOptions options) {
    const double most = std::get<MaxError>(options.sampling).value;
    options.sampling = sampling_named(cheapest_method(Operation::ssao, tile, most).method);
    return options;
}

DofOptions chosen(const Tile& tile, DofOptions options) {
    const double most = std::get<MaxError>(options.quality).value;
    options.quality = quality_named(cheapest_method(Operation::dof, tile, most).method).value();
    return options;
}

NormalsOptions chosen(const Tile& tile, NormalsOptions options) {
    const double most = std::get<MaxError>(options.method).value;
    options.method =
        named<NormalMethod>(cheapest_method(Operation::normals, tile, most).method,
                            {{"neighbours", NormalMethod::neighbours}, {"least squares", NormalMethod::least_squares}})
            .value();
    return options;
}

} // namespace fathom
