// Mistakes that used to pass in silence: input, the line that is expected, the exit code. And right inputs, which warn of
// nothing. More of depth are in test_doubts.cpp, and of camera files in test_io_camera_file.cpp.
#include "io_files.hpp"
#include "program.hpp"
#include "real_inputs.hpp"

#include "scene/scene.hpp"

#include <fathom/picture.hpp>

#include <nlohmann/json.hpp>

#include <map>
#include <set>
#include <string>

using namespace fathom;
using namespace fathom::test;

namespace {

struct Mistake {
    const char* name;
    cv::Mat depth;
    std::string file, camera; ///< a name for the depth; members of the camera file
    int code;
    std::vector<std::string> said;     ///< parts of the line; none: no line at all
    Arguments command = {"linearize"}; ///< and options; {} in them is the folder of the inputs
    std::string result = "z.exr";
};

const std::string lens = R"("perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100})";
const std::string wide = R"("perspective": {"fov_y_deg": 60})";

/// A slanted plane, metres from 2.6 to 10, some of them replaced.
cv::Mat metres(double fraction = 0, float instead = 0) {
    return filled(width, height, [&](int x, int y) {
        const int i = y * width + x;
        return i < fraction * width * height
                   ? instead
                   : static_cast<float>(1 / (1 / 2.6 + (1 / 10.0 - 1 / 2.6) * i / (width * height - 1)));
    });
}

/// The same, as another description has it: what `stored` makes of z, and of how much longer the ray is than z.
cv::Mat plane(const std::function<double(double z, double stretch)>& stored) {
    const cv::Mat depth = metres();
    const double f = height / 2.0 / std::tan(std::numbers::pi / 6);
    return filled(width, height, [&](int x, int y) {
        const double stretch = std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0, f) / f;
        return stored(static_cast<double>(depth.at<float>(y, x)), stretch);
    });
}

/// Colours that change slowly, as in a photograph. With R as the lowest byte they would be 24 bits.
cv::Mat picture() {
    return filled<cv::Vec3b>(width, height, [](int x, int y) {
        return cv::Vec3b(cv::saturate_cast<uchar>(90 + x + y), cv::saturate_cast<uchar>(80 + x + y),
                         cv::saturate_cast<uchar>(60 + x + 3 * (y % 9)));
    });
}

/// 24 bits of a plane, R the lowest byte.
cv::Mat packed() {
    const cv::Mat depth = metres();
    return filled<cv::Vec3b>(width, height, [&](int x, int y) {
        const auto code =
            static_cast<unsigned>(std::lround(static_cast<double>(depth.at<float>(y, x)) / 40 * 16777215));
        return cv::Vec3b(static_cast<uchar>(code >> 16), static_cast<uchar>(code >> 8 & 255),
                         static_cast<uchar>(code & 255));
    });
}

cv::Mat constant(float value) {
    return cv::Mat(height, width, CV_32FC1, cv::Scalar(value));
}

/// A wall at 5 metres over a fraction of the image, and one at 8.
cv::Mat walls(double fraction) {
    return filled(width, height, [&](int x, int y) { return y * width + x < fraction * width * height ? 5 : 8; });
}

cv::Mat codes(const cv::Mat& depth, double scale) {
    return converted(depth, CV_16U, scale);
}

/// A box of a room, seen from its inside: distances in all directions, twice as wide as high.
cv::Mat all_directions() {
    return filled(128, 64, [](int x, int y) {
        const double along = (x + 0.5) / 128 * 2 * std::numbers::pi, up = (0.5 - (y + 0.5) / 64) * std::numbers::pi;
        const double direction[] = {std::cos(up) * std::sin(along), std::sin(up), std::cos(up) * std::cos(along)};
        constexpr double before[] = {4.2, 1.4, 2.1}, behind[] = {2.3, 1.2, 6.4};
        double distance = 1e9;
        for (int i = 0; i < 3; ++i)
            distance = std::min(distance, direction[i] > 0 ? before[i] / direction[i] : -behind[i] / direction[i]);
        return distance;
    });
}

/// A floor without anything on it, in all directions.
cv::Mat floor_in_all_directions() {
    cv::Mat depth(64, 128, CV_32FC1, cv::Scalar(0));
    for (int y = 32; y < depth.rows; ++y)
        depth.row(y) = 1.2 / std::sin((y + 0.5 - 32) / depth.rows * std::numbers::pi);
    return depth;
}

