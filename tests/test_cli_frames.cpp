// The program on many frames: what it prints and writes does not depend on what overlaps, a bad frame ends itself only, and it
// tells how far it is.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <csignal>
#include <regex>

#include <sys/ioctl.h>

using namespace fathom::test;

namespace {

std::string numbered(int number, const std::string& extension = ".exr") {
    return "f" + std::to_string(100 + number) + extension;
}

// Inputs that differ, in their order.
std::vector<std::string> make_shot(const Folder& folder, int count, const std::string& extension = ".exr") {
    std::vector<std::string> files;
    for (int i = 0; i < count; ++i) {
        cv::Mat depth = ramp();
        depth.row(0).setTo(0.5f + 0.01f * static_cast<float>(i));
        files.push_back(depth_file(folder, numbered(i, extension), depth));
    }
    return files;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(line);
    return lines;
}

std::string without_times(const std::string& text) {
    return std::regex_replace(text, std::regex("[0-9]+ ms|\"[a-z_]*seconds\":[-0-9.e]+"), "time");
}

std::string cut_short(const std::string& file) {
    return content(file).substr(0, content(file).size() / 2);
}

// How many threads of a process work, or would if they had a core. Whether they get one depends on what else runs.
int working_threads(pid_t process) {
    int working = 0;
    std::error_code ended;
    for (fs::directory_iterator each("/proc/" + std::to_string(process) + "/task", ended), last; !ended && each != last;
         each.increment(ended)) {
        const std::string status = content(each->path() / "stat"); // number (name) state ...
        const std::size_t name_end = status.rfind(") ");
        working += name_end != std::string::npos && status[name_end + 2] == 'R';
    }
    return working;
}

// Threads, on average: one that wakes another works on for a moment, which other programs make longer. 0.03 on an idle machine,
// and 0.7 or more where nothing limits the threads.
constexpr double beside_threads = 0.3;

} // namespace

TEST_CASE("program frames: no more threads work at once than --threads says") {
    const Folder folder;
    for (int i = 0; i < 12; ++i)
        depth_file(folder, numbered(i, ".pfm"), ramp(1280, 720));
    const std::string camera = camera_file(folder);
    for (const Arguments& what : {Arguments{"ssao", "--radius", "0.2"}, Arguments{"linearize"}})
        for (int threads = 1; threads < std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 2, 5);
             ++threads) {
            const Arguments all = joined(what, {folder / "f1##.pfm", "--camera", camera, "-o", folder / "out/",
                                                "--quiet", "--threads", std::to_string(threads)});
            Run running(all);
            double samples = 0, too_many = 0;
            for (; running.is_running(); ++samples) {
                too_many += std::max(0, working_threads(running.process()) - threads);
                std::this_thread::sleep_for(std::chrono::microseconds(300));
            }
            check_done(running.outcome());
            INFO(what.front() << " --threads " << threads);
            CHECK(too_many <= beside_threads * samples);
            std::cout << what.front() << " --threads " << threads << ": " << too_many / samples << " more, in "
                      << samples << " samples\n";
        }
}

TEST_CASE("program frames: there may be more threads than cores") {
    const Folder folder;
    make_shot(folder, 3);
    check_done({"linearize", folder / "f1##.exr", "--camera", camera_file(folder), "-o", folder / "out/", "--threads",
                std::to_string(2 * std::thread::hardware_concurrency() + 2)});
}

