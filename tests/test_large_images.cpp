// Images whose elements, or whose bytes, pass 2^31: rows of 65,537 pixels, single rows and columns, dof at 16384 x 8192. Truth is
// the same part of the image, computed alone.

#include "catch.hpp"
#include "images.hpp"
#include "runtime/state.hpp"
#include "ssao_call.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

// Floats that nobody has written take no memory.
class Floats {
public:
    Floats(int width, int height, int channels = 1)
        : layout_{width, height, channels},
          data_(new float[static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                          static_cast<std::size_t>(channels)]) {}

    float* row(int y) {
        return data_.get() + static_cast<std::size_t>(y) * static_cast<std::size_t>(layout_.width) *
                                 static_cast<std::size_t>(layout_.channels);
    }
    Image on(const Device& device) { return Image::from_host(device, Element::f32, data_.get(), layout_); }

private:
    Layout layout_;
    std::unique_ptr<float[]> data_;
};

constexpr double focal_px = 40000;

// Depth of a floor with steps, and a picture over it. Rows that are not in `rows` lie at one depth and are black.
struct Large {
    Camera camera;
    Floats depth, rgb;

    Large(int width, int height, bool with_picture)
        : depth(width, height), rgb(with_picture ? width : 1, with_picture ? height : 1, 3) {
        camera.width = width;
        camera.height = height;
        camera.projection = perspective(2 * std::atan(height / (2 * focal_px)), 1.0 * width / height, {0.1, 1000});
        camera.encoding = Encoding::view_z;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const int step = x / 37 % 3 + y / 29 % 2 + (x / 211 + y / 97) % 4;
                depth.row(y)[x] =
                    (x * 31LL + y * 17LL) % 997 == 0 ? std::nanf("") : 3.0f + 0.02f * static_cast<float>(step);
            }
            for (int i = 0; with_picture && i < 3 * width; ++i)
                rgb.row(y)[i] = static_cast<float>((i * 7919LL + y * 104729LL) % 1024) / 1024.0f;
        }
    }

    StoredDepth stored(const Device& device) { return {depth.on(device), camera}; }
};

// Parts of an image: its corners and its middle.
std::vector<Region> parts_of(int width, int height, int across, int down) {
    std::vector<Region> parts;
    for (const int x : {0, (width - across) / 2, width - across})
        for (const int y : {0, (height - down) / 2, height - down})
            parts.push_back({x, y, across, down});
    return parts;
}

// The part of an image, and a halo as far as there is one.
Region with_halo(const Region& part, int halo, int width, int height) {
    const int left = std::max(part.x - halo, 0), top = std::max(part.y - halo, 0);
    return {left, top, std::min(part.x + part.width + halo, width) - left,
            std::min(part.y + part.height + halo, height) - top};
}

template <typename Of>
auto part_of(const Of& image, const Region& r) {
    return image.region(r.x, r.y, r.width, r.height);
}

// Where a part lies in another one.
Region within(const Region& part, const Region& around) {
    return {part.x - around.x, part.y - around.y, part.width, part.height};
}

constexpr CircleOfConfusion near_lens{.k = 200, .g = 608}; // circles of -2.7 pixels and more, from 3 m on
constexpr DofMasksOptions near_field{.near_alpha = true, .disocclusion = true};

Camera metric_camera(int width, int height) {
    return {.projection = perspective(1.0, 1.0 * width / height, {0.1, 1000}),
            .width = width,
            .height = height,
            .encoding = Encoding::view_z};
}

// The device, if it takes so many bytes at once: drivers take a quarter of the memory, or so.
std::optional<Device> device_for(std::size_t bytes) {
    const Device device = test_device();
    const cl::Device target(runtime::queue_of(device).getInfo<CL_QUEUE_DEVICE>());
    if (target.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>() >= bytes)
        return device;
    WARN("skipped: the device does not take " << bytes << " bytes at once");
    return std::nullopt;
}

} // namespace

