// The picture on the README's first screen: a still life on a wooden table, rendered before ambient occlusion and a lens.
//   still_life render CAMERA.json DEPTH.exr AMBIENT.exr DIRECT.exr
//   still_life light AMBIENT.exr DIRECT.exr VISIBILITY.exr|- PICTURE.exr    picture = ambient · visibility + direct
//   still_life show LEFT.exr RIGHT.exr BOTH.png                             side by side, at half their size
// The renderer is a small ray caster: a sky that shines from everywhere, which is the ambient light, and a window with soft
// shadows, highlights and one reflection, which are the direct light.

#include "scene/scene.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <exception>
#include <functional>
#include <iostream>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace fathom::scene;
using Color = Eigen::Array3d;
using Eigen::Vector3d;

/// What an object is made of: its colour at a place, how much it mirrors straight ahead, and the light that it gives.
struct Material {
    std::function<Color(const Vector3d& position, const Vector3d& normal)> color;
    double mirror = 0;
    Color emission = {0, 0, 0};
};

struct Object {
    Scene shape; ///< one primitive
    Material material;
};

// A number from 0 to 1 for every corner of a grid, and a smooth function through them.
double noise(const Vector3d& place) {
    const auto corner = [](std::int64_t x, std::int64_t y, std::int64_t z) {
        auto h = static_cast<std::uint64_t>(x * 73856093) ^ static_cast<std::uint64_t>(y * 19349663) ^
                 static_cast<std::uint64_t>(z * 83492791);
        h = (h ^ (h >> 13)) * 0x9E3779B97F4A7C15;
        return static_cast<double>((h ^ (h >> 31)) & 0xFFFF) / 65535;
    };
    const Eigen::Array3d base = place.array().floor();
    const Eigen::Array3d t = place.array() - base, s = t * t * (3 - 2 * t);
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
        const Eigen::Array3i step(i & 1, i >> 1 & 1, i >> 2);
        const Eigen::Array3d weight = (step == 1).select(s, 1 - s);
        const Eigen::Array3d at = base + step.cast<double>();
        sum += weight.prod() * corner(static_cast<std::int64_t>(at[0]), static_cast<std::int64_t>(at[1]),
                                      static_cast<std::int64_t>(at[2]));
    }
    return sum;
}

Material plain(const Color& color, double mirror = 0) {
    return {[color](const Vector3d&, const Vector3d&) { return color; }, mirror};
}

Color wood(const Vector3d& place, const Vector3d&) {
    const double plank = std::floor(place.z() / 0.16);
    const double tone = 0.75 + 0.5 * noise({plank * 7.3, 1, 1});
    const Vector3d along(place.x() * 1.6 + plank * 5.1, place.y() * 3, place.z() * 30);
    const double grain = noise(along + Vector3d(0, 0, 2 * noise(along * 0.4))) * 0.6 + noise(along * 4) * 0.25;
    const double gap = std::abs(place.z() / 0.16 - plank - 0.5) > 0.488 ? 0.35 : 1;
    return gap * tone * (Color(0.42, 0.24, 0.12) * (1 - grain) + Color(0.62, 0.40, 0.22) * grain);
}

Color orange(const Vector3d& place, const Vector3d&) {
    return Color(0.90, 0.38, 0.05) * (0.85 + 0.25 * noise(place * 150));
}

Color plaster(const Vector3d& place, const Vector3d&) {
    return Color(0.10, 0.15, 0.19) * (0.8 + 0.4 * noise(place * 3) + 0.15 * noise(place * 12));
}

Color pages(const Vector3d& place, const Vector3d& normal) {
    const double line = std::abs(normal.y()) > 0.5 ? 1 : 0.8 + 0.2 * noise({1, place.y() * 400, 1});
    return Color(0.82, 0.77, 0.66) * line;
}

void add_book(std::vector<Object>& objects, const Vector3d& bottom, const Vector3d& half, double yaw,
              const Color& cover) {
    const double board = 0.004;
    const Vector3d up(0, 1, 0);
    const Vector3d boards(half.x(), board / 2, half.z());
    objects.push_back({{Box{bottom + up * board / 2, boards, yaw}}, plain(cover, 0.02)});
    objects.push_back({{Box{bottom + up * (2 * half.y() - board / 2), boards, yaw}}, plain(cover, 0.02)});
    objects.push_back({{Box{bottom + up * half.y(), half - Vector3d(0.007, board, 0.007), yaw}}, {pages}});
}

