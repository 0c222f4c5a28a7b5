#include "case.hpp"

#include "room_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace fathom::bench {
namespace {

std::vector<float> patches(int width, int height) {
    std::vector<float> color;
    color.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto patch = static_cast<unsigned>((y / 12) * 7919 + (x / 16) * 104729);
            for (const unsigned factor : {2654435761u, 2246822519u, 3266489917u})
                color.push_back(static_cast<float>((patch * factor) >> 8) * 0x1p-24f);
        }
    }
    return color;
}

Image codes(const Device& device, Layout layout, const std::vector<double>& stored) {
    std::vector<std::uint16_t> values;
    for (const double value : stored)
        values.push_back(static_cast<std::uint16_t>(std::lround(65535 * value)));
    const Image image(device, Element::u16, layout);
    const std::size_t row = static_cast<std::size_t>(layout.width) * sizeof(std::uint16_t);
    device.queue().enqueueWriteBufferRect(image.buffer(), CL_TRUE, {0, 0, 0}, {0, 0, 0},
                                          {row, static_cast<std::size_t>(layout.height), 1},
                                          image.row_stride() * sizeof(std::uint16_t), 0, row, 0, values.data());
    return image;
}

} // namespace

Case::Case(const Device& device, View view, const std::vector<double>& stored, int frames)
    : device_(device), view_(std::move(view)), frames_(static_cast<std::size_t>(frames)) {
    const Layout layout{width(), height()};
    const std::vector<float> values(stored.begin(), stored.end());
    for (Frame& frame : frames_) {
        frame.stored = uploaded(device, layout, values);
        frame.stored16 = codes(device, layout, stored);
    }
    std::vector<float> z(values.size());
    linearize({frames_[0].stored, camera()}).image.download(z.data());
    for (std::size_t i = 0; i < z.size(); i += 17)
        if (std::isfinite(z[i]))
            sorted_depth_.push_back(z[i]);
    std::ranges::sort(sorted_depth_);
}

StoredDepth Case::stored(Storage storage) const {
    const Frame& frame = frames_[current_];
    return {storage == Storage::uint16 ? frame.stored16 : frame.stored, camera(), storage};
}

// Its pages touched before anything is timed.
Image Case::filled(int channels) const {
    const Layout layout{width(), height(), channels};
    const Image image(device_, Element::f32, layout);
    device_.queue().enqueueFillBuffer(image.buffer(), 0.0f, 0, Image::allocation(Element::f32, layout));
    return image;
}

const Image& Case::floats(int channels) {
    Image& image = frames_[current_].floats[channels == 1 ? 0 : channels == 3 ? 1 : 2];
    if (!image)
        image = filled(channels);
    return image;
}

const std::array<Image, 4>& Case::masks() {
    auto& images = frames_[current_].masks;
    for (Image& image : images)
        if (!image)
            image = filled(1);
    return images;
}

const Image& Case::color() {
    Image& image = frames_[current_].color;
    if (picture_.empty())
        picture_ = patches(width(), height());
    if (!image)
        image = uploaded(device_, {width(), height(), 3}, picture_);
    return image;
}

void Case::set_color(const std::vector<float>& picture) {
    picture_ = picture;
    for (Frame& frame : frames_)
        frame.color = {};
}

void Case::complete() {
    const Frame& made = frames_[current_];
    for (Frame& frame : frames_) {
        for (std::size_t i = 0; i < made.floats.size(); ++i)
            if (made.floats[i] && !frame.floats[i])
                frame.floats[i] = filled(made.floats[i].channels());
        for (std::size_t i = 0; i < made.masks.size(); ++i)
            if (made.masks[i] && !frame.masks[i])
                frame.masks[i] = filled(1);
        if (made.color && !frame.color)
            frame.color = uploaded(device_, {width(), height(), 3}, picture_);
    }
    device_.finish();
}

double Case::depth_quantile(double share) const {
    const double last = static_cast<double>(sorted_depth_.size() - 1);
    return static_cast<double>(sorted_depth_[static_cast<std::size_t>(share * last)]);
}

double Case::median_width() const {
    const double scale = static_cast<double>(camera().projection.matrix(0, 0));
    return 2 * (camera().projection.is_perspective() ? depth_quantile(0.5) : 1) / scale;
}

CircleOfConfusion Case::lens() const {
    const double focus = depth_quantile(1.0 / 3), near = depth_quantile(0), far = depth_quantile(1);
    if (!camera().projection.is_perspective()) {
        const double g = max_coc_px / std::max(far - focus, focus - near);
        return {g * focus, g, 0, true};
    }
    const double k = max_coc_px / std::max(focus / near - 1, 1 - focus / far);
    return {k, k * focus};
}

} // namespace fathom::bench
