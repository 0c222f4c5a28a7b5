// The program as a person uses it: what it writes, what it says, its exit codes, and that no input makes it worse than
// one line on stderr.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <csignal>

#include <sys/stat.h>

using namespace fathom::test;

TEST_CASE("program: --quiet and --json say what they promise") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png"),
                      output = folder / "out/z.exr";
    const Outcome quiet = check_done({"linearize", input, "--camera", camera, "-o", output, "--quiet"});
    CHECK(quiet.out.empty());
    const Outcome json = check_done({"linearize", input, "--camera", camera, "-o", output, "--json"});
    CHECK(json.out.starts_with(R"({"input":")" + input + R"(","output":")" + output +
                               R"(","width":48,"height":32,"channels":["Z"],"seconds":)"));
    const auto seconds = [&](const std::string& key) {
        const std::size_t at = json.out.find('"' + key + "\":");
        REQUIRE(at != std::string::npos);
        return std::stod(json.out.substr(at + key.size() + 3));
    };
    CHECK(seconds("read_seconds") + seconds("compute_seconds") + seconds("write_seconds") ==
          Approx(seconds("seconds")));
    CHECK(seconds("write_seconds") > 0);
}

TEST_CASE("program: inspect tells what the file holds and what the camera makes of it") {
    const Folder folder;
    const std::string camera = camera_file(folder);
    cv::Mat depth = ramp();
    depth.at<float>(0, 0) = NAN;
    depth.at<float>(0, 1) = INFINITY;
    depth.at<float>(0, 2) = -INFINITY;
    const std::string input = depth_file(folder, "depth.exr", depth);
    const Outcome plain = check_done({"inspect", input});
    for (const char* text :
         {"48 × 32", "float32, channel Z", "Z (float)", "50 %", "NaN           1\n", "-Inf          1\n"})
        CHECK(contains(plain.out, text));

    CHECK(run({"inspect", input, "--camera", camera}).out.find("81.79° × 60°") !=
          std::string::npos); // 2 atan(1.5 tan 30°)
    const Outcome json = check_done({"inspect", input, "--camera", camera, "--json"});
    for (const char* text :
         {R"("storage":"float32")", R"("channels":[{"name":"Z","type":"float"}])", R"("nan":1,"inf":1,"minus_inf":1)",
          R"("form":"reciprocal")", R"("background":1,"invalid":3)", R"("precision_of":"32-bit float")"})
        CHECK(contains(json.out, text));
    CHECK(std::count(json.out.begin(), json.out.end(), '\n') == 1);
}

TEST_CASE("program: inspect prints a channel's name without what would control a terminal") {
    const Folder folder;
    const std::string input = folder / "depth.exr";
    fathom::write_image(input, ramp(), {.channels = {"\x1b[31mZ\xff"}});
    const Outcome outcome = check_done({"inspect", input});
    CHECK(contains(outcome.out, " [31mZ\\xff (float)"));
    for (const char byte : {'\x1b', '\xff'})
        CHECK(!contains(outcome.out, byte));
    const Outcome refused = run({"inspect", input, "--channel", "A"});
    check_refused(refused, 1, "it has [31mZ\\xff");
    CHECK(!contains(refused.err, '\x1b'));
}

