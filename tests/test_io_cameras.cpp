// Cameras of other programs' files: world points that each format's own formula puts on a pixel come back from that
// pixel.
#include "exr_files.hpp"
#include "io_files.hpp"
#include "places.hpp"

#include <fathom/camera.hpp>
#include <fathom/import_camera.hpp>
#include <fathom/pixel_rays.hpp>

#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#ifdef WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#endif
#include <opencv2/core.hpp>

#include <ctime>

using namespace fathom;
using namespace fathom::test;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Relative to the distance. Both sides compute in double or wider, in some 30 operations of 2^-53 each.
constexpr double doubles = 32 * 0x1p-53;
/// The same where headers hold floats: some 16 roundings to 2^-24, of two matrices.
constexpr double floats = 16 * 0x1p-24;

/// A place and the pixel at which a format's formula sees it, counted from the corner of the first one.
struct Seen {
    Vector3d world;
    Vector2d pixel;
    double depth; ///< along the view axis
};

/// Where the camera puts what lies at a pixel and a distance along the view axis.
Vector3d world_at(const Camera& camera, const Vector2d& pixel, double depth) {
    const Rays rays = camera_rays(camera);
    REQUIRE(rays.w_is_depth);
    const Eigen::Matrix<long double, 3, 1> at(pixel.x(), pixel.y(), 1);
    const Vector3d place = (rays.origin * at + static_cast<long double>(depth) * (rays.direction * at)).cast<double>();
    const Matrix4d view = camera.view.value_or(Matrix4d::Identity());
    return (view.inverse() * place.homogeneous()).head<3>();
}

void check_sees(const Camera& camera, const std::vector<Seen>& all, double tolerance) {
    double worst = 0;
    for (const Seen& seen : all)
        worst =
            std::max(worst, (world_at(camera, seen.pixel, seen.depth) - seen.world).norm() / (1 + seen.world.norm()));
    std::cout << "cameras: " << Catch::getResultCapture().getCurrentTestName() << ": the worst place is off by "
              << worst << '\n';
    CHECK(worst <= tolerance);
    CHECK(all.size() >= 20);
}

/// The camera file that the import is written as makes the same camera, to the bit.
ImportedCamera reread(const TempFolder& folder, ImportedCamera imported, int width = 640, int height = 480) {
    const CameraFile again = read_camera(put(folder / "again.json", imported.text));
    const Camera a = camera_for(imported, width, height), b = camera_for(again, width, height);
    CHECK(a.projection.matrix == b.projection.matrix);
    CHECK(a.projection.convention == b.projection.convention);
    CHECK(a.view.has_value() == b.view.has_value());
    CHECK((!a.view || *a.view == *b.view));
    CHECK(a.encoding == b.encoding);
    CHECK(a.scale == b.scale);
    CHECK(a.missing == b.missing);
    CHECK(a.background_from == b.background_from);
    CHECK(a.near_plane == b.near_plane);
    CHECK(a.far_plane == b.far_plane);
    CHECK(a.width == b.width);
    CHECK(again.preset == imported.preset);
    CHECK(again.packing == imported.packing);
    CHECK(again.lens.f_stop == imported.lens.f_stop);
    CHECK(again.lens.focus == imported.lens.focus);
    return imported;
}

/// Random turns and places, and points before the camera. The matrix takes the world to the camera's axes.
class World {
public:
    explicit World(unsigned seed) : random_(seed) {
        Eigen::Quaterniond turn(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1));
        to_camera.topLeftCorner<3, 3>() = turn.normalized().toRotationMatrix();
        to_camera.topRightCorner<3, 1>() = Vector3d(number(-5, 5), number(-5, 5), number(-5, 5));
    }
    double number(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }

    /// Points in the axes x right, y up or down, z ahead (or behind, `ahead` = -1), and what `pixel` says of them.
    template <typename Pixel>
    std::vector<Seen> points(const Pixel& pixel, double ahead = 1, int count = 60) {
        std::vector<Seen> all;
        for (int i = 0; i < count; ++i) {
            const double z = number(1, 20);
            const Vector3d place(number(-0.4, 0.4) * z, number(-0.3, 0.3) * z, ahead * z);
            all.push_back({(to_camera.inverse() * place.homogeneous()).head<3>(), pixel(place), z});
        }
        return all;
    }

    Matrix4d to_camera = Matrix4d::Identity();

private:
    std::mt19937 random_;
};

std::string text_of(const Matrix4d& matrix) { // rows of JSON, all digits
    std::ostringstream text;
    text.precision(17);
    for (int r = 0; r < 4; ++r) {
        text << (r ? ", [" : "[[");
        for (int c = 0; c < 4; ++c)
            text << (c ? ", " : "") << matrix(r, c);
        text << "]";
    }
    return text.str() + "]";
}

std::string number(double value) {
    std::ostringstream text;
    text.precision(17);
    text << value;
    return text.str();
}

Matrix4d flipped(const char* axes) { // diag(1, -1, -1, 1) for "yz"
    Matrix4d matrix = Matrix4d::Identity();
    for (; *axes; ++axes)
        matrix(*axes - 'x', *axes - 'x') = -1;
    return matrix;
}

struct Colmap {
    std::string cameras, images;
    template <typename Number>
    static void add(std::string& to, Number number) {
        to.append(reinterpret_cast<const char*>(&number), sizeof number);
    }
    void camera(std::uint32_t id, std::int32_t model, const std::vector<double>& parameters) {
        add(cameras, id);
        add(cameras, model);
        add(cameras, std::uint64_t{640});
        add(cameras, std::uint64_t{480});
        for (const double each : parameters)
            add(cameras, each);
    }
    void image(std::uint32_t camera, const std::string& name, const Eigen::Quaterniond& q, const Vector3d& t) {
        add(images, std::uint32_t{9});
        for (const double each : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()})
            add(images, each);
        add(images, camera);
        images += name + '\0';
        add(images, std::uint64_t{2}); // two points
        images.append(48, 'p');
    }
    static std::string counted(std::uint64_t count, const std::string& rest) {
        std::string all;
        add(all, count);
        return all + rest;
    }
};

/// An EXR file with depth and the attributes that are given.
fs::path put_exr(const fs::path& file, const std::function<void(Imf::Header&)>& attributes) {
    const Box2i window{{0, 0}, {63, 47}};
    return write(file, {.display = window, .data = window, .more = attributes});
}

/// A matrix for column vectors as OpenEXR documents it, for row vectors, or as it stands.
Imath::M44f written(const Matrix4d& matrix, bool for_rows) {
    Imath::M44f m;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            m[i][j] = static_cast<float>(for_rows ? matrix(j, i) : matrix(i, j));
    return m;
}

// Of a camera of 500 and 510 pixels that looks through (321.5, 237.5), where the first pixel's centre lies at 0.
Vector2d pixel(const Vector3d& p) {
    return {500 * p.x() / p.z() + 321.5 + 0.5, 510 * p.y() / p.z() + 237.5 + 0.5};
}

} // namespace

TEST_CASE("camera file: camera_to_world is the inverse of view, and one of both is enough", "[io][cameras]") {
    const TempFolder folder;
    World world(1);
    const std::string rest = R"("perspective": {"fov_x_deg": 60}, "encoding": "view-z", )";
    const Camera by_view =
        read_camera(put(folder / "a.json", "{" + rest + "\"view\": " + text_of(world.to_camera) + "}")).camera;
    const Matrix4d to_world = world.to_camera.inverse();
    const Camera by_place =
        read_camera(put(folder / "b.json", "{" + rest + "\"camera_to_world\": " + text_of(to_world) + "}")).camera;
    CHECK((*by_view.view - *by_place.view).cwiseAbs().maxCoeff() <= doubles);
    CHECK(by_place.view->row(3) == Eigen::RowVector4d(0, 0, 0, 1));
    check_says(
        [&] {
            read_camera(put(folder / "c.json", "{" + rest + "\"view\": " + text_of(world.to_camera) +
                                                   ", \"camera_to_world\": " + text_of(to_world) + "}"));
        },
        {"c.json", "both \"view\" and \"camera_to_world\"", "keep one"});
    check_says(
        [&] {
            read_camera(
                put(folder / "d.json", "{" + rest + "\"camera_to_world\": " + text_of(to_world.transpose()) + "}"));
        },
        {"d.json", "\"camera_to_world\"", "is transposed"});
}

