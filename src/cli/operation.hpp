#pragma once

#include "description/operations.hpp"
#include "shot/each_depth.hpp"

#include <functional>
#include <map>
#include <string>
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

} // namespace fathom::cli
