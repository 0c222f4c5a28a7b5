// Pictures and packed depth in a cv::Mat are B, G, R as OpenCV's own are, whichever way they came; files hold R, G, B.
#include "program.hpp"

#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

// Codes of 24 bits as CARLA's camera encodes them, R the lowest: some that tell the bytes apart, the ends, and noise.
std::vector<std::uint32_t> carla_codes() {
    std::vector<std::uint32_t> codes{0x000000, 0xffffff, 0xfffffe, 0x000001, 0x000100, 0x010000, 0x123456, 0x0000ff};
    std::mt19937 random(3); // NOLINT: the same codes every time
    while (codes.size() < static_cast<std::size_t>(width * height))
        codes.push_back(random() & 0xffffff);
    return codes;
}

// A PNG with R, G, B and perhaps an alpha that says nothing. OpenCV's encoder takes B first.
std::string carla_file(const Folder& folder, const std::vector<std::uint32_t>& codes, int channels) {
    cv::Mat bgr(height, width, CV_8UC(channels), cv::Scalar::all(255));
    for (std::size_t i = 0; i < codes.size(); ++i)
        for (std::size_t byte = 0; byte < 3; ++byte)
            bgr.data[i * static_cast<std::size_t>(channels) + 2 - byte] =
                static_cast<unsigned char>(codes[i] >> (8 * byte));
    const std::string file = folder / ("carla-" + std::to_string(channels) + ".png");
    cv::imwrite(file, bgr);
    return file;
}

} // namespace

TEST_CASE("bgr: a CARLA PNG is the same depth through fathom_io, OpenCV and the program", "[io]") {
    constexpr double far = 1000, largest = (1 << 24) - 1;
    const Folder folder;
    const std::vector<std::uint32_t> codes = carla_codes();
    const std::string camera = folder / "camera.json";
    write(camera, R"({"perspective": {"fov_x_deg": 90, "aspect": 1.5}, "encoding": "view-z",
                      "scale": 5.960464832810452e-05, "background": 16777215, "packing": "rgb-low-first"})");
    const CameraFile file = read_camera(camera);
    const Camera sized = camera_for(file, width, height);
    const Device device = Device::open();
    for (const int channels : {3, 4}) {
        INFO(channels << " channels");
        const std::string input = carla_file(folder, codes, channels), out = folder / "out/z.tif";

        const DepthFile depth = read_depth(input, {.packing = file.packing});
        CHECK(depth.storage == Storage::bgr8_red_low);
        const cv::Mat by_io = to_mat(linearize({to_device(device, depth.values), sized, depth.storage}).image);
        cv::Mat by_opencv;
        linearize(device, cv::imread(input), sized, by_opencv, {}, Storage::bgr8_red_low);
        check_done({"linearize", input, "--camera", camera, "-o", out});
        const cv::Mat by_program = channel(out);
        CHECK(same(by_io, by_opencv));
        CHECK(same(by_io, by_program));

        double worst = 0;
        for (std::size_t i = 0; i < codes.size(); ++i) {
            const float z = by_io.at<float>(static_cast<int>(i));
            const double truth = far * codes[i] / largest;
            if (codes[i] == 0xffffff)
                CHECK(z == INFINITY); // the far end is the sky
            else if (codes[i] == 0)
                CHECK(std::isnan(z)); // nothing lies at the camera
            else
                worst = std::max(worst, std::abs(z - truth) / std::ldexp(1, std::ilogb(truth)));
        }
        CHECK(worst <= 0x1p-23);
    }
}

TEST_CASE("bgr: packed bytes mean the same in either order, and pictures keep their colours", "[io]") {
    const Folder folder;
    const std::vector<std::uint32_t> codes = carla_codes();
    const std::string camera = camera_file(folder), input = carla_file(folder, codes, 3);
    const Camera sized = camera_for(read_camera(camera), width, height);
    const Device device = Device::open();
    const cv::Mat bgr = cv::imread(input);
    cv::Mat rgb(bgr.size(), bgr.type());
    const int pairs[] = {0, 2, 1, 1, 2, 0};
    cv::mixChannels(&bgr, 1, &rgb, 1, pairs, 3);
    const auto decoded = [&](const cv::Mat& bytes, Storage storage) {
        return to_mat(linearize({to_device(device, bytes), sized, storage}).image);
    };
    CHECK(same(decoded(bgr, Storage::bgr8_red_low), decoded(rgb, Storage::rgb8_red_low)));
    CHECK(same(decoded(bgr, Storage::bgr8_red_high), decoded(rgb, Storage::rgb8_red_high)));
    CHECK(!same(decoded(bgr, Storage::bgr8_red_low), decoded(bgr, Storage::bgr8_red_high)));
    for (const auto packing : {Packing::rgb_red_low, Packing::rgb_red_high}) {
        const DepthFile depth = read_depth(input, {.packing = packing});
        CHECK(depth.storage == (packing == Packing::rgb_red_low ? Storage::bgr8_red_low : Storage::bgr8_red_high));
        CHECK(same(depth.values, bgr));
    }
}

TEST_CASE("bgr: a PFM of floats has R before G before B", "[io]") {
    const Folder folder;
    const cv::Mat color = filled<cv::Vec3f>(
        5, 4, [](int x, int y) { return cv::Vec3f(static_cast<float>(x), static_cast<float>(10 * y), 0.5f); });
    write_color(folder / "raw.pfm", color);
    CHECK(same(read_color(folder / "raw.pfm"), color));
    const std::string bytes = content(folder / "raw.pfm"); // its lowest row comes first
    float last[3];
    std::memcpy(last, bytes.data() + bytes.size() - sizeof last, sizeof last);
    CHECK((last[0] == 0.5f && last[1] == 0 && last[2] == 4));
    CHECK_THROWS_AS(write_color(folder / "grey.exr", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1))), Error);
}
