// A reconstruction of COLMAP: cameras.bin and images.bin, or cameras.txt and images.txt.
//   x = fx X/Z + cx, y = fy Y/Z + cy, pixels counted from the corner; X = R(q) X_world + t, x right, y down, z ahead
// COLMAP, Output format and src/colmap/sensor/models.h. Numbers of binary files are little-endian.
#include "camera_formats.hpp"

#include "camera_file/file.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <sstream>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

/// What the parameters of a camera model distort, behind its focal lengths and its principal point.
enum class Distortion { none, radial, opencv, fisheye, other };

struct Model {
    const char* name;
    std::size_t parameters;
    std::size_t focal_lengths;
    Distortion distortion;
};

/// In the order of COLMAP's numbers.
constexpr std::array<Model, 11> models{{{"SIMPLE_PINHOLE", 3, 1, Distortion::none},
                                        {"PINHOLE", 4, 2, Distortion::none},
                                        {"SIMPLE_RADIAL", 4, 1, Distortion::radial},
                                        {"RADIAL", 5, 1, Distortion::radial},
                                        {"OPENCV", 8, 2, Distortion::opencv},
                                        {"OPENCV_FISHEYE", 8, 2, Distortion::fisheye},
                                        {"FULL_OPENCV", 12, 2, Distortion::opencv},
                                        {"FOV", 5, 2, Distortion::other},
                                        {"SIMPLE_RADIAL_FISHEYE", 4, 1, Distortion::fisheye},
                                        {"RADIAL_FISHEYE", 5, 1, Distortion::fisheye},
                                        {"THIN_PRISM_FISHEYE", 12, 2, Distortion::other}}};

struct ColmapCamera {
    std::uint32_t id = 0;
    const Model* model = nullptr;
    std::uint64_t width = 0, height = 0;
    std::vector<double> parameters = {};
};

struct ColmapImage {
    std::array<double, 4> rotation{}; ///< w, x, y, z
    std::array<double, 3> translation{};
    std::uint32_t camera = 0;
    std::string name = {};
};

constexpr std::uint64_t longest = std::uint64_t{4} << 30; // an image takes 24 bytes for each of its points

/// Reads a binary file from its beginning to its end.
class Reader {
public:
    explicit Reader(const fs::path& file) : file_(file), bytes_(read_file(file, longest)) {}

    template <typename Number>
    Number next() {
        Number number;
        std::memcpy(&number, take(sizeof number), sizeof number);
        return number;
    }
    std::string next_text() {
        const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(at_);
        const auto end = std::find(begin, bytes_.end(), 0);
        const auto length = static_cast<std::size_t>(end - begin);
        take(length + 1);
        return {begin, end};
    }
    void skip(std::uint64_t count, std::size_t size) {
        if (count > bytes_.size() / size)
            refuse_short();
        take(static_cast<std::size_t>(count) * size);
    }
    /// How many things follow, each of at least `size` bytes.
    std::uint64_t next_count(std::size_t size) {
        const auto count = next<std::uint64_t>();
        if (count > (bytes_.size() - at_) / size)
            refuse_short();
        return count;
    }

private:
    const unsigned char* take(std::size_t size) {
        if (size > bytes_.size() - at_)
            refuse_short();
        at_ += size;
        return bytes_.data() + (at_ - size);
    }
    [[noreturn]] void refuse_short() const { refuse(file_, "is cut short or no binary file of COLMAP; copy it again"); }

    fs::path file_;
    Bytes bytes_;
    std::size_t at_ = 0;
};

std::vector<ColmapCamera> read_binary_cameras(const fs::path& file) {
    Reader reader(file);
    std::vector<ColmapCamera> cameras(reader.next_count(24));
    for (ColmapCamera& camera : cameras) {
        camera.id = reader.next<std::uint32_t>();
        const auto model = reader.next<std::int32_t>();
        if (model < 0 || model >= static_cast<std::int32_t>(models.size()))
            refuse(file, "has a camera of model number " + std::to_string(model) +
                             ", which Fathom does not know; run colmap image_undistorter, which writes PINHOLE");
        camera.model = &models[static_cast<std::size_t>(model)];
        camera.width = reader.next<std::uint64_t>();
        camera.height = reader.next<std::uint64_t>();
        for (std::size_t i = 0; i < camera.model->parameters; ++i)
            camera.parameters.push_back(reader.next<double>());
    }
    return cameras;
}

