// Cameras of other programs' files, as people give them to the program.
#include "exr_files.hpp"
#include "program.hpp"

#include <fathom/camera_file.hpp>

#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

const std::string calibration =
    "%YAML:1.0\n---\nimage_width: 48\nimage_height: 32\ncamera_matrix: !!opencv-matrix\n   rows: 3\n"
    "   cols: 3\n   dt: d\n   data: [ 40., 0., 23.5, 0., 40., 15.5, 0., 0., 1. ]\n";
const std::string same_calibration = R"("width": 48, "height": 32, "view_axes": "opencv",
    "intrinsics": {"fx": 40, "fy": 40, "cx": 23.5, "cy": 15.5, "pixel_origin": "centre"})";

std::string ros(const std::string& d) {
    return "width: 48\nheight: 32\ndistortion_model: plumb_bob\nd: [" + d +
           ", 0, 0, 0, 0]\nk: [40, 0, 23.5, 0, 40, 15.5, 0, 0, 1]\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
           "p: [30, 0, 20, 0, 0, 30, 10, 0, 0, 0, 1, 0]\n";
}

std::string put_text(const Folder& folder, const std::string& name, const std::string& text) {
    write(folder / name, text);
    return folder / name;
}

/// A slanted plane, 5 to 20 away: 1/z is affine in the pixel.
cv::Mat slanted() {
    cv::Mat depth;
    cv::divide(20.0, ramp() * 3 + 1, depth);
    return depth;
}

/// The plane as EXR with a camera in its header: 50 pixels of focal length, seen from (1, 2, 3) along +z.
std::string put_frame(const Folder& folder, const std::string& name, float focus = 5, bool vray = false) {
    const std::string file = folder / name;
    cv::Mat depth = vray ? cv::Mat((slanted() - 1) / 19) : slanted(); // V-Ray: from 1 to 20
    Imf::Header header(width, height);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    const Imath::M44f to_camera(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, -2, -3, 1);
    const Imath::M44f lens(50.f / width, 0, 0, 0, 0, -50.f / height, 0, 0, 0.5f, 0.5f, 1, 1, 0, 0, -0.1f, 0);
    if (vray) {
        header.insert("cameraFov", Imf::FloatAttribute(50));
    } else {
        header.insert("worldToCamera", Imf::M44fAttribute(to_camera));
        header.insert("worldToNDC", Imf::M44fAttribute(to_camera * lens));
        Imf::addFocus(header, focus);
        Imf::addAperture(header, 2);
    }
    Imf::FrameBuffer frame;
    frame.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(depth.data), 4, depth.step));
    Imf::OutputFile exr(file.c_str(), header);
    exr.setFrameBuffer(frame);
    exr.writePixels(height);
    return file;
}

std::string kinect_depth(const Folder& folder, const std::string& name = "depth.png") {
    cv::imwrite(folder / name, converted(slanted(), CV_16U, 1000));
    return folder / name;
}

} // namespace

TEST_CASE("camera program: a calibration and a preset are the camera file that they stand for") {
    const Folder folder;
    const std::string depth = kinect_depth(folder), camera = put_text(folder, "calibration.yml", calibration);
    const std::string truth = put_text(
        folder, "truth.json", R"({"encoding": "view-z", "scale": 0.001, "missing": 0, )" + same_calibration + "}");
    const std::string made = folder / "out/camera.json";
    check_done({"camera", camera, "--preset", "kinect", "-o", made});
    const Outcome printed = check_done({"camera", camera, "--preset", "kinect"});
    CHECK(printed.out == content(made));
    CHECK(read_camera(made).preset == "kinect");
    const Arguments ways[] = {{"--camera", made},
                              {"--camera", camera, "--preset", "kinect"},
                              {"--camera", camera, "--preset", "encoding=view-z,scale=0.001,missing=0"}};
    for (const Arguments& command : {Arguments{"unproject"}, {"normals"}}) {
        check_done(joined(command, {depth, "--camera", truth, "-o", folder / "out/truth.exr"}));
        for (const Arguments& way : ways) {
            check_done(joined(joined(command, way), {depth, "-o", folder / "out/a.exr"}));
            for (const Channel& each : list_channels(folder / "out/truth.exr"))
                CHECK(same(channel(folder / "out/a.exr", each.name), channel(folder / "out/truth.exr", each.name)));
        }
    }
    check_done({"inspect", depth, "--camera", camera, "--preset", "kinect"});
    // A preset takes the place of what is no projection at all.
    check_done({"camera", put_text(folder, "list.json", R"({"encoding": "view-z", "perspective": [1, 2]})"), "--preset",
                "fov_x_deg=45"});
}

