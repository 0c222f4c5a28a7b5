// Normals of Blender's depth against the path tracer's own.
//
// A depth discontinuity lies between two neighbours in a row or a column whose z differ by more than 5% of the nearer one;
// "near" are the pixels within a distance of 2 pixels of one that touches it, "away" all others. Other definitions (2% or
// 10%, a square of pixels for the disk) move the three figures of any method by up to a quarter.

#include "real_inputs.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

using namespace fathom;
using namespace fathom::real;
using Eigen::Vector3d;

namespace {

constexpr double jump = 0.05;     // of the nearer z
constexpr double near_pixels = 2; // from a pixel at a discontinuity

// Bars that the normals of the perspective frame must meet, degrees.
constexpr double mean_all_deg = 1.15, mean_away_deg = 0.50, mean_near_deg = 6.0;

struct Frame {
    Camera camera;
    DepthFile depth;
    cv::Mat z, truth[3];

    Vector3d normal(int x, int y) const {
        return {truth[0].at<float>(y, x), truth[1].at<float>(y, x), truth[2].at<float>(y, x)};
    }
};

Frame read_frame(const fs::path& folder) {
    Frame frame{{}, read_depth(folder / "sharp.exr"), {}, {}};
    const cv::Mat& values = frame.depth.values;
    frame.camera = camera_for(read_camera(folder / "camera.json"), values.cols, values.rows);
    linearize(test_device(), values, frame.camera, frame.z);
    for (int i = 0; i < 3; ++i)
        frame.truth[i] =
            read_depth(folder / "sharp.exr", {.channel = std::string("ViewLayer.Normal.") + "XYZ"[i]}).values;
    return frame;
}

cv::Mat1b near_discontinuities(const cv::Mat& z) {
    cv::Mat1b touching(z.size(), uchar{0}), near(z.size(), uchar{0});
    for (int y = 0; y < z.rows; ++y)
        for (int x = 0; x < z.cols; ++x)
            for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
                if (x + dx >= z.cols || y + dy >= z.rows)
                    continue;
                const double a = z.at<float>(y, x), b = z.at<float>(y + dy, x + dx);
                if (std::abs(a - b) > jump * std::min(a, b))
                    touching(y, x) = touching(y + dy, x + dx) = 1;
            }
    const int reach = static_cast<int>(near_pixels);
    for (int y = 0; y < z.rows; ++y)
        for (int x = 0; x < z.cols; ++x)
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    if (std::hypot(dx, dy) <= near_pixels && x + dx >= 0 && y + dy >= 0 && x + dx < z.cols &&
                        y + dy < z.rows && touching(y + dy, x + dx))
                        near(y, x) = 1;
    return near;
}

struct Means {
    double all = 0, away = 0, near = 0;
    long pixels = 0, near_pixels = 0;
};

Means judge(const Frame& frame, const cv::Mat& normals) {
    const cv::Mat1b near = near_discontinuities(frame.z);
    Means means;
    for (int y = 0; y < frame.z.rows; ++y)
        for (int x = 0; x < frame.z.cols; ++x) {
            const auto& n = normals.at<cv::Vec3f>(y, x);
            const Vector3d truth = frame.normal(x, y), ours(n[0], n[1], n[2]);
            if (std::abs(truth.norm() - 1) > 0.1) // the renderer has none here
                continue;
            const double off = std::atan2(ours.cross(truth).norm(), ours.dot(truth)) * 180 / std::acos(-1.0);
            means.all += off;
            (near(y, x) ? means.near : means.away) += off;
            ++means.pixels;
            means.near_pixels += near(y, x);
        }
    means.away /= static_cast<double>(means.pixels - means.near_pixels);
    means.near /= static_cast<double>(means.near_pixels);
    means.all /= static_cast<double>(means.pixels);
    return means;
}

} // namespace

TEST_CASE("real: Blender's depth gives the path tracer's normals", "[real][normals]") {
    if (!there("blender"))
        return;
    const Frame frame = read_frame(data / "blender" / "perspective");
    const StoredDepth stored{to_device(test_device(), frame.depth.values), frame.camera, frame.depth.storage};
    for (const auto& [name, method] :
         {std::pair{"neighbours", NormalMethod::neighbours}, {"least squares", NormalMethod::least_squares}}) {
        const Means means = judge(frame, to_mat(normals(stored, {.method = method, .space = Space::world})));
        std::printf(
            "normals of Blender's frame, %s, mean error in degrees: %.3f over the frame, %.3f away from edges, %.2f "
            "within 2 pixels of one\n",
            name, means.all, means.away, means.near);
        CHECK(means.pixels > 480 * 270 - 100);
        CHECK(means.all <= mean_all_deg);
        CHECK(means.away <= mean_away_deg);
        CHECK(means.near <= mean_near_deg);
    }
}