std::vector<ColmapImage> read_binary_images(const fs::path& file) {
    Reader reader(file);
    std::vector<ColmapImage> images(reader.next_count(73));
    for (ColmapImage& image : images) {
        reader.next<std::uint32_t>(); // its number
        for (double& each : image.rotation)
            each = reader.next<double>();
        for (double& each : image.translation)
            each = reader.next<double>();
        image.camera = reader.next<std::uint32_t>();
        image.name = reader.next_text();
        reader.skip(reader.next<std::uint64_t>(), 24); // its points
    }
    return images;
}

/// Lines that are no comments.
std::vector<std::string> lines_of(const fs::path& file) {
    std::istringstream text(text_of_file(file, longest));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
        if (line.ends_with('\r'))
            line.pop_back();
        if (!line.starts_with('#'))
            lines.push_back(line);
    }
    return lines;
}

std::vector<ColmapCamera> read_text_cameras(const fs::path& file) {
    std::vector<ColmapCamera> cameras;
    for (const std::string& line : lines_of(file)) {
        std::istringstream words(line);
        ColmapCamera camera;
        std::string model;
        if (!(words >> camera.id >> model >> camera.width >> camera.height)) {
            if (line.find_first_not_of(" \t") == std::string::npos)
                continue;
            refuse(file, "has the line \"" + line.substr(0, 60) + "\"; it must be ID MODEL WIDTH HEIGHT PARAMETERS");
        }
        const auto known = std::ranges::find_if(models, [&](const Model& each) { return each.name == model; });
        if (known == models.end())
            refuse(file, "has a camera of the model \"" + model.substr(0, 60) +
                             "\", which Fathom does not know; run colmap image_undistorter, which writes PINHOLE");
        camera.model = &*known;
        for (double each; words >> each;)
            camera.parameters.push_back(each);
        if (!words.eof() || camera.parameters.size() != known->parameters)
            refuse(file, "has a camera " + model + " with " + std::to_string(camera.parameters.size()) +
                             " numbers after its size; it must have " + std::to_string(known->parameters));
        cameras.push_back(camera);
    }
    return cameras;
}

