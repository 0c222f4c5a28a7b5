#include "frames.hpp"

#include <bit>
#include <random>

namespace fathom::bench {
namespace {

// Uniform stored depth, with a share close to 1 where distant surfaces lie.
std::vector<float> stored_pattern(std::size_t size) {
    std::mt19937 random(20161);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<float> pattern(size);
    for (float& value : pattern) {
        const float d = uniform(random);
        value = uniform(random) < 0.25f ? 1 - d * 1e-4f : d;
    }
    return pattern;
}

void write(const Image& image, const void* data) {
    const std::size_t row = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.channels()) *
                            element_bytes(image.element());
    const std::size_t pitch = image.row_stride() * element_bytes(image.element());
    image.device().queue().enqueueWriteBufferRect(image.buffer(), CL_TRUE, {0, 0, 0}, {0, 0, 0},
                                                  {row, static_cast<std::size_t>(image.height()), 1}, pitch, 0, row, 0,
                                                  data);
}

} // namespace

Frames::Frames(const Device& device, int width, int height, int count)
    : device_(device), width_(width), height_(height) {
    const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    pattern_ = stored_pattern(size);
    for (const float value : pattern_)
        pattern16_.push_back(static_cast<std::uint16_t>(value * 65535));
    const std::vector<float> zeros(3 * size); // touches the pages before anything is timed
    for (int i = 0; i < count; ++i) {
        const auto add = [&](std::vector<Image>& to, Element element, int channels, const void* data) {
            to.emplace_back(device, element, Layout{width, height, channels});
            write(to.back(), data);
        };
        add(stored_, Element::f32, 1, pattern_.data());
        add(in_place_, Element::f32, 1, pattern_.data());
        add(stored16_, Element::u16, 1, pattern16_.data());
        add(results_, Element::f32, 1, zeros.data());
        add(positions_, Element::f32, 3, zeros.data());
    }
}

void Frames::restore_in_place() {
    write(in_place(), pattern_.data());
}

} // namespace fathom::bench
