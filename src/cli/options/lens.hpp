#pragma once

#include "cli/command.hpp"
#include "description/operations.hpp"
#include "doubts/lengths.hpp"
#include "shot/plan.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/lens_arguments.hpp>

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace fathom::cli {

/// Adds the options of the lens, of the circle instead of it, and of relative depth.
void add_lens_options(CLI::App& app, LensArguments& lens, const description::Option& circle);

/// Takes what is read of relative depth from the lens, and what the lens lacks from the camera. Refuses relative depth without a
/// blur or a focus, and a lens that is still incomplete or impossible. Where each input has a camera of its own, that waits until
/// it is read.
/// Throws: UsageError, and Error for the camera file.
void complete(LensArguments& lens, RelativeSource& relative, const CameraOption& camera);

/// The circle of an input, whose own camera may complete the lens, and whose image gives the focus if the lens focuses on a pixel.
/// Pixels are counted in the display window, which the sensor has, too.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_of(const LensArguments& lens, const StoredDepth& stored, const Job& job);

/// What is probably wrong with it for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> blur_doubts(const LensArguments& lens, const StoredDepth& stored, const Job& job,
                                     const Subject& subject, Sky sky, double max_coc_px);

} // namespace fathom::cli
