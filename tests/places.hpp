#pragma once

/// Where the sources lie and what this build has made. Only places.cpp knows it, so that other builds can link the tests.
namespace fathom::test::places {

extern const char *const sources, *const shared_data;
extern const char *const program, *const failing_malloc; // empty without fathom_io
extern const char* const layer;                          // between OpenCL's loader and its drivers: tests/opencl_layer
extern const bool sanitized;                             // under AddressSanitizer memory has other sizes

} // namespace fathom::test::places