TEST_CASE("camera file: a lens and its sensor are a projection where no other is given", "[io][cameras]") {
    const TempFolder folder;
    const auto projection = [&](const std::string& keys) {
        return camera_for(read_camera(put(folder / "lens.json", R"({"encoding": "view-z", )" + keys + "}")), 960, 540)
            .projection.matrix;
    };
    const auto same = [](const Projection::Matrix& a, const Projection::Matrix& b) {
        return (a - b).topRows(2).cwiseAbs().maxCoeff() <= doubles;
    };
    const auto truth =
        projection(R"("intrinsics": {"fx": 1333.3333333333333, "fy": 1333.3333333333333, "cx": 480, "cy": 270})");
    CHECK(same(projection(R"("lens_mm": 50, "sensor_mm": 36)"), truth));
    CHECK(same(projection(R"("width": 960, "height": 540, "lens_mm": 50, "sensor_mm": 36)"), truth));
    CHECK(same(projection(R"("lens_mm": 50, "sensor_mm": 36, "sensor_height_mm": 20.25)"), truth));
    CHECK_FALSE(same(projection(R"("lens_mm": 50, "sensor_mm": 36, "sensor_height_mm": 24)"), truth));
    CHECK_FALSE(same(projection(R"("lens_mm": 50, "sensor_mm": 36, "perspective": {"fov_x_deg": 60})"), truth));
    const CameraFile file = read_camera(folder / "lens.json");
    CHECK(file.lens.focal_length_mm == 50.0);
    CHECK(file.lens.sensor_mm == 36.0);
    CHECK(preset_camera("blender:lens_mm=50,sensor_mm=36", 960, 540).projection.is_perspective());
    check_says([&] { projection(R"("lens_mm": 0, "sensor_mm": 36)"); }, {"\"lens_mm\": 0", "positive"});
    check_says([&] { projection(R"("lens_mm": 50)"); }, {"has no projection"});
}

TEST_CASE("cameras: keys alone are a description, too", "[io][cameras]") {
    const CameraFile file = preset_file("encoding=view-z,scale=0.001,missing=0,fov_x_deg=60");
    CHECK(file.preset.empty());
    CHECK(file.camera.encoding == Encoding::view_z);
    CHECK(file.camera.scale == 0.001);
}

TEST_CASE("cameras: glTF sees what its specification says, through parents and scale", "[io][cameras]") {
    const TempFolder folder;
    World world(2);
    // glTF 2.0, 3.10.3.3: x/(aspect z tan(yfov/2)), y/(z tan(yfov/2)) in clip space; the viewport has y down.
    const double yfov = 0.8, aspect = 1.5, width = 600, height = 400;
    const auto pixel = [&](const Vector3d& p) {
        const double t = std::tan(yfov / 2) * -p.z();
        return Vector2d((p.x() / (aspect * t) + 1) / 2 * width, (1 - p.y() / t) / 2 * height);
    };
    const Matrix4d to_world = world.to_camera.inverse();
    // The place is split between a scaled parent, in TRS, and the node, whose matrix is in columns.
    const Eigen::Quaterniond turn = Eigen::Quaterniond(0.6, -0.2, 0.5, 0.3).normalized();
    Matrix4d parent = Matrix4d::Identity();
    parent.topLeftCorner<3, 3>() = 2 * turn.toRotationMatrix();
    parent.topRightCorner<3, 1>() = Vector3d(1, -2, 3);
    Matrix4d local = parent.inverse() * to_world;
    std::string columns;
    for (int i = 0; i < 16; ++i)
        columns += (i ? ", " : "") + number(local.data()[i]);
    const std::string json =
        R"({"asset": {"version": "2.0"}, "cameras": [
          {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0.5, "zfar": 40}},
          {"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1, "zfar": 100}},
          {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}, "name": "Infinite"}],
        "nodes": [{"name": "Root", "children": [1], "translation": [1, -2, 3], "scale": [2, 2, 2], "rotation": [)" +
        number(turn.x()) + ", " + number(turn.y()) + ", " + number(turn.z()) + ", " + number(turn.w()) +
        R"(]}, {"name": "Main", "camera": 1, "matrix": [)" + columns +
        R"(]}, {"name": "Plan", "camera": 0}, {"camera": 2}], "buffers": []})";
    const fs::path file = put(folder / "scene.gltf", json);
    const ImportedCamera main = reread(folder, import_camera(file, {.node = "Main"}), 600, 400);
    const Camera camera = camera_for(main, 600, 400);
    check_sees(camera, world.points(pixel, -1), doubles);
    CHECK(camera.encoding == Encoding::window);
    // 3.10.3.3: clip z = (far + near)/(near - far) z + 2 far near/(near - far), over -z
    for (const double z : {0.1, 1.0, 7.0, 100.0}) {
        const double n = 0.1, f = 100, clip = ((f + n) / (n - f) * -z + 2 * f * n / (n - f)) / z;
        const auto decoded = static_cast<double>(view_depth(camera, Storage::float32, 0.5, 0.5, clip / 2 + 0.5));
        CHECK(std::abs(decoded / z - 1) <= 1000 * doubles); // far/near is the condition of window depth
    }
    CHECK(import_camera(file, {.node = "1"}).text == main.text);
    CHECK(import_json_camera(file, {.node = "Main"}).text == main.text);
    const Camera infinite = camera_for(import_camera(file, {.node = "Infinite"}), 600, 400);
    CHECK(std::isinf(*infinite.far_plane));

    const Camera plan = camera_for(import_camera(file, {.node = "Plan"}), 600, 400);
    World plane(3);
    std::vector<Seen> seen;
    for (int i = 0; i < 30; ++i) { // 3.10.3.2: x/xmag, y/ymag; this node has no matrix
        const Vector3d p(plane.number(-3, 3), plane.number(-2, 2), -plane.number(1, 30));
        seen.push_back({p, {(p.x() / 3 + 1) * 300, (1 - p.y() / 2) * 200}, -p.z()});
    }
    check_sees(plan, seen, doubles);

    const auto binary = [&](std::uint32_t length) {
        std::string glb = "glTF";
        const auto word = [&](std::uint32_t value) { glb.append(reinterpret_cast<const char*>(&value), 4); };
        word(2);
        word(static_cast<std::uint32_t>(json.size()) + 20);
        word(length);
        word(0x4e4f534a);
        return glb + json;
    };
    const auto size = static_cast<std::uint32_t>(json.size());
    CHECK(import_camera(put(folder / "scene.glb", binary(size)), {.node = "Main"}).text == main.text);
    check_says([&] { import_camera(put(folder / "scene.glb", binary(size + 1)), {.node = "Main"}); },
               {"scene.glb", "cut short"});
    check_says([&] { import_camera(put(folder / "scene.glb", binary(size).substr(0, 17))); }, {"cut short"});

    check_says([&] { camera_for(main, 640, 480); }, {"scene.gltf", "aspect 1.5", "640 x 480"});
    CHECK(camera_for(main, 640, 427).projection.matrix == camera.projection.matrix); // rounded to whole pixels

    check_says([&] { import_camera(file); }, {"scene.gltf", "has 3 cameras", "--node", "Main, Plan, Infinite"});
    check_says([&] { import_camera(file, {.node = "Mian"}); }, {"no camera \"Mian\"", "nearest are Main"});
    check_says([&] { import_camera(file, {.image = "x"}); }, {"leave out --image"});
    const auto refused = [&](const std::string& nodes, const std::vector<std::string>& parts) {
        check_says(
            [&] {
                import_camera(put(folder / "bad.gltf", R"({"asset": {}, "cameras": [{"type": "perspective",
                           "perspective": {"yfov": 0.8, "znear": 0.1}}], "nodes": )" +
                                                           nodes + "}"));
            },
            parts);
    };
    refused("[]", {"no node"});
    refused(R"([{"camera": 1}])", {"nodes[0].camera", "index below 1"});
    refused(R"([{"camera": 0, "children": [0]}])", {"its own ancestor"});
    refused(R"([{"camera": 0, "rotation": [0, 0, 0, 0]}])", {"nodes[0].rotation", "quaternion"});
    refused(R"([{"camera": 0, "rotation": [0, 0, 0]}])", {"nodes[0].rotation", "4 numbers"});
    refused(R"([{"camera": 0, "scale": [1, 0, 1]}])", {"scale of 0"});
    refused(R"([{"camera": 0, "scale": [1, 1, -1]}])", {"mirrored"});
    refused(R"([{"camera": 0, "matrix": "x"}])", {"nodes[0].matrix", "16 numbers"});
    refused(R"([7])", {"nodes[0]", "must be an object"});
    check_says([&] { import_camera(put(folder / "bad.gltf", R"({"asset": {}})")); }, {"has no camera"});

    std::string chain = R"({"asset": {}, "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
                            "nodes": [)";
    constexpr int nodes = 200'000;
    for (int i = 1; i < nodes; ++i)
        chain += R"({"translation": [0, 0, 0.5], "children": [)" + std::to_string(i) + "]},";
    const fs::path long_chain = put(folder / "chain.gltf", chain + R"({"camera": 0}]})");
    const std::clock_t start = std::clock();
    CHECK((*camera_for(import_camera(long_chain), 640, 480).view)(2, 3) == -0.5 * (nodes - 1));
    constexpr double most_s = 3; // 0.3 s of the processor; if each node looked at all others, it would take 7 s
    CHECK((places::sanitized || static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC < most_s));
}

