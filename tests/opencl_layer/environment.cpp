#include <cstdlib>

namespace {
// Before the first call of OpenCL, which reads both: the layer, and two devices, of which each has to build its programs.
const bool is_set = setenv("OPENCL_LAYERS", FATHOM_LAYER, 1) == 0 && setenv("POCL_DEVICES", "pthread pthread", 1) == 0;
} // namespace