std::vector<Object> still_life() {
    std::vector<Object> objects;
    objects.push_back({{Box{{0, -0.03, -0.25}, {1.3, 0.03, 0.95}}}, {wood, 0.03}});
    objects.push_back({{Plane{{0, 0, -2.4}, {0, 0, 1}}}, {plaster}});
    objects.push_back({{Plane{{0, -0.8, 0}, {0, 1, 0}}}, plain({0.16, 0.12, 0.09})});
    // A bowl of oranges.
    const Vector3d bowl(0.14, 0.2, -0.32);
    objects.push_back({{Bowl{bowl, 0.2, {0, 1, 0}, 0.15}}, plain({0.55, 0.66, 0.70}, 0.04)});
    for (int i = 0; i < 3; ++i) {
        const double angle = 0.5 + i * 2 * std::numbers::pi / 3;
        objects.push_back({{Sphere{bowl + Vector3d(0.0866 * std::cos(angle), -0.09, 0.0866 * std::sin(angle)), 0.075}},
                           {orange, 0.03}});
    }
    objects.push_back({{Sphere{bowl + Vector3d(0, 0.0325, 0), 0.075}}, {orange, 0.03}});
    // Three books with a marble on top.
    add_book(objects, {-0.34, 0, -0.34}, {0.19, 0.028, 0.13}, 0.32, {0.45, 0.06, 0.06});
    add_book(objects, {-0.33, 0.056, -0.35}, {0.17, 0.018, 0.12}, 0.12, {0.07, 0.22, 0.18});
    add_book(objects, {-0.35, 0.092, -0.33}, {0.14, 0.024, 0.10}, 0.5, {0.10, 0.14, 0.34});
    objects.push_back({{Sphere{{-0.33, 0.14 + 0.045, -0.33}, 0.045}}, plain({0.70, 0.62, 0.20}, 0.08)});
    // Dice and marbles, near and far.
    objects.push_back({{Box{{-0.06, 0.028, -0.06}, {0.028, 0.028, 0.028}, 0.5}}, plain({0.78, 0.76, 0.72}, 0.03)});
    objects.push_back({{Box{{0.015, 0.028, -0.03}, {0.028, 0.028, 0.028}, -0.2}}, plain({0.62, 0.10, 0.10}, 0.03)});
    objects.push_back({{Box{{-0.02, 0.084, -0.045}, {0.028, 0.028, 0.028}, 0.15}}, plain({0.20, 0.40, 0.55}, 0.03)});
    objects.push_back({{Sphere{{-0.25, 0.055, 0.36}, 0.055}}, plain({0.08, 0.30, 0.26}, 0.08)});
    objects.push_back({{Sphere{{-0.13, 0.035, 0.44}, 0.035}}, plain({0.60, 0.12, 0.08}, 0.08)});
    objects.push_back({{Sphere{{0.40, 0.045, 0.20}, 0.045}}, plain({0.75, 0.72, 0.66}, 0.08)});
    objects.push_back({{Sphere{{0.33, 0.03, 0.27}, 0.03}}, plain({0.15, 0.25, 0.50}, 0.08)});
    // Behind them boxes and spheres, and a string of lamps before the wall.
    objects.push_back({{Box{{0.66, 0.17, -0.95}, {0.15, 0.17, 0.12}, -0.35}}, plain({0.10, 0.34, 0.36})});
    objects.push_back({{Box{{0.42, 0.07, -0.98}, {0.09, 0.07, 0.09}, 0.4}}, plain({0.62, 0.45, 0.16})});
    objects.push_back({{Sphere{{-0.66, 0.17, -0.95}, 0.17}}, plain({0.50, 0.20, 0.14}, 0.04)});
    objects.push_back({{Sphere{{-0.30, 0.09, -1.0}, 0.09}}, plain({0.66, 0.58, 0.44}, 0.04)});
    for (int i = 0; i < 17; ++i) {
        const double x = -1.52 + 0.19 * i;
        const double sag = 0.30 + 0.07 * std::cos(1.9 * x + 0.4) + 0.03 * std::cos(5.1 * x);
        objects.push_back({{Sphere{{x, sag, -2.2}, 0.014}}, {plain({1, 1, 1}).color, 0, {26, 15, 6}}});
    }
    return objects;
}