TEST_CASE("camera program: without --camera the header of the depth is the camera") {
    const Folder folder;
    const std::string frame = put_frame(folder, "frame.exr"), camera = folder / "camera.json";
    check_done({"camera", frame, "-o", camera});
    const Arguments commands[] = {
        {"linearize"},
        {"unproject", "--space", "world"},
        {"dof-masks", "--sensor-mm", "36", "--mm-per-unit", "10"}}; // its focus and f-number are in the header
    for (const Arguments& command : commands) {
        INFO(command.front());
        check_done(joined(command, {frame, "-o", folder / "out/a.exr"}));
        check_done(joined(command, {frame, "--camera", camera, "-o", folder / "out/b.exr"}));
        for (const Channel& each : list_channels(folder / "out/a.exr"))
            CHECK(same(channel(folder / "out/a.exr", each.name), channel(folder / "out/b.exr", each.name)));
    }
    // The middle of the image, at distance z, is (1, 2, 3 + z) of the header's world.
    check_done({"unproject", frame, "--space", "world", "-o", folder / "out/points.exr"});
    const cv::Mat z = channel(frame, "Z"), x = channel(folder / "out/points.exr", "P.X");
    const cv::Mat depth = channel(folder / "out/points.exr", "P.Z");
    constexpr float ulps = 8 * 0x1p-24f; // of the header's floats, and unproject's own 4
    for (const auto& [row, column] : {std::pair{0, 0}, {16, 24}, {31, 47}}) {
        const float at = z.at<float>(row, column), truth = 1 + at * (static_cast<float>(column) + 0.5f - 24) / 50;
        CHECK(std::abs(x.at<float>(row, column) - truth) <= ulps * (1 + std::abs(at)));
        CHECK(std::abs(depth.at<float>(row, column) - (3 + at)) <= ulps * (3 + at));
    }
    const Outcome inspected = check_done({"inspect", frame});
    CHECK(contains(inspected.out, "encoding      view-z"));

    // A header that leaves the values open takes them from a preset, and a preset its angle of view from the header.
    const std::string ramped = put_frame(folder, "vray.exr", 5, true);
    check_refused({"linearize", ramped, "-o", folder / "out/no.exr"}, 1, "--preset vray-z:near=BLACK,far=WHITE");
    check_done({"linearize", ramped, "--preset", "vray-z:near=1,far=20", "-o", folder / "out/c.exr"});
    check_done({"linearize", frame, "--preset", "blender", "-o", folder / "out/d.exr"});
    check_done({"inspect", ramped});

    // Each input has its own header; one without is told, and the others are done.
    const std::string bare = depth_file(folder, "bare.exr"), more = folder / "out/more/";
    check_refused(run({"linearize", frame, bare, "-o", more, "--quiet"}), 1, bare + ": has no camera in its header");
    CHECK(fs::exists(fs::path(more) / "frame.exr"));
    CHECK_FALSE(fs::exists(fs::path(more) / "bare.exr"));
    check_refused({"linearize", bare, "-o", more}, 2, "--camera: missing");

    // Each has its own lens, too: this one is focused farther away.
    const std::string other = put_frame(folder, "other.exr", 7), told = folder / "told.exr";
    check_done({"dof-masks", frame, other, "--sensor-mm", "36", "--mm-per-unit", "10", "-o", more});
    check_done({"dof-masks", other, "--sensor-mm", "36", "--mm-per-unit", "10", "--focus", "7", "-o", told});
    CHECK(same(channel(more + "other.exr", "coc"), channel(told, "coc")));
    CHECK(!same(channel(more + "frame.exr", "coc"), channel(told, "coc")));
    check_refused({"dof-masks", frame, "-o", told}, 1, "--focal-length-mm: missing, and ");

    // A damaged input does not keep the others back.
    write(folder / "cut.exr", content(frame).substr(0, 400));
    fs::remove(more + "frame.exr");
    check_refused(run({"linearize", folder / "cut.exr", frame, "-o", more, "--quiet"}), 1, "cut.exr: is damaged");
    CHECK(fs::exists(more + "frame.exr"));
}

