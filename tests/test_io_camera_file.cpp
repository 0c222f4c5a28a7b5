// The camera file: every key means what docs/camera.md says, and every mistake is named.
#include "io_files.hpp"

#include <fathom/io.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

const std::string opengl_matrix = R"("projection": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, -1.5, -1], [0, 0, -1, 0]])";
const std::string directx_matrix = R"("projection": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1.5, -1], [0, 0, 1, 0]])";
const std::string lens = R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 0.5, "far": 100})";

/// A camera file of these members.
CameraFile camera(const std::string& members) {
    const TempFolder folder;
    return read_camera(put(folder / "camera.json", "{" + members + "}"));
}

std::string refused(const std::string& members) {
    const auto line = refusal([&] { camera(members); });
    check_says(line, {"camera.json: "});
    return line;
}

void check_same(const Projection& a, const Projection& b) {
    CHECK((a.matrix - b.matrix).cwiseAbs().maxCoeff() <= 1e-15L * a.matrix.cwiseAbs().maxCoeff());
    CHECK(a.convention == b.convention);
    CHECK(a.order == b.order);
}

} // namespace

TEST_CASE("camera file: defaults", "[io]") {
    const auto file = camera(opengl_matrix);
    CHECK(file.camera.width == 0);
    CHECK(file.camera.rows == Rows::top_down);
    CHECK(file.camera.encoding == Encoding::window);
    CHECK(file.camera.projection.convention == Convention::opengl());
    CHECK(file.camera.depth_range == std::array{0.0, 1.0});
    CHECK_FALSE(file.camera.background);
    CHECK_FALSE(file.camera.view);
    CHECK_FALSE(file.packing);
    CHECK_FALSE(file.lens.focal_length_mm);
}

TEST_CASE("camera file: every key arrives", "[io]") {
    const auto file = camera(opengl_matrix + R"(,
        "width": 640, "height": 480, "rows": "bottom-up", "clip_z": "zero-to-one", "clip_y": "down",
        "view_axes": "opengl", "depth_range": [1, 0], "encoding": "logarithmic", "near": 0.25, "far": 50, "median": 3,
        "log_c": 2, "packing": "rgb-high-first", "depth_bits": 24, "background": 7,
        "view": [[0, 1, 0, 1], [-1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]],
        "lens_mm": 35, "sensor_mm": 36, "f_stop": 2.8, "focus_distance": 5, "ao_distance": 1)");
    const auto& c = file.camera;
    CHECK((c.width == 640 && c.height == 480));
    CHECK(c.rows == Rows::bottom_up);
    CHECK(c.projection.convention == Convention{ClipZ::zero_to_one, ClipY::down, ViewAxes::opengl});
    CHECK(c.depth_range == std::array{1.0, 0.0});
    CHECK(c.encoding == Encoding::logarithmic);
    CHECK((c.near_plane == 0.25 && c.far_plane == 50 && c.median == 3 && c.log_c == 2));
    CHECK(file.packing == Packing::rgb_red_high);
    CHECK(c.depth_bits == 24);
    CHECK(c.background == 7);
    REQUIRE(c.view);
    CHECK(((*c.view)(0, 3) == 1 && (*c.view)(1, 0) == -1 && (*c.view)(2, 3) == 3));
    CHECK((file.lens.focal_length_mm == 35 && file.lens.sensor_mm == 36 && file.lens.f_stop == 2.8));
    CHECK((file.lens.focus == 5 && file.lens.ao_distance == 1));
    CHECK(camera(opengl_matrix + R"(, "background": "infinity")").camera.background == infinity);
    CHECK(camera(opengl_matrix + R"(, "encoding": "view-z", "scale": 0.001)").camera.scale == 0.001);
    const auto none = camera(opengl_matrix + R"(, "width": 4, "height": 4, "background": "none")").camera;
    CHECK_FALSE(depth_form(none, Storage::uint16).background);
    const auto disparity =
        camera(lens + R"(, "encoding": "inverse", "offset": 30.5, "along": "ray", "missing": "infinity",
                                            "background_from": 0.5)")
            .camera;
    CHECK((disparity.offset == 30.5 && disparity.along == Along::ray && disparity.missing == infinity));
    CHECK(disparity.background_from == 0.5);
    CHECK(camera(lens + R"(, "encoding": "ray-distance", "from_near_plane": true)").camera.from_near_plane);
    const auto range = camera(lens + R"(, "encoding": "view-z", "background_from": "far")").camera; // 0.5 to 100
    CHECK(*range.background_from == Approx(100 / (1 + 4 * 0x1p-24 * 200)).epsilon(1e-12));
    CHECK(camera(opengl_matrix + R"(, "packing": "uint24-high")").packing == Packing::uint24_high);
}