Scene all_of(const std::vector<Object>& objects) {
    Scene scene;
    for (const Object& object : objects) {
        if ((object.material.emission == 0).all()) // lamps cast no shadows
            scene.push_back(object.shape.front());
    }
    return scene;
}

/// Light that a surface sends along a ray: what comes from everywhere, and what comes from the window and by reflection.
struct Light {
    Color ambient = {0, 0, 0}, direct = {0, 0, 0};
};

class Renderer {
public:
    Light along(const Ray& ray, int bounces = 1) const {
        const Object* nearest = nullptr;
        Met place{};
        double distance = std::numeric_limits<double>::infinity();
        for (const Object& object : objects_) {
            const auto found = met(object.shape, ray);
            const double d = found ? (found->position - ray.origin).norm() : distance;
            if (d < distance) {
                distance = d;
                place = *found;
                nearest = &object;
            }
        }
        return nearest ? leaving(place, nearest->material, ray.direction.normalized(), bounces)
                       : Light{.direct = {0.03, 0.04, 0.06}};
    }

private:
    Light leaving(const Met& at, const Material& material, const Vector3d& direction, int bounces) const {
        const Color color = material.color(at.position, at.normal);
        const double up = 0.5 + 0.5 * at.normal.y();
        Light light;
        light.ambient = color * (Color(0.20, 0.16, 0.13) * (1 - up) + Color(0.36, 0.39, 0.44) * up);
        light.direct = material.emission;
        const double open = window_seen(at.position + 1e-6 * at.normal);
        const Vector3d to_window = (window_centre_ - at.position).normalized();
        light.direct += color * Color(1.30, 1.08, 0.82) * (open * std::max(0.0, at.normal.dot(to_window)));
        if (material.mirror > 0) {
            const double facing = -at.normal.dot(direction);
            const double mirrored = material.mirror + (1 - material.mirror) * std::pow(1 - facing, 5) * 0.6;
            const Vector3d reflected = direction + 2 * facing * at.normal;
            light.direct += 9 * mirrored * open * std::pow(std::max(0.0, reflected.dot(to_window)), 250);
            if (bounces > 0) {
                const Light seen = along(Ray{at.position, reflected, 1e-6, 1e9}, bounces - 1);
                light.direct += mirrored * (seen.ambient + seen.direct).min(2.0);
            }
        }
        return light;
    }

    // The visible fraction of a square window: its corners first, the rest of it where they differ.
    double window_seen(const Vector3d& from) const {
        int open = 0, asked = 0;
        const auto ask = [&](double u, double v) {
            const Vector3d to = window_centre_ + 0.5 * (u * window_across_ + v * window_up_) - from;
            open += blocked(scene_, from, to.normalized(), to.norm()) ? 0 : 1;
            ++asked;
        };
        for (const auto& [u, v] : {std::pair{-0.9, -0.9}, {0.9, -0.9}, {-0.9, 0.9}, {0.9, 0.9}, {0.0, 0.0}})
            ask(u, v);
        if (open == 0 || open == asked)
            return open > 0;
        open = asked = 0;
        for (int y = 0; y < 10; ++y)
            for (int x = 0; x < 10; ++x)
                ask(-0.9 + 0.2 * x, -0.9 + 0.2 * y);
        return static_cast<double>(open) / asked;
    }

    std::vector<Object> objects_ = still_life();
    Scene scene_ = all_of(objects_);
    Vector3d window_centre_{-1.5, 1.6, 0.7}, window_across_{0.35, 0, 0.75}, window_up_{0.3, 0.6, 0};
};

