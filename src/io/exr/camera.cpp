// The camera in an OpenEXR header. Programs write its matrices in two layouts and two ranges, told apart here.
//   A = worldToNDC · worldToCamera⁻¹ (column vectors): fx = W A₀₀/A₃₂, cx = W A₀₂/A₃₂, fy = H |A₁₁|/A₃₂
// OpenEXR, Standard Optional Attributes (row vectors, NDC from 0 to 1 and y down, camera with +z ahead). pbrt-v4
// writes both matrices transposed; Arnold's and RenderMan's NDC run from -1 to 1, which OpenImageIO calls
// worldToScreen. V-Ray and Redshift have attributes of their own; what those mean was read off files that they wrote
// and scripts that read them.
#include "open.hpp"

#include "io/cameras/camera_formats.hpp"
#include "io/formats.hpp"
#include "text.hpp"

#include <fathom/error.hpp>

#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

using Eigen::Matrix4d;

constexpr double float_noise = 1e-4;  // of products of matrices that were stored as floats
constexpr double affine_noise = 1e-6; // of the row of an affine matrix that is (0, 0, 0, 1)
constexpr double same_lens = 0.01;    // relative, between two attributes that should agree

/// The header of one part, and the display window of its image.
class Header {
public:
    Header(const fs::path& file, const Imf::Header& header) : file_(file), header_(header) {
        const auto& window = header.displayWindow();
        width = static_cast<double>(window.max.x) - window.min.x + 1;
        height = static_cast<double>(window.max.y) - window.min.y + 1;
        check_size(file, static_cast<long long>(width), static_cast<long long>(height));
    }

    /// A number of a lens, where it says something: many programs write infinity or 0 for none.
    std::optional<double> positive(const std::string& name) const {
        const auto value = written_number(name);
        return value && *value > 0 && std::isfinite(*value) ? value : std::nullopt;
    }

    std::optional<double> number(const std::string& name) const {
        const auto value = written_number(name);
        if (value && !std::isfinite(*value))
            refuse(name, "is not finite");
        return value;
    }

    /// A number, in whatever type it was written.
    std::optional<double> written_number(const std::string& name) const {
        std::optional<double> value;
        if (const auto* f = find<Imf::FloatAttribute>(name))
            value = f->value();
        else if (const auto* d = find<Imf::DoubleAttribute>(name))
            value = d->value();
        else if (const auto* i = find<Imf::IntAttribute>(name))
            value = i->value();
        else if (const auto* r = find<Imf::RationalAttribute>(name))
            value = static_cast<double>(r->value());
        else if (const auto numbers = numbers_in_text(name); numbers.size() == 1)
            value = numbers.front();
        return value;
    }

    std::optional<Eigen::Vector2d> vector(const std::string& name) const {
        std::optional<Eigen::Vector2d> value;
        if (const auto* v = find<Imf::V2fAttribute>(name))
            value = Eigen::Vector2d(v->value().x, v->value().y);
        if (value && !value->allFinite())
            refuse(name, "is not finite");
        return value;
    }

    /// A matrix as it was written.
    std::optional<Matrix4d> matrix(const std::string& name) const {
        using RowByRow = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
        Matrix4d matrix;
        if (const auto* f = find<Imf::M44fAttribute>(name))
            matrix = Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(f->value()[0]).cast<double>();
        else if (const auto* d = find<Imf::M44dAttribute>(name))
            matrix = Eigen::Map<const RowByRow>(d->value()[0]);
        else if (const auto numbers = numbers_in_text(name); numbers.size() == 16)
            matrix = Eigen::Map<const RowByRow>(numbers.data());
        else
            return std::nullopt;
        if (!matrix.allFinite())
            refuse(name, "is not finite");
        return matrix;
    }

    std::string text(const std::string& name) const {
        const auto* text = find<Imf::StringAttribute>(name);
        return text ? text->value() : std::string();
    }

    bool has_name_with(const std::string& beginning) const {
        for (auto each = header_.begin(); each != header_.end(); ++each)
            if (std::string(each.name()).starts_with(beginning))
                return true;
        return false;
    }

