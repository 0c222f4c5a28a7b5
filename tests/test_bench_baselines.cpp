// The bench's baselines do what their articles say: on planes, whose depths, points and normals are known, they are right to
// what floats and their own differences leave, under every camera of the charts that they are for.

#include "catch.hpp"
#include "judge.hpp"
#include "methods.hpp"

using namespace fathom;
using namespace fathom::bench;
using Eigen::Vector3d;

namespace {

// Window depth in floats is off by 2^-24 z / near of a distance, and a plane at 3 is seen from a near plane at 0.01.
constexpr double largest_depth_error = 1e-4;
// Central differences of distances are exact to the second order of a pixel's angle, 0.01.
constexpr double largest_mean_deg = 0.2;

struct Errors {
    double worst = 0, mean = 0; ///< relative to the distance, or degrees
};

Errors errors_of(const Method& method, Case& on, const scene::Rendered& truth) {
    const std::vector<float> got = images::floats(method.run(on));
    Errors errors;
    long pixels = 0;
    for (std::size_t i = 0; i < truth.z.size(); ++i) {
        if (!std::isfinite(truth.z[i]))
            continue;
        double off = 0;
        if (method.operation == "linearize") {
            off = std::abs(static_cast<double>(got[i]) / truth.z[i] - 1);
        } else {
            const Vector3d v(got[3 * i], got[3 * i + 1], got[3 * i + 2]);
            off = method.operation == "unproject"
                      ? (v - truth.position[i]).norm() / truth.position[i].norm()
                      : std::atan2(v.cross(truth.normal[i]).norm(), v.dot(truth.normal[i])) * 180 / std::numbers::pi;
        }
        errors.worst = std::isfinite(off) ? std::max(errors.worst, off) : INFINITY;
        errors.mean += off;
        ++pixels;
    }
    CHECK(pixels > 160 * 90 * 2 / 5);
    errors.mean /= static_cast<double>(pixels);
    return errors;
}

} // namespace

TEST_CASE("bench: baselines are right on planes, under every camera of the charts", "[bench]") {
    const Device& device = oracle::device(Arithmetic::fp64);
    Baselines kernels(device);
    const std::vector<Method> list = methods(kernels);
    int runs = 0;
    for (View view : views(160, 90)) {
        view.subject.camera.view = std::nullopt;
        view.scene = {scene::Plane{{0, 0, -3}, Vector3d(0.3, 0.2, 1).normalized()}};
        const scene::Rendered truth = scene::render(view.scene, view.camera());
        Case on(device, view, 1);
        for (const char* name : {"Popov's listing 1", "Lenaerts' interpolated rays", "D2NT v3", "3F2N"}) {
            const Method& method = *std::ranges::find(list, name, &Method::name);
            if (method.fits && !method.fits(view))
                continue;
            const Errors errors = errors_of(method, on, truth);
            std::printf("%-9s %-28s worst %.2e, mean %.2e\n", view.name.c_str(), name, errors.worst, errors.mean);
            INFO(view.name << ", " << name);
            if (method.operation == "normals")
                CHECK(errors.mean <= largest_mean_deg);
            else
                CHECK(errors.worst <= largest_depth_error);
            ++runs;
        }
    }
    CHECK(runs == 7 + 7 + 6 + 6);
}
