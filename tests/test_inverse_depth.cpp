// Inverse depth and the bound of its error: for every encoding and storage, stored to the nearest value and decoded again.

#include "camera/rays.hpp"
#include "camera_over.hpp"
#include "catch.hpp"
#include "judge.hpp"
#include "operations/inverse_depth.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int width = 64, height = 48;

// The bound is of first order: a step of depth that is 1% of the depth itself moves q by 1% more.
constexpr double second_order = 1.01;

struct Subject {
    const char* name;
    Camera camera;
    Storage storage;
    double near, far; ///< depths to try
};

Camera camera_of(const Projection& projection) {
    return camera_over(projection, width, height);
}

Camera with(Camera camera, Encoding encoding, double scale = 1) {
    camera.encoding = encoding;
    camera.scale = scale;
    if (encoding != Encoding::window) {
        camera.near_plane = 0.5;
        camera.far_plane = 500;
        camera.median = 6;
    }
    return camera;
}

Camera along_ray(Camera camera) {
    camera.along = Along::ray;
    return camera;
}

Camera measured(Camera camera, double offset) {
    camera.offset = offset;
    return camera;
}

std::vector<Subject> subjects() {
    const Camera plain = camera_of(perspective(1.0, 4.0 / 3, {0.5, 500}));
    const Camera reversed = camera_of(perspective(1.0, 4.0 / 3, {0.5, infinity, DepthOrder::reversed}));
    const Camera deep = camera_of(perspective(1.0, 4.0 / 3, {0.1, 1e5}));
    const Camera oblique = camera_of(with_oblique_near_plane(plain.projection, {0.2, 0.1, -1, -1}));
    const Camera orthographic_camera = camera_of(orthographic({-4, 4, -3, 3}, {0.5, 500}));
    Eigen::Matrix4d matrix = plain.projection.matrix.cast<double>();
    matrix.row(3) = Eigen::RowVector4d(0.06, -0.04, -1, 0);
    const Camera tilted = camera_of(from_matrix(matrix));
    Camera read_back = plain;
    read_back.depth_bits = 16;
    const auto f32 = Storage::float32, u16 = Storage::uint16, u24 = Storage::uint24, f16 = Storage::float16;
    return {
        {"window, float32", plain, f32, 0.6, 400},
        {"window, uint16", plain, u16, 0.6, 400},
        {"window, uint24", plain, u24, 0.6, 400},
        {"window, float16", plain, f16, 0.6, 400},
        {"window, read back from 16 bits", read_back, f32, 0.6, 400},
        {"window, far/near 1e6", deep, f32, 0.2, 5e4},
        {"window, reversed infinite", reversed, f32, 0.6, 1e6},
        {"oblique", oblique, f32, 1.6, 300},
        {"oblique, uint24", oblique, u24, 1.6, 300},
        {"tilted", tilted, f32, 0.6, 300},
        {"tilted, uint16", tilted, u16, 0.6, 300},
        {"tilted, view-z", with(tilted, Encoding::view_z), f32, 0.6, 300},
        {"orthographic", orthographic_camera, f32, 0.6, 400},
        {"orthographic, uint16", orthographic_camera, u16, 0.6, 400},
        {"view-z", with(plain, Encoding::view_z), f32, 0.6, 400},
        {"view-z, float16", with(plain, Encoding::view_z), f16, 0.6, 400},
        {"view-z, millimetres", with(plain, Encoding::view_z, 0.001), u16, 0.6, 60},
        {"ray distance", with(plain, Encoding::ray_distance), f32, 0.6, 400},
        {"ray distance, millimetres", with(plain, Encoding::ray_distance, 0.001), u16, 0.6, 50},
        {"linear, uint16", with(plain, Encoding::linear), u16, 0.6, 400},
        {"linear", with(plain, Encoding::linear), f32, 0.6, 400},
        {"logarithmic", with(plain, Encoding::logarithmic), f32, 0.6, 400},
        {"logarithmic, uint16", with(plain, Encoding::logarithmic), u16, 0.6, 400},
        {"exponential, uint16", with(plain, Encoding::exponential), u16, 0.6, 400},
        {"median", with(plain, Encoding::median), f32, 0.6, 400},
        {"median, uint16", with(plain, Encoding::median), u16, 0.6, 400},
        {"inverse", with(plain, Encoding::inverse), f32, 0.6, 400},
        {"inverse, uint16", with(plain, Encoding::inverse, 1000), u16, 0.6, 400},
        {"inverse, uint8", with(plain, Encoding::inverse, 100), Storage::uint8, 0.6, 60},
        {"inverse, offset", measured(with(plain, Encoding::inverse), 0.01), f32, 0.6, 90},
        {"inverse range, uint16", with(plain, Encoding::inverse_range), u16, 0.6, 400},
        {"inverse range along the ray, uint16", along_ray(with(plain, Encoding::inverse_range)), u16, 0.6, 400},
        {"inverse range along tilted rays", along_ray(with(tilted, Encoding::inverse_range)), f32, 0.6, 300},
        {"linear along the ray, uint16", along_ray(with(plain, Encoding::linear)), u16, 0.6, 400},
        {"linear along the ray", along_ray(with(plain, Encoding::linear)), f32, 0.6, 400},
        {"inverse along the ray, offset", along_ray(measured(with(plain, Encoding::inverse), 0.01)), f32, 0.6, 90},
    };
}

