// fathom dof-masks: its lens reaches the library, the files hold what it gives, and what is wrong is told in one line.
#include "program.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};

// A ramp of depths from 0.5 to 100 as the program and as the library sees it.
struct Scene {
    Folder folder;
    std::string camera, input;
    cv::Mat depth = ramp();
    StoredDepth stored;
    Lens lens{.f_stop = 0.4, .focus = 3, .focal_length_mm = 50, .sensor_mm = 36};

    Scene() : camera(camera_file(folder)) {
        depth.at<float>(0, 1) = NAN; // invalid
        for (int x = 0; x < width; ++x)
            depth.at<float>(7, x) = 0.1f + 0.004f * static_cast<float>(x); // before the focus
        for (int x = 0; x < width; ++x)
            depth.at<float>(20, x) = x < 24 ? 0.95f : x > 24 ? 0.6f : 0.8f; // averaged over an edge
        input = depth_file(folder, "frame.exr", depth);
        stored = {to_device(Device::open(), depth), camera_for(read_camera(camera), width, height)};
    }

    Arguments arguments(const std::string& output, const Arguments& more = {}) const {
        return joined({"dof-masks", input, "--camera", camera, "-o", output}, more);
    }
    Arguments with_lens(const std::string& output, const Arguments& more = {}) const {
        return joined(
            arguments(output, {"--focus", "3", "--f-stop", "0.4", "--focal-length-mm", "50", "--sensor-mm", "36"}),
            more);
    }

    std::vector<cv::Mat> expected(const Lens& of, const DofMasksOptions& options = weights) const {
        return expected(circle_of_confusion(of, stored.camera), options);
    }

    std::vector<cv::Mat> expected(const CircleOfConfusion& coc, const DofMasksOptions& options = weights) const {
        const DofMasks masks = dof_masks(stored, coc, options);
        return {to_mat(masks.coc).clone(), to_mat(masks.near_weight).clone(), to_mat(masks.focus_weight).clone(),
                to_mat(masks.far_weight).clone()};
    }
};

const std::vector<std::string> names{"coc", "near", "focus", "far"};

bool holds(const std::string& file, const std::vector<cv::Mat>& masks) {
    for (std::size_t i = 0; i < 4; ++i)
        if (!same(channel(file, names[i]), masks[i]))
            return false;
    return true;
}

} // namespace

TEST_CASE("dof-masks program: writes what the library computes") {
    const Scene scene;
    const std::vector<cv::Mat> truth = scene.expected(scene.lens);
    double least, greatest;
    cv::minMaxLoc(truth[0], &least, &greatest, nullptr, nullptr, truth[0] == truth[0]);
    CHECK(least < -5);
    CHECK(greatest > 2);
    CHECK(std::isnan(truth[0].at<float>(0, 1)));
    const std::string all = scene.folder / "out/masks.exr";
    check_done(scene.with_lens(all));
    CHECK(holds(all, truth));
    for (std::size_t i = 0; i < 4; ++i) {
        const std::string output = scene.folder / ("out/" + names[i] + ".pfm");
        check_done(scene.with_lens(output, {"--mask", names[i]}));
        CHECK(same(channel(output), truth[i]));
    }
    const std::string circle = scene.folder / "out/coc.png";
    check_refused(scene.with_lens(circle, {"--mask", "coc"}), 2, "--png-scale");
    check_done(scene.with_lens(circle, {"--mask", "coc", "--png-scale", "0.01"}));
    CHECK(channel(circle).at<ushort>(31, 0) == std::lround(truth[0].at<float>(31, 0) * 0.01 * 65535));
}

TEST_CASE("dof-masks program: a lens and what it is focused on reach the library") {
    const Scene scene;
    const std::string output = scene.folder / "out/masks.exr";
    const auto lens = [&](const Arguments& arguments, const Lens& of) {
        INFO(arguments[0] << ' ' << arguments[1]);
        check_done(scene.arguments(output, arguments));
        CHECK(holds(output, scene.expected(of)));
    };
    lens({"--focus", "inf", "--f-stop", "4", "--focal-length-mm", "50", "--sensor-mm", "24"},
         {.f_stop = 4, .focus = infinity, .focal_length_mm = 50, .sensor_mm = 24});
    lens({"--f-stop", "0.4", "--focus", "5", "--sensor-mm", "24"}, {.f_stop = 0.4, .focus = 5, .sensor_mm = 24});
    lens({"--f-stop", "4", "--focus", "5", "--focal-length-mm", "24", "--mm-per-unit", "10"},
         {.f_stop = 4, .focus = 5, .focal_length_mm = 24, .mm_per_unit = 10});
    lens({"--f-stop", "inf", "--focus", "5", "--focal-length-mm", "24"},
         {.f_stop = infinity, .focus = 5, .focal_length_mm = 24});
    const double z = depth_at(scene.stored, 20, 7);
    lens({"--focus-at", "20,7", "--f-stop", "0.2", "--focal-length-mm", "24"},
         {.f_stop = 0.2, .focus = z, .focal_length_mm = 24});
    lens({"--focus-at", "47,31", "--f-stop", "0.2", "--focal-length-mm", "24"}, // the sky
         {.f_stop = 0.2, .focus = infinity, .focal_length_mm = 24});
    lens({"--focus-along", "3,4,5.5", "--f-stop", "0.2", "--focal-length-mm", "24"},
         {.f_stop = 0.2, .focus = depth_along_ray(scene.stored.camera, 3.5, 4.5, 5.5), .focal_length_mm = 24});
    check_done(scene.arguments(output, {"--circle", "20,60"}));
    CHECK(holds(output, scene.expected(CircleOfConfusion{20, 60, 0, false})));
}

