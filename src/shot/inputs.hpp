#pragma once

#include "io/formats.hpp"
#include "sequence/frames.hpp"
#include "terminal/exit.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

/// A shot: which images it has, what a task makes of each, and what is said of it.
namespace fathom::shot {

using namespace terminal;
using sequence::Frame;

/// What becomes of a frame whose depth, or another file of its own, is not there.
enum class Missing { error, skip };

/// A depth image to read.
struct Input {
    std::string file;
    std::optional<Frame> frame = {};        ///< which names of other files may have, too
    std::optional<std::size_t> source = {}; ///< which sequence it is of; none: it was named itself
};

/// The name of standard input, and of standard output.
inline constexpr const char* standard_stream = "-";

/// What is said of raw frames in pipes.
struct PipeOptions {
    std::optional<cv::Size> size;                 ///< of all of them
    const io::RawFormat* depth = io::raw_formats; ///< of those that are depth
};

/// Is this the name of a pipe: "-", or, where the size of frames is given, something that delivers bytes and is no file?
bool is_pipe(const std::string& name, const PipeOptions& pipes);

/// The depth images that arguments stand for: files, patterns of names, quoted globs and folders. A file that is there is
/// meant itself, whatever its name looks like.
class Inputs {
public:
    std::vector<std::string> arguments;
    std::optional<std::vector<Frame>> frames; ///< of the patterns; none: those that are there
    Missing missing = Missing::error;
    PipeOptions pipes;

    /// All of them, those that are missing, too. Looked for once, by the first call.
    /// Throws: Error for an argument that stands for no file, and UsageError for frames of what is no sequence.
    const std::vector<Input>& all() const;

    /// Are they the frames of a pipe? `all` is then the first one.
    bool is_piped() const { return arguments.size() == 1 && is_pipe(arguments.front(), pipes); }

    /// Is there more than a single file that was named itself?
    bool is_sequence() const;

    /// Shots that inputs are frames of: their files, whichever frames were asked for, and the shot of each input.
    struct Shots {
        std::vector<std::map<Frame, std::string>> files;
        std::vector<std::optional<std::size_t>> of_inputs; ///< none: no other file is named like it
    };

    /// Files of a folder, a glob or a command line are frames of one shot if their names have one pattern, whatever else there is.
    Shots shots() const;

private:
    void add(const std::string& argument) const;
    void add_files(const std::string& argument, const std::vector<std::string>& files) const;
    void add_sequence(const sequence::FramePattern& pattern, const std::map<Frame, std::string>& files) const;

    mutable std::vector<Input> all_;
    mutable std::vector<std::map<Frame, std::string>> there_; ///< of each source
};

/// The frame that a file's name holds.
std::optional<Frame> frame_of(const std::string& file);

} // namespace fathom::shot
