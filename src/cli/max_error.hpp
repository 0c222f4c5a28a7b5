#pragma once

#include "each_depth.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/image.hpp>
#include <fathom/quality.hpp>

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace fathom::cli {

/// Adds --max-error, which the options named `chosen` contradict, and --explain. `unit` says what the error is.
void add_max_error(CLI::App& app, std::optional<double>& max_error, bool& explain, const std::string& unit,
                   const std::vector<std::string>& chosen, const std::string& group);

/// The method of an operation: what --max-error chooses, if it is given.
template <typename Method>
std::variant<Method, MaxError> method_or(const std::optional<double>& max_error, const Method& method) {
    if (max_error)
        return MaxError{*max_error};
    return method;
}

/// Checks that some method meets an input's --max-error. On request says on one line of stderr which method that is,
/// its error and its time. Does nothing without --max-error.
/// Throws: Error if no method meets it.
void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame,
                    std::optional<double> max_error, bool explain);

} // namespace fathom::cli
