// What is said of depth that was stored through a lens: pixels without a ray, folds, and what the values count along, by how flat
// surfaces are. Scenes are ray-cast.

#include "catch.hpp"
#include "lenses.hpp"
#include "test_device.hpp"

#include "scene/scene.hpp"

#include <fathom/doubts.hpp>
#include <fathom/fathom.hpp>
#include <fathom/findings.hpp>
#include <fathom/pixel_rays.hpp>

using namespace fathom;

namespace {

struct Meaning {
    const char* name; // what a doubt calls it
    Encoding encoding;
    Along along;
};

const Meaning meanings[] = {{"\"view-z\"); are", Encoding::view_z, Along::axis},
                            {"\"ray-distance\"", Encoding::ray_distance, Along::axis},
                            {"\"cube\"", Encoding::view_z, Along::cube}};

Camera with(Camera camera, const Meaning& meaning) {
    camera.encoding = meaning.encoding;
    camera.along = meaning.along;
    return camera;
}

// A room as a renderer writes it, in millimetres of 16 bits or in floats.
std::vector<float> stored_room(const Camera& camera, const Meaning& meaning) {
    const scene::Scene room = scene::room();
    const PixelRays rays(camera);
    std::vector<float> values;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const auto ray = rays.ray_of(x + 0.5, y + 0.5);
            const Eigen::Vector3d along =
                ray ? Eigen::Vector3d(ray->x(), -ray->y(), -ray->z()) : Eigen::Vector3d::Zero();
            const auto met = ray ? scene::met(room, {{0, 0, 0}, along, 1e-6, 1e6}) : std::optional<scene::Met>();
            if (!met) {
                values.push_back(0);
                continue;
            }
            const double part = meaning.encoding == Encoding::ray_distance ? 1
                                : meaning.along == Along::cube             ? ray->cwiseAbs().maxCoeff()
                                                                           : ray->z();
            values.push_back(static_cast<float>(met->position.norm() * part));
        }
    return values;
}

HostDepth host(const Camera& camera, const std::vector<float>& values) {
    return {values.data(), camera.width, camera.height, 4 * static_cast<std::size_t>(camera.width)};
}

} // namespace

TEST_CASE("lens findings: flat surfaces tell what depth through a lens counts along", "[lens][doubts]") {
    for (const std::size_t which : {1u, 4u, 7u, 9u, 11u}) {
        const auto [name, plain] = lens_subjects().at(which);
        for (const Meaning& written : meanings) {
            if (which == 11 && written.encoding == Encoding::view_z && written.along == Along::axis)
                continue; // half of a panorama lies behind the camera
            const std::vector<float> values = stored_room(plain, written);
            for (const Meaning& said : meanings) {
                const std::vector<std::string> doubts = depth_doubts(with(plain, said), host(plain, values));
                const bool bent = std::ranges::any_of(
                    doubts, [&](const std::string& doubt) { return contains(doubt, "flat surfaces are bent"); });
                const bool right = std::ranges::any_of(doubts, [&](const std::string& doubt) {
                    return contains(doubt, "flat surfaces are bent") && contains(doubt, written.name);
                });
                INFO(name << ": written as " << written.name << ", said to be " << said.name);
                // Within 45 degrees of its axis, which the distorted pinhole hardly leaves, a cube's face is the image plane.
                const bool alike =
                    which == 1 && written.encoding == Encoding::view_z && said.encoding == Encoding::view_z;
                if (alike && &said != &written)
                    continue;
                if (&said == &written)
                    CHECK_FALSE(bent);
                else if (which == 1 && written.encoding == Encoding::view_z) // either of the two
                    CHECK(bent);
                else
                    CHECK(right);
            }
        }
    }
}

TEST_CASE("lens findings: pixels without a ray, steep ones and folds are counted", "[lens][doubts]") {
    const auto found_of = [](const Camera& camera) {
        const std::vector<float> values(static_cast<std::size_t>(camera.width * camera.height), 2.0f);
        return camera_findings(camera, host(camera, values)).lens.value();
    };
    for (const std::size_t which : {2u, 5u, 8u}) {
        auto [name, camera] = lens_subjects().at(which);
        INFO(name);
        const PixelRays rays(camera);
        std::size_t no_ray = 0, steep = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const auto ray = rays.ray_of(x + 0.5, y + 0.5);
                no_ray += !ray;
                steep += ray && ray->z() < std::cos(89 * std::numbers::pi / 180);
            }
        CHECK(found_of(camera).no_ray == no_ray);
        CHECK((no_ray > 0) == (which != 5));
        CHECK(found_of(camera).steep == 0);
        camera.encoding = Encoding::view_z;
        CHECK(found_of(camera).steep == steep);
        CHECK(found_of(camera).fold.has_value() == (which != 5));
    }
}

TEST_CASE("lens findings: a fold over more than half of the image is refused, and a fisheye's circle is not",
          "[lens][doubts]") {
    const Device device = test_device();
    const auto decode = [&](LensModel lens, int width, int height) {
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.encoding = Encoding::ray_distance;
        camera.lens = std::move(lens);
        const std::vector<float> values(static_cast<std::size_t>(width * height), 2.0f);
        return linearize({Image::from_host(device, Element::f32, values.data(), {width, height}), camera});
    };
    // A circle of 180 degrees in 16 : 9 covers 44 %.
    CHECK_NOTHROW(decode({LensLaw::equidistant, 57.3, 57.3, 160, 90}, 320, 180));
    // One of 194 degrees whose polynomial folds just outside.
    CHECK_NOTHROW(decode({LensLaw::opencv_fisheye, 66, 66, 160, 90, {0, -0.02395, 0, 0}}, 320, 180));
    // A calibration that folds at 41 degrees, and an image that reaches far beyond.
    CHECK_THROWS_WITH(decode({LensLaw::brown, 60, 60, 160, 90, {-0.45, 0, 0, 0}}, 320, 180),
                      ContainsSubstring("folds") && ContainsSubstring("k1") && ContainsSubstring("% of the image"));
    CHECK_NOTHROW(decode({LensLaw::brown, 200, 200, 160, 90, {-0.45, 0, 0, 0}}, 320, 180));
}
