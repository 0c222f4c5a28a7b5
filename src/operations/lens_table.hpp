#pragma once

#include "runtime/launch.hpp"
#include "runtime/table.hpp"

#include <fathom/image.hpp>

#include <memory>

namespace fathom {

/// The rays of a camera's lens as kernels read them.
struct LensTable {
    static constexpr const char* name = "lens";

    runtime::Table tiles, nodes;
    int tiles_across;

    std::size_t bytes() const {
        return 4 * (static_cast<std::size_t>(tiles.count) + static_cast<std::size_t>(nodes.count));
    }
};

/// What a kernel takes to decode depth through a lens.
struct ThroughLens {
    DepthForm form; ///< gives distances along the ray, or along the axis
    std::shared_ptr<const LensTable> table;
    params::lens_params parameters;
    runtime::Defines defines; ///< beside CHANNELS or AS_DISTANCE

    /// `turn`: from the camera's view space to the axes of the result; `centre`: of the camera, there.
    ThroughLens(const StoredDepth& stored, const Eigen::Matrix3d& turn, const Eigen::Vector3d& centre, int vector_width,
                bool stream);
};

} // namespace fathom
