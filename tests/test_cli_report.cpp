// fathom report: what the page holds. tests/report_page.py looks at it in a browser.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

using namespace fathom;
using namespace fathom::test;
using Json = nlohmann::json;

namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size())
        ++found;
    return found;
}

// The data of a page, read as a browser reads the element: up to the first </script.
Json data_of(const std::string& page) {
    const std::string begin = R"(<script type="application/json" id="data">)";
    const std::size_t from = page.find(begin) + begin.size();
    return Json::parse(page.substr(from, page.find("</script", from) - from));
}

cv::Mat decoded(const std::string& uri) {
    const std::string head = "data:image/jpeg;base64,",
                      digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    REQUIRE(uri.starts_with(head));
    std::vector<unsigned char> bytes;
    unsigned bits = 0, held = 0;
    for (const char c : uri.substr(head.size()))
        if (const std::size_t digit = digits.find(c); digit != std::string::npos) {
            held = held << 6 | static_cast<unsigned>(digit);
            bits += 6;
            if (bits >= 8)
                bytes.push_back(static_cast<unsigned char>(held >> (bits -= 8)));
        }
    return cv::imdecode(bytes, cv::IMREAD_COLOR);
}

// Results and inputs of a few frames; each result has as many invalid pixels as its number says.
struct Shot {
    Folder folder;

    explicit Shot(int frames = 3) {
        for (int frame = 1; frame <= frames; ++frame) {
            cv::Mat ao(height, width, CV_32FC1, cv::Scalar(0.25));
            for (int x = 0; x < frame; ++x)
                ao.at<float>(0, x) = nothing;
            write_image(ao_file(frame), ao, {.channels = {"AO"}});
            depth_file(folder, fmt::format("shot.{:04}.exr", frame));
        }
    }

    std::string ao_file(int frame) const { return folder / fmt::format("ao.{:04}.exr", frame); }
    std::string outputs() const { return folder / "ao.####.exr"; }
    std::string page() const { return folder / "out/report.html"; }

    Json run_line(const Arguments& command = {"fathom", "ssao", "shot.####.exr", "-o", "it's here/ao.exr"}) const {
        return {{"run", {{"command", command}, {"folder", folder / "."}, {"version", "9.9"}, {"device", "cpu"}}}};
    }
    Json frame_line(int frame, const std::string& status = "made") const {
        return {{"frame", frame},
                {"input", fmt::format("shot.{:04}.exr", frame)},
                {"output", fmt::format("ao.{:04}.exr", frame)},
                {"status", status},
                {"seconds", 0.5 * frame},
                {"read_seconds", 0.1},
                {"compute_seconds", 0.3},
                {"write_seconds", 0.1},
                {"invalid", frame},
                {"warnings", Json::array()},
                {"camera", {{"encoding", "view-z"}, {"view", {{1, 0}, {0, 1}}}}}};
    }
    std::string log(const std::vector<Json>& lines, const std::string& more = {}) const {
        std::string text;
        for (const Json& line : lines)
            text += line.dump() + '\n';
        write(folder / "run.jsonl", text + more);
        return folder / "run.jsonl";
    }
    Json report(const Arguments& more = {}) const {
        check_done(joined({"report", outputs(), "-o", page()}, more));
        return data_of(content(page()));
    }
};

} // namespace

