#pragma once

#include <fathom/ssao.hpp>

/// A radius and the options that go with it, for tests that hand both around.
struct SsaoCall : fathom::SsaoOptions {
    double radius = 0;
};

inline fathom::Occlusion ssao(const fathom::StoredDepth& stored, const SsaoCall& call) {
    return fathom::ssao(stored, call.radius, call);
}
