// fathom show: its colors against published tables, and what it chooses by the values.
#include "program.hpp"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();

// One row of values.
std::string row_file(const Folder& folder, const std::string& name, const std::vector<float>& values,
                     const std::vector<std::string>& channels = {"Z"}) {
    const int wide = static_cast<int>(values.size() / channels.size());
    const cv::Mat row(1, wide, CV_32FC(static_cast<int>(channels.size())), const_cast<float*>(values.data()));
    write_image(folder / name, row, {.channels = channels});
    return folder / name;
}

std::vector<float> ramp_of(int count, float (*value)(float)) {
    std::vector<float> values;
    for (int i = 0; i < count; ++i)
        values.push_back(value((static_cast<float>(i) + 0.5f) / static_cast<float>(count)));
    return values;
}

// What the program shows without a legend.
cv::Mat shown(const Folder& folder, const std::string& file, const Arguments& more = {}) {
    check_done(joined({"show", file, "--no-legend", "-o", folder / "out/shown.png"}, more));
    return cv::imread(folder / "out/shown.png", cv::IMREAD_UNCHANGED);
}

// RRGGBB of a pixel.
std::string hex(const cv::Mat& picture, int x, int y = 0) {
    const auto& color = picture.at<cv::Vec3b>(y, x);
    return fmt::format("{:02x}{:02x}{:02x}", color[2], color[1], color[0]);
}

nlohmann::json told(const Folder& folder, const std::string& file, const Arguments& more = {}) {
    const Outcome outcome = check_done(joined({"show", file, "--json", "-o", folder / "out/told.png"}, more));
    return nlohmann::json::parse(outcome.out);
}

const std::string invalid = "ff00ff", background = "c8d7f0";

} // namespace

TEST_CASE("show gives values the colors of published tables") {
    const Folder folder;
    std::vector<float> codes;
    for (int i = 0; i < 256; ++i)
        codes.push_back(static_cast<float>(i));
    const std::string file = row_file(folder, "codes.exr", codes);
    // Every 64th color of Matplotlib's tables.
    const auto check = [&](const char* map, const std::vector<std::string>& published) {
        const cv::Mat picture = shown(folder, file, {"--range", "0:255", "--map", map});
        REQUIRE(picture.size() == cv::Size(256, 1));
        for (std::size_t i = 0; i < published.size(); ++i)
            CHECK(hex(picture, std::min(255, 64 * static_cast<int>(i))) == published[i]);
        return picture;
    };
    const cv::Mat viridis = check("viridis", {"440154", "3b528b", "21918c", "5ec962", "fde725"});
    check("turbo", {"30123b", "28bceb", "a4fc3c", "fb7e21", "7a0403"});
    check("grey", {"000000", "404040", "808080", "c0c0c0", "ffffff"});
    double before = -1; // all colors between them: each is lighter than the one before, by less than 2 of 255
    for (int x = 0; x < 256; ++x) {
        const auto& color = viridis.at<cv::Vec3b>(0, x);
        const double luma = 0.2126 * color[2] + 0.7152 * color[1] + 0.0722 * color[0];
        CHECK(luma > before - 0.3); // codes are rounded
        CHECK((before < 0 || luma < before + 2));
        before = luma;
    }
}

TEST_CASE("show marks what has no color") {
    const Folder folder;
    const std::string file = row_file(folder, "holes.exr", {1, nothing, 2, infinity, -infinity, 3});
    const cv::Mat picture = shown(folder, file);
    CHECK(hex(picture, 0) == "440154");
    CHECK(hex(picture, 1) == invalid);
    CHECK(hex(picture, 3) == background);
    CHECK(hex(picture, 4) == invalid);
    CHECK(hex(picture, 5) == "fde725");
    const nlohmann::json said = told(folder, file);
    CHECK(said["invalid"] == 2);
    CHECK(said["background"] == 1);
    CHECK(said["min"] == 1);
    CHECK(said["max"] == 3);
    const Outcome line = check_done({"show", file, "-o", folder / "out/line.png"});
    CHECK(line.out == folder / "out/line.png" + "  6 × 1  Z 1 to 3, 2 of 6 pixels invalid (33 %)\n");
    const Outcome none =
        check_done({"show", row_file(folder, "none.exr", {nothing, nothing}), "-o", folder / "out/none.png"});
    CHECK(none.out.find("no finite value, 2 of 2 pixels invalid (100 %)") != std::string::npos);
}

