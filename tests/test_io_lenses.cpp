// Lenses from camera files and calibrations. The truth of OpenCV's is OpenCV's own projection.

#include "catch.hpp"
#include "io_files.hpp"
#include "matrices.hpp"

#include <fathom/fathom.hpp>
#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>
#include <fathom/pixel_rays.hpp>

#ifdef WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#endif
#include <opencv2/core.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

/// Pixels that OpenCV's projection and ours may differ by, with the rounding of both.
constexpr double opencv_px = 1e-6;

Camera read(const TempFolder& folder, const std::string& keys, int width = 640, int height = 480) {
    return camera_for(read_camera(put(folder / "camera.json", "{\"encoding\": \"ray-distance\", " + keys + "}")), width,
                      height);
}

const std::string pixels = R"("intrinsics": {"fx": 500, "fy": 510, "cx": 320, "cy": 240}, )";

} // namespace

TEST_CASE("lenses: OpenCV's own projection puts each ray on its pixel", "[io][lens]") {
#ifdef WITH_CALIB3D
    const TempFolder folder;
    const cv::Matx33d matrix(400.25, 0, 319.5, 0, 401.75, 240.125, 0, 0, 1);
    const auto written = [&](const std::vector<double>& k, bool fisheye) {
        const fs::path file = folder / "calibration.yml";
        cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
        storage << "image_width" << 640 << "image_height" << 480 << "camera_matrix" << cv::Mat(matrix)
                << "distortion_coefficients" << cv::Mat(k);
        if (fisheye)
            storage << "fisheye_model" << 1;
        storage.release();
        return camera_for(import_camera(file, {.preset = "encoding=view-z"}), 640, 480);
    };
    for (const auto& [k, fisheye] : std::vector<std::pair<std::vector<double>, bool>>{
             {{-0.3, 0.1, 1e-3, -5e-4}, false},
             {{0.1, -0.05, 1e-3, 2e-3, 0.01}, false},
             {{5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1}, false},
             {{-0.1, 0.02, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 2e-4, -1e-3, 1e-4}, false},
             {{-0.1, 0.02, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 2e-4, -1e-3, 1e-4, 0, 0}, false},
             {{0.05, -0.01, 0.002, -3e-4}, true}}) {
        const PixelRays rays(written(k, fisheye));
        double worst = 0;
        for (int y = 0; y < 480; y += 5)
            for (int x = 0; x < 640; x += 7) {
                const Eigen::Vector3d ray = rays.ray_of(x + 0.5, y + 0.5).value();
                if (std::atan2(ray.head<2>().norm(), ray.z()) > 89.9 * std::numbers::pi / 180)
                    continue;
                const std::vector<cv::Point3d> point{{ray.x(), ray.y(), ray.z()}};
                std::vector<cv::Point2d> pixel;
                if (fisheye)
                    cv::fisheye::projectPoints(point, pixel, cv::Vec3d(), cv::Vec3d(), matrix, k);
                else
                    cv::projectPoints(point, cv::Vec3d(), cv::Vec3d(), matrix, k, pixel);
                worst = std::max(worst, std::hypot(pixel[0].x - x, pixel[0].y - y)); // centres count from 0
            }
        std::printf("OpenCV's projection of our rays, %2zu coefficients%s: %.1e px\n", k.size(),
                    fisheye ? " of a fisheye" : "", worst);
        CHECK(worst <= opencv_px);
    }
    check_says(
        [&] {
            written({-0.1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.01, 0}, false);
        },
        {"tilted sensor", "\"rays\": FILE"});
#else
    std::cout << "skipped: OpenCV's projection, since libopencv-calib3d-dev was not there when this was built\n";
#endif
}

