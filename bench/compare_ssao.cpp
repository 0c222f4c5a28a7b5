// compare_ssao: the library's ambient occlusion and other methods of it, error against brute force and time in the same run.

#include "ssao_rivals.hpp"
#include "stopwatch.hpp"

#include "brute_force.hpp"
#include "scene/scene.hpp"
#include "text.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace fathom;
using namespace fathom::bench;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

struct View {
    std::string name;
    scene::Scene scene;
    Camera camera;
    std::vector<double> thicknesses; // in radii, of the library and of brute force
};

Camera eye(int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.projection = perspective(0.9, 1.0 * width / height, {0.1, 1000});
    return camera;
}

Camera from_above(double half_width, double height_of_eye, int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    const double half_height = half_width * height / width;
    camera.projection = orthographic({-half_width, half_width, -half_height, half_height}, {0, 2 * height_of_eye});
    Eigen::Isometry3d view = Eigen::Isometry3d::Identity();
    view.rotate(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
    view.translate(Eigen::Vector3d(0, -height_of_eye, 0));
    camera.view = view.matrix();
    return camera;
}

scene::Scene steeper(scene::Scene scene, double times) {
    for (scene::HeightField::Wave& wave : std::get<scene::HeightField>(scene.front()).waves)
        wave.amplitude *= times;
    return scene;
}

scene::Scene town() {
    scene::Scene scene{scene::Plane{{0, 0, 0}, {0, 1, 0}}};
    for (int row = -4; row <= 4; ++row) {
        for (int column = -6; column <= 6; ++column) {
            const double half_height = 3 + (row * row * 7 + column * 5 + 40) % 9;
            scene.push_back(scene::Box{{24.0 * column, half_height, 24.0 * row}, {8, half_height, 7}, 0.1 * column});
        }
    }
    return scene;
}

std::vector<View> views(int width, int height) {
    return {{"room", scene::room(), eye(width, height), {0.25, infinite}},
            {"railings", scene::railings(), eye(width, height), {0.25, infinite}},
            {"terrain from above", scene::terrain(), from_above(160, 200, width, height), {infinite}},
            {"mountains from above", steeper(scene::terrain(), 4), from_above(160, 200, width, height), {infinite}},
            {"town from above", town(), from_above(150, 200, width, height), {infinite}}};
}

struct Method {
    std::string name;
    std::function<Image()> run; // starts it; the result is overwritten by the next run
    bool fitted = false;        // is its strength a matter of taste? Then it gets the best one for each picture
    std::vector<double> seconds = {};
};

struct Case {
    StoredDepth stored;
    double radius, thickness;
    Image target;
};

SsaoOptions options_of(const Case& c, Quality quality) {
    SsaoOptions options;
    options.radius = c.radius;
    options.thickness = c.thickness;
    options.quality = quality;
    return options;
}

constexpr std::pair<const char*, Quality> qualities[] = {
    {"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}};

void add_library(std::vector<Method>& list, const Case& c) {
    for (const auto& [name, quality] : qualities)
        list.push_back({name, [c, options = options_of(c, quality)] { return ssao(c.stored, options).visibility; }});
    for (const auto& [name, quality] : qualities) {
        SsaoOptions half = options_of(c, quality);
        half.half_resolution = true;
        list.push_back({text(name, ", half resolution"), [c, half] { return ssao(c.stored, half).visibility; }});
    }
    for (const auto& [name, quality, steps] : {std::tuple{"fast", Quality::fast, 16},
                                               {"balanced", Quality::balanced, 64},
                                               {"accurate", Quality::accurate, 60},
                                               {"accurate", Quality::accurate, 100}}) {
        SsaoOptions half = options_of(c, quality);
        half.half_resolution = true;
        half.samples = steps;
        list.push_back(
            {text(name, ", half, ", steps, " steps"), [c, half] { return ssao(c.stored, half).visibility; }});
    }
    SsaoOptions many = options_of(c, Quality::accurate);
    many.samples = 120;
    list.push_back({"accurate, 120 steps", [c, many] { return ssao(c.stored, many).visibility; }});
}

void add_line_sweep(std::vector<Method>& list, const Case& c) {
    for (const int slices : {4, 8, 16}) {
        const auto sweep = std::make_shared<LineSweep>(c.stored, c.radius, slices);
        list.push_back({text("line sweep, ", slices, " slices"), [c, sweep] {
                            sweep->run(c.target);
                            return c.target;
                        }});
    }
}

void add_obscurance(std::vector<Method>& list, const Case& c, const std::string& name, Falloff falloff) {
    for (const int steps : {6, 16}) {
        const auto whole = std::make_shared<Obscurance>(c.stored, c.radius, 1, steps, falloff, 1);
        list.push_back({text(name, ", ", steps, " steps"),
                        [c, whole] {
                            whole->run(c.target);
                            return c.target;
                        },
                        true});
    }
}

std::vector<Method> methods_of(const Case& c, bool library_only) {
    std::vector<Method> list;
    add_library(list, c);
    if (library_only)
        return list;
    add_line_sweep(list, c);
    add_obscurance(list, c, "obscurance, HBAO+", Falloff::hbao_plus);
    add_obscurance(list, c, "obscurance, scalable", Falloff::scalable);
    return list;
}

// Interleaved rounds in random order; the first one is not counted.
void measure(std::vector<Method>& list, const Device& device, int rounds) {
    std::vector<Method*> order;
    for (Method& method : list)
        order.push_back(&method);
    std::mt19937 random(7);
    for (int round = -1; round < rounds; ++round) {
        std::shuffle(order.begin(), order.end(), random);
        for (Method* method : order) {
            const double time = seconds(Clock::processor, [&] {
                method->run();
                device.finish();
            });
            if (round >= 0)
                method->seconds.push_back(time);
        }
    }
}

std::vector<float> pixels(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()));
    image.download(values.data());
    return values;
}

// The factor of the occlusion found with which its errors' squares have the least sum.
double best_factor(const std::vector<oracle::Sample>& points, const std::function<double(const oracle::Sample&)>& at) {
    double products = 0, squares = 0;
    for (const oracle::Sample& p : points) {
        products += (1 - at(p)) * (1 - p.visibility);
        squares += (1 - at(p)) * (1 - at(p));
    }
    return products / std::max(squares, 1e-30);
}

void report(const std::vector<oracle::Sample>& points, const Method& method, int width) {
    const std::vector<float> got = pixels(method.run());
    const auto at = [&](const oracle::Sample& p) {
        return static_cast<double>(
            got[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(p.x)]);
    };
    const double factor = method.fitted ? best_factor(points, at) : 1;
    const oracle::Off off =
        oracle::error_of(points, [&](const oracle::Sample& p) { return std::max(1 - factor * (1 - at(p)), 0.0); });
    std::printf("  %-32s %.4f  %+.4f  %.3f  %8.1f ms", method.name.c_str(), off.rmse, off.bias, off.p99,
                1e3 * median(method.seconds));
    std::printf(method.fitted ? "  factor %.2f\n" : "\n", factor);
}

struct Arguments {
    int rounds = 5, width = 960, height = 540;
    std::string only;
    bool library_only = false;
};

Arguments parse(int argc, char** argv) {
    Arguments a;
    for (int i = 1; i < argc; i += 2) {
        const std::string option = argv[i];
        const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
        const bool known =
            value && (option == "--rounds" || option == "--only" || option == "--size" || option == "--methods");
        if (option == "--rounds" && value)
            a.rounds = std::atoi(value);
        if (option == "--only" && value)
            a.only = value;
        if (option == "--methods" && value)
            a.library_only = std::string(value) == "library";
        if (!known || a.rounds < 1 || (option == "--size" && std::sscanf(value, "%dx%d", &a.width, &a.height) != 2)) {
            std::fprintf(stderr,
                         "usage: compare_ssao [--only SCENE] [--methods all|library] [--size WxH] [--rounds N]\n");
            std::exit(2);
        }
    }
    return a;
}

void compare(const View& view, const Arguments& a, const Device& device) {
    const scene::Rendered image = scene::render(view.scene, view.camera);
    const oracle::DepthLayer layer(view.camera, image.z);
    const StoredDepth stored{Image::from_host(device, Element::f32, image.stored.data(), {a.width, a.height}),
                             view.camera};
    for (const double share : {0.05, 0.4}) {
        for (const double thickness : view.thicknesses) {
            const double radius = share * oracle::median_width(layer);
            const Case c{stored, radius, thickness * radius, Image(device, Element::f32, {a.width, a.height})};
            const auto points = oracle::brute_force(layer, image.normal, c.radius, c.thickness);
            std::printf(
                "\n%s, radius %.0f %% of the width, thickness %g radii, %zu points: root of the mean square, mean "
                "and 99 %% of the error; processor time\n",
                view.name.c_str(), 100 * share, thickness, points.size());
            std::vector<Method> list = methods_of(c, a.library_only);
            measure(list, device, a.rounds);
            for (const Method& method : list)
                report(points, method, a.width);
            std::fflush(stdout);
        }
    }
}

} // namespace

int main(int argc, char** argv) {
    const Arguments a = parse(argc, argv);
    try {
        const Device device = Device::open("");
        for (const View& view : views(a.width, a.height)) {
            if (view.name.find(a.only) != std::string::npos)
                compare(view, a, device);
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "compare_ssao: %s\n", error.what());
        return 1;
    }
    return 0;
}
