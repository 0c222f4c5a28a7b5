// The truth of ambient occlusion, proved: rays against every closed form, slices of a depth layer against rays, columns
// with a thickness against their definition in space.

#include "catch.hpp"
#include "known_occlusion.hpp"
#include "scene/scene.hpp"

using namespace fathom;
using namespace oracle;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr double looks_to = 1;       // radius in the scenes that cameras see, 40 pixels or more
constexpr double no_occluder = 1e-6; // of a plane's visibility, from 1
constexpr double image_error = 8e-3; // of a depth image with edges: they are up to a pixel late

/// The largest of some errors, printed with its place.
class Worst {
public:
    void add(double error, const std::string& where) {
        if (!(std::abs(error) <= std::abs(error_))) {
            error_ = error;
            where_ = where;
        }
    }
    void print(const char* label) const { std::printf("%-44s worst %9.1e  %s\n", label, error_, where_.c_str()); }
    double error() const { return std::abs(error_); }
    const std::string& where() const { return where_; }

private:
    double error_ = 0;
    std::string where_ = "nowhere";
};

std::string text(const std::string& name, double a, double b = 0) {
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, " (%.3g, %.3g)", a, b);
    return name + numbers;
}

struct Named {
    std::string name;
    Known known;
};

std::vector<Named> closed_forms() {
    std::vector<Named> list;
    for (const double tilt : {0.0, 30.0, 60.0, 85.0, 89.9})
        list.push_back({text("plane", tilt), open_plane(tilt * degree, tilt)});
    for (const double alpha : {20.0, 60.0, 90.0, 135.0, 170.0})
        list.push_back({text("crease", alpha), crease(alpha * degree)});
    list.push_back({"crease, very near", crease(pi / 2, 1e-4)});
    for (const auto& [x, y] : {std::pair{1.0, 1.0}, {0.2, 3.0}, {0.001, 0.5}})
        list.push_back({text("corner", x, y), corner(x, y)});
    for (const auto& [height, distance] : {std::pair{0.5, 1.0}, {2.0, 0.1}, {0.3, 10.0}})
        list.push_back({text("wall", height, distance), wall(height, distance)});
    for (const double radius : {1.02, 1.5, 2.0, 10.0, 1000.0})
        list.push_back({text("infinite wall", 1, radius), infinite_wall(1, radius)});
    list.push_back({"trench", trench(1, 0.5, 2, 3)});
    list.push_back({"deep trench", trench(0.1, 5, 0.2, 3)});
    for (const double polar : {0.0, 0.3, 0.9, 1.5})
        list.push_back({text("hemisphere", polar), bowl(1, 1, polar)});
    list.push_back({"bowl", bowl(2, 0.3, 0.3)});
    for (const double elevation : {5.0, 20.0, 44.0})
        list.push_back({text("horizon", elevation), uniform_horizon(elevation * degree)});
    return list;
}

/// Scenes that a camera centre in the direction `from` sees as height fields.
std::vector<Named> height_fields() {
    return {{"crease 60", crease(60 * degree, 0.5)},
            {"crease 90", crease(90 * degree, 0.5)},
            {"crease 135", crease(135 * degree, 0.5)},
            {"corner", corner(1, 0.5)},
            {"wall", wall(0.5, 0.4)},
            {"trench", trench(0.5, 0.5, 0.9, 1.5)},
            {"bowl", bowl(2, 1)},
            {"bowl, aside", bowl(2, 1, 0.5)}};
}

Vector3d in_world(const Camera& camera, const Vector3d& position) {
    return (scene::to_world(camera) * position.homogeneous()).head<3>();
}

/// By rays: what a pixel's surface would see if the depth layer told the whole scene.
double by_rays(const scene::Caster& caster, const scene::Surface& surface, double radius) {
    const Camera& camera = caster.camera();
    const Vector3d normal = scene::to_world(camera).topLeftCorner<3, 3>() * surface.normal;
    return visibility(caster.scene(), in_world(camera, surface.position), normal, radius);
}

std::size_t index(const Camera& camera, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
}

} // namespace

