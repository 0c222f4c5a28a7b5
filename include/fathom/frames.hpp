#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>

/// Many frames in a row: while one is computed, the next are read and the last are written.
namespace fathom {
#pragma GCC visibility push(default)

/// What `for_each_frame` may take.
struct FrameOptions {
    /// Frames that are read at the same time, and frames that are written, beside the one that is computed; 0: as many as there
    /// are cores. Codecs have threads of their own (see `set_exr_threads`).
    int threads = 0;
    /// Is nothing read or written while a frame is computed? Then as many frames as `threads` are read and written at the same
    /// time, and computed one after the other. Where the device and the codecs keep to that number, too, no more threads work.
    bool apart = false;
    /// Bytes that all frames in work may hold, as `FrameSteps::bytes` has it for the first of them; 0: a quarter of the
    /// memory of the machine, or of its control group's limit. One frame is always in work.
    std::size_t memory = 0;
    /// Asked before a frame is read. Once it says true no more frames begin; those in work are finished.
    std::function<bool()> stop = {};
};

/// What is done with a frame. A step that throws ends its frame, and no other: `report` gets the exception.
/// `Frame` is made by its default constructor before `read` and destroyed after `report`.
template <typename Frame>
struct FrameSteps {
    std::function<void(std::size_t index, Frame&)> read = {};    ///< several frames at the same time, in any order
    std::function<void(std::size_t index, Frame&)> compute = {}; ///< one frame at a time, in order
    std::function<void(std::size_t index, Frame&)> write = {};   ///< several frames at the same time, in any order
    /// Every frame, one at a time, in order; `failure` is null where all steps were done. What it throws ends all work, and
    /// `for_each_frame` throws it.
    std::function<void(std::size_t index, Frame&, const std::exception_ptr& failure)> report = {};
    /// Bytes that a frame holds until it is written, asked after it was read. Not given: 1, so that memory sets no limit.
    std::function<std::size_t(const Frame&)> bytes = {};
};

/// The same without the type of the frames.
struct ErasedFrameSteps {
    std::function<std::shared_ptr<void>()> make;
    std::function<void(std::size_t, void*)> read, compute, write;
    std::function<void(std::size_t, void*, const std::exception_ptr&)> report;
    std::function<std::size_t(const void*)> bytes;
};
std::size_t for_each_erased_frame(std::size_t count, const ErasedFrameSteps& steps, const FrameOptions& options);

/// Takes frames 0 to `count` - 1 through the steps, and overlaps the steps of different frames. Gives the number of frames that
/// were begun: `count`, unless `FrameOptions::stop` ended it.
///
/// Steps may run in any thread, also `compute`. A step may call `for_each_frame` itself. A single frame stays in the calling
/// thread.
///
///     struct Frame { fathom::DepthFile depth; cv::Mat z; };
///     fathom::for_each_frame<Frame>(files.size(), {
///         .read = [&](std::size_t i, Frame& frame) { frame.depth = fathom::read_depth(files[i]); },
///         .compute = [&](std::size_t, Frame& frame) { fathom::linearize(device, frame.depth.values, camera, frame.z); },
///         .write = [&](std::size_t i, Frame& frame) { fathom::write_image(results[i], frame.z); },
///         .report = [&](std::size_t i, Frame&, const std::exception_ptr& failure) { failed[i] = failure != nullptr; },
///         .bytes = [](const Frame& frame) { return 3 * frame.depth.values.total() * sizeof(float); },
///     });
///
/// Throws: what `report` throws.
/// Source: oneTBB's parallel_pipeline, <https://oneapi-src.github.io/oneTBB>.
template <typename Frame>
std::size_t for_each_frame(std::size_t count, const FrameSteps<Frame>& steps, const FrameOptions& options = {}) {
    const auto step = [](const std::function<void(std::size_t, Frame&)>& given) {
        return [&given](std::size_t index, void* frame) {
            if (given)
                given(index, *static_cast<Frame*>(frame));
        };
    };
    return for_each_erased_frame(count,
                                 {.make = [] { return std::make_shared<Frame>(); },
                                  .read = step(steps.read),
                                  .compute = step(steps.compute),
                                  .write = step(steps.write),
                                  .report =
                                      [&](std::size_t index, void* frame, const std::exception_ptr& failure) {
                                          if (steps.report)
                                              steps.report(index, *static_cast<Frame*>(frame), failure);
                                      },
                                  .bytes =
                                      [&](const void* frame) {
                                          return steps.bytes ? steps.bytes(*static_cast<const Frame*>(frame))
                                                             : std::size_t{1};
                                      }},
                                 options);
}

#pragma GCC visibility pop
} // namespace fathom
