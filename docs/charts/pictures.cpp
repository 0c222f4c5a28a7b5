// The charts of docs/camera.md, docs/ambient-occlusion.md and docs/research.md: fathom_charts FOLDER. The
// library computes every curve.

#include "article_pictures.hpp"
#include "chart.hpp"

#include <fathom/fathom.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>

using namespace fathom;
using namespace fathom::charts;
using Look = Series::Look;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const FrustumEdges centred{-0.5, 0.5, -0.375, 0.375};

Camera camera_of(const Projection& projection, int width = 640, int height = 480) {
    Camera camera;
    camera.projection = projection;
    camera.width = width;
    camera.height = height;
    return camera;
}

double stored(const Camera& camera, double x, double y, double z) {
    return static_cast<double>(stored_depth(camera, Storage::float32, x, y, z));
}

// Values from low to high, evenly spread over their logarithm.
std::vector<double> spread(double low, double high, int count) {
    std::vector<double> values;
    for (int i = 0; i < count; ++i)
        values.push_back(low * std::pow(high / low, i / (count - 1.0)));
    return values;
}

template <typename Function>
Series curve(std::string label, int color, const std::vector<double>& xs, Function y, Look look = Look::line) {
    Series series{std::move(label), {}, color, look};
    for (const double x : xs)
        series.points.emplace_back(x, y(x));
    return series;
}

Series segment(std::string label, int color, std::vector<std::pair<double, double>> points, Look look = Look::line) {
    return {std::move(label), std::move(points), color, look};
}

// Seen from above, depth to the right: what `camera_rays` gives for a row of pixels.
Chart rays_from_above(const char* title, const Projection& projection, double farthest) {
    Chart chart{title, {"depth z", -0.6, 5, {0, 1, 2, 3, 4}}, {"x", -2.6, 2.6, {-2, -1, 0, 1, 2}}, {}, 24};
    const Camera camera = camera_of(projection);
    const Rays ray = camera_rays(camera);
    Series marks{"", {}, 2, Look::dots};
    Series origins{"", {}, 3, Look::dots};
    for (const double x : {0.0, 80.0, 160.0, 240.0, 320.0, 400.0, 480.0, 560.0, 640.0}) {
        const Eigen::Matrix<long double, 3, 1> pixel(x, 240, 1), origin = ray.origin * pixel,
                                                                 direction = ray.direction * pixel;
        const auto at = [&](double z) { return std::pair{z, static_cast<double>(origin.x() + z * direction.x())}; };
        chart.series.push_back(segment("", 1, {at(0), at(farthest)}, Look::thin));
        for (const double z : {1.0, 2.0, 3.0, 4.0})
            marks.points.push_back(at(z));
        origins.points.push_back(at(0));
    }
    chart.series.push_back(marks);
    chart.series.push_back(origins);
    return chart;
}

void draw_rays(const std::filesystem::path& folder) {
    write(folder / "rays.svg",
          {rays_from_above("Perspective: one origin", perspective(FrustumEdges{-0.5, 0.5, -0.4, 0.4}, {1, 10}), 4.6),
           rays_from_above("Orthographic: one direction", orthographic({-2, 2, -1.5, 1.5}, {0, 10}), 4.6)},
          860, 330);
}

// A plane through the view axis at depth 3, turned by an angle; the world seen from above.
Projection with_turned_plane(const Projection& projection, double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    return with_oblique_near_plane(projection, {std::sin(angle), 0, -std::cos(angle), -3 * std::cos(angle)});
}

