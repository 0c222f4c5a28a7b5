// Stored depth along the edges of a picture, on the host.

#include <fathom/linearize.hpp>

#include "camera/form.hpp"
#include "camera/photograph.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace fathom {
namespace {

// The same in which the background has the distance that is stored.
StoredDepth without_background(StoredDepth stored) {
    stored.camera.background = std::numeric_limits<double>::quiet_NaN(); // none
    stored.camera.background_from.reset();
    stored.camera.background_from_largest_half = false;
    return stored;
}

} // namespace

StoredDepth upsample_along_edges(const StoredDepth& stored, const Image& color) {
    check_stored(stored);
    check_picture_of_any_size(stored, {"color", color});
    const int width = stored.image.width(), height = stored.image.height();
    require(!stored.camera.lens, "color is ", color.width(), " x ", color.height(), " pixels, the depth ", width, " x ",
            height,
            ", and the camera has a lens, through which depth is not brought to another size; give both of "
            "one size");
    require(stored.camera.width == width && stored.camera.height == height,
            "the stored depth is a part of an image; upsample_along_edges takes the whole");
    require(have_same_ratio(width, height, color.width(), color.height()), "color is ", color.width(), " x ",
            color.height(), " pixels, the depth ", width, " x ", height,
            "; both must show the same, with the same ratio of width to height");
    const std::vector<float> z = runtime::floats_of(linearize(stored).image), light = runtime::floats_of(color);
    const Layout layout{color.width(), color.height()};
    std::vector<float> fine(static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.height));
    const EdgeUpsampling upsampling({z.data(), width, height},
                                    {light.data(), layout.width, layout.height, color.channels()});
    in_threads(layout.height, [&](int begin, int end) {
        upsampling.rows_of_distances(begin, end, stored.camera.projection.is_perspective(),
                                     fine.data() +
                                         static_cast<std::size_t>(begin) * static_cast<std::size_t>(layout.width));
    });
    const Image image(stored.image.device(), Element::f32, layout);
    runtime::copy_from_host(fine.data(), image);
    Camera camera = stored.camera;
    camera.width = layout.width;
    camera.height = layout.height;
    return ViewDepth{image, camera}.stored();
}

StoredDepth sharpen_edges(const StoredDepth& stored, const Image& color, const Image& changed) {
    check_stored(stored);
    const Layout layout{stored.image.width(), stored.image.height()};
    if (color)
        check_picture(stored, {"color", color});
    if (changed)
        check_result(stored, {"changed", changed}, Element::u8, layout);
    const bool along_axis = has_plane_in_focus(stored.camera);
    const auto distances = [&](const StoredDepth& depth) {
        return runtime::floats_of(linearize(depth, {.as = along_axis ? Along::axis : Along::ray}).image);
    };
    const std::vector<float> z = distances(stored);
    std::vector<float> light;
    if (color)
        light = runtime::floats_of(color);
    std::vector<float> made = sharpened_distances(
        {z.data(), layout.width, layout.height}, stored.camera.lens || stored.camera.projection.is_perspective(),
        color ? HostFloats{light.data(), layout.width, layout.height, color.channels()} : HostFloats{}, in_threads);
    if (made.empty()) {
        const Encoding encoding = stored.camera.encoding;
        const bool is_of_inverse =
            stored.camera.projection.is_perspective() &&
            (encoding == Encoding::window || encoding == Encoding::inverse || encoding == Encoding::inverse_range);
        const bool has_background = std::ranges::any_of(z, [](float own) { return std::isinf(own); });
        const std::vector<float> open = has_background ? distances(without_background(stored)) : z;
        made = without_means({z.data(), layout.width, layout.height}, {open.data(), layout.width, layout.height},
                             is_of_inverse);
    }
    if (changed) {
        std::vector<std::uint8_t> differ(z.size());
        for (std::size_t i = 0; i < made.size(); ++i)
            differ[i] = made[i] != z[i] && !std::isnan(z[i]);
        runtime::copy_from_host(differ.data(), changed);
    }
    if (made.empty())
        return stored;
    const Image image(stored.image.device(), Element::f32, layout);
    runtime::copy_from_host(made.data(), image);
    StoredDepth sharp = ViewDepth{image, stored.camera}.stored();
    if (!along_axis)
        sharp.camera.encoding = Encoding::ray_distance;
    sharp.x = stored.x;
    sharp.y = stored.y;
    return sharp;
}

} // namespace fathom