TEST_CASE("rows of 65537 pixels, and single rows and columns, have the bits of their parts", "[large][slow]") {
    const Device device = test_device();
    for (const auto& [width, height] : {std::pair{65537, 40}, {65537, 1}, {1, 65537}, {100003, 3}, {3, 100003}}) {
        INFO(width << " x " << height);
        Large large(width, height, true);
        const StoredDepth stored = large.stored(device);
        const Image color = large.rgb.on(device);
        SsaoCall occlusion = options_of(12 * 3 / focal_px, Quality::fast); // 12 pixels
        sampling_of(occlusion).half_resolution = false;
        const CircleOfConfusion lens{.k = 200, .g = 608}; // circles of 2.7 to -2.7 pixels
        const Image z = linearize(stored).image, positions = unproject(stored), directions = normals(stored),
                    foggy = fog(stored, color, {.density = 0.1}), blurred = dof(stored, color, lens);
        const DofMasksOptions near_field{
            .far_weight = true, .max_near_coc = true, .near_alpha = true, .disocclusion = true};
        const DofMasks masks = dof_masks(stored, lens, near_field);
        const Image visible = ssao(stored, occlusion).visibility;
        for (const Region& part : parts_of(width, height, std::min(width, 150), std::min(height, 37))) {
            const Region around = with_halo(part, 160, width, height), inside = within(part, around);
            const StoredDepth small = part_of(stored, around);
            const Image picture = part_of(color, around);
            INFO("from " << part.x << ", " << part.y << " on");
            const auto same = [&](const Image& whole, const Image& alone) {
                return same_bits(floats(part_of(whole, part)), floats(part_of(alone, inside)));
            };
            CHECK(same(z, linearize(small).image));
            CHECK(same(positions, unproject(small)));
            CHECK(same(directions, normals(small)));
            CHECK(same(foggy, fog(small, picture, {.density = 0.1})));
            CHECK(same(blurred, dof(small, picture, lens)));
            const DofMasks parts = dof_masks(small, lens, near_field);
            CHECK(same(masks.far_weight, parts.far_weight));
            CHECK(same(masks.max_near_coc, parts.max_near_coc));
            CHECK(same(masks.near_alpha, parts.near_alpha));
            CHECK(same(masks.disocclusion, parts.disocclusion));
            CHECK(same(visible, ssao(small, occlusion).visibility));
        }
    }
}

TEST_CASE("three channels that pass 2^31 elements have the bits of their parts", "[large][exhaustive]") {
    // Depth lies in single rows only, and so do the results that are looked at: the memory between them is never touched.
    constexpr int width = 65537, height = 11000, rows = 24;
    static_assert(3LL * width * height > 0x80000000LL);
    const auto device = device_for(sizeof(float) * 3 * width * height);
    if (!device)
        return;
    const Camera camera = metric_camera(width, height);
    Floats depth(width, height), positions(width, height, 3);
    const StoredDepth stored{depth.on(*device), camera};
    const Image result = positions.on(*device);
    const Image masks = Image::from_host(*device, Element::f32, positions.row(0), {3 * width, height});
    for (const int top : {0, height / 2, height - rows}) {
        for (int y = top; y < top + rows; ++y)
            for (int x = 0; x < width; ++x)
                depth.row(y)[x] = 3.0f + 0.01f * static_cast<float>((x / 37 + y / 5) % 7);
        const StoredDepth part = stored.region(0, top, width, rows);
        Floats alone(width, rows);
        for (int y = 0; y < rows; ++y)
            std::copy(depth.row(top + y), depth.row(top + y) + width, alone.row(y));
        const StoredDepth same{alone.on(*device), camera, Storage::float32, 0, top};
        const Image there = result.region(0, top, width, rows);
        unproject(part, there);
        CHECK(same_bits(floats(there), floats(unproject(same))));
        normals(part, there);
        CHECK(same_bits(floats(there), floats(normals(same))));
        // Masks side by side in the same memory: rows of three times as many elements.
        const auto beside = [&](int i) { return masks.region(i * width, top, width, rows); };
        const DofMasks results{.coc = beside(0), .near_alpha = beside(1), .disocclusion = beside(2)};
        dof_masks(part, results, near_lens, near_field);
        const DofMasks expected = dof_masks(same, near_lens, near_field);
        CHECK(same_bits(floats(results.coc), floats(expected.coc)));
        CHECK(same_bits(floats(results.near_alpha), floats(expected.near_alpha)));
        CHECK(same_bits(floats(results.disocclusion), floats(expected.disocclusion)));
    }
}
