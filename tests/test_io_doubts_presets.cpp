// What each source writes of a scene, read as if every other source had written it: right, told or silent.
#include "io_files.hpp"
#include "random_scene.hpp"

#include "camera/form.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/doubts.hpp>
#include <fathom/io.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/presets.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <cstdlib>
#include <iostream>
#include <map>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr int height = 120;
constexpr double tangent = 0.6; // of half the view across

int width_for(const Preset& preset) {
    return preset.projection.empty() ? 2 * height : 160;
}

/// A preset with the numbers that it needs, the same for all.
std::string with_numbers(const Preset& preset, int width) {
    const std::map<std::string, std::string> numbers{
        {"near", preset.name == "mitsuba3" ? "0.05" : "0.25"}, {"far", "80"}, {"scale", "20"}, {"offset", "0"}};
    const auto text = [](double value) { return std::to_string(value); };
    const double focal = width / (2 * tangent), degrees = 360 / std::numbers::pi;
    std::string keys =
        preset.projection == "fov_x_deg"   ? "fov_x_deg=" + text(degrees * std::atan(tangent))
        : preset.projection == "fov_y_deg" ? "fov_y_deg=" + text(degrees * std::atan(tangent * height / width))
        : preset.projection == "fx"        ? "fx=" + text(focal) + ",fy=" + text(focal) + ",cx=" + text(width / 2.0) +
                                          ",cy=" + text(height / 2.0) + ",pixel_origin=corner"
                                    : "";
    for (const Preset::Need& need : preset.needs)
        keys += (keys.empty() ? "" : ",") + need.key + "=" + numbers.at(need.key);
    return keys.empty() ? preset.name : preset.name + ":" + keys;
}

/// What a source stores of a distance along the axis; of none where it sees nothing.
double value_of(const Camera& camera, Storage storage, double x, double y, double z) {
    if (std::isfinite(z))
        return static_cast<double>(stored_depth(camera, storage, x, y, std::min(z, camera.far_plane.value_or(80))));
    const double far = camera.far_plane.value_or(0);
    return camera.background && !std::isnan(*camera.background) ? *camera.background
           : camera.background_from                             ? std::max(*camera.background_from, far)
           : !is_metric(camera.encoding) && far > 0 ? static_cast<double>(stored_depth(camera, storage, x, y, far))
           : camera.missing                         ? *camera.missing
           : camera.encoding == Encoding::inverse   ? 0
                                                    : std::numeric_limits<double>::infinity();
}

