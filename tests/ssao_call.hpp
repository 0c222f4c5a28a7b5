#pragma once

#include "images.hpp"
#include "judge.hpp"

#include <fathom/ssao.hpp>

#include <optional>
#include <variant>
#include <vector>

/// A radius and the options that go with it, for tests that hand both around.
struct SsaoCall : fathom::SsaoOptions {
    double radius = 0;
};

inline constexpr fathom::Quality qualities[] = {fathom::Quality::fast, fathom::Quality::balanced,
                                                fathom::Quality::accurate};
inline constexpr const char* quality_names[] = {"fast", "balanced", "accurate"};

/// Of options that have no tolerance.
inline fathom::Sampling& sampling_of(fathom::SsaoOptions& options) {
    return std::get<fathom::Sampling>(options.sampling);
}

inline SsaoCall options_of(double radius, fathom::Quality quality = fathom::Quality::balanced,
                           std::optional<double> thickness = std::nullopt) {
    SsaoCall call;
    call.radius = radius;
    sampling_of(call).quality = quality;
    call.thickness = thickness;
    return call;
}

inline fathom::Occlusion ssao(const fathom::StoredDepth& stored, const SsaoCall& call) {
    return fathom::ssao(stored, call.radius, call);
}

inline std::vector<float> visibility_of(const fathom::StoredDepth& stored, const SsaoCall& call) {
    return fathom::images::floats(ssao(stored, call).visibility);
}

inline fathom::StoredDepth stored_of(const std::vector<float>& values, const fathom::Camera& camera) {
    return {
        fathom::Image::from_host(oracle::device(), fathom::Element::f32, values.data(), {camera.width, camera.height}),
        camera};
}
