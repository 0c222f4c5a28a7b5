// The blur of Blender's sharp frame against the path tracer's own through the same lens, nothing tuned to the image. For
// comparison: untouched 25.9 dB over the frame and 21.6 near edges of depth, Blender's Defocus node 35.2 and 30.6, or 36.1 and
// 31.7 tuned to the truth, a gather with the centre's circle 35.9 and 31.2; the noise of the truth 48.4 and 45.3.

#include "matrices.hpp"
#include "path_traced.hpp"
#include "real_inputs.hpp"
#include "soften.hpp"
#include "test_device.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/fathom.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>
#include <fathom/picture.hpp>

#include <opencv2/imgproc.hpp>

#include <cstring>
#include <fstream>

using namespace fathom;
using namespace fathom::real;

namespace {

constexpr double least_balanced = 39.0, least_balanced_near_edges = 34.5;
constexpr double least_accurate = 40.3, least_accurate_near_edges = 35.9;

double psnr(const std::vector<float>& got, const std::vector<float>& truth, const std::vector<char>* only) {
    double sum = 0;
    const std::vector<double> errors = oracle::color_errors(got, truth, only);
    for (const double off : errors) {
        REQUIRE(std::isfinite(off));
        sum += off * off;
    }
    return -10 * std::log10(sum / static_cast<double>(errors.size()));
}

} // namespace

TEST_CASE("real: the blur of Blender's frame against the path tracer's", "[dof][real]") {
    if (!there("blender/perspective"))
        return;
    const auto [depth, sharp, truth, camera, circle] = oracle::path_traced(data / "blender" / "perspective");
    const Device device = test_device();
    const Image stored = Image::from_host(device, Element::f32, depth.data, {depth.cols, depth.rows});
    const Image color = Image::from_host(device, Element::f32, sharp.data(), {depth.cols, depth.rows, 3});
    const std::vector<char> near = oracle::near_edges(depth);
    const double untouched = psnr(sharp, truth, nullptr);
    const double untouched_near = psnr(sharp, truth, &near);
    std::cout << "blur, Blender perspective, dB over the frame and near edges: untouched " << untouched << " and "
              << untouched_near;
    CHECK(std::abs(untouched - 25.9) < 0.05); // the same pixels as in the figures above
    CHECK(std::abs(untouched_near - 21.6) < 0.05);
    for (const Quality quality : {Quality::balanced, Quality::fast, Quality::accurate}) {
        std::vector<float> got(sharp.size());
        dof({stored, camera}, color, circle, {.quality = quality}).download(got.data());
        const double whole = psnr(got, truth, nullptr), at_edges = psnr(got, truth, &near);
        std::cout << (quality == Quality::fast       ? "; fast "
                      : quality == Quality::balanced ? "; balanced "
                                                     : "; accurate ")
                  << whole << " and " << at_edges;
        const bool accurate = quality == Quality::accurate;
        CHECK(whole >= (accurate ? least_accurate : least_balanced));
        CHECK(at_edges >= (accurate ? least_accurate_near_edges : least_balanced_near_edges));
    }
    std::cout << '\n';
}

namespace {

// Pixels within 4 of those where 1/z bends by more than 0.01 from one to the next, which is where surfaces end.
std::vector<char> bends_of_inverse_depth(const cv::Mat& depth) {
    constexpr float bend = 0.01f;
    constexpr int reach = 4;
    const auto inverse = [&](int x, int y) { // mirrored about the outermost pixels
        const auto within = [](int at, int count) { return at < 0 ? -at : at >= count ? 2 * count - 2 - at : at; };
        return 1 / depth.at<float>(within(y, depth.rows), within(x, depth.cols));
    };
    std::vector<char> near(depth.total());
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x) {
            const float laplacian =
                inverse(x - 1, y) + inverse(x + 1, y) + inverse(x, y - 1) + inverse(x, y + 1) - 4 * inverse(x, y);
            if (std::abs(laplacian) > bend)
                for (int j = std::max(y - reach, 0); j <= std::min(y + reach, depth.rows - 1); ++j)
                    for (int i = std::max(x - reach, 0); i <= std::min(x + reach, depth.cols - 1); ++i)
                        near[static_cast<std::size_t>(j * depth.cols + i)] = 1;
        }
    return near;
}

} // namespace

