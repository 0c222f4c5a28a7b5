#pragma once

#include "doubts/look.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/lens_arguments.hpp>

#include <string>
#include <vector>

namespace fathom {

/// No circle of an image that shows this is wider, in pixels. It may be infinite.
double widest_shown(const CircleOfConfusion& circle, const Look& look, Sky sky);

/// What is probably wrong with a radius of ambient occlusion for an image.
std::vector<std::string> radius_doubts(const Subject& subject, double radius);

/// The same of a lens. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> lens_doubts(const Subject& subject, const LensArguments& lens, const CircleOfConfusion& circle,
                                     Sky sky, double max_coc_px, const LensWords& words);

/// The same of circles that come from no lens. `cure` is what to change.
std::vector<std::string> circle_doubts(const Subject& subject, const CircleOfConfusion& circle, Sky sky,
                                       double max_coc_px, const std::string& cure, const LensWords& words);

} // namespace fathom
