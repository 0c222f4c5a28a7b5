#pragma once

#include "lens.hpp"

#include "io/relative_input.hpp"
#include "shot/plan.hpp"

#include <fathom/image.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <string>

namespace fathom::cli {

/// Says what goes with --relative, after the options of the depth and the lens.
void add_relative_options(CLI::App& app);

/// Takes what is read of relative depth from the lens, and what the lens lacks from the camera. Refuses relative depth without a
/// blur or a focus, and a lens that is still incomplete or impossible.
/// Throws: UsageError, and Error for the camera file.
void complete(LensArguments& lens, RelativeSource& relative, const CameraOption& camera);

/// The circle of an input, whose own camera may complete the lens.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_of(const LensArguments& lens, const StoredDepth& stored, const Job& job);

/// What is probably wrong with it for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> blur_doubts(const LensArguments& lens, const StoredDepth& stored, const Job& job,
                                     const Subject& subject, Sky sky, double max_coc_px);

} // namespace fathom::cli
