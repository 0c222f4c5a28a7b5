#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fathom::sequence {

/// The number of a frame.
using Frame = std::int64_t;

inline constexpr Frame largest_frame = 999'999'999'999; ///< of either sign
inline constexpr int most_figures = 12;                 ///< that it has
inline constexpr std::size_t most_frames = 10'000'000;  ///< of a range, as in fileseq

/// The frame that a text is.
std::optional<Frame> number_in(std::string_view text);

/// The frames that fileseq's FrameSet reads from a text, in its order and none twice: "1-10", "1-10x3" (every third), "10-1" and
/// "-5--1", with commas between them. Blanks, # and @ between these are ignored. Unlike fileseq it refuses parts of frames (1.5),
/// numbers with a blank in them, a range without frames, and what has y or a colon.
/// Throws: std::invalid_argument with the text, the part of it and what would be right; also for more frames than `most`.
std::vector<Frame> parse_frames(std::string_view text, std::size_t most = most_frames);

/// A name that stands for those of all frames: shot.%04d.exr or shot.####.exr.
/// %d and %04d may stand several times, in folders, too: all of them are the same number. Otherwise the last run of # in
/// the file's own name is the frame. Each # is a figure (fileseq's PAD_STYLE_HASH1).
/// Numbers get zeros in front until they have that many figures, a minus among them, and keep those that they have beyond.
class FramePattern {
public:
    /// The pattern that a name is; none where it has no place for a number.
    static std::optional<FramePattern> in(const std::string& name);

    /// The pattern of a file that may be one of many, and its frame: the last figures that stand alone between points,
    /// or else the last figures of the name. A minus counts at the beginning of a name or behind a point or _.
    static std::optional<std::pair<FramePattern, Frame>> of(const std::string& file);

    const std::string& text() const { return text_; }

    /// What is the same in the names of all frames, however many figures their numbers have.
    std::string beside_number() const;

    std::string name(Frame frame) const;

    /// The frame that a name is of: the number whose `name` it is.
    std::optional<Frame> frame(std::string_view name) const;

    /// The files that are there.
    std::map<Frame, std::string> files() const;

    /// The one pattern that all of these files are of, and the file of each frame; none where there is no such pattern.
    static std::optional<std::pair<FramePattern, std::map<Frame, std::string>>>
    common(const std::vector<std::string>& files);

private:
    /// A place for the number, which gets at least so many figures.
    struct Token {
        std::size_t begin, end;
        int figures;
    };

    std::string literal(std::size_t before) const; ///< the text between two tokens

    std::string text_;
    std::vector<Token> tokens_;
};

/// Files whose names a quoted *, ? or [...] stands for, by name; none of them is a folder.
std::vector<std::string> matching_files(const std::string& glob);

/// Depth images in a folder by their extensions, by name. Hidden files do not count.
std::vector<std::string> depth_files_in(const std::filesystem::path& folder);

/// Does a name have a character that `matching_files` reads as more than itself?
bool has_glob(const std::string& name);

/// The values that a file gives to frames, as text.
/// CSV: a line for each frame, with its number and the value. A first line may name the columns: "frame", and `name` or
/// "value" for the value; others do not count. Separators are tabs, semicolons or commas, whichever the first line has first
/// in this order; text between quotation marks may hold them. Lines that are empty or begin with # do not count.
/// JSON (a file that begins with a brace): {"1": 2.5, "2": "inf", "3": [640, 360]}. Numbers of a list get commas.
/// `name` has - where a column may have _.
/// Throws: Error, naming the file, its line and the cure.
std::map<Frame, std::string> read_frame_values(const std::filesystem::path& file, const std::string& name);

} // namespace fathom::sequence
