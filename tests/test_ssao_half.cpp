// ssao at half resolution: planes stay open, edges keep what is theirs, every option holds; and what it is off by where it is
// meant for, a large radius.

#include "brute_force.hpp"
#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "known_occlusion.hpp"
#include "scene/scene.hpp"
#include "ssao_call.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

constexpr int width = 161, height = 121;

std::size_t index(int x, int y, int row = width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(row) + static_cast<std::size_t>(x);
}

SsaoCall half(double radius, Quality quality = Quality::balanced) {
    SsaoCall options = options_of(radius, quality);
    sampling_of(options).half_resolution = true;
    return options;
}

std::vector<Camera> cameras(int across = width, int down = height) {
    Camera perspective_camera{
        .projection = perspective(1.0, 1.0 * across / down, {0.5, 500}), .width = across, .height = down};
    Camera orthographic_camera = perspective_camera;
    const double y = 1.95, x = y * across / down;
    orthographic_camera.projection = orthographic({-x, x, -y, y}, {0.5, 500});
    return {perspective_camera, orthographic_camera};
}

const char* name_of(const Camera& camera) {
    return depth_form(camera).perspective ? "perspective" : "orthographic";
}

/// The room with sky, an invalid area and single invalid pixels.
std::vector<float> pierced_room(const Camera& camera) {
    std::vector<float> stored = scene::render(scene::room(), camera).stored;
    for (int y = 30; y < 37; ++y)
        for (int x = 40; x < 51; ++x)
            stored[index(x, y, camera.width)] = x < 46 ? 1.0f : std::nanf("");
    for (int y = 60; y < 80; y += 3)
        for (int x = 20; x < 60; x += 5)
            stored[index(x, y, camera.width)] = std::nanf("");
    return stored;
}

/// Are all pixels of the image up to `around` away surfaces? Beside a horizon an image does not tell the slope.
bool whole_around(const scene::Rendered& image, int x, int y, int around) {
    for (int at_y = std::max(y - around, 0); at_y <= std::min(y + around, height - 1); ++at_y)
        for (int at_x = std::max(x - around, 0); at_x <= std::min(x + around, width - 1); ++at_x)
            if (!std::isfinite(image.z[index(at_x, at_y)]))
                return false;
    return true;
}

// What rounding alone may do: it moves a tap in a thousand to the next of a side's 31 sectors, in one slice of two.
constexpr double rounding_mean = 2e-5, rounding_worst = 1.0 / 31;

/// The camera of every second pixel of every second row: pixel i + ½ of its image is 2 i + ½ of the other's.
Camera half_camera(const Camera& camera) {
    Camera half = camera;
    half.width = (camera.width + 1) / 2;
    half.height = (camera.height + 1) / 2;
    const auto row = [](int from, int to) {
        const long double scale = 0.5L * from / to;
        return std::pair(scale, scale - 1 + 0.5L / to);
    };
    const auto [scale_x, shift_x] = row(camera.width, half.width);
    const auto [scale_y, shift_y] = row(camera.height, half.height);
    Projection::Matrix& matrix = half.projection.matrix;
    matrix.row(0) = (scale_x * matrix.row(0) + shift_x * matrix.row(3)).eval();
    matrix.row(1) = (scale_y * matrix.row(1) - shift_y * matrix.row(3)).eval(); // rows grow downwards
    return half;
}

/// Every second pixel of every second row.
std::vector<float> picked(const std::vector<float>& values, int channels = 1) {
    std::vector<float> result;
    for (int y = 0; y < height; y += 2)
        for (int x = 0; x < width; x += 2)
            for (int c = 0; c < channels; ++c)
                result.push_back(
                    values[static_cast<std::size_t>(channels) * index(x, y) + static_cast<std::size_t>(c)]);
    return result;
}

/// What the options of one call point at, for all pixels or for those that are picked.
struct Inputs {
    std::vector<float> depth, normals, thicknesses, back;
    Camera camera;
    StoredDepth stored, behind;
    Image normal_image, map;

