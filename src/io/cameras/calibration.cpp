// Calibrations in YAML: OpenCV's, and CameraInfo of ROS as a file or as a printed message; KITTI's lines of matrices.
//   x = fx X/Z + cx, y = fy Y/Z + cy, pixels counted from the centre of the first one; x right, y down, z ahead
// OpenCV, calib3d; ROS, sensor_msgs/CameraInfo and REP 104 (P of rectified images, K of raw ones; regions and binning
// as image_geometry has them), REP 118 (integers are millimetres, 0 is not measured; floats are metres, NaN is not).
#include "camera_formats.hpp"

#include "camera/form.hpp"
#include "camera_file/file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <sstream>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

/// A node's text for a message; a list or a map says what it is.
std::string shown(const YAML::Node& node) {
    return node.IsScalar()     ? node.Scalar().substr(0, 60)
           : node.IsMap()      ? "a map"
           : node.IsSequence() ? "a list"
                               : "nothing";
}

double number(const fs::path& file, const YAML::Node& node, const std::string& name) {
    double value = std::nan("");
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value))
        refuse(file, "\"" + name + "\": " + shown(node) + " must be a finite number");
    return value;
}

/// The value under the first of the keys that is there.
YAML::Node value(const YAML::Node& map, std::initializer_list<const char*> keys) {
    for (const char* key : keys)
        if (const YAML::Node node = map[key]; node && !node.IsNull())
            return node;
    return YAML::Node(YAML::NodeType::Undefined);
}

/// The numbers of a list, of a list of rows, or of a matrix with its rows, columns and data.
std::vector<double> numbers(const fs::path& file, const YAML::Node& node, const std::string& name) {
    const YAML::Node list = node.IsMap() ? node["data"] : node;
    if (!list || !list.IsSequence())
        refuse(file, "\"" + name + "\": must be a list of numbers, or a matrix with rows, cols and data");
    constexpr std::size_t most = 1000; // no camera has so many, and a list of them takes seconds
    if (list.size() > most)
        refuse(file, "\"" + name + "\": has " + std::to_string(list.size()) +
                         " numbers or rows; a camera's have at most " + std::to_string(most));
    std::vector<double> all;
    const auto add = [&](const YAML::Node& each) {
        all.push_back(number(file, each, name + "[" + std::to_string(all.size()) + "]"));
    };
    for (const YAML::Node& each : list) {
        if (each.IsSequence() && each.size() != list[0].size())
            refuse(file, "\"" + name + "\": has rows of different lengths");
        if (each.IsSequence())
            std::ranges::for_each(each, add);
        else
            add(each);
    }
    if (node.IsMap() && node["rows"] && node["cols"] &&
        number(file, node["rows"], name + ".rows") * number(file, node["cols"], name + ".cols") !=
            static_cast<double>(all.size()))
        refuse(file, "\"" + name + "\": has " + std::to_string(all.size()) + " numbers, which are not rows times cols");
    return all;
}

std::vector<double> matrix(const fs::path& file, const YAML::Node& node, const std::string& name, std::size_t count) {
    auto all = numbers(file, node, name);
    if (all.size() != count)
        refuse(file, "\"" + name + "\": has " + std::to_string(all.size()) + " numbers; it must have " +
                         std::to_string(count));
    return all;
}

/// A whole number of pixels; 0 where there is none.
int count(const fs::path& file, const YAML::Node& node, const std::string& name) {
    if (!node.IsDefined())
        return 0;
    const double pixels = number(file, node, name);
    if (!(pixels >= 0 && pixels <= 1e9 && pixels == std::floor(pixels)))
        refuse(file, "\"" + name + "\": " + shown(node) + " must be a whole number of pixels");
    return static_cast<int>(pixels);
}

void set_lens(Imported& imported, const json& lens) {
    if (!lens.empty())
        imported.keys["lens"] = lens;
}