void draw_oblique(const std::filesystem::path& folder) {
    const double near = 1, far = 10, slope = 0.5;
    const Projection plain = perspective(FrustumEdges{-slope, slope, -0.4, 0.4}, {near, far});
    const Camera camera = camera_of(with_turned_plane(plain, 20));
    Chart chart{"A near plane turned by 20°, from above",
                {"depth z", 0, 19, {0, 3, 5, 10, 15}},
                {"x", -6, 6, {-5, 0, 5}},
                {},
                130};
    const auto side = [&](double at) { return std::pair{at, at * slope}; };
    const auto other = [&](double at) { return std::pair{at, -at * slope}; };
    chart.series = {segment("", 0, {{0, 0}, side(19)}, Look::thin), segment("", 0, {{0, 0}, other(19)}, Look::thin),
                    segment("", 0, {side(near), other(near)}, Look::dashed),
                    segment("old far plane", 0, {side(far), other(far)}, Look::dashed)};
    Series near_plane{"near plane", {}, 3, Look::line}, far_plane{"far plane", {}, 2, Look::line};
    for (double x = 640; x >= 0; x -= 0.25) {
        const double across = (x / 320 - 1) * slope;
        const auto z_near = static_cast<double>(view_depth(camera, Storage::float32, x, 240, 0));
        near_plane.points.emplace_back(z_near, z_near * across);
        const double z_far = attainable_depth(camera, x, 240);
        far_plane.points.emplace_back(z_far, z_far * across);
    }
    chart.series.push_back(near_plane);
    chart.series.push_back(far_plane);

    // How deep a direction can reach, against the angle.
    Chart depth{"Where the ray meets the far plane",
                {"angle of the near plane, degrees", 0, 50, {0, 10, 20, 30, 40, 50}},
                {"attainable depth / far", 1, 100, {1, 3, 10, 30, 100}, true},
                {},
                120};
    Chart value{"What the old far distance is stored as",
                depth.x,
                {"stored value of z = far", 0, 1.02, {0, 0.25, 0.5, 0.75, 1}},
                {},
                120};
    struct Direction {
        const char* label;
        double x;
        int color;
    };
    for (const Direction& each :
         {Direction{"touched corner", 640, 3}, {"towards it", 480, 1}, {"centre", 320, 2}, {"opposite", 0, 4}}) {
        Series reaches{each.label, {}, each.color, Look::line}, stores = reaches;
        for (double angle = 0; angle <= 50; angle += 0.125) {
            const Camera turned = camera_of(with_turned_plane(plain, angle));
            reaches.points.emplace_back(angle, attainable_depth(turned, each.x, 240) / far);
            stores.points.emplace_back(angle, stored(turned, each.x, 240, far));
        }
        depth.series.push_back(reaches);
        value.series.push_back(stores);
    }
    write(folder / "oblique.svg", {chart}, 640, 360);
    write(folder / "attainable.svg", {depth, value}, 960, 360);
}

void draw_median(const std::filesystem::path& folder) {
    Camera plain = camera_of(perspective(FrustumEdges{-0.05, 0.05, -0.05, 0.05}, {0.1, 1e4}));
    Camera infinite = camera_of(perspective(FrustumEdges{-0.05, 0.05, -0.05, 0.05}, {0.1, infinity}));
    Camera median = plain, logarithmic = plain;
    median.encoding = Encoding::median;
    median.median = 10;
    logarithmic.encoding = Encoding::logarithmic;
    logarithmic.far_plane = 1e4;
    const auto clip = [](const Camera& camera) {
        return [&camera](double z) { return 2 * stored(camera, 3, 4, z) - 1; };
    };
    const auto all = spread(0.01, 1e4, 300), beyond_near = spread(0.1, 1e4, 300);
    write(folder / "median.svg",
          {{"Depth in the clip range: median 10; near 0.1, far 10 000 or infinite",
            {"distance along the view axis", 0.01, 1e4, {0.01, 0.1, 1, 10, 100, 1e3, 1e4}, true},
            {"stored, −1 to 1", -1.05, 1.05, {-1, -0.5, 0, 0.5, 1}},
            {curve("window", 0, beyond_near, clip(plain)),
             curve("window, infinite far", 2, beyond_near, clip(infinite), Look::dashed),
             curve("median", 1, all, clip(median)), curve("logarithmic, C = 1", 3, all, clip(logarithmic))}}});
}