TEST_CASE("lenses: the camera file says the model, its coefficients, or the ends of a panorama", "[io][lens]") {
    const TempFolder folder;
    const Camera brown = read(folder, pixels + R"("lens": {"model": "brown", "k": [0.1, 0.2, 0.3, 0.4, 0.5]})");
    CHECK(brown.lens.value().law == LensLaw::brown);
    CHECK(brown.lens->k == std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5});
    CHECK((brown.lens->fx == 500 && brown.lens->fy == 510 && brown.lens->cx == 320 && brown.lens->cy == 240));
    const Camera untilted = read(folder, pixels + R"("lens": {"model": "brown", "k": [1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0]})");
    CHECK(untilted.lens.value().k.size() == 12);
    const Camera centre =
        read(folder, R"("pixel_origin": "centre", )" + pixels + R"("lens": {"model": "equidistant"})");
    CHECK(centre.lens.value().cx == 320.5);
    const Camera millimetres = read(folder, R"("lens_mm": 10, "sensor_mm": 32, "lens": {"model": "equisolid"})");
    CHECK((millimetres.lens.value().fx == 200 && millimetres.lens->cy == 240));
    const Camera panorama = read(folder, R"("lens": {"model": "equirectangular"})", 400, 200);
    CHECK(panorama.lens.value().fx == Approx(400 / (2 * std::numbers::pi)));
    CHECK((ray_of(panorama, 200, 100).value() - Eigen::Vector3d(0, 0, -1)).norm() < 1e-15);
    const Camera part = read(
        folder, R"("lens": {"model": "equirectangular", "longitude_deg": [0, 90], "latitude_deg": [-45, 0]})", 90, 45);
    CHECK((ray_of(part, 90, 0).value() - Eigen::Vector3d(1, 0, 0)).norm() < 1e-15);
    CHECK(ray_of(part, 0, 45).value().y() == Approx(-std::sqrt(0.5)));
    const Camera of_floats =
        read(folder, R"("lens": {"model": "equirectangular", "longitude_deg": [-180.000005, 180.000005]})", 400, 200);
    CHECK(of_floats.lens->fx == Approx(400 / (2 * std::numbers::pi)).epsilon(1e-14));
    const Camera face = read(folder, R"("lens": {"model": "cube-face"})", 64, 64);
    CHECK_FALSE(face.lens);
    CHECK((ray_of(face, 64, 32).value() - Eigen::Vector3d(1, 0, -1).normalized()).norm() < 1e-15);

    const auto refused = [&](const std::string& keys, const std::vector<std::string>& parts) {
        check_says([&] { read(folder, keys); }, parts);
    };
    refused(pixels + R"("lens": {"model": "brwn"})", {"camera.json", "lens.model", "the nearest is \"brown\""});
    refused(pixels + R"("lens": {"model": "inverse_brown_conrady"})", {"rays of pixels", "\"rays\": FILE"});
    for (const char* key : {"distortion", "dist_coeffs", "k1"})
        refused(pixels + R"(")" + key + R"(": 0)", {key, "\"lens\": {\"model\": \"brown\", \"k\": ["});
    refused(pixels + R"("lens": {"model": "equidistant", "k": [0, 0, 0, 0]})", {"opencv-fisheye"});
    refused(R"("lens": {"model": "equirectangular"}, "perspective": {"fov_y_deg": 60})", {"leave it out"});
    refused(pixels + R"("lens": {"model": "equidistant"}, "along": "cube")", {"all other"});
    refused(pixels + R"("lens": {"k": [1]})", {"lens.model", "is missing"});
    refused(pixels + R"("lens": {"model": "brown", "k": [1, 2]})",
            {"camera.json", "has 2 coefficients", "4, 5, 8 or 12"});
    refused(pixels + R"("lens": {"model": "brown", "k": [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0]})",
            {"camera.json", "has 14 coefficients", "tilted sensor", "\"rays\": FILE"});
    refused(pixels + R"("along": "cube")", {"camera.json", "along", "six faces", "\"lens\"", "equirectangular"});
    refused(pixels + R"("lens": {"model": "opencv-fisheye", "k": [1, 2]})", {"it takes 4: k1 k2 k3 k4"});
    refused(pixels + R"("lens": {"model": "brown", "k": 7})", {"lens.k", "must be numbers"});
    refused(pixels + R"("lens": {"model": "equirectangular"})", {"intrinsics", "leave"});
    refused(pixels + R"("lens": {"model": "brown", "k": [0, 0, 0, 0], "longitude_deg": [0, 1]})",
            {"longitude_deg", "equirectangular"});
    refused(R"("lens": {"model": "equirectangular", "longitude_deg": [0, 400]})", {"longitude_deg", "360"});
    refused(R"("lens": {"model": "equirectangular", "k": [1]})", {"lens.k", "coefficients"});
    refused(R"("lens": {"model": "brown", "k": [0, 0, 0, 0]}, "perspective": {"fov_y_deg": 60})",
            {"\"lens\" and \"perspective\""});
    refused(R"("lens": {"model": "equidistant"})", {"camera.json", "\"lens\" without \"intrinsics\"", "fx, fy, cx"});
    refused(pixels + R"("lens": {"model": "brown", "K": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]})",
            {"lens.K", "in \"intrinsics\""});
    for (const char* const keys :
         {R"("reversed": true, "lens": {"model": "brown", "k": [0, 0, 0, 0]})",
          R"("lens": {"model": "brown", "k": [0, 0, 0, 0], "reversed": true})",
          R"("lens": {"model": "brown", "k": [0, 0, 0, 0]}, "perspective": {"reversed": true})"})
        refused(pixels + keys, {"camera.json", "reversed", "\"depth_range\": [1, 0]"});
    check_says([&] { read_camera(put(folder / "c.json", R"({"lens": {"model": "equirectangular"}})")); },
               {"c.json", "window", "\"view-z\" or \"ray-distance\""});
}

