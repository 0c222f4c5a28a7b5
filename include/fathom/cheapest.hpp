#pragma once

#include <fathom/camera.hpp>
#include <fathom/image.hpp>

#include <string>

namespace fathom {
#pragma GCC visibility push(default)

/// The operations that can choose their own method.
enum class Operation { ssao, dof, normals };

/// Its name, as the program has it.
const char* to_string(Operation operation);

/// A method or preset of `ssao`, `dof` or `normals` with its measured error.
struct MeasuredMethod {
    std::string method; ///< as the tables name it: "fast", "4 x 64, half resolution", "neighbours"
    double error = 0;   ///< in the scene where it is greatest: rms of visibility, rms of colours up to 1, mean degrees
    std::string scene;  ///< that scene
};

/// The method of `operation` that costs least among those whose measured error is at most `max_error` in every scene. `MaxError` in
/// SsaoOptions, DofOptions and NormalsOptions uses it. Scenes harder than the measured ones have larger errors.
///
/// The errors are those of depth stored as this tile's is, or in 16 bits if `depth_bits` are at most 16. If no such depth was
/// measured, the largest error of any storage counts. Half resolution is a method of `ssao` if the depth has an even column
/// and row of the camera's image.
/// Throws: std::invalid_argument for an error that is not above 0. If no method meets the error, the message names the smallest
/// error available.
MeasuredMethod cheapest_method(Operation operation, const Tile& tile, double max_error);

#pragma GCC visibility pop
} // namespace fathom
