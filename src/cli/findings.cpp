// What a depth image holds, and what its camera makes of it.
#include "findings.hpp"

#include "codecs.hpp"
#include "messages.hpp"

#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

#include <algorithm>
#include <bit>

namespace fathom::cli {
namespace {

// The stored values as they lie in memory: integer codes or floats, and their bits, which background is compared by.
struct StoredValues {
    std::vector<float> values;
    std::vector<std::uint32_t> bits;
};

template <typename Pixel, typename Visit>
void visit_pixels(const cv::Mat& mat, const Visit& visit) {
    for (int y = 0; y < mat.rows; ++y)
        for (const Pixel* pixel = mat.ptr<Pixel>(y); pixel != mat.ptr<Pixel>(y) + mat.cols; ++pixel)
            visit(*pixel);
}

std::uint32_t code_of(std::uint32_t lowest, std::uint32_t middle, std::uint32_t highest) {
    return lowest | middle << 8 | highest << 16;
}

StoredValues stored_values(const DepthFile& depth) {
    StoredValues stored;
    const auto add = [&](float value, std::uint32_t bits) {
        stored.values.push_back(value);
        stored.bits.push_back(bits);
    };
    const auto add_code = [&](std::uint32_t code) { add(static_cast<float>(code), code); };
    stored.values.reserve(depth.values.total());
    stored.bits.reserve(depth.values.total());
    switch (depth.storage) {
    case Storage::float32:
        visit_pixels<float>(depth.values, [&](float value) { add(value, std::bit_cast<std::uint32_t>(value)); });
        break;
    case Storage::float16:
        visit_pixels<cv::float16_t>(depth.values, [&](cv::float16_t value) {
            add(static_cast<float>(value), std::bit_cast<std::uint16_t>(value));
        });
        break;
    case Storage::uint16:
        visit_pixels<std::uint16_t>(depth.values, add_code);
        break;
    case Storage::uint24:
        visit_pixels<std::uint32_t>(depth.values, [&](std::uint32_t word) { add_code(word & 0xffffff); });
        break;
    case Storage::uint24_high:
        visit_pixels<std::uint32_t>(depth.values, [&](std::uint32_t word) { add_code(word >> 8); });
        break;
    case Storage::rgb8_red_low:
    case Storage::bgr8_red_high:
        visit_pixels<cv::Vec3b>(depth.values, [&](const cv::Vec3b& b) { add_code(code_of(b[0], b[1], b[2])); });
        break;
    case Storage::rgb8_red_high:
    case Storage::bgr8_red_low:
        visit_pixels<cv::Vec3b>(depth.values, [&](const cv::Vec3b& b) { add_code(code_of(b[2], b[1], b[0])); });
        break;
    }
    return stored;
}

Statistics statistics_of(const StoredValues& stored, Storage storage) {
    Statistics result;
    result.percentiles.fill(NAN);
    result.pixels = stored.values.size();
    std::vector<float> finite;
    finite.reserve(stored.values.size());
    const auto largest = static_cast<float>(storage_max(storage));
    for (const float value : stored.values) {
        result.nan += std::isnan(value);
        result.inf += std::isinf(value) && value > 0;
        result.minus_inf += std::isinf(value) && value < 0;
        result.at_zero += value == 0;
        result.at_largest += value == largest;
        if (std::isfinite(value))
            finite.push_back(value);
    }
    if (finite.empty())
        return result;
    const auto [min, max] = std::minmax_element(finite.begin(), finite.end());
    result.min = *min;
    result.max = *max;
    // Nearest rank: always a value that is in the image.
    auto from = finite.begin();
    for (std::size_t i = 0; i < percents.size(); ++i) {
        const auto rank = (finite.size() * static_cast<std::size_t>(percents[i]) + 99) / 100;
        const auto at = finite.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
        std::nth_element(from, at, finite.end());
        result.percentiles[i] = *at;
        from = at;
    }
    return result;
}

std::optional<DepthBits> bits_of(const Camera& camera, Storage storage) {
    switch (camera.depth_bits.value_or(0)) {
    case 16:
        return DepthBits::d16;
    case 24:
        return DepthBits::d24;
    case 32:
        return DepthBits::d32f;
    case 0:
        break;
    default:
        return std::nullopt;
    }
    switch (storage) {
    case Storage::float32:
        return DepthBits::d32f;
    case Storage::float16:
        return std::nullopt;
    case Storage::uint16:
        return DepthBits::d16;
    default:
        return DepthBits::d24;
    }
}

// The ends of the stored range and the value half way between them, whatever the image shows. Needs no device.
std::vector<RangePoint> range_of(const Camera& camera, std::optional<DepthBits> bits, Storage image) {
    const Storage storage = bits ? storage_of(*bits) : image;
    const DepthForm form = depth_form(camera, storage);
    const bool is_float = storage == Storage::float32 || storage == Storage::float16;
    const bool float_image = image == Storage::float32 || image == Storage::float16;
    using enum Encoding;
    if (float_image && (camera.encoding == view_z || camera.encoding == ray_distance || camera.encoding == inverse))
        return {}; // metric floats have no end
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
    RangePoint near = point("near", lowest), far = point("far", highest);
    if (near.z > far.z) {
        std::swap(near, far);
        std::swap(near.name, far.name);
    }
    return {near, point("middle", is_float ? half_way : std::floor(half_way)), far};
}

// The nearest, the middle and the farthest surface of a decoded image.
void find_surfaces(CameraFindings& findings, const cv::Mat& z) {
    std::vector<int> surfaces;
    std::size_t invalid = 0;
    for (int i = 0; i < z.rows * z.cols; ++i) {
        const float value = z.at<float>(i / z.cols, i % z.cols);
        invalid += std::isnan(value);
        if (std::isfinite(value))
            surfaces.push_back(i);
    }
    findings.invalid = invalid;
    if (surfaces.empty()) {
        findings.no_surfaces = "no pixel is a surface";
        return;
    }
    const auto depth_at = [&](int i) { return z.at<float>(i / z.cols, i % z.cols); };
    const auto add = [&](const char* name, std::ptrdiff_t rank) {
        std::nth_element(surfaces.begin(), surfaces.begin() + rank, surfaces.end(),
                         [&](int a, int b) { return depth_at(a) < depth_at(b); });
        const int pixel = surfaces[static_cast<std::size_t>(rank)];
        Surface surface{name, depth_at(pixel), pixel % z.cols + 0.5, pixel / z.cols + 0.5, {}, {}};
        if (findings.bits) {
            surface.spacing = depth_spacing(findings.camera, *findings.bits, surface.x, surface.y, surface.z);
            surface.error_bound = depth_error_bound(findings.camera, *findings.bits, surface.x, surface.y, surface.z);
        }
        findings.surfaces.push_back(surface);
    };
    const auto count = static_cast<std::ptrdiff_t>(surfaces.size());
    add("nearest", 0);
    add("middle", (count - 1) / 2);
    add("farthest", count - 1);
}

void decode(CameraFindings& findings, const DepthFile& depth, const DeviceOption& choice) {
    try {
        const Device device = choice.open();
        const StoredDepth stored{to_device(device, depth.values), findings.camera, depth.storage};
        find_surfaces(findings, to_mat(linearize(stored).image));
    } catch (const NoDevice&) {
        if (!choice.wanted.empty())
            throw;
        findings.no_surfaces = "no OpenCL device to decode them";
    }
}

CameraFindings look_through(const CameraFile& file, const DepthFile& depth, const StoredValues& stored,
                            const DeviceOption& device) {
    CameraFindings findings;
    findings.camera = camera_for(file, depth.values.cols, depth.values.rows);
    const Camera& camera = findings.camera;
    findings.form = depth_form(camera, depth.storage);
    findings.bits = bits_of(camera, depth.storage);
    if (findings.form.background)
        findings.background =
            static_cast<std::size_t>(std::count(stored.bits.begin(), stored.bits.end(), *findings.form.background));
    findings.range = range_of(camera, findings.bits, depth.storage);
    decode(findings, depth, device);
    const double right = camera.width, bottom = camera.height;
    findings.attainable = {{"top left", attainable_depth(camera, 0, 0)},
                           {"top right", attainable_depth(camera, right, 0)},
                           {"centre", attainable_depth(camera, right / 2, bottom / 2)},
                           {"bottom left", attainable_depth(camera, 0, bottom)},
                           {"bottom right", attainable_depth(camera, right, bottom)}};
    return findings;
}

} // namespace

Findings look_at(const std::string& file, const std::string& camera, const std::string& channel,
                 const DeviceOption& device) {
    CameraFile camera_file;
    if (!camera.empty())
        camera_file = read_camera(camera);
    Findings found;
    {
        const StderrSilenced silenced;
        found.depth = read_depth(file, {.channel = channel, .packing = camera_file.packing});
        found.channels = list_channels(file);
    }
    const StoredValues stored = stored_values(found.depth);
    found.statistics = statistics_of(stored, found.depth.storage);
    try {
        if (!camera.empty())
            found.camera = look_through(camera_file, found.depth, stored, device);
    } catch (const std::invalid_argument& error) { // a field of the camera
        throw Error(about(camera, error.what(), {file}));
    }
    return found;
}

} // namespace fathom::cli
