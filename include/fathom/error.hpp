#pragma once

#include <stdexcept>
#include <string>

namespace fathom {
#pragma GCC visibility push(default)

/// A failure of the device, its driver or a file.
/// Options out of range are `std::invalid_argument` instead, naming the option, the value and the range.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// No OpenCL device answers to what was asked for. The message lists the devices that are there.
class NoDevice : public Error {
public:
    using Error::Error;
};

/// An image has more pixels than an operation can take. The message names its size.
class ImageTooLarge : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

#pragma GCC visibility pop
} // namespace fathom