TEST_CASE("cameras: transforms.json of nerfstudio and instant-ngp", "[io][cameras]") {
    const TempFolder folder;
    World world(4), other(5);
    const auto frame = [](const std::string& name, const World& w, const std::string& more = {}) {
        return R"({"file_path": "images/)" + name + R"(.png", "transform_matrix": )" + text_of(w.to_camera.inverse()) +
               more + "}";
    };
    const auto pixel = [](const Vector3d& p) { // OpenGL axes, pixels from the corner
        return Vector2d(500 * p.x() / -p.z() + 322, 510 * -p.y() / -p.z() + 238);
    };
    const std::string lens =
        R"("fl_x": 500, "fl_y": 510, "cx": 322, "cy": 238, "w": 640, "h": 480, "k1": 0, "p2": 0.0, )";
    const fs::path file = put(
        folder / "transforms.json",
        "{" + lens + R"("camera_model": "OPENCV", "applied_transform": [[1,0,0,0],[0,1,0,0],[0,0,1,0]], "frames": [)" +
            frame("a", world, R"(, "depth_file_path": "depth/d7.png")") + ", " + frame("b", other) + "]}");
    const ImportedCamera a = reread(folder, import_camera(file, {.image = "images/a.png"}));
    check_sees(camera_for(a, 640, 480), world.points(pixel, -1), doubles);
    CHECK(a.camera.encoding == Encoding::view_z);
    CHECK(a.camera.scale == 0.001);
    CHECK(a.camera.missing == 0.0);
    CHECK(import_json_camera(file, {.image = "a"}).text == a.text);
    CHECK(import_camera(file, {.depth = folder / "d7.png"}).text == a.text); // the depth is named in the frame
    CHECK(import_camera(file, {.preset = "encoding=view-z", .depth = "elsewhere/b.exr"}).camera.view ==
          import_camera(file, {.image = "b.png", .preset = "encoding=view-z"}).camera.view);
    CHECK(import_camera(file, {.image = "b", .preset = "tum"}).camera.scale == 0.0002);
    check_says([&] { import_camera(file, {.image = "b"}); },
               {"transforms.json", "does not say what the values", "--preset tum"});
    check_says([&] { import_camera(file); }, {"has 2 images", "--image", "images/a.png, images/b.png"});
    check_says([&] { import_camera(file, {.image = "c"}); }, {"no image \"c\"", "nearest are images/"});
    check_says([&] { import_camera(file, {.image = "a", .undistorted = true}); }, {"--undistorted"});

    // instant-ngp: an angle instead of focal lengths, depth as integers times a scale
    const double fx = 320 / std::tan(0.4), fov_pixel = 0.8;
    const auto of_angle = [&](const Vector3d& p) {
        return Vector2d(fx * p.x() / -p.z() + 320, fx * -p.y() / -p.z() + 240);
    };
    const auto ngp = [&](const std::string& keys) {
        return import_camera(put(folder / "ngp.json", "{" + keys + R"(, "integer_depth_scale": 0.00025, "frames": [)" +
                                                          frame("a", world, R"(, "depth_path": "a_depth.png")") +
                                                          "]}"));
    };
    for (const std::string& keys :
         {"\"camera_angle_x\": " + number(fov_pixel) + R"(, "w": 640, "h": 480)",
          "\"x_fov\": " + number(fov_pixel * 180 / std::numbers::pi) + R"(, "w": 640, "h": 480)",
          "\"camera_angle_x\": " + number(fov_pixel)}) { // the image gives its size
        INFO(keys);
        const ImportedCamera camera = reread(folder, ngp(keys));
        check_sees(camera_for(camera, 640, 480), world.points(of_angle, -1), doubles);
        CHECK(camera.camera.scale == 0.00025);
        CHECK(camera.camera.missing == 0.0);
    }
    const auto refused = [&](const std::string& keys, const std::vector<std::string>& parts) {
        check_says([&] { ngp(keys); }, parts);
    };
    refused(lens + R"("k4": 0.01)",
            {"\"k4\": 0.01 is a coefficient that Fathom does not know", "colmap image_undistorter"});
    refused(lens + R"("camera_model": "FOV")", {"\"FOV\" is a lens that Fathom does not know"});
    refused(R"("w": 640)", {"fl_x"});
    refused(R"("fl_x": 500)", {"\"cx\" is missing", "\"w\""});
    refused(R"("fl_x": "a", "w": 640, "h": 480)", {"\"fl_x\": \"a\" must be a number"});
    refused(R"("fl_x": 500, "w": 0.5, "h": 480)", {"\"w\": 0.5", "whole number"});
    refused(R"("camera_angle_x": 4)", {"camera_angle_x", "180 degrees"});
    refused(R"("fl_x": -5, "w": 640, "h": 480)", {"ngp.json"});
    const auto damaged = [&](const std::string& text, const std::vector<std::string>& parts) {
        check_says([&] { import_camera(put(folder / "bad.json", text)); }, parts);
    };
    damaged(R"({"frames": []})", {"\"frames\": []", "not empty"});
    damaged(R"({"frames": [1]})", {"frames[0]", "object"});
    damaged("{" + lens + R"("frames": [{"file_path": "a"}]})", {"frames[0].transform_matrix", "missing"});
    damaged("{" + lens + R"("frames": [{"transform_matrix": [[1, 2], [3]]}]})", {"four rows"});
    damaged("{" + lens + R"("frames": [{"transform_matrix": [[NaN]]}]})", {"bad.json", "is no JSON"});
}

TEST_CASE("cameras: OpenCV's calibration as cv::FileStorage writes it", "[io][cameras]") {
    const TempFolder folder;
    const auto write = [&](const cv::Matx33d& matrix, const std::vector<double>& distortion) {
        const fs::path file = folder / "calibration.yml";
        cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
        storage << "calibration_time"
                << "Sun Nov 22 13:00:00 2026"
                << "image_width" << 640 << "image_height" << 480 << "camera_matrix" << cv::Mat(matrix)
                << "distortion_coefficients" << cv::Mat(distortion);
        storage.release();
        return file;
    };
    const cv::Matx33d matrix(525.25, 0, 319.5, 0, 526.75, 240.125, 0, 0, 1);
    const fs::path file = write(matrix, {0, 0, 0, 0, 0});
    const ImportedCamera made = reread(folder, import_camera(file, {.preset = "kinect"}));
    CHECK(made.preset == "kinect");
    CHECK(made.camera.scale == 0.001);
    CHECK(made.camera.missing == 0.0);
    const Camera camera = camera_for(made, 640, 480);
    CHECK(camera.projection.convention.view_axes == ViewAxes::opencv);
    World world(6);
    world.to_camera.setIdentity(); // a calibration has no place
    const auto by_hand = [&](const Vector3d& p) {
        return Vector2d(525.25 * p.x() / p.z() + 319.5 + 0.5, 526.75 * p.y() / p.z() + 240.125 + 0.5);
    };
    check_sees(camera, world.points(by_hand), doubles);
#ifdef WITH_CALIB3D
    check_sees(camera, world.points([&](const Vector3d& p) {
        std::vector<cv::Point2d> pixel;
        cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(), cv::Vec3d(), matrix,
                          cv::noArray(), pixel);
        return Vector2d(pixel[0].x + 0.5, pixel[0].y + 0.5); // OpenCV counts from the first pixel's centre
    }),
               doubles);
#else
    std::cout << "skipped: cv::projectPoints, since libopencv-calib3d-dev was not there when this was built\n";
