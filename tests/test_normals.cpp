// normals against analytic scenes: planes at every tilt under every kind of camera, spheres, boxes and whole scenes, for each
// method; quantised and noisy depth; images that are all edges.

#include "camera/rays.hpp"
#include "catch.hpp"
#include "operations/normals.hpp"
#include "regimes/normal_bound.hpp"
#include "stability.hpp"

#include <fathom/fathom.hpp>

#include <scene/scene.hpp>

using namespace fathom;
using Eigen::Vector3d;

namespace {

using stability::camera_of;
using stability::infinity;
using stability::not_a_number;

constexpr double degree = 3.14159265358979323846 / 180;

// What float32 depth of 161 × 121 pixels and 57 by 72 degrees leaves of a plane's normal, inside. An error of depth turns a
// normal the more, the nearer two pixels' rays are: by its share of the depth over their angle.
constexpr double plane_error_deg = 1e-3;

double angle_deg(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) / degree;
}

struct Result {
    int width, height;
    std::vector<float> values; // x, y, z and the validity

    Vector3d at(int x, int y) const {
        const float* n = &values[4 * static_cast<std::size_t>(y * width + x)];
        return {n[0], n[1], n[2]};
    }
    float validity(int x, int y) const { return values[4 * static_cast<std::size_t>(y * width + x) + 3]; }
};

template <typename Value>
StoredDepth stored_of(const std::vector<Value>& values, const Camera& camera, Storage storage = Storage::float32,
                      Arithmetic arithmetic = oracle::widest()) {
    return {Image::from_host(oracle::device(arithmetic), element_of(storage), values.data(),
                             {camera.width, camera.height, channels_of(storage)}),
            camera, storage};
}

Result normals_of(const StoredDepth& stored, NormalsOptions options = {}) {
    options.channels = 4;
    const Image image = normals(stored, options);
    Result result{image.width(), image.height(), {}};
    result.values.resize(4 * static_cast<std::size_t>(result.width * result.height));
    image.download(result.values.data());
    return result;
}

// Each method, and least squares with noise for which its window is a wide one.
const NormalsOptions each_method[] = {{.method = NormalMethod::neighbours},
                                      {.method = NormalMethod::least_squares},
                                      {.method = NormalMethod::least_squares, .noise = 0.04}};

// Unit length with validity 1, or nothing with validity 0.
bool well_formed(const Result& result) {
    for (std::size_t i = 0; i < result.values.size(); i += 4) {
        const float* n = &result.values[i];
        const double length = std::hypot(n[0], n[1], n[2]);
        const bool nothing = n[0] == 0 && n[1] == 0 && n[2] == 0 && n[3] == 0;
        if (!nothing && !(n[3] == 1 && std::abs(length - 1) <= normals_length_error))
            return false;
    }
    return true;
}

struct Subject {
    const char* name;
    Camera camera;
    double distance = 2.5; // of the planes, along the view axis
};

Camera with(Camera camera, Encoding encoding) {
    camera.encoding = encoding;
    if (encoding != Encoding::window) {
        camera.near_plane = 0.5;
        camera.far_plane = 500;
        camera.median = 6;
    }
    return camera;
}

Camera sized(const Projection& projection) {
    return camera_of(projection, 161, 121);
}