    Inputs(const Inputs&) = delete;
    explicit Inputs(const Camera& from) : camera(from) {
        const auto image = scene::render(scene::room(), camera);
        depth = pierced_room(camera);
        for (std::size_t i = 0; i < depth.size(); ++i) {
            for (int c = 0; c < 3; ++c)
                normals.push_back(static_cast<float>(image.normal[i][c]));
            thicknesses.push_back(i % width < width / 2 ? 2.0f : 0.02f);
            const double z = image.z[i] + (i / width % 3 == 0 ? 3 : 0.3);
            back.push_back(
                static_cast<float>(std::isfinite(z) ? stored_depth(camera, Storage::float32, 0.5, 0.5, z) : 1));
        }
        upload();
    }
    /// Those that are picked of `all`.
    Inputs(const Inputs& all, const Camera& half)
        : depth(picked(all.depth)), normals(picked(all.normals, 3)), thicknesses(picked(all.thicknesses)),
          back(picked(all.back)), camera(half) {
        upload();
    }
    void upload() {
        stored = stored_of(depth, camera);
        behind = stored_of(back, camera);
        const Device& device = stored.image.device();
        normal_image = Image::from_host(device, Element::f32, normals.data(), {camera.width, camera.height, 3});
        map = Image::from_host(device, Element::f32, thicknesses.data(), {camera.width, camera.height});
    }
};

using Change = std::function<void(SsaoCall&, const Inputs&)>;
const std::pair<const char*, Change> changes[] = {
    {"fast", [](auto& o, const auto&) { sampling_of(o).quality = Quality::fast; }},
    {"accurate", [](auto& o, const auto&) { sampling_of(o).quality = Quality::accurate; }},
    {"border clamp", [](auto& o, const auto&) { o.border = Border::clamp; }},
    {"falloff", [](auto& o, const auto&) { o.falloff = 1; }},
    {"infinite thickness", [](auto& o, const auto&) { o.thickness = oracle::infinite; }},
    {"thickness map", [](auto& o, const Inputs& in) { o.thickness = in.map; }},
    {"back layer", [](auto& o, const Inputs& in) { o.thickness = in.behind; }},
    {"seed", [](auto& o, const auto&) { o.seed = 5; }},
};

} // namespace

TEST_CASE("ssao at half resolution: a plane is open at every tilt under five cameras", "[ssao][half]") {
    double worst = 0;
    long pixels = 0;
    for (const double tilt : {0.0, 30.0, 60.0, 80.0}) {
        const auto plane = oracle::open_plane(tilt * std::numbers::pi / 180, 0.3);
        for (const auto& [name, camera] : oracle::views({.width = width, .height = height})) {
            const auto truth = scene::render(plane.scene, camera);
            for (const Quality quality : qualities) {
                const auto got = visibility_of(stored_of(truth.stored, camera), half(1, quality));
                double off = 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x) {
                        if (!whole_around(truth, x, y, 8))
                            continue;
                        ++pixels;
                        off = std::max(off, std::abs(static_cast<double>(got[index(x, y)]) - 1));
                    }
                INFO(name << ", tilt " << tilt << ", quality " << static_cast<int>(quality));
                CHECK(off <= ssao_plane_error);
                worst = std::max(worst, off);
            }
        }
    }
    std::printf("ssao of planes at half resolution: largest difference from 1 %.2e, %ld pixels\n", worst, pixels);
    CHECK(pixels > 500000);
}