TEST_CASE("program: inspect tells the camera's range and precision, without a surface and without a device") {
    const Folder folder;
    const std::string camera = camera_file(folder, R"(, "depth_bits": 16)");
    const std::string input = depth_file(folder, "depth.exr", cv::Mat(height, width, CV_32FC1, cv::Scalar(1)));
    const Surroundings bare{.before = {"env", "OCL_ICD_VENDORS=/nonexistent"}};
    const auto range = [&](const std::string& place) {
        const Outcome outcome = check_done({"inspect", input, "--camera", camera, "--json"}, bare);
        return nlohmann::json::parse(outcome.out)["camera"]["range"][place];
    };
    const auto z = [](double code) { return 1 / (2 + code / 65535 * (0.01 - 2)); };
    CHECK(range("near")["z"].get<double>() == Approx(0.5));
    CHECK(range("near")["spacing"].get<double>() == Approx(z(1) - z(0)));
    CHECK(range("middle")["stored"].get<double>() == 32767);
    CHECK(range("middle")["z"].get<double>() == Approx(z(32767)));
    CHECK(range("far")["z"].get<double>() == Approx(100));
    CHECK(range("far")["spacing"].get<double>() == Approx(z(65535) - z(65534)));
    CHECK(range("far")["error_bound"].get<double>() == Approx(z(65535) - z(65534.5)));

    const Outcome plain = check_done({"inspect", input, "--camera", camera}, bare);
    CHECK(contains(plain.out, "\nrange: "));
    write(camera, R"({"perspective": {"fov_y_deg": 60, "aspect": 1.5}, "encoding": "view-z"})");
    CHECK(range("near").is_null());
    CHECK(run({"inspect", input, "--camera", camera}, bare).out.find("no end") != std::string::npos);
}

TEST_CASE("program: devices marks the default") {
    const Outcome list = run({"devices"}), json = run({"devices", "--json"});
    check_done(list);
    check_done(json);
    CHECK(contains(list.out, "* 0"));
    CHECK(contains(json.out, R"("default":true)"));
}

TEST_CASE("program: --help has an example and the exit codes for every command") {
    const std::string overview = run({"--help"}).out;
    for (const std::string command :
         {"", "linearize", "unproject", "normals", "ssao", "dof-masks", "dof", "inspect", "devices"}) {
        INFO(command);
        CHECK((command.empty() || contains(overview, "\n  " + command + "  ")));
        const Outcome outcome = check_done(command.empty() ? Arguments{"--help"} : Arguments{command, "--help"});
        for (const char* text : {"Usage: fathom", "Example:\n  fathom ", "Exit codes:", "130"})
            CHECK(contains(outcome.out, text));
    }
    CHECK(run({"--version"}).out.starts_with("fathom "));
}

TEST_CASE("program: --help of an operation has its own options, and --help-all those of every operation") {
    const std::string own = run({"fog", "--help"}).out, all = run({"fog", "--help-all"}).out;
    for (const char* option : {"--density X REQUIRED", "--color IMAGE REQUIRED", "--camera FILE", "DEPTH"}) {
        INFO(option);
        CHECK(contains(own, option));
        CHECK(contains(all, option));
    }
    for (const char* option : {"--frames RANGE", "--compression ", "--strict", "--device DEVICE", "--channel NAME"}) {
        INFO(option);
        CHECK(!contains(own, option));
        CHECK(contains(all, option));
    }
}

// Bad input: one line, the right exit code, nothing left behind

TEST_CASE("program: refuses a missing file, a directory, a pipe, a device and what is no image") {
    const Folder folder;
    fs::create_directory(folder / "folder.exr");
    REQUIRE(mkfifo((folder / "pipe.png").c_str(), 0666) == 0);
    write(folder / "text.tif", "no image");
    for (const std::string& input : {folder / "nowhere.exr", folder / "folder.exr", folder / "pipe.png",
                                     std::string("/dev/null"), folder / "text.tif"}) {
        check_refused({"linearize", input, "--camera", camera_file(folder), "-o", folder / "out/z.exr"}, 1, input);
        check_refused({"inspect", input}, 1, input);
    }
    CHECK(folder.results().empty());
}

TEST_CASE("program: refuses an output that cannot be written") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png");
    const auto try_output = [&](const std::string& output, const std::string& named) {
        check_refused({"linearize", input, "--camera", camera, "-o", output}, 1, named);
    };
    try_output(input + "/z.exr", input + "/z.exr");                 // its parent is a file
    try_output(folder / "nowhere/z.exr", folder / "nowhere/z.exr"); // its parent is not there
    try_output(camera + "/new/", camera + "/new");                  // the folder cannot be made
    CHECK(folder.results().empty());
    fs::create_directories(folder / "out/depth.exr"); // the target is a directory
    try_output(folder / "out/", folder / "out/depth.exr");
    CHECK(folder.results() == std::vector<std::string>{"depth.exr"});
}

