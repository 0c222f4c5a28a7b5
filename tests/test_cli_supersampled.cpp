// fathom dof, ssao and fog --supersampled: the large frame's own result, whose squares are averaged here in double.
#include "program.hpp"

#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

constexpr int across = 60, down = 44; // of the results
constexpr double two_ulp = 0x1p-22;

/// A box before a slope, and a sky, at so many pixels for one of the result.
struct Frame {
    Folder folder;
    int factor;
    std::string depth = folder / "depth.exr", picture = folder / "color.exr", camera = folder / "camera.json",
                large_camera = folder / "large.json", out = folder / "out/o.exr", large_out = folder / "out/large.exr";

    explicit Frame(int times) : factor(times) {
        const auto at = [&](int x, int y) { return cv::Point2d((x + 0.5) / factor, (y + 0.5) / factor); };
        write_image(depth, filled(across * factor, down * factor, [&](int x, int y) {
                        const auto [u, v] = at(x, y);
                        return v < 9.3                                          ? HUGE_VAL
                               : std::abs(u - 27) < 8.3 && std::abs(v - 25) < 9 ? 3 + 0.01 * u
                                                                                : 1 / (0.05 + 4e-3 * v);
                    }));
        write_image(picture,
                    filled<cv::Vec3f>(across * factor, down * factor,
                                      [&](int x, int y) {
                                          const cv::Point2d p = at(x, y);
                                          const auto wave = [&](double a, double b) {
                                              return static_cast<float>(0.5 + 0.45 * std::sin(a * p.x + b * p.y));
                                          };
                                          return cv::Vec3f(wave(1.3, 0.4), wave(0.2, 1.7), wave(0.9, -0.8));
                                      }),
                    {.channels = {"R", "G", "B"}});
        write(camera, R"({"encoding": "view-z", "intrinsics": {"fx": 55, "fy": 55, "cx": 30, "cy": 22}})");
        const auto f = std::to_string(55 * factor), x = std::to_string(30 * factor), y = std::to_string(22 * factor);
        write(large_camera, R"({"encoding": "view-z", "intrinsics": {"fx": )" + f + R"(, "fy": )" + f + R"(, "cx": )" +
                                x + R"(, "cy": )" + y + "}}");
    }

    Arguments small(const Arguments& arguments) const {
        return joined(arguments, {"--camera", camera, "-o", out, "--supersampled", std::to_string(factor)});
    }

    /// The result is the mean of the large frame's own one, up to 2 ulp.
    void check(const Arguments& arguments, const Arguments& large, const std::vector<std::string>& channels) const {
        check_done(small(arguments));
        check_done(joined(large, {"--camera", large_camera, "-o", large_out}));
        for (const std::string& name : channels) {
            const cv::Mat got = channel(out, name), whole = channel(large_out, name);
            REQUIRE(got.size() == cv::Size(across, down));
            for (int y = 0; y < down; ++y)
                for (int x = 0; x < across; ++x) {
                    double sum = 0;
                    for (int j = 0; j < factor; ++j)
                        for (int i = 0; i < factor; ++i)
                            sum += static_cast<double>(whole.at<float>(y * factor + j, x * factor + i));
                    const double mean = sum / (factor * factor), is = static_cast<double>(got.at<float>(y, x));
                    if (!(std::abs(is - mean) <= two_ulp * std::abs(mean)))
                        FAIL(name << " of pixel " << x << ", " << y << ": " << is << ", not " << mean);
                }
        }
    }
};

} // namespace

TEST_CASE("supersampled program: results are the means of the large frame's, in the small picture's lengths") {
    for (const int factor : {2, 3}) {
        const Frame frame(factor);
        const auto pixels = [&](int small) { return std::to_string(factor * small); };
        const Arguments color{"--color", frame.picture};
        const Arguments lens{"--f-stop", "2", "--sensor-mm", "36", "--mm-per-unit", "40", "--quality", "fast"};
        const auto dof = [&](const Arguments& more) {
            return joined(joined({"dof", frame.depth}, color), joined(lens, more));
        };
        const auto middle = [&](int x, int y) {
            return std::to_string(x * factor + factor / 2) + "," + std::to_string(y * factor + factor / 2);
        };
        frame.check(dof({"--focus-at", "27,25", "--max-coc-px", "9"}),
                    dof({"--focus-at", middle(27, 25), "--max-coc-px", pixels(9)}), {"R", "G", "B"});
        const auto circle = [&](int k, int g) {
            return joined(joined({"dof", frame.depth}, color), {"--circle", pixels(k) + "," + pixels(g)});
        };
        frame.check(joined(joined({"dof", frame.depth}, color), {"--circle", "6,24"}), circle(6, 24), {"R", "G", "B"});
        const Arguments ssao{"ssao", frame.depth, "--radius", "1.5"};
        frame.check(ssao, ssao, {"AO"});
        const Arguments fog = joined(joined({"fog", frame.depth}, color), {"--density", "0.1"});
        frame.check(fog, fog, {"R", "G", "B"});
    }
}