TEST_CASE("show gives normals ½n + ½ and light the codes of sRGB") {
    const Folder folder;
    const cv::Mat normals =
        shown(folder, row_file(folder, "n.exr", {0, 0, 1, -1, 0, 0, 0, 0, 0}, {"N.X", "N.Y", "N.Z"}));
    CHECK(hex(normals, 0) == "8080ff");
    CHECK(hex(normals, 1) == "008080");
    CHECK(hex(normals, 2) == invalid);
    // IEC 61966-2-1: 0.2158605 is code 128; 0.002 lies on the straight part, 255 · 12.92 · 0.002 = 6.6.
    const cv::Mat picture =
        shown(folder, row_file(folder, "rgb.exr", {0, 1, 7, 0.2158605f, 0.002f, -1, nothing, 0, 0}, {"R", "G", "B"}));
    CHECK(hex(picture, 0) == "00ffff");
    CHECK(hex(picture, 1) == "800700");
    CHECK(hex(picture, 2) == invalid);
}

TEST_CASE("show chooses the range by the values") {
    const Folder folder;
    std::vector<float> rare = ramp_of(4096, [](float t) { return 1 + t; });
    rare[7] = 1e9f;
    const nlohmann::json said = told(folder, row_file(folder, "rare.exr", rare));
    CHECK(said["max"] == 1e9);
    CHECK(said["range"][1].get<double>() < 2);
    CHECK(said["range"][1].get<double>() > 1.99);

    const nlohmann::json mask = told(folder, row_file(folder, "ao.exr", {0.4f, 0.6f}, {"AO"}));
    CHECK(mask["range"] == nlohmann::json({0, 1}));
    CHECK(mask["shows"] == "AO");
    CHECK(told(folder, row_file(folder, "both.exr", {1, 2, 3, 5}, {"Z", "AO"}))["shows"] == "AO");
    const nlohmann::json flat = told(folder, row_file(folder, "flat.exr", {5, 5, 5}));
    CHECK(flat["range"][0] < 5);
    CHECK(flat["range"][1] > 5);
}

TEST_CASE("show draws a legend below the picture") {
    const Folder folder;
    const std::string file = depth_file(folder, "depth.exr");
    check_done({"show", file, "--range", "0:1", "--unit", "m", "-o", folder / "out/legend.png"});
    const cv::Mat whole = cv::imread(folder / "out/legend.png"), alone = shown(folder, file, {"--range", "0:1"});
    REQUIRE(whole.cols >= 320); // for the labels
    const cv::Rect place((whole.cols - width) / 2, 0, width, height);
    CHECK(same(whole(place).clone(), alone));
    // The bar runs from the first color to the last one.
    const int bar = height + 12;
    CHECK(hex(whole, 10, bar) == "440154");
    CHECK(hex(whole, whole.cols - 11, bar) == "fde725");
    // The unit is drawn: without it the picture is another one.
    check_done({"show", file, "--range", "0:1", "-o", folder / "out/plain.png"});
    CHECK_FALSE(same(whole, cv::imread(folder / "out/plain.png")));
    // A name for the picture is made of the file's.
    check_done({"show", file});
    CHECK(same(cv::imread(folder / "depth.show.png"), cv::imread(folder / "out/plain.png")) == false);
    CHECK(cv::imread(folder / "depth.show.png").cols == whole.cols);
}

TEST_CASE("show reads every kind of result") {
    const Folder folder;
    const cv::Mat codes(2, 3, CV_16UC1, cv::Scalar(700));
    cv::imwrite(folder / "codes.png", codes);
    CHECK(told(folder, folder / "codes.png")["shows"] == "codes");
    CHECK(told(folder, row_file(folder, "coc.exr", {-3, 0, 0, 1, 2, 1, 0, 0},
                                {"coc", "near", "focus", "far"}))["shows"] == "coc");
    CHECK(told(folder, folder / "coc.exr", {"--channel", "far"})["shows"] == "far");
    write_image(folder / "n.pfm", cv::Mat(2, 2, CV_32FC3, cv::Scalar(0, 0, -1)));
    CHECK(told(folder, folder / "n.pfm")["shows"] == "normals");
    write_image(folder / "rgb.pfm", cv::Mat(2, 2, CV_32FC3, cv::Scalar(3, 2, 1)));
    CHECK(told(folder, folder / "rgb.pfm")["shows"] == "R, G, B");
    write_image(folder / "z.npy", ramp());
    CHECK(told(folder, folder / "z.npy")["shows"] == "stored values");
}