TEST_CASE("a report holds what the images and the log say") {
    const Shot shot;
    Json warned = shot.frame_line(2);
    warned["warnings"] = {"mind the gap"};
    const Json data =
        shot.report({"--log", shot.log({shot.run_line(), shot.frame_line(1), warned, shot.frame_line(3)})});
    REQUIRE(data["frames"].size() == 3);
    CHECK(data["title"] == "ao.####.exr");
    CHECK(data["width"] == width);
    CHECK(data["height"] == height);
    CHECK(data["command"] == "ssao");
    CHECK(data["runs"][0]["command"] == R"(fathom ssao 'shot.####.exr' -o 'it'\''s here/ao.exr')");
    CHECK(data["runs"][0]["facts"]["version"] == "9.9");
    CHECK(data["cameras"].size() == 1);
    CHECK(Json::parse(data["cameras"][0].get<std::string>()) == shot.frame_line(1)["camera"]);
    CHECK(data["layers"]["output"]["name"] == "AO");
    CHECK(data["layers"]["input"]["name"] == "Z");
    CHECK(data["layers"]["output"]["ticks"][0]["label"] == "0");
    CHECK(data["layers"]["output"]["ticks"].back()["label"] == "1");
    CHECK(data["layers"]["output"]["colors"][0] == "#440154");
    CHECK(data["layers"]["output"]["colors"].back() == "#fde725");
    for (int i = 0; i < 3; ++i) {
        const Json& frame = data["frames"][static_cast<std::size_t>(i)];
        CHECK(frame["frame"] == i + 1);
        CHECK(frame["status"] == "made");
        CHECK(frame["seconds"] == 0.5 * (i + 1));
        CHECK(frame["stats"]["output"]["invalid"] == i + 1);
        CHECK(frame["stats"]["output"]["pixels"] == width * height);
        CHECK(frame["stats"]["output"]["p50"] == 0.25);
        long all = 0;
        for (const Json& bin : frame["stats"]["output"]["histogram"])
            all += bin.get<long>();
        CHECK(all == width * height - (i + 1));
        // 0.25 is viridis' color 64; a JPEG of one color keeps it but for a code or two.
        const cv::Mat picture = decoded(frame["images"]["output"]);
        REQUIRE(picture.size() == cv::Size(width, height));
        const auto& color = picture.at<cv::Vec3b>(height - 1, width - 1);
        CHECK(std::abs(color[2] - 0x3b) <= 3);
        CHECK(std::abs(color[1] - 0x52) <= 3);
        CHECK(std::abs(color[0] - 0x8b) <= 3);
        CHECK(decoded(frame["images"]["input"]).size() == cv::Size(width, height));
    }
    CHECK(data["frames"][1]["warnings"] == Json({"mind the gap"}));
}

TEST_CASE("a report needs no log") {
    const Shot shot;
    const Json alone = shot.report();
    CHECK(alone["has_log"] == false);
    CHECK_FALSE(alone["layers"].contains("input"));
    CHECK_FALSE(alone["frames"][0].contains("seconds"));
    const Json compared = shot.report({"--input", shot.folder / "shot.%04d.exr"});
    CHECK(compared["layers"]["input"]["name"] == "Z");
    CHECK(compared["frames"][2]["input"] == shot.folder / "shot.0003.exr");
    const Json all = shot.report({"--input", shot.folder / "ao.%04d.exr", "--depth", shot.folder / "shot.@@@@.exr"});
    CHECK(all["layers"]["depth"]["name"] == "Z");
    // A single result and a folder of them.
    check_done({"report", shot.ao_file(2), "-o", shot.page(), "--map", "grey"});
    const Json single = data_of(content(shot.page()));
    CHECK(single["frames"].size() == 1);
    CHECK(single["layers"]["output"]["colors"].back() == "#ffffff");
}

TEST_CASE("a report shows the picture that a logged command changed") {
    const Shot shot(2);
    for (int frame = 1; frame <= 2; ++frame)
        write_color(shot.folder / fmt::format("rgb.{:04}.exr", frame),
                    cv::Mat(height, width, CV_32FC3, cv::Scalar(1, 0, 0)));
    const Json data = shot.report(
        {"--log",
         shot.log({shot.run_line({"fathom", "dof", "shot.####.exr", "--color", "rgb.####.exr", "-o", "ao.####.exr"}),
                   shot.frame_line(1), shot.frame_line(2)})});
    CHECK(data["layers"]["input"]["name"] == "R, G, B");
    CHECK(data["layers"]["depth"]["name"] == "Z");
    const auto blue = decoded(data["frames"][0]["images"]["input"]).at<cv::Vec3b>(height / 2, width / 2);
    CHECK(blue[0] > 250);
    CHECK(blue[2] < 5);
}

TEST_CASE("a picture that is made smaller keeps its light and its invalid pixels") {
    const Folder folder;
    cv::Mat picture(20, 4000, CV_32FC3, cv::Scalar::all(0)); // shown 960 wide: 4 or 5 pixels become one
    for (int x = 0; x < picture.cols; x += 2)
        picture.col(x).setTo(cv::Scalar::all(1)); // half of the light is code 188
    for (int x = 3000; x < 3040; x += 4)          // one of the pixels that become one
        picture.at<cv::Vec3f>(10, x)[1] = nothing;
    write_color(folder / "dots.exr", picture);
    check_done({"report", folder / "dots.exr", "-o", folder / "out/report.html"});
    const Json data = data_of(content(folder / "out/report.html"));
    CHECK(data["frames"][0]["stats"]["output"]["invalid"] == 10);
    const cv::Mat small = decoded(data["frames"][0]["images"]["output"]);
    REQUIRE(small.cols == 960);
    double sum = 0;
    for (int x = 100; x < 600; ++x)
        sum += small.at<cv::Vec3b>(1, x)[1];
    CHECK(std::abs(sum / 500 - 188) < 3);
    const auto& marked = small.at<cv::Vec3b>(2, 725); // of rows 8 to 11; a JPEG mixes it with what is beside it
    CHECK(marked[1] + 40 < marked[0]);
    CHECK(marked[1] + 40 < marked[2]);
}