// Colours that Blender has filtered over 1.5 pixels, as it does by default, with depth of point samples: dB near edges, measured less
// 0.05. Frames rendered at twice the size, blurred and halved have 33.0 and 34.7, and 31.4 and 33.3.
TEST_CASE("real: antialiased frames are blurred about as well as frames of twice the size", "[dof][real]") {
    if (!there("blender/antialiased"))
        return;
    struct Frame {
        const char* name;
        double balanced, accurate; ///< least dB
    };
    const Device device = test_device();
    for (const auto& [name, balanced, accurate] :
         {Frame{"antialiased", 33.22, 34.12}, {"antialiased-near", 31.84, 32.60}, {"perspective", 34.08, 34.64}}) {
        const auto [depth, sharp, truth, camera, circle] = oracle::path_traced(data / "blender" / name);
        const Image stored = Image::from_host(device, Element::f32, depth.data, {depth.cols, depth.rows});
        const Image color = Image::from_host(device, Element::f32, sharp.data(), {depth.cols, depth.rows, 3});
        const std::vector<char> near = bends_of_inverse_depth(depth);
        for (const Quality quality : {Quality::balanced, Quality::accurate}) {
            std::vector<float> got(sharp.size());
            dof({stored, camera}, color, circle, {.quality = quality}).download(got.data());
            const double found = psnr(got, truth, &near);
            std::printf("blur of %s, %s: %.2f dB near edges\n", name,
                        quality == Quality::accurate ? "accurate" : "balanced", found);
            CHECK(found >= (quality == Quality::accurate ? accurate : balanced));
        }
    }
}

// How much is lost near edges where depth is soft, against exact depth, once its edges are sharpened.
TEST_CASE("real: a blur by soft depth is nearly that by exact depth", "[dof][edges][real]") {
    if (!there("blender/antialiased"))
        return;
    constexpr double most_lost = 5, most_on_average = 3.5, most_of_means = 2.2; // dB
    constexpr double away = 0.1;                                                // dB, beside edges
    const Device device = test_device();
    double all = 0, of_means = 0;
    int count = 0, means = 0;
    for (const char* name : {"antialiased", "antialiased-near", "perspective"}) {
        const auto [depth, sharp, truth, camera, circle] = oracle::path_traced(data / "blender" / name);
        const std::vector<char> near = bends_of_inverse_depth(depth);
        std::vector<char> far(near);
        std::ranges::transform(near, far.begin(), [](char is_near) { return !is_near; });
        const Layout layout{depth.cols, depth.rows};
        const Image color = Image::from_host(device, Element::f32, sharp.data(), {depth.cols, depth.rows, 3});
        const auto figures = [&, &sharp = sharp, &truth = truth, &circle = circle](const StoredDepth& stored) {
            std::vector<float> got(sharp.size());
            dof(stored, color, circle).download(got.data());
            return std::pair{psnr(got, truth, &near), psnr(got, truth, &far)};
        };
        const std::vector<float> exact(depth.ptr<float>(), depth.ptr<float>() + depth.total());
        const double best = figures({Image::from_host(device, Element::f32, exact.data(), layout), camera}).first;
        std::printf("%s: exact %.2f dB near edges; lost", name, best);
        for (const auto& [how, soften] : test::softenings) {
            const std::vector<float> soft = soften(exact, depth.cols, depth.rows);
            const StoredDepth stored{Image::from_host(device, Element::f32, soft.data(), layout), camera};
            const auto [as_is, beside_as_is] = figures(stored);
            const auto [found, beside] = figures(sharpen_edges(stored, color));
            std::printf(", %s: %.2f (%.2f as it is)", how, best - found, best - as_is);
            CHECK(best - found <= most_lost);
            CHECK(beside >= beside_as_is - away);
            all += best - found;
            ++count;
            if (std::string_view(how).starts_with("z averaged")) {
                of_means += best - found;
                ++means;
            }
        }
        std::printf("\n");
    }
    std::printf("on average %.2f dB, of means %.2f\n", all / count, of_means / means);
    CHECK(all / count <= most_on_average);
    CHECK(of_means / means <= most_of_means);
}

namespace {

// A .npy of half floats.
std::vector<float> halves_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    const std::size_t begin =
        10 + static_cast<unsigned char>(bytes.at(8)) + 256 * static_cast<unsigned char>(bytes.at(9));
    std::vector<Eigen::half> halves((bytes.size() - begin) / 2);
    std::memcpy(halves.data(), &bytes[begin], 2 * halves.size());
    return {halves.begin(), halves.end()};
}

// Pixels at most so many away from where z changes by 8 % to the next one.
std::vector<char> edges_of(const cv::Mat& z, int reach) {
    cv::Mat log, edges(z.size(), CV_8UC1, cv::Scalar(0));
    cv::log(z, log);
    for (int y = 0; y < z.rows; ++y)
        for (int x = 0; x < z.cols; ++x)
            for (const auto& [u, v] : {std::pair{x + 1, y}, {x, y + 1}})
                if (u < z.cols && v < z.rows && std::abs(log.at<float>(v, u) - log.at<float>(y, x)) > 0.08f)
                    edges.at<uchar>(y, x) = edges.at<uchar>(v, u) = 1;
    cv::dilate(edges, edges, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}), {-1, -1}, reach);
    return {edges.datastart, edges.dataend};
}

} // namespace