TEST_CASE("program frames: lines, warnings and bytes are those of frames done in turn") {
    const Folder folder, in_turn;
    const std::vector<std::string> shot = make_shot(folder, 24);
    cv::Mat gaps = ramp();
    gaps.rowRange(0, height / 2).setTo(2.f); // no depth buffer holds that: a warning
    depth_file(folder, numbered(5), gaps);
    depth_file(folder, numbered(17), gaps);
    write(shot[9], cut_short(shot[9]));
    const std::string report = GENERATE("", "--json");
    Arguments arguments = joined({"ssao", "--camera", camera_file(folder), "--radius", "1"}, shot);
    if (!report.empty())
        arguments.push_back(report);
    const Outcome both = run(joined(arguments, {"-o", folder / "out/"}));
    const Outcome turn = run(joined(arguments, {"-o", in_turn / "out/", "--memory", "1K", "--threads", "1"}));
    CHECK(both.code == 1);
    CHECK(turn.code == 1);
    CHECK(both.err == turn.err);
    CHECK(lines_of(both.err).size() == 4); // two warnings, an error, the list of the failed
    const auto same_folder = [&](const std::string& text) {
        return std::regex_replace(without_times(text), std::regex(in_turn / "out"), folder / "out");
    };
    CHECK(same_folder(both.out) == same_folder(turn.out));
    CHECK(lines_of(both.out).size() == (report.empty() ? 23 : 24));
    CHECK(folder.results().size() == 23);
    CHECK(folder.results() == in_turn.results());
    for (const std::string& name : folder.results())
        CHECK(content(folder / ("out/" + name)) == content(in_turn / ("out/" + name)));
    if (report == "--json")
        for (const std::string& line : lines_of(both.out)) {
            const auto read = nlohmann::json::parse(line);
            if (read.at("input") == shot[9]) { // what stderr says
                CHECK(contains(both.err, read.at("error").get<std::string>() + "\n"));
                CHECK(read.size() == 2);
                continue;
            }
            for (const char* key : {"read_seconds", "compute_seconds", "write_seconds"})
                CHECK(read.at(key).get<double>() > 0);
        }
}

TEST_CASE("program frames: a bad frame in the middle fails alone, and is listed at the end") {
    constexpr int count = 9, bad = 4;
    const Folder folder;
    const std::vector<std::string> shot = make_shot(folder, count);
    struct Case {
        const char* what;
        std::function<void(const std::string&)> damage;
        const char* told;
    };
    const Case cases[] = {
        {"missing", [](const std::string& file) { fs::remove(file); }, "there is no such file"},
        {"empty", [](const std::string& file) { write(file, ""); }, "is empty"},
        {"truncated", [](const std::string& file) { write(file, cut_short(file)); }, "exr"},
        {"no image", [](const std::string& file) { write(file, "not found (404)"); }, "exr"},
        {"another size",
         [](const std::string& file) {
             fathom::write_image(file, ramp(width / 2, height), {.channels = {"Z"}, .png_scale = {}});
         },
         "24"},
        {"only NaN",
         [](const std::string& file) {
             const cv::Mat nothing(height, width, CV_32FC1, cv::Scalar::all(std::nan("")));
             fathom::write_image(file, nothing, {.channels = {"Z"}, .png_scale = {}});
         },
         "no pixel has a depth"},
        {"another channel",
         [](const std::string& file) {
             fathom::write_image(file, cv::Mat(height, width, CV_32FC2, cv::Scalar::all(1)),
                                 {.channels = {"A.left", "A.right"}, .png_scale = {}});
         },
         "channel"},
    };
    const std::string camera = camera_file(folder, R"(, "width": 48, "height": 32)");
    for (const Case& each : cases) {
        INFO(each.what);
        fs::remove_all(folder / "out");
        fs::create_directory(folder / "out");
        each.damage(shot[bad]);
        const Outcome outcome = run(joined({"linearize", "--camera", camera, "-o", folder / "out/"}, shot));
        INFO(outcome.err);
        CHECK(outcome.code == 1);
        const std::vector<std::string> told = lines_of(outcome.err);
        REQUIRE(told.size() == 2);
        CHECK(contains(told[0], shot[bad]));
        CHECK(contains(told[0], each.told));
        CHECK(told[1] == "fathom: 1 of 9 inputs failed: " + shot[bad]);
        std::vector<std::string> expected;
        for (int i = 0; i < count; ++i)
            if (i != bad)
                expected.push_back(numbered(i));
        CHECK(folder.results() == expected);
    }
}

