// Depth that others made: OpenGL's rasteriser and Blender. None of it comes from this project's code,
// so it tells whether the conventions are right, and how near to the truth of each file its numbers can be expected.

#include "real_inputs.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <iomanip>

using namespace fathom;
using namespace fathom::real;
using Eigen::Vector3d;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = 0x1p-24; // half a unit in the last place of a float, relative

// The rasteriser interpolates in float32, one plane d₀ + x gₓ + y g_y for the depth, one for 1/w and one for each
// attribute: the gradients come from about eight rounded operations (two differences, four products, an area and its
// inverse, …) and the plane's value from four more, some of them shared. Sixteen roundings, each of the largest term
// that is added up: |d| + |gₓ| width + |g_y| height. The float that holds a 24-bit code is one of them.
constexpr double rasteriser_roundings = 16;

// What the vertices of `pseudolinear32f` span: its floor, where it is worst, is made of squares of one scene unit, so
// that w in a triangle goes from an integer to the next.
constexpr double pseudo_linear_cell = 1.0;

// `median32f` was interpolated with w = z + m: depth stays exact, x and y slide along the triangle by up to
// (√k − 1)/(√k + 1) of the distance between its vertices' rays, k the ratio of z/(z + m) at them. The data's notes say
// 1.1 %, to the digits given.
constexpr double median_position_relative = 0.0115;

// Blender computes a hit in float32 from the ray's start, so its rounding is that of the distance plus the camera centre's
// coordinates: a triangle's two edges, a determinant and its quotients, the three products of the interpolated position,
// the float32 matrices of the camera.
constexpr double renderer_roundings = 16;
// Long thin triangles (the railing) lose more: the position slides along them, but never out of its pixel.
constexpr double renderer_slivers = 0.01; // share of pixels
constexpr double renderer_pixel = 0.5;    // pixels

Device cpu() {
    return test_device();
}

struct Spread {
    std::vector<double> values;
    void add(double value) { values.push_back(value); }
    double quantile(double q) const {
        std::vector<double> sorted = values;
        std::ranges::sort(sorted);
        return sorted.empty() ? 0 : sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
    }
    double worst() const { return quantile(1); }
};

struct Buffer {
    std::string name;
    DepthFile depth;
    Camera camera;
    cv::Mat z, x_of, y_of, z_of; // truth: distance, and the three coordinates
};

DepthBits bits_of(const Camera& camera) {
    return *camera.depth_bits == 16 ? DepthBits::d16 : *camera.depth_bits == 24 ? DepthBits::d24 : DepthBits::d32f;
}

cv::Mat read_truth(const fs::path& file) {
    cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
    REQUIRE(!image.empty());
    return image;
}

Buffer read_buffer(const std::string& name) {
    const fs::path folder = data / "opengl";
    Buffer buffer{name, opengl_depth(name), {}, {}, {}, {}, {}};
    const cv::Mat& values = buffer.depth.values;
    buffer.camera = camera_for(read_camera(folder / (name + ".json")), values.cols, values.rows);
    buffer.z = read_truth(folder / (name + ".z.tif"));
    cv::Mat channels[3]; // blue first, as OpenCV has it; the file keeps x in red
    cv::split(read_truth(folder / (name + ".position.tif")), channels);
    buffer.x_of = channels[2];
    buffer.y_of = channels[1];
    buffer.z_of = channels[0];
    return buffer;
}

/// The stored value, 0 to 1, that the rasteriser's own z has at every pixel.
cv::Mat stored_of_truth(const Buffer& buffer) {
    cv::Mat stored(buffer.z.size(), CV_64F, cv::Scalar(std::nan("")));
    for (int y = 0; y < stored.rows; ++y)
        for (int x = 0; x < stored.cols; ++x) {
            const float z = buffer.z.at<float>(y, x);
            if (!std::isnan(z))
                stored.at<double>(y, x) =
                    static_cast<double>(stored_depth(buffer.camera, Storage::float32, x + 0.5, y + 0.5, z));
        }
    return stored;
}