TEST_CASE("program: a full disk behind stdout is an error") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png");
    const Surroundings full{.out = "/dev/full"};
    check_refused(run({"inspect", input}, full), 1, "standard output");
    check_refused(run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"}, full), 1,
                  "standard output");
    const std::string reason = "standard output: cannot be written: No space left on device";
    for (const Arguments& command : {Arguments{"--version"}, {"--help"}, {"linearize", "--help"}, {"devices"}})
        check_refused(run(command, full), 1, reason);
}

TEST_CASE("program: closed streams are errors where they are needed") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png");
    const auto closed = [](const std::string& stream) {
        return Surroundings{.before = {"bash", "-c", "exec \"$@\" " + stream, "bash"}};
    };
    for (const Arguments& command : {Arguments{"--version"}, {"linearize", input, "--camera", camera, "-o", "-"}})
        check_refused(run(command, closed(">&-")), 1, "standard output: cannot be written: Bad file descriptor");
    const Arguments frames{"linearize", "-", "--size",         "8x8",      "--camera", camera,
                           "-o",        "-", "--depth-format", "grayf32le"};
    check_refused(run(frames, closed("<&-")), 1, "standard input: ");
    CHECK(run({"inspect", input, "--camera", camera}, closed("<&- 2>&-")).code == 0);
}

TEST_CASE("program: when nobody reads what it prints, it stops after the frames in work, without a line") {
    const Folder folder;
    const std::string camera = camera_file(folder);
    Arguments command{"linearize"};
    constexpr std::size_t frames = 40;
    for (std::size_t i = 0; i < frames; ++i)
        command.push_back(depth_file(folder, "depth" + std::to_string(i) + ".png"));
    command = joined(command, {"--camera", camera, "-o", folder / "out", "--log", folder / "log", "--threads", "1"});
    // The reader has ended before the program starts. `exec` keeps the process, so that its exit code is the program's.
    const Surroundings unread{.before = {"bash", "-c", "exec 3> >(exec true); wait $!; exec \"$@\" >&3 3>&-", "bash"}};
    const Outcome outcome = run(command, unread);
    CHECK(outcome.code == 141);
    CHECK(outcome.err.empty());
    const std::vector<std::string> results = folder.results();
    CHECK(results.size() < frames);
    const std::string log =
        content(folder / "log"); // begins with a line of the run; a frame's is written after it is printed
    CHECK(static_cast<std::size_t>(std::ranges::count(log, '\n')) == 1 + results.size());
    for (const std::string& name : results) {
        CHECK(name.starts_with("depth"));
        CHECK(!fathom::read_depth(folder / ("out/" + name)).values.empty());
    }
    CHECK(run({"presets"}, unread).code == 141);
}

TEST_CASE("program: no such device") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png");
    for (const std::string device : {"99", "no such name"})
        check_refused({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr", "--device", device}, 3,
                      device);
    const Surroundings bare{.before = {"env", "OCL_ICD_VENDORS=/nonexistent"}};
    check_refused(run({"linearize", input, "--camera", camera, "-o", folder / "out/z.exr"}, bare), 3,
                  "no OpenCL device");
    check_refused(run({"devices"}, bare), 3,
                  "no OpenCL device is found in /nonexistent, the only place where OCL_ICD_VENDORS");
    CHECK(run({"inspect", input, "--camera", camera}, bare).code == 0);
    CHECK(folder.results().empty());
}