#endif
    check_says([&] { import_camera(file); }, {"calibration.yml", "does not say what the values", "--preset kinect"});
    check_says([&] { camera_for(made, 320, 240); }, {"640 x 480", "320 x 240", "scale", "by 0.5"});
    check_says([&] { camera_for(made, 320, 200); }, {"640 x 480", "320 x 200", "use the camera of this image"});

    write(matrix, {0.1, -0.05, 0, 0, 0});
    CHECK(import_camera(file, {.preset = "kinect"}).camera.lens.value().k == std::vector<double>{0.1, -0.05, 0, 0, 0});
    const ImportedCamera undone = import_camera(file, {.preset = "kinect", .undistorted = true});
    CHECK((undone.camera.projection.matrix == made.camera.projection.matrix && !undone.camera.lens));

    const fs::path listed = folder / "listed.yml"; // what yaml.dump and json.dump make of NumPy's lists
    const std::string rows = "image_width: 640\nimage_height: 480\n"
                             "camera_matrix: [[525.25, 0, 319.5], [0, 526.75, 240.125], [0, 0, 1]]\n";
    put(listed, rows + "dist_coeff: [[0.1, -0.05, 0, 0, 0]]\n");
    const Camera bent = import_camera(listed, {.preset = "kinect"}).camera;
    CHECK(bent.projection.matrix == import_camera(file, {.preset = "kinect"}).camera.projection.matrix);
    CHECK(bent.lens.value().k == std::vector<double>{0.1, -0.05, 0, 0, 0});
    put(listed, "camera_matrix: [[525.25, 0, 319.5, 0], [526.75, 240.125], [0, 0, 1]]\n");
    check_says([&] { import_camera(listed, {.preset = "kinect"}); }, {"camera_matrix", "rows of different lengths"});

    write(cv::Matx33d(525, 1, 319.5, 0, 525, 239.5, 0, 0, 1), {});
    check_says([&] { import_camera(file, {.preset = "kinect"}); }, {"camera_matrix", "skew"});
    write(cv::Matx33d(525, 0, 0, 0, 525, 0, 319.5, 239.5, 1), {});
    check_says([&] { import_camera(file, {.preset = "kinect"}); }, {"camera_matrix", "transposed?"});
    write(cv::Matx33d(525, 0, std::nan(""), 0, 525, 239.5, 0, 0, 1), {});
    check_says([&] { import_camera(file, {.preset = "kinect"}); }, {"camera_matrix[2]", "finite"});

    const auto damaged = [&](const std::string& text, const std::vector<std::string>& parts) {
        check_says([&] { import_camera(put(folder / "bad.yml", text), {.preset = "kinect"}); }, parts);
    };
    damaged("%YAML:1.0\n---\ncamera_matrix: [1, 2\n", {"bad.yml", "is no YAML"});
    damaged("%YAML:1.0\n---\nM1: 7\nR: 8\n", {"neither OpenCV's \"camera_matrix\" nor \"K\" of ROS", "M1, R"});
    damaged("camera_matrix: [1, 0, 0]\n", {"3 numbers", "9"});
    damaged("camera_matrix: {rows: 3, cols: 4, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n", {"rows times cols"});
    damaged("just a text\n", {"holds no camera"});
    damaged("<?xml version=\"1.0\"?>", {"is XML"});
    damaged(std::string("camera_matrix: \x1b[31m\xff"), {"bad.yml"});
}

TEST_CASE("cameras: CameraInfo of ROS in both layouts", "[io][cameras]") {
    const TempFolder folder;
    const auto import = [&](const std::string& text, ImportOptions options = {.storage = Storage::uint16}) {
        return import_camera(put(folder / "info.yaml", text), options);
    };
    const std::string k = "[525.0, 0.0, 319.5, 0.0, 526.0, 239.5, 0.0, 0.0, 1.0]";
    const std::string p = "[500.0, 0.0, 310.25, 0.0, 0.0, 501.0, 230.75, 0.0, 0.0, 0.0, 1.0, 0.0]";
    const auto saved = [&](const std::string& d) { // camera_calibration_parsers' file
        return "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  "
               "data: " +
               k + "\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: " + d +
               "\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
               "projection_matrix:\n  rows: 3\n  cols: 4\n  data: " +
               p + "\n";
    };
    const auto message = [&](const std::string& d, const std::string& roi, int binning, bool capital) {
        const auto key = [&](char c) {
            return std::string(1, capital ? static_cast<char>(std::toupper(c)) : c) + ": ";
        };
        return "header:\n  frame_id: head\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n" + key('d') + d +
               "\n" + key('k') + k + "\n" + key('r') + "[1, 0, 0, 0, 1, 0, 0, 0, 1]\n" + key('p') + p +
               "\nbinning_x: " + std::to_string(binning) + "\nbinning_y: " + std::to_string(binning) + "\nroi: " + roi +
               "\n---\n";
    };
    const std::string none = "[0.0, 0.0, 0.0, 0.0, 0.0]", some = "[0.1, 0.0, 0.0, 0.0, 0.0]";
    const std::string whole = "{x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: False}";
    World world(7);
    world.to_camera.setIdentity();
    const auto raw = [](const Vector3d& q) { return Vector2d(525 * q.x() / q.z() + 320, 526 * q.y() / q.z() + 240); };
    const auto rectified = [](const Vector3d& q) {
        return Vector2d(500 * q.x() / q.z() + 310.75, 501 * q.y() / q.z() + 231.25);
    };
    for (const std::string& text : {saved(none), message(none, whole, 0, false), message(none, whole, 1, true)}) {
        INFO(text);
        const ImportedCamera camera = reread(folder, import(text));
        check_sees(camera_for(camera, 640, 480), world.points(raw), doubles);
        CHECK(camera.camera.scale == 0.001); // REP 118
        CHECK(camera.camera.missing == 0.0);
        CHECK(import(text, {.storage = Storage::float32}).camera.scale == 1);
        CHECK_FALSE(import(text, {.storage = Storage::float32}).camera.missing.has_value());
        check_says([&] { import(text, {}); }, {"16UC1", "32FC1"});
    }
    for (const std::string& text : {saved(some), message(some, whole, 0, false)}) {
        CHECK(import(text).camera.lens.value().law == LensLaw::brown);
        const ImportedCamera camera = import(text, {.undistorted = true, .storage = Storage::uint16});
        check_sees(camera_for(camera, 640, 480), world.points(rectified), doubles);
    }
    // A part of the sensor, two pixels by two put together: f/2 and (c - offset)/2, as image_geometry has it.
    const std::string part = "{x_offset: 100, y_offset: 60, height: 200, width: 320, do_rectify: False}";
    const ImportedCamera binned = import(message(none, part, 2, false));
    CHECK(binned.camera.width == 160);
    CHECK(binned.camera.height == 100);
    const auto half = [](const Vector3d& q) {
        return Vector2d(262.5 * q.x() / q.z() + (319.5 - 100) / 2 + 0.5, 263 * q.y() / q.z() + (239.5 - 60) / 2 + 0.5);
    };
    check_sees(camera_for(binned, 160, 100), world.points(half), doubles);

    const auto damaged = [&](std::string text, const std::string& from, const std::string& to,
                             const std::vector<std::string>& parts) {
        text.replace(text.find(from), from.size(), to);
        check_says([&] { import(text); }, parts);
    };
    damaged(saved(none), "525.0", "0.0", {"info.yaml", "never calibrated"});
    damaged(saved(none), "525.0", ".nan", {"finite"});
    damaged(saved(none), "525.0", "-525.0", {"info.yaml", "is mirrored"});
    damaged(saved(none), "plumb_bob", "spherical", {"spherical", "rectified topic", "--undistorted"});
    damaged(message(none, whole, 0, false), "binning_x: 0", "binning_x: x", {"binning_x", "finite"});
    damaged(message(none, whole, 0, false), whole, "7", {"roi", "map"});
    damaged(saved(none), "image_width: 640", "image_width: -640", {"width", "whole number"});
}