std::vector<Subject> cameras() {
    const DepthSpan span{0.5, 500}, reversed{0.5, std::numeric_limits<double>::infinity(), DepthOrder::reversed};
    const Convention opencv{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    const Camera plain = sized(perspective(1.0, 4.0 / 3, span));
    const Camera orthographic_camera = sized(orthographic({-2, 2, -1.5, 1.5}, {0.5, 100}));
    Eigen::Matrix4d tilt = plain.projection.matrix.cast<double>();
    tilt.row(3) = Eigen::RowVector4d(0.06, -0.04, -1, 0);
    Eigen::Matrix4d shear = orthographic_camera.projection.matrix.cast<double>();
    shear(0, 2) = 0.2;
    shear(1, 2) = -0.1;
    Eigen::Matrix4d moved = plain.projection.matrix.cast<double>();
    moved.col(3) -= moved.leftCols<3>() * Vector3d(0.3, -0.1, 0.4);
    Camera bottom_up = plain;
    bottom_up.rows = Rows::bottom_up;
    return {
        {"perspective", plain},
        {"rows bottom up", bottom_up},
        {"off-centre", sized(perspective(FrustumEdges{-0.6, 0.15, -0.15, 0.4}, span))},
        {"OpenCV axes", sized(perspective(1.0, 4.0 / 3, span, opencv))},
        {"Direct3D", sized(perspective(1.0, 4.0 / 3, span, Convention::direct3d()))},
        {"reversed infinite", sized(perspective(1.0, 4.0 / 3, reversed, Convention::vulkan()))},
        {"infinite", sized(perspective(1.0, 4.0 / 3, {0.5, std::numeric_limits<double>::infinity()}))},
        {"oblique", sized(with_oblique_near_plane(plain.projection, {0.2, 0.1, -1, -0.6}))},
        {"150 degrees", sized(perspective(150 * degree, 4.0 / 3, span))},
        {"tilted", sized(from_matrix(tilt))},
        {"centre moved", sized(from_matrix(moved)), 2.9},
        {"orthographic", orthographic_camera},
        {"oblique orthographic", sized(with_oblique_near_plane(orthographic_camera.projection, {0.2, -0.1, -1, -0.6}))},
        {"sheared orthographic", sized(from_matrix(shear))},
        {"view-z", with(plain, Encoding::view_z)},
        {"linear", with(plain, Encoding::linear)},
        {"ray distance", with(plain, Encoding::ray_distance)},
        {"ray distance, tilted", with(sized(from_matrix(tilt)), Encoding::ray_distance)},
        {"logarithmic", with(plain, Encoding::logarithmic)},
        {"exponential", with(plain, Encoding::exponential)},
        {"median", with(plain, Encoding::median)},
        {"inverse", with(plain, Encoding::inverse)},
        {"orthographic, view-z", with(orthographic_camera, Encoding::view_z)},
    };
}

struct PlaneErrors {
    double worst = 0, share = 0;
    long pixels = 0;
};

void judge_plane(const scene::Rendered& truth, const Camera& camera, const Result& result, int reach,
                 PlaneErrors& errors) {
    const regimes::NormalBound promise(camera);
    for (int y = reach; y < camera.height - reach; ++y)
        for (int x = reach; x < camera.width - reach; ++x) {
            bool inside = true;
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    inside &= std::isfinite(truth.z[static_cast<std::size_t>((y + dy) * camera.width + x + dx)]);
            if (!inside)
                continue;
            const auto i = static_cast<std::size_t>(y * camera.width + x);
            const double off = angle_deg(result.at(x, y), truth.normal[i]);
            errors.worst = std::max(errors.worst, off);
            errors.share = std::max(errors.share, off / promise.degrees(x, y, truth.z[i], truth.normal[i]));
            ++errors.pixels;
        }
}

// A sphere that fills most of the image, and a box seen at three of its faces, both before an open sky.
const scene::Scene sphere{scene::Sphere{{0, 0, -3}, 1}};
const scene::Scene box{scene::Box{{0.2, -0.5, -4}, {1, 0.8, 0.9}, 0.6}};

struct Score {
    double mean = 0, within = 0; ///< degrees; percent of the pixels that are off by 1 degree at most
};

Score score(const Result& result, const scene::Rendered& truth) {
    double sum = 0;
    long pixels = 0, good = 0;
    for (int y = 0; y < truth.height; ++y)
        for (int x = 0; x < truth.width; ++x) {
            const auto i = static_cast<std::size_t>(y * truth.width + x);
            if (!std::isfinite(truth.z[i]))
                continue;
            const double off = angle_deg(result.at(x, y), truth.normal[i]);
            sum += off;
            good += off <= 1;
            ++pixels;
        }
    return {sum / static_cast<double>(pixels), 100 * static_cast<double>(good) / static_cast<double>(pixels)};
}

struct Comparison {
    const char* scene;
    scene::Scene content;
    // As measured, float32, then D16, then 16 bits that are linear from 0.1 to 100.
    Score neighbours[3], least_squares[3];
};

// Another host may round the scene's pixels at an edge differently.
constexpr double mean_slack = 1.2, within_slack = 0.5;

constexpr double sensor_noise = 9e-4;

// The middle of an image of 1920 × 1080 pixels and 0.9 radians from top to bottom, as view depth in OpenCV's axes.
Camera sensor(int width = 480, int height = 270) {
    const double f = 540 / std::tan(0.45);
    const Convention opencv{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    return with(camera_of(perspective(Intrinsics{f, f, 0.5 * width, 0.5 * height, width, height}, {0.1, 100}, opencv),
                          width, height),
                Encoding::view_z);
}

std::vector<float> noisy(const scene::Rendered& truth, double noise) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, noise);
    std::vector<float> depth;
    for (const double z : truth.z)
        depth.push_back(static_cast<float>(z * (1 + normal(random))));
    return depth;
}