TEST_CASE("program frames: a frame with some NaN is done, and a bad picture fails its frame") {
    const Folder folder;
    const std::vector<std::string> shot = make_shot(folder, 4);
    cv::Mat gap = ramp();
    gap.at<float>(3, 5) = std::numeric_limits<float>::quiet_NaN();
    depth_file(folder, numbered(1), gap);
    fs::create_directory(folder / "color");
    for (int i = 0; i < 4; ++i)
        fathom::write_color(folder / ("color/" + numbered(i)), cv::Mat(height, width, CV_32FC3, cv::Scalar::all(0.5)));
    fathom::write_color(folder / ("color/" + numbered(2)), cv::Mat(height, width / 2, CV_32FC3, cv::Scalar::all(0.5)));
    fs::remove(folder / ("color/" + numbered(3)));
    const Outcome outcome = run(joined({"fog", "--camera", camera_file(folder), "--color", folder / "color",
                                        "--density", "0.1", "-o", folder / "out/"},
                                       shot));
    INFO(outcome.err);
    CHECK(outcome.code == 1);
    CHECK(folder.results() == std::vector<std::string>{numbered(0), numbered(1)});
    const std::vector<std::string> told = lines_of(outcome.err);
    REQUIRE(told.size() == 3);
    CHECK(contains(told[0], folder / ("color/" + numbered(2))));
    CHECK(contains(told[0], "same ratio of width to height"));
    CHECK(contains(told[1], folder / ("color/" + numbered(3))));
    CHECK(told[2] == "fathom: 2 of 4 inputs failed: " + shot[2] + ", " + shot[3]);
}

TEST_CASE("program frames: a camera's mistake is told once, with the first frame") {
    const Folder folder;
    std::vector<std::string> shot = make_shot(folder, 12);
    fs::remove(shot[0]);
    const std::string camera = folder / "camera.json";
    write(camera, R"({"perspective": {"fov_y_deg": 60, "aspect": 0.6667, "near": 0.5, "far": 100}})");
    const Outcome outcome = run(joined({"linearize", "--camera", camera, "-o", folder / "out/"}, shot));
    CHECK(outcome.code == 1);
    const std::vector<std::string> told = lines_of(outcome.err);
    INFO(outcome.err);
    REQUIRE(told.size() == 3);
    CHECK(contains(told[0], shot[0]));
    CHECK(told[1].starts_with("fathom: warning: " + camera));
    CHECK(told[2].starts_with("fathom: 1 of 12 inputs failed"));
}

TEST_CASE("program frames: a frame that has no place is told, and the others are done") {
    const Folder folder;
    make_shot(folder, 12);
    write(folder / "out/103", "is in the way of a folder");
    const Outcome outcome =
        run({"linearize", folder / "f1##.exr", "--camera", camera_file(folder), "-o", folder / "out/1%02d/z.exr"});
    CHECK(outcome.code == 1);
    CHECK(lines_of(outcome.out).size() == 11);
}

TEST_CASE("program frames: a long list of failed frames is cut") {
    const Folder folder;
    std::vector<std::string> shot;
    for (int i = 0; i < 13; ++i)
        shot.push_back(folder / numbered(i));
    const Outcome outcome = run(joined({"linearize", "--camera", camera_file(folder), "-o", folder / "out/"}, shot));
    CHECK(outcome.code == 1);
    const std::vector<std::string> told = lines_of(outcome.err);
    REQUIRE(told.size() == 14);
    CHECK(told.back().starts_with("fathom: 13 of 13 inputs failed: " + shot[0] + ", " + shot[1]));
    CHECK(told.back().ends_with(shot[9] + " and 3 more"));
}

