// Depth that others made: OpenGL's rasteriser, Blender, a simulator, a studio. None of it comes from this project's code,
// so it tells whether the conventions are right, and how near to the truth of each file its numbers can be expected.

#include "real_inputs.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/opencv.hpp>

#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
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

double ulp(double value) {
    const auto f = static_cast<float>(std::abs(value));
    return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity()) - f);
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

TEST_CASE("real: the studio's depth is read through its odd data window", "[real]") {
    if (!there("openexr"))
        return;
    const fs::path file = data / "openexr" / "beachball-singlepart.exr";
    const DepthFile depth = read_depth(file);

    Imf::InputFile exr(file.c_str());
    const auto display = exr.header().displayWindow(), window = exr.header().dataWindow();
    REQUIRE(window.min != display.min);
    const long columns = window.max.x - window.min.x + 1;
    Imf::Array2D<half> z(window.max.y - window.min.y + 1, columns);
    Imf::FrameBuffer frame;
    frame.insert("Z", Imf::Slice(Imf::HALF, reinterpret_cast<char*>(&z[0][0] - window.min.x - window.min.y * columns),
                                 sizeof(half), sizeof(half) * static_cast<std::size_t>(columns)));
    exr.setFrameBuffer(frame);
    exr.readPixels(window.min.y, window.max.y);

    CHECK(depth.channel == "Z");
    CHECK(depth.storage == Storage::float16);
    REQUIRE(depth.values.cols == display.max.x - display.min.x + 1);
    REQUIRE(depth.values.rows == display.max.y - display.min.y + 1);
    int inside = 0, outside = 0, different = 0, finite = 0;
    for (int y = 0; y < depth.values.rows; ++y)
        for (int x = 0; x < depth.values.cols; ++x) {
            const int there_x = x + display.min.x, there_y = y + display.min.y;
            const auto bits = depth.values.at<std::uint16_t>(y, x);
            if (there_x < window.min.x || there_x > window.max.x || there_y < window.min.y || there_y > window.max.y) {
                ++outside;
                different += (bits & 0x7c00) != 0x7c00 || (bits & 0x03ff) == 0; // a half's NaN
            } else {
                ++inside;
                const half value = z[there_y - window.min.y][there_x - window.min.x];
                different += value.bits() != bits;
                finite += value.isFinite();
            }
        }
    std::cout << "studio EXR: " << inside << " pixels in the data window, " << outside << " outside, " << finite
              << " finite\n";
    CHECK(different == 0);
    CHECK(inside > 0);
    CHECK(outside > 0);
    CHECK(finite > 0);
}

TEST_CASE("real inputs: the lens of Blender's camera files", "[dof_masks][real]") {
    if (!there("blender"))
        return;
    for (const std::string view : {"perspective", "orthographic"}) {
        const DepthFile depth = read_depth(data / "blender" / view / "sharp.exr");
        const CameraFile file = read_camera(data / "blender" / view / "camera.json");
        const Camera camera = camera_for(file, depth.values.cols, depth.values.rows);
        const StoredDepth stored{to_device(test_device(), depth.values), camera, depth.storage};
        const double focus = *file.lens.focus, focal = *file.lens.focal_length_mm, width = *file.lens.sensor_mm;
        const Lens lens{.f_stop = *file.lens.f_stop, .focus = focus, .focal_length_mm = focal, .sensor_mm = width};
        const CircleOfConfusion circle = circle_of_confusion(lens, camera);
        const cv::Mat found = to_mat(dof_masks(stored, circle).coc);
        // Written from the lens equation, in millimetres; the orthographic view's pixels per unit are its projection's.
        const double aperture = focal / *file.lens.f_stop, pixels_per_mm = 480 / width;
        double worst = 0, least = 0, greatest = 0;
        for (int y = 0; y < found.rows; ++y)
            for (int x = 0; x < found.cols; ++x) {
                const double z = static_cast<double>(depth.values.at<float>(y, x)),
                             c = static_cast<double>(found.at<float>(y, x));
                if (!(z < 1e9))
                    continue;
                const double exact = view == "perspective"
                                         ? aperture * focal / (1000 * focus - focal) * (1 - focus / z) * pixels_per_mm
                                         : aperture / 1000 / focus * (z - focus) *
                                               camera.projection.matrix_in_opengl_axes().cast<double>()(0, 0) * 240;
                worst = std::max(worst, std::abs(c - exact));
                least = std::min(least, c);
                greatest = std::max(greatest, c);
            }
        std::printf("Blender's lens, %-12s circles from %.2f to %.2f px, off the lens equation by at most %.1e px\n",
                    view.c_str(), least, greatest, worst);
        CHECK(worst <= coc_ulp * ulp(std::max(-least, greatest)));
        CHECK(least < -5);
        CHECK(greatest > 2);
        // The projection knows the same lens: it differs by f/S, since a pinhole's image lies at f for every focus.
        if (view == "perspective") {
            const CircleOfConfusion derived =
                circle_of_confusion({.f_stop = *file.lens.f_stop, .focus = focus, .sensor_mm = width}, camera);
            CHECK(std::abs(static_cast<double>(derived.k / circle.k) - (1 - focal / 1000 / focus)) < 1e-6);
        }
    }
}

TEST_CASE("real: the scanned room decodes from 3.77 to 8.07 with its five empty pixels marked", "[real]") {
    if (!there("habitat"))
        return;
    const DepthFile file = read_depth(data / "habitat" / "room.depth.exr");
    const Camera camera =
        camera_for(read_camera(data / "habitat" / "room.camera.json"), file.values.cols, file.values.rows);
    cv::Mat z;
    linearize(cpu(), file.values, camera, z);
    const double near = 0.1, far = 100; // as its camera file says, in engines' own words: z = n f/(f − d (f − n))
    std::vector<cv::Point> empty;
    Spread error;
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
    for (int y = 0; y < z.rows; ++y)
        for (int x = 0; x < z.cols; ++x) {
            const float decoded = z.at<float>(y, x);
            const double stored = file.values.at<float>(y, x);
            if (stored == 1) {
                empty.emplace_back(x, y);
                REQUIRE(decoded == std::numeric_limits<float>::infinity());
                continue;
            }
            nearest = std::min(nearest, decoded);
            farthest = std::max(farthest, decoded);
            error.add(std::abs(decoded / (near * far / (far - stored * (far - near))) - 1));
        }
    std::cout << "habitat room: " << nearest << " to " << farthest << ", worst " << error.worst() / rounding
              << " roundings\n";
    CHECK(file.channel == "Z");
    CHECK(empty == std::vector<cv::Point>{{304, 56}, {305, 56}, {306, 56}, {307, 56}, {308, 56}});
    CHECK(nearest == Approx(3.77).margin(0.005));
    CHECK(farthest == Approx(8.07).margin(0.005));
    CHECK(error.worst() <= 1.001 * rounding * 2); // one unit in the last place, as linearize promises
}
