#pragma once

#include <fathom/camera.hpp>
#include <fathom/lens.hpp>
#include <fathom/photograph.hpp>

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Relative depth: values from 0 to 1 that are ordered by distance but have no unit, as neural networks give them. Enough
/// for a blur, which needs the circles only. On the host, without a device.
namespace fathom {
#pragma GCC visibility push(default)

/// Are high values near (disparity: MiDaS, Depth Anything) or far?
enum class RelativeOrder { high_is_near, low_is_near };

/// A camera under which relative depth, stored as floats from 0 to 1, can be given to `dof_masks` and `dof` together with the
/// circle of `relative_circle`. Its view depth is v where low is near, and 1 − v otherwise. Nothing is background.
Camera relative_camera(int width, int height, RelativeOrder order);

/// The circle of a stored value v: blur_px (v_focus − v) horizontal pixels if high is near, blur_px (v − v_focus) otherwise;
/// positive behind the focus. That is the circle of a thin lens if 1/z is affine in v, whatever the two numbers are.
/// Throws: std::invalid_argument unless blur_px is finite and 0 or greater, and v_focus lies between 0 and 1.
CircleOfConfusion relative_circle(double blur_px, double v_focus, RelativeOrder order);

/// Values between which all is in focus.
struct FocusRange {
    double low, high;
};

/// Takes a range of values out, so that all of it has one value, and what lies beyond keeps its distance to the range. A circle
/// of `blur_px` for a difference of 1 outside the range stays one. Returns the value that the range then has.
/// Throws: std::invalid_argument unless 0 ≤ low ≤ high ≤ 1.
double flatten_range(std::span<float> values, FocusRange range);

/// Turns the steps of a coarse storage into slopes: each value moves by at most half a step, to where it lies between the edges
/// of its step. Steps of two codes and more are edges of objects, and stay where they are. Rows follow each other without a gap.
/// `step`: between two codes, as 1/255. Values are multiples of it; others, NaN among them, stay as they are.
/// Accuracy: a slanted plane has an rms error of at most 0.1 steps, where the steps themselves have 0.29.
void smooth_steps(std::span<float> values, int width, int height, double step);

/// How relative depth is read.
struct RelativeOptions {
    /// Stored values that become 0 and 1. Default: the least and the greatest of floats, all codes of integers.
    std::optional<std::array<double, 2>> range = {};
    std::optional<FocusRange> focus_range = {}; ///< see `flatten_range`
    Edges edges = Edges::sharpen;               ///< see `sharpen_edges` of linearize.hpp
    RelativeOrder order = RelativeOrder::high_is_near;
};

/// Values for a `relative_camera`, and what is probably wrong with them: a sentence each, with the cure.
struct RelativeValues {
    std::vector<float> values = {}; ///< 0 to 1, NaN where nothing is known; rows without a gap
    int width = 0, height = 0;
    std::vector<std::string> doubts = {};
};

/// Makes values from 0 to 1 of relative depth as it is stored, as `fathom dof --relative` does: codes of 8 bits lose their steps
/// (`smooth_steps`), depth gets the size of a picture of another size along its edges
/// (`upsample_along_edges`), soft edges become hard ones, and the range in focus becomes one value (`flatten_range`). `bits`: 8 and 16 for codes, 32 for floats.
/// `color`: the picture in linear light, if there is one. `range_option`: how a doubt calls `RelativeOptions::range`.
/// Throws: std::invalid_argument for channels other than one or R = G = B, and an alpha; for pixels of which none has a
/// value; for a range that is not finite or does not ascend; and for a picture of another ratio of width to height, by more than 1 %.
RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options = {},
                               const HostFloats& color = {}, const std::string& range_option = "relative_range");

/// A frame of a shot, as `steady_ranges` needs it: the means of its values in 64 x 48 cells, and the ends of all.
struct ShotFrame {
    std::vector<double> cells;
    double least, greatest;
};

/// Throws: std::invalid_argument for a frame whose values are all the same, and for one without pixels.
ShotFrame shot_frame(const HostFloats& stored);

/// Stored values of a frame that become 0 and 1, as `RelativeOptions::range` takes them.
struct SteadyRange {
    double least, greatest;
    bool is_first; ///< of a shot, or behind a cut
};

/// Ranges under which relative depth does not flicker, though a network gives each frame a scale and an offset of its own: what keeps
/// its distance then keeps its value from frame to frame, up to the next cut. 0 and 1 are the ends of all frames between two cuts.
/// Each frame is compared with frames 1, 2, 4, 8 and so on before it, so that nothing drifts; what moves counts little.
/// Accuracy: docs/sequences.md. Source: weights of Tukey's biweight; slopes are reduced major axes.
std::vector<SteadyRange> steady_ranges(std::span<const ShotFrame> frames);

#pragma GCC visibility pop
} // namespace fathom
