#pragma once

#include "baselines.hpp"
#include "frames.hpp"

#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

__extension__ using Quad = __float128;

/// What comparing a baseline with the library's result gave: whether they compute the same, and the figures.
struct Comparison {
    bool same;
    std::string figures;
};

/// Something that is timed on the current frame.
struct Subject {
    std::string name;
    std::string floor;                                          ///< name of the copy that moves the same bytes
    std::function<void()> run;                                  ///< starts the work
    std::function<void()> after = {};                           ///< puts back what was overwritten; not timed
    std::function<Quad(int x, int y, float stored)> truth = {}; ///< exact result, where the error is measured
    std::string rival = {};                      ///< of a baseline: name of the library's row that does the same
    std::function<Comparison()> comparison = {}; ///< of its results with the rival's, made before anything is timed
    int every = 1;                               ///< rounds from one run to the next: more for what takes long
    double pixels = 0;                           ///< of one run; 0: a frame's
};

/// Far/near of the bench's perspective cameras: where engines' formulas start to fail.
inline constexpr double bench_near = 0.1, bench_far = 1e5;

/// Copies, this library's operations and the formulas of others, all on the same frames.
std::vector<Subject> subjects(Frames& frames, Baselines& plain, Baselines& streaming);

/// The rows of `ssao`: on a room of this size instead of the frames, which is made when it is first looked at.
std::vector<Subject> ssao_subjects(const Device& device, int width, int height);

/// The rows of `dof_masks` on the frames, and of `dof` on a room of 1920 × 1080, made when it is first looked at.
std::vector<Subject> dof_subjects(Frames& frames, Baselines& plain, Baselines& streaming);

} // namespace fathom::bench
