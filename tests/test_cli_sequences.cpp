// A shot as a person gives it to the program: patterns of names, ranges of frames, cameras and values of each frame, and
// frames that are not there. The truth is what the program makes of each frame by itself.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

using namespace fathom::test;

namespace {

/// Frames whose depths, cameras and normals differ.
struct Shot {
    Folder folder;
    std::vector<int> frames;

    explicit Shot(const std::vector<int>& all = {1, 2, 3}) : frames(all) {
        for (const int frame : frames) {
            depth_file(folder, numbered("shot", frame), depth_of(frame));
            write(folder / fmt::format("cam.{:04}.json", frame), camera_of(frame));
        }
        write(camera(), camera_of(7));
    }

    static std::string numbered(const std::string& name, int frame) { return fmt::format("{}.{:04}.exr", name, frame); }
    static cv::Mat depth_of(int frame) {
        return filled(width, height, [&](int x, int y) { // bars that stand before a wall
            return 0.5 + 0.1 * (x / 6 % 2) + 0.01 * frame + 0.0001 * y;
        });
    }
    static std::string camera_of(int frame) {
        return fmt::format(R"({{"perspective": {{"fov_y_deg": {}, "aspect": 1.5, "near": 0.5, "far": 100}},
                           "ao_distance": {}, "focus_distance": {}, "f_stop": 0.01, "sensor_mm": 36}})",
                           50 + frame, 0.1 * frame, 0.9 + 0.1 * frame);
    }

    std::string camera() const { return folder / "camera.json"; }
    std::string file(int frame) const { return folder / numbered("shot", frame); }
    std::string own_camera(int frame) const { return folder / fmt::format("cam.{:04}.json", frame); }

    /// What the program makes of one frame alone.
    cv::Mat alone(const Arguments& command, const std::string& input, const std::string& camera,
                  const std::string& channel_name) const {
        const Folder own;
        check_done(joined(command, {input, "--camera", camera, "-o", own / "out/alone.exr"}));
        return channel(own / "out/alone.exr", channel_name);
    }

    cv::Mat result(int frame, const std::string& channel_name, const std::string& name = "z") const {
        return channel(folder / ("out/" + numbered(name, frame)), channel_name);
    }

    /// The lines of --json.
    static std::vector<nlohmann::json> lines(const Outcome& outcome) {
        std::vector<nlohmann::json> lines;
        std::istringstream text(outcome.out);
        for (std::string line; std::getline(text, line);)
            lines.push_back(nlohmann::json::parse(line));
        return lines;
    }
    static std::vector<int> frames_of(const Outcome& outcome) {
        std::vector<int> frames;
        for (const nlohmann::json& line : lines(outcome))
            frames.push_back(line["frame"]);
        return frames;
    }
};

using Names = std::vector<std::string>;

} // namespace

TEST_CASE("sequences: patterns, globs and folders are the frames that are there") {
    const Shot shot({2, 3, 11});
    const Folder& folder = shot.folder;
    fs::create_directory(folder / "shots");
    for (const int frame : shot.frames)
        fs::create_symlink(shot.file(frame), folder / ("shots/" + Shot::numbered("shot", frame)));
    const std::string input = folder / GENERATE(std::string("shot.%04d.exr"), "shot.####.exr", "shot.*.exr",
                                                "shot.00[01]?.exr", "shots", "shots/");
    const std::string output = folder / GENERATE(std::string("out/z.%04d.exr"), "out/z.####.exr");
    INFO(input << " to " << output);
    const Outcome outcome = check_done({"linearize", input, "--camera", shot.camera(), "-o", output, "--json"});
    CHECK(Shot::frames_of(outcome) == shot.frames);
    CHECK(folder.results() == Names{"z.0002.exr", "z.0003.exr", "z.0011.exr"});
    for (const int frame : shot.frames)
        CHECK(same(shot.result(frame, "Z"), shot.alone({"linearize"}, shot.file(frame), shot.camera(), "Z")));
}

TEST_CASE("sequences: results go into a folder, which is made, under the names of their frames") {
    const Shot shot;
    check_done({"linearize", shot.folder / "shot.####.exr", "--camera", shot.camera(), "-o",
                shot.folder / "out/new/deep", "--format", "tif"});
    CHECK(shot.folder.results() == Names{"deep", "new", "shot.0001.tif", "shot.0002.tif", "shot.0003.tif"});
    const std::string own = shot.folder / "out/f%d/z.exr";
    check_done({"linearize", shot.folder / "shot.####.exr", "--camera", shot.camera(), "-o", own, "--frames", "3"});
    CHECK(fs::exists(shot.folder / "out/f3/z.exr"));
    check_done({"linearize", shot.file(1), shot.file(2), "--camera", shot.camera(), "-o", shot.folder / "out/b#.exr"});
    CHECK(fs::exists(shot.folder / "out/b1.exr"));
    CHECK(fs::exists(shot.folder / "out/b2.exr"));
}