/// Slope per pixel within a surface: the smaller one of both sides, since the other may lie on another surface.
double slope(const cv::Mat& stored, int x, int y, int dx, int dy) {
    double least = infinity;
    for (const int side : {-1, 1}) {
        const int there_x = x + side * dx, there_y = y + side * dy;
        if (there_x < 0 || there_y < 0 || there_x >= stored.cols || there_y >= stored.rows)
            continue;
        const double step = std::abs(stored.at<double>(there_y, there_x) - stored.at<double>(y, x));
        least = std::isnan(step) ? least : std::min(least, step);
    }
    return std::isinf(least) ? 1 : least; // a lone pixel: anything inside the range
}

/// How far z may lie from the rasteriser's: what the buffer's step costs, and what the interpolation's noise costs.
double z_bound(const Buffer& buffer, const cv::Mat& stored, int x, int y) {
    const Camera& camera = buffer.camera;
    const double z = buffer.z.at<float>(y, x), value = stored.at<double>(y, x);
    if (camera.encoding == Encoding::pseudo_linear) {
        const double near = std::floor(z / pseudo_linear_cell) * pseudo_linear_cell;
        return pseudo_linear_bound(near, near + pseudo_linear_cell) + rasteriser_roundings * rounding * z;
    }
    const double terms =
        std::abs(value) + slope(stored, x, y, 1, 0) * stored.cols + slope(stored, x, y, 0, 1) * stored.rows;
    const double noise = rasteriser_roundings * rounding * terms;
    const auto moved = [&](double by) {
        return std::abs(static_cast<double>(view_depth(camera, Storage::float32, x + 0.5, y + 0.5, value + by)) - z);
    };
    return depth_error_bound(camera, bits_of(camera), x + 0.5, y + 0.5, z) + std::max(moved(noise), moved(-noise)) +
           rasteriser_roundings * rounding * z;
}

struct Errors {
    Spread z, z_share, position, position_share;
    int surfaces = 0, nothing = 0;
};

Errors judge(const Device& device, const Buffer& buffer) {
    cv::Mat z;
    linearize(device, buffer.depth.values, buffer.camera, z);
    cv::Mat positions;
    unproject(device, buffer.depth.values, buffer.camera, positions);
    const cv::Mat stored = stored_of_truth(buffer);
    Errors errors;
    for (int y = 0; y < z.rows; ++y)
        for (int x = 0; x < z.cols; ++x) {
            INFO(buffer.name << " at " << x << ", " << y);
            const float truth = buffer.z.at<float>(y, x), decoded = z.at<float>(y, x);
            const auto& p = positions.at<cv::Vec3f>(y, x);
            if (std::isnan(truth)) {
                ++errors.nothing;
                REQUIRE(decoded == std::numeric_limits<float>::infinity());
                REQUIRE((std::isnan(p[0]) && std::isnan(p[1]) && std::isnan(p[2])));
                continue;
            }
            ++errors.surfaces;
            REQUIRE(std::isfinite(decoded));
            const double bound = z_bound(buffer, stored, x, y);
            const double error = std::abs(static_cast<double>(decoded) - truth);
            errors.z.add(error / truth);
            errors.z_share.add(error / bound);

            const Vector3d position(buffer.x_of.at<float>(y, x), buffer.y_of.at<float>(y, x),
                                    buffer.z_of.at<float>(y, x));
            REQUIRE(position.z() == -truth);
            const double away = (Vector3d(p[0], p[1], p[2]) - position).norm() / position.norm();
            const double position_bound = buffer.camera.encoding == Encoding::median
                                              ? median_position_relative
                                              : bound / truth + rasteriser_roundings * rounding;
            errors.position.add(away);
            errors.position_share.add(away / position_bound);
        }
    return errors;
}

struct Hit {
    double z_error, error, footprint_error;
};