TEST_CASE("lenses: a reversed depth buffer beside intrinsics is a depth range that is turned", "[io][lens]") {
    const TempFolder folder;
    const auto camera = [&](const std::string& keys) {
        return camera_for(read_camera(put(folder / "camera.json", R"({"width": 640, "height": 480, )" + keys + "}")),
                          640, 480);
    };
    const Camera straight = camera(R"("perspective": {"fov_y_deg": 60, "near": 0.5, "far": 20, "reversed": true})");
    Camera bent = camera(R"("near": 0.5, "far": 20, "depth_range": [1, 0], )" + pixels +
                         R"("lens": {"model": "brown", "k": [0, 0, 0, 0]})");
    bent.lens.reset(); // which changes no depth along the axis
    for (const double v : {0.0, 0.01, 0.3, 0.9, 1.0})
        CHECK(view_depth(bent, Storage::float32, 320, 240, v) ==
              Approx(static_cast<double>(view_depth(straight, Storage::float32, 320, 240, v))).epsilon(1e-6));
}

TEST_CASE("lenses: the preset of a panorama takes what its depth counts along", "[io][lens]") {
    const Camera cube = preset_camera("habitat-panorama:along=cube", 320, 160);
    CHECK((cube.encoding == Encoding::view_z && cube.along == Along::cube));
    CHECK(cube.lens.value().law == LensLaw::equirectangular);
    CHECK(preset_camera("habitat-panorama", 320, 160).encoding == Encoding::ray_distance);
    check_says([] { preset_camera("hypersim:fov_x_deg=60,along=ray", 320, 160); }, {"along", "ray-distance"});
}

TEST_CASE("lenses: pictures that are not of their lens's shape are told, and depth of a lens that nobody says",
          "[io][lens]") {
    const auto said = [](const std::string& keys, int width, int height) {
        return key_doubts("{" + keys + "}", width, height);
    };
    for (const std::string preset :
         {R"("preset": "habitat-panorama")", R"("encoding": "ray-distance", "lens": {"model": "equirectangular"})"}) {
        CHECK(said(preset, 320, 160).empty());
        CHECK(said(preset, 321, 160).empty());
        REQUIRE(said(preset, 320, 100).size() == 1);
        CHECK(said(preset, 320, 100).front().find("\"latitude_deg\"") != std::string::npos);
    }
    CHECK(said(R"("preset": "habitat-panorama", "lens": {"latitude_deg": [-40, 40]})", 320, 100).empty());
    CHECK(said(R"("preset": "habitat-panorama", "lens": {"model": "equirectangular", "longitude_deg": [0, 90]})", 320,
               100)
              .empty());
    const std::string face = R"("encoding": "view-z", "lens": {"model": "cube-face"})";
    CHECK(said(face, 64, 64).empty());
    REQUIRE(said(face, 160, 90).size() == 1);
    CHECK(said(face, 160, 90).front().find("not square") != std::string::npos);
    const std::string millimetres =
        R"("encoding": "ray-distance", "intrinsics": {"fx": 13.3, "fy": 13.3, "cx": 240, "cy": 160}, "lens": )";
    CHECK(said(millimetres + R"({"model": "blender-polynomial", "k": [0, -0.02, 0, 0, 0]})", 480, 320).empty());
    CHECK(said(millimetres + R"({"model": "equidistant"})", 480, 320).size() == 1);
    const std::string azure =
        R"("preset": "azure-kinect", "intrinsics": {"fx": 150, "fy": 148, "cx": 163.2, "cy": 117.7})";
    REQUIRE(said(azure, 320, 240).size() == 1);
    CHECK(said(azure, 320, 240).front().find("preset kinect if it was undone") != std::string::npos);
    CHECK(said(azure + R"(, "lens": {"model": "brown", "k": [0.1, 0, 0, 0]})", 320, 240).empty());
}