TEST_CASE("sequences: --frames chooses and orders, in the syntax of fileseq") {
    const Shot shot({-2, 1, 2, 3, 4, 5, 6});
    const auto frames = [&](const Arguments& range) {
        const Outcome outcome = check_done(joined({"linearize", shot.folder / "shot.####.exr", "--camera",
                                                   shot.camera(), "-o", shot.folder / "out/z.####.exr", "--json"},
                                                  range));
        return Shot::frames_of(outcome);
    };
    CHECK(frames({"--frames", "1-6x2,6"}) == std::vector<int>{1, 3, 5, 6});
    CHECK(frames({"--frames", "2-6x2"}) == std::vector<int>{2, 4, 6});
    CHECK(frames({"--frames", "6-1x3"}) == std::vector<int>{6, 3});
    CHECK(frames({"--frames", "-2"}) == std::vector<int>{-2});
    CHECK(frames({"--frames=-2--2,4"}) == std::vector<int>{-2, 4});
    CHECK(fs::exists(shot.folder / "out/z.-002.exr"));
    const Outcome folder = check_done({"linearize", shot.folder / "shot.*.exr", "--camera", shot.camera(), "-o",
                                       shot.folder / "out/", "--frames", "2-4", "--json"});
    CHECK(Shot::frames_of(folder) == std::vector<int>{2, 3, 4});
}

TEST_CASE("sequences: each frame has its own camera, companions and further results") {
    const Shot shot;
    const Folder& folder = shot.folder;
    const std::string depths = folder / "shot.####.exr", cameras = folder / "cam.%04d.json";
    check_done({"normals", depths, "--camera", cameras, "-o", folder / "n.####.exr"});
    check_done({"ssao", depths, "--camera", cameras, "--normals", folder / "n.####.exr", "-o",
                folder / "out/z.####.exr", "--confidence", folder / "out/c.%04d.exr", "--strict"});
    CHECK(folder.results() ==
          Names{"c.0001.exr", "c.0002.exr", "c.0003.exr", "z.0001.exr", "z.0002.exr", "z.0003.exr"});
    cv::Mat before;
    for (const int frame : shot.frames) { // also the radius is the camera's
        const Arguments command{"ssao", "--normals", folder / Shot::numbered("n", frame)};
        const cv::Mat alone = shot.alone(command, shot.file(frame), shot.own_camera(frame), "AO");
        CHECK(same(shot.result(frame, "AO"), alone));
        CHECK(!same(alone, before));
        before = alone;
    }
    check_done({"dof-masks", depths, "--camera", cameras, "-o", folder / "out/m.####.exr"});
    for (const int frame : shot.frames) // and the focus
        CHECK(same(shot.result(frame, "coc", "m"),
                   shot.alone({"dof-masks"}, shot.file(frame), shot.own_camera(frame), "coc")));
    check_done({"linearize", shot.file(2), "--camera", cameras, "-o", folder / "out/one.exr"});
    CHECK(same(channel(folder / "out/one.exr"), shot.alone({"linearize"}, shot.file(2), shot.own_camera(2), "Z")));

    write(shot.own_camera(2), R"({"perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100}})");
    const Outcome lacks = run({"ssao", depths, "--camera", cameras, "-o", folder / "out/z.####.exr", "--quiet"});
    check_refused(lacks, 1, "cam.0002.json has no \"ao_distance\"");
}