TEST_CASE("camera file: the four kinds of projection", "[io]") {
    const auto rows = camera(directx_matrix + R"(, "view_axes": "directx", "clip_z": "zero-to-one")").camera.projection;
    CHECK((rows.matrix(2, 3) == -1 && rows.matrix(3, 2) == 1));

    const double angle = std::numbers::pi / 3;
    check_same(camera(lens).camera.projection, perspective(angle, 1.5, {0.5, 100}));
    check_same(
        camera(R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 0.5, "far": "infinity", "reversed": true},
                         "clip_z": "zero-to-one", "view_axes": "opencv")")
            .camera.projection,
        perspective(angle, 1.5, {0.5, infinity, DepthOrder::reversed},
                    {ClipZ::zero_to_one, ClipY::up, ViewAxes::opencv}));
    check_same(camera(R"("perspective": {"fov_x_deg": 60, "near": 0.5, "far": 100}, "width": 300, "height": 200)")
                   .camera.projection,
               perspective(2 * std::atan(std::tan(angle / 2) / 1.5), 1.5, {0.5, 100}));
    check_same(camera(R"("orthographic": {"left": -1, "right": 2, "bottom": -3, "top": 4, "near": -5, "far": 6})")
                   .camera.projection,
               orthographic({-1, 2, -3, 4}, {-5, 6}));

    const std::string size = R"("width": 640, "height": 480, "near": 0.5, "far": 100, )";
    const Intrinsics corner{500, 510, 320, 240, 640, 480}, centre{500, 510, 320.5, 240.5, 640, 480};
    check_same(camera(size + R"("intrinsics": {"fx": 500, "fy": 510, "cx": 320, "cy": 240})").camera.projection,
               perspective(corner, {0.5, 100}));
    check_same(camera(size + R"("intrinsics": {"fx": 500, "fy": 510, "cx": 320, "cy": 240, "pixel_origin": "centre"})")
                   .camera.projection,
               perspective(centre, {0.5, 100}));

    check_same(camera(lens + R"(, "oblique_near_plane": [0, 0.25, -1, -2])").camera.projection,
               with_oblique_near_plane(perspective(angle, 1.5, {0.5, 100}), {0, 0.25, -1, -2}));
}

TEST_CASE("camera file: exactly one kind of projection", "[io]") {
    check_says(refused(lens + ", " + opengl_matrix), {"both \"projection\" and \"perspective\""});
    check_says(refused(R"("width": 3)"), {"has no projection", "\"orthographic\""});
}

TEST_CASE("camera file: near and far said twice must agree", "[io]") {
    check_says(refused(lens + R"(, "near": 5)"), {"\"perspective\"", "give them once"});
    CHECK_NOTHROW(camera(lens + R"(, "near": 0.5, "far": 100)"));
    CHECK_NOTHROW(camera(lens + R"(, "encoding": "linear", "near": 1, "far": 50)"));
}