std::vector<ColmapImage> read_text_images(const fs::path& file) {
    std::vector<ColmapImage> images;
    bool of_points = false; // every second line, which may be empty
    for (const std::string& line : lines_of(file)) {
        if (std::exchange(of_points, !of_points))
            continue;
        if (line.find_first_not_of(" \t") == std::string::npos) { // between images, or at the end
            of_points = false;
            continue;
        }
        std::istringstream words(line);
        ColmapImage image;
        std::uint32_t id = 0;
        words >> id;
        for (double& each : image.rotation)
            words >> each;
        for (double& each : image.translation)
            words >> each;
        if (!(words >> image.camera >> std::ws) || !std::getline(words, image.name))
            refuse(file,
                   "has the line \"" + line.substr(0, 60) + "\"; it must be ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
        images.push_back(image);
    }
    return images;
}

/// What the files are called without their extensions' folders.
struct Files {
    fs::path cameras, images; ///< `images` may be missing
    bool binary;
};

std::optional<Files> files_in(const fs::path& folder, const char* extension) {
    Files files{folder / (std::string("cameras") + extension), folder / (std::string("images") + extension),
                std::string(extension) == ".bin"};
    return is_there(files.cameras) ? std::optional(files) : std::nullopt;
}

Files files_of(const fs::path& file) {
    if (!is_folder(file)) {
        const auto files = files_in(file.parent_path(), file.extension().c_str());
        check_readable(file);
        if (!files)
            refuse(file, "has no cameras" + file.extension().string() + " beside it; name COLMAP's folder");
        return *files;
    }
    for (const fs::path& folder : {file, file / "sparse" / "0", file / "sparse", file / "0"})
        for (const char* extension : {".bin", ".txt"})
            if (const auto files = files_in(folder, extension))
                return *files;
    refuse(file,
           "is a folder without COLMAP's cameras.bin or cameras.txt, also in sparse/0; name the file or its folder");
}

json keys_of(const fs::path& file, const ColmapCamera& camera) {
    const Model& model = *camera.model;
    for (const double each : camera.parameters)
        if (!std::isfinite(each))
            refuse(file, "has a camera " + std::string(model.name) +
                             " with a parameter that is not finite; run COLMAP again");
    const std::size_t of_pinhole = model.focal_lengths + 2;
    std::vector<double> k(camera.parameters.begin() + static_cast<std::ptrdiff_t>(of_pinhole), camera.parameters.end());
    k.resize(std::max<std::size_t>(k.size(), 4)); // its simpler models have the first ones of OpenCV's
    if (model.distortion == Distortion::other)
        refuse(
            file,
            "has a camera " + std::string(model.name) +
                " with a lens distortion that Fathom does not know; run colmap image_undistorter --image_path IMAGES "
                "--input_path SPARSE --output_path DENSE, and take DENSE");
    if (camera.width < 1 || camera.height < 1 || std::max(camera.width, camera.height) > 1'000'000'000)
        refuse(file, "has a camera of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                         " pixels; copy it again");
    const auto& p = camera.parameters;
    json keys{{"width", camera.width},
              {"height", camera.height},
              {"view_axes", "opencv"},
              {"intrinsics",
               {{"fx", p[0]},
                {"fy", p[model.focal_lengths - 1]},
                {"cx", p[model.focal_lengths]},
                {"cy", p[model.focal_lengths + 1]},
                {"pixel_origin", "corner"}}}};
    if (const json lens = model.distortion == Distortion::fisheye ? fisheye_lens(file, k, model.name)
                                                                  : opencv_lens(file, k, model.name);
        !lens.empty())
        keys["lens"] = lens;
    return keys;
}

Eigen::Matrix4d view_of(const fs::path& file, const ColmapImage& image) {
    const auto& [w, x, y, z] = image.rotation;
    const Eigen::Quaterniond rotation(w, x, y, z);
    const Eigen::Vector3d translation(image.translation.data());
    if (!(rotation.norm() > 0) || !std::isfinite(rotation.norm()) || !translation.allFinite())
        refuse(file, "has no rotation or no translation for " + image.name + "; run COLMAP again");
    Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
    view.topLeftCorner<3, 3>() = rotation.normalized().toRotationMatrix();
    view.topRightCorner<3, 1>() = translation;
    return view;
}

} // namespace

bool is_colmap(const fs::path& file) {
    const std::string name = file.filename().string();
    return is_folder(file) || name == "cameras.bin" || name == "cameras.txt" || name == "images.bin" ||
           name == "images.txt";
}

std::vector<fs::path> colmap_files(const fs::path& file) {
    const Files files = files_of(file);
    return is_there(files.images) ? std::vector{files.cameras, files.images} : std::vector{files.cameras};
}

Imported import_colmap(const fs::path& file, const ImportOptions& options) {
    if (options.undistorted)
        refuse(file, "leave out --undistorted; name the folder that colmap image_undistorter wrote");
    const Files files = files_of(file);
    const auto cameras = files.binary ? read_binary_cameras(files.cameras) : read_text_cameras(files.cameras);
    if (cameras.empty())
        refuse(files.cameras, "has no camera; run COLMAP again");
    Imported imported{.keys = {},
                      .cure = "for its own depth maps add --preset colmap, otherwise name the source or give the keys: "
                              "--preset encoding=view-z,scale=0.001"};
    if (!is_there(files.images)) {
        if (cameras.size() != 1 || !options.image.empty())
            refuse(files.cameras, "has " + std::to_string(cameras.size()) + " cameras and no " +
                                      files.images.filename().string() +
                                      " beside it, which says whose they are; add it");
        imported.keys = keys_of(files.cameras, cameras.front());
        return imported;
    }
    const auto images = files.binary ? read_binary_images(files.images) : read_text_images(files.images);
    if (images.empty())
        refuse(files.images, "has no image; run COLMAP again");
    std::vector<std::string> names;
    for (const ColmapImage& image : images)
        names.push_back(image.name);
    const ColmapImage& image = images[chosen(files.images, names, options.image, options.depth, "image", "--image")];
    const auto camera = std::ranges::find(cameras, image.camera, &ColmapCamera::id);
    if (camera == cameras.end())
        refuse(files.images, "has " + image.name + " with camera " + std::to_string(image.camera) +
                                 ", which is not in " + files.cameras.filename().string() + "; copy both files again");
    imported.keys = keys_of(files.cameras, *camera);
    imported.keys["view"] = rows_of(view_of(files.images, image));
    return imported;
}

} // namespace fathom::io
