#pragma once

#include "shot/each_depth.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/image.hpp>
#include <fathom/quality.hpp>

#include <string>
#include <variant>

namespace CLI {
class App;
}

namespace fathom::cli {

/// Adds --explain, which needs --max-error.
void add_explain(CLI::App& app, bool& explain, const std::string& group);

/// Checks that some method meets an input's --max-error. On request says on one line of stderr which method that is,
/// and its error. Does nothing without a MaxError.
/// Throws: Error if no method meets it.
void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame, double max_error,
                    bool explain);

template <typename Method>
void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame,
                    const std::variant<Method, MaxError>& method, bool explain) {
    if (const auto* most = std::get_if<MaxError>(&method))
        explain_method(operation, stored, frame, most->value, explain);
}

} // namespace fathom::cli
