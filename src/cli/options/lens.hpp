#pragma once

#include "doubts/lengths.hpp"
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

/// The depth of the surface at --focus-at.
/// Throws: Error for a pixel outside the image, or without depth.
double depth_under(const LensArguments::Pixel& pixel, const StoredDepth& stored, const Windows& windows);

/// How messages name the program's options, and the camera.
LensWords lens_words(const std::string& camera = "the camera");

} // namespace fathom::cli