TEST_CASE("camera program: each depth has the frame of transforms.json that names it") {
    const Folder folder;
    const std::string one = kinect_depth(folder, "one.png"), two = kinect_depth(folder, "two.png");
    const auto frame = [](const std::string& name, int x) {
        return R"({"file_path": "images/)" + name + R"(.jpg", "depth_file_path": "depth/)" + name +
               R"(.png", "transform_matrix": [[1, 0, 0, )" + std::to_string(x) +
               "], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}";
    };
    const std::string camera = put_text(folder, "transforms.json",
                                        R"({"fl_x": 40, "cx": 24, "cy": 16, "w": 48, "h": 32, "frames": [)" +
                                            frame("one", 10) + ", " + frame("two", 30) + "]}");
    check_done({"unproject", one, two, "--space", "world", "--camera", camera, "-o", folder / "out/"});
    const cv::Mat a = channel(folder / "out/one.exr", "P.X"), b = channel(folder / "out/two.exr", "P.X");
    CHECK(b.at<float>(16, 24) - a.at<float>(16, 24) == 20);
    const Outcome chosen = check_done({"camera", camera, "--image", "two"});
    CHECK(chosen.out.find("[1.0,0.0,0.0,30.0]") != std::string::npos);
    check_refused({"camera", camera}, 1, "has 2 images; say which with --image: images/one.jpg, images/two.jpg");
}

TEST_CASE("camera program: what is wrong is told in a line, and nothing is left behind") {
    const Folder folder;
    const std::string depth = kinect_depth(folder), output = folder / "out/z.exr";
    const std::string camera = put_text(folder, "calibration.yml", calibration);
    const std::string bent = put_text(folder, "bent.yaml", ros("0.1"));
    const auto refused = [&](const Arguments& arguments, int code, const std::string& named) {
        check_refused(arguments, code, named);
        CHECK(folder.results().empty());
    };
    refused({"linearize", depth, "--camera", camera, "-o", output}, 1, "--preset kinect");
    refused({"ssao", depth, "--radius", "1", "--camera", bent, "--border", "clamp", "-o", output}, 1,
            "border clamp repeats pixels along straight lines");
    refused({"camera", camera, "--preset", "kinect:fx=3,fy=3,cx=1,cy=1,fov_x_deg=50"}, 1, "keep one");
    refused({"camera", camera, "--preset", "kinect", "--node", "a"}, 1, "leave out --node");
    refused({"camera", camera, "--preset", "kinect", "-o", folder / "out/camera.yaml"}, 2, "written as .json");
    refused({"camera", folder / "out"}, 1, "without COLMAP's cameras.bin or cameras.txt");
    refused({"camera", depth}, 1, "depth.png");
    refused({"linearize", depth, "--preset", "kinect:fx=1,fy=1,cx=1,cy=1", "--image", "a", "-o", output}, 2,
            "give it with --camera");
    const std::string own = put_text(folder, "own.json", R"({"encoding": "view-z", )" + same_calibration + "}");
    refused({"camera", own, "-o", own}, 2, "would replace the file that is read");
    refused({"camera", own, "--preset", "nuke-depth"}, 1, "contradicts the preset \"nuke-depth\"");
    const std::string large = put_text(folder, "large.json", R"({"encoding": "view-z", "width": 96, "height": 64,
        "perspective": {"fov_x_deg": 60}})");
    refused({"linearize", depth, "--camera", large, "-o", output}, 1,
            "scale the camera's width, height and pixels by 0.5");
    check_done({"linearize", depth, "--camera", bent, "--undistorted", "-o", output});
    CHECK(content(bent) == ros("0.1"));
}

TEST_CASE("camera program: what a header leaves uncertain is a warning, and an error if asked") {
    const Folder folder;
    const auto aside = [](Imf::Header& header) {
        header.screenWindowWidth() = 0.9f;
        header.screenWindowCenter() = {0.1f, 0};
    };
    write(fs::path(folder / "aside.exr"), ExrImage{.more = aside});
    for (const Arguments& command : {Arguments{"linearize", folder / "aside.exr", "-o", folder / "out/z.exr"},
                                     {"camera", folder / "aside.exr", "-o", folder / "out/c.json"}}) {
        const Outcome warned = run(command);
        CHECK(warned.code == 0);
        CHECK(warned.err.starts_with("fathom: warning: "));
        CHECK(contains(warned.err, "aside.exr: screenWindowCenter"));
        CHECK(std::count(warned.err.begin(), warned.err.end(), '\n') == 1);
        fs::remove(command.back());
        check_refused(joined(command, {"--strict"}), 1, "aside.exr: screenWindowCenter");
        CHECK(folder.results().empty());
    }
}
