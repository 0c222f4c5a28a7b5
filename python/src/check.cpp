// fathom.check: what is probably wrong with a camera and its depth.
#include "bindings.hpp"

#include "call.hpp"
#include "unlocked.hpp"

#include "description/check.hpp"
#include "description/ssao.hpp"

#include <fathom/dof.hpp>
#include <fathom/doubts.hpp>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

namespace fathom::python {
namespace {

using Length = std::optional<double>;

std::vector<std::string> check(const Pixels& depth, const CameraObject& camera, const Word<Storage>& storage,
                               Length radius, Length focus, Length f_stop, Length focal_length_mm, Length sensor_mm,
                               double mm_per_unit) {
    if (radius) // whatever else is wrong
        description::Check{}("radius", *radius, description::ssao_radius);
    const HeldDepth held = host_depth(depth, camera, storage, "depth");
    const Camera seen = camera.of_size(held.stored.width, held.stored.height);
    std::vector<std::string> said = key_doubts(camera.file().text, seen.width, seen.height);
    LensArguments lens{.focus = focus,
                       .f_stop = f_stop,
                       .focal_length_mm = focal_length_mm,
                       .sensor_mm = sensor_mm,
                       .mm_per_unit = mm_per_unit};
    CircleOfConfusion circle;
    const bool has_lens = focus || f_stop || focal_length_mm || sensor_mm;
    if (has_lens) {
        lens = completed(lens, camera.file().lens, seen.projection);
        circle = circle_for(lens, {.image = {}, .camera = seen, .storage = held.stored.storage});
    }
    const Unlocked released;
    for (const std::string& doubt : depth_doubts(seen, held.stored))
        said.push_back(in_python(doubt));
    if (!said.empty())
        return said; // or one mistake would be told twice
    if (radius)
        said = radius_doubts(seen, held.stored, *radius);
    if (has_lens)
        for (const std::string& doubt :
             lens_doubts(seen, held.stored, lens, circle, Sky::blur, DofOptions{}.max_coc_px))
            said.push_back(doubt);
    return said;
}

} // namespace

void bind_check(nb::module_& module) {
    module.def(
        "check", check, nb::arg("depth"), nb::arg("camera"), nb::kw_only(), nb::arg("storage") = nb::none(),
        nb::arg("radius") = nb::none(), nb::arg("focus") = nb::none(), nb::arg("f_stop") = nb::none(),
        nb::arg("focal_length_mm") = nb::none(), nb::arg("sensor_mm") = nb::none(), nb::arg("mm_per_unit") = 1000.0,
        R"(What is probably wrong with the camera for this depth: a sentence each, with the cure. Needs no device.

If nothing is, and a radius of ssao or a lens of dof is given, what is probably wrong with that: it reaches nothing or
everything that the image shows, or counts in another unit. What a lens lacks the camera gives, as for dof.

depth, storage: as for linearize. All pixels count: about 50 ms for 1920 x 1080. The first call of an operation with a
camera looks at a sample of its depth, in at most a millisecond, and warns (CameraWarning) of the same.

Returns a list of str, empty if nothing looks wrong. Raises ValueError and fathom.Error as linearize does.)");
}

} // namespace fathom::python
