// Thickness from the silhouette's width: closed forms, and brute force in double that shares no code with the kernel.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "occlusion.hpp"
#include "operations/ssao/ssao_call.hpp"
#include "operations/ssao/ssao_method.hpp"
#include "scene/scene.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

constexpr int width = 161, height = 121;
constexpr double radius = 1;
constexpr double rounding = 1e-5;         // of a thickness, relative: a few operations in float
constexpr double other_decisions = 0.002; // of the pixels: where a surface is farther by nearly nothing

const Device& default_device() {
    return oracle::device();
}

Camera camera_of(const Projection& projection) {
    return {.projection = projection, .width = width, .height = height};
}

const std::pair<const char*, Projection> projections[] = {
    {"perspective", perspective(0.9, 4.0 / 3, {0.1, 100})},
    {"orthographic", orthographic({-2, 2, -1.5, 1.5}, {0.1, 100})},
};

std::vector<float> thickness_of(const std::vector<float>& stored, const Camera& camera, const Sampling& sampling = {}) {
    const StoredDepth depth{
        Image::from_host(default_device(), Element::f32, stored.data(), {camera.width, camera.height}), camera};
    const CentreRays rays = centre_rays(camera_rays(camera));
    runtime::Scratch scratch(default_device());
    const Image inverse = inverse_depth(scratch, depth);
    return floats(silhouette_thickness(
        scratch, inverse, depth, rays.perspective,
        occlusion_parameters(camera, rays, inverse_depth_error(camera, depth.storage), radius, {}, {}), sampling, {}));
}

/// The same by its definition, in double.
class BruteForce {
public:
    BruteForce(const scene::Rendered& image, const Camera& camera) : image_(image), sight_(camera) {}

    double at(int x, int y) const {
        double least = silhouette_most * radius;
        for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
            const Eigen::Vector3d step = sight_.is_orthographic
                                             ? (dx * sight_.origin_x + dy * sight_.origin_y).eval()
                                             : (z(x, y) * (dx * sight_.direction_x + dy * sight_.direction_y)).eval();
            const double length = step.norm();
            least = std::min(least, (run(x, y, dx, dy, length) + run(x, y, -dx, -dy, length) - 1) * length);
        }
        return std::max(least, silhouette_least * radius);
    }

private:
    /// View depth of a pixel, NaN outside the image.
    double z(int x, int y) const {
        const bool inside = x >= 0 && y >= 0 && x < image_.width && y < image_.height;
        return inside ? image_.z[static_cast<std::size_t>(y * image_.width + x)] : std::nan("");
    }

    double run(int x, int y, int dx, int dy, double length) const {
        std::vector<int> samples{1};
        for (int power = 2; power < 4096; power *= 2)
            samples.insert(samples.end(), {power, power + power / 2});
        for (const int n : samples)
            if (n * length < silhouette_most * radius &&
                z(x + n * dx, y + n * dy) > z(x, y) + silhouette_step * radius + n * length)
                return n;
        return std::numeric_limits<double>::infinity();
    }

    const scene::Rendered& image_;
    oracle::DepthLayer::Sight sight_;
};

/// Orthographic pixels of a 64th across. A pole of so many pixels from column 70 on, 2 away, a wall 5 away.
constexpr double pixel = 1.0 / 64;
constexpr int first = 70;

Camera pole_camera() {
    return camera_of(orthographic({0, width * pixel, 0, height * pixel}, {1, 9}));
}

std::vector<float> pole(int pixels) {
    std::vector<float> stored(static_cast<std::size_t>(width * height), 0.5f);
    for (int y = 0; y < height; ++y)
        std::fill_n(stored.begin() + y * width + first, pixels, 0.125f);
    return stored;
}

float at(const std::vector<float>& values, int x, int y) {
    return values[static_cast<std::size_t>(y * width + x)];
}

} // namespace

TEST_CASE("silhouette: a pole before a wall is as thick as it is wide, and the wall as thick as can be", "[ssao]") {
    for (const int pixels : {1, 2, 3, 4, 7, 12, 24}) {
        const std::vector<float> got = thickness_of(pole(pixels), pole_camera());
        const double wide = pixels * pixel;
        for (const int y : {0, 60, height - 1}) {
            for (int x = first; x < first + pixels; ++x) {
                INFO(pixels << " pixels, at " << x << ", " << y);
                CHECK(at(got, x, y) >= wide * (1 - rounding));
                CHECK(at(got, x, y) <= wide * (pixels <= 4 ? 1 : 1.5) * (1 + rounding));
            }
            for (const int x : {0, first - 1, first + pixels, width - 1})
                CHECK(at(got, x, y) == static_cast<float>(silhouette_most));
        }
    }
    const std::vector<float> too_wide = thickness_of(pole(40), pole_camera());
    CHECK(at(too_wide, first + 20, 60) == static_cast<float>(silhouette_most));
}

TEST_CASE("silhouette: a run across the border is as wide as can be, and invalid pixels belong to the run", "[ssao]") {
    std::vector<float> slab(static_cast<std::size_t>(width * height), 0.5f);
    for (int y = 0; y < height; ++y)
        std::fill_n(slab.begin() + y * width, 3, 0.125f);
    const std::vector<float> cut = thickness_of(slab, pole_camera());
    for (int x = 0; x < 3; ++x)
        CHECK(at(cut, x, 60) == static_cast<float>(silhouette_most));

    std::vector<float> gap = pole(2);
    for (int y = 0; y < height; ++y)
        gap[static_cast<std::size_t>(y * width + first + 2)] = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> got = thickness_of(gap, pole_camera());
    for (const int x : {first, first + 1})
        CHECK(at(got, x, 60) == Approx(3 * pixel).epsilon(rounding));
}

TEST_CASE("silhouette: brute force over four scenes", "[ssao]") {
    for (const char* name : {"room", "railings", "spheres", "corridor"})
        for (const auto& [projection_name, projection] : projections) {
            const Camera camera = camera_of(projection);
            const auto image = scene::render(scene::named(name), camera);
            const BruteForce truth(image, camera);
            const std::vector<float> got = thickness_of(image.stored, camera);
            REQUIRE(got.size() == static_cast<std::size_t>(width * height));
            long surfaces = 0, thin = 0, differ = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    if (!std::isfinite(image.z[static_cast<std::size_t>(y * width + x)]))
                        continue;
                    const double expected = truth.at(x, y);
                    ++surfaces;
                    thin += expected < silhouette_most * radius;
                    differ += std::abs(static_cast<double>(at(got, x, y)) - expected) > rounding * expected;
                }
            std::printf("silhouette, %-8s %-12s: %ld of %ld pixels are thin, %ld differ from brute force\n", name,
                        projection_name, thin, surfaces, differ);
            INFO(name << ", " << projection_name);
            CHECK(static_cast<double>(differ) <= other_decisions * static_cast<double>(surfaces));
            CHECK(thin > surfaces / 100);
            const std::vector<float> every_second = thickness_of(image.stored, camera, {.half_resolution = true});
            for (int y = 0; y < height; y += 2)
                for (int x = 0; x < width; x += 2)
                    REQUIRE(at(every_second, x, y) == at(got, x, y));
        }
}
