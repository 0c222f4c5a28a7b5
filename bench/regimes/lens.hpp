#pragma once

// Pictures through a lens, and what is known of them.

#include "camera_over.hpp"
#include "images.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom::regimes {

/// A picture at depths that have the circles wanted: c = 1000 - 1000/z.
struct Picture {
    int width, height;
    std::vector<float> depth, color;

    template <typename CircleOf, typename ValueOf>
    Picture(int across, int down, CircleOf circle, ValueOf value) : width(across), height(down) {
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x) {
                depth.push_back(static_cast<float>(1000 / (1000 - circle(x, y))));
                color.insert(color.end(), 3, static_cast<float>(value(x, y)));
            }
    }

    /// The first channel of the blurred picture.
    std::vector<double> blurred(const Device& device, Quality quality) const {
        Camera camera = camera_over(perspective(1.0, static_cast<double>(width) / height, {0.01, 100}), width, height);
        camera.encoding = Encoding::view_z;
        const Image image = Image::from_host(device, Element::f32, color.data(), {width, height, 3});
        const CircleOfConfusion coc{.k = 1000, .g = 1000};
        const auto all =
            images::floats(dof(images::stored_of(device, depth, camera), image, coc, {.quality = quality}));
        std::vector<double> first;
        for (std::size_t i = 0; i < all.size(); i += 3)
            first.push_back(static_cast<double>(all[i]));
        return first;
    }
};

/// Fraction of a blurred half-plane at t radii into it.
inline double half_plane(double t) {
    t = std::clamp(t, -1.0, 1.0);
    return 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / std::numbers::pi;
}

/// The qualities, as curves are called.
struct Way {
    const char* name;
    Quality quality;
};
inline constexpr Way ways[] = {
    {"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}};

} // namespace fathom::regimes
