// fathom presets, and --preset in place of a camera file.
#include "io_files.hpp"
#include "program.hpp"

#include <fathom/presets.hpp>

#include <nlohmann/json.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

std::string kinect_file(const Folder& folder) {
    const std::string file = folder / "depth.png"; // of a slanted plane, 1 to 8 metres
    cv::imwrite(file, converted(125 / (1 - 0.875 * ramp()), CV_16U, 8));
    return file;
}

const std::string kinect = "kinect:fx=40,fy=40,cx=23.5,cy=15.5";

} // namespace

TEST_CASE("presets program: lists every source with its formula and what it needs") {
    const Outcome list = check_done({"presets"});
    const Outcome json = check_done({"presets", "--json"});
    const auto all = nlohmann::json::parse(json.out);
    CHECK(all.size() == presets().size());
    for (const Preset& preset : presets()) {
        INFO(preset.name);
        CHECK(("\n" + list.out).find("\n" + preset.name + " ") != std::string::npos);
        CHECK(contains(list.out, preset.formula + "; needs "));
        const Outcome one = check_done({"presets", preset.name});
        CHECK(contains(one.out, preset.source));

        // The camera file to start from is one, as soon as each question mark is a number.
        std::string file = one.out.substr(one.out.find("\n{") + 1);
        const TempFolder folder;
        if (contains(file, '?'))
            check_says([&] { read_camera(put(folder / "camera.json", file)); }, {"camera.json", "\"?\"", "number"});
        for (std::size_t at = 0, value = 1; (at = file.find("\"?\"")) != std::string::npos; ++value)
            file.replace(at, 3, std::to_string(value));
        CHECK(read_camera(put(folder / "camera.json", file)).preset == preset.name);
    }
}

TEST_CASE("presets program: what is wrong is told in a line, and nothing is done") {
    const Folder folder;
    const std::string depth = kinect_file(folder), camera = camera_file(folder), output = folder / "out/z.exr";
    const auto refused = [&](const Arguments& more, const std::string& named) {
        check_refused(joined({"linearize", depth, "-o", output}, more), 2, named);
        CHECK(folder.results().empty());
    };
    refused({}, "--preset with the source of the depth (fathom presets lists them)");
    check_refused({"linearize", depth, "-o", output, "--camera", camera, "--preset", kinect}, 1,
                  "both \"perspective\" and \"intrinsics\"");
    refused({"--preset", "kinekt:fx=40"}, "the nearest is \"kinect\"");
    refused({"--preset", "kinect"}, "\"intrinsics\" is missing; the preset \"kinect\" needs a projection");
    refused({"--preset", "kinect:fx=40,fy"}, "\"fy\" is no key and value");
    refused({"--preset", "kinect:fx=40,fy=40,cx=a,cy=1"}, "\"a\" must be a number");
    check_refused({"presets", "kinekt"}, 2, "did you mean kinect?");
    check_refused({"ssao", depth, "--preset", kinect, "-o", output}, 2, "preset kinect");
    check_refused({"linearize", depth, "--preset", "carla:fov_x_deg=90", "-o", output}, 1, "three 8-bit channels");
}
