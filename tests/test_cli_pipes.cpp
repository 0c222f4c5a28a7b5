// Raw frames through pipes: each result has the bits of the same frame done as a file. Other programs at the pipes' ends are sh, cat
// and, where it is installed, ffmpeg.
#include "program.hpp"

#include <fathom/picture.hpp>

#include <chrono>
#include <sys/stat.h>
#include <thread>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr int frames = 5;
constexpr std::size_t pixels = std::size_t{width} * height;

/// A command line of sh, in which "$@" is the program and its arguments.
Surroundings in_shell(const std::string& line) {
    return {.before = {"sh", "-c", line, "sh"}};
}

template <typename T>
std::string raw(const cv::Mat& image) {
    const auto* first = reinterpret_cast<const char*>(image.ptr<T>());
    return {first, first + image.total() * image.elemSize()};
}

/// Millimetres that move from frame to frame.
cv::Mat depth_of(int frame) {
    return filled<std::uint16_t>(width, height, [&](int x, int y) {
        return (x - 8 * frame) * (x - 8 * frame) + (y - 16) * (y - 16) < 60 ? 900 + 10 * x : 2500 + 7 * x + 3 * y;
    });
}

/// In OpenCV's order.
cv::Mat color_of(int frame) {
    return filled<cv::Vec3b>(width, height, [&](int x, int y) {
        return cv::Vec3b(static_cast<uchar>(5 * x), static_cast<uchar>(7 * y + frame), (x / 4 + y / 4) % 2 ? 230 : 20);
    });
}

cv::Mat rgb(const cv::Mat& bgr) {
    cv::Mat result(bgr.size(), bgr.type());
    cv::mixChannels(std::vector{bgr}, std::vector{result}, {0, 2, 1, 1, 2, 0});
    return result;
}

std::string numbered(const std::string& before, int frame, const std::string& after) {
    return before + "000" + std::to_string(frame) + after;
}

/// A shot as files and as streams.
struct Shot {
    Folder folder;
    const std::string depth = folder / "depth.raw", color = folder / "color.raw", out = folder / "out/frames.raw",
                      size = std::to_string(width) + "x" + std::to_string(height);
    const Arguments camera{"--preset", "kinect:fx=60,fy=60,cx=23.5,cy=15.5"};
    const Arguments blur = joined({"--circle", "9,14", "--quality", "fast"}, camera);

    Shot() {
        std::string depths, colors;
        for (int i = 1; i <= frames; ++i) {
            cv::imwrite(numbered(folder / "d.", i, ".png"), depth_of(i));
            cv::imwrite(numbered(folder / "c.", i, ".png"), color_of(i));
            depths += raw<uchar>(depth_of(i));
            colors += raw<uchar>(rgb(color_of(i)));
        }
        write(depth, depths);
        write(color, colors);
    }

    /// A run whose stdin is the depth and whose stdout is `out`.
    Outcome piped(const Arguments& arguments, const std::string& line = {}) const {
        fs::remove(out);
        return run(joined(arguments, {"--size", size}),
                   in_shell(line.empty() ? "cat '" + depth + "' | \"$@\" > '" + out + "'" : line));
    }
};

std::string line_without_newline(std::string text) {
    return text.ends_with('\n') ? text.substr(0, text.size() - 1) : text;
}

} // namespace

