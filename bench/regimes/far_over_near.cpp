// Far over near: what decoding loses of the number that was stored, and what storing has lost already.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/corner.hpp"

#include <algorithm>
#include <cmath>

namespace fathom::regimes {
namespace {

constexpr double near = 0.1; // of decoding
constexpr double far = 100;  // of storing: the corner lies at a fifth of it
constexpr const char* decoding = "error of the stored number's z, relative";
constexpr const char* engines = "1/(Z d + W) in floats";

Camera camera_with(const DepthSpan& span) {
    return camera_over(perspective(1.0, static_cast<double>(corner_width) / corner_height, span), corner_width,
                       corner_height);
}

// Stored values over the whole range and crowded at its far end.
std::vector<float> stored_values() {
    constexpr int all = corner_width * corner_height, even = all - 400;
    std::vector<float> values;
    for (int i = 1; i <= even; ++i)
        values.push_back(static_cast<float>(i) / even);
    for (int i = 0; i < all - even; ++i)
        values.push_back(1 - std::ldexp(1 + static_cast<float>(i % 16) / 16, -1 - i / 18));
    return values;
}

// The two constants, the product and the sum are rounded, and the sum is as small as 1/far.
double engine_bound(double ratio) {
    const double lost = 0x1p-24 * (3 * ratio + 1);
    return lost < 1 ? lost / (1 - lost) + 0x1p-24 : none;
}

// An ulp; and where the far plane is stored 1/far is what two terms of 1/near leave in long double.
double linearize_bound(double ratio) {
    const double lost = 0x1p-63 * ratio;
    return lost < 1 ? lost / (1 - lost) + linearize_ulp_fp64 * 0x1p-23 : none;
}

void sweep_decoding(const Device& device, Panel& panel) {
    const std::vector<float> stored = stored_values();
    for (int power = 1; power <= 24; power += power < 12 ? 1 : 2) {
        const double ratio = std::pow(10.0, power);
        const Camera camera = camera_with({near, near * ratio});
        const auto z = images::floats(linearize(images::stored_of(device, stored, camera), {Background::decode}).image);
        const auto slope = static_cast<float>(1 / (near * ratio) - 1 / near), start = static_cast<float>(1 / near);
        long double ours = 0, engine = 0;
        for (std::size_t i = 0; i < stored.size(); ++i) {
            const long double d = stored[i], exact = 1 / ((1 - d) / near + d / (near * ratio));
            const volatile float product = slope * stored[i]; // as a shader without fused multiply-add does it
            ours = std::max(ours, std::abs(z[i] / exact - 1));
            engine = std::max(engine, std::abs(1 / (product + start) / exact - 1));
        }
        const auto put = [&](const char* curve, long double error, double bound) { // infinity would not be drawn
            panel.curve(curve).points.push_back({ratio, static_cast<double>(std::min(error, 10.0L)), bound});
        };
        put("linearize", ours, linearize_bound(ratio));
        put(engines, engine, engine_bound(ratio));
    }
}

void sweep_storing(const Device& device, Regime& regime) {
    struct Kind {
        const char* name;
        Buffer buffer;
        DepthOrder order;
    };
    for (const Kind& kind :
         {Kind{"D16", {16}, DepthOrder::standard}, Kind{"D24", {24}, DepthOrder::standard},
          Kind{"D32F", {32}, DepthOrder::standard}, Kind{"D32F reversed", {32}, DepthOrder::reversed}})
        for (double power = 1; power <= 9; power += 0.5) {
            const double ratio = std::pow(10.0, power);
            const Corner corner(camera_with({far / ratio, far, kind.order}));
            add(regime, kind.name, ratio, corner_errors(device, corner, kind.buffer));
        }
}

} // namespace

Regime far_over_near(const Device& device) {
    Regime regime{"far-over-near", "far / near"};
    sweep_decoding(device, regime.panel(decoding));
    sweep_storing(device, regime);
    regime.boundaries = {
        {decoding, "linearize", linearize_ulp_fp64 * 0x1p-23, 1e12, 1e14,
         "promised: one ulp; constants in long double"},
        {decoding, engines, 1e-3, 1e4, 1e5, "derived: 3 far/near roundings"},
        {quantity::depth, "D16", 0.01, 3.2e3, 1e4, "derived: half a step of the buffer"},
        {quantity::depth, "D24", 0.01, 1e6, 3.1e6, "derived: half a step of the buffer"},
        {quantity::depth, "D32F", 0.01, 1e6, 3.1e6, "derived: half a step of the buffer"},
        {quantity::normal, "D16", 1, 320, 1e3, "derived: normals_slope_error"},
        {quantity::normal, "D24", 1, 1e5, 3.1e5, "derived: normals_slope_error"},
        {quantity::visibility, "D16", 0.03, 320, 1e3, "measured"},
        {quantity::visibility, "D24", 0.03, 3.2e4, 1e5, "measured"},
        {quantity::circle, "D16", 0.1, 3.2e3, 1e4, "derived: half a step of the buffer"},
        {quantity::circle, "D24", 0.1, 1e6, 3.1e6, "derived: half a step of the buffer"},
    };
    return regime;
}

} // namespace fathom::regimes
