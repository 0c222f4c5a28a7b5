#pragma once

#include "camera_file/file.hpp"
#include "doubts/look.hpp"
#include "io/formats.hpp"
#include "runtime/compiler.hpp"
#include "sequence/frames.hpp"
#include "terminal/terminal.hpp"

#include <fathom/device.hpp>
#include <fathom/image.hpp>
#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <array>
#include <functional>
#include <future>
#include <memory>
#include <shared_mutex>

/// A shot: which images it has, what a task makes of each, and what is said of it.
namespace fathom::shot {

using namespace terminal;
using sequence::Frame;
using terminal::number;

/// A depth image to read.
struct Input {
    std::string file;
    std::optional<Frame> frame = {};        ///< which names of other files may have, too
    std::optional<std::size_t> source = {}; ///< which sequence it is of; none: it was named itself
};

/// The name of standard input, and of standard output.
inline constexpr const char* standard_stream = "-";

/// The end of the names of pictures that `fathom show` made.
inline constexpr const char* show_ending = ".show.png";

/// The end of the name of what --resume writes beside a result.
inline constexpr const char* record_ending = ".fathom.json";

/// The depth images that arguments stand for: files, patterns of names, quoted globs and folders. A file that is there is
/// meant itself, whatever its name looks like.
class Inputs {
public:
    std::vector<std::string> arguments;
    std::optional<std::vector<Frame>> frames; ///< of the patterns; none: those that are there
    bool skip_missing = false;         ///< is a frame left out whose depth, or another file of its own, is not there?
    std::optional<cv::Size> pipe_size; ///< of the raw frames in pipes
    const io::RawFormat* pipe_format = io::raw_formats; ///< of those that are depth

    /// All of them, those that are missing, too. Looked for once, by the first call.
    /// Throws: Error for an argument that stands for no file, and UsageError for frames of what is no sequence.
    const std::vector<Input>& all() const;

    /// Is this the name of a pipe: "-", or, where the size of frames is given, something that delivers bytes and is no file?
    bool is_pipe(const std::string& name) const;

    /// Are they the frames of a pipe? `all` is then the first one.
    bool is_piped() const { return arguments.size() == 1 && is_pipe(arguments.front()); }

    /// Is there more than a single file that was named itself?
    bool is_sequence() const { return all().size() > 1 || !there_.empty() || is_piped(); }

    /// The files of a shot, whichever frames were asked for, and which inputs are frames of it.
    struct Shot {
        std::map<Frame, std::string> files;
        std::vector<std::size_t> inputs;
    };

    /// Files of a folder, a glob or a command line are frames of one shot if their names have one pattern, whatever else there is.
    std::vector<Shot> shots() const;

private:
    void add(const std::string& argument) const;
    void add_files(const std::string& argument, std::vector<std::string> files) const;
    void add_sequence(const sequence::FramePattern& pattern, const std::map<Frame, std::string>& files) const;

    mutable std::vector<Input> all_;
    mutable std::vector<std::map<Frame, std::string>> there_; ///< of each source
};

/// The frame that a file's name holds.
std::optional<Frame> frame_of(const std::string& file);

/// The pattern that a name is, unless a file has this very name.
std::optional<sequence::FramePattern> pattern_in(const std::string& name);

/// The name for an input's frame, which an option asks for.
/// Throws: UsageError where the input's own name holds no frame.
std::string named(const sequence::FramePattern& pattern, const std::string& option, const Input& input);

/// The camera of the images: a file of any format that Fathom reads, a source of depth by name, both, or the headers
/// of the images.
struct CameraOption {
    std::string file;                                       ///< or the pattern of those of all frames
    std::string preset;                                     ///< NAME, NAME:key=value,... or key=value,...
    std::string image, node;                                ///< which camera of the file
    bool undistorted = false;                               ///< see ImportOptions
    std::function<const std::vector<Input>&()> inputs = {}; ///< whose headers may have cameras
    bool or_relative = false;                               ///< may the command do without?

    bool given() const { return !file.empty() || !preset.empty(); }
    std::string name() const; ///< for messages

    /// Is the camera of each input in its header?
    bool of_headers() const;

    /// Does each frame have a camera file of its own?
    bool is_pattern() const { return pattern_in(file).has_value(); }

    /// The camera file of one input. Throws: UsageError where a pattern needs a frame that the input's name does not hold.
    std::string file_for(const Input& input) const;

    /// The files that the camera of one input is read from, without the input's own header.
    std::vector<std::filesystem::path> files_for(const Input& input) const;

    /// The camera of the first input that has one: refuses early what is wrong for all of them.
    /// Throws: UsageError where there is no camera, and Error for a camera that cannot be used.
    ImportedCamera read() const;

    /// Calls `use` with the camera of the first input that has what it needs, for which it throws no UsageError. A camera that
    /// cannot be read is told when all inputs are planned, or when the turn of its own comes.
    /// Throws: the first UsageError of `use` where none has what it needs.
    void first_for(const std::function<void(const ImportedCamera&)>& use) const;