scene::Rendered tilted_plane(const Camera& camera, double tilt) {
    const Vector3d normal(std::sin(tilt) * std::cos(1.3), std::sin(tilt) * std::sin(1.3), std::cos(tilt));
    return scene::render({scene::Plane{{0, 0, -2.5}, normal}}, camera);
}

// The plane of least squares through 1/z = a x + b y + c of all pixels of a window, and its normal: n P = d says that
// 1/z = (n_x X + n_y Y + n_z) / d with X = (x - cx) / fx and Y = (y - cy) / fy.
Vector3d brute_force(const std::vector<float>& depth, const Camera& camera, int x, int y, int radius) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    Vector3d sums = Vector3d::Zero();
    for (int v = y - radius; v <= y + radius; ++v)
        for (int u = x - radius; u <= x + radius; ++u) {
            const Vector3d terms(u - x, v - y, 1);
            squares += terms * terms.transpose();
            sums += terms / static_cast<double>(depth[static_cast<std::size_t>(v * camera.width + u)]);
        }
    const Vector3d plane = squares.ldlt().solve(sums);
    const double f = 540 / std::tan(0.45), a = plane[0], b = plane[1];
    const double c = plane[2] + a * (0.5 * camera.width - x - 0.5) + b * (0.5 * camera.height - y - 0.5);
    return -Vector3d(a * f, b * f, c).normalized();
}

// Neighbouring pixels' windows overlap, so the mean over an image is one of a thousand windows, each off by half of itself.
constexpr double sampling_error = 0.05;

// Of a plane's pixels: those whose window has no pixel more than four standard deviations off. The kernel's plane is drawn
// towards that of the small window with the weight of one pixel, by a thousandth of a normal's error.
constexpr double whole_windows = 0.95, drawn_deg = 0.02;

// Slopes of floats are off by less than two roundings of the inverse depth a pixel, each, and a normal by that over a pixel's angle.
const double sensor_rounding_deg = std::sqrt(2.0) * 2 * 0x1p-24 / (std::tan(0.45) / 540) / degree;

// As many pixels as `whole_windows` says have the normal of brute force over their whole window, within an angle.
void check_whole_windows(const Result& result, const std::vector<float>& depth, const Camera& camera, int radius,
                         double within_deg) {
    double worst = 0;
    long same = 0, pixels = 0;
    for (int y = radius; y < camera.height - radius; ++y)
        for (int x = radius; x < camera.width - radius; ++x) {
            const double off = angle_deg(result.at(x, y), brute_force(depth, camera, x, y, radius));
            worst = std::max(worst, off);
            same += off <= within_deg;
            ++pixels;
        }
    const double fraction = static_cast<double>(same) / static_cast<double>(pixels);
    std::printf("%.2f %% as by brute force, worst %.3f degrees\n", 100 * fraction, worst);
    CHECK(fraction >= whole_windows);
}

} // namespace

