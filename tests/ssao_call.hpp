#pragma once

#include <fathom/ssao.hpp>

#include <variant>

/// A radius and the options that go with it, for tests that hand both around.
struct SsaoCall : fathom::SsaoOptions {
    double radius = 0;
};

/// Of options that have no tolerance.
inline fathom::Sampling& sampling_of(fathom::SsaoOptions& options) {
    return std::get<fathom::Sampling>(options.sampling);
}

inline fathom::Occlusion ssao(const fathom::StoredDepth& stored, const SsaoCall& call) {
    return fathom::ssao(stored, call.radius, call);
}
