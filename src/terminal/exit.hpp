#pragma once

#include <stdexcept>

namespace fathom::cli {

/// What the program says to the shell. An interrupt is 128 plus the signal's number: 130 for Ctrl-C.
enum ExitCode : int { done = 0, input_failed = 1, wrong_usage = 2, no_device = 3 };

/// The arguments contradict each other or the files that are there. Nothing was done yet.
class UsageError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

} // namespace fathom::cli
