// The named scenes. Lengths in metres, the camera at the origin looking along −z unless it has a view matrix.

#include "scene/scene.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace fathom::scene {
namespace {

const std::vector<std::pair<std::string, Scene (*)()>>& all() {
    static const std::vector<std::pair<std::string, Scene (*)()>> scenes{
        {"room", room},         {"spheres", spheres}, {"corridor", corridor},
        {"railings", railings}, {"terrain", terrain}, {"slant", slant},
    };
    return scenes;
}

} // namespace

Scene room() {
    Scene scene{Box{{0, 0, -4.5}, {4, 1.5, 5.5}}};
    // A table with four legs, two chairs, a shelf with boards, a cupboard, a sphere, a lamp and a rug.
    scene.push_back(Box{{-1.2, -0.72, -4.2}, {0.9, 0.03, 0.5}, 0.3});
    for (const double x : {-0.8, 0.8}) {
        for (const double z : {-0.4, 0.4}) {
            scene.push_back(
                Box{{-1.2 + x * 0.955 + z * 0.296, -1.12, -4.2 - x * 0.296 + z * 0.955}, {0.035, 0.38, 0.035}, 0.3});
        }
    }
    scene.push_back(Box{{-0.2, -1.25, -5.4}, {0.25, 0.25, 0.25}, -0.5});
    scene.push_back(Box{{-0.32, -0.8, -5.6}, {0.25, 0.35, 0.03}, -0.5});
    scene.push_back(Box{{2.2, -0.2, -9.2}, {0.04, 1.3, 0.5}});
    scene.push_back(Box{{3.9, -0.2, -9.2}, {0.04, 1.3, 0.5}});
    for (const double y : {-1.3, -0.75, -0.2, 0.35, 0.9}) {
        scene.push_back(Box{{3.05, y, -9.2}, {0.85, 0.025, 0.5}});
    }
    scene.push_back(Box{{-3.2, -0.4, -8.6}, {0.7, 1.1, 0.6}});
    scene.push_back(Sphere{{1.2, -1.05, -4.8}, 0.45});
    scene.push_back(Sphere{{-1.4, -0.52, -4.1}, 0.17});
    scene.push_back(Sphere{{0.4, 0.95, -6.5}, 0.3});
    scene.push_back(Box{{0.4, 1.4, -6.5}, {0.01, 0.2, 0.01}});
    scene.push_back(Disk{{0.6, -1.49, -6}, {0, 1, 0}, 1.6});
    return scene;
}

Scene spheres() {
    Scene scene{Plane{{0, -1, 0}, {0, 1, 0}}};
    for (int row = 0; row < 5; ++row) {
        for (int column = -2; column <= 2; ++column) {
            const double radius = 0.25 + 0.08 * ((row * 3 + column + 7) % 5);
            scene.push_back(Sphere{{1.4 * column + 0.3 * (row % 2), radius - 1, -3 - 2.2 * row}, radius});
        }
    }
    return scene;
}

Scene corridor() {
    Scene scene{Box{{0, 0, -28}, {1.2, 1.3, 32}}};
    for (int door = 0; door < 10; ++door) {
        const double z = -3 - 5.5 * door;
        for (const double side : {-1.2, 1.2}) {
            scene.push_back(Box{{side, -0.2, z - 0.6}, {0.12, 1.1, 0.08}});
            scene.push_back(Box{{side, -0.2, z + 0.6}, {0.12, 1.1, 0.08}});
            scene.push_back(Box{{side, 0.98, z}, {0.12, 0.08, 0.68}});
        }
        scene.push_back(Box{{0, 1.28, z}, {0.6, 0.03, 0.15}});
    }
    return scene;
}

Scene railings() {
    Scene scene{Plane{{0, -1.5, 0}, {0, 1, 0}}, Plane{{0, 0, -12}, {0, 0, 1}}};
    for (int bar = -20; bar <= 20; ++bar) {
        scene.push_back(Box{{0.22 * bar, -0.3, -4 + 0.02 * bar}, {0.02, 1.1, 0.02}});
    }
    scene.push_back(Box{{0, 0.82, -4}, {5, 0.03, 0.05}, -0.0907});
    scene.push_back(Box{{0, -1.35, -4}, {5, 0.03, 0.05}, -0.0907});
    scene.push_back(Sphere{{1.5, -0.5, -8}, 1});
    return scene;
}

Scene terrain() {
    return {HeightField{-12,
                        400,
                        {{6, 0.021, 0.013, 0.3},
                         {4, -0.017, 0.034, 1.1},
                         {2, 0.061, 0.047, 2.0},
                         {0.8, -0.13, 0.11, 0.7},
                         {0.25, 0.31, 0.42, 0.1}}}};
}

Scene slant() {
    return {Plane{{0, 0, -5}, {0.5, 0.3, 1}}};
}

const std::vector<std::string>& names() {
    static const std::vector<std::string> result = [] {
        std::vector<std::string> list;
        std::ranges::transform(all(), std::back_inserter(list), [](const auto& scene) { return scene.first; });
        return list;
    }();
    return result;
}

Scene named(const std::string& name) {
    std::string known;
    for (const auto& [candidate, make] : all()) {
        if (candidate == name) {
            return make();
        }
        known += (known.empty() ? "" : ", ") + candidate;
    }
    throw std::invalid_argument("scene: '" + name + "' is none of " + known);
}

} // namespace fathom::scene