// A stored value that its storage can hold, as the storage's element.
template <typename Value>
Value rounded(const Subject& subject, long double exact) {
    if (subject.storage == Storage::float16) {
        const int exponent = std::max(std::ilogb(exact), -14);
        const auto fraction = static_cast<std::uint32_t>(std::nearbyint(std::ldexp(exact, 10 - exponent)));
        return static_cast<Value>(
            fraction < 1024 ? fraction : (static_cast<std::uint32_t>(exponent + 15) << 10) + fraction - 1024);
    }
    if constexpr (std::is_same_v<Value, float>) {
        if (subject.camera.depth_bits) {
            const long double codes = std::exp2(static_cast<long double>(*subject.camera.depth_bits)) - 1;
            return static_cast<float>(std::round(exact * codes) / codes);
        }
        return static_cast<float>(exact);
    } else {
        return static_cast<Value>(std::round(exact));
    }
}

struct Found {
    double worst = 0, typical = 0; ///< error over its bound: the largest, and the largest of the farthest tenth
};

template <typename Value>
Found judge(const Subject& subject) {
    const CentreRays rays = centre_rays(camera_rays(subject.camera));
    const DepthForm form = depth_form(subject.camera, subject.storage);
    const InverseDepthError error = inverse_depth_error(subject.camera, subject.storage);
    std::vector<Value> stored(width * height);
    std::vector<double> exact(stored.size(), 0); // 0: outside the view volume
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform;
    for (std::size_t i = 0; i < stored.size(); ++i) {
        const double x = static_cast<double>(i % width) + 0.5, y = static_cast<double>(i / width) + 0.5;
        const double z = subject.near * std::pow(subject.far / subject.near, uniform(random));
        const long double value = stored_depth(subject.camera, subject.storage, x, y, z);
        stored[i] = rounded<Value>(subject, value);
        const long double covered = rays.depth(0) * x + rays.depth(1) * y + rays.depth(2);
        if (value >= form.lowest && value < form.highest)
            exact[i] = static_cast<double>(rays.perspective ? covered / (z - rays.centre_depth) : -z);
    }
    Found found;
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        const Device& device = oracle::device(arithmetic);
        const Image image = Image::from_host(device, element_of(subject.storage), stored.data(), {width, height});
        runtime::Scratch scratch(device);
        std::vector<float> q(stored.size());
        inverse_depth(scratch, {image, subject.camera, subject.storage}).download(q.data());
        for (std::size_t i = 0; i < q.size(); ++i) {
            if (exact[i] == 0)
                continue;
            const double size = std::abs(exact[i]);
            const double bound = static_cast<double>(error.constant) + static_cast<double>(error.linear) * size +
                                 static_cast<double>(error.quadratic) * size * size;
            const double share = std::abs(static_cast<double>(q[i]) - exact[i]) / bound;
            found.worst = std::max(found.worst, std::isfinite(share) ? share : infinity);
            const double z = rays.perspective ? 1 / size : size;
            if (z > subject.near * std::pow(subject.far / subject.near, 0.9))
                found.typical = std::max(found.typical, share);
        }
    }
    return found;
}

} // namespace

TEST_CASE("inverse depth: its error is within its bound, and not far below", "[inverse_depth]") {
    for (const Subject& subject : subjects()) {
        const Element element = element_of(subject.storage);
        const Found found = element == Element::f32   ? judge<float>(subject)
                            : element == Element::u32 ? judge<std::uint32_t>(subject)
                            : element == Element::u8  ? judge<std::uint8_t>(subject)
                                                      : judge<std::uint16_t>(subject);
        const InverseDepthError error = inverse_depth_error(subject.camera, subject.storage);
        std::printf("inverse depth, %-32s %.2e + %.2e q + %.2e q^2: worst %.3f of the bound, far away %.3f\n",
                    subject.name, static_cast<double>(error.constant), static_cast<double>(error.linear),
                    static_cast<double>(error.quadratic), found.worst, found.typical);
        INFO(subject.name);
        CHECK(found.worst <= second_order);
        CHECK(found.typical > 0.2);
    }
}

TEST_CASE("inverse depth: background is the farthest, and invalid pixels have none", "[inverse_depth]") {
    const Camera perspective_camera = camera_of(perspective(1.0, 4.0 / 3, {0.5, 500}));
    const Camera orthographic_camera = camera_of(orthographic({-4, 4, -3, 3}, {0.5, 500}));
    for (Camera camera : {perspective_camera, orthographic_camera}) {
        camera.width = 3;
        camera.height = 1;
        const CentreRays rays = centre_rays(camera_rays(camera));
        const float stored[] = {1.0f, std::numeric_limits<float>::quiet_NaN(), 0.5f};
        for (const Arithmetic arithmetic : oracle::arithmetics()) {
            const Device& device = oracle::device(arithmetic);
            runtime::Scratch scratch(device);
            float q[3];
            inverse_depth(scratch, {Image::from_host(device, Element::f32, stored, {3, 1}), camera}).download(q);
            CHECK(q[0] == (rays.perspective ? 0.0f : -std::numeric_limits<float>::infinity()));
            CHECK(std::isnan(q[1]));
            CHECK(q[2] == Approx(rays.perspective ? 1 / 0.999001 : -250.25).epsilon(1e-5));
        }
    }
}
