#pragma once

#include "baselines.hpp"
#include "frames.hpp"

#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

__extension__ using Quad = __float128;

/// Something that is timed on the current frame.
struct Subject {
    std::string name;
    std::string floor;                                     ///< name of the copy that moves the same bytes
    std::function<void()> run;                             ///< starts the work
    std::function<void()> after;                           ///< puts back what was overwritten; not timed
    std::function<Quad(int x, int y, float stored)> truth; ///< exact result, where the error is measured
};

/// Far/near of the bench's perspective cameras: where engines' formulas start to fail.
inline constexpr double bench_near = 0.1, bench_far = 1e5;

/// Copies, this library's operations and the formulas of others, all on the same frames.
std::vector<Subject> subjects(Frames& frames, Baselines& plain, Baselines& streaming);

} // namespace fathom::bench