/// A pinhole's picture of that shape: a corridor with a floor and a ceiling, as wide on either side.
cv::Mat corridor() {
    return filled(128, 64, [](int x, int y) {
        return 1 / std::max({std::abs(x + 0.5 - 64) / 100, std::abs(y + 0.5 - 32) / 60, 0.05});
    });
}

cv::Mat half_bits() {
    const cv::Mat half = converted(1000 * metres(), CV_16F);
    return cv::Mat(half.size(), CV_16UC1, half.data).clone();
}

/// Codes without any surface.
cv::Mat noise(int columns, int rows) {
    std::mt19937 random(3);
    cv::Mat result(rows, columns, CV_16UC1);
    for (auto& code : cv::Mat_<std::uint16_t>(result))
        code = static_cast<std::uint16_t>(random() >> 16);
    return result;
}

cv::Mat grey_8() {
    return converted(ramp(), CV_8U, 255);
}

/// A depth buffer that surfaces without a flat place fill, the sky in it.
cv::Mat far_buffer() {
    return filled(width, height, [](int x, int y) {
        const int i = y * width + x;
        return i % 7 == 0 ? 1 : 0.97 + 0.02 * std::sin(i * i);
    });
}

std::string calibration(const std::string& fx, const std::string& fy, const std::string& cx, const std::string& cy) {
    return R"("encoding": "view-z", "intrinsics": {"fx": )" + fx + R"(, "fy": )" + fy + R"(, "cx": )" + cx +
           R"(, "cy": )" + cy + "}";
}

const std::string packing = R"(, "encoding": "view-z", "packing": "rgb-low-first", "scale": 2.384186e-06)";
const Arguments masks{"dof-masks", "--focal-length-mm", "50", "--sensor-mm", "36"};

using Said = std::vector<std::string>;

Mistake refused(const char* name, const cv::Mat& depth, const char* file, const std::string& camera, const Said& said,
                const Arguments& command = {"linearize"}) {
    return {name, depth, file, camera, 1, said, command};
}
Mistake warned(const char* name, const cv::Mat& depth, const char* file, const std::string& camera, Said said,
               const Arguments& command = {"linearize"}, const char* result = "z.exr") {
    said.insert(said.begin(), "warning: ");
    return {name, depth, file, camera, 0, said, command, result};
}
Mistake right(const char* name, const cv::Mat& depth, const char* file, const std::string& camera,
              const Arguments& command = {"linearize"}, const char* result = "z.exr") {
    return {name, depth, file, camera, 0, {}, command, result};
}