/// The lens that was undone, with which nothing is computed: one that Fathom does not know is left out.
void set_raw_lens(Imported& imported, const std::function<json()>& lens, json intrinsics) {
    json raw;
    try {
        raw = lens();
    } catch (const Error&) {
    }
    if (raw.empty())
        return;
    raw["intrinsics"] = std::move(intrinsics);
    imported.keys["raw_lens"] = std::move(raw);
}

Imported import_opencv(const fs::path& file, const YAML::Node& map, const ImportOptions& options) {
    Imported imported{.keys = {{"view_axes", "opencv"}},
                      .cure =
                          "name its source or give the keys: --preset kinect, or --preset encoding=view-z,scale=0.001"};
    imported.keys["intrinsics"] =
        intrinsics_of(file, matrix(file, map["camera_matrix"], "camera_matrix", 9), 3, "camera_matrix");
    for (const auto& [key, name] : {std::pair{"width", "image_width"}, {"height", "image_height"}})
        if (const int pixels = count(file, value(map, {name}), name); pixels > 0)
            imported.keys[key] = pixels;
    const auto lens = [&]() -> json {
        const YAML::Node is_fisheye = value(map, {"fisheye_model"});
        const bool fisheye = is_fisheye.IsDefined() && count(file, is_fisheye, "fisheye_model") != 0;
        for (const char* key : {"distortion_coefficients", "distCoeffs", "dist_coeffs", "dist_coeff", "dist"})
            if (const YAML::Node node = value(map, {key}); node.IsDefined() || fisheye) {
                const auto k = node.IsDefined() ? numbers(file, node, key) : std::vector<double>(4);
                return fisheye ? fisheye_lens(file, k, key) : opencv_lens(file, k, key);
            }
        return {};
    };
    if (options.undistorted)
        set_raw_lens(imported, lens, imported.keys["intrinsics"]);
    else
        set_lens(imported, lens());
    return imported;
}

/// What a camera's driver made of its sensor: a region of it, pixels put together.
struct Readout {
    int x = 0, y = 0, width = 0, height = 0, across = 1, down = 1;
};

Readout readout_of(const fs::path& file, const YAML::Node& map) {
    Readout out{.width = count(file, value(map, {"width", "image_width"}), "width"),
                .height = count(file, value(map, {"height", "image_height"}), "height")};
    out.across = std::max(1, count(file, value(map, {"binning_x"}), "binning_x"));
    out.down = std::max(1, count(file, value(map, {"binning_y"}), "binning_y"));
    if (const YAML::Node roi = value(map, {"roi"}); roi.IsDefined()) {
        if (!roi.IsMap())
            refuse(file, "\"roi\": " + shown(roi) + " must be a map");
        out.x = count(file, value(roi, {"x_offset"}), "roi.x_offset");
        out.y = count(file, value(roi, {"y_offset"}), "roi.y_offset");
        const int width = count(file, value(roi, {"width"}), "roi.width");
        const int height = count(file, value(roi, {"height"}), "roi.height");
        out.width = width > 0 ? width : out.width;
        out.height = height > 0 ? height : out.height;
    }
    return out;
}