void draw_pseudo_linear(const std::filesystem::path& folder) {
    Camera camera = camera_of(perspective(centred, {0.5, 100}));
    camera.encoding = Encoding::pseudo_linear;
    camera.near_plane = 0.5;
    camera.far_plane = 100;
    // The window interpolates the stored value and 1/z linearly; corners a, b, c, weights in the window.
    const auto error = [&](const std::array<double, 3>& z, const std::array<double, 3>& weight) {
        double value = 0, inverse = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            value += weight[i] * stored(camera, 3, 4, z[i]);
            inverse += weight[i] / z[i];
        }
        return std::abs(static_cast<double>(view_depth(camera, Storage::float32, 3, 4, value)) - 1 / inverse);
    };
    std::mt19937 random(5);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
    };
    Series inside{"", {}, 1, Look::dots};
    for (int pixel = 0; pixel < 1500; ++pixel) {
        const double ratio = uniform(1, 10), a = uniform(0, 1), b = uniform(0, 1 - a);
        inside.points.emplace_back(ratio, error({1, ratio, uniform(1, ratio)}, {a, b, 1 - a - b}));
    }
    std::vector<double> ratios, window;
    for (int i = 0; i <= 200; ++i) {
        ratios.push_back(1 + 9 * i / 200.0);
        window.push_back(i / 200.0);
    }
    const auto decoded = [&](double s) {
        const double value = (1 - s) * stored(camera, 3, 4, 1) + s * stored(camera, 3, 4, 10);
        return static_cast<double>(view_depth(camera, Storage::float32, 3, 4, value));
    };
    write(
        folder / "pseudo-linear.svg",
        {{"Along an edge from z = 1 to z = 10",
          {"place in the window", 0, 1, {0, 0.25, 0.5, 0.75, 1}},
          {"z", 0, 10.5, {0, 2, 4, 6, 8, 10}},
          {curve("decoded", 2, window, decoded), curve("true", 3, window, [](double s) { return 1 / (1 - 0.9 * s); })},
          80},
         {"Random pixels of random triangles",
          {"farthest / nearest vertex", 1, 10, {1, 2, 4, 6, 8, 10}},
          {"error / nearest vertex", 0, 5, {0, 1, 2, 3, 4, 5}},
          {inside, curve("bound", 2, ratios, [](double r) { return pseudo_linear_bound(1, r); })},
          80}},
        960, 360);
}

void draw_precision(const std::filesystem::path& folder) {
    const double near = 0.1, far = 1e4;
    const Camera window = camera_of(perspective(centred, {near, far}));
    const Camera reversed =
        camera_of(perspective(centred, {near, infinity, DepthOrder::reversed}, Convention::direct3d()));
    Camera logarithmic = window;
    logarithmic.encoding = Encoding::logarithmic;
    logarithmic.far_plane = far;
    logarithmic.log_c = 1;
    const auto zs = spread(near * 1.01, far * 0.999, 500);
    const auto relative = [](const Camera& camera, DepthBits bits) {
        return [&camera, bits](double z) { return depth_spacing(camera, bits, 320, 240, z) / z; };
    };
    write(
        folder / "precision.svg",
        {{"Distance between neighbouring stored depths, relative to z (near 0.1, far 10 000)",
          {"distance along the view axis", 0.1, 1e4, {0.1, 1, 10, 100, 1e3, 1e4}, true},
          {"spacing / z", 1e-8, 1, {1e-8, 1e-6, 1e-4, 0.01, 1}, true},
          {curve("D16", 4, zs, relative(window, DepthBits::d16)), curve("D24", 2, zs, relative(window, DepthBits::d24)),
           curve("D32F", 5, zs, relative(window, DepthBits::d32f), Look::dashed),
           curve("D32F reversed, infinite", 1, zs, relative(reversed, DepthBits::d32f), Look::thin),
           curve("D24 logarithmic", 3, zs, relative(logarithmic, DepthBits::d24))}}});
}

void draw_cancellation(const std::filesystem::path& folder) {
    constexpr double near = 0.1, far = 1e5;
    constexpr int width = 1024, bins = 128, size = width * width;
    std::vector<float> values(size), decoded(size);
    std::vector<double> depths = spread(near, far, size);
    for (std::size_t i = 0; i < size; ++i)
        values[i] = static_cast<float>((1 / near - 1 / depths[i]) / (1 / near - 1 / far));
    const Device device = Device::open("cpu");
    const StoredDepth frame{Image::from_host(device, Element::f32, values.data(), {width, width}),
                            camera_of(perspective(centred, {near, far}), width, width)};
    linearize(frame, {Background::decode}).image.download(decoded.data());

    Series engine{"1/(Z d + W)", {}, 2, Look::line}, ours{"linearize", {}, 1, Look::line};
    const auto slope = static_cast<float>(1 / far - 1 / near), start = static_cast<float>(1 / near);
    for (std::size_t bin = 0; bin < bins; ++bin) {
        long double worst_engine = 0, worst_ours = 0;
        for (std::size_t i = bin * size / bins; i < (bin + 1) * size / bins; ++i) {
            const volatile float product = slope * values[i]; // as a shader without fused multiply-add does it
            const long double exact = 1 / ((1 / 1e5L - 1 / 0.1L) * values[i] + 1 / 0.1L);
            worst_engine = std::max(worst_engine, std::abs(1 / (product + start) / exact - 1));
            worst_ours = std::max(worst_ours, std::abs(decoded[i] / exact - 1));
        }
        const double z = depths[bin * size / bins + size / bins / 2];
        engine.points.emplace_back(z, static_cast<double>(worst_engine));
        ours.points.emplace_back(z, static_cast<double>(worst_ours));
    }
    write(folder / "cancellation.svg",
          {{"Worst relative error of the decoded depth (near 0.1, far 100 000)",
            {"distance along the view axis", 0.1, 1e5, {0.1, 1, 10, 100, 1e3, 1e4, 1e5}, true},
            {"relative error", 1e-8, 1, {1e-8, 1e-6, 1e-4, 1e-2, 1}, true},
            {engine, ours}}});
}