std::vector<Mistake> mistakes() {
    const std::string window = lens, view_z = wide + R"(, "encoding": "view-z")";
    return {
        refused("metric depth as a depth buffer", metres(), "a.exr", window,
                {"a.exr: no pixel has a depth", "2.6 to 10", "\"window\" depth lies in 0 to 1",
                 "\"encoding\": \"view-z\""}),
        refused("nothing but NaN", constant(NAN), "a.exr", view_z, {"all of its values are NaN", "--channel"}),
        refused("nothing but infinity", constant(-INFINITY), "a.exr", view_z, {"none of its values is finite"}),
        refused("negative depth", -1 * metres(), "a.exr", view_z, {"no pixel has a depth", "from -10 to -2.6"}),
        refused("nothing measured", codes(constant(0), 1), "a.png", view_z + R"(, "scale": 0.001, "missing": 0)",
                {"all of its values are 0, which the camera says was not measured"}),
        refused("a zero image", constant(0), "a.exr", view_z, {"no pixel has a depth", "the values are 0"}),
        warned("a third is negative", metres(0.34, -1), "a.exr", view_z,
               {"a.exr: 34 % of the pixels are invalid", "\"background\": -1"}),
        warned("a fifth is negative", metres(0.2, -1), "a.exr", view_z,
               {"20 % of the pixels hold -1", "\"missing\": -1"}),
        warned("half is beyond the range", metres(0.5, 0.5f), "a.exr", window, {"50 % of the pixels are invalid"}),
        warned("the sky of half floats as a surface", metres(0.2, 65504), "a.exr", view_z, {"hold 65504"}),
        warned("Nuke's 1/z as distances", plane([](double z, double) { return 1 / z; }), "a.exr", view_z,
               {"depth-buffer values or 1/z", "\"encoding\": \"inverse\" with its scale"}),
        warned("distances along the rays as those along the axis",
               plane([](double z, double stretch) { return z * stretch; }), "a.exr", view_z,
               {"distances along the rays", "say \"encoding\": \"ray-distance\""}),
        warned("distances along the axis as those along the rays", metres(), "a.exr",
               wide + R"(, "encoding": "ray-distance")",
               {"distances along the view axis", "say \"encoding\": \"view-z\""}),
        warned("linear depth as a depth buffer", plane([](double z, double) { return (z - 0.5) / 99.5; }), "a.exr",
               window, {"linear from near to far", "say \"encoding\": \"linear\""}),
        warned("nothing but background", codes(metres(), 1000), "a.png", view_z + R"(, "background_from": 10)",
               {"every pixel is background", "run from 2600 to 10000"}),
        refused("a picture as normals", metres(), "a.exr", view_z, {"color.png: holds ", "have lengths unlike 1"},
                {"ssao", "--radius", "1", "--normals", "{}/color.png"}),
        warned("distances of a perspective camera under an orthographic one", metres(), "a.exr",
               R"("orthographic": {"left": -2, "right": 2, "bottom": -1, "top": 1}, "encoding": "view-z")",
               {"distances of a perspective camera"}),
        warned("a depth buffer far away as distances", far_buffer(), "a.exr", view_z,
               {"as in a depth buffer", "\"encoding\": \"window\""}),
        refused("the bits of half floats", half_bits(), "a.png", view_z,
                {"the bits of half floats", "save them as floats"}),
        warned("a picture of all directions", all_directions(), "a.exr", wide + R"(, "encoding": "ray-distance")",
               {"left and right columns continue each other", "cut it into views"}),
        warned("a floor in all directions", floor_in_all_directions(), "a.exr", view_z + R"(, "background": 0)",
               {"left and right columns continue each other"}),
        warned("disparity without a scale", plane([](double z, double) { return 500 / z; }), "a.exr",
               wide + R"(, "encoding": "inverse")", {"disparity without its \"scale\"", "focal length in pixels"}),
        warned("a third is Nuke's sky", metres(0.6, 0), "a.exr", view_z,
               {"60 % of the values are 0", "\"missing\": 0", "\"encoding\": \"inverse\""}),
        warned("values from 0 to 1 as the distances of a projection that ends before them", 0.01 * metres(), "a.exr",
               lens + R"(, "encoding": "view-z")",
               {"100 % of the surfaces lie before the near plane of the projection, 0.5", "from 0 to 1"}),
        warned("millimetres as the distances of a projection in metres", 1000 * metres(), "a.exr",
               lens + R"(, "encoding": "view-z")", {"behind the far plane of the projection, 100", "\"scale\""}),
        warned("the same with a matrix", 1000 * metres(), "a.exr",
               R"("encoding": "view-z", "projection": [[1.2,0,0,0],[0,1.7,0,0],[0,0,-1.01,-1.005],[0,0,-1,0]])",
               {"behind the far plane of the projection, 100.5", "\"scale\""}),
        warned(
            "a projection times a view", metres(), "a.exr",
            R"("encoding": "view-z", "projection": [[0.96,0,-0.72,1],[0,1.7,0,2],[-0.606,0,-0.808,-1],[-0.6,0,-0.8,3]])",
            {"it holds the view as well"}),
        warned("radians", metres(), "a.exr", R"("perspective": {"fov_y_deg": 1.05}, "encoding": "view-z")",
               {"\"perspective.fov_y_deg\": 1.05", "write 60.2 degrees"}),
        refused("fy in other units", metres(), "a.exr", calibration("27.7", "5e8", "24", "16"),
                {"times as much across as down", "check fx and fy"}),
        {"no camera at all",
         metres(),
         "a.exr",
         "",
         2,
         {"--camera: missing", "--preset", "--relative"},
         {"dof", "--color", "{}/color.png", "--focus", "5", "--f-stop", "2", "--sensor-mm", "36"}},
        warned("a radius in millimetres", metres(), "a.exr", view_z, {"radius of 500", "scene units"},
               {"ssao", "--radius", "500"}),
        warned("a focus behind everything", metres(), "a.exr", view_z,
               {"focus of 5000 lies behind everything", "--focus-at"},
               joined(masks, {"--focus", "5000", "--f-stop", "0.1"})),
        warned("a scene unit of a kilometre", metres(), "a.exr", view_z,
               {"are cut off at --max-coc-px 512", "--mm-per-unit"},
               {"dof", "--color", "{}/color.png", "--focus", "900", "--f-stop", "1", "--focal-length-mm", "50",
                "--sensor-mm", "0.3", "--mm-per-unit", "30"}),
        warned("a scene unit of a metre taken for a kilometre, the subject a third of the image", walls(1.0 / 3),
               "a.exr", view_z, {"67 % of the circles of confusion are cut off at --max-coc-px 512", "--mm-per-unit"},
               joined(masks, {"--focus", "5", "--f-stop", "0.0001", "--max-coc-px", "512"})),
        warned("a sensor in metres", metres(), "a.exr", view_z, {"--sensor-mm: 0.036 mm", "give 36"},
               {"dof-masks", "--focus", "5", "--f-stop", "2", "--sensor-mm", "0.036"}),
        warned("a blur of no pixel", ramp(), "a.png", "",
               {"no circle of confusion is a pixel wide", "--blur-px is 0.5"},
               {"dof-masks", "--relative", "high-is-near", "--blur-px", "0.5", "--focus-at", "5,5"}),
        refused("depth as the picture", metres(), "a.exr", view_z, {"depth.png", "is it depth?"},
                {"fog", "--color", "{}/depth.png", "--density", "0.1"}),
        warned("a JPEG as linear", metres(), "a.exr", view_z, {"--color-space linear", "leave the option out"},
               {"fog", "--color", "{}/color.jpg", "--color-space", "linear", "--density", "0.1"}),
        warned("a PNG of 8 bits as linear", metres(), "a.exr", view_z,
               {"--color-space linear", "color.png holds 8 bits", "leave the option out"},
               {"fog", "--color", "{}/color.png", "--color-space", "linear", "--density", "0.1"}),
        warned("a PNG that cuts off", metres(), "a.exr", view_z,
               {"--png-scale 0.2 cuts 35 % of the values off", "--png-scale 0.099"},
               {"linearize", "--png-scale", "0.2"}, "z.png"),
        warned("a PNG of few codes", metres(), "a.exr", view_z, {"leaves 7 codes of 65535", "--png-scale 0.099"},
               {"linearize", "--png-scale", "0.00001"}, "z.png"),
        right("a corridor twice as wide as high", corridor(), "a.exr", view_z),
        right("packed depth", packed(), "a.png", wide + packing),
        right("a radius", metres(), "a.exr", view_z, {"ssao", "--radius", "1"}),
        right("a radius through a fisheye", metres(), "a.exr",
              calibration("10", "10", "24", "16") + R"(, "lens": {"model": "equidistant"}, "along": "ray")",
              {"ssao", "--radius", "1"}),
        right("a lens", metres(), "a.exr", view_z, joined(masks, {"--focus", "5", "--f-stop", "0.2"})),
        right("a limit of the circles that is a choice", walls(1.0 / 3), "a.exr", view_z,
              joined(masks, {"--focus", "5", "--f-stop", "0.2", "--max-coc-px", "2"})),
        right("a pinhole", metres(), "a.exr", view_z, joined(masks, {"--focus", "5", "--f-stop", "inf"})),
        right("a grey photograph as the picture", metres(), "a.exr", view_z,
              {"fog", "--color", "{}/grey.png", "--density", "0.1"}),
        right("a PNG of 16 bits as linear", metres(), "a.exr", view_z,
              {"fog", "--color", "{}/16.png", "--color-space", "linear", "--density", "0.1"}),
        right("a PNG of 8 bits that says that it is linear", metres(), "a.exr", view_z,
              {"fog", "--color", "{}/linear.png", "--color-space", "linear", "--density", "0.1"}),
        right("a PNG that fits", metres(), "a.exr", view_z, {"linearize", "--png-scale", "0.1"}, "z.png"),
        right("millimetres that the projection's planes fit", 1000 * metres(), "a.exr",
              R"("perspective": {"fov_y_deg": 60, "near": 500, "far": 100000}, "encoding": "view-z")"),
        right("noise", noise(width, height), "a.png", view_z + R"(, "scale": 0.001)"),
        right("noise in a larger image", noise(160, 120), "a.png", view_z + R"(, "scale": 0.001)"),
        right("noise along the rays", noise(160, 120), "a.png",
              wide + R"(, "encoding": "ray-distance", "scale": 0.001)"),
        right("whole metres", codes(metres(), 1), "a.png", view_z),
        right("holes that are said", codes(metres(0.6, 0), 1000), "a.png",
              view_z + R"(, "scale": 0.001, "missing": 0)"),
        right("holes of NaN", metres(0.6, NAN), "a.exr", view_z),
        right("a sky of infinity", metres(0.6, INFINITY), "a.exr", view_z),
        right("nothing but sky", constant(INFINITY), "a.exr", view_z),
        right("a depth buffer", ramp(), "a.png", window),
        right("a few pixels that are wrong", metres(0.05, -1), "a.exr", view_z),
    };
}