TEST_CASE("lenses: of a calibration whose distortion was undone the lens is kept for doubts alone", "[io][lens]") {
    const TempFolder folder;
    const auto file = [&](const std::string& k, const std::string& rest = "") {
        return put(folder / "calibration.yml",
                   "image_width: 640\nimage_height: 480\n"
                   "camera_matrix: [500, 0, 320.5, 0, 510, 240.5, 0, 0, 1]\ndistortion_coefficients: " +
                       k + "\n" + rest);
    };
    const auto undistorted = [&](const std::string& k, const std::string& rest = "") {
        const ImportedCamera made =
            import_camera(file(k, rest), {.preset = "kinect", .undistorted = true, .storage = Storage::uint16});
        const Camera camera = camera_for(made, 640, 480);
        CHECK_FALSE(camera.lens.has_value());
        const Camera again = camera_for(read_camera(put(folder / "again.json", made.text)), 640, 480);
        REQUIRE(again.raw_lens.has_value() == camera.raw_lens.has_value());
        if (camera.raw_lens)
            CHECK((again.raw_lens->fx == camera.raw_lens->fx && again.raw_lens->k == camera.raw_lens->k));
        return camera;
    };
    const LensModel brown = undistorted("[-0.3, 0.1, 0, 0, 0]").raw_lens.value();
    CHECK((brown.law == LensLaw::brown && brown.fx == 500 && brown.fy == 510 && brown.cx == 321 && brown.cy == 241));
    CHECK(brown.k == std::vector{-0.3, 0.1, 0.0, 0.0, 0.0});
    CHECK(undistorted("[0.05, 0, 0, 0]", "fisheye_model: 1\n").raw_lens.value().law == LensLaw::opencv_fisheye);
    // Nothing is computed with it, so that one that Fathom does not know is no error.
    for (const char* const k :
         {"[0, 0, 0, 0, 0]", "[0.1, 0, 0, 0, 0, 0]", "[0.1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.01, 0]"})
        CHECK_FALSE(undistorted(k).raw_lens.has_value());
    for (const char* const rest : {"", "fisheye_model: 1\n"}) // which are not those of four
        check_says([&] { import_camera(file("[0.1, 0.01, 0.001]", rest), {.preset = "kinect"}); },
                   {"calibration.yml", "distortion_coefficients", "3 coefficients"});
    const std::string p = "projection_matrix: [400, 0, 310.5, 0, 0, 410, 230.5, 0, 0, 0, 1, 0]\ndistortion_model: ";
    const Camera ros = undistorted("[-0.3, 0.1, 0, 0, 0]", p + "plumb_bob\n");
    CHECK((ros.raw_lens.value().fx == 500 && ros.raw_lens->cx == 321));
    CHECK_FALSE(undistorted("[-0.3, 0.1, 0, 0, 0]", p + "spherical\n").raw_lens.has_value());

    const auto refused = [&](const std::string& keys, const std::vector<std::string>& words) {
        check_says([&] { read(folder, pixels + keys); }, words);
    };
    const std::string own = R"("intrinsics": {"fx": 1, "fy": 1, "cx": 0, "cy": 0})";
    refused(R"("raw_lens": {"k": [0.1, 0, 0, 0], )" + own + "}", {"raw_lens", "model"});
    refused(R"("raw_lens": {"model": "brown", "k": [0.1, 0, 0, 0]})", {"raw_lens", "intrinsics"});
    refused(R"("raw_lens": {"model": "brown", "k": [0.1, 0], )" + own + "}", {"camera.json", "k"});
    refused(R"("raw_lens": {"model": "equirectangular", )" + own + "}", {"raw_lens", "model", "distortion"});
    refused(R"("lens": {"model": "equidistant"}, "raw_lens": {"model": "equidistant", )" + own + "}",
            {"both", "raw_lens"});
}