TEST_CASE("sequences: an option changes from frame to frame") {
    const Shot shot;
    const Folder& folder = shot.folder;
    const std::string depths = folder / "shot.####.exr", csv = folder / "pull.csv", json = folder / "stops.json";
    write(csv, "frame,focus,radius\n1,1.1,0.1\n2,inf,0.2\n3,1.2,0.4\n");
    write(json, R"({"1": 0.01, "2": 0.02, "3": "inf"})");
    const std::map<int, std::string> focus{{1, "1.1"}, {2, "inf"}, {3, "1.2"}},
        radius{{1, "0.1"}, {2, "0.2"}, {3, "0.4"}}, stops{{1, "0.01"}, {2, "0.02"}, {3, "inf"}};
    check_done({"dof-masks", depths, "--camera", shot.camera(), "--animate", "focus=" + csv, "--animate",
                "f_stop=" + json, "-o", folder / "out/z.####.exr"});
    check_done({"ssao", "--animate", "radius=" + csv, depths, "--camera", shot.camera(), "-o",
                folder / "out/ao.####.exr", "--frames", "3,1-2"});
    for (const int frame : shot.frames) {
        CHECK(same(shot.result(frame, "coc"),
                   shot.alone({"dof-masks", "--focus", focus.at(frame), "--f-stop", stops.at(frame)}, shot.file(frame),
                              shot.camera(), "coc")));
        CHECK(same(shot.result(frame, "AO", "ao"),
                   shot.alone({"ssao", "--radius", radius.at(frame)}, shot.file(frame), shot.camera(), "AO")));
    }
    write(csv, "1,\"5,6\"\n2,\"20,10\"\n3,\"30,30\"\n"); // a pixel that moves; an option that is required
    write(json, R"({"1": 0, "2": 0.1, "3": 0.5})");
    check_done({"dof-masks", depths, "--camera", shot.camera(), "--animate", "focus-at=" + csv, "-o",
                folder / "out/z.####.exr"});
    for (const int frame : shot.frames)
        fathom::write_image(folder / Shot::numbered("rgb", frame),
                            cv::Mat(height, width, CV_32FC3, cv::Scalar::all(frame)),
                            {.channels = {"R", "G", "B"}, .png_scale = {}});
    check_done({"fog", depths, "--color", folder / "rgb.####.exr", "--camera", shot.camera(), "--animate",
                "density=" + json, "-o", folder / "out/fog.####.exr"});
    CHECK(same(shot.result(3, "R", "fog"),
               shot.alone({"fog", "--density", "0.5", "--color", folder / Shot::numbered("rgb", 3)}, shot.file(3),
                          shot.camera(), "R")));
    CHECK(same(shot.result(2, "coc"),
               shot.alone({"dof-masks", "--focus-at", "20,10"}, shot.file(2), shot.camera(), "coc")));

    const auto refused = [&](const std::string& text, const Arguments& more, int code, const std::string& said) {
        write(csv, text);
        const Folder out;
        check_refused(joined({"dof-masks", depths, "--camera", shot.camera(), "-o", out / "out/z.####.exr"}, more),
                      code, said);
        CHECK(out.results().empty());
    };
    const std::string good = "1,2\n2,2\n3,2\n";
    refused("1,2\n2,-3\n3,4\n", {"--animate", "focus=" + csv}, 1, "pull.csv: frame 2: --focus: '-3' will not do");
    refused("1,2\n3,4\n", {"--animate", "focus=" + csv}, 1, "pull.csv: has no --focus for frame 2");
    refused(good, {"--animate", "focus=" + csv, "--focus", "3"}, 2, "--focus is given already");
    refused(good, {"--animate", "focus=" + csv, "--animate", "focus=" + csv}, 2, "--focus is given already");
    refused(good, {"--animate", "focus=" + csv, "--focus-at", "3,3"}, 2, "--focus");
    refused(good, {"--animate", "focs=" + csv}, 2, "did you mean focus?");
    refused(good, {"--animate", "camera=" + csv}, 2, "'camera' is no option that changes");
    refused(good, {"--animate", "focus"}, 2, "NAME=FILE");
    const Arguments keys{"--animate", "focus=" + csv, "--interpolate"};
    refused("1,2\n2,4\n", keys, 1, "has no --focus for frame 3");
    refused("1,2\n3,inf\n", keys, 1, "--focus of frame 2: nothing lies between '2' and 'inf'");
    refused("1,2\n3,4\n", {"--animate", "focus=" + csv}, 1, "give every frame a line, or let --interpolate fill");
    refused("1,\"2,3\"\n3,\"3,4\"\n", {"--animate", "focus-at=" + csv, "--interpolate"}, 1,
            "--focus-at: '2.5,3.5' will not do");
    refused(good, {"--focus", "2", "--interpolate"}, 2, "--animate");
    const std::string unnumbered = depth_file(folder, "still.exr");
    check_refused(
        {"dof-masks", unnumbered, "--camera", shot.camera(), "-o", folder / "out/s.exr", "--animate", "focus=" + csv},
        2, "its name holds no frame");
}

