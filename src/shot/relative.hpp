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

/// Throws: Error.
RelativeDepth relative_depth(const RelativeOptions& relative, const Job& job, const std::string& channel);

/// "values 3 to 250, 0 of 9600 pixels invalid": for the line about a result.
std::string in_words(const io::RelativeInput& input);

} // namespace fathom::cli