TEST_CASE("a report lists frames that failed, and those that a later run kept") {
    const Shot shot(3);
    Json failed = shot.frame_line(4, "failed");
    failed["error"] = "shot.0004.exr: is damaged";
    Json left_out = shot.frame_line(5, "left out");
    left_out.erase("output");
    left_out["missing"] = "shot.0005.exr";
    Json left_out_once = left_out; // and made by the last run
    left_out_once["frame"] = 2;
    Json of_another_command = failed;
    of_another_command["output"] = "dof.0004.exr";
    Json kept = shot.frame_line(1, "kept");
    kept["seconds"] = 0.001;
    const Json data =
        shot.report({"--log", shot.log({shot.run_line(), left_out_once, shot.frame_line(1), shot.frame_line(2), failed,
                                        of_another_command, left_out, shot.run_line(), kept})});
    REQUIRE(data["frames"].size() == 5);
    CHECK(data["runs"].size() == 2);
    CHECK(data["frames"][0]["seconds"] == 0.5);
    CHECK(data["frames"][0]["status"] == "made");
    CHECK_FALSE(data["frames"][2].contains("status")); // is not in the log
    CHECK(data["frames"][3]["error"] == "shot.0004.exr: is damaged");
    CHECK_FALSE(data["frames"][3].contains("images"));
    CHECK(data["frames"][4]["status"] == "left out");
    CHECK(data["frames"][4]["missing"] == "shot.0005.exr");
    CHECK(data["frames"][1]["status"] == "made");
    const std::string page = content(shot.page());
    static_cast<void>(shot.report({"--log", shot.folder / "run.jsonl"}));
    CHECK(content(shot.page()) == page); // which says nothing of its own time or place
}

