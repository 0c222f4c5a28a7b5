// Ambient occlusion from Blender's depth against the path tracer's own, rays of one unit. What a single layer of depth
// cannot know, behind poles and outside the frame, is part of the difference: brute force over all slices and pixels of
// the perspective frame, with the path tracer's normals, leaves 0.049 at the same thickness. Thickness from the silhouette
// knows more of the scene than a constant.

#include "camera_over.hpp"
#include "images.hpp"
#include "path_traced.hpp"
#include "program.hpp"
#include "real_inputs.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::real;

namespace {

constexpr double ray_length = 1, thickness = 0.25;
constexpr double best_thickness = 0.322; // the constant that fits both frames best

// What is wanted of balanced and accurate: 0.060 and 0.052 of the perspective frame, 0.01 more of the orthographic one. Its
// 0.062 is missed: brute force over every pixel leaves 0.064 there, and 0.049 on the perspective frame. The rest is
// measured, with a margin of 3%.
struct Known {
    const char* frame;
    double fast, balanced, accurate;
    double balanced_best, accurate_best; // at the best thickness, as wanted
    double with_normals;                 // accurate and of the silhouette, with Blender's normals: docs/blender.md
};
constexpr Known known[] = {{"perspective", 0.069, 0.060, 0.052, 0.052, 0.050, 0.0371},
                           {"orthographic", 0.094, 0.070, 0.070, 0.066, 0.066, 0.0540}};

// Without a thickness it is that of the silhouette.
std::vector<float> visibility_of(const fs::path& folder, Quality quality, std::optional<double> thick = thickness,
                                 bool with_normals = false) {
    const DepthFile depth = read_depth(folder / "sharp.exr");
    const int width = depth.values.cols, height = depth.values.rows;
    const Camera camera = camera_for(read_camera(folder / "camera.json"), width, height);
    const Device device = test_device();
    SsaoOptions options{.sampling = Sampling{.quality = quality},
                        .thickness = thick ? Thickness(*thick) : Thickness(Silhouette{})};
    const cv::Mat normals = with_normals ? read_normals(folder / "sharp.exr") : cv::Mat(); // the image reads its memory
    if (with_normals) {
        options.normals = Image::from_host(device, Element::f32, normals.data, {width, height, 3});
        options.normals_space = Space::world;
    }
    const Image stored = Image::from_host(device, Element::f32, depth.values.data, {width, height});
    std::vector<float> visibility(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    ssao({stored, camera}, ray_length, options).visibility.download(visibility.data());
    return visibility;
}

std::vector<float> truth_of(const fs::path& folder) {
    const cv::Mat truth = oracle::path_traced_visibility(folder);
    return {truth.begin<float>(), truth.end<float>()};
}

double rms_error(const fs::path& folder, Quality quality, std::optional<double> thick = thickness,
                 bool with_normals = false) {
    const images::Difference off =
        images::difference(visibility_of(folder, quality, thick, with_normals), truth_of(folder));
    REQUIRE(std::isfinite(off.rmse));
    return off.rmse;
}

} // namespace

TEST_CASE("real: ambient occlusion from Blender's depth against the path tracer's", "[ssao][real]") {
    if (!there("blender"))
        return;
    for (const Known& frame : known) {
        const fs::path folder = data / "blender" / frame.frame;
        const double fast = rms_error(folder, Quality::fast), balanced = rms_error(folder, Quality::balanced);
        const double accurate = rms_error(folder, Quality::accurate);
        const double with_normals = rms_error(folder, Quality::accurate, std::nullopt, true);
        const double balanced_best = rms_error(folder, Quality::balanced, best_thickness);
        const double accurate_best = rms_error(folder, Quality::accurate, best_thickness);
        std::cout << "ambient occlusion, Blender " << frame.frame << ", RMSE: fast " << fast << ", balanced "
                  << balanced << ", accurate " << accurate << "; at a thickness of " << best_thickness << ": balanced "
                  << balanced_best << ", accurate " << accurate_best << "; from the silhouette, with normals: accurate "
                  << with_normals << '\n';
        CHECK(fast <= frame.fast);
        CHECK(balanced <= frame.balanced);
        CHECK(accurate <= frame.accurate);
        CHECK(balanced_best <= frame.balanced_best);
        CHECK(accurate_best <= frame.accurate_best);
        CHECK(with_normals <= frame.with_normals);
    }
}

namespace {

// What is nearer by 3 % than the pixels two or three away on both sides, along a row or a column.
std::vector<bool> strands_of(const cv::Mat& depth) {
    std::vector<bool> strands(depth.total());
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x)
            for (const int away : {2, 3})
                for (const cv::Point step : {cv::Point(away, 0), cv::Point(0, away)}) {
                    const cv::Point here(x, y);
                    const cv::Rect all({}, depth.size());
                    const float farther = 1.03F * depth.at<float>(here);
                    if (all.contains(here + step) && all.contains(here - step) &&
                        depth.at<float>(here + step) > farther && depth.at<float>(here - step) > farther)
                        strands[static_cast<std::size_t>(y * depth.cols + x)] = true;
                }
    return strands;
}

constexpr float far_away = 1e4F; // what Blender writes where nothing is lies beyond

// Of the strands' mean, of those below 0.2, of all pixels' rms for balanced and accurate: without Blender's normals, and with
// them. 0.060 is wanted with them: 32 slices of 128 samples leave 0.0593. The rms with them is measured, with a margin of 1 %.
struct HairBars {
    double mean, black, rms[2];
};
constexpr HairBars hair_bars[] = {{0.04, 0.04, {0.080, 0.080}}, {0.05, 0.01, {0.0683, 0.0623}}};

double square(double value) {
    return value * value;
}

constexpr int move_samples = 64, move_frames = 10;
constexpr double most_flicker = 1.4;

} // namespace