TEST_CASE("sequences: frames between two lines have a value between theirs") {
    const Shot shot({1, 2, 3, 5});
    const std::string depths = shot.folder / "shot.####.exr", csv = shot.folder / "pull.csv";
    const auto check = [&](const std::string& text, const std::string& option,
                           const std::map<int, std::string>& values) {
        write(csv, text);
        check_done({"dof-masks", depths, "--camera", shot.camera(), "--animate", option + "=" + csv, "--interpolate",
                    "-o", shot.folder / "out/z.####.exr"});
        for (const auto& [frame, value] : values)
            CHECK(same(shot.result(frame, "coc"),
                       shot.alone({"dof-masks", "--" + option, value}, shot.file(frame), shot.camera(), "coc")));
    };
    check("1,1\n3,1.5\n5,inf\n", "focus", {{1, "1"}, {2, "1.25"}, {3, "1.5"}, {5, "inf"}});
    check("0,1\n5,1.25\n", "focus", {{1, "1.05"}, {2, "1.1"}, {3, "1.15"}, {5, "1.25"}});
    check("1,\"4,8\"\n5,\"8,28\"\n", "focus-at", {{2, "5,13"}, {3, "6,18"}});
}

TEST_CASE("sequences: a missing frame is an error, or left out") {
    const Shot shot({1, 2, 5, 6});
    const Folder& folder = shot.folder;
    fs::remove(shot.own_camera(5));
    const Arguments command{"linearize", folder / "shot.####.exr",  "--camera", folder / "cam.####.json",
                            "-o",        folder / "out/z.####.exr", "--frames", "0-6",
                            "--json"};
    Arguments one = command;
    one[7] = "1-3,6";
    const Outcome error = run(one);
    check_refused(error, 1, "shot.0003.exr: is not there, so that frame 3 cannot be done; --missing skip");
    CHECK(folder.results() == Names{"z.0001.exr", "z.0002.exr", "z.0006.exr"});

    const Outcome skip = check_done(joined(command, {"--missing", "skip"}));
    CHECK(Shot::frames_of(skip) == std::vector<int>{0, 1, 2, 3, 4, 5, 6});
    for (const nlohmann::json& line : Shot::lines(skip)) {
        const int frame = line["frame"];
        CHECK(line.contains("skipped") == (frame == 0 || (frame >= 3 && frame <= 5)));
        if (frame == 5) // its depth is there, but its camera is not
            CHECK(line["missing"] == shot.own_camera(5));
    }
    CHECK(folder.results() == Names{"z.0001.exr", "z.0002.exr", "z.0006.exr"});

    const Outcome none = run({"linearize", folder / "shot.####.exr", "--camera", shot.camera(), "-o",
                              folder / "out/z.####.exr", "--frames", "100-20000"});
    check_refused(none, 1, "shot.0100.exr: is not there, and none of the 19901 frames has all its files");
}

TEST_CASE("sequences: a camera that lacks what others have concerns its frames only, also the first") {
    const Shot shot({1, 2, 3});
    const Folder& folder = shot.folder;
    const auto lacking = [&](int frame, const std::string& key) {
        nlohmann::json camera = nlohmann::json::parse(Shot::camera_of(frame));
        camera.erase(key);
        write(shot.own_camera(frame), camera.dump());
    };
    const auto command = [&](const Arguments& what) {
        return run(joined(what, {folder / "shot.####.exr", "--camera", folder / "cam.####.json", "-o",
                                 folder / "out/z.####.exr", "--frames", "1-3"}));
    };
    lacking(1, "ao_distance");
    const Outcome first = command({"ssao"});
    CHECK(first.code == 1);
    CHECK(contains(first.err, "cam.0001.json has no \"ao_distance\""));
    CHECK(contains(first.err, "1 of 3 inputs failed: " + shot.file(1)));
    CHECK(folder.results() == Names{"z.0002.exr", "z.0003.exr"});
    lacking(1, "f_stop");
    const Outcome masks = command({"dof-masks", "--mask", "coc"});
    CHECK(masks.code == 1);
    CHECK(contains(masks.err, "cam.0001.json has no \"f_stop\""));
    for (const int frame : shot.frames)
        lacking(frame, "ao_distance");
    check_refused(command({"ssao"}), 2, "cam.####.json has no \"ao_distance\"");
}

