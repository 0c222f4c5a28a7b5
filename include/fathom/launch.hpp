#pragma once

#include <fathom/device.hpp>

#include <vector>

namespace fathom {
#pragma GCC visibility push(default)

/// How an operation takes its place among other work on the device: the last parameter of every operation.
///
/// An operation starts its kernels and returns. Only `dof`, and `ssao` through a lens, wait in between, for their first
/// kernels and so for the events in `wait`. An operation that throws has waited for all that was started in its queue. If that hangs on a user event, another
/// thread has to set it.
/// Throws: std::invalid_argument for a queue that is not the device's own, and for an event that is null or of another context;
/// Error for an event that has failed. What becomes of one that fails later is the driver's choice: PoCL ends the process.
struct Launch {
    cl_command_queue queue = nullptr; ///< null or the device's own queue; any other is refused
    std::vector<cl_event> wait = {};  ///< the operation's first kernel starts after these
    cl_event* event = nullptr; ///< if given, an event that completes with the last kernel; the caller releases it
};

#pragma GCC visibility pop
} // namespace fathom