TEST_CASE("pipes: frames on stdin come out of stdout as they come out of files", "[pipes]") {
    const Shot shot;
    check_done(joined({"dof", shot.folder / "d.####.png", "--color", shot.folder / "c.####.png", "-o",
                       shot.folder / "blurred.####.png"},
                      shot.blur));
    std::string expected;
    for (int i = 1; i <= frames; ++i)
        expected += raw<uchar>(rgb(cv::imread(numbered(shot.folder / "blurred.", i, ".png"), cv::IMREAD_UNCHANGED)));
    REQUIRE(expected.size() == frames * pixels * 3);
    CHECK(expected != content(shot.color));

    // The picture as files, and as a second pipe.
    check_done(shot.piped(joined({"dof", "-", "--color", shot.folder / "c.####.png", "-o", "-"}, shot.blur)));
    CHECK(content(shot.out) == expected);
    const std::string fifo = shot.folder / "fifo";
    REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
    const std::string second = "cat '" + shot.color + "' > '" + fifo + "' & cat '" + shot.depth + "' | \"$@\" > '" +
                               shot.out + "'; code=$?; wait; exit $code";
    check_done(shot.piped(joined({"dof", "-", "--color", fifo, "-o", "-"}, shot.blur), second));
    CHECK(content(shot.out) == expected);
    check_done(shot.piped(joined({"dof", fifo, "--color", "-", "-o", "-"}, shot.blur),
                          "cat '" + shot.depth + "' > '" + fifo + "' & \"$@\" < '" + shot.color + "' > '" + shot.out +
                              "'; code=$?; wait; exit $code"));
    CHECK(content(shot.out) == expected);
    // One program that writes both, each picture before its depth, and neither fits into a pipe.
    constexpr std::size_t large = std::size_t{1280} * 960;
    write(shot.folder / "large.depth", std::string(3 * 2 * large, '\3'));
    write(shot.folder / "large.color", std::string(3 * 3 * large, '\100'));
    const auto part = [&](const char* name, int bytes) {
        return "dd status=none iflag=fullblock skip=$i count=1 bs=" + std::to_string(bytes * large) + " if='" +
               (shot.folder / (std::string("large.") + name)) + "'";
    };
    check_done(run(joined({"fog", "-", "--color", "/dev/fd/3", "-o", "-", "--density", "0.1", "--size", "1280x960",
                           "--preset", "kinect:fx=1000,fy=1000,cx=639.5,cy=479.5"},
                          {}),
                   in_shell("for i in 0 1 2; do " + part("color", 3) + " >&3; " + part("depth", 2) + "; done 3> '" +
                            fifo + "' | \"$@\" 3< '" + fifo + "' > '" + shot.out + "'")));
    CHECK(fs::file_size(shot.out) == 3 * 3 * large);
    // Depth as files, and results as files.
    check_done(shot.piped(joined({"dof", shot.folder / "d.####.png", "--color", "-", "-o", "-"}, shot.blur),
                          "\"$@\" < '" + shot.color + "' > '" + shot.out + "'"));
    CHECK(content(shot.out) == expected);
    const Outcome to_files = shot.piped(
        joined({"dof", "-", "--color", shot.folder / "c.####.png", "-o", shot.folder / "out/b.####.png", "--json"},
               shot.blur),
        "cat '" + shot.depth + "' | \"$@\"");
    check_done(to_files);
    CHECK(contains(to_files.out, "\"input\":\"standard input, frame 5\""));
    for (int i = 1; i <= frames; ++i)
        CHECK(content(numbered(shot.folder / "out/b.", i, ".png")) ==
              content(numbered(shot.folder / "blurred.", i, ".png")));
}