TEST_CASE("lenses: calibrations of ROS, COLMAP and nerfstudio become lenses", "[io][lens]") {
    const TempFolder folder;
    const auto lens_of = [&](const std::string& name, const std::string& text,
                             const ImportOptions& options = {.preset = "encoding=view-z"}) {
        return import_camera(put(folder / name, text), options).camera.lens;
    };
    const auto ros = [&](const std::string& model, const std::string& d) {
        return lens_of("info.yaml", "width: 640\nheight: 480\ndistortion_model: " + model + "\nd: " + d +
                                        "\nk: [500, 0, 320, 0, 500, 240, 0, 0, 1]\n");
    };
    CHECK(ros("plumb_bob", "[0.1, 0.2, 0.3, 0.4, 0.5]").value().k == std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5});
    CHECK(ros("rational_polynomial", "[1, 2, 0, 0, 3, 4, 5, 6]").value().k.size() == 8);
    CHECK(ros("equidistant", "[0.1, 0, 0, 0]").value().law == LensLaw::opencv_fisheye);
    CHECK(ros("equidistant", "[0.1, 0, 0, 0]").value().cx == 320.5);
    CHECK_FALSE(ros("plumb_bob", "[0, 0, 0, 0, 0]"));

    const auto colmap = [&](const std::string& model, const std::string& parameters) {
        put(folder / "images.txt", std::string("1 1 0 0 0 0 0 0 1 a.jpg\n\n"));
        return lens_of("cameras.txt", "1 " + model + " 640 480 " + parameters + "\n");
    };
    CHECK(colmap("SIMPLE_RADIAL", "500 320 240 0.1").value().k == std::vector<double>{0.1, 0, 0, 0});
    CHECK(colmap("RADIAL", "500 320 240 0.1 0.2").value().k == std::vector<double>{0.1, 0.2, 0, 0});
    CHECK(colmap("FULL_OPENCV", "500 500 320 240 1 2 0 0 3 4 5 6").value().k ==
          std::vector<double>{1, 2, 0, 0, 3, 4, 5, 6});
    CHECK(colmap("RADIAL_FISHEYE", "500 320 240 0.1 0.02").value().k == std::vector<double>{0.1, 0.02, 0, 0});
    CHECK(colmap("OPENCV_FISHEYE", "500 500 320 240 0 0 0 0").value().law == LensLaw::opencv_fisheye);
    CHECK_FALSE(colmap("OPENCV", "500 500 320 240 0 0 0 0"));

    const auto nerfstudio = [&](const std::string& keys) {
        return lens_of(
            "transforms.json",
            R"({"fl_x": 500, "fl_y": 500, "cx": 320, "cy": 240, "w": 640, "h": 480, )" + keys +
                R"("frames": [{"file_path": "a.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
    };
    CHECK(nerfstudio(R"("k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4, "k3": 0.5, )").value().k ==
          std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5});
    CHECK(nerfstudio(R"("camera_model": "OPENCV_FISHEYE", "k1": 0.1, )").value().k ==
          std::vector<double>{0.1, 0, 0, 0});
    CHECK_FALSE(nerfstudio(""));
}

TEST_CASE("lenses: nerfstudio's panoramas see where its formula says", "[io][lens]") {
    const TempFolder folder;
    const auto camera = [&](const std::string& keys) {
        return import_camera(put(folder / "transforms.json",
                                 R"({"camera_model": "EQUIRECTANGULAR", "w": 800, "h": 400, )" + keys +
                                     R"("frames": [{"file_path": "a.png", "depth_file_path": "a.depth.png",
            "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})"))
            .camera;
    };
    for (const auto& [keys, f, cx, cy] : {std::tuple("", 400.0, 400.0, 200.0),
                                          {R"("fl_x": 400, "fl_y": 400, "cx": 400, "cy": 200, )", 400, 400, 200},
                                          {R"("fl_x": 900, "fl_y": 900, "cx": 380, "cy": 210, )", 900, 380, 210}}) {
        const Camera read = camera(keys);
        CHECK((read.encoding == Encoding::ray_distance && read.scale == 0.001 && read.missing == 0));
        for (const double x : {0.5, 123.0, 700.25})
            for (const double y : {0.5, 200.0, 399.5}) {
                // nerfstudio, cameras.py
                const double theta = -std::numbers::pi * (x - cx) / f, phi = std::numbers::pi * (0.5 + (y - cy) / f);
                const Eigen::Vector3d ray(-std::sin(theta) * std::sin(phi), std::cos(phi),
                                          -std::cos(theta) * std::sin(phi));
                CHECK((ray_of(read, x, y).value() - ray).norm() < 1e-12);
            }
    }
    check_says([&] { camera(R"("fl_x": 100, "cx": 400, )"); }, {"transforms.json", "longitude_deg", "360"});
}