    /// The camera of one input, whose values are stored like this.
    ImportedCamera read_for(const Input& depth, Storage storage = Storage::float32) const;
};

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

/// The hash of the text of all kernels.
std::string kernels_hash();

/// Held while a device's vector width is used, and alone while it changes.
inline std::shared_mutex vector_widths;

/// Runs work on a device. Where PoCL's compiler crashes on a kernel, a warning says so, and the work runs again with another vector
/// width.
/// Throws: NoDevice where it crashes for each of them.
template <typename Action>
auto at_any_width(const Device& device, const Action& action) {
    for (std::string said;;) {
        try {
            const std::shared_lock lock(vector_widths);
            auto result = action();
            if (!said.empty())
                complain("warning: " + said);
            return result;
        } catch (const runtime::CompilerCrashed& crashed) {
            const std::unique_lock lock(vector_widths);
            said = runtime::take_another_width(device, crashed);
        }
    }
}

/// Numbers between commas; none where there are others than `count` of them, if it is given, or something else.
std::vector<double> numbers_in(const std::string& text, std::optional<std::size_t> count = {});

/// An option whose value changes from frame to frame.
struct Animation {
    std::string option; ///< its name: --focus
    std::string file;
    std::map<Frame, std::string> values;
    std::function<void(const std::string&)> give; ///< gives the option a value
};

/// What a file holds that an operation makes of a depth image.
struct Product {
    std::vector<std::string> extensions;  ///< types it can be written as, the default first
    std::vector<std::string> channels;    ///< EXR names of its channels
    std::optional<double> png_scale = {}; ///< of values that have a range; none: --png-scale must say it
    double png_offset = 0;
    ImageKind kind = ImageKind::values;
    std::string layer = {}; ///< of appended channels whose names say too little
};

/// An image to write for each input.
struct Output {
    std::string option; ///< that says where: -o, --confidence
    std::string target; ///< file, folder, or the pattern of the files of all frames
    Product product;
    bool beside = false; ///< does each lie beside its input instead, whose name but for the extension it has?
};

/// An image to read with each input.
struct Companion {
    std::string option; ///< that says where: --normals
    std::string source; ///< a file, a folder in which it is named like the input, or the pattern of those of all frames
    const io::RawFormat* pixels = nullptr; ///< of a pipe's frames; none: it may be no pipe
};

/// The picture that an operation changes, or that belongs to its depth.
struct PictureOptions {
    std::string source, layer;
    const io::RawFormat* pixels = &io::raw_formats[2]; ///< of a pipe: rgb24
    std::optional<ColorEncoding> encoding;             ///< of the files; none: what their type says
};

/// What the program prints on stdout about its successes.
enum class Report { line, json, nothing };

/// What every operation on depth images takes, the files that it reads and writes among it.
struct DepthOptions {
    Inputs inputs;
    std::vector<Companion> companions = {}; ///< the picture first, if there is one, and the mask of --ignore last
    bool made_of_picture = false;           ///< are the results made of the picture, not of the depth?
    std::vector<Output> outputs = {};       ///< that of -o first
    std::vector<Animation> animations;
    bool interpolate = false; ///< are frames between those of an animation filled?
    CameraOption camera;
    std::optional<RelativeOrder>
        relative; ///< of depth without a unit, see fathom/relative.hpp; none: the depth has a camera
    RelativeOptions relative_options; ///< of such depth
    PictureOptions picture;           ///< of commands that take it
    std::string output;
    std::string format; ///< extension of the results in a folder, with its dot; empty: .exr
    std::string channel;
    std::string ignore; ///< the mask of pixels that do not count; empty: none
    io::IgnoredBy ignored_by;
    int supersampled = 1;                       ///< of how many pixels each way is one of the results the mean?
    std::optional<Edges> edges;                 ///< none: `sharpen` for relative depth alone
    std::optional<std::array<double, 2>> valid; ///< least and greatest distance along the axis of pixels that count
    std::optional<double> png_scale;
    bool append = false; ///< does the first result also hold what its source holds?
    bool half = false;
    std::optional<ExrCompression> compression;
    DeviceOption device;
    Report report = Report::line;
    bool strict = false;    ///< is what is probably wrong an error?
    std::size_t memory = 0; ///< bytes of the images in work, and as many beside them; 0: see FrameOptions
    ProgressKind progress = ProgressKind::automatic;
    bool resume = false; ///< are frames kept that are finished, and does a line beside them say what made them?
    std::string log;     ///< file that the run is told to; empty: none, "-": stdout
    std::string command; ///< its name
    /// What was asked for: options and their values. Called before an animated option has changed.
    std::function<std::map<std::string, std::vector<std::string>>()> given = {};
};

/// The images beside its depth that a command reads for an input. Each command reads its own of them.
struct Images {
    Picture picture = {}, clean_plate = {};
    DepthFile other_depth{{}, Storage::float32, {}}; ///< of the same camera: the clean plate's, or where solids end
    cv::Mat normals = {}, thickness = {};
};

class FrameFile;

/// An input on its way from its files to its results, with the files and images that belong to it.
struct Job {
    std::filesystem::path input;
    std::vector<std::filesystem::path> companions;
    std::vector<std::filesystem::path> outputs;
    std::filesystem::path camera_name = {};          ///< the file that its camera comes from, or "preset NAME"
    std::optional<Frame> frame = {};                 ///< that the input's name holds
    std::vector<std::string> values = {};            ///< of the animated options, in their order
    std::filesystem::path missing = {};              ///< a file without which the frame cannot be done; empty: it can
    bool left_out = false;                           ///< because of it?
    bool in_sequence = false;                        ///< or is the input a file that was named itself?
    std::optional<std::array<double, 2>> range = {}; ///< of the relative floats of its shot
    Windows windows = {};                            ///< of the depth, once it is read
    std::string channel = {};                        ///< that it was read from, of an EXR
    std::optional<ImportedCamera> camera = {};       ///< once it is read; none of relative depth