TEST_CASE("pipes: every raw format carries what it stands for", "[pipes]") {
    const Shot shot;
    const auto as_files = [&](const Arguments& arguments, const std::string& extension, const auto& frame_of) {
        check_done(
            joined(joined({arguments.front(), shot.folder / "d.####.png", "-o", shot.folder / ("r.####" + extension)},
                          shot.camera),
                   {arguments.begin() + 1, arguments.end()}));
        std::string all;
        for (int i = 1; i <= frames; ++i)
            all += frame_of(numbered(shot.folder / "r.", i, extension));
        return all;
    };
    const auto as_pipe = [&](const Arguments& arguments) {
        check_done(shot.piped(joined(joined({arguments.front(), "-", "-o", "-"}, shot.camera),
                                     {arguments.begin() + 1, arguments.end()})));
        return content(shot.out);
    };
    const auto floats_in = [](const std::string& file) { // behind the header
        const std::string bytes = content(file);
        return bytes.substr(bytes.find('\n') + 1);
    };
    const std::string z = as_pipe({"linearize"});
    CHECK(z.size() == frames * pixels * 4);
    CHECK(z == as_files({"linearize"}, ".npy", floats_in));
    CHECK(as_pipe({"normals"}) == as_files({"normals"}, ".npy", floats_in));
    CHECK(as_pipe({"unproject"}) == as_files({"unproject"}, ".npy", floats_in));
    CHECK(as_pipe({"dof-masks", "--mask", "near", "--circle", "9,14"}) ==
          as_files({"dof-masks", "--mask", "near", "--circle", "9,14"}, ".npy", floats_in));
    const auto codes_in = [](const std::string& file) { return raw<uchar>(cv::imread(file, cv::IMREAD_UNCHANGED)); };
    const Arguments occlusion{"ssao", "--radius", "0.3", "--quality", "fast"};
    CHECK(as_pipe(joined(occlusion, {"--format", "gray16le"})) == as_files(occlusion, ".png", codes_in));
    CHECK(as_pipe({"linearize", "--format", "gray16le", "--png-scale", "0.2"}) ==
          as_files({"linearize", "--png-scale", "0.2"}, ".png", codes_in));

    // Floats as depth, and light as a picture.
    const std::string floats = shot.folder / "z.raw", light = shot.folder / "light.raw";
    write(floats, z);
    std::string lights;
    for (int i = 1; i <= frames; ++i)
        lights += raw<uchar>(rgb(read_picture(numbered(shot.folder / "c.", i, ".png")).color));
    write(light, lights);
    const Arguments of_floats{"--preset", "kinect:fx=60,fy=60,cx=23.5,cy=15.5,encoding=view-z,scale=1"};
    const Arguments fog = joined({"fog", "--density", "0.2"}, of_floats);
    check_done(joined({"linearize", shot.folder / "d.####.png", "-o", shot.folder / "z.####.npy"}, shot.camera));
    const auto succeeds = [](const Outcome& outcome) { // with doubts about floats that count millimetres
        INFO(outcome.err);
        CHECK(outcome.code == 0);
    };
    succeeds(run(joined(
        fog, {shot.folder / "z.####.npy", "--color", shot.folder / "c.####.png", "-o", shot.folder / "f.####.npy"})));
    std::string expected;
    for (int i = 1; i <= frames; ++i)
        expected += floats_in(numbered(shot.folder / "f.", i, ".npy"));
    const std::string fifo = shot.folder / "fifo";
    REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
    succeeds(shot.piped(
        joined(fog, {"-", "-o", "-", "--depth-format", "grayf32le", "--color", fifo, "--color-format", "rgbf32le"}),
        "cat '" + light + "' > '" + fifo + "' & \"$@\" < '" + floats + "' > '" + shot.out +
            "'; code=$?; wait; exit $code"));
    CHECK(content(shot.out) == expected);
    succeeds(shot.piped(joined(fog, {"-", "-o", "-", "--depth-format", "grayf32le", "--color",
                                     shot.folder / "c.####.png", "--format", "rgbf32le"}),
                        "\"$@\" < '" + floats + "' > '" + shot.out + "'"));
    CHECK(content(shot.out) == expected);
}