TEST_CASE("camera file: metric images need no near and far", "[io]") {
    for (const std::string encoding : {"view-z", "ray-distance", "inverse"}) {
        const auto with = R"("encoding": ")" + encoding + R"(", )";
        CHECK_NOTHROW(camera(with + R"("perspective": {"fov_y_deg": 60, "aspect": 1.5})"));
        CHECK_NOTHROW(camera(with + R"("orthographic": {"left": -1, "right": 2, "bottom": -3, "top": 4})"));
        const auto file = camera(with + R"("width": 640, "height": 480, "scale": 0.001,
                                           "intrinsics": {"fx": 500, "fy": 510, "cx": 320, "cy": 240})");
        CHECK_NOTHROW(depth_form(file.camera, Storage::uint16));
    }
    check_says(refused(R"("perspective": {"fov_y_deg": 60})"),
               {"\"perspective.near\" is missing", "\"encoding\": \"view-z\""});
    check_says(refused(R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 1})"),
               {"\"perspective.far\" is missing"});
    check_says(refused(R"("width": 6, "height": 4, "far": 9, "intrinsics": {"fx": 5, "fy": 5, "cx": 3, "cy": 2})"),
               {"\"near\" is missing"});
}

TEST_CASE("camera file: an encoding has what it needs", "[io]") {
    check_says(refused(opengl_matrix + R"(, "encoding": "linear", "near": 1)"), {"\"far\" is missing", "\"linear\""});
    check_says(refused(opengl_matrix + R"(, "encoding": "exponential", "far": 1)"), {"\"near\" is missing"});
    check_says(refused(opengl_matrix + R"(, "encoding": "logarithmic")"), {"\"far\" is missing"});
    check_says(refused(opengl_matrix + R"(, "encoding": "median")"), {"\"median\" is missing"});
    check_says(refused(opengl_matrix + R"(, "encoding": "linear", "near": 1, "far": "infinity")"), {"finite"});
    check_says(refused(opengl_matrix + R"(, "encoding": "logarithmic", "far": 1, "log_c": 0)"), {"\"log_c\": 0"});
    const auto taken = camera(lens + R"(, "encoding": "linear")").camera; // from the projection
    CHECK((taken.near_plane == 0.5 && taken.far_plane == 100));
}

TEST_CASE("camera file: an unknown word names the nearest known one", "[io]") {
    check_says(refused(lens + R"(, "encoding": "view_z")"), {"\"view_z\" must be one of", "the nearest is \"view-z\""});
    check_says(refused(lens + R"(, "rows": "bottomup")"), {"the nearest is \"bottom-up\""});
    check_says(refused(lens + R"(, "rows": 3)"), {"3 must be one of \"top-down\", \"bottom-up\""});
}

TEST_CASE("camera file: an unknown key names the nearest known one", "[io]") {
    check_says(refused(opengl_matrix + R"(, "encodng": "window")"),
               {"\"encodng\"", "nearest known one is \"encoding\""});
    check_says(refused(opengl_matrix + R"(, "clipz": "zero-to-one")"), {"is \"clip_z\""});
    check_says(refused(opengl_matrix + R"(, "focus": 3)"), {"unknown key \"focus\"; write \"focus_distance\""});
    check_says(refused(R"("perspective": {"fov_deg": 60})"), {"\"perspective.fov_deg\"", "is \"perspective.fov_"});
    check_says(refused(R"("perspective": {"fov": 60})"), {"\"perspective.fov\"", "fov_y_deg"});
    check_says(refused(R"("cx": 24)"), {"unknown key \"cx\"", "it belongs in \"intrinsics\""});
    check_says(refused(R"("intrinsics": {"fx": 20, "near": 1})"), {"\"intrinsics.near\"", "beside \"intrinsics\""});
    check_says(refused(lens + R"(, "clip_start": 0.1)"), {"\"clip_start\"", "write \"near\""});
    check_says(refused(R"("intrinsics": {"f_x": 60})"), {"is \"intrinsics.fx\""});
    check_says(refused(R"("orthographic": {"rigth": 60})"), {"is \"orthographic.right\""});
}

