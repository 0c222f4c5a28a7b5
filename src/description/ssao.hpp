#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include "require.hpp"

#include <fathom/lens.hpp>
#include <fathom/ssao.hpp>

#include <optional>
#include <string>

namespace fathom::description {

inline constexpr Range ssao_radius = above(0);

template <typename Visitor, Is<SsaoOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("quality", in<&Sampling::quality>(o.sampling), {"fast", "balanced", "accurate"},
      "speed against accuracy: sets slices, samples, growth, jitter and half resolution");
    v("slices", in<&Sampling::slices>(o.sampling), whole(1, 64), "number of planes through the view ray", "by quality");
    v("samples", in<&Sampling::samples>(o.sampling), whole(1, 256), "number of samples on either side of a slice",
      "by quality");
    v("growth", in<&Sampling::growth>(o.sampling), between(1, 8),
      "up to how many times as many samples long rays take: they grow with the square root of the radius beyond 48 "
      "pixels",
      "by quality");
    v("jitter", in<&Sampling::jitter>(o.sampling), one_of(1.0, 4.0, 16.0),
      "number of neighbouring pixels that look into different directions and are averaged. 1 turns both off",
      "by quality");
    v("half_resolution", in<&Sampling::half_resolution>(o.sampling), Kind::flag,
      "compute every second pixel of every second row, and interpolate along the surfaces",
      "the quality chooses it for blocks where the radius covers many pixels");
    v("max_error", in<&MaxError::value>(o.sampling), tolerated_error,
      "rms error of visibility, instead of a quality: takes the fastest method whose measured error is at most this in "
      "every scene of docs/performance.md");
    v("thickness", in<double>(o.thickness), from(0).or_infinite(),
      "how thick surfaces are along their rays, scene units. Infinity suits reliefs and what is seen from straight "
      "above",
      "from the silhouette");
    v("thickness", in<Image>(o.thickness), Kind::lengths, "a thickness for each pixel, scene units");
    v("thickness", in<Silhouette>(o.thickness), {"silhouette"},
      "each object is as thick as it is wide in the image: the default");
    v("thickness", in<StoredDepth>(o.thickness), Kind::depth,
      "a second layer of depth: where each pixel's solid ends. Where it is NaN or in front of the depth, a quarter of "
      "the radius counts");
    v("falloff", o.falloff, between(0, 1),
      "fraction of the radius, at its end, over which occluders fade out. 0 is a hard end");
    v("border", o.border, {"open", "clamp"},
      "open: nothing lies outside the image; clamp: the pixels of its border repeat there");
    v("tolerance", o.tolerance, above(0),
      "how far depth may be off, in half steps of its storage. Raise it for a noisy sensor");
    v("seed", o.seed, whole(0, 4294967295.0),
      "another number gives another pattern of jitter, as frames need that are averaged");
    v("normals", o.normals, Kind::directions,
      "normals of length 1. Where a vector is none, faces away, or has another length, the depth's own counts",
      "from the depth");
    v("normals_space", o.normals_space, {"view", "world"},
      "axes of the normals that are given: the camera's or the world's, which need the camera's view matrix");
    v("region", o.region, Kind::region,
      "the part that is computed, pixels: results have its size. Samples still come from the whole image");
    v("bent_normal", o.bent_normal, a_result);
    v("confidence", o.confidence, a_result);
}

/// The radius that a camera has for want of another. Throws: std::invalid_argument naming the camera or the option.
inline double default_radius(const LensDefaults& defaults, const std::string& camera, const std::string& option) {
    const std::optional<double>& radius = defaults.ao_distance;
    require(radius.has_value(), option, ": missing, and ", camera,
            " has no \"ao_distance\"; give a length in scene units");
    require(ssao_radius.holds(*radius), camera, ": \"ao_distance\" is ", *radius, "; it must be ",
            ssao_radius.instead_of(*radius), ", or give ", option);
    return *radius;
}

struct SsaoCall {
    static constexpr Said said{.name = "ssao",
                               .summary = "Computes ambient occlusion: how much ambient light reaches each pixel.",
                               .arguments = {"radius"},
                               .group = "Occlusion",
                               .needing = {{{"normals_space", {"normals"}}}},
                               .results = "Occlusion",
                               .first_alone = true};

    double radius = 0;
    SsaoOptions options = {};
    Occlusion results = {};

    void supersample(int) const {
        require(!options.region, "region: a part of a supersampled frame is not computed alone; leave one of them out");
    }
    void run(const StoredDepth& stored, const Launch& launch) const { ssao(stored, results, radius, options, launch); }
};

template <typename Visitor, Is<SsaoCall> Call>
void describe(const Visitor& v, Call& call) {
    v("radius", call.radius, ssao_radius,
      "how far occlusion reaches, scene units: objects farther away occlude nothing",
      "\"ao_distance\" of the camera file");
    describe(v, call.options);
}

template <typename Visitor>
void describe_results(const Visitor& v, SsaoCall& call, const StoredDepth& stored) {
    const SsaoOptions& o = call.options;
    const ImageSize size = o.region ? ImageSize{o.region->width, o.region->height} : size_of(stored);
    v("visibility", call.results.visibility, true, floats(size, 1), fractions("AO"),
      "1 open, 0 blocked; NaN for invalid pixels");
    v("bent_normal", call.results.bent_normal, o.bent_normal, floats(size, 3),
      directions("N.X N.Y N.Z", "of length 1, or 0, but for rounding"),
      "the mean open direction: of unit length, in the camera's axes");
    v("confidence", call.results.confidence, o.confidence, floats(size, 1), fractions("confidence"),
      "the fraction of samples that hit valid pixels inside the image");
}

} // namespace fathom::description