TEST_CASE("pipes: relative depth, animated values and warnings go with them", "[pipes]") {
    const Shot shot;
    const std::string focus = shot.folder / "blur.csv";
    write(focus, "frame,blur_px\n1,2\n5,8\n");
    const Arguments blur{"--relative",       "low-is-near",   "--focus-at", "40,4", "--animate",
                         "blur-px=" + focus, "--interpolate", "--quality",  "fast"};
    const Outcome files = run(joined(
        {"dof", shot.folder / "d.####.png", "--color", shot.folder / "c.####.png", "-o", shot.folder / "r.####.png"},
        blur));
    CHECK(files.code == 0);
    std::string expected;
    for (int i = 1; i <= frames; ++i)
        expected += raw<uchar>(rgb(cv::imread(numbered(shot.folder / "r.", i, ".png"), cv::IMREAD_UNCHANGED)));
    const Outcome piped = shot.piped(joined({"dof", "-", "--color", shot.folder / "c.####.png", "-o", "-"}, blur));
    CAPTURE(piped.err);
    CHECK(piped.code == 0);
    CHECK(content(shot.out) == expected);
    CHECK(contains(piped.err, "warning: standard input, frame 1: its values take ")); // of all 16 bits
    CHECK_FALSE(contains(piped.err, "/proc"));
}

TEST_CASE("pipes: a frame of one depth, as after a fade to black, is in focus and ends nothing", "[pipes]") {
    const Shot shot;
    const std::string black = shot.folder / "black.raw", as_rgb = shot.folder / "black-rgb.raw";
    std::string codes, bytes;
    for (int i = 1; i <= frames; ++i) {
        const cv::Mat depth = depth_of(i) * (i == 2 || i == frames ? 0 : 16);
        const cv::Mat eight = converted(depth, CV_8U, 1 / 256.0);
        codes += raw<uchar>(depth);
        bytes += raw<uchar>(merged({eight, eight, eight}));
    }
    write(black, codes);
    write(as_rgb, bytes);
    const Arguments blur{"dof",       "-",   "--color",    shot.folder / "c.####.png",
                         "-o",        "-",   "--relative", "high-is-near",
                         "--blur-px", "40",  "--focus-at", "40,4",
                         "--quality", "fast"};
    for (const auto& [file, more] : {std::pair{black, Arguments{}}, {as_rgb, {"--depth-format", "rgb24"}}}) {
        const Outcome outcome = shot.piped(joined(blur, more), "\"$@\" < '" + file + "' > '" + shot.out + "'");
        INFO(outcome.err);
        CHECK(outcome.code == 0);
        CHECK(contains(outcome.err, "warning: standard input, frame 2: all its values are the same"));
        const std::string got = content(shot.out), sharp = content(shot.color);
        REQUIRE(got.size() == sharp.size());
        for (int i = 0; i < frames; ++i) {
            const auto frame = [&](const std::string& of) { return of.substr(i * pixels * 3, pixels * 3); };
            CHECK((frame(got) == frame(sharp)) == (i == 1 || i == frames - 1));
        }
    }
}

