// --max-error and --explain, which ssao, dof and normals share.
#include "max_error.hpp"

#include "messages.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <stdexcept>

namespace fathom::cli {

void add_max_error(CLI::App& app, std::optional<double>& max_error, bool& explain, const std::string& unit,
                   const std::vector<std::string>& chosen, const std::string& group) {
    CLI::Option* option =
        app.add_option("--max-error", max_error,
                       "instead of " + CLI::detail::join(chosen, ", ") +
                           ":\nthe fastest method with error up to E in every scene\nof docs/performance.md (" + unit +
                           ")")
            ->type_name("E")
            ->check(is_a_number("number above 0", [](double e) { return e > 0; }))
            ->group(group);
    for (const std::string& name : chosen)
        option->excludes(name);
    app.add_flag("--explain", explain, "print on stderr what --max-error chose, its error and its time")
        ->needs(option)
        ->group(group);
}

void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame,
                    std::optional<double> max_error, bool explain) {
    if (!max_error)
        return;
    MeasuredMethod cheapest;
    try {
        cheapest = cheapest_method(operation, stored, *max_error);
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what(), option = "max_error = ";
        throw Error(message.starts_with(option) ? "--max-error " + message.substr(option.size()) : message);
    }
    if (explain)
        frame.said.push_back(
            fmt::format("{}: {} {}: error up to {} (in the scene {}), {:.3g} ns per pixel at 1920 × 1080 (all "
                        "threads of {})",
                        frame.input.native(), fathom::to_string(operation), cheapest.method, number(cheapest.error),
                        cheapest.scene, cheapest.ns_per_pixel, cheapest.device));
}

} // namespace fathom::cli