TEST_CASE("program frames: --progress openjd prints what a session understands") {
    const Folder folder;
    std::vector<std::string> shot = make_shot(folder, 4);
    fs::remove(shot[2]);
    const Outcome outcome = run(
        joined({"linearize", "--camera", camera_file(folder), "-o", folder / "out/", "--quiet", "--progress", "openjd"},
               shot));
    CHECK(outcome.code == 1);
    const std::vector<std::string> lines = lines_of(outcome.out);
    REQUIRE(lines.size() == 8);
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(lines[2 * i] == "openjd_progress: " + std::to_string(25 * (i + 1)) + ".0");
        CHECK(lines[2 * i + 1].starts_with("openjd_status: " + std::to_string(i + 1) + " of 4  "));
    }
    CHECK(lines.back().ends_with("0:00 left"));
}

TEST_CASE("program frames: a size of memory is a number and a unit") {
    const Folder folder;
    const Arguments arguments{"linearize", depth_file(folder, "a.exr"), "--camera", camera_file(folder),
                              "-o",        folder / "out/a.exr",        "--memory"};
    for (const char* good : {"1", "64K", "1.5M", "2G", "1T"})
        CHECK(usage_refusal(joined(arguments, {good})).empty());
    for (const char* bad : {"0", "G", "-1G", "2X", "1e30G", "nan", "inf", "2GG"})
        check_refused(joined(arguments, {bad}), 2, "--memory");
}

TEST_CASE("program frames: a line of progress on a terminal, which leaves the lines alone") {
    const Folder folder;
    const std::vector<std::string> shot = make_shot(folder, 5);
    const std::string kind = GENERATE("TERM=xterm", "TERM=dumb");
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    REQUIRE(terminal >= 0);
    REQUIRE(grantpt(terminal) == 0);
    REQUIRE(unlockpt(terminal) == 0);
    const int other_end = open(ptsname(terminal), O_RDWR | O_NOCTTY);
    const winsize size{24, 60, 0, 0};
    REQUIRE(ioctl(other_end, TIOCSWINSZ, &size) == 0);
    const Surroundings on_terminal{
        .before = {"env", kind, "sh", "-c", std::string(R"(exec "$@" 2>)") + ptsname(terminal), "sh"}};
    const Outcome outcome =
        run(joined({"linearize", "--camera", camera_file(folder), "-o", folder / "out/"}, shot), on_terminal);
    CHECK(outcome.code == 0);
    CHECK(lines_of(outcome.out).size() == 5);
    close(other_end); // reading ends where nobody can write any more
    std::string shown;
    std::array<char, 4096> part{};
    for (ssize_t length = 0; (length = read(terminal, part.data(), part.size())) > 0;)
        shown.append(part.data(), static_cast<std::size_t>(length));
    close(terminal);
    if (kind == "TERM=dumb") {
        CHECK(shown.empty());
        return;
    }
    const std::regex bar("[1-5] of 5  [0-9.e+]+ frames/s  [0-9:]+ left");
    CHECK(std::distance(std::sregex_iterator(shown.begin(), shown.end(), bar), std::sregex_iterator()) == 5);
    CHECK(shown.ends_with("\r\x1b[K"));
    CHECK(!contains(shown, '\n'));
}

TEST_CASE("program frames: a second signal ends the run at once") {
    const Folder folder;
    const std::string input = depth_file(folder, "depth.exr", ramp(960, 640));
    Arguments arguments{"ssao",     "--camera", camera_file(folder), "--radius", "5", "--quality",
                        "accurate", "-o",       folder / "out"};
    for (int i = 0; i < 200; ++i) {
        arguments.push_back(folder / numbered(i));
        fs::create_symlink(input, arguments.back());
    }
    const int signal = GENERATE(SIGINT, SIGTERM);
    Run running(arguments);
    for (int i = 0; i < 6000 && folder.results().empty(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    running.send(signal);
    for (int i = 0; i < 20; ++i) { // within the frame in work; two signals at once would count as one
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        running.send(signal);
    }
    const Outcome outcome = running.outcome();
    CHECK(outcome.code == 128 + signal);
    CHECK(outcome.err.empty()); // killed by it, without a word
}