    double screen_window_width() const { return header_.screenWindowWidth(); }
    Eigen::Vector2d screen_window_center() const {
        return {header_.screenWindowCenter().x, header_.screenWindowCenter().y};
    }
    /// Of a pixel, width over height.
    double pixel_aspect() const {
        const double aspect = header_.pixelAspectRatio();
        if (!(aspect > 0) || !std::isfinite(aspect))
            refuse("pixelAspectRatio", "must be positive");
        return aspect;
    }

    [[noreturn]] void refuse(const std::string& name, const std::string& what) const {
        io::refuse(file_,
                   "\"" + name + "\" of its header " + what + "; render it again, or give a camera file (--camera)");
    }

    double width = 0, height = 0; ///< pixels

private:
    template <typename Attribute>
    const Attribute* find(const std::string& name) const {
        return header_.findTypedAttribute<Attribute>(name);
    }
    std::vector<double> numbers_in_text(const std::string& name) const {
        std::string list = text(name);
        std::ranges::replace(list, ',', ' ');
        std::istringstream words(list);
        std::vector<double> numbers;
        for (double each; words >> each;)
            numbers.push_back(each);
        return numbers;
    }

    fs::path file_;
    const Imf::Header& header_;
};

bool is_row_of_one(const Eigen::Vector4d& row) {
    return row.head<3>().cwiseAbs().maxCoeff() <= affine_noise * std::abs(row[3]) && row[3] != 0;
}

/// A matrix for column vectors, and whether it was written for row vectors, as OpenEXR documents it.
struct Reading {
    Matrix4d matrix;
    bool documented;
};

/// The readings of a matrix that are affine, the documented one first. A pure rotation has both.
std::vector<Reading> affine_readings(const Header& header, const std::string& name, const Matrix4d& written) {
    std::vector<Reading> readings;
    for (const bool documented : {true, false}) {
        Matrix4d matrix = documented ? Matrix4d(written.transpose()) : written;
        if (!is_row_of_one(matrix.row(3).transpose()))
            continue;
        matrix /= double(matrix(3, 3));
        matrix.row(3) << 0, 0, 0, 1;
        readings.push_back({matrix, documented});
    }
    if (readings.empty())
        header.refuse(name, "is no affine matrix");
    if (!(std::abs(readings.front().matrix.determinant()) > 0))
        header.refuse(name, "is singular");
    return readings;
}

/// Where a camera stands and how it projects, as far as the header says.
struct HeaderCamera {
    json projection = {};              ///< "intrinsics" or "orthographic"
    std::optional<Matrix4d> view = {}; ///< OpenGL's axes
    std::vector<std::string> warnings = {};
};

json intrinsics(double fx, double fy, double cx, double cy) {
    return {{"intrinsics", {{"fx", fx}, {"fy", fy}, {"cx", cx}, {"cy", cy}, {"pixel_origin", "corner"}}}};
}