// What a strand's pixel differs by from the mean of the frames before and after, over that of the path tracer without its noise,
// which has the variance of as many rays of which some meet nothing.
TEST_CASE("real: strands in a move flicker at most 1.4 times as much as the path tracer's",
          "[ssao][real][exhaustive]") {
    if (!there("blender"))
        return;
    const test::Folder folder;
    const test::Outcome rendered = test::run({"-b", "--python", data / "blender/strands-move.py", "--", folder / "out",
                                              "move", std::to_string(move_samples)},
                                             {.program = "blender", .patience_s = 1800});
    if (rendered.code == 126) {
        WARN("skipped: Blender is not installed");
        return;
    }
    REQUIRE(rendered.code == 0);
    std::vector<std::vector<bool>> strands;
    std::vector<std::vector<float>> truth, found[3];
    for (int frame = 1; frame <= move_frames; ++frame) {
        const fs::path file =
            folder / ("out/move." + std::string(frame < 10 ? "000" : "00") + std::to_string(frame) + ".exr");
        const DepthFile depth = read_depth(file);
        const int width = depth.values.cols, height = depth.values.rows;
        strands.push_back(strands_of(depth.values));
        const cv::Mat open = read_depth(file, {.channel = "ViewLayer.AO.R"}).values;
        truth.emplace_back(open.begin<float>(), open.end<float>());
        Camera camera = camera_over(
            perspective(2 * std::atan(18.0 / 35 * height / width), 1.0 * width / height, {0.1, 1000}), width, height);
        camera.encoding = Encoding::view_z;
        const Image stored = Image::from_host(test_device(), Element::f32, depth.values.data, {width, height});
        for (const Quality quality : {Quality::fast, Quality::balanced, Quality::accurate})
            found[static_cast<int>(quality)].push_back(
                images::floats(ssao({stored, camera}, 0.5, {.sampling = Sampling{.quality = quality}}).visibility));
    }
    double of_truth = 0, noise = 0, ours[3] = {};
    for (std::size_t t = 1; t + 1 < strands.size(); ++t)
        for (std::size_t i = 0; i < strands[t].size(); ++i) {
            if (!strands[t][i])
                continue;
            const auto second_difference = [&](const std::vector<std::vector<float>>& frames) {
                return square(static_cast<double>(frames[t - 1][i]) - 2 * static_cast<double>(frames[t][i]) +
                              static_cast<double>(frames[t + 1][i]));
            };
            of_truth += second_difference(truth);
            for (const auto& [at, times] : {std::pair{t - 1, 1}, {t, 4}, {t + 1, 1}})
                noise +=
                    times * static_cast<double>(truth[at][i]) * (1 - static_cast<double>(truth[at][i])) / move_samples;
            for (int q = 0; q < 3; ++q)
                ours[q] += second_difference(found[q]);
        }
    for (int q = 0; q < 3; ++q) {
        const double times = std::sqrt(ours[q] / (of_truth - noise));
        std::cout << "strands in a move, quality " << q << ": " << times << " of the path tracer's flicker, noise "
                  << std::sqrt(noise / of_truth) << " of it\n";
        CHECK(times <= most_flicker);
    }
}

TEST_CASE("real: strands of hair are as bright as the path tracer's", "[ssao][real]") {
    if (!there("blender/hair"))
        return;
    const fs::path folder = data / "blender/hair";
    const cv::Mat depth = read_depth(folder / "sharp.exr").values;
    const std::vector<bool> strands = strands_of(depth);
    const std::vector<float> truth = truth_of(folder);
    for (const int run : {0, 1, 2, 3}) {
        const Quality quality = run % 2 == 0 ? Quality::balanced : Quality::accurate;
        const bool with_pass = run >= 2;
        const HairBars& bars = hair_bars[with_pass];
        const std::vector<float> got = visibility_of(folder, quality, std::nullopt, with_pass);
        double squares = 0, off = 0;
        int all = 0, of_strands = 0, black = 0;
        for (std::size_t i = 0; i < got.size(); ++i) {
            if (!(depth.ptr<float>()[i] < far_away))
                continue;
            const double error = static_cast<double>(got[i]) - static_cast<double>(truth[i]);
            ++all;
            squares += error * error;
            if (strands[i]) {
                ++of_strands;
                off += error;
                black += got[i] < 0.2F;
            }
        }
        const double rms = std::sqrt(squares / all), mean = off / of_strands, part = 1.0 * black / of_strands;
        std::cout << "hair, quality " << static_cast<int>(quality) << (with_pass ? ", with normals" : "") << ": rms "
                  << rms << ", strands brighter by " << mean << " in the mean, " << 100 * part
                  << " % of them below 0.2\n";
        CHECK(of_strands > 5000);
        CHECK(rms <= bars.rms[run % 2]);
        CHECK(std::abs(mean) <= bars.mean);
        CHECK(part <= bars.black);
    }
}
