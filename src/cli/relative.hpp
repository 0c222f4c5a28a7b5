#pragma once

#include "lens.hpp"
#include "outputs.hpp"

#include <fathom/image.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <string>

namespace fathom::cli {

/// Adds --relative and what goes with it, after the options of the depth and the lens. --focus-at is the lens's.
void add_relative_options(CLI::App& app, RelativeOptions& relative);

/// Refuses relative depth without a blur or a focus.
/// Throws: UsageError.
void check_relative(const RelativeOptions& relative, const LensOptions& lens);

/// An input's relative depth, floats from 0 to 1, made smooth, and of the picture's size if there is one.
DepthFile relative_depth(const RelativeOptions& relative, const Job& job, const std::string& channel);

/// The circle for a focus at a pixel, or for the range that is in focus.
CircleOfConfusion relative_circle_for(const RelativeOptions& relative, const StoredDepth& stored,
                                      const LensOptions& lens);

} // namespace fathom::cli
