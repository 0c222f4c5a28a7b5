#pragma once

#include "doubts/look.hpp"
#include "shot/camera.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/exr.hpp>
#include <fathom/image.hpp>
#include <fathom/lens_arguments.hpp>

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

/// No circle of an image that shows this is wider, in pixels. It may be infinite.
double widest_coc(const CircleOfConfusion& circle, const Look& look, Sky sky);

/// What is probably wrong with a lens for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> lens_doubts(const LensArguments& lens, const CircleOfConfusion& circle, const Subject& subject,
                                     Sky sky, double max_coc_px);

/// The same of circles that come from no lens. `cure` is what to change.
std::vector<std::string> circle_doubts(const CircleOfConfusion& circle, const Subject& subject, Sky sky,
                                       double max_coc_px, const std::string& cure);

} // namespace fathom::cli