TEST_CASE("program: wrong usage is told before anything is done") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png"), out = folder / "out/z.exr";
    const Arguments good{"linearize", input, "--camera", camera, "-o", out};
    const auto with = [&](const Arguments& more) { return joined(good, more); };
    const std::vector<std::pair<Arguments, std::string>> cases{
        {{}, "no command"},
        {{"linearise", input}, "did you mean linearize?"},
        {{"linearize"}, "DEPTH"},
        {{"linearize", input, "-o", out}, "--camera"},
        {{"linearize", input, "--preset", "kinekt:fx=40", "-o", out}, "the nearest is \"kinect\""},
        {{"linearize", input, "--camera", camera}, "--output"},
        {{"linearize", input, "--camra", camera, "-o", out}, "did you mean --camera?"},
        {with({"--backgroud=nan"}), "did you mean --background?"},
        {with({"--background", "black"}), "inf, decode or nan"},
        {with({"--threads", "0"}), "--threads"},
        {with({"--threads", "1.5"}), "--threads"},
        {with({"--png-scale", "nan"}), "--png-scale"},
        {with({"--quiet", "--json"}), "--quiet"},
        {with({"--format", "tif"}), "--format"},
        {with({"--camera", camera}), "--camera"},
        {{"linearize", input, "--camera", camera, "-o", folder / "out/z.jpg"}, ".jpg"},
        {{"linearize", input, "--camera", camera, "-o", folder / "out/z.ply"}, ".ply"},
        {{"linearize", input, "--camera", camera, "-o", folder / "out/z"}, "without extension"},
        {{"linearize", input, "--camera", camera, "-o", folder / "out/z.png"}, "--png-scale"},
        {{"linearize", input, "--camera", camera, "-o", ""}, "-o"},
        {{"unproject", input, "--camera", camera, "-o", out, "--origin", "1,2,3"}, "--space"},
        {{"unproject", input, "--camera", camera, "-o", out, "--space", "world", "--origin", "1,2"}, "X,Y,Z"},
        {{"unproject", input, "--camera", camera, "-o", out, "--space", "world", "--origin", "1,2,inf"}, "X,Y,Z"},
        {{"unproject", input, "--camera", camera, "-o", out, "--space", "view", "--origin", "1,2,3"}, "--origin"},
        {{"normals", input, "--camera", camera, "-o", folder / "out/n.ply"}, ".ply"},
        {{"normals", input, "--camera", camera, "-o", folder / "out/n.png", "--png-scale", "1"}, "--png-scale"},
        {{"inspect", input, input}, "too many"},
    };
    for (const auto& [arguments, named] : cases)
        check_refused(arguments, 2, named);
    check_refused(run({"linearize", input, "-o", out}), 2, "--camera");
    check_refused({"normals", input, "--camera", camera, "-o", out, "--space", "world"}, 1, "view matrix");
    const Arguments fog{"fog", input, "--camera", camera, "--color", depth_file(folder, "colour.pfm"), "-o", out};
    check_refused(fog, 2, "--density");
    check_refused(joined(fog, {"--density", "1", "--fog-color", "1,2"}), 2, "three finite numbers");
    CHECK(folder.results().empty());
}

TEST_CASE("program: refuses results that would replace each other or an input") {
    const Folder folder;
    fs::create_directory(folder / "b");
    const std::string camera = camera_file(folder), other = depth_file(folder, "b/depth.exr");
    const std::string input = depth_file(folder, "depth.exr"), before = content(input);
    fs::create_symlink(input, folder / "out/link.exr");
    fs::create_symlink("second.exr", folder / "out/first.exr");
    fs::create_symlink(folder / "out/first.exr", folder / "b/third.exr");
    const std::vector<std::pair<Arguments, std::string>> cases{
        {{input, "-o", folder / "out/first.exr", "--log", folder / "out/second.exr"}, "out/first.exr"},
        {{input, "-o", folder / "b/third.exr", "--log", folder / "out/second.exr"}, "b/third.exr"},
        {{input, other, "-o", folder / "out"}, "out/depth.exr"},
        {{input, input, "-o", folder / "out"}, "out/depth.exr"},
        {{input, other, "-o", folder / "out/z.exr"}, "out/z.exr"},
        {{input, other, "-o", camera}, camera},
        {{input, "-o", input}, input},
        {{input, "-o", folder / "b/../depth.exr"}, "depth.exr"},
        {{input, "-o", folder / "out/link.exr"}, "link.exr"},
        {{input, "-o", folder / ""}, input},
    };
    for (const auto& [more, named] : cases)
        check_refused(joined({"linearize", "--camera", camera}, more), 2, named);
    check_refused(run({"ssao", input, "--camera", camera, "--radius", "1", "-o", folder / "out/first.exr",
                       "--bent-normal", folder / "out/second.exr"}),
                  2, "out/second.exr");
    fs::create_symlink("circle.exr", folder / "out/circle.exr");
    check_refused({"linearize", "--camera", camera, input, "-o", folder / "out/circle.exr"}, 1,
                  "out/circle.exr: is a link that leads to itself");
    CHECK(content(input) == before);
    CHECK(folder.results() == std::vector<std::string>{"circle.exr", "first.exr", "link.exr"});
}