TEST_CASE("ssao at half resolution: nothing leaks over an edge", "[ssao][half]") {
    // Something open before or behind something dark, whose edges lie on even and odd pixels.
    const scene::Scene plate_before_crease{scene::Plane{{0, -3, -20}, {0, 1, 0.5}},
                                           scene::Plane{{0, -3, -20}, {0, -0.5, 1}},
                                           scene::Box{{0.4, -0.93, -5}, {0.53, 0.61, 0.01}}};
    const scene::Scene corner_before_plane{scene::Plane{{0, 0, -40}, {0.2, 0.1, 1}},
                                           scene::Box{{0.11, -0.9, -5}, {0.8, 0.1, 0.8}},
                                           scene::Box{{0.11, -0.2, -5.7}, {0.8, 0.6, 0.1}}};
    const auto near = [](double z) { return z < 8; };
    const auto far = [](double z) { return z > 20 && z < 100; };
    for (const auto& [what, scene, is_open] :
         {std::tuple{"an open plate before a crease", plate_before_crease, std::function<bool(double)>(near)},
          {"a corner before an open plane", corner_before_plane, std::function<bool(double)>(far)}}) {
        const Camera camera = cameras()[0];
        const auto image = scene::render(scene, camera);
        SsaoCall options = half(1.5);
        options.thickness = 1.0;
        const auto got = visibility_of(stored_of(image.stored, camera), options);
        double least = 1, darkest = 1;
        long open = 0;
        for (std::size_t i = 0; i < got.size(); ++i)
            if (is_open(image.z[i])) {
                ++open;
                least = std::min(least, static_cast<double>(got[i]));
            } else if (std::isfinite(image.z[i])) {
                darkest = std::min(darkest, static_cast<double>(got[i]));
            }
        std::printf("%s at half resolution: least visibility of %ld open pixels %.5f, of the others %.2f\n", what, open,
                    least, darkest);
        INFO(what);
        CHECK(open > 300);
        CHECK(darkest < 0.7);
        CHECK(least >= 1 - ssao_plane_error);
    }
}

TEST_CASE("ssao at half resolution: what no pixel beside it tells about is open, and said to be unknown",
          "[ssao][half]") {
    const Camera camera = cameras()[0];
    std::vector<float> values(static_cast<std::size_t>(width) * height, std::nanf(""));
    const auto plane = scene::render({scene::Plane{{0, 0, -3}, {0.3, 0.2, 1}}}, camera).stored;
    for (int y = 1; y < height; y += 2) // no even row is left
        std::copy_n(plane.begin() + y * width, width, values.begin() + y * width);
    SsaoCall options = half(0.5);
    options.confidence = options.bent_normal = true;
    const Occlusion all = ssao(stored_of(values, camera), options);
    const auto visibility = floats(all.visibility), sure = floats(all.confidence), bent = floats(all.bent_normal);
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::isnan(values[i]))
            continue;
        REQUIRE(visibility[i] == 1);
        REQUIRE(sure[i] == 0);
        REQUIRE(bent[3 * i] == 0);
    }
}

// With given normals and a constant thickness: those from depth come from all pixels.
TEST_CASE("ssao at half resolution: every second pixel has what its image alone has, for every option",
          "[ssao][half]") {
    std::printf("ssao at half resolution, every second pixel, against the image of these alone\n");
    for (const Camera& camera : cameras()) {
        const Inputs all(camera), few(all, half_camera(camera));
        for (const auto& [what, change] : changes) {
            SsaoCall options = half(0.8);
            options.confidence = options.bent_normal = true;
            options.normals = all.normal_image;
            options.thickness = 0.2;
            change(options, all);
            const Occlusion got = ssao(all.stored, options);
            sampling_of(options).half_resolution = false;
            options.normals = few.normal_image;
            change(options, few);
            const Occlusion truth = ssao(few.stored, options);
            const Difference off = difference(picked(floats(got.visibility)), floats(truth.visibility));
            const Difference sure = difference(picked(floats(got.confidence)), floats(truth.confidence));
            const Difference bent = difference(picked(floats(got.bent_normal), 3), floats(truth.bent_normal));
            off.print((std::string(name_of(camera)) + ", " + what).c_str());
            INFO(name_of(camera) << ", " << what);
            for (const Difference& one : {off, sure, bent}) {
                CHECK(one.same_kind);
                CHECK(one.mean <= rounding_mean);
            }
            CHECK(off.worst <= rounding_worst);
        }
    }
}
