#pragma once

#include <fathom/fathom.hpp>

namespace fathom::bench {

/// Ambient occlusion with its loop over samples written per pixel (scalar_ssao.cl): the samples of `ssao` balanced, taken
/// the way that engines take them.
class ScalarSsao {
public:
    static constexpr int slices = 1, steps = 32; ///< of `Quality::balanced`

    /// Do neighbours look into different directions?
    enum class Patterns { alike, sixteen };

    /// For float32 window depth of `perspective(fov_y, width / height, span)` that has no background.
    ScalarSsao(const Image& stored, double fov_y, DepthSpan span, double radius, double thickness, Patterns patterns);

    /// Starts it. Visibility, one float a pixel, not filtered.
    void run(const Image& visibility);

private:
    Image stored_;
    cl::Kernel surfaces_kernel_, kernel_;
    cl::Buffer surfaces_, patterns_;
};

} // namespace fathom::bench
