#include "room_depth.hpp"

#include "scene/scene.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace fathom::bench {

std::vector<float> room_depth(const Camera& camera) {
    const auto width = static_cast<std::size_t>(camera.width);
    std::vector<float> stored(width * static_cast<std::size_t>(camera.height));
    const scene::Caster caster(scene::room(), camera);
    std::atomic<int> next = 0;
    const auto rows = [&] {
        for (int y = next++; y < camera.height; y = next++) {
            for (std::size_t x = 0; x < width; ++x) {
                const auto surface = caster.at(static_cast<double>(x) + 0.5, y + 0.5);
                stored[static_cast<std::size_t>(y) * width + x] = surface ? static_cast<float>(surface->stored) : 1.0f;
            }
        }
    };
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        workers.emplace_back(rows);
    return stored;
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