Imported import_ros(const fs::path& file, const YAML::Node& map, const ImportOptions& options) {
    const auto k = matrix(file, value(map, {"camera_matrix", "k", "K"}), "K", 9);
    if (k[0] == 0)
        refuse(file, "\"K\": is 0, so the camera was never calibrated; calibrate it (camera_calibration)");
    const YAML::Node d = value(map, {"distortion_coefficients", "d", "D"});
    const YAML::Node model = value(map, {"distortion_model"});
    const std::string name = model.IsDefined() && model.IsScalar() ? model.Scalar() : "";
    const bool pinhole = name.empty() || name == "plumb_bob" || name == "rational_polynomial",
               fisheye = name == "equidistant" || name == "fisheye";
    Imported imported{
        .keys = {{"view_axes", "opencv"}},
        .cure = "name the topic's type: --preset kinect for 16UC1 (millimetres), --preset encoding=view-z for "
                "32FC1 (metres)"};
    const auto lens = [&] {
        auto coefficients = d.IsDefined() ? numbers(file, d, "D") : std::vector<double>();
        if (coefficients.empty())
            coefficients.resize(4);
        if (!pinhole && !fisheye)
            refuse(file,
                   "\"D\": is a lens distortion that Fathom does not know (" + name +
                       "); take the depth of a rectified topic (image_proc) and say --undistorted, which takes P");
        return fisheye ? fisheye_lens(file, coefficients, "D") : opencv_lens(file, coefficients, "D");
    };
    const Readout out = readout_of(file, map);
    // Of the whole sensor to pixels of the region.
    const auto read_out = [&](json pixels) {
        pixels["fx"] = pixels["fx"].get<double>() / out.across;
        pixels["fy"] = pixels["fy"].get<double>() / out.down;
        pixels["cx"] = (pixels["cx"].get<double>() - out.x) / out.across;
        pixels["cy"] = (pixels["cy"].get<double>() - out.y) / out.down;
        return pixels;
    };
    if (options.undistorted) {
        const YAML::Node p = value(map, {"projection_matrix", "p", "P"});
        if (!p.IsDefined())
            refuse(file, "\"P\": is missing; it is what rectified images (--undistorted) have");
        imported.keys["intrinsics"] = read_out(intrinsics_of(file, matrix(file, p, "P", 12), 4, "P"));
        set_raw_lens(imported, lens, read_out(intrinsics_of(file, k, 3, "K")));
    } else {
        set_lens(imported, lens());
        imported.keys["intrinsics"] = read_out(intrinsics_of(file, k, 3, "K"));
    }
    if (out.width > 0)
        imported.keys["width"] = std::max(1, out.width / out.across);
    if (out.height > 0)
        imported.keys["height"] = std::max(1, out.height / out.down);
    if (options.storage) {
        imported.otherwise = {{"encoding", "view-z"}};
        if (!is_float(*options.storage))
            imported.otherwise.update({{"scale", 0.001}, {"missing", 0}});
    }
    return imported;
}

/// Keys for a message.
std::string keys_of(const YAML::Node& map) {
    std::vector<std::string> keys;
    for (const auto& item : map)
        keys.push_back(item.first.IsScalar() ? item.first.Scalar().substr(0, 60) : "?");
    return listed(keys);
}

/// The numbers of a text that holds a matrix of 3 × 3, 3 × 4 or 4 × 4, and nothing else but brackets, commas and comments.
std::optional<std::vector<double>> matrix_in(const std::string& text) {
    std::vector<double> numbers;
    std::string plain;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        plain += line.substr(0, line.find('#')) + ' ';
    std::ranges::replace_if(
        plain, [](char c) { return std::string_view("[](),;").find(c) != std::string_view::npos; }, ' ');
    std::istringstream words(plain);
    for (std::string word; words >> word && numbers.size() <= 16;) {
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), numbers.emplace_back());
        if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(numbers.back()))
            return std::nullopt;
    }
    return numbers.size() == 9 || numbers.size() == 12 || numbers.size() == 16 ? std::optional(numbers) : std::nullopt;
}

