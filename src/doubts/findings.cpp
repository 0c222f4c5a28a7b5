// What a depth image holds, and what its camera makes of it.
#include <fathom/findings.hpp>

#include "camera/form.hpp"
#include "doubts/stored_values.hpp"
#include "lens/camera_lens.hpp"
#include "lens/patches.hpp"
#include "require.hpp"
#include "text.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace fathom {
namespace {

std::optional<DepthBits> bits_of(const Camera& camera, Storage storage) {
    const bool float32 = storage == Storage::float32,
               no_buffer = storage == Storage::float16 || storage == Storage::uint8;
    const int own = float32 ? 32 : no_buffer ? 0 : storage == Storage::uint16 ? 16 : 24;
    switch (camera.depth_bits.value_or(own)) {
    case 16:
        return DepthBits::d16;
    case 24:
        return DepthBits::d24;
    case 32:
        return DepthBits::d32f;
    default:
        return std::nullopt;
    }
}

// The camera of a buffer that need not be able to hold the image's special values.
Camera of_buffer(Camera camera) {
    camera.background = NAN;
    camera.background_from.reset();
    camera.missing.reset();
    return camera;
}

// The ends of the stored range and the value half way between them, whatever the image shows.
std::vector<RangePoint> range_of(const Camera& given, std::optional<DepthBits> bits, Storage image) {
    const Camera camera = bits ? of_buffer(given) : given;
    const Storage storage = bits ? storage_of(*bits) : image;
    const DepthForm form = depth_form(camera, storage);
    if (is_float(image) && is_metric(camera.encoding))
        return {}; // the range of metric floats has no end
    const double lowest = form.lowest, highest = form.highest, half_way = (lowest + highest) / 2;
    const double x = camera.width / 2.0, y = camera.height / 2.0;
    const auto point = [&](const char* name, double stored) {
        const auto z = static_cast<double>(view_depth(camera, storage, x, y, stored));
        RangePoint result{name, stored, z >= form.least_depth && std::isfinite(z) ? z : INFINITY, {}, {}};
        if (bits) {
            const bool finite = std::isfinite(result.z);
            result.spacing = finite ? depth_spacing(camera, *bits, x, y, z) : INFINITY;
            result.error_bound = finite ? depth_error_bound(camera, *bits, x, y, z) : INFINITY;
        }
        return result;
    };
    RangePoint near_end = point("near", lowest), far_end = point("far", highest);
    if (near_end.z > far_end.z) {
        std::swap(near_end, far_end);
        std::swap(near_end.name, far_end.name);
    }
    return {near_end, point("middle", is_float(storage) ? half_way : std::floor(half_way)), far_end};
}

// The nearest, the median and the farthest surface of a decoded image.
std::vector<SurfacePoint> surfaces_of(const CameraFindings& findings, std::span<const float> depth) {
    const auto width = static_cast<std::size_t>(findings.camera.width);
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (std::isfinite(depth[i]))
            pixels.push_back(i);
    std::vector<SurfacePoint> surfaces;
    if (pixels.empty())
        return surfaces;
    const Camera camera = of_buffer(findings.camera);
    const auto add = [&](const char* name, std::size_t rank) {
        const auto at = pixels.begin() + static_cast<std::ptrdiff_t>(rank);
        std::ranges::nth_element(pixels, at, {}, [&](std::size_t i) { return depth[i]; });
        SurfacePoint point{
            name, depth[*at], static_cast<double>(*at % width) + 0.5, static_cast<double>(*at / width) + 0.5, {}, {}};
        if (findings.bits) {
            point.spacing = depth_spacing(camera, *findings.bits, point.x, point.y, point.z);
            point.error_bound = depth_error_bound(camera, *findings.bits, point.x, point.y, point.z);
        }
        surfaces.push_back(point);
    };
    add("nearest", 0);
    add("middle", (pixels.size() - 1) / 2);
    add("farthest", pixels.size() - 1);
    return surfaces;
}

LensFindings lens_findings(const Camera& camera) {
    const lens::CameraLens lens(camera);
    LensFindings found{.fold = lens.laws().fold()};
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const auto ray = lens.direction(x + 0.5, y + 0.5);
            found.no_ray += !ray;
            found.steep += ray && counted_along(camera) == Along::axis && lens.ahead(*ray) < lens::least_ahead();
        }
    return found;
}

} // namespace

StoredStatistics stored_statistics(const HostDepth& stored) {
    StoredStatistics result;
    result.percentiles.fill(NAN);
    const auto largest = static_cast<float>(storage_max(stored.storage));
    std::vector<float> finite;
    visit_values(stored, [&](float value, std::uint32_t) {
        ++result.pixels;
        result.nan += std::isnan(value);
        result.inf += std::isinf(value) && value > 0;
        result.minus_inf += std::isinf(value) && value < 0;
        result.at_zero += value == 0;
        result.at_largest += value == largest;
        if (std::isfinite(value))
            finite.push_back(value);
    });
    if (finite.empty())
        return result;
    auto from = finite.begin();
    for (std::size_t i = 0; i < stored_percents.size(); ++i) { // in ascending order
        const auto nearest_rank = (finite.size() * static_cast<std::size_t>(stored_percents[i]) + 99) / 100;
        const auto at = finite.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(nearest_rank, 1) - 1);
        std::nth_element(from, at, finite.end());
        result.percentiles[i] = *at;
        from = at;
    }
    const auto [min, max] = std::ranges::minmax(finite);
    result.min = min;
    result.max = max;
    return result;
}

CameraFindings camera_findings(const Camera& given, const HostDepth& stored, std::span<const float> depth) {
    const auto pixels = static_cast<std::size_t>(stored.width) * static_cast<std::size_t>(stored.height);
    check_size(given, stored);
    const Camera camera = straightened(given);
    require(depth.empty() || depth.size() == pixels, "depth of ", depth.size(),
            " pixels; must be of the stored depth's ", pixels);
    const double right = camera.width, bottom = camera.height;
    CameraFindings findings{
        .camera = camera,
        .form = depth_form(camera, stored.storage),
        .bits = bits_of(camera, stored.storage),
        .range = {},
        .invalid = {},
        .surfaces = {},
        .attainable = {{{"top left", attainable_depth(camera, 0, 0)},
                        {"top right", attainable_depth(camera, right, 0)},
                        {"centre", attainable_depth(camera, right / 2, bottom / 2)},
                        {"bottom left", attainable_depth(camera, 0, bottom)},
                        {"bottom right", attainable_depth(camera, right, bottom)}}},
    };
    if (given.lens)
        findings.lens = lens_findings(given);
    findings.range = range_of(camera, findings.bits, stored.storage);
    visit_values(stored, [&](float value, std::uint32_t bits) {
        const StoredKind kind = kind_of(findings.form, value, bits);
        findings.background += kind == StoredKind::background;
        findings.missing += kind == StoredKind::missing;
    });
    if (!depth.empty()) {
        findings.invalid =
            static_cast<std::size_t>(std::ranges::count_if(depth, [](float z) { return std::isnan(z); }));
        findings.surfaces = surfaces_of(findings, depth);
    }
    findings.camera = given;
    return findings;
}

} // namespace fathom
