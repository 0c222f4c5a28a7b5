#pragma once

#include "shot.hpp"

#include "io/relative_input.hpp"
#include "io/replace_files.hpp"
#include "operations/invalid_value.hpp"

#include <atomic>
#include <exception>
#include <fstream>
#include <mutex>

/// The steps of `each_depth`: what is read, written and told of an input.
namespace fathom::shot {

/// Seconds that the steps of an input took. It waits between them, which does not count.
struct Times {
    double read = 0, compute = 0, write = 0;

    double whole() const { return read + compute + write; }
};

/// What was found in an input. It goes when the input is computed.
struct Examined {
    StoredDepth stored;
    cv::Mat z;     ///< what it decodes to
    cv::Mat small; ///< the depth before it was brought to the picture's size
    Look look;
    Subject subject;
    std::vector<std::string> value_doubts, camera_doubts;
};

/// An input between the steps, and its results until they are written and told.
struct Work {
    Job frame;
    Times times;
    bool kept = false;             ///< Do the results lie there already?
    nlohmann::ordered_json record; ///< of a run with records

    DepthFile depth{{}, Storage::float32, {}}; ///< whose image goes when it is computed
    std::optional<InvalidValue> invalid;       ///< of pixels that do not count, if there may be some
    Camera seen;                               ///< by the pixels
    std::optional<cv::Size> picture_size;      ///< if it is another than the depth's
    std::vector<std::string> channel_doubts, relative_doubts;
    std::shared_future<std::vector<std::string>> option_doubts;

    std::optional<Examined> examined;
    std::string depth_channel, depth_words; ///< for the line about a result
    nlohmann::ordered_json depth_members;   ///< for --json
    bool is_sampled = false;                ///< is its depth judged by some pixels?
    bool doubtful_values = false;
    std::optional<ExrSource> source;
    Windows windows; ///< of the results
    std::vector<Made> results;
    io::Bytes raw = {}; ///< of the result that goes to standard output
};

/// Gives each job of relative depth the range of the floats of its whole shot, which is read for it unless it is given, so that a
/// frame does not depend on which frames are done with it. Files that cannot be read do not count. Says the ranges in words, a line
/// for each shot.
/// Throws: Interrupted.
std::vector<std::string> find_ranges(const DepthOptions& options, std::vector<Job>& jobs);

/// What --ignore leaves out of relative depth, by the mask of an input.
io::Ignored ignored_of(const DepthOptions& options, const std::filesystem::path& mask);

/// The image that a camera file is of: the depth, or its picture, which sees the same in other pixels; or the results, which have so
/// many times fewer pixels each way, unless the file says the frame's own size.
cv::Size size_for(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture,
                  int supersampled);

/// The camera of the pixels that were read.
/// Throws: Error for one of another size.
Camera camera_of(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture,
                 int supersampled);

/// Throws: Error where squares of pixels do not fill the windows of a frame.
void check_squares(const std::filesystem::path& file, const Windows& windows, int factor);

/// Names that other programs know, beside a result's own in an EXR: a channel Y, which Blender and OpenCV open as a grey picture;
/// or channels of a layer "Fathom" that Blender lists among others, each called layer.pass.letter.
std::vector<std::string> known_names(std::vector<std::string> channels, bool append);

/// Finds the EXR whose header the results keep: that of the picture they are made of, or that of the depth. And their windows: those
/// of the depth, or less where the picture that they are made of has fewer pixels.
void find_source(const DepthOptions& options, Work& work);

/// What makes the results of each frame: a line of JSON beside the first of them, OUT.fathom.json, with the sizes and times of all
/// files. A frame whose line says what a run finds need not be made again.
class Records {
public:
    /// Options are those of the command line now, before a frame has changed the animated ones.
    Records(const DepthOptions& options, const Device& device);

    /// All that makes the results of a frame, before they are made.
    nlohmann::ordered_json of(const Job& job) const;

    /// Are all results of the frame those that were made of this?
    bool is_finished(const nlohmann::ordered_json& record, const Job& job) const;

    /// The file with the line, of what the results will be.
    io::LastFile file_of(const nlohmann::ordered_json& record, const Job& job) const;

private:
    const DepthOptions& options_;
    nlohmann::ordered_json common_; ///< of all frames
};

/// Says what is probably wrong with a file of an input.
/// Throws: Error where that is to count as one.
void warn(const DepthOptions& options, Work& work, const std::filesystem::path& subject,
          const std::vector<std::string>& said);

/// Writes what was made of an input: all images and the record, if there is one, or none.
/// Throws: Error.
void write_results(const DepthOptions& options, const Records* records, Work& work);

/// What is said on stdout, which a log there has for itself.
/// Throws: UsageError where two kinds of lines are to stand there.
Report report_of(const DepthOptions& options);

/// A line of JSON for an input that failed, if such lines are wanted.
void announce_failure(Report report, const Job& job, const std::string& error);

/// Tells how a run goes: lines on stdout, errors and a bar on stderr, and the log. The latter has lines of JSON, each one write, so
/// that several runs and processes may append to it; "-" is stdout.
class Telling {
public:
    /// Begins the log, and says for people what holds for all jobs. An empty log would say of no run, so that everything that
    /// ends a run comes before.
    /// Throws: Error for a log that cannot be written, or that holds something else.
    Telling(const DepthOptions& options, Report said, const std::vector<Job>& jobs, const Device& device,
            const std::vector<std::string>& lines);

    /// One of the jobs is done or left out, and so are all before it.
    void tell(const Work& work, const std::exception_ptr& failure);

    /// Names the inputs that failed, once no more will. Gives whether everything was done and told.
    bool sum_up();

private:
    void log(const nlohmann::ordered_json& line);
    void tell_left_out(const Job& job);

    const DepthOptions& options_;
    Report said_;
    std::size_t count_; // that are not left out
    std::ofstream log_;
    bool is_log_complete_ = true; // has every line been written?
    Progress progress_;
    std::vector<std::string> failed_;
};

/// The pipes that a run reads: that of the depth, of a companion, or both. They have raw frames of one size, one after the other
/// without anything between them, as ffmpeg's rawvideo.
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
