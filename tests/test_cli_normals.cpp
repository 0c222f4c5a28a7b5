// fathom normals: the files hold what the library gives, and what is wrong is told in one line.
#include "rendered_input.hpp"

#include <fathom/normals.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

struct SphereAbove : RenderedInput {
    explicit SphereAbove(const std::string& more = view) : RenderedInput({scene::Sphere{{0, 0, -3}, 1.2}}, more) {}

    Arguments arguments(const std::string& output, const Arguments& more = {}) const {
        return joined({"normals", input, "--camera", camera, "-o", output}, more);
    }
    cv::Mat expected() const { return to_mat(normals(stored)); }
};

// What a layer holds, untouched.
cv::Mat layer(const std::string& file) {
    std::vector<cv::Mat> parts;
    for (const char* name : {"N.X", "N.Y", "N.Z"})
        parts.push_back(channel(file, name));
    cv::Mat all;
    cv::merge(parts, all);
    return all;
}

} // namespace

TEST_CASE("normals program: writes what the library computes, in every format") {
    const SphereAbove sphere;
    const cv::Mat truth = sphere.expected();
    REQUIRE(truth.at<cv::Vec3f>(0, 0) == cv::Vec3f(0, 0, 0));
    REQUIRE(truth.at<cv::Vec3f>(height / 2, width / 2)[2] > 0.9f);
    check_done(sphere.arguments(sphere.folder / "out/n.exr"));
    CHECK(same(layer(sphere.folder / "out/n.exr"), truth));
    for (const std::string extension : {".exr", ".tif", ".pfm", ".png"}) {
        const std::string output = sphere.folder / ("out/n" + extension);
        check_done(sphere.arguments(output));
        INFO(extension);
        // Reading makes lengths one again, and ½n + ½ has steps of 2/65535.
        CHECK(cv::norm(read_normals(output), truth, cv::NORM_INF) < (extension == ".png" ? 3e-5 : 3e-7));
    }
    const cv::Mat codes = cv::imread(sphere.folder / "out/n.png", cv::IMREAD_UNCHANGED);
    REQUIRE(codes.type() == CV_16UC3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto n = truth.at<cv::Vec3f>(y, x);
            const auto bgr = codes.at<cv::Vec3w>(y, x);
            for (int i = 0; i < 3; ++i)
                REQUIRE(bgr[2 - i] == (n == cv::Vec3f(0, 0, 0) ? 0 : std::lround((0.5 * n[i] + 0.5) * 65535)));
        }
}

TEST_CASE("normals program: what is wrong is told in one line") {
    const SphereAbove sphere("");
    check_refused(sphere.arguments(sphere.folder / "out/n.ply"), 2, ".ply");
    check_refused(sphere.arguments(sphere.folder / "out/n.exr", {"--method", "nearest"}), 2, "'nearest' is unknown");
    check_refused(sphere.arguments(sphere.folder / "out/n.exr", {"--noise", "0.001", "--max-error", "9"}), 2,
                  "--max-error");
    check_refused(sphere.arguments(sphere.folder / "out/n.exr", {"--space", "world"}), 1, "view matrix");
    check_refused(sphere.arguments(sphere.folder / "out/n.png", {"--png-scale", "1"}), 2, "--png-scale");
    CHECK(sphere.folder.results().empty());
}
