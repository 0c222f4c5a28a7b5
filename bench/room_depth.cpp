#include "room_depth.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>

namespace fathom::bench {
namespace {

// Window depth is affine on the screen for planes. So a cell whose corners and middle lie in a plane is filled in between
// them, and rays are cast for every pixel of the others. What is narrower than a cell may be missed: this is for times.
constexpr int cell = 8;
constexpr double in_plane = 1e-12;

class Cells {
public:
    Cells(const scene::Scene& scene, const Camera& camera)
        : caster_(scene, camera), width_(camera.width), height_(camera.height), clear_(scene::clear_value(camera)),
          stored_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

    std::vector<double> filled() && {
        std::atomic<int> next = 0;
        const auto rows = [&] {
            for (int y = next++ * cell; y < height_; y = next++ * cell)
                for (int x = 0; x < width_; x += cell)
                    fill(x, y, std::min(x + cell, width_), std::min(y + cell, height_));
        };
        {
            std::vector<std::jthread> workers;
            for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
                workers.emplace_back(rows);
        }
        return std::move(stored_);
    }

private:
    double at(int x, int y) const {
        const auto surface = caster_.at(x + 0.5, y + 0.5);
        return surface ? surface->stored : clear_;
    }

    void fill(int left, int top, int right, int bottom) {
        const double across = right - 1 - left, down = bottom - 1 - top;
        const std::array corners{at(left, top), at(right - 1, top), at(left, bottom - 1), at(right - 1, bottom - 1)};
        const auto plane = [&](int x, int y) {
            const double s = across > 0 ? (x - left) / across : 0, t = down > 0 ? (y - top) / down : 0;
            return corners[0] + s * (corners[1] - corners[0]) + t * (corners[2] - corners[0]);
        };
        const int x_middle = (left + right) / 2, y_middle = (top + bottom) / 2;
        const bool flat = std::abs(plane(right - 1, bottom - 1) - corners[3]) <= in_plane &&
                          std::abs(plane(x_middle, y_middle) - at(x_middle, y_middle)) <= in_plane;
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < right; ++x)
                stored_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] =
                    flat ? plane(x, y) : at(x, y);
    }

    scene::Caster caster_;
    int width_, height_;
    double clear_;
    std::vector<double> stored_;
};

} // namespace

std::vector<double> stored_depth_of(const scene::Scene& scene, const Camera& camera) {
    return Cells(scene, camera).filled();
}

std::vector<float> room_depth(const Camera& camera) {
    const std::vector<double> stored = stored_depth_of(scene::room(), camera);
    return {stored.begin(), stored.end()};
}

Image uploaded(const Device& device, Layout layout, const std::vector<float>& values) {
    const Image image(device, Element::f32, layout);
    const std::size_t row =
        static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.channels) * sizeof(float);
    device.queue().enqueueWriteBufferRect(image.buffer(), CL_TRUE, {0, 0, 0}, {0, 0, 0},
                                          {row, static_cast<std::size_t>(layout.height), 1},
                                          image.row_stride() * sizeof(float), 0, row, 0, values.data());
    return image;
}

} // namespace fathom::bench