TEST_CASE("camera file: a value of the wrong kind is named with its key", "[io]") {
    const auto says = [](const std::string& member, const std::vector<std::string>& parts) {
        check_says(refused(opengl_matrix + ", " + member), parts);
    };
    says(R"("width": 0)", {"\"width\": 0", "whole number"});
    says(R"("width": 1.5)", {"\"width\": 1.5"});
    says(R"("height": "tall")", {"\"height\": \"tall\""});
    says(R"("rows": "topdown")", {"\"rows\": \"topdown\"", "\"top-down\", \"bottom-up\""});
    says(R"("encoding": "log")", {"\"encoding\": \"log\"", "\"logarithmic\""});
    says(R"("encoding": 3)", {"\"encoding\": 3"});
    says(R"("clip_z": "gl")", {"\"zero-to-one\""});
    says(R"("view_axes": "vulkan")", {"\"opencv\""});
    says(R"("packing": "rgb")", {"\"rgb-low-first\"", "\"uint24-high\""});
    says(R"("depth_bits": 25)", {"\"depth_bits\": 25", "1 to 24, or 32"});
    says(R"("depth_range": [0])", {"\"depth_range\": [0]", "2 numbers"});
    says(R"("depth_range": [1, 1])", {"different"});
    says(R"("background": "sky")", {"\"background\": \"sky\"", "infinity"});
    says(R"("scale": null)", {"\"scale\": null", "a number"});
    says(R"("scale": 0)", {"\"scale\": 0"});
    says(R"("scale": 0.001)", {"\"scale\": 0.001 is for \"view-z\"", "the encoding is \"window\""});
    says(R"("missing": true)", {"\"missing\": true", "infinity"});
    says(R"("background_from": "near")", {"\"background_from\": \"near\"", "infinity"});
    says(R"("background_from": "far")", {"is for the encoding \"view-z\"", "0 < near < far"});
    says(R"("along": "z")", {"\"axis\", \"ray\""});
    says(R"("along": "ray")",
         {"\"along\": \"ray\" is for \"linear\", \"inverse\" and \"inverse-range\"", "\"window\""});
    says(R"("offset": 3)", {"\"offset\": 3 is for \"inverse\""});
    says(R"("from_near_plane": true)", {"is for \"ray-distance\""});
    says(R"("encoding": "ray-distance", "from_near_plane": true)", {"\"near\" is missing"});
    says(R"("encoding": "inverse-range", "near": 1)", {"\"far\" is missing", "\"inverse-range\""});
    says(R"("pixel_origin": "top")", {"\"corner\", \"centre\""});
    says(R"("f_stop": [2.8])", {"\"f_stop\": [2.8]"});
    says(R"("oblique_near_plane": [0, 0, "-1", 2])", {"\"oblique_near_plane\"", "4 numbers"});
    says(R"("view": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1]])",
         {"\"view\"", "is transposed", "write its columns as rows"});
    says(R"("view": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, -1], [0, 0, -1, 0]])", {"without the projection"});
    says(R"("view": [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])", {"invertible"});
    check_says(refused(R"("perspective": {"fov_y_deg": 190, "aspect": 1})"), {"\"perspective.fov_y_deg\": 190"});
    check_says(refused(R"("perspective": {"fov_y_deg": 90, "fov_x_deg": 60, "aspect": 1})"), {"one of"});
    check_says(refused(R"("perspective": [60])"), {"\"perspective\": [60]", "object"});
    check_says(refused(R"("width": 6, "height": 4, "intrinsics": {"fx": 5, "fy": 5, "cx": 3})"), {"\"intrinsics.cy\""});
}