TEST_CASE("cameras: Open3D's intrinsics and parameters, column by column", "[io][cameras]") {
    const TempFolder folder;
    World world(21);
    const std::string lens =
        R"("width": 640, "height": 480, "intrinsic_matrix": [500, 0, 0, 0, 510, 0, 321.5, 237.5, 1])";
    std::string columns;
    for (int i = 0; i < 16; ++i)
        columns += (i ? ", " : "") + number(world.to_camera(i % 4, i / 4));
    const auto pixel = [](const Vector3d& p) { // of which the first one's centre is at 0, 0
        return Vector2d(500 * p.x() / p.z() + 321.5 + 0.5, 510 * p.y() / p.z() + 237.5 + 0.5);
    };
    const fs::path file =
        put(folder / "parameters.json", R"({"class_name": "PinholeCameraParameters", "extrinsic": [)" + columns +
                                            R"(], "intrinsic": {)" + lens + "}}");
    check_sees(camera_for(reread(folder, import_camera(file, {.preset = "kinect"})), 640, 480), world.points(pixel),
               doubles);
    const ImportedCamera alone = import_camera(put(folder / "intrinsic.json", "{" + lens + "}"), {.preset = "kinect"});
    World unmoved(22);
    unmoved.to_camera.setIdentity();
    check_sees(camera_for(alone, 640, 480), unmoved.points(pixel), doubles);
    CHECK(alone.camera.scale == 0.001);
    const auto refused = [&](const std::string& text, const std::string& said, const std::string& preset = "kinect") {
        check_says([&] { import_camera(put(folder / "bad.json", text), {.preset = preset}); }, {"bad.json: ", said});
    };
    const fs::path shot = put(folder / "trajectory.json",
                              R"({"class_name": "PinholeCameraTrajectory", "parameters": [{"extrinsic": [)" + columns +
                                  R"(], "intrinsic": {)" + lens + R"(}}, {"intrinsic": {)" + lens + "}}]}");
    check_sees(camera_for(import_camera(shot, {.image = "0", .preset = "kinect"}), 640, 480), world.points(pixel),
               doubles);
    check_sees(camera_for(import_camera(shot, {.image = "1", .preset = "kinect"}), 640, 480), unmoved.points(pixel),
               doubles);
    check_says([&] { import_camera(shot, {.preset = "kinect"}); }, {"has 2 cameras; say which with --image: 0, 1"});
    refused(R"({"class_name": "PinholeCameraTrajectory", "parameters": [7]})", "\"class_name\"");
    refused("{" + lens + "}", "does not say what the values of the depth mean; name its source", "");
    refused(R"({"intrinsic_matrix": [500, 0, 321.5, 0, 510, 237.5, 0, 0, 1]})", "is it transposed?");
    refused(R"({"intrinsic_matrix": [500, 0, 0]})", "must be a list of 9 numbers");
    refused(R"({"intrinsic_matrix": [500, 0, 0, 0, 510, 0, 321.5, "x", 1]})", "must be a list of 9 numbers");
    refused(R"({"intrinsic": {)" + lens + R"(}, "extrinsic": [1]})", "\"extrinsic\": [1] must be a list of 16 numbers");
}

TEST_CASE("cameras: a scene and a camera of BOP", "[io][cameras]") {
    const TempFolder folder;
    World world(23);
    const auto rows = [&](const Matrix4d& m) {
        std::string all;
        for (int i = 0; i < 9; ++i)
            all += (i ? ", " : "") + number(m(i / 3, i % 3));
        return all;
    };
    const Vector3d place = 1000 * world.to_camera.topRightCorner<3, 1>(); // in millimetres
    const std::string first = R"({"cam_K": [900, 0, 300, 0, 900, 200, 0, 0, 1], "depth_scale": 1.0})",
                      moved =
                          R"({"cam_K": [500, 0, 321.5, 0, 510, 237.5, 0, 0, 1], "depth_scale": 0.1, "cam_R_w2c": [)" +
                          rows(world.to_camera) + R"(], "cam_t_w2c": [)" + number(place.x()) + ", " +
                          number(place.y()) + ", " + number(place.z()) + "]}";
    const fs::path file = put(folder / "scene_camera.json", R"({"0": )" + first + R"(, "12": )" + moved + "}");
    constexpr double through_millimetres = doubles + 4 * 0x1p-53;
    for (const ImportOptions& options :
         {ImportOptions{.image = "12"}, {.image = "000012"}, {.depth = "depth/000012.png"}}) {
        const ImportedCamera camera = reread(folder, import_camera(file, options));
        check_sees(camera_for(camera, 640, 480), world.points(pixel), through_millimetres);
        CHECK(camera.camera.scale == Approx(0.0001).epsilon(1e-15)); // a code is a tenth of a millimetre
        CHECK(camera.camera.missing == 0.0);
    }
    CHECK(camera_for(import_camera(file, {.image = "0"}), 640, 480).scale == 0.001);
    check_says([&] { import_camera(file, {}); }, {"has 2 images; say which with --image: 000000, 000012"});
    check_says([&] { import_camera(file, {.image = "7"}); }, {"has no image \"000007\""});
    const ImportedCamera whole = import_camera(
        put(folder / "camera.json",
            R"({"cx": 321.5, "cy": 237.5, "depth_scale": 0.5, "fx": 500, "fy": 510, "height": 480, "width": 640})"),
        {});
    World unmoved(24);
    unmoved.to_camera.setIdentity();
    check_sees(camera_for(whole, 640, 480), unmoved.points(pixel), doubles);
    CHECK(whole.camera.scale == 0.0005);
    for (const char* scale : {"-0.5", "0"})
        check_says(
            [&] {
                import_camera(put(folder / "camera.json",
                                  std::string(R"({"cx": 1, "cy": 1, "fx": 5, "fy": 5, "depth_scale": )") + scale + "}"),
                              {});
            },
            {"\"depth_scale\": ", scale, "how many millimetres a code is"});
}

TEST_CASE("cameras: RealSense's intrinsics, whatever their model is called", "[io][cameras]") {
    const TempFolder folder;
    World world(27);
    world.to_camera.setIdentity();
    // librealsense's rs2_project_point_to_pixel, whose pixels are counted from the first one's centre.
    const auto pixel_of = [](std::array<double, 5> k, bool is_modified) {
        return [=](const Vector3d& p) {
            const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y,
                         f = 1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2, xt = is_modified ? x * f : x,
                         yt = is_modified ? y * f : y;
            return Vector2d(500 * (x * f + 2 * k[2] * xt * yt + k[3] * (r2 + 2 * xt * xt)) + 321.5 + 0.5,
                            510 * (y * f + 2 * k[3] * xt * yt + k[2] * (r2 + 2 * yt * yt)) + 237.5 + 0.5);
        };
    };
    const auto file = [&](const std::string& more) {
        return put(folder / "rs.json",
                   R"({"width": 640, "height": 480, "ppx": 321.5, "ppy": 237.5, "fx": 500, "fy": 510)" + more + "}");
    };
    const std::string none = R"(, "coeffs": [0.0, 0.0, 0.0, 0.0, 0.0])";
    for (const std::string& more :
         {std::string(), R"(, "model": "distortion.brown_conrady")" + none,
          R"(, "model": "Inverse Brown Conrady")" + none, R"(, "model": "distortion.none")" + none,
          R"(, "model": "modified_brown_conrady")" + none}) {
        const ImportedCamera made = reread(folder, import_camera(file(more), {.preset = "realsense"}));
        CHECK(made.camera.scale == 0.001);
        CHECK_FALSE(made.camera.lens);
        check_sees(camera_for(made, 640, 480), world.points(pixel_of({}, false)), doubles);
    }
    const auto rays_lead_back = [&](const std::string& more, const auto& pixel) {
        const Camera camera = camera_for(import_camera(file(more), {.preset = "realsense"}), 640, 480);
        REQUIRE(camera.lens);
        const PixelRays rays(camera);
        for (const Vector3d& p : {Vector3d(0.3, -0.2, 1), {-0.4, 0.35, 1}, {0.1, 0.1, 1}}) {
            const Vector2d at = pixel(p);
            const auto ray = rays.ray_of(at.x(), at.y());
            REQUIRE(ray);
            CHECK((*ray - p.normalized()).norm() < 1e-9);
        }
    };
    rays_lead_back(R"(, "model": "distortion.brown_conrady", "coeffs": [0.05, -0.04, 0.001, -0.002, 0.01])",
                   pixel_of({0.05, -0.04, 0.001, -0.002, 0.01}, false));
    rays_lead_back(R"(, "model": "distortion.modified_brown_conrady", "coeffs": [0.05, -0.04, 0, 0, 0.01])",
                   pixel_of({0.05, -0.04, 0, 0, 0.01}, true));
    const auto refused = [&](const std::string& more, const std::string& said) {
        check_says([&] { import_camera(file(more), {.preset = "realsense"}); }, {"rs.json: ", said});
    };
    for (const char* model : {"inverse_brown_conrady", "modified_brown_conrady", "none"})
        refused(R"(, "model": "distortion.)" + std::string(model) + R"(", "coeffs": [0.05, 0, 0.001, 0, 0])",
                "align the colour to it (rs.align(rs.stream.depth))");
    refused(R"(, "model": "distortion.kannala_brandt4")" + none, "must be none, brown_conrady");
    refused(R"(, "model": 4)" + none, "must be none, brown_conrady");
    refused(R"(, "coeffs": [0, 0])", "must be a list of 5 numbers");
    check_says([&] { import_camera(file(none)); }, {"does not say what the values", "--preset realsense"});
}

