// --max-error and --explain, which ssao, dof and normals share.
#include "max_error.hpp"

#include "depth_options.hpp"

#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <stdexcept>

namespace fathom::cli {

void add_explain(CLI::App& app, bool& explain, const std::string& group) {
    app.add_flag("--explain", explain, "print on stderr what --max-error chose, and its error")
        ->needs(app.get_option("--max-error"))
        ->group(group);
}

void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame, double max_error,
                    bool explain) {
    MeasuredMethod cheapest;
    try {
        cheapest = cheapest_method(operation, stored, max_error);
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what(), option = "max_error = ";
        throw Error(message.starts_with(option) ? "--max-error " + message.substr(option.size()) : message);
    }
    if (explain)
        frame.said.push_back(fmt::format("{}: {} {}: error up to {} (in the scene {})", frame.input.native(),
                                         fathom::to_string(operation), cheapest.method, number(cheapest.error),
                                         cheapest.scene));
}

} // namespace fathom::cli
