#pragma once

#include <fathom/launch.hpp>

namespace fathom::runtime {

/// The time in which an operation starts its kernels. If an exception ends it, the queue is finished first, so that no kernel
/// uses memory that is about to go. Declare it after whatever kernels read from the host, and before the first kernel.
class Launched {
public:
    /// What follows waits for `launch.wait`.
    /// Throws: std::invalid_argument for a queue that is not the device's own.
    explicit Launched(const Device& device, const Launch& launch = {});
    ~Launched();
    Launched(const Launched&) = delete;
    Launched& operator=(const Launched&) = delete;

    /// Everything is started: makes `launch.event`, if it is wanted.
    void done() const;

private:
    Device device_;
    cl_event* event_;
    int exceptions_; // in flight when this began
};

} // namespace fathom::runtime
