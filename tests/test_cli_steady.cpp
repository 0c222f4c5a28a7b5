// fathom steady, and the blur by what it writes: frames with scales and offsets of their own are blurred as if they had none.
#include "program.hpp"

#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <random>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

constexpr int across = 96, down = 64, count = 8;

/// A floor and posts, of which nothing moves.
float nearness(int x, int y) {
    return x % 24 < 6 && y > 12 ? 0.8f : 0.1f + 0.4f * static_cast<float>(y) / down;
}

struct Shot {
    Folder folder;
    std::string frames = folder / "depth.####.npy", picture = folder / "rgb.####.png", csv = folder / "out/range.csv";

    Shot() {
        std::mt19937 random(11);
        std::uniform_real_distribution number(0.0f, 1.0f);
        const cv::Mat color = filled<cv::Vec3b>(across, down, [](int x, int y) {
            return cv::Vec3b(uchar(37 * x % 251), uchar(91 * y % 253), uchar((x * y) % 255));
        });
        for (int t = 1; t <= count; ++t) {
            const float scale = 0.5f + 2 * number(random), offset = 3 * number(random);
            write_image(folder / fmt::format("depth.{:04}.npy", t),
                        filled(across, down, [&](int x, int y) { return scale * nearness(x, y) + offset; }));
            REQUIRE(cv::imwrite(folder / fmt::format("rgb.{:04}.png", t), color));
        }
    }

    /// The largest difference between two blurred frames, in codes.
    double flicker(const Arguments& more) const {
        check_done(joined({"dof", frames, "--relative", "high-is-near", "--color", picture, "-o",
                           folder / "out/b.####.png", "--blur-px", "12", "--focus-at", "3,40", "--quality", "fast"},
                          more));
        const cv::Mat first = cv::imread(folder / "out/b.0001.png");
        double most = 0;
        for (int t = 2; t <= count; ++t)
            most =
                std::max(most, cv::norm(first, cv::imread(folder / fmt::format("out/b.{:04}.png", t)), cv::NORM_INF));
        return most;
    }
};

} // namespace

TEST_CASE("steady program: a blur by its ranges does not flicker") {
    const Shot shot;
    const Outcome done = run({"steady", shot.frames, "-o", shot.csv});
    check_done(done);
    CHECK_THAT(done.out, ContainsSubstring("8 frames; --animate relative-range="));
    std::istringstream lines(content(shot.csv));
    std::string line;
    int numbers = 0;
    std::getline(lines, line);
    CHECK(line == "frame,relative_range");
    while (std::getline(lines, line)) {
        ++numbers;
        CHECK(line.starts_with(std::to_string(numbers) + ",\""));
    }
    CHECK(numbers == count);
    const double with = shot.flicker({"--animate", "relative-range=" + shot.csv}), without = shot.flicker({});
    std::printf(
        "a still shot of relative depth: blurred frames differ by %.0f codes of 255, and by %.0f without ranges\n",
        with, without);
    CHECK(with <= 1);
    CHECK(without > 10);

    // Frames that are chosen, and cuts.
    check_done({"steady", shot.frames, "-o", shot.csv, "--frames", "2-5"});
    CHECK_THAT(content(shot.csv), ContainsSubstring("\n5,"));
    CHECK_THAT(content(shot.csv), !ContainsSubstring("\n6,"));
    for (int t = 5; t <= count; ++t)
        write_image(shot.folder / fmt::format("depth.{:04}.npy", t), filled(across, down, [&](int x, int y) {
                        return std::sin(0.3 * x) * std::cos(0.2 * y) + 0.01 * t;
                    }));
    CHECK_THAT(run({"steady", shot.frames, "-o", shot.csv}).out, ContainsSubstring("8 frames, cuts before 5;"));
}

TEST_CASE("steady program: what is no shot is refused in one line, and nothing is written") {
    const Shot shot;
    const std::string one = shot.folder / "depth.0001.npy";
    check_refused(run({"steady", one, "-o", shot.csv}), 2, "is no shot of several frames");
    check_refused(run({"steady", shot.frames, "-o", shot.folder / "out/range.txt"}), 2, "written as .csv");
    check_refused(run({"steady", shot.folder / "none.####.npy", "-o", shot.csv}), 1, "none.####.npy");
    check_refused(run({"steady", shot.frames, "-o", shot.csv}, {.largest_file = 200}), 1, "range.csv");
    write_image(shot.folder / "depth.0003.npy", filled(across, down, [](int, int) { return 0.5f; }));
    const Outcome with_one = run({"steady", shot.frames, "-o", shot.csv});
    CHECK(with_one.code == 0);
    CHECK_THAT(with_one.err, ContainsSubstring("warning: " + shot.folder / "depth.0003.npy: all values are the same"));
    fs::remove(shot.csv);
    write(shot.folder / "depth.0003.npy", "no array");
    check_refused(run({"steady", shot.frames, "-o", shot.csv}), 1, "depth.0003.npy");
    CHECK(shot.folder.results().empty());
}
