#pragma once

#include "plan.hpp"

#include "io/relative_input.hpp"

#include <fathom/io.hpp>
#include <fathom/relative.hpp>

#include <string>
#include <vector>

namespace fathom::cli {

/// An input's relative depth.
struct RelativeDepth {
    DepthFile depth{
        {}, Storage::float32, {}}; ///< floats from 0 to 1, made smooth, and of the picture's size if there is one
    io::RelativeInput input;       ///< before that
    std::vector<std::string> doubts = {}; ///< what is probably wrong with its values, a sentence each with the cure
};

/// Gives each job the range of the relative floats of its whole shot, which is read for it, so that a frame does not depend on
/// which frames are done with it. Files that cannot be read do not count. Says the ranges in words, a line for each shot, and one for
/// inputs whose names are like no other's, which have ranges of their own.
/// Throws: Interrupted.
std::vector<std::string> find_ranges(const DepthOptions& options, std::vector<Job>& jobs);

/// Throws: Error.
RelativeDepth relative_depth(const DepthOptions& options, const Job& job);

/// "values 3 to 250, 0 of 9600 pixels invalid": for the line about a result.
std::string in_words(const io::RelativeInput& input);

} // namespace fathom::cli