TEST_CASE("cameras: KITTI's lines of matrices", "[io][cameras]") {
    const TempFolder folder;
    World world(28);
    world.to_camera.setIdentity();
    std::string lines = "calib_time: 09-Jan-2012 13:57:47\n";
    for (const char* camera : {"0", "1", "2", "3"})
        lines += std::string("P") + camera + ": 5.000000000000e+02 0 " + (camera[0] == '2' ? "321.5" : "300") + " -" +
                 camera + "45.5 0 510 237.5 0.3 0 0 1 0.002\n";
    const fs::path file =
        put(folder / "calib.txt", lines + "R0_rect: 1 0 0 0 1 0 0 0 1\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
    const ImportedCamera second = reread(folder, import_camera(file, {.image = "P2", .preset = "kitti"}));
    CHECK(second.camera.scale == 1 / 256.0);
    check_sees(camera_for(second, 640, 480), world.points(pixel), doubles);
    check_says([&] { import_camera(file, {.preset = "kitti"}); },
               {"has 4 cameras; say which with --image: P0, P1, P2, P3"});
    check_says([&] { import_camera(file, {.image = "P2"}); }, {"does not say what the values", "--preset kitti"});
}

TEST_CASE("cameras: settings of ORB-SLAM and chains of Kalibr are refused with the page that helps", "[io][cameras]") {
    const TempFolder folder;
    for (const char* text : {"%YAML:1.0\n\nCamera.fx: 500.0\nCamera.fy: 510.0\n", "Camera1.fx: 500.0\n",
                             "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 362.7, 248.1]\n"})
        check_says([&] { import_camera(put(folder / "c.yaml", std::string(text)), {.preset = "tum"}); },
                   {"c.yaml: ", "ORB-SLAM or Kalibr", "docs/cameras.md"});
}

TEST_CASE("cameras: a byte order mark before a text is no part of it", "[io][cameras]") {
    const TempFolder folder;
    const std::string mark = "\xef\xbb\xbf", k = "500 0 321.5 0\n0 510 237.5 0\n0 0 1 0\n";
    const auto centre_of = [&](const char* name, const std::string& text,
                               ImportOptions options = {.preset = "scannet"}) {
        const auto ahead =
            pixel_of(camera_for(import_camera(put(folder / name, mark + text), options), 640, 480), {0, 0, 1});
        REQUIRE(ahead);
        CHECK((*ahead - Vector2d(322, 238)).norm() < 1e-9);
    };
    centre_of("4x4.txt", k + "0 0 0 1\n");
    centre_of("3x4.txt", k);
    centre_of("calib.txt", "P2: 500 0 321.5 0 0 510 237.5 0 0 0 1 0\n");
    centre_of("k.yml", "%YAML:1.0\n---\ncamera_matrix: [500, 0, 321.5, 0, 510, 237.5, 0, 0, 1]\n");
    centre_of("k.json",
              R"({"intrinsics": {"fx": 500, "fy": 510, "cx": 321.5, "cy": 237.5, "pixel_origin": "centre"}})");
    centre_of("cameras.txt", "# Camera list\n1 PINHOLE 640 480 500 510 322 238\n", {.preset = "colmap"});
}

TEST_CASE("cameras: a camera matrix in a text, as ScanNet has it", "[io][cameras]") {
    const TempFolder folder;
    World world(25);
    world.to_camera.setIdentity();
    for (const char* text :
         {"500.0 0.0 321.5 0.0\n0.0 510.0 237.5 0.0\n0.0 0.0 1.0 0.0\n0.0 0.0 0.0 1.0\n",
          "5e2 0 321.5\r\n0 510 237.5\r\n0 0 1", "# K\n[[500, 0, 321.5],\n [0, 510, 237.5],\n [0, 0, 1]]\n",
          "500 0 321.5 0\n0 510 237.5 0\n0 0 1 0\n", "500 0 321.5 45.8 0 510 237.5 -0.3 0 0 1 0.005"})
        check_sees(
            camera_for(reread(folder, import_camera(put(folder / "k.txt", text), {.preset = "scannet"})), 640, 480),
            world.points(pixel), doubles);
    const auto refused = [&](const std::string& text, const std::string& said) {
        check_says([&] { import_camera(put(folder / "bad.txt", text), {.preset = "scannet"}); }, {"bad.txt: ", said});
    };
    refused("0.9 -0.1 0.4 1\n0.1 0.9 0.1 2\n-0.4 0 0.9 3\n0 0 0 1\n", "is it the camera's place?");
    refused("500 0 0\n0 510 0\n321.5 237.5 1\n", "is it transposed?");
    refused("480 20 330 4\n-20 500 240 5\n0.01 0.02 1 6\n", "cv2.decomposeProjectionMatrix");
    refused("1 0 0 4\n0 1 0 5\n0 0 1 6\n", "or the camera's place?");
    refused(std::string("II*\0\x08\0\0\0\x10", 9), "is no camera, but an image");
    refused("500 0 321.5 0 510 237.5 0 0", "holds no camera that Fathom knows");
    refused("500 0 321.5 0 510 237.5 0 0 nan", "holds no camera that Fathom knows");
}

TEST_CASE("cameras: COLMAP's binary and text files", "[io][cameras]") {
    const TempFolder folder;
    World world(8);
    const Eigen::Quaterniond q(Eigen::Matrix3d(world.to_camera.topLeftCorner<3, 3>()));
    const Vector3d t = world.to_camera.topRightCorner<3, 1>();
    Colmap colmap;
    colmap.camera(1, 1, {500, 510, 322, 238});
    colmap.camera(5, 0, {500, 322, 238});
    colmap.camera(6, 4, {500, 510, 322, 238, 0.1, 0, 0, 0});
    Eigen::Quaterniond twice(2 * q.w(), 2 * q.x(), 2 * q.y(), 2 * q.z()); // a length other than 1 is no other turn
    colmap.image(1, "left/a.jpg", twice, t);
    colmap.image(5, "b.jpg", q, t);
    colmap.image(6, "bent.jpg", q, t);
    fs::create_directories(folder / "dense/sparse/0");
    const fs::path sparse = folder / "dense/sparse/0";
    const auto cameras = Colmap::counted(3, colmap.cameras), images = Colmap::counted(3, colmap.images);
    put(sparse / "cameras.bin", cameras);
    put(sparse / "images.bin", images);

    std::ostringstream lines;
    lines.precision(17);
    for (const char* name : {"left/a.jpg", "b.jpg", "bent.jpg"})
        lines << "9 " << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << t.x() << ' ' << t.y() << ' '
              << t.z() << ' '
              << (name[0] == 'l'   ? 1
                  : name[1] == '.' ? 5
                                   : 6)
              << ' ' << name << '\n'
              << (name[0] == 'l' ? "12.5 13.5 -1 7 8 9\n" : "\n"); // points in two dimensions; none
    fs::create_directories(folder / "text");
    const std::string text_cameras =
        "# Camera list\n1 PINHOLE 640 480 500 510 322 238\n5 SIMPLE_PINHOLE 640 480 500 322 238\n"
        "6 OPENCV 640 480 500 510 322 238 0.1 0 0 0\n";
    put(folder / "text/cameras.txt", text_cameras);
    put(folder / "text/images.txt", "# Image list\n" + lines.str());

    const auto pixel = [](double fy) {
        return [fy](const Vector3d& p) { return Vector2d(500 * p.x() / p.z() + 322, fy * p.y() / p.z() + 238); };
    };
    for (const fs::path& file : {folder / "dense", sparse, sparse / "cameras.bin", folder / "text",
                                 folder / "text/cameras.txt", folder / "text/images.txt"}) {
        INFO(file.native());
        const ImportedCamera a = reread(folder, import_camera(file, {.image = "left/a.jpg", .preset = "colmap"}));
        check_sees(camera_for(a, 640, 480), world.points(pixel(510)), doubles);
        CHECK(a.camera.missing == 0.0);
        check_sees(camera_for(import_camera(file, {.image = "b", .preset = "colmap"}), 640, 480),
                   world.points(pixel(500)), doubles);
        CHECK(import_camera(file, {.preset = "colmap", .depth = "depth/a.jpg.geometric.tif"}).text == a.text);
        check_says([&] { import_camera(file, {.preset = "colmap", .depth = "depth/c.tif"}); }, {"has 3 images"});
    }

    constexpr std::size_t points = 8 + 48; // the count of the last image, and its points
    const std::string many = Colmap::counted(3, images.substr(8, images.size() - 8 - points));
    put(sparse / "images.bin", many + Colmap::counted(std::uint64_t{1} << 61, "")); // times their size is 0 in 64 bits
    check_says([&] { import_camera(sparse, {.image = "b", .preset = "colmap"}); }, {"images.bin: is cut short"});
    const auto refused = [&](const std::string& text, const std::string& said) {
        put(folder / "text/cameras.txt", text);
        check_says([&] { import_camera(folder / "text", {.image = "b", .preset = "colmap"}); }, {".txt: ", said});
    };
    refused("5 PINHOLE 640 480 500\n", "has a camera PINHOLE with 1 numbers after its size; it must have 4");
    refused("5 FOV 640 480 500 510 322 238 0.1\n", "a lens distortion that Fathom does not know; run colmap");
    put(folder / "text/images.txt", std::string("# Image list\n"));
    refused(text_cameras, "images.txt: has no image; run COLMAP again");
    fs::remove(folder / "text/images.txt");
    refused(text_cameras, "has 3 cameras and no images.txt beside it");
    fs::rename(folder / "text/cameras.txt", folder / "text/images.txt");
    check_says([&] { import_camera(folder / "text/images.txt"); }, {"has no cameras.txt beside it; name COLMAP's"});
}

TEST_CASE("cameras: the matrices of an EXR header in every layout", "[io][cameras]") {
    const TempFolder folder;
    const double width = 64, height = 48, fx = 70, fy = 70, cx = 30, cy = 26;
    const auto pixel = [&](const Vector3d& p) { // x right, y up, z ahead
        return Vector2d(cx + fx * p.x() / p.z(), cy - fy * p.y() / p.z());
    };
    // The pixel over the image's size is NDC: from 0 to 1 and y down as OpenEXR documents it; a near plane is in the
    // third row.
    Matrix4d documented;
    documented << fx / width, 0, cx / width, 0, 0, -fy / height, cy / height, 0, 0, 0, 1.01, -0.2, 0, 0, 1, 0;
    Matrix4d up = documented; // y up
    up.row(1) = documented.row(3) - documented.row(1);
    Matrix4d screen = 2 * up; // from -1 to 1, y up, as RenderMan's and Arnold's
    screen.row(3) = up.row(3);
    screen.row(0) -= up.row(3);
    screen.row(1) -= up.row(3);
    struct Layout {
        const char* name;
        const char* attribute;
        Matrix4d ndc;
        bool camera_for_rows, ndc_for_rows;
        const char* behind; // axes that the program's camera has the other way round
    };
    const Layout layouts[] = {{"OpenEXR", "worldToNDC", documented, true, true, ""},
                              {"pbrt-v4", "worldToNDC", documented, false, false, ""},
                              {"mixed", "worldToNDC", documented, true, false, ""},
                              {"y up", "worldToNDC", up, true, true, ""},
                              {"Arnold", "worldToNDC", screen, true, true, ""},
                              {"Arnold, columns", "worldToNDC", screen, false, false, ""},
                              {"OpenImageIO", "worldToScreen", screen, true, true, ""},
                              {"-z ahead", "worldToNDC", documented, true, true, "z"}};
    for (const Layout& layout : layouts)
        for (const double away : {1.0, 0.0, 2e4}) { // without a translation both layouts are affine
            INFO(layout.name << ", translation times " << away);
            World world(9);
            world.to_camera.topRightCorner<3, 1>() *= away;
            const Matrix4d to_camera = flipped(layout.behind) * world.to_camera;
            const fs::path file = put_exr(folder / "frame.exr", [&](Imf::Header& header) {
                header.insert("worldToCamera", Imf::M44fAttribute(written(to_camera, layout.camera_for_rows)));
                header.insert(layout.attribute,
                              Imf::M44fAttribute(written(layout.ndc * world.to_camera, layout.ndc_for_rows)));
            });
            const ImportedCamera made = reread(folder, import_camera(file), 64, 48);
            CHECK(made.warnings.empty());
            CHECK(made.camera.encoding == Encoding::view_z);
            CHECK(made.camera.projection.convention.view_axes == ViewAxes::opengl);
            check_sees(camera_for(made, 64, 48), world.points(pixel), floats);
        }
}

TEST_CASE("cameras: lens shift, windows and parallel projections of EXR headers", "[io][cameras]") {
    const TempFolder folder;
    World world(10);
    // A lens shift may be a shear of worldToCamera; world positions are the same.
    Matrix4d shear = Matrix4d::Identity();
    shear(0, 2) = 0.1;
    Matrix4d ndc;
    ndc << 1.1, 0, 0.5, 0, 0, -1.4, 0.5, 0, 0, 0, 1, 0, 0, 0, 1, 0;
    const auto sheared = [&](const Vector3d& p) {
        return Vector2d(64 * (1.1 * (p.x() + 0.1 * p.z()) / p.z() + 0.5), 48 * (-1.4 * p.y() / p.z() + 0.5));
    };
    const auto shifted = import_camera(put_exr(folder / "shift.exr", [&](Imf::Header& header) {
        header.insert("worldToCamera", Imf::M44fAttribute(written(shear * world.to_camera, true)));
        header.insert("worldToNDC", Imf::M44fAttribute(written(ndc * shear * world.to_camera, true)));
    }));
    check_sees(camera_for(shifted, 64, 48), world.points(sheared), floats);

    // Parallel: NDC = x/8 + 1/2, 1/2 - y/6
    Matrix4d parallel;
    parallel << 1 / 8., 0, 0, 0.5, 0, -1 / 6., 0, 0.5, 0, 0, 0.01, 0, 0, 0, 0, 1;
    const auto flat = import_camera(put_exr(folder / "parallel.exr", [&](Imf::Header& header) {
        header.insert("worldToCamera", Imf::M44fAttribute(written(world.to_camera, true)));
        header.insert("worldToNDC", Imf::M44fAttribute(written(parallel * world.to_camera, true)));
    }));
    check_sees(camera_for(flat, 64, 48),
               world.points([](const Vector3d& p) { return Vector2d(64 * (p.x() / 8 + 0.5), 48 * (0.5 - p.y() / 6)); }),
               floats);

    // screenWindow only: x from -S/2 to S/2 on the plane z = 1; pixels twice as wide as high
    const auto window = import_camera(put_exr(folder / "window.exr", [&](Imf::Header& header) {
        header.screenWindowWidth() = 0.8f;
        header.screenWindowCenter() = {0, 0.125f};
        header.pixelAspectRatio() = 2;
    }));
    World at_origin(11);
    at_origin.to_camera.setIdentity();
    const double f = 64 / static_cast<double>(0.8f);
    check_sees(camera_for(window, 64, 48),
               at_origin.points(
                   [&](const Vector3d& p) { // x right, y up, -z ahead
                       return Vector2d(32 + f * p.x() / -p.z(), 24 - 2 * f * (p.y() / -p.z() - 0.125));
                   },
                   -1),
               doubles);
    CHECK(window.warnings.empty());
    const auto aside = import_camera(put_exr(folder / "aside.exr", [&](Imf::Header& header) {
        header.screenWindowWidth() = 0.8f;
        header.screenWindowCenter() = {0.1f, 0};
    }));
    REQUIRE(aside.warnings.size() == 1);
    check_says(aside.warnings.front(), {"screenWindowCenter", "x is taken to point left"});
    check_sees(camera_for(aside, 64, 48),
               at_origin.points(
                   [&](const Vector3d& p) { // the window lies to the left, so that the axis is right of its middle
                       return Vector2d(32 + f * (p.x() / -p.z() + static_cast<double>(0.1f)), 24 - f * p.y() / -p.z());
                   },
                   -1),
               doubles);
}

TEST_CASE("cameras: V-Ray's, Redshift's and Arnold's attributes of EXR headers", "[io][cameras]") {
    const TempFolder folder;
    World world(12); // OpenGL axes
    const double f = 32 / std::tan(27 * std::numbers::pi / 180);
    const auto pixel = [&](const Vector3d& p) { return Vector2d(32 + f * p.x() / -p.z(), 24 - f * p.y() / -p.z()); };
    // V-Ray writes the place for column vectors. From 3ds Max its axes are right, up, back; from Maya right, back,
    // down.
    for (const auto& [maya, at_origin] : {std::pair{false, false}, {true, false}, {false, true}}) {
        INFO(maya << at_origin);
        if (at_origin)
            world.to_camera.topRightCorner<3, 1>().setZero();
        const Matrix4d of_frame = world.to_camera.inverse();
        Matrix4d axes = of_frame;
        if (maya) {
            axes.col(1) = of_frame.col(2);
            axes.col(2) = -of_frame.col(1);
        }
        const fs::path file = put_exr(folder / "vray.exr", [&](Imf::Header& header) {
            header.insert("cameraFov", Imf::FloatAttribute(54));
            header.insert("cameraProjection", Imf::IntAttribute(0));
            header.insert("cameraTransform", Imf::M44fAttribute(written(axes, false)));
            header.insert("cameraFNumber", Imf::FloatAttribute(8));
            header.insert("cameraAperture", Imf::FloatAttribute(36));
            header.insert("vrayInfo/vrayversion",
                          Imf::StringAttribute(maya ? "Version of V-Ray for Maya Next" : "V-Ray Next for 3ds Max"));
        });
        check_says([&] { import_camera(file); }, {"vray.exr", "does not say what the values", "--preset vray-z:"});
        const ImportedCamera made = reread(folder, import_camera(file, {.preset = "vray-z:near=2,far=30"}), 64, 48);
        check_sees(camera_for(made, 64, 48), world.points(pixel, -1), floats);
        CHECK(made.camera.encoding == Encoding::linear);
        CHECK(made.camera.near_plane == 2.0);
        CHECK(made.lens.f_stop == 8.0);
        CHECK(made.lens.sensor_mm == 36.0);
        CHECK(made.warnings.empty());
    }
    const fs::path spherical = put_exr(folder / "vr.exr", [&](Imf::Header& header) {
        header.insert("cameraFov", Imf::FloatAttribute(54));
        header.insert("cameraProjection", Imf::IntAttribute(1));
    });
    check_says([&] { import_camera(spherical); }, {"cameraProjection", "no pinhole"});

    world = World(12);
    const Matrix4d place = world.to_camera.inverse();
    // Redshift writes the place for row vectors, as a matrix or as text, its z ahead; degrees, or radians as
    // documented.
    for (const bool text : {false, true})
        for (const bool left : {false, true}) {
            const Matrix4d ahead = place * flipped(left ? "xz" : "z");
            const fs::path file = put_exr(folder / "redshift.exr", [&](Imf::Header& header) {
                header.insert("rs/camera/fov", Imf::FloatAttribute(text ? 54 * std::numbers::pi_v<float> / 180 : 54));
                header.insert("rs/camera/FStop", Imf::FloatAttribute(4));
                header.insert("rs/camera/DOFFocusDistance", Imf::FloatAttribute(7));
                const Imath::M44f m = written(ahead, true);
                std::ostringstream list;
                list.precision(9);
                for (int i = 0; i < 16; ++i)
                    list << (i ? "," : "") << m[i / 4][i % 4];
                if (text)
                    header.insert("rs/camera/transform", Imf::StringAttribute(list.str()));
                else
                    header.insert("rs/camera/transform", Imf::M44fAttribute(m));
            });
            const ImportedCamera made = reread(folder, import_camera(file), 64, 48);
            check_sees(camera_for(made, 64, 48), world.points(pixel, -1), floats);
            CHECK(made.lens.f_stop == 4.0);
            CHECK(made.lens.focus == 7.0);
        }

    // Arnold with worldToCamera and the film back alone: 36 mm, which is 1.417 inches
    for (const float aperture : {36.f, 1.4173228f}) {
        const Matrix4d ahead = flipped("z") * world.to_camera;
        const fs::path file = put_exr(folder / "arnold.exr", [&](Imf::Header& header) {
            header.insert("worldToCamera", Imf::M44fAttribute(written(ahead, true)));
            header.insert("CameraFocalLength", Imf::FloatAttribute(35));
            header.insert("CameraFilmApertureHorizontal", Imf::FloatAttribute(aperture));
            header.insert("arnold/camera/near_clip", Imf::FloatAttribute(0.1f));
        });
        const ImportedCamera made = import_camera(file);
        const double g = 64 * 35 / 36.;
        check_sees(
            camera_for(made, 64, 48),
            world.points([&](const Vector3d& p) { return Vector2d(32 + g * p.x() / -p.z(), 24 - g * p.y() / -p.z()); },
                         -1),
            floats);
        CHECK(made.camera.background_from == 1e30);
        REQUIRE(made.warnings.size() == 2);
        check_says(made.warnings[0], {aperture > 3 ? "millimetres" : "inches"});
        check_says(made.warnings[1], {"Arnold's Z", "encoding=ray-distance"});
        CHECK(import_camera(file, {.preset = "encoding=ray-distance"}).warnings.size() == 1);
    }

    // OpenEXR's own lens attributes
    const ImportedCamera lens = import_camera(put_exr(folder / "lens.exr", [&](Imf::Header& header) {
        header.screenWindowWidth() = 0.72f; // 36/50
        Imf::addAperture(header, 2.8f);
        Imf::addFocus(header, 3.5f);
        header.insert("nominalFocalLength", Imf::FloatAttribute(52));
        header.insert("pinholeFocalLength", Imf::FloatAttribute(50));
        header.insert("sensorOverallDimensions", Imf::V2fAttribute({36, 27}));
    }));
    CHECK(lens.lens.f_stop == static_cast<double>(2.8f));
    CHECK(lens.lens.focus == 3.5);
    CHECK(lens.lens.focal_length_mm == 50.0);
    CHECK(lens.lens.sensor_mm == 36.0);
}

TEST_CASE("cameras: renders without a camera in their headers are not given one", "[io][cameras][real]") {
    const fs::path shared = places::shared_data;
    if (!fs::exists(shared)) {
        std::cout << "skipped: real EXR files, since " << shared.native() << " is not there\n";
        return;
    }
    int count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(shared)) {
        if (entry.path().extension() != ".exr")
            continue;
        check_says([&] { import_camera(entry.path()); }, {"no camera in its header"});
        ++count;
    }
    CHECK(count >= 6);
}