TEST_CASE("normals: planes at tilts up to 85 degrees under every camera", "[normals][exact]") {
    std::printf("normals of planes, worst error in degrees (fraction of normals_slope_error's promise)\n");
    for (const Subject& subject : cameras()) {
        PlaneErrors neighbours, least_squares;
        for (const double tilt : {0.0, 30.0, 60.0, 75.0, 85.0})
            for (const double around : {0.0, 77.0, 200.0}) {
                // The scene's world has the OpenGL axes, the result the projection's own.
                const Vector3d normal(std::sin(tilt * degree) * std::cos(around * degree),
                                      std::sin(tilt * degree) * std::sin(around * degree), std::cos(tilt * degree));
                const scene::Rendered truth =
                    scene::render({scene::Plane{{0, 0, -subject.distance}, normal}}, subject.camera);
                const auto arithmetic = tilt == 30 ? Arithmetic::two_float : oracle::widest();
                const StoredDepth stored = stored_of(truth.stored, subject.camera, Storage::float32, arithmetic);
                const Result nearest = normals_of(stored, {.method = NormalMethod::neighbours});
                const Result fitted = normals_of(stored, {.method = NormalMethod::least_squares});
                CHECK(well_formed(nearest));
                CHECK(well_formed(fitted));
                judge_plane(truth, subject.camera, nearest, normals_reach_neighbours, neighbours);
                judge_plane(truth, subject.camera, fitted, normals_reach_least_squares, least_squares);
            }
        std::printf("  %-22s neighbours %.2e (%.3f)   least squares %.2e   %ld pixels\n", subject.name,
                    neighbours.worst, neighbours.share, least_squares.worst, neighbours.pixels);
        INFO(subject.name);
        CHECK(neighbours.pixels > 60000);
        CHECK(neighbours.worst <= plane_error_deg);
        CHECK(neighbours.share <= 1);
        CHECK(least_squares.worst <= plane_error_deg);
    }
}

TEST_CASE("normals: spheres, boxes and whole scenes, by method and storage", "[normals]") {
    const Comparison comparisons[] = {
        {"sphere",
         sphere,
         {{0.079, 97.38}, {0.625, 83.75}, {1.272, 47.32}},
         {{0.079, 97.38}, {0.210, 97.50}, {0.335, 95.49}}},
        {"box", box, {{0.003, 100}, {0.362, 97.63}, {0.515, 87.79}}, {{0.002, 100}, {0.200, 99.60}, {0.321, 96.56}}},
        {"room",
         scene::room(),
         {{0.130, 99.41}, {0.554, 94.06}, {0.306, 96.66}},
         {{0.129, 99.41}, {0.469, 97.13}, {0.238, 98.59}}},
        {"spheres",
         scene::spheres(),
         {{0.186, 95.92}, {0.722, 79.84}, {0.651, 81.20}},
         {{0.186, 95.92}, {0.403, 94.07}, {0.397, 93.86}}},
        {"slant",
         scene::slant(),
         {{0.010, 100}, {2.041, 0}, {0.795, 73.38}},
         {{0.002, 100}, {0.262, 99.56}, {0.127, 99.86}}},
    };
    std::printf("normals, mean error in degrees and share within 1 degree: neighbours | least squares\n");
    Camera window = camera_of(perspective(1.0, 4.0 / 3, {0.1, 1000}), 640, 480);
    Camera linear = with(window, Encoding::linear);
    linear.near_plane = 0.1;
    linear.far_plane = 100;
    for (const Comparison& comparison : comparisons) {
        const scene::Rendered truth = scene::render(comparison.content, window),
                              linear_truth = scene::render(comparison.content, linear);
        const auto codes = scene::codes16(truth, window), linear_codes = scene::codes16(linear_truth, linear);
        const StoredDepth inputs[] = {stored_of(truth.stored, window), stored_of(codes, window, Storage::uint16),
                                      stored_of(linear_codes, linear, Storage::uint16)};
        const char* const names[] = {"float32", "D16", "linear, 16 bits"};
        for (std::size_t i = 0; i < std::size(inputs); ++i) {
            const Score neighbours = score(normals_of(inputs[i], {.method = NormalMethod::neighbours}), truth);
            const Score fitted = score(normals_of(inputs[i], {.method = NormalMethod::least_squares}), truth);
            std::printf("  %-8s %-16s %6.3f  %6.2f %%  | %6.3f  %6.2f %%\n", comparison.scene, names[i],
                        neighbours.mean, neighbours.within, fitted.mean, fitted.within);
            INFO(comparison.scene << ", " << names[i]);
            CHECK(neighbours.mean <= mean_slack * comparison.neighbours[i].mean);
            CHECK(neighbours.within >= comparison.neighbours[i].within - within_slack);
            CHECK(fitted.mean <= mean_slack * comparison.least_squares[i].mean);
            CHECK(fitted.within >= comparison.least_squares[i].within - within_slack);
        }
    }
}

