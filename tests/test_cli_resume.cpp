// --resume makes what is not finished, and nothing else; --log says what was done. The truth is a run that nobody interrupted.
// tests/faults/run kills runs, and resumes them.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

using namespace fathom::test;

namespace {

using Names = std::vector<std::string>;
using Frames = std::set<int>;

std::string numbered(const std::string& name, int frame, const std::string& extension) {
    return fmt::format("{}.{:04}{}", name, frame, extension);
}

std::vector<nlohmann::json> lines_of(const std::string& text) {
    std::vector<nlohmann::json> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(nlohmann::json::parse(line));
    return lines;
}

// Frames that a run of --json kept, or made.
Frames frames_of(const Outcome& outcome, bool kept) {
    Frames frames;
    for (const nlohmann::json& line : lines_of(outcome.out))
        if (line.value("kept", false) == kept)
            frames.insert(line.at("frame").get<int>());
    return frames;
}

// Depths, normals and cameras that differ from frame to frame. The files of a PFM all have the same size.
struct Shot {
    Folder folder;
    int count;
    std::string log = folder / "run.jsonl";

    explicit Shot(int frames) : count(frames) {
        for (int frame = 1; frame <= count; ++frame) {
            write_depth(frame, 0.01 * frame);
            write_normals(frame, 0.8f);
            write_camera(frame, 50 + frame);
        }
        write_radii(0.2);
    }

    void write_depth(int frame, double more) const {
        const auto bars = [&](int x, int) { return 0.5 + 0.1 * (x / 6 % 2) + more; }; // that stand before a wall
        fathom::write_image(depth_of(frame), filled(width, height, bars));
    }
    void write_normals(int frame, float z) const {
        const cv::Mat normals(height, width, CV_32FC3, cv::Scalar(0, std::sqrt(1 - z * z), z));
        fathom::write_image(normals_of(frame), normals);
    }
    void write_camera(int frame, int angle) const {
        write(camera_of(frame),
              fmt::format(R"({{"perspective": {{"fov_y_deg": {}, "aspect": 1.5, "near": 0.5, "far": 100}}}})", angle));
    }
    void write_radii(double of_second) const {
        std::string text;
        for (int frame = 1; frame <= count; ++frame)
            text += fmt::format("{},{}\n", frame, frame == 2 ? of_second : 0.1);
        write(folder / "radius.csv", text);
    }

    std::string depth_of(int frame) const { return folder / numbered("shot", frame, ".pfm"); }
    std::string normals_of(int frame) const { return folder / numbered("n", frame, ".pfm"); }
    std::string camera_of(int frame) const { return folder / numbered("cam", frame, ".json"); }
    std::string result(int frame, const std::string& name = "ao", const std::string& extension = ".exr") const {
        return folder / ("out/" + numbered(name, frame, extension));
    }

    /// Two results for each frame; everything that can change does.
    Arguments command(const std::string& extension = ".exr") const {
        return {"ssao",         folder / "shot.####.pfm",
                "--camera",     folder / "cam.####.json",
                "--normals",    folder / "n.####.pfm",
                "--animate",    "radius=" + folder / "radius.csv",
                "-o",           folder / ("out/ao.####" + extension),
                "--confidence", folder / "out/conf.####.pfm",
                "--json"};
    }
    Frames all() const {
        Frames frames;
        for (int frame = 1; frame <= count; ++frame)
            frames.insert(frame);
        return frames;
    }
    std::map<std::string, std::string> images() const { // and not the records, which have times
        std::map<std::string, std::string> contents;
        for (const auto& entry : fs::directory_iterator(folder / "out"))
            if (entry.path().extension() != ".json")
                contents[entry.path().filename().string()] = content(entry.path());
        return contents;
    }
};

// Beside a result.
std::string record_of(const std::string& result) {
    return content(result + ".fathom.json");
}

// A later time than any file has that a run made.
void touch(const std::string& file, std::chrono::hours later = std::chrono::hours(1)) {
    fs::last_write_time(file, fs::file_time_type::clock::now() + later);
}

} // namespace

