#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::sequence {

/// The number of a frame.
using Frame = std::int64_t;

inline constexpr Frame largest_frame = 999'999'999'999; ///< of either sign
inline constexpr int most_figures = 12;                 ///< that it has
inline constexpr std::size_t most_frames = 10'000'000;  ///< of a range, as in fileseq

/// The frames that fileseq's FrameSet reads from a text, in its order and none twice: "1-10", "1-10x3" (every third),
/// "1-10y3" (those that x3 leaves out), "1-10:3" (x3, then x2, then x1), "10-1" and "-5--1", with commas between them.
/// Blanks, # and @ between these are ignored. Unlike fileseq it refuses parts of frames (1.5), numbers with a blank in
/// them, and a range without frames.
/// Throws: std::invalid_argument with the text, the place in it and what would be right; also for more frames than `most`.
std::vector<Frame> parse_frames(std::string_view text, std::size_t most = most_frames);

/// Rising frames in a few words: "1-3, 7".
std::string in_words(std::span<const Frame> frames);

} // namespace fathom::sequence
