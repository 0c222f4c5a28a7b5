#pragma once

#include "each_depth.hpp"
#include "relative.hpp"

#include "doubts/look.hpp"
#include "io/formats.hpp"
#include "operations/invalid_value.hpp"
#include "shot/record.hpp"

#include <fathom/device.hpp>
#include <fathom/import_camera.hpp>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <future>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace fathom::cli {

/// Seconds that the steps of an input took. It waits between them, which does not count.
struct Times {
    double read = 0, compute = 0, write = 0;

    double whole() const { return read + compute + write; }
};

/// Adds the seconds of its own life.
class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What the depth holds, for the line about a result and for --json.
struct Held {
    std::string channel, words;
    nlohmann::ordered_json members;
};

/// What `make` gives or throws, for whoever asks later.
template <typename Make>
auto later(Make make) {
    std::packaged_task<decltype(make())()> task(std::move(make));
    task();
    return task.get_future().share();
}

/// What was read of an input. The images in it go when the input is computed.
struct ReadInput {
    DepthFile depth{{}, Storage::float32, {}};
    std::optional<InvalidValue> invalid;   ///< of pixels that do not count, if there may be some
    std::optional<RelativeDepth> relative; ///< all but its depth
    ImportedCamera camera;
    Camera seen;                          ///< by the pixels
    std::optional<cv::Size> picture_size; ///< if it is another than the depth's
    std::vector<std::string> channel_doubts;
    std::shared_future<std::vector<std::string>> option_doubts;
};

/// What was found in it. It goes when the input is computed.
struct Examined {
    StoredDepth stored;
    cv::Mat z;     ///< what it decodes to
    cv::Mat small; ///< the depth before it was brought to the picture's size
    Subject subject;
    std::vector<std::string> value_doubts, camera_doubts;
};

/// An input between the steps, and its results until they are written and told.
struct Work {
    Loaded frame;
    Times times;
    bool loaded = false;
    bool kept = false;                            ///< Do the results lie there already?
    std::optional<nlohmann::ordered_json> record; ///< of a run with records
    ReadInput read;
    std::optional<Examined> examined;
    Held held;
    bool doubtful_values = false;
    std::optional<ExrSource> source;
    Windows windows; ///< of the results
    std::vector<Result> results;
    io::Bytes raw = {}; ///< of the result that goes to standard output
};

/// In full floats 65504 is the sky only where nothing lies beyond it.
void settle_sky(Camera& camera, const cv::Mat& values);

/// The steps of an input. Only `compute` goes from input to input in order; the others see nothing but their own.
/// `apart`: the device waits while files are read.
class Steps {
public:
    Steps(const DepthOptions& options, const std::vector<Output>& outputs, const More& more,
          const Operation& operation);

    /// The part of `read` that needs no device: may come before it, without records.
    void load(Work& work) const;

    /// What all other steps need.
    void use(const Device& device, bool apart);

    void read(Work& work) const;
    void compute(Work& work);
    void write(Work& work) const;

    /// The bytes of the images that an input holds until it is written: of what was read, of its results and of their files.
    std::size_t bytes(const Work& work) const;

private:
    bool is_relative() const { return options_.relative.order.has_value(); }
    ReadOptions read_options(const Work& work) const;
    void find_invalid_value(Work& work) const;
    void ignore(Work& work) const;
    std::optional<cv::Size> picture_size(const Work& work) const;
    void bring_up(Work& work) const;
    void keep_valid(Work& work) const;
    void examine(Work& work) const;
    void find_doubts(Work& work) const;
    bool is_finished(Work& work) const;
    void check_append(const Work& work) const;
    void warn(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) const;
    bool warn_once(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said);

    const DepthOptions& options_;
    const std::vector<Output>& outputs_;
    const More& more_;
    const Operation& operation_;
    Device device_;
    bool apart_ = false;
    std::optional<Records> records_;
    std::set<std::string> told_; // warnings that are no input's own
};

} // namespace fathom::cli
