#pragma once

#include "plan.hpp"

#include "io/formats.hpp"

#include <opencv2/core/types.hpp>

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

/// Pipes: raw frames of one size, one after the other without anything between them, as ffmpeg's rawvideo has them.
namespace fathom::shot {

/// A frame of a pipe as a file in memory, which is read like any other.
class FrameFile {
public:
    /// Throws: Error where there is no memory for it.
    FrameFile(std::string name, const io::RawFormat& format, cv::Size size);
    ~FrameFile();
    FrameFile(const FrameFile&) = delete;
    FrameFile& operator=(const FrameFile&) = delete;

    const std::string& name() const { return name_; } ///< for messages
    std::filesystem::path path() const;

    /// Where its pixels belong.
    std::span<unsigned char> pixels() const { return pixels_; }

private:
    std::string name_;
    int number_;
    void* mapped_ = nullptr;
    std::size_t bytes_ = 0;
    std::span<unsigned char> pixels_;
};

/// The pipes that a run reads: that of the depth, of a companion, or both.
class Pipes {
public:
    /// Throws: UsageError for a pipe that is no place for what it stands for, and for frames of which nobody knows the size.
    explicit Pipes(const DepthOptions& options);
    ~Pipes();

    bool any() const { return !sources_.empty(); }
    bool of_depth() const { return of_depth_; }

    /// Throws: Error for a pipe that cannot be opened.
    void open();

    /// Waits for the next frame of each pipe, all at once. False where they have ended, together or not, and after `stop`.
    bool next();

    /// No more frames are waited for.
    void stop() { stopped_ = true; }

    /// What the job reads of pipes becomes the frame that came so many frames after the first one.
    void give(std::size_t frame, Job& job);

    /// Throws: Error for a pipe that has ended within a frame or before another one has, and for one that has more than `expected`
    /// frames, if there are pipes of companions alone.
    void check_end(std::size_t expected);

private:
    struct Source;
    using Frame = std::vector<std::shared_ptr<FrameFile>>; // one of each source

    cv::Size size_;
    bool of_depth_ = false;
    std::vector<std::unique_ptr<Source>> sources_;
    std::size_t count_ = 0; // of frames that have come
    std::string failure_;
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
    std::map<std::size_t, Frame> waiting_; // that no job has taken
};

/// How the result of -o - is written.
/// Throws: UsageError for one that no format holds, or not the one that was asked for.
const io::RawFormat& result_format(const DepthOptions& options);

} // namespace fathom::shot
