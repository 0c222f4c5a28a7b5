#pragma once

#include "options.hpp"

#include "camera_file/file.hpp"
#include "doubts/look.hpp"

#include <opencv2/core/mat.hpp>

#include <future>
#include <memory>

namespace fathom::shot {

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
