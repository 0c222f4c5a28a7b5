#pragma once

#include "runtime/launch.hpp"
#include "runtime/table.hpp"

#include <fathom/image.hpp>

#include <array>
#include <cstdint>
#include <memory>

namespace fathom {

/// The rays of a camera's lens as kernels read them.
struct LensTable {
    static constexpr const char* name = "lens";

    runtime::Table tiles, nodes;
    int tiles_across;
    std::shared_ptr<const RayMap> map; ///< that it was made of

    std::size_t bytes() const {
        return 4 * (static_cast<std::size_t>(tiles.count) + static_cast<std::size_t>(nodes.count));
    }
};

/// All that the rays of a camera's lens depend on: what is made of them is kept by it.
struct LensKey {
    std::array<std::uint64_t, 7> numbers;
    std::array<std::uint64_t, 13> coefficients; ///< how many, and they
    std::array<std::uint64_t, 9> turn;
    std::uint64_t map; ///< where it lies, which whoever keeps something must keep too
};

LensKey lens_key(const Camera& camera, bool along_axis, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity());

/// The axes of a result: from the camera's view space, and back again, and the camera centre in them.
struct LensAxes {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// The lens of a camera, or none, as a kernel that is built for LENS takes it.
class KernelLens {
public:
    KernelLens(const Device& device, const Camera& camera, const LensAxes& axes = {});

    /// LENS, and what else a lens is built for.
    runtime::Defines with_lens(runtime::Defines defines) const;

    /// Starts the kernel with the lens behind its other arguments.
    template <typename... Arguments>
    void launch(const Device& device, runtime::Kernel& kernel, runtime::Range range,
                const Arguments&... arguments) const {
        if (table_)
            runtime::launch(device, kernel, range, arguments..., table_->tiles.on(device), table_->nodes.on(device),
                            parameters_);
        else
            runtime::launch(device, kernel, range, arguments...);
    }

private:
    Along along_ = Along::axis;
    std::shared_ptr<const LensTable> table_;
    params::lens_params parameters_{};
};

} // namespace fathom
