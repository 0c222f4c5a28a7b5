#pragma once

#include "depth_options.hpp"

#include "doubts/look.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/image.hpp>
#include <fathom/lens.hpp>

#include <optional>
#include <string>

namespace fathom::cli {

/// A lens as the arguments and the camera file give it.
struct LensOptions {
    struct Pixel {
        int x, y;
    };
    struct AlongRay {
        Pixel pixel;
        double distance;
    };
    std::optional<double> focus; ///< z, scene units
    std::optional<Pixel> focus_at;
    std::optional<AlongRay> focus_along;
    std::optional<double> f_stop, focal_length_mm, sensor_mm;
    double mm_per_unit = 1000;
    std::optional<std::array<double, 2>> circle; ///< k and g, instead of all of these
};

void add_lens_options(CLI::App& app, LensOptions& lens);

/// Takes what is not given from the camera, and refuses a lens that is still incomplete or impossible. Where each input has a
/// camera of its own, that waits until it is read.
/// Throws: UsageError, and Error for the camera file.
void complete(LensOptions& lens, const CameraOption& camera);

/// The same with the camera of a file of this name.
void complete(LensOptions& lens, const CameraFile& camera, const std::string& name);

/// The circle of confusion of this lens for this image. The image gives the focus if the lens focuses on a pixel. Pixels are
/// counted in the display window, which the sensor has, too.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_for(const LensOptions& lens, const StoredDepth& stored, const Windows& windows);

/// What is probably wrong with a lens for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> lens_doubts(const LensOptions& lens, const CircleOfConfusion& circle, const Look& look,
                                     Sky sky, double max_coc_px);

/// The same of circles that come from no lens. `cure` is what to change.
std::vector<std::string> circle_doubts(const CircleOfConfusion& circle, const Look& look, Sky sky, double max_coc_px,
                                       const std::string& cure);

} // namespace fathom::cli
