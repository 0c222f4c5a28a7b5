#pragma once

#include <fathom/camera.hpp>
#include <fathom/image.hpp>

#include <string>

namespace fathom {

/// The operations that can choose their own method.
enum class Operation { ssao, dof, normals };

/// Its name, as the program has it.
const char* to_string(Operation operation);

/// A method or preset of `ssao`, `dof` or `normals`, and what was measured of it: the tables of docs/performance.md, as they
/// were when the library was built.
struct MeasuredMethod {
    std::string method; ///< as the tables name it: "fast", "4 x 64, half resolution", "neighbours"
    double error = 0;   ///< in the scene where it is greatest: rms of visibility, rms of colours up to 1, mean degrees
    std::string scene;  ///< that scene
    double ns_per_pixel = 0; ///< of 1920 x 1080, time of all threads together
    std::string device;      ///< that took that time
};

/// The cheapest way of `operation` whose error in no scene of the tables exceeds `max_error`:
/// what `SsaoOptions::max_error` and its kin do. Scenes harder than those have larger errors.
///
/// Errors are those of depth stored as this one is, or in 16 bits where `depth_bits` are no more; where nothing was measured of
/// such depth, the largest of any storage. ssao at half resolution is one of the ways, but for depth without an even column
/// and row of the camera's.
/// Throws: std::invalid_argument for an error that is not above 0, or that nothing meets, with the best that there is.
MeasuredMethod cheapest_method(Operation operation, const StoredDepth& stored, double max_error);

} // namespace fathom