/// The projection that camera space is seen through, if A is one: x and y of NDC each depend on their own axis and on
/// depth.
std::optional<HeaderCamera> camera_of(const Header& header, const Matrix4d& world_to_camera,
                                      const Matrix4d& world_to_ndc, bool signed_range) {
    const Matrix4d to_world = world_to_camera.inverse();
    if (!to_world.allFinite())
        return std::nullopt;
    const Matrix4d a = world_to_ndc * to_world;
    const double w = a(3, 2);
    const bool parallel =
        world_to_ndc.row(3).head<3>().isZero(0); // exactly: far from the origin a perspective is nearly so
    const auto small = [](double value, double beside) { return std::abs(value) <= float_noise * std::abs(beside); };
    if (!small(a(0, 1), a(0, 0)) || !small(a(1, 0), a(1, 1)) || a(0, 0) == 0 || a(1, 1) == 0)
        return std::nullopt;
    if (parallel ? !small(a(0, 2), a(0, 0)) || !small(a(1, 2), a(1, 1)) : !small(a(3, 0), w) || !small(a(3, 1), w))
        return std::nullopt;

    // Where the axis meets the image tells 0 to 1 from -1 to 1: it is near 1/2 in the one, near 0 in the other.
    const double scale = parallel ? world_to_ndc(3, 3) : w;
    const Eigen::Vector2d axis = Eigen::Vector2d(parallel ? a(0, 3) : a(0, 2), parallel ? a(1, 3) : a(1, 2)) / scale;
    const double from_half = (axis.array() - 0.5).abs().maxCoeff(), from_zero = axis.cwiseAbs().maxCoeff();
    const bool is_signed = signed_range || from_zero < from_half;
    HeaderCamera camera;
    if (!signed_range && std::abs(from_zero - from_half) < 0.2)
        camera.warnings.push_back("worldToNDC is far off-centre, so that its range, taken as " +
                                  std::string(is_signed ? "-1 to 1" : "0 to 1") +
                                  ", is uncertain; compare the field of view that fathom inspect shows");
    const double unit = is_signed ? 2 : 1; // of NDC across the image
    const double slope_x = a(0, 0) / std::abs(scale), slope_y = a(1, 1) / std::abs(scale);
    if (slope_x < 0)
        return std::nullopt; // a mirror
    const bool y_up = slope_y > 0;
    const double fx = header.width / unit * slope_x, fy = header.height / unit * std::abs(slope_y);
    const double u = is_signed ? (1 + axis.x()) / 2 : axis.x(), v = is_signed ? (1 + axis.y()) / 2 : axis.y();
    const double cx = header.width * u, cy = header.height * (y_up ? 1 - v : v);
    camera.projection = parallel ? json{{"orthographic",
                                         {{"left", -cx / fx},
                                          {"right", (header.width - cx) / fx},
                                          {"bottom", -(header.height - cy) / fy},
                                          {"top", cy / fy},
                                          {"near", 0},
                                          {"far", 1}}}}
                                 : intrinsics(fx, fy, cx, cy);
    Matrix4d view = world_to_camera;
    if (parallel || w > 0)
        view.row(2) = -view.row(2); // +z was ahead
    camera.view = view;
    return camera;
}

/// worldToCamera with worldToNDC or worldToScreen.
std::optional<HeaderCamera> standard_matrices(const Header& header) {
    const auto camera = header.matrix("worldToCamera");
    if (!camera)
        return std::nullopt;
    const auto readings = affine_readings(header, "worldToCamera", *camera);
    const bool has_ndc = header.matrix("worldToNDC").has_value();
    const auto screen = has_ndc ? header.matrix("worldToNDC") : header.matrix("worldToScreen");
    if (!screen)
        return HeaderCamera{.view = Matrix4d(Eigen::Vector4d(1, 1, -1, 1).asDiagonal() * readings.front().matrix)};
    // Both in the same layout, as one program writes them, or else each in its own.
    for (const bool alike : {true, false})
        for (const Reading& reading : readings) {
            const Matrix4d ndc = reading.documented == alike ? Matrix4d(screen->transpose()) : *screen;
            if (const auto found = camera_of(header, reading.matrix, ndc, !has_ndc))
                return found;
        }
    header.refuse(has_ndc ? "worldToNDC" : "worldToScreen",
                  "and worldToCamera do not make a pinhole or a parallel projection");
}

/// The angle of view across the image. V-Ray: degrees. Redshift: degrees in files, radians in its documentation.
std::optional<json> angle_of_view(const Header& header, std::vector<std::string>& warnings) {
    for (const char* name : {"cameraFov", "rs/camera/fov"}) {
        auto angle = header.number(name);
        if (!angle)
            continue;
        const bool radians = std::string(name) == "rs/camera/fov" && *angle < std::numbers::pi;
        if (radians)
            warnings.push_back("rs/camera/fov, " + fathom::text(*angle) +
                               ", is taken as radians; compare the field of view that fathom inspect shows");
        *angle *= radians ? 1 : std::numbers::pi / 180;
        if (!(*angle > 0 && *angle < std::numbers::pi))
            header.refuse(name, "is no angle between 0 and 180 degrees");
        const double fx = header.width / (2 * std::tan(*angle / 2));
        return intrinsics(fx, fx * header.pixel_aspect(), header.width / 2, header.height / 2);
    }
    return std::nullopt;
}