TEST_CASE("program: --json has a line for each input whose camera cannot be read") {
    const Folder folder;
    const std::string a = depth_file(folder, "a.png"), b = depth_file(folder, "b.png"), none = folder / "none.json";
    for (const Arguments& command :
         {Arguments{"linearize"}, {"ssao"}, {"dof", "--color", folder / "", "--focus", "2", "--f-stop", "2"}}) {
        const Outcome outcome = run(joined(command, {a, b, "--camera", none, "-o", folder / "out/", "--json"}));
        CHECK(outcome.code == 1);
        CHECK(contains(outcome.err, none + ": there is no such file"));
        const std::string error = R"(","error":")" + none + R"(: there is no such file; check the path"})";
        CHECK(outcome.out == R"({"input":")" + a + error + "\n" + R"({"input":")" + b + error + "\n");
    }
    CHECK(folder.results().empty());
}

TEST_CASE("program: a name with line breaks still makes one line") {
    const Folder folder;
    check_refused({"linearize", folder / "a\nb.png", "--camera", camera_file(folder), "-o", folder / "out/z.exr"}, 1,
                  "a b.png");
}

TEST_CASE("program: an interrupt ends between two files, with whole results only") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png", ramp(480, 320));
    Arguments arguments{"linearize", "--camera", camera, "-o", folder / "out"};
    constexpr std::size_t count = 2000; // seconds of work
    for (std::size_t i = 0; i < count; ++i) {
        arguments.push_back(folder / ("depth" + std::to_string(i) + ".png"));
        fs::create_symlink(input, arguments.back());
    }
    const int signal = GENERATE(SIGINT, SIGTERM);
    Run running(arguments);
    for (int i = 0; i < 6000 && !fs::exists(folder / "out/depth0.exr"); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    running.send(signal);
    const Outcome outcome = running.outcome();
    check_refused(outcome, 128 + signal, "interrupted");
    const std::vector<std::string> results = folder.results();
    CHECK(!results.empty());
    CHECK(results.size() < count);
    for (const std::string& result : results) {
        CHECK(result.ends_with(".exr"));
        CHECK_NOTHROW(fathom::read_depth(folder / ("out/" + result)));
    }
}

TEST_CASE("program: an interrupt while kernels are compiled is no failure of theirs") {
    const Folder folder;
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png", ramp(48, 32)),
                      next = depth_file(folder, "next.png", ramp(48, 32)); // which an interrupt leaves out
    const Arguments arguments{"ssao", input, next, "--camera", camera, "--radius", "1", "-o", folder / "out"};
    CHECK(run(arguments).code == 0); // PoCL keeps the kernels: the other runs take the time of the next one
    const auto start = std::chrono::steady_clock::now();
    CHECK(run(arguments).code == 0);
    const auto whole = std::chrono::steady_clock::now() - start;
    constexpr int moments = 9;
    int interrupted = 0;
    for (int i = 1; i < moments; ++i) {
        Run running(arguments);
        std::this_thread::sleep_for(whole * i / moments);
        running.send(SIGTERM);
        const Outcome outcome = running.outcome();
        INFO(outcome.err);
        interrupted += outcome.code != 0;
        CHECK((outcome.code == 0 || outcome.code == 128 + SIGTERM));
        CHECK((outcome.err.empty() || outcome.err.starts_with("fathom: interrupted")));
    }
    CHECK(interrupted > 0);
}

