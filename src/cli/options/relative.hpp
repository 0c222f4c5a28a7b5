#pragma once

#include "lens.hpp"

#include "io/relative_input.hpp"
#include "shot/outputs.hpp"

#include <fathom/image.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/mat.hpp>

#include <string>

namespace fathom::cli {

/// Adds --relative and what goes with it, after the options of the depth and the lens. --focus-at is the lens's.
void add_relative_options(CLI::App& app, RelativeOptions& relative);

/// Refuses relative depth without a blur or a focus.
/// Throws: UsageError.
void check_relative(const RelativeOptions& relative, const LensOptions& lens);

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

/// The circle of relative depth, for a focus at a pixel or for the range that is in focus; the lens's otherwise.
/// Throws: Error, for instance for a pixel without depth.
CircleOfConfusion circle_of(const RelativeOptions& relative, const LensOptions& lens, const StoredDepth& stored,
                            const Job& job);

/// What is probably wrong with it for an image. Circles end at `max_coc_px`, which may be infinity.
std::vector<std::string> blur_doubts(const RelativeOptions& relative, const LensOptions& lens,
                                     const StoredDepth& stored, const Job& job, const Look& look, Sky sky,
                                     double max_coc_px);

} // namespace fathom::cli