/// World to view, from the place of a V-Ray camera. Its axes are right, back, down from Maya, right, up, back
/// elsewhere.
std::optional<Matrix4d> vray_view(const Header& header, std::vector<std::string>& warnings) {
    const auto written = header.matrix("cameraTransform");
    if (!written)
        return std::nullopt;
    // V-Ray writes for column vectors, which a place without a translation does not show.
    Matrix4d place = affine_readings(header, "cameraTransform", *written).back().matrix;
    const std::string host = lower(header.text("vrayInfo/vrayversion") + header.text("vrayInfo/filename"));
    if (host.find("maya") != std::string::npos || host.ends_with(".ma") || host.ends_with(".mb")) {
        const Matrix4d turned = place;
        place.col(1) = -turned.col(2);
        place.col(2) = turned.col(1);
    } else if (host.empty()) {
        warnings.emplace_back(
            "its V-Ray header does not name its host; cameraTransform is read as from 3ds Max (right, up, "
            "back), and from Maya world positions would be turned");
    }
    return place.inverse();
}

/// World to view, from the place of a Redshift camera: its z is ahead, its y up, and the picture is not mirrored.
std::optional<Matrix4d> redshift_view(const Header& header) {
    const auto written = header.matrix("rs/camera/transform");
    if (!written)
        return std::nullopt;
    Matrix4d place = affine_readings(header, "rs/camera/transform", *written).front().matrix;
    if (place.topLeftCorner<3, 3>().determinant() > 0)
        place.col(0) = -place.col(0); // x was to the left
    place.col(2) = -place.col(2);
    return place.inverse();
}

/// Arnold's lens, if there is no matrix: the ratio of focal length to aperture.
std::optional<json> film_back(const Header& header, std::vector<std::string>& warnings) {
    const auto focal = header.number("CameraFocalLength"), aperture = header.number("CameraFilmApertureHorizontal");
    if (!focal || !aperture)
        return std::nullopt;
    if (!(*focal > 0 && *aperture > 0))
        header.refuse("CameraFocalLength", "or CameraFilmApertureHorizontal is not positive");
    constexpr double widest_film_in = 3; // no film is wider than that in inches, no sensor narrower in millimetres
    const bool inches = *aperture < widest_film_in;
    const double fx = header.width * *focal / (*aperture * (inches ? 25.4 : 1));
    warnings.push_back("CameraFilmApertureHorizontal, " + fathom::text(*aperture) + ", is taken as " +
                       (inches ? "inches" : "millimetres") + "; compare the field of view that fathom inspect shows");
    return intrinsics(fx, fx * header.pixel_aspect(), header.width / 2, header.height / 2);
}

/// The window on the plane z = 1. A width of 1 around 0 is the default and says nothing.
std::optional<json> screen_window(const Header& header, std::vector<std::string>& warnings) {
    const double width = header.screen_window_width();
    const Eigen::Vector2d center = header.screen_window_center();
    if (width == 1 && center.isZero())
        return std::nullopt;
    if (!(width > 0) || !std::isfinite(width) || !center.allFinite())
        header.refuse("screenWindowWidth", "or screenWindowCenter is no window");
    const double fx = header.width / width, fy = header.pixel_aspect() * fx;
    if (center.x() != 0)
        warnings.push_back(
            "screenWindowCenter has x = " + fathom::text(center.x()) +
            ", and x is taken to point left, as OpenEXR's introduction has it; if the picture is shifted "
            "the other way, give a camera file (--camera)");
    return intrinsics(fx, fy, header.width / 2 + center.x() * fx, header.height / 2 + center.y() * fy);
}