TEST_CASE("resume: a frame is kept until something changes that makes it") {
    const Shot shot(3);
    const Frames none, all = shot.all(), second{2}, others{1, 3};
    const Arguments resume = joined(shot.command(), {"--resume", "--falloff", "0.5"});
    const auto check = [&](const std::string& what, const Frames& made, const Arguments& more = {}) {
        INFO(what);
        const Outcome outcome = check_done(joined(resume, more));
        CHECK(frames_of(outcome, false) == made);
        CHECK(frames_of(outcome, true).size() == all.size() - made.size());
        CHECK(shot.folder.results().size() == 3 * all.size()); // two results and a record, and no temporary file
    };
    // And makes it as a run does that finds nothing.
    const auto check_anew = [&](const std::string& what, const Frames& made) {
        check(what, made);
        const auto after = shot.images();
        fs::remove_all(shot.folder / "out");
        fs::create_directory(shot.folder / "out");
        check(what + ", from nothing", all);
        CHECK(shot.images() == after);
    };
    check("nothing is there", all);
    const auto made = fs::last_write_time(shot.result(2));
    check("all is there", none);
    CHECK(fs::last_write_time(shot.result(2)) == made);
    const std::string record = record_of(shot.result(2));
    CHECK(!contains(record, shot.folder / ""));
    CHECK(nlohmann::json::parse(record).at("values") == nlohmann::json{{"--radius", "0.2"}});
    CHECK(nlohmann::json::parse(record).at("options") == nlohmann::json{{"--falloff", {"0.5"}}});
    check("the machine's share changed", none, {"--threads", "1", "--memory", "1K", "--log", shot.log});
    shot.write_depth(2, 0.05);
    check_anew("an input changed", second);
    const auto time = fs::last_write_time(shot.depth_of(2));
    fs::last_write_time(shot.depth_of(2), time - std::chrono::hours(24));
    check("an older input took the place of one", second);
    touch(shot.depth_of(2));
    check("an input was touched", second);
    shot.write_normals(2, 0.6f);
    check_anew("a companion changed", second);
    shot.write_camera(2, 60);
    check_anew("a camera changed", second);
    shot.write_radii(0.4);
    check_anew("an animated value changed", second);
    shot.write_radii(0.40);
    check("an animated value is written in another way", none);
    const std::vector<std::pair<Arguments, bool>> options{
        {{"--slices", "3"}, true}, {{"--half"}, true}, {{"--strict"}, true}, {{"--device", "cpu"}, false}};
    for (const auto& [more, changes] : options) {
        check(more.front(), changes ? all : none, more);
        check("without " + more.front(), changes ? all : none);
    }
    Arguments spelled = resume;
    spelled.back() = "0.51";
    CHECK(frames_of(run(spelled), false) == all);
    check("and back", all);

    for (const std::string& file : {shot.result(2), shot.result(2, "conf", ".pfm"), shot.result(2) + ".fathom.json"}) {
        const std::string whole = content(file);
        write(file, whole.substr(0, whole.size() - 1));
        check("a file is shorter: " + file, second);
        write(file, "");
        check("a file is empty: " + file, second);
        fs::remove(file);
        check("a file is not there: " + file, second);
        if (file.ends_with(".json"))
            continue;
        touch(file);
        check("a result is another one: " + file, second);
    }
    Arguments fewer = resume;
    fewer.erase(fewer.begin() + 10, fewer.begin() + 12); // --confidence and its file
    REQUIRE(std::ranges::find(fewer, "--confidence") == fewer.end());
    CHECK(frames_of(run(fewer), false) == all);
    // A folder of results is an input, too.
    const Outcome shown = check_done({"show", shot.folder / "out", "--json"});
    CHECK(lines_of(shown.out).size() == 2 * all.size()); // and no record
}