TEST_CASE("dof-masks program: orthographic rays have a telecentric lens") {
    const Scene scene;
    const std::string file = scene.folder / "parallel.json", output = scene.folder / "out/masks.exr";
    write(file, R"({"orthographic": {"left": -2, "right": 2, "bottom": -1, "top": 1, "near": 1, "far": 9}})");
    Scene orthographic_scene;
    orthographic_scene.camera = file;
    orthographic_scene.stored.camera = camera_for(read_camera(file), width, height);
    check_done(orthographic_scene.with_lens(output, {"--max-coc-px", "30"}));
    DofMasksOptions options = weights;
    options.max_coc_px = 30;
    CHECK(holds(output, orthographic_scene.expected(orthographic_scene.lens, options)));
    check_done(orthographic_scene.arguments(output, {"--circle", "20,4"}));
    CHECK(holds(output, orthographic_scene.expected(CircleOfConfusion{.k = 20, .g = 4, .telecentric = true})));
    for (const Arguments& lens : {Arguments{"--sensor-mm", "36"}, Arguments{}}) {
        Arguments all = orthographic_scene.arguments(output, {"--focus", "3", "--f-stop", "2"});
        all.insert(all.end(), lens.begin(), lens.end());
        check_refused(all, 2, "--focal-length-mm: missing, and " + file + " has no \"lens_mm\"; give it: orthographic");
    }
    // An orthographic camera has no lens at a finite depth, so the focus may be nearer than the focal length.
    check_done(orthographic_scene.arguments(
        output, {"--focus", "1", "--f-stop", "2", "--focal-length-mm", "50", "--mm-per-unit", "10"}));
}

TEST_CASE("dof-masks program: wrong usage is told before anything is done") {
    const Scene scene;
    const std::string output = scene.folder / "out/masks.exr";
    const std::vector<std::pair<Arguments, std::string>> cases{
        {{"--focus-at", "1"}, "X,Y"},
        {{"--focus-at", "1.5,2"}, "X,Y"},
        {{"--focus-along", "1,2"}, "X,Y,D"},
        {{"--circle", "1"}, "K,G"},
        {{"--mask", "all"}, "coc, near, focus or far"},
        {{"--transitoin-px", "1"}, "did you mean --transition-px?"},
        {{"--f-stop", "2", "--f-stop", "4"}, "--f-stop: is given more than once"},
        {{"--f-stop", "2", "--focus", "3"}, "--focal-length-mm: missing"},
    };
    for (const auto& [arguments, named] : cases) {
        INFO(arguments[0] << ' ' << arguments[1]);
        check_refused(scene.arguments(output, arguments), 2, named);
    }
    for (const std::string extension : {".png", ".tif", ".pfm"})
        check_refused(scene.with_lens(scene.folder / ("out/masks" + extension)), 2, "--mask coc|near|focus|far");
    check_refused(scene.with_lens(scene.folder / "out/masks.ply", {"--mask", "near"}), 2, ".ply");
    CHECK(scene.folder.results().empty());
}

TEST_CASE("dof-masks program: a focus that the image has not is refused") {
    const Scene scene;
    const std::string output = scene.folder / "out/masks.exr";
    const auto refused = [&](const Arguments& focus, const std::string& named) {
        check_refused(joined(scene.arguments(output, {"--f-stop", "2", "--focal-length-mm", "50"}), focus), 1, named);
    };
    refused({"--focus-at", "48,0"}, "--focus-at: pixel 48,0 lies outside the image of 48 × 32; the last one is 47,31");
    refused({"--focus-at", "1,0"}, "--focus-at: pixel 1,0 is invalid");
    refused({"--focus-along", "0,32,2"}, "--focus-along: pixel 0,32 lies outside the image of 48 × 32");
    refused({"--focus-along", "5,5,0.01"}, "focal length");
    CHECK(scene.folder.results().empty());
}

TEST_CASE("dof-masks program: what is between 0 and 1 may be PNG, and tiles need a file") {
    const Scene scene;
    const auto file = [&](const std::string& name) { return scene.folder / ("out/" + name); };
    check_done(scene.with_lens(file("near.png"), {"--mask", "near", "--near-alpha", file("coverage.png")}));
    const DofMasks truth =
        dof_masks(scene.stored, circle_of_confusion(scene.lens, scene.stored.camera), {.near_alpha = true});
    CHECK(channel(file("coverage.png")).at<ushort>(7, 3) ==
          std::lround(to_mat(truth.near_alpha).at<float>(7, 3) * 65535.0));
    const std::string other = file("other.exr");
    check_refused(scene.with_lens(other, {"--tile-px", "5"}), 2, "--tile-px");
    check_refused(scene.with_lens(other, {"--tile-max-coc", file("t.png")}), 2, ".png");
    check_refused(scene.with_lens(other, {"--max-near-coc", file("t.png")}), 2, ".png");
    check_refused(scene.with_lens(other, {"--near-alpha", other}), 2, "--near-alpha");
    CHECK(!fs::exists(other));
}
