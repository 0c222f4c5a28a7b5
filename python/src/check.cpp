// fathom.check: what is probably wrong with a camera and its depth.
#include "bindings.hpp"

#include "call.hpp"
#include "unlocked.hpp"

#include <fathom/doubts.hpp>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

namespace fathom::python {
namespace {

std::vector<std::string> check(const Pixels& depth, const CameraObject& camera, const Word<Storage>& storage) {
    const HeldDepth held = host_depth(depth, camera, storage, "depth");
    const Camera seen = camera.of_size(held.stored.width, held.stored.height);
    std::vector<std::string> said = camera.key_doubts(seen.width, seen.height);
    const Unlocked released;
    for (const std::string& doubt : depth_doubts(seen, held.stored))
        said.push_back(in_python(doubt));
    return said;
}

} // namespace

void bind_check(nb::module_& module) {
    module.def(
        "check", check, nb::arg("depth"), nb::arg("camera"), nb::kw_only(), nb::arg("storage") = nb::none(),
        R"(What is probably wrong with the camera for this depth: a sentence each, with the cure. Needs no device.

depth, storage: as for linearize. All pixels count: about 50 ms for 1920 x 1080. The first call of an operation with a
camera looks at a sample of its depth, in at most a millisecond, and warns (CameraWarning) of the same.

Returns a list of str, empty if nothing looks wrong. Raises ValueError and fathom.Error as linearize does.)");
}

} // namespace fathom::python
