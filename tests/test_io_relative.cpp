// Relative depth in files, on the grid of a picture, and through the program.
#include "io_files.hpp"
#include "program.hpp"

#include <fathom/dof.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>
#include <fathom/picture.hpp>
#include <fathom/relative.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

/// Disparity of a slanted floor with a box on it, from 0 to 1.
cv::Mat scene(int columns = 96, int rows = 64) {
    return filled(columns, rows, [&](int x, int y) {
        const bool box = x > columns / 3 && x < columns * 2 / 3 && y > rows / 4 && y < rows * 3 / 4;
        return box ? 0.9f : 0.1f + 0.5f * static_cast<float>(y) / static_cast<float>(rows);
    });
}

/// A picture of it: the box is bright.
cv::Mat photo(int columns = 96, int rows = 64) {
    const cv::Mat values = scene(columns, rows);
    return filled<cv::Vec3b>(columns, rows, [&](int x, int y) {
        return values.at<float>(y, x) > 0.8f ? cv::Vec3b(200, static_cast<uchar>(180 + x % 7), 240)
                                             : cv::Vec3b(static_cast<uchar>(40 + y % 5), 60, 20);
    });
}

fs::path saved(const fs::path& file, const cv::Mat& image) {
    REQUIRE(cv::imwrite(file.string(), image));
    return file;
}

} // namespace

TEST_CASE("relative files: integers count from 0 to 1, floats by a range", "[relative]") {
    const TempFolder folder;
    const cv::Mat values = scene();
    for (const char* name : {"a.png", "a.tif"}) {
        const RelativeFile bytes = read_relative(saved(folder / name, converted(values, CV_8U, 255)));
        CHECK(bytes.bits == 8);
        CHECK(cv::norm(bytes.values, values, cv::NORM_INF) <= 0.501 / 255);
        const RelativeFile words = read_relative(saved(folder / name, converted(values, CV_16U, 65535)));
        CHECK(words.bits == 16);
        CHECK(cv::norm(words.values, values, cv::NORM_INF) <= 0.501 / 65535);
        const cv::Mat grey = converted(values, CV_8U, 255);
        CHECK(same(read_relative(saved(folder / name, merged({grey, grey, grey}))).values, bytes.values));
    }
    CHECK(read_relative(saved(folder / "a.jpg", converted(values, CV_8U, 255))).bits == 8);
    write_image(folder / "a.exr", values * 20 - 3);
    const RelativeFile own = read_relative(folder / "a.exr");
    double low, high;
    cv::minMaxLoc(own.values, &low, &high);
    CHECK((own.bits == 32 && low == 0 && high == 1));
    const RelativeFile asked = read_relative(folder / "a.exr", {.range = std::array{-3.0, 17.0}});
    CHECK(cv::norm(asked.values, values, cv::NORM_INF) < 1e-6);
}