TEST_CASE("lenses: a map of rays is read from EXR, TIFF and NPY, and is the lens that it was made of", "[io][lens]") {
    const TempFolder folder;
    const Camera fisheye = read(folder, pixels + R"("view_axes": "opencv", "lens": {"model": "opencv-fisheye",
        "k": [0.05, -0.01, 0.002, -0.0003]})",
                                160, 120);
    const PixelRays rays(fisheye);
    cv::Mat map = filled<cv::Vec3f>(160, 120, [&](int x, int y) {
        const Eigen::Vector3f ray = rays.ray_of(x + 0.5, y + 0.5).value().cast<float>();
        return cv::Vec3f(ray.x(), ray.y(), ray.z());
    });
    map.at<cv::Vec3f>(7, 9) = {0, 0, 0};
    cv::Mat depth(map.size(), CV_32FC1, cv::Scalar(2.5));
    const Device device = Device::open("cpu");
    const auto positions = [&](const Camera& camera) { return to_mat(unproject({to_device(device, depth), camera})); };
    const cv::Mat expected = positions(fisheye);
    for (const char* const name : {"rays.exr", "rays.tif", "rays.npy"}) {
        write_image(folder / name, map, {.channels = {"X", "Y", "Z"}});
        const auto file =
            put(folder / "map.json", std::string(R"({"encoding": "ray-distance", "view_axes": "opencv", )") +
                                         R"("lens": {"rays": ")" + name + R"("}})");
        const CameraFile read_file = import_camera(file);
        CHECK(read_file.camera.width == 160);
        const Camera camera = camera_for(read_file, 160, 120);
        CHECK(camera.lens.value().law == LensLaw::rays);
        CHECK_FALSE(ray_of(camera, 9.5, 7.5));
        const cv::Mat found = positions(camera);
        double worst = 0;
        for (int y = 0; y < map.rows; ++y)
            for (int x = 0; x < map.cols; ++x)
                if (x != 9 || y != 7)
                    worst = std::max(worst, cv::norm(found.at<cv::Vec3f>(y, x) - expected.at<cv::Vec3f>(y, x)) / 2.5);
        std::printf("positions through %s: off %.2f * 2^-24 of the distance\n", name, worst * 0x1p24);
        CHECK(worst <= 2 * unproject_relative_error); // of both
        CHECK(std::isnan(found.at<cv::Vec3f>(7, 9)[0]));
        CHECK((pixel_of(camera, rays.ray_of(60.3, 40.7).value()).value() - Eigen::Vector2d(60.3, 40.7)).norm() < 2e-3);
        check_says([&] { camera_for(read_file, 320, 240); }, {"160 x 120", "320 x 240"});
    }
    const auto refused = [&](const std::string& text, const std::vector<std::string>& parts) {
        check_says([&] { import_camera(put(folder / "c.json", text)); }, parts);
    };
    refused(R"({"encoding": "view-z", "lens": {"rays": "nowhere.npy"}})", {"nowhere.npy"});
    refused(R"({"encoding": "view-z", "width": 8, "height": 8, "lens": {"rays": "rays.npy"}})",
            {"c.json", "8 x 8", "160 x 120"});
    refused(R"({"encoding": "view-z", "lens": {"rays": "rays.npy", "model": "brown"}})",
            {"lens", "both \"model\" and \"rays\""});
    refused(
        R"({"encoding": "view-z", "lens": {"rays": "rays.npy"}, "intrinsics": {"fx": 1, "fy": 1, "cx": 1, "cy": 1}})",
        {"intrinsics"});
    for (const auto& [name, x, y, z] : {std::tuple("nothing.npy", 0, 0, 0), {"opengl.npy", 1, -1, -1}}) {
        write_image(folder / name, map.mul(cv::Mat(map.size(), CV_32FC3, cv::Scalar(x, y, z))));
        refused(std::string(R"({"encoding": "view-z", "lens": {"rays": ")") + name + R"("}})",
                {z == 0 ? "has no ray" : "x right, y down and z ahead"});
    }
    cv::Mat picture(8, 8, CV_32FC3, cv::Scalar(3, 4, 5));
    write_image(folder / "picture.exr", picture, {.channels = {"X", "Y", "Z"}});
    refused(R"({"encoding": "view-z", "lens": {"rays": "picture.exr"}})", {"picture.exr"});
    write_image(folder / "grey.png", depth, {.png_scale = 1000});
    write_image(folder / "depth.exr", depth, {.channels = {"Z"}});
    for (const char* const name : {"grey.png", "depth.exr"})
        refused(std::string(R"({"encoding": "view-z", "lens": {"rays": ")") + name + R"("}})",
                {name, "a map of rays has three channels of floats"});
}