std::string saved(const Folder& folder, const Mistake& mistake) {
    const std::string file = folder / mistake.file;
    if (mistake.depth.depth() != CV_32F)
        cv::imwrite(file, mistake.depth);
    else if (fs::path(file).extension() == ".png")
        return depth_file(folder, mistake.file, mistake.depth);
    else
        write_image(file, mistake.depth);
    return file;
}

void write_pictures(const Folder& folder) {
    cv::imwrite(folder / "color.png", picture());
    cv::imwrite(folder / "color.jpg", picture());
    cv::imwrite(folder / "grey.png", grey_8());
    const cv::Mat light = converted(picture(), CV_32F, 1 / 255.0);
    cv::imwrite(folder / "16.png", codes(light, 65535));
    write_picture(folder / "linear.png", {light, {.encoding = ColorEncoding::linear, .bits = 8}});
    depth_file(folder, "depth.png");
}

} // namespace

TEST_CASE("mistakes: each is told in one line with its cure, and what is right is not") {
    std::size_t wrong = 0;
    std::set<std::string> told; // commands
    const std::vector<Mistake> all = mistakes();
    for (const Mistake& mistake : all) {
        INFO(mistake.name);
        const Folder folder;
        write_pictures(folder);
        const std::string input = saved(folder, mistake), camera = folder / "camera.json";
        write(camera, "{" + mistake.camera + "}");
        const auto asked = [&](const Arguments& more) {
            Arguments arguments = mistake.command;
            for (std::string& each : arguments)
                if (each.starts_with("{}"))
                    each = folder / each.substr(3);
            arguments.push_back(input);
            if (!mistake.camera.empty())
                arguments = joined(arguments, {"--camera", camera});
            return run(joined(arguments, more));
        };
        const Outcome outcome = asked({"-o", folder / ("out/" + mistake.result)});
        INFO("stderr: " << outcome.err);
        wrong += !mistake.said.empty();
        CHECK(outcome.code == mistake.code);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == (mistake.said.empty() ? 0 : 1));
        for (const std::string& part : mistake.said)
            CHECK(contains(outcome.err, part));
        CHECK(folder.results().size() == (mistake.code == 0 ? 1u : 0u));
        // A warning is an error where that is asked for: all of them go one way, so one of each command is tried.
        if (mistake.code == 0 && !mistake.said.empty() && told.insert(mistake.command.front()).second) {
            const Outcome strict = asked({"-o", folder / ("out/strict-" + mistake.result), "--strict"});
            CHECK(strict.code == 1);
            CHECK(folder.results().size() == 1);
            CHECK(asked({"-o", folder / ("out/" + mistake.result), "--quiet"}).err == outcome.err);
        }
    }
    std::cout << wrong << " mistakes told, " << all.size() - wrong << " right inputs without a word\n";
    CHECK(wrong >= 36);
}