/// The file that a source writes of a scene.
fs::path written(const TempFolder& folder, const Preset& preset, const Scene& scene) {
    const int width = width_for(preset);
    const CameraFile file = preset_file(with_numbers(preset, width));
    const Camera camera = camera_for(file, width, height);
    const bool is_code = preset.name == "vkitti2" || (!file.packing && camera.missing == 0 && camera.scale < 0.1) ||
                         file.packing == Packing::uint16_rotated;
    const Storage storage = file.packing == Packing::uint8         ? Storage::uint8
                            : file.packing == Packing::rgb_red_low ? Storage::uint24
                            : is_code                              ? Storage::uint16
                                                                   : Storage::float32;
    const bool is_rgba = file.packing == Packing::rgba_red_low || file.packing == Packing::rgba_red_high;
    const int type = storage == Storage::uint8    ? CV_8UC1
                     : storage == Storage::uint24 ? CV_8UC3
                     : is_code                    ? CV_16UC1
                     : is_rgba                    ? CV_8UC4
                                                  : CV_32FC1;
    const PixelRays rays(camera);
    Camera straight = camera;
    straight.lens.reset();
    cv::Mat image(height, width, type);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Eigen::Vector3d ray = rays.ray_of(x + 0.5, y + 0.5).value_or(Eigen::Vector3d::UnitZ());
            const Eigen::Vector3d down(ray.x(), camera.lens ? ray.y() : std::copysign(ray.y(), y + 0.5 - height / 2.0),
                                       std::abs(ray.z()) * (camera.lens ? ray.z() / std::abs(ray.z()) : 1));
            const double distance = scene.distance(down);
            const double value = camera.lens ? (std::isfinite(distance) ? distance / camera.scale
                                                                        : value_of(straight, storage, x, y, distance))
                                             : value_of(straight, storage, x + 0.5, y + 0.5, distance * down.z());
            const auto code = static_cast<std::uint32_t>(std::clamp(std::round(value), 0.0, 16777215.0));
            if (type == CV_32FC1)
                image.at<float>(y, x) = static_cast<float>(value);
            else if (type == CV_16UC1) {
                const auto bits = static_cast<std::uint16_t>(std::min(code, 65535u));
                image.at<std::uint16_t>(y, x) = file.packing ? std::rotl(bits, 3) : bits;
            } else if (type == CV_8UC1)
                image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::min(code, 255u));
            else if (type == CV_8UC3) // B, G, R
                image.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(code >> 16),
                                             static_cast<std::uint8_t>(code >> 8 & 0xff),
                                             static_cast<std::uint8_t>(code & 0xff)};
            else {
                const auto bits = static_cast<std::uint32_t>(std::clamp(value * 0x1p32, 0.0, 0xffffffffp0));
                cv::Vec4b bytes; // R the highest, A the lowest
                for (int i = 0; i < 4; ++i)
                    bytes[i] = static_cast<std::uint8_t>(bits >> (24 - 8 * i) & 0xff);
                image.at<cv::Vec4b>(y, x) = file.packing == Packing::rgba_red_high
                                                ? cv::Vec4b(bytes[2], bytes[1], bytes[0], bytes[3])
                                                : cv::Vec4b(bytes[1], bytes[2], bytes[3], bytes[0]);
            }
        }
    const fs::path name = folder / (preset.name + (type == CV_32FC1 ? ".tif" : ".png"));
    REQUIRE(cv::imwrite(name.string(), image));
    return name;
}

/// What a source reads of a file: the distances along its way, and what is said of them.
struct Reading {
    std::vector<double> lengths;
    std::string told = {}; ///< empty where nothing is
};

Reading read(const fs::path& name, const Preset& preset, int width) {
    Reading reading;
    try {
        const CameraFile file = preset_file(with_numbers(preset, width));
        const DepthFile depth = read_depth(name, {.packing = file.packing, .gamma = file.gamma});
        const Camera camera = camera_for(file, depth.values.cols, depth.values.rows);
        const HostDepth stored{depth.values.data, depth.values.cols, depth.values.rows, depth.values.step,
                               depth.storage};
        for (const std::string& each : depth_doubts(camera, stored))
            reading.told += each + "; ";
        for (const std::string& each : key_doubts("{\"preset\": \"" + preset.name + "\"}", camera.width, camera.height))
            reading.told += preset.is_distorted ? "" : each; // which this scene is not
        const DepthForm form = depth_form(straightened(camera), depth.storage);
        const Rays rays = is_along_ray(form) ? camera_rays(camera) : Rays{};
        for (int y = 0; y < stored.height; ++y)
            for (int x = 0; x < stored.width; ++x) {
                double value = 0;
                switch (depth.values.type()) {
                case CV_32FC1:
                    value = static_cast<double>(depth.values.at<float>(y, x));
                    break;
                case CV_16UC1:
                    value = depth.values.at<std::uint16_t>(y, x);
                    break;
                case CV_8UC1:
                    value = depth.values.at<std::uint8_t>(y, x);
                    break;
                default: { // of three bytes R, G, B or B, G, R
                    const auto& bytes = depth.values.at<cv::Vec3b>(y, x);
                    const bool is_rgb = depth.storage == Storage::rgb8_red_low;
                    value = bytes[is_rgb ? 0 : 2] + 256 * bytes[1] + 65536.0 * bytes[is_rgb ? 2 : 0];
                }
                }
                reading.lengths.push_back(static_cast<double>(view_depth(form, rays, x + 0.5, y + 0.5, value)));
            }
    } catch (const std::exception& error) { // refused
        reading.told = error.what();
    }
    return reading;
}