TEST_CASE("normals: planes under a sensor's noise", "[normals][noise]") {
    const Camera camera = sensor();
    const int radius = window_radius(camera, sensor_noise);
    const double side = 2 * radius + 1, per_pixel = std::tan(0.45) / 540;
    // Two slopes' errors, each normal: the length of both has the mean of Rayleigh's distribution.
    const double expected = std::sqrt(std::numbers::pi / 2) * sensor_noise /
                            std::sqrt(side * side * radius * (radius + 1) / 3) / per_pixel / degree;
    std::printf(
        "normals of planes with noise of %g, mean error in degrees: neighbours, least squares, with noise told\n",
        sensor_noise);
    for (const double tilt : {0.0, 30.0, 60.0}) {
        const scene::Rendered truth = tilted_plane(camera, tilt * degree);
        const std::vector<float> depth = noisy(truth, sensor_noise);
        const StoredDepth stored = stored_of(depth, camera);
        const double half_steps = 3 * sensor_noise / 0x1p-24;
        const Score nearest = score(normals_of(stored, {.method = NormalMethod::neighbours}), truth);
        const Score narrow =
            score(normals_of(stored, {.method = NormalMethod::least_squares, .tolerance = half_steps}), truth);
        const Score told = score(normals_of(stored, {.noise = sensor_noise}), truth);
        std::printf("  tilted by %2.0f: %6.2f  %6.2f  %6.2f (expected of a facing one with radius %d: %.2f)\n", tilt,
                    nearest.mean, narrow.mean, told.mean, radius, expected);
        CHECK(told.mean <= normals_noise_error_deg);
        CHECK(told.mean < 0.75 * narrow.mean);
        if (tilt == 0)
            CHECK(std::abs(told.mean / expected - 1) <= sampling_error);
    }
}

TEST_CASE("normals: noise has every pixel of a plane's wide window count", "[normals][noise]") {
    const Camera camera = sensor(120, 90);
    for (const double noise : {2e-4, 5e-4, 9e-4}) {
        const int radius = window_radius(camera, noise);
        const std::vector<float> depth = noisy(tilted_plane(camera, 0.7), noise);
        std::printf("normals with noise %g: window of radius %d, ", noise, radius);
        check_whole_windows(normals_of(stored_of(depth, camera), {.noise = noise}), depth, camera, radius, drawn_deg);
    }
}

TEST_CASE("normals: every pixel of a coarse plane's window counts", "[normals]") {
    Camera camera = sensor(120, 90);
    camera.scale = 0.001;
    constexpr int radius = normals_reach_least_squares;
    for (const double tilt : {0.0, 0.3, 0.7}) {
        const scene::Rendered truth = tilted_plane(camera, tilt);
        std::vector<std::uint16_t> codes;
        std::vector<float> depth;
        for (const double z : truth.z) {
            codes.push_back(static_cast<std::uint16_t>(std::lround(z * 1000)));
            depth.push_back(static_cast<float>(codes.back() * camera.scale));
        }
        std::printf("normals of a plane of millimetres, tilted by %.1f: ", tilt);
        check_whole_windows(normals_of(stored_of(codes, camera, Storage::uint16)), depth, camera, radius,
                            sensor_rounding_deg);
    }
}

TEST_CASE("normals: the window is as wide as noise and a pixel's angle ask for", "[normals][noise]") {
    const auto radius = [](const Camera& camera, double noise) { return window_radius(camera, noise); };
    const Camera camera = sensor();
    CHECK(radius(camera, 0) == normals_reach_least_squares);
    CHECK(radius(camera, 2.5e-4) == 3);
    CHECK(radius(camera, 2.7e-4) == 5);
    CHECK(radius(camera, 6.4e-4) == 5);
    CHECK(radius(camera, 6.6e-4) == normals_reach_noise);
    // Larger pixels need a smaller window; and every part of the image has the same.
    CHECK(radius(sized(perspective(0.9, 16.0 / 9, {0.1, 100})), 2.5e-3) == 3);
    CHECK(radius(sensor(64, 48), 2.7e-4) == 5);
}

