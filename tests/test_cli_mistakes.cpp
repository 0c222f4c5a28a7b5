// Mistakes that used to pass in silence: input, the line that is expected, the exit code. And right inputs, which warn of
// nothing.
#include "io_files.hpp"
#include "program.hpp"
#include "real_inputs.hpp"

#include <cmath>

using namespace fathom;
using namespace fathom::test;

namespace {

struct Mistake {
    const char* name;
    cv::Mat depth;
    std::string file, camera; ///< a name for the depth; members of the camera file
    int code;
    std::vector<std::string> said; ///< parts of the line; none: no line at all
};

const std::string lens = R"("perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100})";
const std::string wide = R"("perspective": {"fov_y_deg": 60})";

/// Metres from 2.6 to 10, some of them replaced.
cv::Mat metres(double fraction = 0, float instead = 0) {
    cv::Mat depth(height, width, CV_32FC1);
    for (int i = 0; i < width * height; ++i)
        depth.at<float>(i / width, i % width) =
            i < fraction * width * height ? instead : 2.6f + 7.4f * static_cast<float>(i) / (width * height - 1);
    return depth;
}

cv::Mat codes(const cv::Mat& depth, double scale) {
    cv::Mat result;
    depth.convertTo(result, CV_16U, scale);
    return result;
}

cv::Mat constant(float value) {
    return cv::Mat(height, width, CV_32FC1, cv::Scalar(value));
}

std::vector<Mistake> mistakes() {
    const std::string window = lens, view_z = wide + R"(, "encoding": "view-z")";
    return {
        {"metric depth as a depth buffer",
         metres(),
         "a.exr",
         window,
         1,
         {"a.exr: no pixel has a depth", "2.6 to 10", "\"window\" depth lies in 0 to 1", "\"encoding\": \"view-z\""}},
        {"metric depth as linear",
         metres(),
         "a.pfm",
         lens + R"(, "encoding": "linear")",
         1,
         {"no pixel", "\"linear\" depth lies in 0 to 1"}},
        {"nothing but NaN", constant(NAN), "a.exr", view_z, 1, {"all of its values are NaN", "--channel"}},
        {"nothing but infinity", constant(-INFINITY), "a.exr", view_z, 1, {"none of its values is finite"}},
        {"negative depth", -1 * metres(), "a.exr", view_z, 1, {"no pixel has a depth", "from -10 to -2.6"}},
        {"nothing measured",
         codes(constant(0), 1),
         "a.png",
         view_z + R"(, "scale": 0.001, "missing": 0)",
         1,
         {"all of its values are 0, which the camera says was not measured"}},
        {"a zero image", constant(0), "a.exr", view_z, 1, {"no pixel has a depth", "the values are 0"}},
        {"a third is negative",
         metres(0.34, -1),
         "a.exr",
         view_z,
         0,
         {"warning: ", "a.exr: 34 % of the pixels are invalid", "from -1 to 10"}},
        {"half is beyond the range",
         metres(0.5, 0.5f),
         "a.exr",
         window,
         0,
         {"warning: ", "50 % of the pixels are invalid"}},
        {"Blender's sky as a surface",
         metres(0.2, 1e10f),
         "a.exr",
         view_z,
         0,
         {"warning: ", "20 % of the pixels hold 1e+10", "\"background_from\": 1e+10"}},
        {"the sky of half floats as a surface", metres(0.2, 65504), "a.exr", view_z, 0, {"warning: ", "hold 65504"}},
        {"millimetres without a scale",
         codes(metres(), 1000),
         "a.png",
         view_z,
         0,
         {"warning: ", "depths run from 2600 to 1e+04", "\"scale\": 0.001"}},
        {"metres times the scale of millimetres",
         metres(),
         "a.exr",
         view_z + R"(, "scale": 0.001)",
         0,
         {"warning: ", "are 0.01 at most", "\"scale\": 1"}},
        // What is right
        {"millimetres with a scale", codes(metres(), 1000), "a.png", view_z + R"(, "scale": 0.001)", 0, {}},
        {"whole metres", codes(metres(), 1), "a.png", view_z, 0, {}},
        {"a sky that is said", metres(0.2, 1e10f), "a.exr", view_z + R"(, "background_from": 1e10)", 0, {}},
        {"a sky that is said by its value", metres(0.2, 1e10f), "a.exr", view_z + R"(, "background": 1e10)", 0, {}},
        {"holes that are said",
         codes(metres(0.6, 0), 1000),
         "a.png",
         view_z + R"(, "scale": 0.001, "missing": 0)",
         0,
         {}},
        {"holes of NaN", metres(0.6, NAN), "a.exr", view_z, 0, {}},
        {"a sky of infinity", metres(0.6, INFINITY), "a.exr", view_z, 0, {}},
        {"nothing but sky", constant(INFINITY), "a.exr", view_z, 0, {}},
        {"a depth buffer", ramp(), "a.png", window, 0, {}},
        {"a few pixels that are wrong", metres(0.2, -1), "a.exr", view_z, 0, {}},
    };
}