TEST_CASE("mistakes: the line about a result says what the depth holds") {
    const Folder folder;
    const std::string input = folder / "a.exr", camera = folder / "camera.json";
    cv::Mat depth = metres(0.25, INFINITY);
    depth.at<float>(height - 1, 0) = -1;
    write_image(input, depth);
    write(camera, "{" + wide + R"(, "encoding": "view-z"})");
    const Outcome line = check_done({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"});
    CHECK(line.out.find("z 3.191 to 10, 25 % background, 1 of 1536 pixels invalid (under 0.1 %)") != std::string::npos);
    const Outcome json = run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr", "--json"});
    CHECK(contains(json.out, R"("background":384,"invalid":1)"));

    write_pictures(folder);
    const Arguments thin{"--focus", "5", "--f-stop", "0.2", "--focal-length-mm", "50", "--sensor-mm", "36"},
        picture{"--color", folder / "color.png"};
    for (const Arguments& command :
         {Arguments{"normals"}, Arguments{"ssao", "--radius", "1"}, joined({"dof-masks"}, thin),
          joined(joined({"dof"}, thin), picture), joined({"fog", "--density", "0.1"}, picture)}) {
        INFO(command.front());
        const Outcome each = check_done(joined(command, {input, "--camera", camera, "-o", folder / "out/each.exr"}));
        CHECK(each.out.find(", 1 of 1536 pixels invalid (under 0.1 %)") != std::string::npos);
    }
    const Outcome points = run({"unproject", input, "--camera", camera, "-o", folder / "out/points.ply"});
    CHECK(points.out.find(", 1 of 1536 pixels invalid (under 0.1 %)") != std::string::npos);
    write_image(input, metres());
    const Outcome all = run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"});
    CHECK(all.out.find("z 2.6 to 10, 0 of 1536 pixels invalid  ") != std::string::npos);
}

TEST_CASE("mistakes: the line about relative depth says which values it holds") {
    const Folder folder;
    const std::string floats = folder / "a.exr", bytes = folder / "a.png";
    cv::Mat depth = metres(0.25, NAN);
    write_image(floats, depth, {.channels = {"Depth.Z"}, .png_scale = {}});
    cv::Mat codes_of_8 = grey_8() / 2;
    codes_of_8.at<uchar>(0, 0) = 200;
    cv::imwrite(bytes, codes_of_8);
    const Arguments ask{"dof-masks", "--relative", "high-is-near", "--blur-px", "24", "--focus-range", "0.2,0.4", "-o"};
    const Outcome line = check_done(joined(ask, {folder / "out/a.exr", floats}));
    CHECK(contains(line.out, "Depth.Z: values 3.190")); // the value of pixel 384
    CHECK(line.out.find(" to 10, 384 of 1536 pixels invalid (25 %)") != std::string::npos);
    const Outcome json = run(joined(ask, {folder / "out/a.exr", floats, "--json"}));
    CHECK(contains(json.out, R"("depth_channel":"Depth.Z","stored":{"min":3.19)"));
    CHECK(contains(json.out, R"("max":10.0},"invalid":384})"));
    const Outcome integers = check_done(joined(ask, {folder / "out/a.exr", bytes}));
    CHECK(integers.out.find("  values 0 to 200, 0 of 1536 pixels invalid  ") != std::string::npos);
}

TEST_CASE("mistakes: a result that loses the profile or the data of a camera is a warning") {
    const Folder folder;
    const std::string input = folder / "a.exr", camera = folder / "camera.json", photo = folder / "photo.png";
    write_image(input, metres());
    write(camera, "{" + wide + R"(, "encoding": "view-z"})");
    cv::imwrite(photo, picture());
    Picture taken = read_picture(photo);
    taken.format.exif = {'I', 'I', '*', 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0}; // a directory without an entry
    write_picture(photo, taken);
    const auto fogged = [&](const std::string& name, const Arguments& more) {
        return run(joined(
            {"fog", input, "--camera", camera, "--color", photo, "--density", "0.1", "-o", folder / ("out/" + name)},
            more));
    };
    for (const char* kept : {"a.png", "a.jpg"})
        check_done(fogged(kept, {"--strict"}));
    for (const char* lost : {"a.exr", "a.tif", "a.hdr"}) {
        INFO(lost);
        const Outcome refused = fogged(lost, {"--strict"});
        CHECK(refused.code == 1);
        CHECK(!fs::exists(folder / ("out/" + std::string(lost))));
        for (const Arguments& more : {Arguments{}, Arguments{"--quiet"}}) {
            const Outcome told = fogged(lost, more);
            CHECK(told.code == 0);
            CHECK(told.err.starts_with("fathom: warning: " + folder / ("out/" + std::string(lost))));
            CHECK(contains(told.err, "does not hold the colour profile or the camera's data"));
            CHECK(std::count(told.err.begin(), told.err.end(), '\n') == 1);
        }
    }
    taken.format.exif.resize(70000); // more than a JPEG holds
    write_picture(photo, taken);
    check_done(fogged("a.png", {"--strict"}));
    CHECK(fogged("a.jpg", {"--strict"}).code == 1);
}

TEST_CASE("mistakes: no real input warns", "[real]") {
    if (!real::there("opengl"))
        return;
    const Folder folder;
    int inputs = 0;
    for (const auto& entry : fs::directory_iterator(real::data / "opengl")) {
        const std::string name = entry.path().stem().string();
        const fs::path depth = real::data / "opengl" / (name + ".depth.tif");
        if (entry.path().extension() != ".json" || !fs::exists(depth))
            continue;
        INFO(name);
        check_done({"linearize", depth.string(), "--camera", entry.path().string(), "-o", folder / "out/z.exr"});
        ++inputs;
    }
    for (const char* view : {"perspective", "orthographic"}) {
        const fs::path frame = real::data / "blender" / view;
        if (!fs::exists(frame / "sharp.exr"))
            continue;
        INFO(view);
        check_done({"linearize", (frame / "sharp.exr").string(), "--camera", (frame / "camera.json").string(), "-o",
                    folder / "out/z.exr"});
        ++inputs;
    }
    const fs::path room = real::data / "habitat";
    check_done({"linearize", (room / "room.depth.exr").string(), "--camera", (room / "room.camera.json").string(), "-o",
                folder / "out/z.exr"});
    for (const char* view : {"perspective", "orthographic"}) { // which bring their lens and their radius
        const fs::path frame = real::data / "blender" / view;
        const Arguments input{(frame / "sharp.exr").string(), "--camera", (frame / "camera.json").string()};
        check_done(joined({"ssao", "-o", folder / "out/ao.exr", "--region", "0,0,8,8", "--normals", "none"}, input));
        check_done(joined({"dof-masks", "-o", folder / "out/masks.exr", "--max-coc-px", "512"}, input));
    }
    CHECK(inputs > 10);
}

TEST_CASE("mistakes: real depth buffers are told where they are read as distances", "[real]") {
    if (!real::there("opengl"))
        return;
    const Folder folder;
    const std::string camera = folder / "camera.json";
    // Flat surfaces tell most of them. Of others only the planes of their projection, or the sky at 1. Those of
    // `ortho_oblique24` are oblique.
    const char *clipped = "before the near plane of the projection", *sky = "of the pixels hold 1, as in normalised";
    const std::map<std::string, const char*> others{{"linear24", "\"encoding\": \"linear\""},
                                                    {"log32f", "\"encoding\": \"logarithmic\""},
                                                    {"median32f", clipped},
                                                    {"pseudolinear32f", clipped},
                                                    {"ortho_off24", clipped},
                                                    {"ortho16", "\"scale\": 0.001"},
                                                    {"tilt32f", sky}};
    const std::set<std::string> unknown{"ortho_oblique24"};
    int told = 0;
    for (const auto& entry : fs::directory_iterator(real::data / "opengl")) {
        const std::string name = entry.path().stem().string();
        if (entry.path().extension() != ".json" || unknown.contains(name))
            continue;
        INFO(name);
        auto json = nlohmann::json::parse(content(entry.path()));
        json["encoding"] = "view-z";
        for (const char* key : {"near", "far", "median"}) // of the encoding
            json.erase(key);
        write(camera, json.dump());
        std::string depth = (real::data / "opengl" / name).string() + ".depth.tif";
        if (!fs::exists(depth))
            depth = (real::data / "opengl" / name).string() + ".depth.png";
        const Outcome outcome = run({"linearize", depth, "--camera", camera, "-o", folder / "out/z.exr"});
        CHECK(outcome.code == 0);
        CHECK(contains(outcome.err, "warning: "));
        CHECK(contains(outcome.err, others.contains(name) ? others.at(name) : "\"encoding\": \"window\""));
        ++told;
    }
    std::cout << told << " depth buffers of OpenGL read as distances are told\n";
    CHECK(told == 18);
}

TEST_CASE("mistakes: no camera of the examples warns on its scene") {
    const Folder folder;
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(places::sources) / "examples/cameras")) {
        INFO(entry.path().filename().string());
        CameraFile file = read_camera(entry.path());
        Camera still =
            camera_for(file, file.camera.width ? file.camera.width : 96, file.camera.height ? file.camera.height : 60);
        const bool hills = entry.path().stem() == "terrain";
        const auto image =
            still.lens ? scene::render(scene::room(), still,
                                       [rays = PixelRays(still)](double x, double y) { return rays.ray_of(x, y); })
                       : scene::render(hills ? scene::terrain() : scene::room(), still);
        const std::string input = folder / "a.exr";
        write_image(input, cv::Mat(still.height, still.width, CV_32FC1, const_cast<float*>(image.stored.data())));
        check_done({"linearize", input, "--camera", entry.path().string(), "-o", folder / "out/z.exr"});
        ++count;
    }
    CHECK(count >= 4);
}

