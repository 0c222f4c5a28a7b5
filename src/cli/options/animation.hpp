#pragma once

#include "shot/options.hpp"

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

/// Adds --animate NAME=FILE and --interpolate. Every value of the file is parsed and checked as the option itself does it, and the first one
/// stays, so that what depends on the option can be checked before a frame is read.
void add_animate_options(CLI::App& app, DepthOptions& options);

} // namespace fathom::cli