/// Blender's Position pass against ours, in roundings of the distance plus the camera centre's coordinates, and in pixels.
std::vector<Hit> compare_blender(const fs::path& folder) {
    const fs::path file = folder / "sharp.exr";
    const cv::Mat depth = read_depth(file).values;
    const Camera camera = camera_for(read_camera(folder / "camera.json"), depth.cols, depth.rows);
    cv::Mat positions;
    unproject(cpu(), depth, camera, positions, {.space = Space::world});
    cv::Mat truth[3];
    for (int i = 0; i < 3; ++i)
        truth[i] = read_depth(file, {.channel = std::string("ViewLayer.Position.") + "XYZ"[i]}).values;

    const Eigen::Matrix4d view = *camera.view;
    const Vector3d centre = view.inverse().topRightCorner<3, 1>();
    const bool perspective = camera.projection.is_perspective();
    const double pixel = 2 / (static_cast<double>(camera.projection.matrix(0, 0)) * camera.width);
    std::vector<Hit> hits;
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x) {
            const auto& ours = positions.at<cv::Vec3f>(y, x);
            const Vector3d theirs(truth[0].at<float>(y, x), truth[1].at<float>(y, x), truth[2].at<float>(y, x));
            const double size = rounding * ((theirs - centre).norm() + centre.norm());
            const double z = -(view * theirs.homogeneous()).z();
            const double error = (Vector3d(ours[0], ours[1], ours[2]) - theirs).norm();
            hits.push_back(
                {std::abs(z - depth.at<float>(y, x)) / size, error / size, error / (perspective ? pixel * z : pixel)});
        }
    return hits;
}

} // namespace

TEST_CASE("real: 19 OpenGL buffers decode to the rasteriser's own z and positions", "[real]") {
    if (!there("opengl"))
        return;
    const Device device = cpu();
    std::cout << "OpenGL buffer      pixels      z worst      99 %  of bound  |  position worst      99 %  of bound\n"
              << std::scientific << std::setprecision(2);
    for (const char* name : {"persp16", "persp24", "persp32f", "offcentre24", "infinite24", "reversed32f", "revinf32f",
                             "d3d32f", "ortho16", "ortho_off24", "oblique24", "oblique_off24", "oblique_inf32f",
                             "ortho_oblique24", "tilt32f", "linear24", "log32f", "median32f", "pseudolinear32f"}) {
        const Errors errors = judge(device, read_buffer(name));
        std::cout << std::left << std::setw(17) << name << std::right << std::setw(8) << errors.surfaces << "     "
                  << errors.z.worst() << "  " << errors.z.quantile(0.99) << "  " << std::fixed << errors.z_share.worst()
                  << "      |        " << std::scientific << errors.position.worst() << "  "
                  << errors.position.quantile(0.99) << "  " << std::fixed << errors.position_share.worst()
                  << std::scientific << '\n';
        INFO(name);
        CHECK(errors.surfaces > 12000);
        CHECK(errors.nothing > 1000);
        CHECK(errors.surfaces + errors.nothing == 161 * 121);
        CHECK(errors.z_share.worst() <= 1);
        CHECK(errors.position_share.worst() <= 1);
    }
    std::cout << std::defaultfloat << std::setprecision(6);
}

TEST_CASE("real: Blender's depth unprojects to its Position pass", "[real]") {
    if (!there("blender"))
        return;
    for (const char* kind : {"perspective", "orthographic"}) {
        const std::vector<Hit> hits = compare_blender(data / "blender" / kind);
        Spread z, position, pixels;
        for (const Hit& hit : hits) {
            z.add(hit.z_error);
            position.add(hit.error);
            pixels.add(hit.footprint_error);
        }
        std::cout << "Blender " << kind << ", " << hits.size() << " pixels: z within " << z.worst()
                  << " roundings; positions 99 % within " << position.quantile(1 - renderer_slivers)
                  << " roundings, worst " << pixels.worst() << " pixel\n";
        CHECK(hits.size() == 480 * 270);
        CHECK(z.worst() <= renderer_roundings); // Z is the distance along the view axis, not along the ray
        CHECK(position.quantile(1 - renderer_slivers) <= renderer_roundings);
        CHECK(pixels.worst() <= renderer_pixel);
    }
}