TEST_CASE("normals: the world's are the view's, turned", "[normals]") {
    Camera camera = camera_of(perspective(1.0, 4.0 / 3, {0.1, 100}), 96, 64);
    Eigen::Isometry3d view = Eigen::Isometry3d::Identity();
    view.rotate(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -0.5).normalized()));
    const Eigen::Matrix3d turned = view.linear();
    view.translate(Vector3d(3, 4, 5));
    for (const bool is_orthographic : {false, true}) {
        if (is_orthographic)
            camera.projection = orthographic({-4, 4, -3, 3}, {0.1, 100});
        camera.view = std::nullopt;
        const scene::Rendered truth = scene::render(scene::room(), camera);
        const Result in_view = normals_of(stored_of(truth.stored, camera));
        camera.view = view.matrix();
        const Result in_world = normals_of(stored_of(truth.stored, camera), {.space = Space::world});
        CHECK(well_formed(in_world));
        double worst = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x)
                worst = std::max(worst, (turned * in_world.at(x, y) - in_view.at(x, y)).norm());
        CHECK(worst < 1e-6);
    }
    camera.view = std::nullopt;
    const std::vector<float> stored(96 * 64, 0.5f);
    CHECK_THROWS_WITH(normals(stored_of(stored, camera), {.space = Space::world}),
                      "normals in the world need the camera's view matrix, and it has none");
}

TEST_CASE("normals: options that do not fit are refused, and the method follows the storage", "[normals]") {
    const Camera camera = camera_of(perspective(1.0, 1, {1, 4}), 8, 8);
    const std::vector<float> values(64, 0.5f);
    const StoredDepth stored = stored_of(values, camera);
    CHECK_THROWS_WITH(normals(stored, {.method = static_cast<NormalMethod>(3)}),
                      "method = 3 must be automatic, neighbours or least-squares");
    CHECK_THROWS_WITH(normals(stored, Image(oracle::device(), Element::f32, {8, 8, 4})),
                      "the result holds 4 floats a pixel; it must hold 3 floats");
    CHECK_THROWS_WITH(normals(stored, {.method = MaxError{90}, .noise = 0.001}),
                      "noise and max_error exclude each other: give one of the two");
    CHECK(chosen_method({}, stored) == NormalMethod::neighbours);
    CHECK(chosen_method({.noise = 0.001}, stored) == NormalMethod::least_squares);
    CHECK(chosen_method({.method = NormalMethod::neighbours, .noise = 0.001}, stored) == NormalMethod::neighbours);
    Camera read_back = camera;
    read_back.depth_bits = 16;
    CHECK(chosen_method({}, stored_of(values, read_back)) == NormalMethod::least_squares);
    const std::vector<std::uint16_t> codes(64, 30000);
    CHECK(chosen_method({}, stored_of(codes, camera, Storage::uint16)) == NormalMethod::least_squares);
}

TEST_CASE("stability: normals of images that are all border", "[normals][stability]") {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {17, 2}, {33, 5}})
        for (const bool is_orthographic : {false, true}) {
            const Camera camera =
                camera_of(is_orthographic ? orthographic({-2, 2, -2, 2}, {0.1, 100}) : perspective(1.0, 1, {0.1, 100}),
                          width, height);
            // A plane across the axis faces it wherever neighbours are missing; a slanted one is found where they are there.
            const scene::Rendered facing = scene::render({scene::Plane{{0, 0, -3}, {0, 0, 1}}}, camera);
            const scene::Rendered slanted =
                scene::render({scene::Plane{{0, 0, -9}, Vector3d(0.2, 0.1, 1).normalized()}}, camera);
            for (const NormalsOptions& options : each_method) {
                INFO(width << " x " << height << (is_orthographic ? ", orthographic" : ", perspective"));
                const Result across = normals_of(stored_of(facing.stored, camera), options);
                const Result aslant = normals_of(stored_of(slanted.stored, camera), options);
                CHECK(well_formed(across));
                CHECK(well_formed(aslant));
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x) {
                        CHECK(angle_deg(across.at(x, y), {0, 0, 1}) < 0.01);
                        CHECK(aslant.validity(x, y) == 1);
                        if (width > 1 && height > 1)
                            CHECK(angle_deg(aslant.at(x, y), slanted.normal.front()) < 0.01);
                    }
            }
        }
}