TEST_CASE("supersampled program: relative depth, a camera of the large size, directions") {
    const Frame frame(2);
    const cv::Mat codes = filled<std::uint8_t>(2 * across, 2 * down, [](int x, int y) { return x + y; });
    const std::string relative = frame.folder / "relative.png";
    REQUIRE(cv::imwrite(relative, codes));
    const auto blur = [&](const char* px, const char* pixel) {
        return Arguments{"dof",         relative,    "--relative", "high-is-near", "--color",
                         frame.picture, "--blur-px", px,           "--focus-at",   pixel};
    };
    check_done(joined(blur("12", "5,6"), {"-o", frame.out, "--supersampled", "2"}));
    check_done(joined(blur("24", "11,13"), {"-o", frame.large_out}));
    const cv::Mat got = read_color(frame.out), whole = read_color(frame.large_out);
    REQUIRE(got.size() == cv::Size(across, down));
    const auto four = [&](int c) {
        const auto at = [&](int x, int y) { return static_cast<double>(whole.at<cv::Vec3f>(y, x)[c]); };
        return (at(40, 30) + at(41, 30) + at(40, 31) + at(41, 31)) / 4;
    };
    for (int c = 0; c < 3; ++c)
        CHECK(std::abs(static_cast<double>(got.at<cv::Vec3f>(15, 20)[c]) - four(c)) <= two_ulp * four(c));

    // A camera that says the large frame's size is taken, too.
    const std::string sized = frame.folder / "sized.json", normals = frame.folder / "out/n.exr";
    write(sized, R"({"encoding": "view-z", "width": 120, "height": 88,)"
                 R"( "intrinsics": {"fx": 110, "fy": 110, "cx": 60, "cy": 44}})");
    const Arguments ssao{"ssao", frame.depth, "--radius", "1.5", "--bent-normal", normals, "--supersampled", "2"};
    check_done(joined(ssao, {"--camera", sized, "-o", frame.out}));
    const cv::Mat of_sized = channel(frame.out, "AO");
    check_done(joined(ssao, {"--camera", frame.camera, "-o", frame.out}));
    CHECK(same(of_sized, channel(frame.out, "AO")));
    const cv::Mat x = channel(normals, "N.X"), y = channel(normals, "N.Y"), z = channel(normals, "N.Z");
    for (int row = 0; row < down; ++row)
        for (int column = 0; column < across; ++column) {
            const double length =
                std::hypot(static_cast<double>(x.at<float>(row, column)), static_cast<double>(y.at<float>(row, column)),
                           static_cast<double>(z.at<float>(row, column)));
            CHECK((length < 1e-9 || std::abs(length - 1) < 1e-6));
        }
}

TEST_CASE("supersampled program: what does not fit is refused in one line") {
    const Frame frame(2);
    const auto refused = [&](const Arguments& arguments, int code, const char* reason) {
        check_refused(run(joined(arguments, {"--camera", frame.camera, "-o", frame.out})), code, reason);
    };
    const Arguments ssao{"ssao", frame.depth, "--radius", "1"};
    refused(joined(ssao, {"--supersampled", "5"}), 2, "'5' will not do");
    refused(joined(ssao, {"--supersampled", "3"}), 1, "needs multiples of 3 there");
    refused(joined(ssao, {"--supersampled", "2", "--region", "0,0,8,8"}), 2, "--region");
    refused(joined(ssao, {"--supersampled", "2", "--append"}), 2, "--append: the results of --supersampled");
    const Arguments dof{"dof", frame.depth, "--color", frame.picture, "--circle", "4,16", "--supersampled", "2"};
    refused(joined(dof, {"--max-coc-px", "300"}), 2, "--max-coc-px = 300 pixels of the result are 600");
    const std::string other = frame.folder / "small.exr";
    write_image(other, cv::Mat(down, across, CV_32FC3, cv::Scalar::all(0.5)), {.channels = {"R", "G", "B"}});
    refused({"dof", frame.depth, "--color", other, "--circle", "4,16", "--supersampled", "2"}, 1,
            "needs both in the size of the large frame");
    refused({"normals", frame.depth, "--supersampled", "2"}, 2, "--supersampled");
    CHECK(frame.folder.results().empty());
}