TEST_CASE("resume: a record lies beside every type of result, and its files have the bytes of a run without one") {
    const Folder folder;
    const std::string depth = depth_file(folder, "d.exr"), camera = camera_file(folder);
    const std::string photograph = folder / "photo.jpg";
    cv::imwrite(photograph, cv::Mat(height, width, CV_8UC3, cv::Scalar(10, 150, 200)));
    const Arguments lens{"--focus", "1", "--f-stop", "0.05", "--sensor-mm", "36"};
    const std::vector<std::pair<Arguments, Names>> commands{
        {{"linearize", "--png-scale", "0.01"}, {".exr", ".png", ".tif", ".npy"}},
        {{"linearize", "--append"}, {".exr"}},
        {{"unproject"}, {".ply"}},
        {joined({"dof-masks"}, lens), {".exr"}},
        {{"fog", "--color", photograph, "--density", "0.1"}, {".jpg"}},
    };
    int number = 0;
    for (const auto& [command, extensions] : commands)
        for (const std::string& extension : extensions) {
            INFO(command.front() << " to " << extension);
            const std::string name = std::to_string(number++), plain = folder / ("plain" + name + extension);
            const std::string file = folder / ("out/" + name + extension);
            const auto is_made = [&](const std::string& out, const Arguments& more) {
                const Outcome outcome =
                    run(joined(joined(command, {depth, "--camera", camera, "-o", out, "--json"}), more));
                INFO(outcome.err);
                CHECK(outcome.code == 0);
                return !lines_of(outcome.out).at(0).value("kept", false);
            };
            is_made(plain, {});
            CHECK(is_made(file, {"--resume"}));
            CHECK(!is_made(file, {"--resume"}));
            CHECK(content(file) == content(plain));
            const std::string record = record_of(file);
            CHECK(nlohmann::json::parse(record).at("command") == command.front());
            CHECK(std::ranges::count(record, '\n') == 1);
            CHECK(!contains(record, folder / ""));
        }
}

TEST_CASE("resume: a record is no input where a shell's * names it, and one that cannot be written leaves no result") {
    const Folder folder;
    const std::string camera = camera_file(folder), depth = depth_file(folder, "d.exr");
    const Arguments command{"linearize", depth, "--camera", camera, "--resume", "-o"};
    check_done(joined(command, {folder / "out/z.exr"}));
    fs::copy(folder / "out/z.exr.fathom.json", depth + ".fathom.json");
    const Outcome shell =
        check_done({"linearize", depth, depth + ".fathom.json", "--camera", camera, "-o", folder / "more/", "--json"});
    CHECK(lines_of(shell.out).size() == 1);
    const Outcome refused = run(joined(command, {folder / ("out/" + std::string(245, 'n') + ".exr")}));
    check_refused(refused, 1, "fathom.json");
    CHECK(folder.results() == Names{"z.exr", "z.exr.fathom.json"});
}

TEST_CASE("resume: a full disk leaves nothing, and the frame fails") {
    const Folder folder;
    const std::string camera = camera_file(folder);
    cv::Mat noise(1536, 2048, CV_32FC1); // megabytes, packed or not: the driver's own files are smaller
    cv::randu(noise, 0.1, 0.9);
    depth_file(folder, "a.1.exr", cv::Mat(1536, 2048, CV_32FC1, cv::Scalar(0.5)));
    depth_file(folder, "a.2.exr", noise);
    for (const std::string extension : {".exr", ".png", ".npy"}) {
        INFO(extension);
        const Arguments command{"linearize", folder / "a.#.exr", "--camera", camera, "--resume",
                                "--json",    "--png-scale",      "0.01",     "-o",   folder / ("out/z.#" + extension)};
        check_done(command); // compiles the kernels, which are files, too
        fs::remove_all(folder / "out");
        fs::create_directory(folder / "out");
        const Outcome full = run(command, {.largest_file = 4 << 20});
        CHECK(full.code == 1);
        CHECK(contains(full.err, "free some space"));
        const Outcome again = check_done(command);
        if (extension == ".npy") // all of which have the same size
            CHECK(frames_of(again, true).empty());
        else
            CHECK(frames_of(again, true) == Frames{1});
        for (const std::string& name : folder.results())
            CHECK(!name.ends_with(".tmp"));
    }
}

