#pragma once

#include <fathom/fathom.hpp>
#include <fathom/ssao.hpp>

#include "operations/ssao.hpp"
#include "runtime/program.hpp"

#include <string>
#include <vector>

/// Other methods of ambient occlusion than the library's, built on its planes, slopes, places and filter, so that a comparison
/// is one of methods. Of `ssao`'s options they know the radius alone; all write visibility, one float a pixel.
/// For float32 depth of the whole image of a camera.
namespace fathom::bench {

/// What all of them share: depth as the occlusion kernels read it, and the filter of their sums.
class OcclusionPlanes {
public:
    OcclusionPlanes(const StoredDepth& stored, double radius, const SliceTable& table, int patterns);

    /// Starts the passes before the method's own, and the one after it.
    void split();
    void filter(const Image& visibility);

    const Image& stored() const { return stored_.image; }
    const Device& device() const { return stored_.image.device(); }

    /// The kernel of a file beside this one, behind the text of kernels/ssao.cl.
    runtime::Kernel kernel(const std::string& file, const std::string& name, runtime::Defines choices) const;

    /// `count` images split into planes.
    Image planes(int count) const;

    Image fronts, backs, slopes, sums;
    params::split_params layout;
    params::occlusion_params occlusion;

private:
    StoredDepth stored_;
    EyeRays eye_;
    int patterns_;
    Image depth_;
};

/// Horizons of a height field by line sweep (line_sweep.cl): `slices` of them through every pixel, without a pattern, at a cost
/// that the radius does not change. Its thickness is infinite.
class LineSweep {
public:
    LineSweep(const StoredDepth& stored, double radius, int slices);
    void run(const Image& visibility);

private:
    OcclusionPlanes planes_;
    runtime::Kernel sweep_, add_;
    std::vector<Image> directions_;
    Image scratch_, horizons_;
};

/// What an occluder at a distance of d radii is worth, before a constant.
enum class Falloff {
    hbao_plus, ///< 1 − d²
    scalable,  ///< (1 − d²)³ / d
};

/// Obscurance (obscurance.cl) at the places and jitter that `ssao` has for so many slices and steps.
class Obscurance {
public:
    Obscurance(const StoredDepth& stored, double radius, int slices, int steps, Falloff falloff, double intensity);
    void run(const Image& visibility);

private:
    SliceTable table_;
    OcclusionPlanes planes_;
    runtime::Kernel kernel_;
    Image taps_, turns_, counts_, intensity_;
};

} // namespace fathom::bench