TEST_CASE("a report's log may be torn, or lack keys") {
    const Shot shot(2);
    const Json data = shot.report({"--log", shot.log({{{"run", {{"command", 7}}}},
                                                      {{"output", "ao.0001.exr"}},
                                                      {{"output", "ao.0002.exr"},
                                                       {"seconds", "long"},
                                                       {"warnings", 5},
                                                       {"camera", {1, 2}},
                                                       {"frame", "x"},
                                                       {"input", 3},
                                                       {"status", nullptr}}},
                                                     R"({"output": "ao.0002.exr", "seco)")});
    CHECK(data["frames"].size() == 2);
    CHECK(data["unread_lines"] == 1);
    CHECK_FALSE(data["frames"][1].contains("seconds"));
    CHECK_FALSE(data["frames"][1].contains("camera"));
}

TEST_CASE("a report says that a log is of another shot") {
    const Shot shot(2);
    Json other = shot.frame_line(1);
    other["output"] = "dof.0001.exr";
    const std::string log = shot.log({shot.run_line(), other});
    const Outcome outcome = run({"report", shot.outputs(), "--log", log, "-o", shot.page()});
    CHECK(outcome.code == 0);
    CHECK(outcome.err ==
          "fathom: warning: " + log + ": has no line of " + shot.ao_file(1) + "; is it the log of another shot?\n");
    static_cast<void>(shot.report({"--log", shot.log({shot.run_line(), other, shot.frame_line(2)})})); // has one
}

TEST_CASE("a report finds results that were moved, and takes no other shot's for them") {
    const Shot shot(1);
    const Folder elsewhere;
    Json run_line = shot.run_line();
    run_line["run"]["folder"] = elsewhere / ".";
    const std::string log = shot.log({run_line, shot.frame_line(1)});
    CHECK(shot.report({"--log", log})["frames"][0].contains("seconds"));
    write(elsewhere / "ao.0001.exr", "another take");
    const Outcome outcome = run({"report", shot.outputs(), "--log", log, "-o", shot.page()});
    CHECK(outcome.code == 0);
    CHECK(contains(outcome.err, "has no line of " + shot.ao_file(1)));
}

TEST_CASE("no text becomes markup of a report") {
    const std::string hostile = R"(<!--<script>alert("1")&amp;'{{script}}.0001.exr)",
                      worse = "</script><img src=x onerror=alert(1)>\xff\x1b[31m\u2028 \" ' & {{data}}";
    const Shot shot(1);
    const std::string plain = (static_cast<void>(shot.report()), content(shot.page()));
    fs::rename(shot.ao_file(1), shot.folder / hostile);
    Json line = shot.frame_line(1);
    line["output"] = hostile;
    line["input"] = worse;
    line["error"] = worse;
    line["warnings"] = {worse, hostile};
    line["camera"] = {{worse, worse}};
    std::string text;
    for (const Json& each : {shot.run_line({"fathom", worse, hostile}), line})
        text += each.dump(-1, ' ', false, Json::error_handler_t::ignore) + '\n';
    write(shot.folder / "run.jsonl", text);
    check_done(
        {"report", shot.folder / hostile, "--log", shot.folder / "run.jsonl", "-o", shot.page(), "--title", worse});
    const std::string page = content(shot.page());
    for (const char* part : {"<script", "</script", "<!--", "<img"})
        CHECK(count(page, part) == count(plain, part));
    const Json data = data_of(page);
    CHECK(data["frames"][0]["output"] == shot.folder / hostile);
    CHECK(data["frames"][0]["warnings"][1] == hostile);
    CHECK(data["frames"][0]["error"].get<std::string>().starts_with("</script><img src=x onerror=alert(1)>"));
    CHECK(std::all_of(page.begin(), page.begin() + static_cast<std::ptrdiff_t>(page.find("id=\"data\"")),
                      [](unsigned char c) { return c >= ' ' || c == '\n'; }));
}

TEST_CASE("a report asks no network") {
    const Shot shot(1);
    static_cast<void>(shot.report());
    const std::string page = content(shot.page());
    CHECK(count(page, "://") == count(page, "http://www.w3.org/2000/svg"));
    CHECK(contains(page, "default-src 'none'"));
    for (const char* part : {"@import", "url(", "fetch(", "XMLHttpRequest", "import(", "innerHTML", "src=\"h"})
        CHECK(!contains(page, part));
}

// Noise is what JPEG keeps worst.
TEST_CASE("a report of 240 frames has at most 15 MB") {
    const Folder folder;
    std::minstd_rand random(7);
    cv::Mat noise(144, 256, CV_32FC1);
    for (float& value : cv::Mat_<float>(noise))
        value = static_cast<float>(random()) / static_cast<float>(std::minstd_rand::max());
    write_image(folder / "first.exr", noise, {.channels = {"AO"}});
    for (int frame = 1; frame <= 240; ++frame)
        fs::create_hard_link(folder / "first.exr", folder / fmt::format("ao.{:04}.exr", frame));
    check_done({"report", folder / "ao.####.exr", "--input", folder / "ao.####.exr", "--depth", folder / "ao.####.exr",
                "-o", folder / "out/report.html"});
    const auto bytes = fs::file_size(folder / "out/report.html");
    std::printf("  240 frames of noise: %.1f MB\n", static_cast<double>(bytes) / 1e6);
    CHECK(bytes <= 15'000'000);
    CHECK(bytes >= 3'000'000); // and its pictures are there
}

TEST_CASE("a report refuses what it cannot do in one line") {
    const Shot shot(2);
    const std::string page = shot.page();
    check_refused({"report", shot.folder / "none.exr", "-o", page}, 1, "none.exr");
    check_refused({"report", shot.folder / "none.####.exr", "-o", page}, 1, "none.####.exr");
    check_refused({"report", shot.outputs(), "-o", shot.folder / "out/report.pdf"}, 2, "ends with .html");
    check_refused({"report", shot.outputs(), "-o", shot.folder / "nowhere/r.html"}, 1, "nowhere/r.html");
    check_refused({"report", shot.outputs(), "-o", page, "--log", shot.folder / "none.jsonl"}, 1, "none.jsonl");
    write(shot.folder / "text.jsonl", "no log\nat all\n");
    check_refused({"report", shot.outputs(), "-o", page, "--log", shot.folder / "text.jsonl"}, 1, "is no log of a run");
    write(shot.folder / "other.jsonl", "{\"focus\": 3}\n");
    check_refused({"report", shot.outputs(), "-o", page, "--log", shot.folder / "other.jsonl"}, 1,
                  "is no log of a run");
    depth_file(shot.folder, "one.exr");
    check_refused({"report", shot.outputs(), "-o", page, "--input", shot.folder / "one.exr"}, 2,
                  "--input: stands for 1 files, but there are 2 results");
    CHECK(shot.folder.results().empty());

    // One that cannot be read among others: a line, and the page shows it.
    write(shot.ao_file(2), "no image");
    const Outcome outcome = run({"report", shot.outputs(), "-o", page});
    CHECK(outcome.code == 1);
    CHECK(count(outcome.err, "\n") == 1);
    CHECK(outcome.err.starts_with("fathom: " + shot.ao_file(2) + ": "));
    const Json data = data_of(content(page));
    CHECK(data["frames"].size() == 2);
    CHECK(data["frames"][1]["error"].get<std::string>().starts_with(shot.ao_file(2)));
}