TEST_CASE("program: a name that is too long is told so, and so are too many open files and a disk that fails") {
    const Folder folder;
    const std::string depth = depth_file(folder, "depth.png", ramp(48, 32)), camera = camera_file(folder);
    const std::string file = folder / (std::string(300, 'n') + ".exr");
    check_refused({"linearize", depth, "--camera", camera, "-o", file}, 1,
                  "cannot be written: File name too long; choose a shorter name");
    if (is_missing({"strace", "-o", "/dev/null"}, "strace is not installed or not permitted"))
        return;
    // LeakSanitizer does not work under strace.
    const auto where = [&](const std::string& injected) {
        return Surroundings{.before = {"env", "ASAN_OPTIONS=detect_leaks=0", "strace", "-f", "-qq", "-o", "/dev/null",
                                       "-P", depth, "-e", "inject=" + injected}};
    };
    check_refused(
        run({"linearize", depth, "--camera", camera, "-o", folder / "out/z.exr"}, where("openat:error=EMFILE")), 1,
        "cannot be read: Too many open files; raise the limit of open files (ulimit -n)");
    for (const char* call : {"openat", "read"}) // inspect opens it once more to look for a camera
        for (const char* when : {"1", "2+"})
            check_refused(run({"inspect", depth}, where(std::string(call) + ":error=EIO:when=" + when)), 1,
                          "Input/output error; check the disk");
}

