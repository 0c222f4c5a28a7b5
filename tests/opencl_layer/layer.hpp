#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// An OpenCL layer (cl_khr_icd's clInitLayer) between the loader and the drivers: it counts calls, makes one of them fail and
/// keeps account of what the program holds. The loader takes it from the environment: OPENCL_LAYERS=path of this library.
/// A test links with it too, so that both have the same copy.
///
/// For a program that does not link with it, FATHOM_LAYER_FAILS="POINT CODE once" (or always) says what fails and with which
/// error, and FATHOM_LAYER_POINTS names a file for the list of points. With FATHOM_LAYER_CRASHES=TEXT a compiler aborts over options
/// that hold the text, as LLVM does; with FATHOM_LAYER_CRASHES_AT=start when a kernel starts.
///
/// Building the same source with the same options in the same context again takes no time: its kernels are made from the
/// program that was built first. So a thousand new devices of one context cost no more than one.
namespace layer {

/// Has the loader loaded this library?
bool loaded();

/// Counts from here on: calls, host waits and points of failure. No call fails.
void reset();

/// Calls of this function since `reset`.
int calls(std::string_view function);

/// Waits of the host since `reset`: clFinish, clWaitForEvents and blocking reads, writes and maps.
int host_waits();

/// The calls since `reset` that could have failed, in their order.
std::vector<std::string> points();

enum class Failure {
    once,      ///< only this call fails
    from_here, ///< this call and all that follow fail, as those to a lost device do
};

/// As `reset`, but the point of this number (from 0) returns an error. Waits that fail have waited nevertheless.
void fail(std::size_t point, Failure failure);

/// References to OpenCL's objects that the program holds: made or retained, and not yet released. "2 clCreateBuffer, 1 event".
std::string held();

/// From here on this buffer (cl_mem) says that it has so many bytes.
void claim(const void* buffer, std::size_t bytes);

/// Commands that were started and that nothing has waited for since.
int unfinished();

/// Under AddressSanitizer: what was wrong with memory that commands used, at a wait for them. Empty if nothing was.
std::string freed_too_early();

} // namespace layer
