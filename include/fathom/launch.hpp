#pragma once

#include <fathom/device.hpp>

#include <vector>

namespace fathom {

/// How an operation takes its place among other work on the device: the last parameter of every operation.
///
/// An operation starts its kernels and returns. Only `dof` waits in between, for its first kernels and so for the events in
/// `wait`. An operation that throws has waited for all that it started.
/// Throws: std::invalid_argument for a queue that is not the device's own; Error for an event that failed.
struct Launch {
    cl_command_queue queue = nullptr; ///< null or the device's own queue; any other is refused
    std::vector<cl_event> wait = {};  ///< the operation's first kernel starts after these
    cl_event* event = nullptr; ///< if given, an event that completes with the last kernel; the caller releases it
};

} // namespace fathom