void render(const std::string& camera_file, const std::string& depth, const std::string& ambient,
            const std::string& direct) {
    const fathom::Camera camera = fathom::read_camera(camera_file).camera;
    const Renderer renderer;
    Scene scene;
    for (const Object& object : still_life())
        scene.push_back(object.shape.front());
    auto image = fathom::scene::render(scene, camera);
    fathom::write_image(depth, cv::Mat(image.height, image.width, CV_32FC1, image.stored.data()), {.channels = {"Z"}});

    const Caster caster(scene, camera);
    const Eigen::Matrix4d world = to_world(camera);
    cv::Mat lights[2] = {cv::Mat(image.height, image.width, CV_32FC3), cv::Mat(image.height, image.width, CV_32FC3)};
    std::atomic<int> next = 0;
    const auto work = [&] {
        for (int y = next++; y < image.height; y = next++) {
            for (int x = 0; x < image.width; ++x) {
                Ray ray = caster.ray(x + 0.5, y + 0.5);
                ray.origin = world.topLeftCorner<3, 3>() * ray.origin + world.topRightCorner<3, 1>();
                ray.direction = world.topLeftCorner<3, 3>() * ray.direction;
                const Light light = renderer.along(ray);
                for (int c = 0; c < 3; ++c) {
                    lights[0].at<cv::Vec3f>(y, x)[c] = static_cast<float>(light.ambient[2 - c]); // B, G, R
                    lights[1].at<cv::Vec3f>(y, x)[c] = static_cast<float>(light.direct[2 - c]);
                }
            }
        }
    };
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        threads.emplace_back(work);
    threads.clear();
    fathom::write_color(ambient, lights[0]);
    fathom::write_color(direct, lights[1]);
}

void light(const std::string& ambient_file, const std::string& direct_file, const std::string& visibility_file,
           const std::string& picture) {
    cv::Mat ambient = fathom::read_color(ambient_file);
    const cv::Mat visibility = visibility_file == "-" ? cv::Mat(ambient.size(), CV_32FC1, cv::Scalar(1))
                                                      : fathom::read_depth(visibility_file, {.channel = "AO"}).values;
    const cv::Mat direct = fathom::read_color(direct_file);
    for (int y = 0; y < ambient.rows; ++y)
        for (int x = 0; x < ambient.cols; ++x)
            ambient.at<cv::Vec3f>(y, x) =
                ambient.at<cv::Vec3f>(y, x) * visibility.at<float>(y, x) + direct.at<cv::Vec3f>(y, x);
    fathom::write_color(picture, ambient);
}

// IEC 61966-2-1.
double encoded(double linear) {
    const double value = std::clamp(linear, 0.0, 1.0);
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;
}

void show(const std::string& left, const std::string& right, const std::string& file) {
    const cv::Mat pictures[] = {fathom::read_color(left), fathom::read_color(right)};
    const int width = pictures[0].cols / 2, height = pictures[0].rows / 2, gap = 8;
    cv::Mat both(height, 2 * width + gap, CV_8UC3, cv::Scalar(255, 255, 255));
    for (int side = 0; side < 2; ++side)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c) {
                    double sum = 0; // of four pixels as a screen shows them, so that bright edges are smooth too
                    for (int i = 0; i < 4; ++i)
                        sum += std::min(1.0f, pictures[side].at<cv::Vec3f>(2 * y + i / 2, 2 * x + i % 2)[c]);
                    both.at<cv::Vec3b>(y, x + side * (width + gap))[c] =
                        cv::saturate_cast<unsigned char>(255 * encoded(sum / 4));
                }
    if (!cv::imwrite(file, both))
        throw std::runtime_error(file + ": cannot be written");
}

} // namespace

int main(int argc, char* argv[]) {
    const std::string what = argc > 1 ? argv[1] : "";
    try {
        if (what == "render" && argc == 6)
            render(argv[2], argv[3], argv[4], argv[5]);
        else if (what == "light" && argc == 6)
            light(argv[2], argv[3], argv[4], argv[5]);
        else if (what == "show" && argc == 5)
            show(argv[2], argv[3], argv[4]);
        else {
            std::cerr << "usage: still_life render CAMERA.json DEPTH.exr AMBIENT.exr DIRECT.exr\n"
                         "       still_life light AMBIENT.exr DIRECT.exr VISIBILITY.exr|- PICTURE.exr\n"
                         "       still_life show LEFT.exr RIGHT.exr BOTH.png\n";
            return 2;
        }
    } catch (const std::exception& error) {
        std::cerr << "still_life: " << error.what() << '\n';
        return 1;
    }
}
