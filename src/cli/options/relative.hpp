#pragma once

#include "lens.hpp"

#include "io/relative_input.hpp"
#include "shot/plan.hpp"

#include <fathom/image.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <string>

namespace fathom::cli {

/// Adds --relative and what goes with it, after the options of the depth and the lens. --focus-at is the lens's.
void add_relative_options(CLI::App& app, RelativeOptions& relative);

/// Refuses relative depth without a blur or a focus.
/// Throws: UsageError.
void check_relative(const RelativeOptions& relative, const LensArguments& lens);

/// The circle of relative depth, for a focus at a pixel or for the range that is in focus; the lens's otherwise.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_of(const RelativeOptions& relative, const LensArguments& lens, const StoredDepth& stored,
                            const Job& job);

/// No circle of an image that shows this is wider, in pixels. The focus lies at no pixel.
double widest_circle(const LensArguments& lens, const Tile& image, const Look& look, Sky sky, const Job& job);

/// What is probably wrong with it for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> blur_doubts(const RelativeOptions& relative, const LensArguments& lens,
                                     const StoredDepth& stored, const Job& job, const Subject& subject, Sky sky,
                                     double max_coc_px);

} // namespace fathom::cli
