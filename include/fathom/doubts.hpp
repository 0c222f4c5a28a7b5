#pragma once

#include <fathom/camera.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/findings.hpp>
#include <fathom/lens_arguments.hpp>

#include <string>
#include <vector>

/// What is probably wrong with what a camera says of stored depth. Needs no device. Target `fathom::camera`.
namespace fathom {
#pragma GCC visibility push(default)

/// What is probably wrong, a sentence each with the cures that help, as the program's warnings have it: millimetres as metres, a depth
/// buffer as distances, a sky as a surface, pixels that are invalid. None where nothing looks wrong. Where no pixel has a
/// depth, the only sentence says why that is likely. A cure is told if the fault is gone with it, and nothing new is found.
///
/// `stored`: depth of the camera's width × height. Flat surfaces tell of a wrong encoding where there are some; docs/inspect.md
/// lists what is told and what nobody can see. Looks at a hundred thousand pixels, spread evenly.
/// Throws: std::invalid_argument for a camera that `depth_form` refuses, and for depth of another size.
std::vector<std::string> depth_doubts(const Camera& camera, const HostDepth& stored);

/// The same of a few thousand pixels and some rows: at most a millisecond for 1920 × 1080 pixels. Ranges and percentages are
/// those of the sample. Looks at all pixels if nothing was measured at these.
std::vector<std::string> depth_doubts_of_sample(const Camera& camera, const HostDepth& stored);

/// What tells whether an image is one like another, about which the same would be said.
struct DepthSketch {
    Storage storage = Storage::float32;
    int width = 0, height = 0;
    double typical = 0; ///< the median of some values that are neither 0 nor infinite; 0 where there is none
};
DepthSketch sketch_of(const HostDepth& stored);

/// Have they the same size and type, and typical values within a factor of 4?
bool are_alike(const DepthSketch& one, const DepthSketch& other);

/// The same of a radius of `ssao`, in scene units: one that hardly reaches the next pixel, or beyond all that the image shows.
/// Throws: std::invalid_argument, as `ssao`, for one that is not above 0 or not finite.
std::vector<std::string> radius_doubts(const Camera& camera, const HostDepth& stored, double radius);

/// The same of a lens and its `circle`, as `circle_for` makes it: metres where a lens has millimetres, a focus before or behind
/// everything, circles that are all smaller than a pixel, or cut off at `max_coc_px`, which may be infinity.
std::vector<std::string> lens_doubts(const Camera& camera, const HostDepth& stored, const LensArguments& lens,
                                     const CircleOfConfusion& circle, Sky sky, double max_coc_px,
                                     const LensWords& words = {});

#pragma GCC visibility pop
} // namespace fathom