TEST_CASE("mistakes: several channels that could be depth are told, unless one of them is it by convention") {
    struct Case {
        std::vector<std::string> channels;
        std::string taken;
        std::vector<std::string> others; ///< that are told
    };
    const Case cases[] = {
        {{"Depth", "ZDepth"}, "Depth", {"ZDepth"}},
        {{"V", "Y"}, "V", {"Y"}},
        {{"V", "Z"}, "Z", {"V"}},
        {{"Depth", "V"}, "V", {"Depth"}},
        {{"A.Depth.Z", "B.Depth.Z"}, "A.Depth.Z", {"B.Depth.Z"}},
        {{"Z", "left.Z", "right.Z"}, "Z", {"left.Z", "right.Z"}},
        {{"Y", "Z"}, "Z", {}}, // OpenEXR: brightness and depth
        {{"Depth", "Y"}, "Depth", {}},
        {{"ViewLayer.Depth.Z", "ViewLayer.Mist.Z"}, "ViewLayer.Depth.Z", {}}, // Blender
        {{"Z", "linear.Z", "Fathom.linear.Z"}, "Z", {}},                      // fathom linearize --append
        {{"N.X", "N.Y", "N.Z", "Z"}, "Z", {}},
        {{"U", "V", "Z"}, "Z", {}},
        {{"Depth", "X", "Y", "Z"}, "Depth", {}},
        {{"Z", "distance"}, "Z", {"distance"}},
    };
    const Folder folder;
    const std::string input = folder / "a.exr", camera = folder / "camera.json";
    write(camera, "{" + wide + R"(, "encoding": "view-z"})");
    for (const Case& each : cases) {
        INFO(each.channels.front() << ", " << each.channels.back());
        write_image(input, merged(std::vector<cv::Mat>(each.channels.size(), metres())),
                    {.channels = each.channels, .png_scale = {}});
        const Arguments ask{"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"};
        const Outcome outcome = run(ask);
        CHECK(outcome.code == 0);
        if (each.others.empty())
            CHECK(outcome.err == "");
        else
            CHECK(contains(outcome.err, "channel \"" + each.taken + "\" is taken, but "));
        for (const std::string& other : each.others) {
            CHECK(contains(outcome.err, other));
            CHECK(run(joined(ask, {"--channel", other})).code == 0);
        }
    }
}

