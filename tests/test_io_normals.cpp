// Normals out of files: which layers and pictures are normals, in which order and range, and what is refused.
#include "io_files.hpp"
#include "matrices.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

// Three normals, and nothing.
cv::Mat three_normals() {
    cv::Mat normals(1, 4, CV_32FC3);
    normals.at<cv::Vec3f>(0, 0) = {1, 0, 0};
    normals.at<cv::Vec3f>(0, 1) = {0, -0.6f, 0.8f};
    normals.at<cv::Vec3f>(0, 2) = {0.48f, 0.6f, -0.64f};
    normals.at<cv::Vec3f>(0, 3) = {0, 0, 0};
    return normals;
}

double difference(const cv::Mat& a, const cv::Mat& b) {
    REQUIRE(a.type() == CV_32FC3);
    REQUIRE(a.size() == b.size());
    return cv::norm(a, b, cv::NORM_INF);
}

std::string refused(const fs::path& file, const std::string& layer = {}) {
    return refusal([&] { read_normals(file, layer); });
}

} // namespace

TEST_CASE("read normals: floats of EXR, TIFF and PFM, in x, y, z order", "[io]") {
    const TempFolder folder;
    const cv::Mat normals = three_normals();
    for (const std::vector<std::string>& names : {std::vector<std::string>{"N.X", "N.Y", "N.Z"},
                                                  {"Normal.X", "Normal.Y", "Normal.Z"},
                                                  {"ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z"},
                                                  {"normals.R", "normals.G", "normals.B"},
                                                  {"X", "Y", "Z"},
                                                  {"R", "G", "B"}}) {
        write_image(folder / "n.exr", normals, {.channels = names});
        INFO(names.front());
        CHECK(difference(read_normals(folder / "n.exr"), normals) < 1e-7);
    }
    for (const char* name : {"n.tif", "n.pfm"}) {
        write_image(folder / name, normals);
        INFO(name);
        CHECK(difference(read_normals(folder / name), normals) < 1e-7);
    }
}

TEST_CASE("read normals: a layer is chosen by its name, among others", "[io]") {
    const TempFolder folder;
    const cv::Mat normals = three_normals();
    const cv::Mat other = -normals;
    const cv::Mat all = merged({other, normals});
    write_image(folder / "n.exr", all,
                {.channels = {"View.Position.X", "View.Position.Y", "View.Position.Z", "View.Normal.X", "View.Normal.Y",
                              "View.Normal.Z"}});
    CHECK(difference(read_normals(folder / "n.exr"), normals) < 1e-7);
    CHECK(difference(read_normals(folder / "n.exr", "View.Position"), other) < 1e-7);
    check_says(refused(folder / "n.exr", "View.Norm"), {"n.exr", "no layer \"View.Norm\"", "View.Normal.X"});
    write_image(folder / "no.exr", all, {.channels = {"A.X", "A.Y", "A.Z", "B.X", "B.Y", "B.Z"}});
    check_says(refused(folder / "no.exr"), {"no.exr", "named like normals", "A.X"});
}

TEST_CASE("read normals: pictures of them hold half of n and a half, black where there is none", "[io]") {
    const TempFolder folder;
    const cv::Mat normals = three_normals();
    for (const int type : {CV_8UC3, CV_16UC3, CV_8UC4, CV_16UC4}) {
        const double largest = CV_MAT_DEPTH(type) == CV_8U ? 255 : 65535;
        cv::Mat codes(normals.size(), type, cv::Scalar::all(largest));
        for (int x = 0; x < normals.cols; ++x)
            for (int i = 0; i < 3; ++i) {
                const auto n = normals.at<cv::Vec3f>(0, x);
                const long code = n == cv::Vec3f(0, 0, 0) ? 0 : std::lround((0.5 * n[i] + 0.5) * largest);
                if (CV_MAT_DEPTH(type) == CV_8U)
                    codes.ptr<uchar>(0)[x * codes.channels() + 2 - i] = static_cast<uchar>(code); // blue first
                else
                    codes.ptr<ushort>(0)[x * codes.channels() + 2 - i] = static_cast<ushort>(code);
            }
        Bytes bytes;
        REQUIRE(cv::imencode(".png", codes, bytes));
        const fs::path file = put(folder / "n.png", bytes);
        const cv::Mat read = read_normals(file);
        INFO(largest << ", " << codes.channels() << " channels");
        CHECK(difference(read, normals) < 2.5 / largest);
        CHECK(read.at<cv::Vec3f>(0, 3) == cv::Vec3f(0, 0, 0));
        for (int x = 0; x < 3; ++x)
            CHECK(cv::norm(read.at<cv::Vec3f>(0, x)) == Approx(1).margin(2.5 / largest));
    }
}

TEST_CASE("read normals: lengths stay, and what has none is none", "[io]") {
    const TempFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    cv::Mat normals(1, 12, CV_32FC3, cv::Scalar(0, 0, 1));
    normals.at<cv::Vec3f>(0, 0) = {0.3f, 0, 0.4f};
    normals.at<cv::Vec3f>(0, 1) = {nan, 0, 1};
    normals.at<cv::Vec3f>(0, 2) = {0, infinite, 0};
    normals.at<cv::Vec3f>(0, 3) = {0, 1e-5f, 0};
    normals.at<cv::Vec3f>(0, 4) = {0, -30, 40};
    write_image(folder / "n.pfm", normals);
    const cv::Mat read = read_normals(folder / "n.pfm");
    CHECK(read.at<cv::Vec3f>(0, 0) == cv::Vec3f(0.3f, 0, 0.4f));
    for (const int x : {1, 2, 3})
        CHECK(read.at<cv::Vec3f>(0, x) == cv::Vec3f(0, 0, 0));
    CHECK(read.at<cv::Vec3f>(0, 4) == cv::Vec3f(0, -30, 40));
    write_image(folder / "p.pfm", 3 * normals);
    check_says([&] { read_normals(folder / "p.pfm"); },
               {"p.pfm: holds 9 vectors, 9 of which have lengths unlike 1", "a picture or positions"});
}

TEST_CASE("read normals: what holds none is refused in one line", "[io]") {
    const TempFolder folder;
    check_says(refused(folder / "missing.exr"), {"missing.exr"});
    write_image(folder / "z.tif", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)));
    check_says(refused(folder / "z.tif"), {"z.tif", "32-bit float with 1 channel", "three channels x, y, z"});
    write_image(folder / "z.exr", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)));
    check_says(refused(folder / "z.exr"), {"z.exr", "named like normals", "Z"});
    write_image(folder / "n.pfm", three_normals());
    check_says(refused(folder / "n.pfm", "Normal"), {"n.pfm", "no OpenEXR file", "\"Normal\""});
    check_says(refused(put(folder / "text.png", "no picture")), {"text.png", "no image that holds normals"});
}