TEST_CASE("show makes a picture of each frame that a name stands for") {
    const Folder folder;
    for (const int frame : {1, 2, 7})
        row_file(folder, fmt::format("z.{:04}.exr", frame), {1, 2, static_cast<float>(frame)});
    const auto frames = [](const char* name) {
        return std::vector<std::string>{fmt::format(fmt::runtime(name), 1), fmt::format(fmt::runtime(name), 2),
                                        fmt::format(fmt::runtime(name), 7)};
    };
    for (const char* name : {"z.%04d.exr", "z.####.exr", "z.*.exr"}) {
        const Outcome outcome = check_done({"show", folder / name, "-o", folder / "out/new/"});
        CHECK(std::count(outcome.out.begin(), outcome.out.end(), '\n') == 3);
        for (const std::string& picture : frames("out/new/z.{:04}.png"))
            CHECK(cv::imread(folder / picture).rows > 1);
        fs::remove_all(folder / "out/new");
    }
    check_done({"show", folder / "z.####.exr", "--no-legend", "-o", folder / "out/p.##.png"});
    CHECK(folder.results() == frames("p.{:02}.png"));
    CHECK(same(cv::imread(folder / "out/p.07.png"), shown(folder, folder / "z.0007.exr")));
    for (int again = 0; again < 2; ++again) // the pictures themselves are not shown
        check_done({"show", folder / "z.*", "--range", "0:9"});
    for (const std::string& picture : frames("z.{:04}.show.png"))
        CHECK(fs::exists(folder / picture));
    CHECK_FALSE(fs::exists(folder / "z.0001.show.show.png"));
    // Nor are they depth, or the records of --resume results.
    check_done({"linearize", folder / "z.*", "--preset", "encoding=view-z,fov_x_deg=90", "--resume", "--quiet", "-o",
                folder / "out/depth/"});
    const Outcome beside = check_done({"show", folder / "out/depth/z.*", "--range", "0:9"});
    CHECK(std::count(beside.out.begin(), beside.out.end(), '\n') == 3);
    check_refused({"show", folder / "out/depth/z.0002.exr.fathom.json", folder / "out/depth/z.0007.exr.fathom.json"}, 1,
                  "is a record of --resume");
    fs::remove_all(folder / "out/depth");
    check_refused({"show", folder / "z.####.exr", "-o", folder / "out/one.png"}, 2, "give a folder");
    check_refused({"show", folder / "nix.####.exr"}, 1, "nix.####.exr: no frame of this name is there");
    write(folder / "z.0002.exr", "damaged");
    const Outcome outcome = run({"show", folder / "z.####.exr", "-o", folder / "out/rest/"});
    CHECK(outcome.code == 1);
    CHECK(outcome.err.starts_with("fathom: " + (folder / "z.0002.exr")));
    CHECK(fs::exists(folder / "out/rest/z.0007.png"));
}

TEST_CASE("show names the channels that there are, and how to choose one") {
    const Folder folder;
    const std::string ao = row_file(folder, "ao.exr", {0, 1}, {"AO"});
    check_refused({"show", ao, "--channel", "P"}, 1, "has no channel \"P\"; it has AO, which --channel can name");
    const std::string points = row_file(folder, "p.exr", {1, 2, -30, 4, 5, -6}, {"P.X", "P.Y", "P.Z"});
    check_refused({"show", points, "--channel", "P"}, 1, "normals have length 1, so it is a picture or positions");
    CHECK(told(folder, points, {"--channel", "P.X"})["max"] == 4);
}

TEST_CASE("show refuses what it cannot do in one line") {
    const Folder folder;
    const std::string file = depth_file(folder, "depth.exr"), out = folder / "out/p.png";
    check_refused({"show", folder / "none.exr", "-o", out}, 1, "none.exr");
    write(folder / "cut.exr", content(file).substr(0, 200));
    check_refused({"show", folder / "cut.exr", "-o", out}, 1, "cut.exr");
    write(folder / "text.png", "no picture");
    check_refused({"show", folder / "text.png", "-o", out}, 1, "text.png");
    check_refused({"show", file, "-o", folder / "out/p.jpg"}, 2, "it is .png");
    check_refused({"show", file, "-o", folder / "nowhere/p.png"}, 1, "nowhere/p.png");
    for (const char* range : {"5:1", "1:1", "a:b", "3", "nan:1", "0:inf", ":"})
        check_refused({"show", file, "-o", out, "--range", range}, 2, std::string("'") + range + "'");
    check_refused({"show", file, "-o", out, "--map", "jet"}, 2, "'jet' is unknown");
    check_refused({"show", file, "-o", out, "--channel", "nix"}, 1, "\"nix\"");
    const std::string normals = row_file(folder, "n.exr", {0, 0, 1}, {"N.X", "N.Y", "N.Z"});
    check_refused({"show", normals, "-o", out, "--range", "0:1"}, 1, "which have no range");
    const std::string layers = row_file(folder, "layers.exr", {0, 0}, {"a.b", "c.d"});
    check_refused({"show", layers, "-o", out}, 1, "a.b, c.d");
    CHECK(folder.results().empty());
    const cv::Mat picture(2, 2, CV_8UC3, cv::Scalar(1, 2, 3));
    cv::imwrite(folder / "same.png", picture);
    check_refused({"show", folder / "same.png", "-o", folder / "same.png"}, 2, "is one of the files to read");
}