TEST_CASE("sequences: what is wrong with the camera of a frame in the middle concerns this frame only") {
    const Shot shot({1, 2, 3});
    const Folder& folder = shot.folder;
    const Arguments command{"linearize", folder / "shot.####.exr", "--camera", folder / "cam.####.json",
                            "-o",        folder / "out/z.####.exr"};
    const auto refused = [&](const std::string& camera, const std::string& said) {
        INFO(said);
        write(shot.own_camera(2), camera);
        check_refused(command, 1, said);
        CHECK(folder.results() == Names{"z.0001.exr", "z.0003.exr"});
    };
    refused("{", "cam.0002.json");
    refused(R"({"width": 99, "height": 9, "perspective": {"fov_y_deg": 60}})", "shot.0002.exr");

    write(shot.own_camera(2), Shot::camera_of(2)); // pixels that are no numbers are invalid
    cv::Mat holes = Shot::depth_of(2);
    holes.rowRange(0, 4).setTo(std::numeric_limits<float>::quiet_NaN());
    depth_file(folder, Shot::numbered("shot", 2), holes);
    const Outcome nan = check_done(joined(command, {"--json"}));
    CHECK(Shot::lines(nan)[1]["invalid"] == 4 * width);
    depth_file(folder, Shot::numbered("shot", 2), ramp(20, 10)); // each frame has the size that it has
    check_done(command);
    CHECK(shot.result(2, "Z").size() == cv::Size(20, 10));
}

TEST_CASE("sequences: a file that is there is meant itself") {
    const Folder folder;
    const std::string camera = camera_file(folder);
    for (const std::string name : {"take#1.exr", "take%04d.exr", "take*.exr", "a@b.exr", "take[1].exr"}) {
        INFO(name);
        const std::string input = depth_file(folder, name), output = folder / ("out/" + name);
        check_done({"linearize", input, "--camera", camera, "-o", output});
        CHECK(folder.results() == Names{name}); // a single file goes into one of just this name
        fs::remove(output);
        fs::remove(input);
    }
    const std::string one = depth_file(folder, "one.1.exr");
    fs::copy_file(camera, folder / "cam#.json");
    write(folder / "cam1.json", "{");
    check_done({"linearize", one, "--camera", folder / "cam#.json", "-o", folder / "out/one.exr"});
}

TEST_CASE("sequences: wrong usage is told before anything is done") {
    const Shot shot;
    const Folder& folder = shot.folder;
    const std::string depths = folder / "shot.####.exr", still = depth_file(folder, "still.exr");
    const std::string out = folder / "out/z.####.exr";
    fs::create_directory(folder / "empty");
    const std::vector<std::tuple<Arguments, int, std::string>> cases{
        {{depths, "-o", folder / "out/z.exr"}, 2, "3 inputs cannot go into one file"},
        {{depths, "-o", folder / "out/z.####.jpg", "--frames", "1"}, 2, ".jpg is no type of result"},
        {{depths, "-o", folder / "out/z.####.png"}, 2, "z.0001.png: PNG holds 0 to 1 only"},
        {{depths, "-o", out, "--format", "tif"}, 2, "contradicts --format"},
        {{depths, "-o", depths}, 2, "is one of the files to read"},
        {{depths, depths, "-o", out}, 2, "would be written for"},
        {{depths, "-o", out, "--frames", "1-5z2"}, 2, "--frames: '1-5z2': '1-5z2' is no frames"},
        {{depths, "-o", out, "--frames", ""}, 2, "--frames"},
        {{depths, "-o", out, "--missing", "keep"}, 2, "error or skip"},
        {{shot.file(1), "-o", out, "--frames", "1"}, 2, "--frames: chooses from a sequence"},
        {{folder / "s*.exr", "-o", folder / "out/", "--frames", "1"}, 2, "more than one sequence"},
        {{shot.file(1), still, "-o", out}, 2, "still.exr: its name holds no frame, which -o"},
        {{folder / "shot.##.exr", "-o", out}, 1, "shot.##.exr: no frame of this name is there"},
        {{folder / "none.*", "-o", out}, 1, "none.*: stands for no image"},
        {{folder / "empty", "-o", out}, 1, "empty: stands for no image"},
        {{folder / "shot.####.exr", "-o", folder / "a.####.gif"}, 2, "a.####.gif: .gif is no type of result"},
    };
    for (const auto& [more, code, named] : cases) {
        INFO(named);
        check_refused(joined({"linearize", "--camera", shot.camera()}, more), code, named);
    }
    check_refused({"linearize", still, "--camera", folder / "cam.####.json", "-o", folder / "out/z.exr"}, 2,
                  "still.exr: its name holds no frame, which --camera");
    check_refused(
        {"ssao", still, "--camera", shot.camera(), "--normals", folder / "n.####.exr", "-o", folder / "out/z.exr"}, 2,
        "still.exr: its name holds no frame, which --normals");
    check_refused({"inspect", folder / "empty"}, 1, "is a folder");
    CHECK(folder.results().empty());
}
