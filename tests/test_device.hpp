#pragma once

#include "fathom/device.hpp"

#include <cstdlib>

/// The device that the operations' tests run on: the one that FATHOM_TEST_DEVICE names, such as `gpu`, or else the CPU.
inline fathom::Device test_device(fathom::DeviceOptions options = {}) {
    const char* const wanted = std::getenv("FATHOM_TEST_DEVICE");
    return fathom::Device::open(wanted ? wanted : "cpu", options);
}