    std::vector<std::shared_ptr<FrameFile>> frames = {}; ///< of pipes, whose paths stand in the place of files
    std::shared_future<Images> images = {};              ///< get() throws what was wrong with them
    std::vector<std::string> said = {}; ///< lines for stderr: warnings and explanations, in their order

    /// Words in which frames of pipes have names instead of paths.
    std::string shown(std::string words) const;

    /// The input, and the frame that its camera is of.
    Input read_as() const { return {.file = input.native(), .frame = frame}; }
};

/// Do the windows of an image differ?
bool has_overscan(const Windows& windows);

/// The windows of an image that has so many times fewer pixels each way.
Windows smaller(const Windows& windows, int factor);

using io::extension_of; // as `Product::extensions` has it

/// Decides where everything lies, before anything is read or written.
/// A target is a folder when it is one, when it ends with a slash, or when there are several inputs; a result is then
/// <folder>/<name of the input without its extension><format>. With several inputs, or a sequence, a name with a place for
/// the frame is a pattern. Otherwise the target is the file to write. In a folder of companions the same name is looked for
/// with the extensions that images have.
/// A frame of a sequence is missing when its input is not there, or a companion or a camera file of its own.
/// Throws: UsageError when two results would have the same name, when a result would replace a file that is read, when
/// the extension is not one of the product's, when .png is asked for without a scale, when several inputs share a
/// companion, or when a name has no number for a pattern. Error when no frame at all can be done, or an animated value is
/// missing.
std::vector<Job> plan(const DepthOptions& options);

/// The same for one input, which may be a frame of piped depth.
Job plan_frame(const DepthOptions& options, const Input& input);

/// Makes the folders of results whose targets are folders or patterns that are not there yet.
/// Throws: Error when one cannot be made, or when a single file is to go into a folder that does not exist.
void prepare_folders(const DepthOptions& options, const Job& job);

/// An image that was made of an input, and the format that it has as a picture.
struct Made {
    Made(cv::Mat made) : image(std::move(made)), size(image.size()) {}

    cv::Mat image;
    cv::Size size; ///< of the whole, if the image is a part
    std::optional<PictureFormat> format = {};
    std::optional<cv::Rect> part = {}; ///< of the depth image, if it has no more pixels
    cv::Mat normals = {}, colors = {}; ///< of points
};

/// What a command does with each depth image.
class Task : public DepthOptions {
public:
    virtual ~Task() = default;

    /// Reads the images beside the depth. Other inputs are computed meanwhile, and others are read, too. The job has its windows.
    virtual Images read(const Job&) const { return {}; }

    /// Makes the images of `outputs`. Called for one input after the other.
    virtual std::vector<Made> make(const StoredDepth& stored, Job& job) = 0;

    /// What is probably wrong with the command's own options, a sentence each with the cure. Called beside `read`.
    virtual std::vector<std::string> doubts(const Job&) const { return {}; }

    /// The same of lengths, which this image is too large or too small for. Not asked where its depths are doubted anyway.
    virtual std::vector<std::string> length_doubts(const StoredDepth&, const Subject&, const Job&) const { return {}; }
};

/// Reads each input, does the task, writes the results and says so, in the order of the inputs. While one is computed, others
/// are read and written. A bad input is reported and the others are still done. Of an input's images all are written or none.
/// Gives the exit code.
/// Throws: UsageError, NoDevice and Interrupted, and Error for the camera file.
int each_depth(Task& task);

/// What the program was started with, for the first line of --log.
void remember_command_line(int argc, char** argv);

bool is_exr(const std::filesystem::path& file);

} // namespace fathom::shot