TEST_CASE("mistakes: an EXR of distances along the ray is told where it counts as distances along the axis") {
    const Folder folder;
    const std::string z = folder / "z.npy", ray = folder / "ray.exr", camera = folder / "camera.json",
                      of_rays = folder / "rays.json";
    write_image(z, metres());
    write(camera, "{" + wide + R"(, "encoding": "view-z"})");
    write(of_rays, "{" + wide + R"(, "encoding": "ray-distance"})");
    check_done({"linearize", z, "--camera", camera, "--as", "ray-distance", "-o", ray});
    const auto linearize = [&](const std::string& input, const std::string& by) {
        return run({"linearize", input, "--camera", by, "-o", folder / "out/back.exr"});
    };
    const std::string line = R"(channel "distance" is called like distances along the ray)",
                      key = R"(say "encoding": "ray-distance")";
    for (const Outcome& outcome : {linearize(ray, camera), run({"inspect", ray, "--camera", camera})}) {
        CHECK(contains(outcome.out + outcome.err, line));
        CHECK(contains(outcome.out + outcome.err, key));
    }
    const Outcome right = linearize(ray, of_rays);
    CHECK(right.code == 0);
    CHECK(right.err == "");
    const cv::Mat back = read_depth(folder / "out/back.exr").values;
    double worst = 0;
    cv::minMaxLoc(cv::abs(back - metres()), nullptr, &worst);
    CHECK(worst < 10 * 4 * 0x1p-24);
    CHECK(linearize(z, camera).err == "");
}
