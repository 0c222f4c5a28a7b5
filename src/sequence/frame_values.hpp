#pragma once

#include "frame_range.hpp"

#include <filesystem>
#include <map>
#include <string>

namespace fathom::sequence {

/// The values that a file gives to frames, as text.
/// CSV: a line for each frame, with its number and the value. A first line may name the columns: "frame", and `name` or
/// "value" for the value; others do not count. Separators are tabs, semicolons or commas, whichever the first line has first
/// in this order; text between quotation marks may hold them. Lines that are empty or begin with # do not count.
/// JSON (a file that begins with a brace): {"1": 2.5, "2": "inf", "3": [640, 360]}. Numbers of a list get commas.
/// `name` has - where a column may have _.
/// Throws: Error, naming the file, its line and the cure.
std::map<Frame, std::string> read_frame_values(const std::filesystem::path& file, const std::string& name);

} // namespace fathom::sequence
