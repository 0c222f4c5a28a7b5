#pragma once

#include "runtime/compiler.hpp"
#include "terminal/messages.hpp"

#include <fathom/device.hpp>

#include <cstddef>
#include <shared_mutex>
#include <string>

namespace fathom::cli {

/// Where the work is done.
struct DeviceOption {
    std::string wanted; ///< cpu, gpu, an index or a part of a name; empty: the default
    int threads = 0;    ///< of a CPU device; 0: as many as it likes

    /// Tells the driver and the codecs of the threads, and the heap of the memory, before either begins, and starts the process
    /// that compiles. The number of threads counts from the first time only, as it does for the driver.
    void prepare(std::size_t memory = 0) const;

    /// Opens the device, whose operations may take so many bytes beside their images, or 64 MiB if that is more; 0: what is
    /// fastest.
    Device open(std::size_t memory = 0) const;

    /// Do files and the device take turns, so that no more threads work at once? Where they may have all cores, these are the
    /// limit.
    bool takes_turns(const Device& opened) const;

    /// Gives the threads to so many files at once.
    void share_among(std::size_t files) const;
};

/// Held while a device's vector width is used, and alone while it changes.
std::shared_mutex& vector_widths();

/// Runs work on a device. Where PoCL's compiler crashes on a kernel, a warning says so, and the work runs again with another vector
/// width.
/// Throws: NoDevice where it crashes for each of them.
template <typename Action>
auto at_any_width(const Device& device, const Action& action) {
    for (std::string said;;) {
        try {
            const std::shared_lock lock(vector_widths());
            auto result = action();
            if (!said.empty())
                complain("warning: " + said);
            return result;
        } catch (const runtime::CompilerCrashed& crashed) {
            const std::unique_lock lock(vector_widths());
            said = runtime::take_another_width(device, crashed);
        }
    }
}

} // namespace fathom::cli
