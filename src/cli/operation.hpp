#pragma once

#include "description/operations.hpp"
#include "shot/each_depth.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/image.hpp>
#include <fathom/quality.hpp>

#include <functional>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

/// The file that a result of an operation goes to.
Product product_of(const description::Operation& operation, const description::Result& result);

/// The results beside the first one that go to files, by their names. They are asked of the call.
std::vector<Output> outputs_of(const description::Operation& operation, void* call,
                               const std::map<std::string, std::string>& files);

/// Runs a call, and gives its results: the first, and those of `outputs_of`.
std::vector<Result> run(const description::Operation& operation, void* call, const StoredDepth& stored,
                        const Loaded& frame);

/// The command of an operation as it is described, whose only image beside the depth is a picture.
std::function<int()> configure_operation(CLI::App& app, const description::Operation& operation);

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