TEST_CASE("program: an image that is too wide is named, not its camera") {
    const Folder folder;
    const std::string camera = folder / "camera.json", depth = depth_file(folder, "wide.pfm", ramp(130'001, 1));
    write(camera,
          R"({"orthographic": {"left": -130001, "right": 130001, "bottom": -1, "top": 1, "near": 1, "far": 2}})");
    check_refused({"ssao", depth, "--camera", camera, "--radius", "1", "-o", folder / "out/ao.exr"}, 1,
                  "wide.pfm: an image of 130001 x 1 pixels: at most 130000 in a row or column; crop it or split it");
}

namespace {

/// A run of linearize with other variables of the environment: "-u", "HOME" takes one away.
struct Linearize {
    Folder folder;
    Arguments arguments{"linearize", depth_file(folder, "depth.png", ramp(48, 32)),
                        "--camera",  camera_file(folder),
                        "-o",        folder / "out/z.exr"};

    Outcome with(const Arguments& variables, const Arguments& before = {}) const {
        return run(arguments, {.before = joined(joined(before, {"env"}), variables)});
    }
};

std::size_t entries(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

} // namespace

TEST_CASE("program: PoCL has a folder of its own where there is no home, and nobody else writes into it") {
    const Linearize linearize;
    const Folder& folder = linearize.folder;
    fs::create_directory(folder / "tmp");
    const std::string tmp = "TMPDIR=" + folder / "tmp", strace_log = folder / "strace.log";
    const bool pocl_was_there = fs::exists("/tmp/pocl"); // PoCL's own idea
    const auto with = [&](const Arguments& variables) {
        Arguments all = joined({"env", "-u", "POCL_CACHE_DIR", "-u", "XDG_CACHE_HOME"}, variables);
        all.push_back(tmp);
        check_done({"devices"}, {.before = all});
        CHECK(entries(folder / "tmp") == 0); // removed at the end
    };
    with({"-u", "HOME"});
    with({"HOME=/proc/nope"});
    with({"HOME=/proc"});
    CHECK(fs::exists("/tmp/pocl") == pocl_was_there);
    // An empty variable is none, and one that is set and bad stays refused.
    fs::create_directory(folder / "home");
    with({"POCL_CACHE_DIR=", "HOME=" + folder / "home"});
    CHECK(entries(folder / "home/.cache/pocl/kcache") > 0);
    check_refused(linearize.with({"POCL_CACHE_DIR=/proc/nope", tmp}), 3, "/proc/nope, where nothing can be written");
    const Arguments trace{"strace", "-f", "-e", "trace=mkdir,chmod", "-o", strace_log};
    if (is_missing(trace, "there is no strace"))
        return;
    check_done(linearize.with({"-u", "POCL_CACHE_DIR", "-u", "XDG_CACHE_HOME", "-u", "HOME", tmp}, trace));
    CHECK(entries(folder / "tmp") == 0);
    CHECK(contains(content(strace_log), folder / "tmp/fathom-kernels-"));
    CHECK(contains(content(strace_log), ", 0700) = 0"));
}

TEST_CASE("program: without a linker PoCL runs no kernel, and one line says what is missing") {
    const Linearize linearize;
    const Folder& folder = linearize.folder;
    fs::create_directory(folder / "kernels");
    fs::create_directory(folder / "bin");
    const Arguments usual{"POCL_CACHE_DIR=" + folder / "kernels"};
    const auto without = [&](const Arguments& arguments) {
        return run(arguments, {.before = joined({"env"}, joined(usual, {"PATH=" + folder / "bin"}))});
    };
    const std::string line = "no folder of PATH holds \"ld\"; install the package binutils";
    check_refused(without(linearize.arguments), 3, line);
    CHECK(folder.results().empty());
    check_done(linearize.with(usual));
}

TEST_CASE("program: a folder of compiled kernels goes with a process that signals end") {
    const Folder folder;
    fs::create_directory(folder / "tmp");
    const std::string camera = camera_file(folder), input = depth_file(folder, "depth.png", ramp(48, 32));
    Run running(
        {"ssao", input, "--camera", camera, "--radius", "1", "-o", folder / "out"},
        {.before = {"env", "-u", "POCL_CACHE_DIR", "-u", "XDG_CACHE_HOME", "-u", "HOME", "TMPDIR=" + folder / "tmp"}});
    for (int i = 0; i < 3000 && entries(folder / "tmp") == 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(100)); // kernels are being compiled
    running.send(SIGTERM);
    running.send(SIGINT); // the first may only ask
    const Outcome outcome = running.outcome();
    CHECK(outcome.code != 0);
    CHECK(entries(folder / "tmp") == 0);
}

TEST_CASE("program: want of room is not called want of a device") {
    const Linearize linearize;
    const Arguments little{"sh", "-c", R"(ulimit -v 200000 && exec "$@")", "sh"};
    if (!is_missing(little, "the address space cannot be limited here")) // as under a sanitizer
        check_refused(linearize.with({}, little), 1, "less than 256 MiB of memory are left");
    const Arguments alone{"unshare", "--user", "--map-root-user", "--mount"};
    if (is_missing(alone, "no new mount namespace is permitted here (unshare --mount)"))
        return;
    const std::string full = linearize.folder / "full";
    fs::create_directory(full);
    for (const auto& [mounted, kernels] : // no room for another folder, and none for a kernel
         {std::pair{R"(mount -t tmpfs -o nr_inodes=3 none "$0" && touch "$0/a" "$0/b")", full + "/kernels"},
          {R"(mount -t tmpfs -o size=64k none "$0")", full}}) {
        const std::string command = mounted + (" && POCL_CACHE_DIR=" + kernels) + R"( exec "$@")";
        const Outcome outcome = linearize.with({}, joined(alone, {"sh", "-c", command, full}));
        check_refused(outcome, 1, kernels + ", where nothing can be written (No space left on device)");
        CHECK(!contains(outcome.err, "device answers"));
        CHECK(linearize.folder.results().empty());
    }
}