TEST_CASE("camera file: a matrix must be four by four finite numbers", "[io]") {
    check_says(refused(R"("projection": [[1, 0, 0, 0]])"), {"\"projection\"", "four rows"});
    check_says(refused(R"("projection": [[1, 0, 0, 0], [0, 1, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"), {"row 1 is [0,1,0]"});
    check_says(refused(R"("projection": [[1, 0, 0, 0], [0, "NaN", 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"),
               {"row 1, column 1 is \"NaN\"", "finite"});
    check_says(refused(R"("projection": [[1, 0, 0, 0], [0, NaN, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"), {"is no JSON"});
    check_says(refused(R"("projection": [[1, 0, 0, 0], [0, 1e999, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"), {"1e999"});
    check_says(refused(R"("projection": [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"), {"singular"});
}

TEST_CASE("camera file: view axes that contradict the matrix are refused", "[io]") {
    check_says(refused(directx_matrix),
               {"\"projection\"", "must have -1 in its fourth row", "\"view_axes\"", "directx"});
    check_says(refused(opengl_matrix + R"(, "view_axes": "opencv")"), {"\"view_axes\"", "opengl"});
    CHECK_NOTHROW(camera(directx_matrix + R"(, "view_axes": "opencv")"));
    const std::string flat = R"("projection": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])";
    CHECK_NOTHROW(camera(flat + R"(, "view_axes": "opencv")")); // an orthographic matrix fits any axes
    CHECK_NOTHROW(camera(flat));
}

TEST_CASE("camera file: a transposed matrix is told with its cure", "[io]") {
    for (
        const std::string rest :
        {R"("encoding": "view-z", "projection": [[1.2,0,0,0],[0,1.7,0,0],[0.1,0,-1.01,-1],[0,0,-1.005,0]])",
         R"("view_axes": "directx", "clip_z": "zero-to-one", "projection": [[1.2,0,0,0],[0,1.7,0,0],[0,0,1.005,1],[0,0,-0.5,0]])",
         R"("projection": [[0.5,0,0,0],[0,0.5,0,0],[0,0,-0.02,0],[0.1,0,-1.002,1]])"})
        check_says(refused(rest), {"\"projection\"", "is transposed", "write its columns as rows"});
}

TEST_CASE("camera file: doubtful keys are told of an image of 48 x 32", "[io]") {
    const auto calibration = [](const std::string& fx, const std::string& fy, const std::string& cx,
                                const std::string& cy) {
        return R"("intrinsics": {"fx": )" + fx + R"(, "fy": )" + fy + R"(, "cx": )" + cx + R"(, "cy": )" + cy + "}";
    };
    const std::string centred = calibration("27.7", "27.7", "23.5", "15.5");
    for (const auto& [keys, parts] : std::vector<std::pair<std::string, std::vector<std::string>>>{
             {R"("perspective": {"fov_y_deg": 60, "aspect": 0.667})",
              {"\"perspective.aspect\": 0.667", "leave it out"}},
             {calibration("0.8", "1.2", "0.5", "0.5"), {"fx 0.8 and fy 1.2", "turn them into pixels"}},
             {calibration("55.4", "55.4", "48", "32"), {"cx 48 and cy 32", "scale fx, fy, cx and cy"}},
             {calibration("13.9", "13.9", "12", "8"), {"cx 12 and cy 8", "scale fx, fy, cx and cy"}},
             {calibration("27.7", "27.7", "16", "24"), {"exchange cx and cy"}},
             {centred, {"cx 23.5 and cy 15.5", "\"pixel_origin\": \"centre\""}},
             {R"("perspective": {"fov_x_deg": 80})", {}},
             {calibration("27.7", "27.7", "24.3", "15.2"), {}},
             {centred + R"(, "pixel_origin": "centre")", {}}}) {
        INFO(keys);
        const std::vector<std::string> said = key_doubts(R"({"encoding": "view-z", )" + keys + "}", 48, 32);
        REQUIRE(said.size() == (parts.empty() ? 0 : 1));
        if (!said.empty())
            check_says(said.front(), parts);
    }
}