/// A camera matrix in a text, as ScanNet and many datasets have it: of 4 × 4 the last row and column say nothing. Of 3 × 4 the last
/// column says how far the camera lies beside another one, as in KITTI, which moves no ray.
Imported import_matrix(const fs::path& file, const std::vector<double>& matrix) {
    const std::size_t size = matrix.size() == 9 ? 3 : 4;
    if (matrix.size() == 12 &&
        (matrix[4] != 0 || matrix[8] != 0 || matrix[9] != 0 || (matrix[0] == 1 && matrix[5] == 1)))
        refuse(file, "is a matrix of 3 x 4, but neither [K | 0] nor one beside it; is it K [R | t], or the camera's "
                     "place? Give K alone (cv2.decomposeProjectionMatrix takes them apart)");
    for (std::size_t i = 0; matrix.size() == 16 && i < 4; ++i)
        if (matrix[4 * i + 3] != (i == 3 ? 1 : 0) || matrix[12 + i] != (i == 3 ? 1 : 0))
            refuse(file, "is a matrix of 4 x 4, but no camera matrix; is it the camera's place? Give the file of the "
                         "intrinsics, such as intrinsic_depth.txt");
    return {.keys = {{"view_axes", "opencv"}, {"intrinsics", intrinsics_of(file, matrix, size, "matrix")}},
            .cure = "name its source or give the keys: --preset scannet, or --preset encoding=view-z,scale=0.001"};
}

/// The matrices of KITTI's calib.txt and calib_cam_to_cam.txt that are of rectified cameras, by their names.
std::vector<std::string> cameras_of_kitti(const YAML::Node& map) {
    std::vector<std::string> names;
    for (const auto& item : map)
        if (item.first.IsScalar() && item.first.Scalar().starts_with('P') && item.second.IsScalar())
            if (const auto matrix = matrix_in(item.second.Scalar()); matrix && matrix->size() == 12)
                names.push_back(item.first.Scalar());
    return names;
}

Imported imported(const fs::path& file, const ImportOptions& options) {
    constexpr std::uint64_t most = 1 << 20; // YAML takes some two hundred times its bytes; calibrations have thousands
    std::string text = text_of_file(file, most);
    if (text.starts_with("%YAML:")) // cv::FileStorage's directive, which YAML does not know
        text.erase(0, std::min(text.find('\n'), text.size()));
    if (const auto matrix = matrix_in(text)) {
        refuse_choice(file, options.image, "--image", formats_of_images);
        return import_matrix(file, *matrix);
    }
    const YAML::Node map = YAML::Load(text); // of a printed topic the first message
    if (!map.IsMap())
        refuse(file, "holds no camera that Fathom knows: JSON, glTF, OpenEXR, YAML of OpenCV or ROS, or the numbers of "
                     "a camera matrix");
    for (const auto& item : map)
        if (item.first.IsScalar() &&
            (item.first.Scalar() == "Camera.fx" || item.first.Scalar() == "Camera1.fx" ||
             (item.second.IsMap() && item.second["camera_model"] && item.second["intrinsics"])))
            refuse(file,
                   "holds a camera of ORB-SLAM or Kalibr, whose files are not read; docs/cameras.md says which of "
                   "its numbers goes where in a camera file");
    if (const std::vector<std::string> names = cameras_of_kitti(map); !names.empty()) {
        const std::string& name = names[chosen(file, names, options.image, options.depth, "camera", "--image")];
        Imported camera = import_matrix(file, *matrix_in(map[name].Scalar()));
        camera.cure = "name its source or give the keys: --preset kitti, or --preset encoding=view-z,scale=0.00390625";
        return camera;
    }
    refuse_choice(file, options.image, "--image", formats_of_images);
    const bool ros = value(map, {"distortion_model", "projection_matrix", "k", "K"}).IsDefined();
    if (!ros && !map["camera_matrix"])
        refuse(file, "has neither OpenCV's \"camera_matrix\" nor \"K\" of ROS; it has " + keys_of(map));
    return ros ? import_ros(file, map, options) : import_opencv(file, map, options);
}

} // namespace

Imported import_calibration(const fs::path& file, const ImportOptions& options) {
    try {
        return imported(file, options);
    } catch (const YAML::Exception& error) { // "yaml-cpp: error at line 3, column 5: ..."
        std::string what = error.what();
        if (what.starts_with("yaml-cpp: "))
            what.erase(0, 10);
        refuse(file, "is no YAML that can be read: " + what);
    }
}

} // namespace fathom::io