std::string saved(const Folder& folder, const Mistake& mistake) {
    const std::string file = folder / mistake.file;
    if (mistake.depth.depth() == CV_16U)
        cv::imwrite(file, mistake.depth);
    else if (fs::path(file).extension() == ".png")
        return depth_file(folder, mistake.file, mistake.depth);
    else
        write_image(file, mistake.depth);
    return file;
}

} // namespace

TEST_CASE("mistakes: each is told in one line with its cure, and what is right is not") {
    for (const Mistake& mistake : mistakes()) {
        INFO(mistake.name);
        const Folder folder;
        const std::string input = saved(folder, mistake), camera = folder / "camera.json",
                          output = folder / "out/z.exr";
        write(camera, "{" + mistake.camera + "}");
        const Outcome outcome = run({"linearize", input, "--camera", camera, "-o", output});
        INFO("stderr: " << outcome.err);
        CHECK(outcome.code == mistake.code);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == (mistake.said.empty() ? 0 : 1));
        for (const std::string& part : mistake.said)
            CHECK(outcome.err.find(part) != std::string::npos);
        CHECK(folder.results().size() == (mistake.code == 0 ? 1u : 0u));
        if (mistake.code == 0) { // a warning is an error where that is asked for
            const Outcome strict =
                run({"linearize", input, "--camera", camera, "-o", folder / "out/s.exr", "--strict"});
            CHECK(strict.code == (mistake.said.empty() ? 0 : 1));
            CHECK(folder.results().size() == (mistake.said.empty() ? 2u : 1u));
            CHECK(run({"linearize", input, "--camera", camera, "-o", output, "--quiet"}).err == outcome.err);
        }
    }
}

TEST_CASE("mistakes: the line about a result says what the depth holds") {
    const Folder folder;
    const std::string input = folder / "a.exr", camera = folder / "camera.json";
    cv::Mat depth = metres(0.25, INFINITY);
    depth.at<float>(height - 1, 0) = -1;
    write_image(input, depth);
    write(camera, "{" + wide + R"(, "encoding": "view-z"})");
    const Outcome line = run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"});
    check_done(line);
    CHECK(line.out.find("z 4.451 to 10, 25 % background, 0.065 % invalid") != std::string::npos);
    const Outcome json = run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr", "--json"});
    CHECK(json.out.find(R"("background":384,"invalid":1)") != std::string::npos);
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
        check_done(run({"linearize", depth.string(), "--camera", entry.path().string(), "-o", folder / "out/z.exr"}));
        ++inputs;
    }
    for (const char* view : {"perspective", "orthographic"}) {
        const fs::path frame = real::data / "blender" / view;
        if (!fs::exists(frame / "sharp.exr"))
            continue;
        INFO(view);
        check_done(run({"linearize", (frame / "sharp.exr").string(), "--camera", (frame / "camera.json").string(), "-o",
                        folder / "out/z.exr"}));
        ++inputs;
    }
    CHECK(inputs > 10);
}