TEST_CASE("pipes: what is wrong is told in one line, and whole frames come out before it", "[pipes]") {
    const Shot shot;
    const auto refused = [&](const Arguments& arguments, int code, const std::string& named,
                             const std::string& line = {}) {
        const Outcome outcome = shot.piped(joined(arguments, shot.camera), line);
        INFO(named);
        check_refused(outcome, code, named);
        return outcome;
    };
    const Arguments plain{"linearize", "-", "-o", "-"};
    const std::string cut = shot.folder / "cut.raw";
    write(cut, content(shot.depth).substr(0, 2 * pixels * 2 + 100));
    refused(plain, 1, "standard input: ends within frame 3, of which 100 of 3072 bytes are there; check --size",
            "\"$@\" < '" + cut + "' > '" + shot.out + "'");
    CHECK(content(shot.out).size() == 2 * pixels * 4);
    refused(plain, 1, "ends before the first frame", "\"$@\" < /dev/null > '" + shot.out + "'");
    const std::string less = shot.folder / "less.raw";
    write(less, content(shot.color).substr(0, 3 * pixels * 3));
    const std::string fifo = shot.folder / "fifo";
    REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
    const Arguments blur{"dof", "-", "--color", fifo, "-o", "-", "--circle", "9,14", "--quality", "fast"};
    const std::string both = "cat '" + less + "' > '" + fifo + "' & cat '" + shot.depth + "' | \"$@\" > '" + shot.out +
                             "'; code=$?; wait; exit $code";
    refused(blur, 1, "fifo: has no frame 4, but standard input has", both);
    CHECK(content(shot.out).size() == 3 * pixels * 3);
    refused({"dof", shot.folder / "d.####.png", "--color", "-", "-o", "-", "--circle", "9,14", "--quality", "fast"}, 1,
            "standard input: has no frame 4, but there are 5 depth images",
            "\"$@\" < '" + less + "' > '" + shot.out + "'");
    refused({"dof", shot.folder / "d.000[1-3].png", "--color", "-", "-o", "-", "--circle", "9,14", "--quality", "fast"},
            1, "more frames than there are depth images (3)", "\"$@\" < '" + shot.color + "' > '" + shot.out + "'");
    std::string broken = content(shot.depth); // a frame that fails ends the stream, which would lose its step
    std::fill_n(broken.begin() + static_cast<std::ptrdiff_t>(2 * pixels), 2 * pixels, '\0');
    write(shot.folder / "broken.raw", broken);
    const Outcome failed =
        shot.piped(joined(plain, shot.camera), "\"$@\" < '" + (shot.folder / "broken.raw") + "' > '" + shot.out + "'");
    CHECK(failed.code == 1);
    CHECK(contains(failed.err, "fathom: standard input, frame 2: "));
    CHECK(line_without_newline(failed.err).ends_with("fathom: standard output: ends before frame 2, which failed"));
    CHECK(content(shot.out).size() == pixels * 4);

    for (const Arguments& other : {Arguments{"--json"}, {"--log", "-"}, {"--progress", "openjd"}})
        refused(joined(plain, other), 2, "stdout has the pixels, which " + other.front());
    refused(joined(plain, {"--resume"}), 2, "--resume: does not go with pipes");
    refused(joined(plain, {"--missing", "skip"}), 2, "--missing: nobody knows");
    refused(joined(plain, {"--frames", "1-3"}), 2, "--frames: a pipe has the frames that come");
    refused({"linearize", "-", "-o", shot.folder / "out/z.exr"}, 2, "give a name with ####");
    refused({"linearize", "-", shot.folder / "d.0001.png", "-o", "-"}, 2, "is a pipe, beside which");
    refused({"dof", "-", "--color", "-", "-o", "-", "--circle", "9,14"}, 2, "standard input is named twice");
    refused({"dof", "-", "--color", shot.folder / "c.0001.png", "-o", "-", "--circle", "9,14"}, 2, "--color: '");
    refused({"ssao", "-", "--radius", "1", "--normals", fifo, "-o", "-"}, 2, "--normals: ");
    refused({"ssao", "-", "--radius", "1", "-o", "-", "--confidence", "-"}, 2, "only -o goes to standard output");
    refused({"dof-masks", "-", "--circle", "9,14", "-o", "-"}, 2, "choose one with --mask");
    refused({"normals", "-", "-o", "-", "--format", "gray16le"}, 2, "it is rgbf32le");
    refused({"linearize", "-", "-o", "-", "--format", "gray16le"}, 2, "give --png-scale");
    refused({"linearize", shot.folder / "d.####.png", "-o", shot.folder / "out/z.####.exr"}, 2,
            "--size: is that of a pipe's frames");
    check_refused({"linearize", "-", "-o", "-", "--preset", "kinect", "--size", "48x"}, 2, "as in 1920x1080");
    check_refused(run(joined({"linearize", "-", "-o", shot.folder / "out/z.####.exr"}, shot.camera)), 2,
                  "give --size WIDTHxHEIGHT");
    const Arguments relative{"dof-masks",      "-",           "-o",        "-", "--mask",     "coc",
                             "--relative",     "low-is-near", "--blur-px", "9", "--focus-at", "4,4",
                             "--depth-format", "grayf32le"};
    check_refused(shot.piped(relative), 2, "--relative-range: missing");
    CHECK(shot.folder.results() == std::vector<std::string>{"frames.raw"});
}