TEST_CASE("cameras: EXR headers without a camera, with a bad one, and damaged", "[io][cameras]") {
    const TempFolder folder;
    const auto refused = [&](const std::function<void(Imf::Header&)>& attributes,
                             const std::vector<std::string>& parts) {
        check_says([&] { import_camera(put_exr(folder / "bad.exr", attributes)); }, parts);
    };
    refused([](Imf::Header&) {}, {"bad.exr", "no camera in its header", "--preset"});
    Matrix4d nonsense = Matrix4d::Constant(2);
    Matrix4d hole = Matrix4d::Identity();
    hole(1, 1) = 0;
    Matrix4d nan = Matrix4d::Identity();
    nan(0, 0) = std::nan("");
    const auto camera = [](const Matrix4d& matrix) {
        return [matrix](Imf::Header& header) {
            header.insert("worldToCamera", Imf::M44fAttribute(written(matrix, true)));
            header.insert("worldToNDC", Imf::M44fAttribute(written(matrix, true)));
        };
    };
    refused(camera(nonsense), {"worldToCamera", "no affine matrix"});
    refused(camera(hole), {"worldToCamera", "singular"});
    refused(camera(nan), {"worldToCamera", "not finite"});
    refused(
        [&](Imf::Header& header) {
            header.insert("worldToCamera", Imf::M44fAttribute(written(Matrix4d::Identity(), true)));
            header.insert("worldToNDC", Imf::M44fAttribute(written(nonsense, true)));
        },
        {"worldToNDC", "do not make a pinhole"});
    refused(
        [](Imf::Header& header) {
            header.insert("worldToCamera", Imf::M44fAttribute(written(Matrix4d::Identity(), true)));
            header.insert("CameraFocalLength", Imf::FloatAttribute(0));
            header.insert("CameraFilmApertureHorizontal", Imf::FloatAttribute(36));
        },
        {"CameraFocalLength", "is not positive"});
    refused([](Imf::Header& header) { header.insert("cameraFov", Imf::FloatAttribute(200)); }, {"cameraFov", "180"});
    refused([](Imf::Header& header) { header.insert("cameraFov", Imf::FloatAttribute(std::nanf(""))); }, {"finite"});
    refused(
        [](Imf::Header& header) {
            header.insert("cameraFov", Imf::FloatAttribute(50));
            header.insert("cameraTransform", Imf::M44fAttribute(written(Matrix4d::Constant(2), true)));
        },
        {"cameraTransform", "no affine"});
    refused(
        [](Imf::Header& header) {
            header.screenWindowWidth() = 0.8f;
            header.insert("nuke/version", Imf::StringAttribute("13.2v5"));
        },
        {"does not say what the values", "--preset nuke-depth"});
    const fs::path good = put_exr(folder / "good.exr", [](Imf::Header& header) { header.screenWindowWidth() = 0.8f; });
    check_says([&] { import_camera(good, {.image = "a"}); }, {"good.exr: holds one camera, so leave out --image"});
    const Bytes bytes = get(good);
    constexpr std::string_view last = "screenWindowWidth"; // of the attributes, in alphabetical order
    const auto header_end =
        static_cast<std::size_t>(std::search(bytes.begin(), bytes.end(), last.begin(), last.end()) - bytes.begin());
    REQUIRE(header_end > 200);
    for (std::size_t length = 1; length < header_end; length += 7) {
        const std::string line = refusal([&] {
            import_camera(
                put(folder / "cut.exr", Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length))));
        });
        check_says(line, {"cut.exr: "});
    }
}
