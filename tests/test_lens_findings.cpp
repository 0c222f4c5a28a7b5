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
#include <fathom/ranking.hpp>

using namespace fathom;

namespace {

struct Meaning {
    const char* name; // what a doubt calls it
    Encoding encoding;
    Along along;
};

const Meaning meanings[] = {{"the view axis", Encoding::view_z, Along::axis},
                            {"along the rays", Encoding::ray_distance, Along::axis},
                            {"a cube's faces", Encoding::view_z, Along::cube}};

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
        linearize({Image::from_host(device, Element::f32, values.data(), {width, height}), camera});
        device.finish(); // it reads the values
    };
    // A circle of 180 degrees in 16 : 9 covers 44 %.
    CHECK_NOTHROW(decode({LensLaw::equidistant, 57.3, 57.3, 160, 90}, 320, 180));
    // One of 194 degrees whose polynomial folds just outside.
    CHECK_NOTHROW(decode({LensLaw::opencv_fisheye, 66, 66, 160, 90, {0, -0.02395, 0, 0}}, 320, 180));
    // A calibration that folds at 41 degrees, and an image that reaches far beyond.
    CHECK_THROWS_WITH(decode({LensLaw::brown, 60, 60, 160, 90, {-0.45, 0, 0, 0}}, 320, 180),
                      ContainsSubstring("folds") && ContainsSubstring("k1") && ContainsSubstring("% of the image"));
    CHECK_NOTHROW(decode({LensLaw::brown, 200, 200, 160, 90, {-0.45, 0, 0, 0}}, 320, 180));
    CHECK_THROWS_WITH(decode({LensLaw::brown, 75, 75, 160, 90, {0, 0, 0.3, 0.2}}, 320, 180),
                      ContainsSubstring("folds where p1, p2") && ContainsSubstring("% of the image"));
}

TEST_CASE("lens findings: a fold in the image is named as why pixels have no depth", "[lens][doubts]") {
    const auto doubts = [](LensModel lens) {
        Camera camera;
        camera.width = 320;
        camera.height = 180;
        camera.encoding = Encoding::ray_distance;
        camera.lens = std::move(lens);
        return depth_doubts(camera, host(camera, std::vector<float>(320 * 180, 2.0f)));
    };
    // 1 - 3 k r² ends at 0.861 focal lengths, where r (1 - k r²) is 0.574: of 115 pixels, in an image of 160 to either side.
    const std::vector<std::string> folded = doubts({LensLaw::brown, 200, 200, 160, 90, {-0.45, 0, 0, 0}});
    REQUIRE(folded.size() == 1);
    double beyond = 0;
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x)
            beyond += std::hypot(x + 0.5 - 160, y + 0.5 - 90) > 200 * std::sqrt(1 / 1.35) * 2 / 3;
    CHECK(std::abs(std::stod(folded.front()) - 100 * beyond / (320 * 180)) < 1);
    for (const char* const words : {"have no ray", "folds 40.7 degrees", "k1", "corners"})
        CHECK(contains(folded.front(), words));
    const std::vector<std::string> aside = doubts({LensLaw::brown, 150, 150, 160, 90, {0, 0, 0.15, 0.1}});
    REQUIRE(aside.size() == 1);
    CHECK(contains(aside.front(), "because the lens folds where p1, p2"));
    CHECK(doubts({LensLaw::brown, 400, 400, 160, 90, {-0.45, 0, 0, 0}}).empty());
    CHECK(doubts({LensLaw::equidistant, 57.3, 57.3, 160, 90}).empty());
}