// Depth of 36 rays a pixel, averaged as a renderer averages light, against the lens of 256 rays and against unfiltered depth.
TEST_CASE("real: averaged depth is as good as unfiltered depth once its edges are sharpened",
          "[dof][ssao][edges][real]") {
    const fs::path folder = data / "cases" / "renderers";
    if (!there("cases/renderers"))
        return;
    constexpr double least_dof = 36.5, most_ssao = 0.05; // dB within 10 pixels of edges; rms within 2 of them
    const Device device = test_device();
    const DepthFile averaged = read_depth(folder / "in" / "r09.exr"),
                    unfiltered = read_depth(folder / "in" / "r09_clean.exr");
    const Layout layout{averaged.values.cols, averaged.values.rows};
    const std::vector<float> truth = halves_of(folder / "truth" / "lens.npy");
    const cv::Mat light = read_picture(folder / "in" / "r09.exr").color;
    cv::Mat rgb;
    cv::cvtColor(light, rgb, cv::COLOR_BGR2RGB);
    const Image color = to_device(device, rgb);
    const Camera camera =
        preset_camera("encoding=view-z,background_from=99,fov_x_deg=61.92751306", layout.width, layout.height);
    const auto stored = [&](const DepthFile& file) { return StoredDepth{to_device(device, file.values), camera}; };
    const std::vector<char> near = edges_of(unfiltered.values, 10), beside = edges_of(unfiltered.values, 2);
    const auto blurred = [&](const StoredDepth& depth) {
        std::vector<float> got(truth.size());
        dof(depth, color, {15.238095, 64}).download(got.data());
        return psnr(got, truth, &near);
    };
    const auto visibility = [&](const StoredDepth& depth) {
        std::vector<float> got(near.size());
        ssao(depth, 0.8, {.sampling = Sampling{.quality = Quality::accurate}}).visibility.download(got.data());
        return got;
    };
    const Image changed(device, Element::u8, layout);
    const StoredDepth sharp = sharpen_edges(stored(averaged), color, changed);
    const double found = blurred(sharp);
    const std::vector<float> exact = visibility(stored(unfiltered)), got = visibility(sharp),
                             as_is = visibility(stored(averaged));
    const auto rms = [&](const std::vector<float>& open) {
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < open.size(); ++i)
            if (const auto off = static_cast<double>(open[i] - exact[i]); beside[i] && !std::isnan(off)) {
                sum += off * off;
                ++count;
            }
        return std::sqrt(sum / count);
    };
    std::printf("averaged depth: blur %.2f dB near edges (as it is %.2f, unfiltered %.2f); occlusion off by %.3f rms "
                "(as it is %.3f)\n",
                found, blurred(stored(averaged)), blurred(stored(unfiltered)), rms(got), rms(as_is));
    CHECK(found >= least_dof);
    CHECK(rms(got) <= most_ssao);
    CHECK(test::same(to_mat(sharpen_edges(stored(unfiltered), color).image), unfiltered.values));
}
// The mean of the foggy colours of 36 rays a pixel, and the program's fog over the mean of their colours.
TEST_CASE("real: fog over an antialiased frame follows both sides of its edges", "[fog][edges][real]") {
    const fs::path folder = data / "cases" / "renderers";
    if (!there("cases/renderers"))
        return;
    // Where a texture is taken for an edge more is off, and beside corners: of all pixels so many.
    constexpr double most_off = 0.065;
    constexpr std::size_t most_beyond = 30; // pixels that are off by more than 0.02; as whole pixels 509
    const Device device = test_device();
    const std::vector<float> truth = halves_of(folder / "truth" / "r06.npy");
    for (const std::string name : {"r06.exr", "r09.exr"}) { // depth of the middle ray, and averaged
        const DepthFile file = read_depth(folder / "in" / name);
        cv::Mat rgb;
        cv::cvtColor(read_picture(folder / "in" / name).color, rgb, cv::COLOR_BGR2RGB);
        const Image color = to_device(device, rgb);
        const Camera camera = preset_camera("encoding=view-z,background_from=99,fov_x_deg=61.92751306",
                                            file.values.cols, file.values.rows);
        const StoredDepth depth = sharpen_edges({to_device(device, file.values), camera}, color);
        const auto off = [&](bool whole_pixels) {
            std::vector<float> got(truth.size());
            fog(depth, color, {.density = 0.15, .fog_color = {0.5, 0.55, 0.6}, .whole_pixels = whole_pixels})
                .download(got.data());
            double largest = 0;
            std::size_t beyond = 0;
            for (std::size_t i = 0; i < got.size(); i += 3) {
                double worst = 0;
                for (std::size_t k = i; k < i + 3; ++k)
                    worst = std::max(worst, std::abs(static_cast<double>(got[k] - truth[k])));
                largest = std::max(largest, worst);
                beyond += worst > 0.02;
            }
            return std::pair{largest, beyond};
        };
        const auto [largest, beyond] = off(false);
        const auto [largest_whole, beyond_whole] = off(true);
        std::printf("fog over %s: off by %.3f, %zu pixels by more than 0.02 (as whole pixels %.3f, %zu)\n",
                    name.c_str(), largest, beyond, largest_whole, beyond_whole);
        CHECK(largest <= most_off);
        CHECK(beyond <= most_beyond);
        CHECK(beyond_whole > 5 * most_beyond);
    }
}