enum class Match { none, but_for_unit, all };

/// Do nine of ten surfaces have the same distance, to 1 %, or the same times a factor?
Match match(const Reading& own, const Reading& other, bool own_lens, bool other_lens) {
    if (own_lens != other_lens || own.lengths.size() != other.lengths.size())
        return Match::none;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < own.lengths.size(); ++i)
        if (own.lengths[i] > 0 && own.lengths[i] < 70)
            ratios.push_back(other.lengths[i] / own.lengths[i]);
    const auto are_most = [&](double ratio) {
        const auto same = std::ranges::count_if(ratios, [&](double r) { return std::abs(r / ratio - 1) < 0.01; });
        return 10 * static_cast<std::size_t>(same) > 9 * ratios.size();
    };
    CAPTURE(own.told);
    REQUIRE(!ratios.empty());
    std::vector<double> sorted = ratios;
    std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
    return are_most(1) ? Match::all : are_most(sorted[sorted.size() / 2]) ? Match::but_for_unit : Match::none;
}

/// Of some scenes of metres the one that fills most of the view.
Scene scene_of(Scene::Kind kind) {
    unsigned best = 0;
    int most = -1;
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        const Scene scene(kind, random);
        int seen = 0;
        double nearest = std::numeric_limits<double>::infinity();
        for (int i = 0; i < 100; ++i) {
            const Eigen::Vector3d ray((i % 10 - 4.5) / 4.5 * tangent, (i / 10 - 4.5) / 4.5 * 0.75 * tangent, 1);
            const double distance = scene.distance(ray.normalized());
            seen += std::isfinite(distance);
            nearest = std::min(nearest, distance);
        }
        if (nearest > 0.4 && scene.unit() > 0.8 && scene.unit() < 4 && seen > most) {
            most = seen;
            best = seed;
        }
    }
    REQUIRE(most > 10);
    std::mt19937 random(best);
    return {kind, random};
}

} // namespace

TEST_CASE("doubts: of every source's depth read as any other's something is said, or it is right", "[doubts][slow]") {
    const char* asked = std::getenv("FATHOM_SCENES"); // three take some minutes
    constexpr std::array scenes{Scene::street, Scene::boxes, Scene::bodies};
    const std::size_t count = asked ? std::min<std::size_t>(scenes.size(), std::strtoul(asked, nullptr, 10)) : 1;
    const TempFolder folder;
    std::map<char, int> counts;
    for (std::size_t i = 0; i < count; ++i) {
        const Scene scene = scene_of(scenes[i]);
        std::cout << "scene " << i << ", in units of " << scene.unit() << " m\n";
        for (const Preset& preset : presets()) {
            const fs::path name = written(folder, preset, scene);
            const int width = width_for(preset);
            const Reading own = read(name, preset, width);
            std::string row;
            for (const Preset& other : presets()) {
                const Reading reading = &other == &preset ? own : read(name, other, width);
                const Match found = match(own, reading, preset.projection.empty(), other.projection.empty());
                row += found == Match::all            ? (!reading.told.empty() ? '!' : '=')
                       : !reading.told.empty()        ? '.'
                       : found == Match::but_for_unit ? 'u'
                                                      : '#';
                ++counts[row.back()];
                if (&other == &preset) {
                    CAPTURE(scene.unit(), preset.name, reading.told);
                    CHECK(row.back() == '=');
                }
                if (row.back() == '!')
                    std::cout << preset.name << " as " << other.name << ", which is right: " << reading.told << '\n';
                if (row.back() == '#')
                    std::cout << preset.name << " as " << other.name << '\n';
            }
            std::cout << row << ' ' << preset.name << '\n';
        }
    }
    std::cout << "presets: " << counts['='] << " right, " << counts['.'] << " told, " << counts['!']
              << " right and told, " << counts['u'] << " silent of another unit, " << counts['#'] << " silent\n";
}