TEST_CASE("pipes: a closed output ends the run, and memory does not grow with the number of frames", "[pipes]") {
    const Shot shot;
    const auto start = std::chrono::steady_clock::now();
    const std::string code = shot.folder / "code";
    const Outcome closed = shot.piped(joined({"linearize", "-", "-o", "-"}, shot.camera),
                                      "{ cat /dev/zero | tr '\\0' '\\3' | { \"$@\"; echo $? > '" + code +
                                          "'; } } | head -c 100000 > '" + shot.out + "'");
    CHECK(closed.err.empty());
    CHECK(content(code) == "141\n");
    CHECK(content(shot.out).size() == 100000);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(60));
    const auto outcome_of = [&](int many) {
        const std::string input = shot.folder / "large.raw";
        std::ofstream all(input, std::ios::binary);
        for (int i = 0; i < many; ++i)
            all << std::string(std::size_t{640} * 480 * 2, '\3');
        all.close();
        return run(joined({"linearize", "-", "-o", "-", "--size", "640x480", "--memory", "20M"}, shot.camera),
                   in_shell("exec \"$@\" < '" + input + "' > /dev/null"));
    };
    const Outcome few = outcome_of(10), many = outcome_of(150);
    CHECK((few.code == 0 && many.code == 0));
    std::cout << "pipes: " << few.peak_mib << " MiB for 10 frames, " << many.peak_mib << " MiB for 150\n";
    CHECK(many.peak_mib < few.peak_mib + 24); // 150 frames take 300 MiB as they come out
}

TEST_CASE("pipes: ffmpeg writes them and reads them", "[pipes][ffmpeg]") {
    if (run({}, {.before = {"sh", "-c", "ffmpeg -version > /dev/null 2>&1", "sh"}}).code != 0) {
        WARN("skipped: ffmpeg is not installed");
        return;
    }
    const Shot shot;
    const std::string video = shot.folder / "blurred.mkv", depths = shot.folder / "depth.mkv",
                      colors = shot.folder / "color.mkv", ffmpeg = "ffmpeg -v error -nostdin";
    const auto shell = [](const std::string& line) {
        INFO(line);
        CHECK(run({}, {.before = {"bash", "-c", line, "bash"}}).code == 0);
    };
    shell(ffmpeg + " -i '" + (shot.folder / "d.%04d.png") + "' -c:v ffv1 -pix_fmt gray16le '" + depths + "'");
    shell(ffmpeg + " -i '" + (shot.folder / "c.%04d.png") + "' -c:v ffv1 -pix_fmt bgr0 '" + colors + "'");
    const Outcome outcome =
        run(joined({"dof", "-", "--color", "/dev/fd/3", "--size", shot.size, "-o", "-"}, shot.blur),
            {.before = {
                 "bash", "-c",
                 "set -o pipefail; " + ffmpeg + " -i '" + depths + "' -f rawvideo -pix_fmt gray16le - | \"$@\" 3< <(" +
                     ffmpeg + " -i '" + colors + "' -f rawvideo -pix_fmt rgb24 -) | " + ffmpeg.substr(0, 15) +
                     " -f rawvideo -pix_fmt rgb24 -s " + shot.size + " -i - -c:v ffv1 -pix_fmt bgr0 '" + video + "'",
                 "bash"}});
    check_done(outcome);
    shell(ffmpeg + " -i '" + video + "' -f rawvideo -pix_fmt rgb24 '" + (shot.folder / "decoded.raw") + "'");
    check_done(shot.piped(joined({"dof", "-", "--color", shot.folder / "c.####.png", "-o", "-"}, shot.blur)));
    CHECK(content(shot.out).size() == frames * pixels * 3);
    CHECK(content(shot.folder / "decoded.raw") == content(shot.out)); // FFV1 loses nothing
}