TEST_CASE("occlusion oracle: rays agree with every closed form", "[ssao][oracle]") {
    Worst worst;
    for (const auto& [name, known] : closed_forms()) {
        const double got = visibility(known.scene, known.position, known.normal, known.radius);
        INFO(name);
        CHECK(std::abs(got - known.visibility) < visibility_error);
        worst.add(got - known.visibility, name);
    }
    worst.print("rays and closed forms");
}

TEST_CASE("occlusion oracle: a plane is open at every tilt, for slices of an image", "[ssao][oracle]") {
    const ScreenOptions options{.radius = 2, .slices = 16};
    Worst of_image;
    int seen = 0;
    for (const double tilt : {0.0, 45.0, 75.0, 85.0})
        for (const double towards : {0.0, 1.0, 2.5}) {
            const scene::Scene plane = open_plane(tilt * degree, towards).scene;
            for (const auto& [name, camera] : views({})) {
                const auto image = scene::render(plane, camera);
                const DepthLayer layer(camera, image.z);
                for (const auto& [x, y] : {std::pair{160, 90}, {0, 0}, {319, 179}, {71, 150}, {300, 33}}) {
                    const std::size_t i = index(camera, x, y);
                    if (std::isfinite(image.z[i])) {
                        ++seen;
                        const std::string where = text(name, x, y) + text(" tilt", tilt, towards);
                        of_image.add(screen_visibility(layer, x, y, image.normal[i], options) - 1, where);
                    }
                }
            }
        }
    of_image.print("plane, image");
    CHECK(seen > 200);
    CHECK(of_image.error() < no_occluder);
}

TEST_CASE("occlusion oracle: slices of a height field agree with rays under five cameras", "[ssao][oracle][slow]") {
    Worst of_image;
    for (const auto& [name, known] : height_fields())
        for (const auto& [camera_name, camera] : views({.target = known.position, .from = known.from})) {
            const scene::Caster caster(known.scene, camera);
            const auto image = scene::render(known.scene, camera);
            const DepthLayer layer(camera, image.z);
            const Vector2d middle = oracle::pixel_of(camera, known.position);
            for (const auto& [dx, dy] : {std::pair{0, 0}, {9, 5}, {-20, 3}, {14, -11}}) {
                const int x = static_cast<int>(middle.x()) + dx, y = static_cast<int>(middle.y()) + dy;
                const auto surface = caster.at(x + 0.5, y + 0.5);
                REQUIRE(surface);
                const double truth = by_rays(caster, *surface, looks_to);
                const std::string where = name + ", " + text(camera_name, dx, dy);
                const ScreenOptions options{.radius = looks_to, .slices = 128};
                of_image.add(screen_visibility(layer, x, y, surface->normal, options) - truth, where);
            }
        }
    of_image.print("height fields, image");
    INFO(of_image.where());
    CHECK(of_image.error() < image_error);
}

TEST_CASE("occlusion oracle: a column that is as thick as the thing it stands for is the thing", "[ssao][oracle]") {
    // Straight from above and with orthographic rays, a floating box is its top and the columns below.
    const double thickness = 0.3;
    const scene::Scene scene{scene::Plane{{0, 0, 0}, {0, 0, 1}},
                             scene::Box{{0.4, 0.1, 0.6}, {0.35, 0.45, 0.5 * thickness}}};
    const Camera camera = views({}).back().camera;
    const scene::Caster caster(scene, camera);
    const auto image = scene::render(scene, camera);
    const DepthLayer layer(camera, image.z);
    Worst of_image;
    for (const Vector3d& point : {Vector3d(0, 0, 0), {-0.3, 0.4, 0}, {0.6, -0.5, 0}, {1.1, 0.2, 0}, {0.4, 0.1, 0.75}}) {
        const Vector2d pixel = oracle::pixel_of(camera, point);
        const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
        const auto surface = caster.at(x + 0.5, y + 0.5);
        REQUIRE(surface);
        const double truth = by_rays(caster, *surface, looks_to);
        const ScreenOptions options{.radius = looks_to, .thickness = thickness};
        const std::string where = text("point", point.x(), point.y());
        of_image.add(screen_visibility(layer, x, y, surface->normal, options) - truth, where);
    }
    of_image.print("floating box, image");
    CHECK(of_image.error() < image_error);
}