TEST_CASE("stability: normals beside invalid pixels", "[normals][stability]") {
    const int width = 64, height = 48;
    for (const bool is_orthographic : {false, true}) {
        const Camera camera = camera_of(is_orthographic ? orthographic({-2, 2, -1.5, 1.5}, {0.1, 100})
                                                        : perspective(1.0, 4.0 / 3, {0.1, 100}),
                                        width, height);
        const Vector3d normal = Vector3d(0.5, 0.3, 1).normalized();
        const scene::Rendered plane = scene::render({scene::Plane{{0, 0, -4}, normal}}, camera);
        for (const float none : {not_a_number, 1.0f, -1.0f, infinity}) {
            // Holes at random, single pixels, pairs and a frame of surface one pixel wide among them: each has a normal,
            // and where it has a neighbour on both axes it is the plane's.
            std::mt19937 random(2);
            std::vector<float> holed = plane.stored;
            for (std::size_t i = 0; i < holed.size(); ++i)
                if (random() % 3 == 0)
                    holed[i] = none;
            const auto there = [&](int x, int y) {
                return x >= 0 && y >= 0 && x < width && y < height &&
                       holed[static_cast<std::size_t>(y * width + x)] ==
                           plane.stored[static_cast<std::size_t>(y * width + x)];
            };
            for (const NormalsOptions& options : each_method) {
                const Result result = normals_of(stored_of(holed, camera), options);
                CHECK(well_formed(result));
                double worst = 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x) {
                        REQUIRE(result.validity(x, y) == (there(x, y) ? 1.0f : 0.0f));
                        if (there(x, y) && (there(x - 1, y) || there(x + 1, y)) && (there(x, y - 1) || there(x, y + 1)))
                            worst = std::max(worst, angle_deg(result.at(x, y), normal));
                    }
                CHECK(worst < 0.02);
            }
            const Result sky = normals_of(stored_of(std::vector<float>(holed.size(), none), camera));
            CHECK(std::ranges::all_of(sky.values, [](float value) { return value == 0; }));
        }
    }
}

TEST_CASE("stability: normals at a step, a crease and a bar one pixel wide", "[normals][stability]") {
    // Two planes across the axis with a step between columns 15 and 16: no pixel takes its slope across.
    const Camera camera = camera_of(perspective(1.0, 4.0 / 3, {0.1, 100}), 32, 24);
    const scene::Rendered near = scene::render({scene::Plane{{0, 0, -2}, {0.3, 0, 1}}}, camera),
                          far = scene::render({scene::Plane{{0, 0, -5}, {-0.2, 0.4, 1}}}, camera);
    const auto joined = [&](auto from_near) {
        scene::Rendered both = far;
        for (int y = 0; y < 24; ++y)
            for (int x = 0; x < 32; ++x) {
                const auto i = static_cast<std::size_t>(y * 32 + x);
                if (from_near(x, y)) {
                    both.stored[i] = near.stored[i];
                    both.normal[i] = near.normal[i];
                }
            }
        return both;
    };
    for (const NormalsOptions& options : each_method) {
        const auto worst = [&](const scene::Rendered& both) {
            const Result result = normals_of(stored_of(both.stored, camera), options);
            double angle = 0;
            for (int y = 0; y < 24; ++y)
                for (int x = 0; x < 32; ++x)
                    angle =
                        std::max(angle, angle_deg(result.at(x, y), both.normal[static_cast<std::size_t>(y * 32 + x)]));
            return angle;
        };
        CHECK(worst(joined([](int x, int) { return x < 16; })) < 0.01);
        CHECK(worst(joined([](int x, int y) { return x < 16 && y > 9; })) < 0.01);
        CHECK(worst(joined([](int x, int y) { return x > 13 && x < 17 && y > 9 && y < 14; })) < 0.01);
        // A bar one pixel wide has no neighbour of its own across: whatever its normal is, the planes beside keep theirs.
        const scene::Rendered bar = joined([](int x, int) { return x == 15; });
        const Result result = normals_of(stored_of(bar.stored, camera), options);
        CHECK(well_formed(result));
        for (int y = 0; y < 24; ++y)
            for (const int x : {12, 13, 14, 16, 17, 18})
                REQUIRE(angle_deg(result.at(x, y), far.normal.front()) < 0.01);
    }
}
