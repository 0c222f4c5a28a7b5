#pragma once

#include "frame_range.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fathom::sequence {

/// A name that stands for those of all frames: shot.%04d.exr, shot.####.exr or shot.@@@@.exr.
/// %d and %04d may stand several times, in folders, too: all of them are the same number. Otherwise the last run of # in
/// the file's own name is the frame, and otherwise its last run of @. Each # or @ is a figure (fileseq's PAD_STYLE_HASH1).
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
    bool matches(std::string_view name, std::size_t token, std::optional<Frame>& frame) const;
    std::vector<FramePattern> parts() const; ///< of the path; some have no token
    static void collect(const std::filesystem::path& folder, std::span<const FramePattern> parts,
                        std::optional<Frame> frame, std::map<Frame, std::string>& found);

    std::string text_;
    std::vector<Token> tokens_;
};

/// Files whose names a quoted *, ? or [...] stands for, by name; none of them is a folder.
std::vector<std::string> matching_files(const std::string& glob);

/// Depth images in a folder by their extensions, by name. Hidden files do not count.
std::vector<std::string> depth_files_in(const std::filesystem::path& folder);

/// Does a name have a character that `matching_files` reads as more than itself?
bool has_glob(const std::string& name);

} // namespace fathom::sequence