/// Keys for the lens.
json lens_of(const Header& header, const json& projection) {
    json keys = json::object();
    for (const char* name : {"nominalFocalLength", "effectiveFocalLength", "pinholeFocalLength"}) // the last one counts
        if (const auto focal = header.positive(name))
            keys["lens_mm"] = *focal;
    for (const char* name : {"aperture", "cameraFNumber", "rs/camera/FStop"})
        if (const auto stop = header.positive(name))
            keys["f_stop"] = *stop;
    for (const char* name : {"focus", "rs/camera/DOFFocusDistance"})
        if (const auto distance = header.positive(name))
            keys["focus_distance"] = *distance;
    if (const auto film = header.positive("cameraAperture")) // V-Ray's width of the film
        keys["sensor_mm"] = *film;
    // The whole sensor is that of the image only if the lens agrees.
    const auto sensor = header.vector("sensorOverallDimensions");
    if (sensor && sensor->x() > 0 && keys.contains("lens_mm") && projection.contains("intrinsics")) {
        const double fx = projection["intrinsics"]["fx"].get<double>();
        if (std::abs(keys["lens_mm"].get<double>() / sensor->x() * header.width / fx - 1) < same_lens)
            keys["sensor_mm"] = sensor->x();
    }
    return keys;
}

/// The camera of a part, if its header has one.
std::optional<Imported> imported(const Header& header) {
    if (const auto kind = header.number("cameraProjection"); kind && *kind != 0)
        header.refuse("cameraProjection", "is " + fathom::text(*kind) + ", no pinhole");
    if (const auto shift = header.vector("rs/camera/shift"); shift && !shift->isZero())
        header.refuse("rs/camera/shift", "is a shift, whose unit Redshift does not document");
    HeaderCamera camera = standard_matrices(header).value_or(HeaderCamera{});
    for (const auto read : {angle_of_view, film_back, screen_window})
        if (camera.projection.is_null())
            camera.projection = read(header, camera.warnings).value_or(json());
    if (camera.projection.is_null())
        return std::nullopt;
    const bool vray = header.number("cameraFov").has_value() || header.has_name_with("vrayInfo/");
    if (!camera.view)
        camera.view = vray ? vray_view(header, camera.warnings) : redshift_view(header);

    Imported result{.keys = camera.projection, .warnings = std::move(camera.warnings)};
    result.keys["width"] = static_cast<int>(header.width);
    result.keys["height"] = static_cast<int>(header.height);
    if (camera.view) {
        camera.view->row(3) << 0, 0, 0, 1;
        result.keys["view"] = rows_of(*camera.view);
    }
    result.keys.update(lens_of(header, camera.projection));

    if (vray) {
        result.cure =
            "V-Ray writes a ramp: --preset vray-z:near=BLACK,far=WHITE has Depth Black and White, and --preset "
            "encoding=view-z is for distances";
    } else if (header.has_name_with("nuke/")) {
        result.cure =
            "it went through Nuke: --preset nuke-depth is for Nuke's own 1/z, --preset encoding=view-z for distances";
    } else {
        result.otherwise = {{"encoding", "view-z"}};
        if (header.has_name_with("arnold/")) {
            result.otherwise["background_from"] = 1e30;
            result.doubts.emplace_back(
                "Arnold's Z is taken as the distance along the view axis; some versions write it "
                "along the ray, then add --preset encoding=ray-distance");
        }
    }
    return result;
}

std::optional<Imported> imported(const fs::path& file) {
    return refusing_damage(file, [&]() -> std::optional<Imported> {
        const Imf::MultiPartInputFile exr = open_exr(file);
        for (int part = 0; part < exr.parts(); ++part)
            if (auto found = imported(Header(file, exr.header(part))))
                return found;
        return std::nullopt;
    });
}

} // namespace

Imported import_exr(const fs::path& file) {
    check_readable(file);
    if (auto found = imported(file))
        return std::move(*found);
    refuse(file,
           "has no camera in its header; give a camera file (--camera), or a preset with the angle of view (--preset)");
}

bool exr_has_camera(const fs::path& file) {
    if (!is_file(file) || !begins_like_exr(file))
        return false;
    const auto found = if_any([&] { return imported(file); });
    return !found || found->has_value(); // one that cannot be used says why
}

} // namespace fathom::io