TEST_CASE("relative files: what has no order of distances is refused", "[relative]") {
    const TempFolder folder;
    const auto refused = [&](const cv::Mat& image, const std::string& name, const ReadRelativeOptions& options = {}) {
        const auto file = saved(folder / name, image);
        return refusal([&] { read_relative(file, options); });
    };
    check_says(refused(photo(), "map.png"), {"map.png", "has colours, as at pixel (", "colour map", "in grey"});
    check_says(refused(converted(scene(), CV_8U, 255), "a.png", {.range = std::array{90.0, 10.0}}),
               {"first end must be the lesser one"});
    CHECK(read_relative(saved(folder / "range.png", converted(scene(), CV_16U, 1000)),
                        {.range = std::array{100.0, 900.0}})
              .values.at<float>(32, 48) == 1);
    check_says(refused(converted(scene(), CV_8U, 255), "a.png", {.channel = "Z"}), {"no OpenEXR file"});
    write_image(folder / "flat.exr", cv::Mat(4, 4, CV_32FC1, cv::Scalar(2)));
    CHECK(cv::countNonZero(read_relative(folder / "flat.exr").values) == 0); // all of it is equally near
    CHECK(read_relative(saved(folder / "b.png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(9)))).values.at<float>(3, 3) ==
          9 / 65535.0f);
    write_image(folder / "none.exr", cv::Mat(4, 4, CV_32FC1, cv::Scalar(NAN)));
    check_says([&] { read_relative(folder / "none.exr"); }, {"no value that is a number"});
    check_says([&] { read_relative(put(folder / "a.txt", "text")); }, {"is no image"});
}

TEST_CASE("relative program: a photograph and a network's depth need no camera", "[relative]") {
    const Folder folder;
    const std::string picture = saved(folder / "photo.png", photo()),
                      depth = saved(folder / "depth.png", converted(scene(), CV_8U, 255)),
                      deep = saved(folder / "deep.png", converted(scene(), CV_16U, 65535)),
                      out = folder / "out/blurred.png";
    const auto blur = [&](const std::string& input, const Arguments& more) {
        return run(joined({"dof", input, "--relative", "high-is-near", "--color", picture, "-o", out}, more));
    };
    check_done(blur(deep, {"--blur-px", "20", "--focus-at", "48,32"}));
    const cv::Mat got = cv::imread(out, cv::IMREAD_UNCHANGED);
    CHECK(cv::norm(got(cv::Rect(40, 24, 16, 16)), photo()(cv::Rect(40, 24, 16, 16)), cv::NORM_INF) <= 1); // in focus
    CHECK(!same(got, photo()));

    const RelativeFile values = read_relative(deep); // the library does the same
    const Picture light = read_picture(picture);
    const Device device = Device::open();
    const StoredDepth stored{to_device(device, values.values), relative_camera(96, 64, RelativeOrder::high_is_near)};
    const double focus = 1 - depth_at(stored, 48, 32);
    const auto expected = [&](const StoredDepth& depths) {
        write_picture(folder / "expected.png", {to_mat(dof(depths, to_device(device, light.color),
                                                           relative_circle(20, focus, RelativeOrder::high_is_near))),
                                                light.format});
        return cv::imread(folder / "expected.png", cv::IMREAD_UNCHANGED);
    };
    CHECK(same(got, expected(stored))); // whose edges are hard
    check_done(blur(deep, {"--blur-px", "20", "--focus-at", "48,32", "--grow-foreground", "1"}));
    CHECK(same(cv::imread(out, cv::IMREAD_UNCHANGED), expected(grow_foreground(stored, 1))));

    check_done(blur(depth, {"--blur-px", "20", "--focus-range", "0.85,1"}));
    check_done(blur(depth, {"--blur-px", "0", "--focus-at", "48,32"}));
    CHECK(same(cv::imread(out, cv::IMREAD_UNCHANGED), photo()));
    const std::string small = saved(folder / "small.png", converted(scene(48, 32), CV_8U, 255));
    check_done(blur(small, {"--blur-px", "20", "--focus-at", "48,32"}));
    check_done({"dof-masks", depth, "--relative", "low-is-near", "--blur-px", "20", "--focus-at", "1,1", "-o",
                folder / "out/masks.exr"});
    CHECK(channel(folder / "out/masks.exr", "coc").at<float>(32, 48) > 10); // low is near: the box is far behind
}

TEST_CASE("relative program: what is wrong is told in one line", "[relative]") {
    const Folder folder;
    const std::string picture = saved(folder / "photo.png", photo()),
                      depth = saved(folder / "depth.png", converted(scene(), CV_8U, 255)),
                      out = folder / "out/blurred.png", camera = camera_file(folder);
    const auto refused = [&](const Arguments& more, int code, const std::string& named, const std::string& input) {
        check_refused(joined({"dof", input, "--color", picture, "-o", out}, more), code, named);
        CHECK(folder.results().empty());
    };
    const Arguments relative{"--relative", "high-is-near"}, focus{"--focus-at", "4,4"}, blur{"--blur-px", "9"};
    refused(joined(relative, focus), 2, "--blur-px: missing", depth);
    refused(joined(relative, blur), 2, "--focus-at: missing", depth);
    refused(joined(joined(relative, joined(focus, blur)), {"--camera", camera}), 2, "--relative", depth);
    refused(joined(joined(relative, joined(focus, blur)), {"--f-stop", "2"}), 2, "--relative", depth);
    refused(joined(focus, blur), 2, "--relative", depth);
    refused(joined(joined(relative, blur), {"--focus-range", "0.5,0.2"}), 2, "0 <= A <= B <= 1", depth);
    refused(joined({"--relative", "near"}, joined(focus, blur)), 2, "high-is-near or low-is-near", depth);
    refused(joined(joined(relative, blur), {"--focus-at", "400,4"}), 1, "400,4 lies outside", depth);
    refused(joined(relative, joined(focus, blur)), 1, "colour map", picture);
    const std::string tall = saved(folder / "tall.png", converted(scene(40, 64), CV_8U, 255));
    refused(joined(relative, joined(focus, blur)), 1, "same ratio of width to height", tall);
    refused(joined(joined(relative, joined(focus, blur)), {"--clean-plate", picture}), 2, "--clean-plate", depth);
}

TEST_CASE("relative program: a shot of floats has one range, whichever frames are done and however they are named",
          "[relative]") {
    const Folder folder;
    const auto frame = [&](int i) { return folder / ("shot.000" + std::to_string(i) + ".exr"); };
    for (int i = 1; i <= 3; ++i) {
        cv::Mat values = scene() * 8;
        if (i == 2)
            values(cv::Rect(2, 50, 8, 8)) = 24; // somebody comes near
        if (i == 3)
            values(cv::Rect(2, 50, 8, 8)) = std::numeric_limits<float>::quiet_NaN();
        write_image(frame(i), values);
    }
    const Arguments masks{"dof-masks", "--relative", "high-is-near", "--blur-px", "40", "--focus-at", "60,8", "-o"};
    const auto result = [&](const char* name, int i) {
        return channel(folder / (std::string("out/") + name + ".000" + std::to_string(i) + ".exr"), "coc");
    };
    const auto done = [&](const char* name, const Arguments& inputs, const Arguments& more = {}) {
        const Outcome outcome =
            run(joined(joined(masks, {folder / (std::string("out/") + name + ".####.exr")}), joined(inputs, more)));
        CHECK(outcome.code == 0);
        CHECK(outcome.err.empty());
        return outcome.out.substr(0, outcome.out.find('\n'));
    };
    // The oracle: blur_px (v_focus - v) with the range of all frames, 0.8 to 24, written a second time.
    const std::string first = done("whole", {folder / "shot.####.exr"});
    CHECK(contains(first, "shot.0001.exr to "));
    CHECK(contains(first, "--relative-range 0.8,24"));
    for (int i = 1; i <= 3; ++i) {
        CAPTURE(i);
        const cv::Mat coc = result("whole", i), values = scene() * 8;
        const auto v = [&](int x, int y) { return (static_cast<double>(values.at<float>(y, x)) - 0.8) / (24 - 0.8); };
        for (const auto& [x, y] : {std::pair(4, 4), std::pair(60, 32), std::pair(90, 60)})
            CHECK(coc.at<float>(y, x) == Approx(40 * (v(60, 8) - v(x, y))).margin(1e-4));
    }
    const auto as_whole = [&](const char* name, std::initializer_list<int> frames) {
        for (const int i : frames)
            CHECK(same(result(name, i), result("whole", i)));
    };
    done("one", {folder / "shot.####.exr"}, {"--frames", "1"}); // a part on a farm
    as_whole("one", {1});
    done("shell", {frame(1), frame(3)});
    as_whole("shell", {1, 3});
    done("said", {folder / "shot.####.exr"}, {"--relative-range", "0.8,24"});
    as_whole("said", {1, 2, 3});
    CHECK_FALSE(contains(done("single", {frame(1)}), "--relative-range")); // has its own, as ever
    CHECK_FALSE(same(channel(folder / "out/single.####.exr", "coc"), result("whole", 1)));

    // A file beside them that is no frame changes nothing.
    write_image(folder / "test.exr", scene() * 30);
    const Outcome beside = run(joined(joined(masks, {folder / "out/beside/"}), {folder / ""}));
    CHECK(beside.code == 0);
    CHECK(contains(beside.out.substr(0, beside.out.find('\n')), "--relative-range 0.8,24"));
    const Outcome by_shell =
        run(joined(joined(masks, {folder / "out/by-shell/"}), {frame(1), frame(2), frame(3), folder / "test.exr"}));
    for (const char* out : {"out/beside/", "out/by-shell/"})
        for (int i = 1; i <= 3; ++i)
            CHECK(same(channel(folder / (out + ("shot.000" + std::to_string(i)) + ".exr"), "coc"), result("whole", i)));
    CHECK(by_shell.out.substr(0, by_shell.out.find('\n')) == beside.out.substr(0, beside.out.find('\n')));
    const Outcome json =
        run(joined(joined(masks, {folder / "out/json.####.exr"}), {folder / "shot.####.exr", "--json"}));
    CHECK(contains(json.out.substr(0, json.out.find('\n')), "\"relative_range\":[0.8"));
    const Folder grey; // integers have the range of their bits
    for (int i = 1; i <= 2; ++i)
        saved(grey / ("shot.000" + std::to_string(i) + ".png"), converted(scene() * (0.5 + 0.2 * i), CV_16U, 65535));
    const Outcome integers = run(joined(joined(masks, {grey / "out/####.exr"}), {grey / "shot.####.png"}));
    CHECK(integers.code == 0);
    CHECK_FALSE(contains(integers.out, "--relative-range"));
}

TEST_CASE("relative: two bytes of a JPEG make none", "[io]") {
    const TempFolder folder;
    check_says([&] { read_relative(put(folder / "a.jpg", Bytes{0xff, 0xd8, 0, 1, 2, 3})); }, {"a.jpg: is no image"});
}