TEST_CASE("camera file: what the projection's builder refuses names the file", "[io]") {
    refused(R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": -1, "far": 100})");
    refused(R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 1, "far": 1})");
    check_says(refused(R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 100, "far": 0.5})"), {"near"});
    refused(R"("orthographic": {"left": 1, "right": 1, "bottom": -3, "top": 4, "near": -5, "far": 6})");
    refused(lens + R"(, "oblique_near_plane": [0, 0, 1, 2])"); // keeps what is behind the camera
}

TEST_CASE("camera file: JSON that is none says where", "[io]") {
    const TempFolder folder;
    const auto file = put(folder / "a.json", "{\n  \"width\": 3,\n  \"height\" 4\n}");
    check_says([&] { read_camera(file); }, {"a.json: is no JSON", "line 3, column"});
    check_says([&] { read_camera(put(folder / "b.json", "[1, 2]")); }, {"b.json: holds [1,2]", "object"});
    check_says([&] { read_camera(put(folder / "c.json", "{} {}")); }, {"c.json: is no JSON"});
    check_says([&] { read_camera(put(folder / "d.json", "{\"a\": \"\xff\"}")); }, {"d.json: is no JSON"});
    check_says(refused(R"("near": 1, "far": 2, "near": 3)"), {"\"near\" is given twice"});
    const std::string long_key = refused('"' + std::string(1 << 20, 'k') + R"(": 1)");
    check_says(long_key, {"unknown key \"kkk", "kkk...", "the nearest known one is"});
    CHECK(long_key.size() < 400);
    const std::string deep = "{\"a\": " + std::string(101, '[') + std::string(101, ']') + "}";
    check_says([&] { read_camera(put(folder / "deep.json", deep)); }, {"deep.json", "more than 100 deep"});
    check_says([&] { read_camera(put(folder / "e.json", std::string(100000, '['))); }, {"e.json: is no JSON"});
}

TEST_CASE("camera file: a file cut or changed at any byte gives a refusal or a camera", "[io]") {
    const TempFolder folder;
    const auto text = "{" + lens + R"(, "width": 30, "height": 20, "view": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]})";
    for (std::size_t i = 0; i < text.size(); ++i) {
        check_says([&] { read_camera(put(folder / "cut.json", text.substr(0, i))); }, {"cut.json: "});
        for (const char c : {'0', '"', '}', '-', '\0', '\xc3'}) {
            auto changed = text;
            changed[i] = c;
            refusal([&] { read_camera(put(folder / "changed.json", changed)); });
        }
    }
}

TEST_CASE("camera file: the image's size is taken or checked", "[io]") {
    const auto any = camera_for(camera(opengl_matrix), 320, 240);
    CHECK((any.width == 320 && any.height == 240));
    const auto file = camera(opengl_matrix + R"(, "width": 320, "height": 240)");
    CHECK_NOTHROW(camera_for(file, 320, 240));
    check_says([&] { camera_for(file, 240, 320); }, {"320 x 240", "240 x 320", "use the camera of this image"});
}

TEST_CASE("camera file: a projection that waits for the image's size is that of the image", "[io]") {
    const double angle = std::numbers::pi / 3;
    const auto narrow = camera(R"("perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100})");
    check_same(camera_for(narrow, 300, 200).projection, perspective(angle, 1.5, {0.5, 100}));
    const std::string plane = R"(, "oblique_near_plane": [0, 0.25, -1, -2])";
    const auto mirror = camera(R"("perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100})" + plane);
    check_same(camera_for(mirror, 300, 200).projection,
               with_oblique_near_plane(perspective(angle, 1.5, {0.5, 100}), {0, 0.25, -1, -2}));
    const auto sensor = camera(R"("encoding": "view-z", "pixel_origin": "centre",
                                  "intrinsics": {"fx": 500, "fy": 510, "cx": 320, "cy": 240})");
    check_same(camera_for(sensor, 640, 480).projection,
               perspective(Intrinsics{500, 510, 320.5, 240.5, 640, 480}, {1, infinity}));
}