// Visibility along a floor towards an infinite wall, both seen from straight above, where the wall's foot is at 0.
Series along_floor(const std::string& label, int color, const SsaoOptions& options, Look look) {
    constexpr int width = 272, height = 224, foot = 160;
    constexpr double pixels = 100; // to a scene unit
    constexpr float floor = 5, top = 1;
    std::vector<float> depths(width * height);
    for (std::size_t i = 0; i < depths.size(); ++i)
        depths[i] = i % width < foot ? floor : top;
    const double right = width / pixels / 2, up = height / pixels / 2;
    Camera camera = camera_of(orthographic({-right, right, -up, up}, {0.5, 10}), width, height);
    camera.encoding = Encoding::view_z;
    const Device device = Device::open("cpu");
    const Image visibility =
        ssao({Image::from_host(device, Element::f32, depths.data(), {width, height}), camera}, 1, options).visibility;
    visibility.download(depths.data(), width);
    Series series{label, {}, color, look};
    for (std::size_t x = foot - 1; x > 20; --x)
        series.points.emplace_back((foot - 0.5 - static_cast<double>(x)) / pixels, depths[height / 2 * width + x]);
    return series;
}

// V = 1 - (a - sin a cos a) / pi, where the radius reaches the wall at the angle a from its foot's direction.
double beside_wall(double distance) {
    const double a = std::acos(std::min(distance, 1.0));
    return 1 - (a - std::sin(a) * std::cos(a)) / std::numbers::pi;
}

void draw_wall(const std::filesystem::path& folder) {
    SsaoOptions options;
    Series thin = along_floor("a quarter thick", 3, options, Look::dashed);
    options.thickness = infinity;
    Chart chart{"Visibility of a floor beside a wall that is higher than the radius, from above",
                {"distance from the wall / radius", 0, 1.4, {0, 0.25, 0.5, 0.75, 1, 1.25}},
                {"visibility", 0.4, 1.05, {0.5, 0.6, 0.7, 0.8, 0.9, 1}},
                {curve("exact", 0, spread(1e-3, 1.395, 400), beside_wall, Look::line)}};
    const std::pair<const char*, Quality> qualities[] = {
        {"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}};
    std::puts("visibility beside an infinite wall, thickness inf: worst and mean error");
    for (const auto& [name, quality] : qualities) {
        options.sampling = Sampling{.quality = quality};
        const Series found = along_floor(name, 2, options, Look::thin);
        double worst = 0, sum = 0;
        for (const auto& [distance, visibility] : found.points) {
            worst = std::max(worst, std::abs(visibility - beside_wall(distance)));
            sum += std::abs(visibility - beside_wall(distance));
        }
        std::printf("  %-9s %.4f  %.4f\n", name, worst, sum / static_cast<double>(found.points.size()));
        if (quality == Quality::balanced)
            chart.series.push_back(found);
    }
    chart.series.push_back(std::move(thin));
    write(folder / "wall.svg", {chart});
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc != 2) {
        std::fputs("usage: fathom_charts FOLDER\n", stderr);
        return 2;
    }
    try {
        const std::filesystem::path folder = argv[1];
        std::filesystem::create_directories(folder);
        for (const auto draw : {draw_rays, draw_oblique, draw_median, draw_pseudo_linear, draw_precision,
                                draw_cancellation, draw_wall, draw_lengyel, draw_kooima, draw_goldberg})
            draw(folder);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_charts: %s\n", error.what());
        return 1;
    }
}