TEST_CASE("lens findings: a picture of all directions is told without a camera, and a pinhole's of its shape is none",
          "[lens][doubts]") {
    Camera panorama = lens_subjects().at(11).camera;
    const std::vector<float> room = stored_room(panorama, meanings[1]);
    const Ranking ranking = rank_encodings(host(panorama, room));
    CHECK(ranking.family == Family::radial);
    REQUIRE(ranking.guesses.size() == 1);
    CHECK(contains(ranking.guesses.front().camera_file,
                   R"({"lens": {"model": "equirectangular"}, "encoding": "ray-distance")"));
    std::vector<std::uint16_t> codes;
    for (const float value : room)
        codes.push_back(static_cast<std::uint16_t>(std::lround(4000 * value))); // Matterport's
    CHECK(rank_encodings({codes.data(), panorama.width, panorama.height, 2 * static_cast<std::size_t>(panorama.width),
                          Storage::uint16})
              .family == Family::radial);
    for (const double degrees : {40.0, 90.0, 130.0})
        for (const Encoding encoding : {Encoding::view_z, Encoding::ray_distance}) {
            Camera pinhole;
            pinhole.width = 640;
            pinhole.height = 320;
            pinhole.encoding = encoding;
            pinhole.projection =
                perspective(2 * std::atan(std::tan(degrees * std::numbers::pi / 360) / 2), 2, {0.1, 100});
            const auto image = scene::render(scene::room(), pinhole);
            const Ranking other = rank_encodings(host(pinhole, image.stored));
            INFO(degrees << " degrees");
            CHECK(other.family == (encoding == Encoding::view_z ? Family::planar : Family::radial));
            CHECK_FALSE(contains(other.guesses.front().camera_file, "equirectangular"));
        }
}

TEST_CASE("lens findings: a radius of more than twice the distance is told where a lens's image is cut into faces",
          "[lens][doubts]") {
    Camera camera = lens_subjects().at(11).camera;
    camera.encoding = Encoding::ray_distance;
    const std::vector<float> room = stored_room(camera, meanings[1]);
    std::vector<float> sorted = room;
    std::ranges::sort(sorted);
    const double nearest = static_cast<double>(sorted[sorted.size() / 20]);
    CHECK(radius_doubts(camera, host(camera, room), 1.8 * nearest).empty());
    const std::vector<std::string> said = radius_doubts(camera, host(camera, room), 2.2 * nearest);
    REQUIRE(said.size() == 1);
    INFO(said.front());
    CHECK(contains(said.front(), "more than twice the distance of "));
    const std::size_t at = said.front().find("Give ") + 5;
    CHECK(radius_doubts(camera, host(camera, room), std::stod(said.front().substr(at))).empty());
    const Camera straight = lens_subjects().at(1).camera; // it has one face
    CHECK(radius_doubts(straight, host(straight, stored_room(straight, meanings[1])), 2.2 * nearest).empty());
}

TEST_CASE("lens findings: a map of rays in other axes is told", "[lens][doubts]") {
    const auto said = [](const Camera& camera, const Eigen::Vector3f& signs, bool from_below) {
        RayMap map{camera.width, camera.height, {}};
        const std::vector<PixelRay> rays = all_rays(camera);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const int row = from_below ? camera.height - 1 - y : y;
                const PixelRay& ray = rays[static_cast<std::size_t>(row * camera.width + x)];
                for (int i = 0; i < 3; ++i)
                    map.rays.push_back(ray ? signs[i] * static_cast<float>((*ray)[i]) : 0);
            }
        Camera mapped = camera;
        mapped.encoding = Encoding::ray_distance;
        mapped.lens = lens_of_rays(std::move(map));
        std::string found;
        for (const std::string& doubt : depth_doubts(mapped, host(mapped, stored_room(mapped, meanings[1]))))
            if (contains(doubt, "the map of rays"))
                found += doubt;
        return found;
    };
    for (const std::size_t which : {0u, 2u, 4u, 5u, 7u, 9u, 11u}) {
        const auto [name, camera] = lens_subjects().at(which);
        INFO(name);
        CHECK(said(camera, {1, 1, 1}, false).empty());
        CHECK(contains(said(camera, {1, -1, 1}, false), "mirror image")); // DirectX's axes
        CHECK(contains(said(camera, {1, 1, 1}, true), "mirror image"));
        CHECK(contains(said(camera, {-1, -1, 1}, false), "upside down"));
    }
    CHECK(contains(said(lens_subjects().at(11).camera, {1, -1, -1}, false), "upside down")); // OpenGL's, of a panorama
}