TEST_CASE("log: a line for the run and one for each frame, in their order") {
    const Shot shot(5);
    fs::remove(shot.depth_of(3));
    write(shot.normals_of(4), "no image");
    const Arguments command = joined(shot.command(), {"--frames", "1-5", "--missing", "skip", "--log", shot.log});
    const Outcome outcome = run(command);
    CHECK(outcome.code == 1);
    auto lines = lines_of(content(shot.log));
    REQUIRE(lines.size() == 6);
    const auto& begin = lines[0].at("run");
    for (const char* key : {"command", "version", "kernels", "device", "host", "started", "process", "folder"})
        CHECK(begin.contains(key));
    CHECK(begin.at("command").size() == command.size() + 1);
    CHECK(begin.at("frames") == 5);
    const Names statuses{"made", "made", "left out", "failed", "made"};
    for (std::size_t i = 0; i < 5; ++i) {
        const auto& line = lines[i + 1];
        INFO(line.dump());
        CHECK(line.at("frame") == i + 1);
        CHECK(line.at("status") == statuses[i]);
        if (statuses[i] == "made")
            for (const char* key : {"input", "output", "confidence", "seconds", "read_seconds", "compute_seconds",
                                    "write_seconds", "invalid", "nearest", "farthest", "warnings", "camera"})
                CHECK(line.contains(key));
        CHECK(line.contains("error") == (statuses[i] == "failed"));
    }
    CHECK(lines[4].at("error").get<std::string>().find(shot.normals_of(4)) != std::string::npos);
    CHECK(lines[1].at("camera").at("perspective").at("fov_y_deg") == 51);

    run(joined(command, {"--resume"})); // is appended
    const std::string text = content(shot.log);
    CHECK(std::count(text.begin(), text.end(), '\n') == 12);
    run(joined(command, {"--resume"}));
    lines = lines_of(content(shot.log).substr(text.size()));
    CHECK(lines.at(1).at("status") == "kept");
    CHECK(lines.at(1).contains("camera"));
}

TEST_CASE("log: a file that cannot be one is told in a line") {
    const Folder folder;
    const std::string depth = depth_file(folder, "d.exr"), out = folder / "out/z.exr";
    const Arguments command{"linearize", depth, "--camera", camera_file(folder), "-o", out};
    check_refused(joined(command, {"--log", folder / "none/run.jsonl"}), 1, "none/run.jsonl: the log cannot");
    check_refused(joined(command, {"--log", folder / "out"}), 1, "out: the log cannot");
    check_refused(joined(command, {"--log", depth}), 1, "d.exr: is no log");
    const fs::path camera = folder / "other.json";
    std::ofstream(camera) << R"({"perspective": {"fov_y_deg": 60}})";
    check_refused(joined(command, {"--log", camera}), 1, "other.json: is no log");
    check_refused(joined(command, {"--log", out}), 2, "would be written for --log");
    CHECK(folder.results().empty());
    const Outcome full = run(joined(command, {"--log", "/dev/full"}));
    check_refused(full, 1, "/dev/full: the log cannot be written");
    CHECK(folder.results() == Names{"z.exr"}); // the frames are done all the same
    check_done(joined(command, {"--log", "/dev/stdout", "--quiet"}));
}

TEST_CASE("log: without a device there is none") {
    const Shot shot(2);
    check_refused(joined(shot.command(), {"--log", shot.log, "--device", "no such device"}), 3, "no such device");
    CHECK_FALSE(fs::exists(shot.log));
}

TEST_CASE("log: - is stdout, which nothing else may have") {
    const Shot shot(3);
    Arguments command = shot.command();
    std::erase(command, "--json");
    const fs::path here = fs::current_path();
    fs::current_path(shot.folder / ".");
    const Outcome outcome = run(joined(command, {"--log", "-"}));
    CHECK_FALSE(fs::exists("-"));
    fs::current_path(here);
    check_done(outcome);
    const auto lines = lines_of(outcome.out);
    REQUIRE(lines.size() == 4);
    CHECK(lines[0].contains("run"));
    for (std::size_t i = 1; i < 4; ++i)
        CHECK(lines[i].at("status") == "made");
    check_refused(joined(shot.command(), {"--log", "-"}), 2, "--log -: stdout has the log, which --json");
    check_refused(joined(command, {"--log", "-", "--progress", "openjd"}), 2,
                  "--log -: stdout has the log, which --progress openjd");
}
