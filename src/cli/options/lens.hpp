#pragma once

#include "doubts/lengths.hpp"
#include "io/relative_input.hpp"
#include "shot/options.hpp"
#include "shot/plan.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/exr.hpp>
#include <fathom/image.hpp>
#include <fathom/lens_arguments.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <string>

namespace CLI {
class App;
}

namespace fathom::cli {

void add_lens_options(CLI::App& app, LensArguments& lens);

/// Takes what is not given from the camera, and refuses a lens that is still incomplete or impossible. Where each input has a
/// camera of its own, that waits until it is read.
/// Throws: UsageError, and Error for the camera file.
void complete(LensArguments& lens, const CameraOption& camera);

/// The same with the camera of a file of this name.
void complete(LensArguments& lens, const CameraFile& camera, const std::string& name);

/// The circle of confusion of this lens for this image. The image gives the focus if the lens focuses on a pixel. Pixels are
/// counted in the display window, which the sensor has, too.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_for(const LensArguments& lens, const StoredDepth& stored, const Windows& windows);

/// The depth of the surface at --focus-at.
/// Throws: Error for a pixel outside the image, or without depth.
double depth_under(const LensArguments::Pixel& pixel, const StoredDepth& stored, const Windows& windows);

/// How messages name the program's options, and the camera.
LensWords lens_words(const std::string& camera = "the camera");

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
