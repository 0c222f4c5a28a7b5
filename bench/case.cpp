#include "case.hpp"

#include "runtime/state.hpp"

#include "brute_force.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace fathom::bench {
namespace {

std::size_t size_of(const Camera& camera) {
    return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

std::vector<float> patches(int width, int height) {
    std::vector<float> color;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto patch = static_cast<unsigned>((y / 12) * 7919 + (x / 16) * 104729);
            for (const unsigned factor : {2654435761u, 2246822519u, 3266489917u})
                color.push_back(static_cast<float>((patch * factor) >> 8) * 0x1p-24f);
        }
    return color;
}

template <typename Value>
Image uploaded(const Device& device, Element element, const Layout& layout, const std::vector<Value>& values) {
    const Image image(device, element, layout);
    const std::size_t row =
        static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.channels) * sizeof(Value);
    runtime::queue_of(device).enqueueWriteBufferRect(runtime::buffer_of(image), CL_TRUE, {0, 0, 0}, {0, 0, 0},
                                                     {row, static_cast<std::size_t>(layout.height), 1},
                                                     image.row_stride() * sizeof(Value), 0, row, 0, values.data());
    return image;
}

std::vector<double> stored_depth_of(const View& view) {
    const Camera& camera = view.camera();
    const scene::Caster caster(view.scene, camera);
    const auto columns = static_cast<std::size_t>(camera.width);
    const double clear = scene::clear_value(camera);
    std::vector<double> stored(size_of(camera));
    oracle::in_parallel(static_cast<std::size_t>(camera.height), [&](std::size_t y) {
        for (std::size_t x = 0; x < columns; ++x) {
            const auto surface = caster.at(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
            stored[y * columns + x] = surface ? surface->stored : clear;
        }
    });
    return stored;
}

int frames_for(const Camera& camera) {
    const double bytes = 8.0 * static_cast<double>(size_of(camera));
    return bytes > 0.3e9 ? 1 : std::clamp(static_cast<int>(0.5e9 / bytes) + 1, 2, 16);
}

} // namespace

Case::Case(const Device& device, const View& view, int frames)
    : Case(device, view, stored_depth_of(view), frames > 0 ? frames : frames_for(view.camera())) {}

Case::Case(const Device& device, View view, const std::vector<double>& stored, int frames)
    : device_(device), view_(std::move(view)), frames_(static_cast<std::size_t>(frames)) {
    const Layout layout{width(), height()};
    const std::vector<float> values(stored.begin(), stored.end());
    std::vector<std::uint16_t> codes;
    for (const double value : stored)
        codes.push_back(static_cast<std::uint16_t>(std::lround(65535 * value)));
    for (Frame& frame : frames_) {
        frame.stored = uploaded(device, Element::f32, layout, values);
        frame.stored16 = uploaded(device, Element::u16, layout, codes);
    }
    const std::vector<float> z = images::floats(linearize({frames_[0].stored, camera()}).image);
    for (std::size_t i = 0; i < z.size(); i += 17)
        if (std::isfinite(z[i]))
            sorted_depth_.push_back(z[i]);
    std::ranges::sort(sorted_depth_);
}

StoredDepth Case::stored(Storage storage) const {
    const Frame& frame = frames_[current_];
    return {storage == Storage::uint16 ? frame.stored16 : frame.stored, camera(), storage};
}

const Image& Case::in_place() {
    if (!frames_[current_].in_place)
        restore();
    return frames_[current_].in_place;
}

void Case::restore() {
    Frame& frame = frames_[current_];
    if (!frame.in_place)
        frame.in_place = Image(device_, Element::f32, {width(), height()});
    runtime::queue_of(device_).enqueueCopyBuffer(runtime::buffer_of(frame.stored), runtime::buffer_of(frame.in_place),
                                                 0, 0, Image::allocation(Element::f32, {width(), height()}));
    device_.finish();
}

// Its pages are touched before anything is timed.
const Image& Case::result(std::size_t place, int channels) {
    Image& image = frames_[current_].results[place];
    if (!image) {
        const Layout layout{width(), height(), channels};
        image = Image(device_, Element::f32, layout);
        runtime::queue_of(device_).enqueueFillBuffer(runtime::buffer_of(image), 0.0f, 0,
                                                     Image::allocation(Element::f32, layout));
    }
    return image;
}

const Image& Case::floats(int channels) {
    return result(channels == 1 ? 0 : channels == 3 ? 1 : 2, channels);
}

DofMasks Case::masks(bool mixed) {
    DofMasks masks;
    masks.coc = result(3, 1), masks.near_weight = result(4, 1), masks.focus_weight = result(5, 1),
    masks.far_weight = result(6, 1);
    if (mixed)
        masks.mixed_pixels = result(7, 1);
    return masks;
}

const Image& Case::color() {
    Image& image = frames_[current_].color;
    if (picture_.empty())
        picture_ = patches(width(), height());
    if (!image)
        image = uploaded(device_, Element::f32, {width(), height(), 3}, picture_);
    return image;
}

// Distances, seen by the same camera.
StoredDepth Case::backs() {
    if (!backs_)
        backs_ = uploaded(device_, Element::f32, {width(), height()}, oracle::ends_of(view_.scene, camera()));
    Camera of_distances = camera();
    of_distances.encoding = Encoding::view_z;
    return {backs_, of_distances};
}

void Case::set_color(const std::vector<float>& picture) {
    picture_ = picture;
    for (Frame& frame : frames_)
        frame.color = {};
}

void Case::complete() {
    const Frame made = frames_[current_];
    for (std::size_t i = 0; i < frames_.size(); ++i, next()) {
        for (std::size_t place = 0; place < made.results.size(); ++place)
            if (made.results[place])
                result(place, made.results[place].channels());
        if (made.color)
            color();
        if (made.in_place)
            in_place();
    }
    device_.finish();
}

double Case::depth_quantile(double fraction) const {
    const double last = static_cast<double>(sorted_depth_.size() - 1);
    return static_cast<double>(sorted_depth_[static_cast<std::size_t>(fraction * last)]);
}

double Case::median_width() const {
    const double scale = static_cast<double>(camera().projection.matrix(0, 0));
    return 2 * (camera().projection.is_perspective() ? depth_quantile(0.5) : 1) / scale;
}

CircleOfConfusion Case::lens() const {
    const double nearest = depth_quantile(0), farthest = depth_quantile(1);
    const double sharp = focus > 0 ? focus : depth_quantile(1.0 / 3);
    if (!camera().projection.is_perspective()) {
        const double g = max_coc_px / std::max(farthest - sharp, sharp - nearest);
        return {g * sharp, g, 0, true};
    }
    const double k = max_coc_px / std::max(sharp / nearest - 1, 1 - sharp / farthest);
    return {k, k * sharp};
}

} // namespace fathom::bench
