// fathom.Camera: the keys of the camera file as keyword arguments, and the importers.
#include "camera.hpp"

#include "arrays.hpp"
#include "unlocked.hpp"

#include "camera_file/file.hpp"
#include "camera_file/imported.hpp"
#include "camera_file/json_object.hpp"
#include "camera_file/key_names.hpp"
#include "camera_file/lens_key.hpp"
#include "camera_file/presets.hpp"

#include <fathom/doubts.hpp>
#include <fathom/error.hpp>
#include <fathom/image.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/presets.hpp>

#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <stdexcept>

namespace fs = std::filesystem;

namespace fathom::python {
namespace {

constexpr const char* source = "Camera"; // stands in messages where a file's name would

nlohmann::json json_of(nb::handle value, const std::string& path, int depth = 0) {
    constexpr int deepest = 100; // as in camera files; a list that holds itself has no bottom
    if (depth > deepest)
        io::refuse(source, "\"" + path.substr(0, path.find('.')) + "\": is nested more than " +
                               std::to_string(deepest) + " deep");
    if (nb::isinstance<nb::bool_>(value))
        return nb::cast<bool>(value);
    if (nb::isinstance<nb::str>(value))
        return text_of(nb::borrow<nb::str>(value));
    if (nb::isinstance<nb::dict>(value)) {
        nlohmann::json object = nlohmann::json::object();
        for (const auto& [name, each] : nb::borrow<nb::dict>(value)) {
            const std::string key = text_of(nb::str(name));
            if (!each.is_none())
                object[key] = json_of(each, path + "." + key, depth + 1);
        }
        return object;
    }
    if (nb::hasattr(value, "tolist")) // NumPy's numbers and arrays
        return json_of(value.attr("tolist")(), path, depth + 1);
    if (nb::isinstance<nb::sequence>(value)) {
        nlohmann::json array = nlohmann::json::array();
        for (nb::handle each : nb::borrow<nb::sequence>(value))
            array.push_back(json_of(each, path, depth + 1));
        return array;
    }
    if (long long whole = 0; nb::isinstance<nb::int_>(value) && nb::try_cast(value, whole))
        return whole;
    double number = 0;
    if (!nb::try_cast(value, number) || std::isnan(number) || (std::isinf(number) && number < 0))
        io::refuse(source, "\"" + path + "\": " + text_of(nb::repr(value)) +
                               " is no number, text, list or dict of a camera file");
    if (constexpr double exact = 1LL << 53; number == std::floor(number) && number != 0 && std::abs(number) <= exact)
        return static_cast<long long>(number); // width=1280/2 is meant as a whole number
    return std::isinf(number) ? nlohmann::json("infinity") : nlohmann::json(number);
}

// Adds keys to those that are there. Dicts join.
void join(nlohmann::json& keys, const nlohmann::json& more) {
    for (const auto& [key, value] : more.items()) {
        if (!keys.contains(key)) {
            keys[key] = value;
            continue;
        }
        nlohmann::json& there = keys[key];
        if (there.is_object() != value.is_object())
            io::refuse(source, "\"" + key + "\": is no dict, but \"" +
                                   (there.is_object() ? there : value).items().begin().key() + "\" belongs into it");
        if (!there.is_object())
            io::refuse(source, "\"" + key + "\" is given twice; keep one");
        join(there, value);
    }
}

// Keys of `perspective`, `intrinsics` and `orthographic` may be given without the dict that they belong into.
nlohmann::json keys_given(const nb::kwargs& given) {
    nlohmann::json keys = nlohmann::json::object();
    for (const auto& [name, value] : given) {
        if (value.is_none())
            continue;
        const std::string key = text_of(nb::str(name)), object = io::object_of(key);
        const nlohmann::json own{{key, json_of(value, key)}};
        join(keys, object.empty() ? own : nlohmann::json{{object, own}});
    }
    return keys;
}

// What the caller said is wrong, and no file.
template <typename Make>
auto as_argument(const Make& make) {
    try {
        return make();
    } catch (const Error& error) {
        throw std::invalid_argument(error.what());
    }
}

CameraObject camera_of_keys(const nb::kwargs& given) {
    return as_argument([&] { return CameraObject(io::completed(source, {.keys = keys_given(given)}, {})); });
}

CameraObject doubted(CameraObject camera, const std::string& name, int frames = 1) {
    camera.doubt(camera.file().camera.width, camera.file().camera.height, name, frames);
    return camera;
}

CameraObject camera_of_text(const std::string& text, const std::string& name) {
    return as_argument([&] {
        const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
        return CameraObject(io::completed(name, {.keys = io::parsed_json(name, {bytes, text.size()})}, {}));
    });
}

// The importers that need OpenCV, OpenEXR and a YAML parser are a module of their own, which is loaded when it is needed. It
// says what it found as a camera file. Where it cannot be loaded, `why` says why.
std::optional<ImportedCamera> from_other_importers(const std::string& name, const nb::tuple& arguments,
                                                   std::string& why) {
    nb::object importers;
    try {
        importers = nb::module_::import_("fathom._importers");
    } catch (nb::python_error& error) {
        if (!error.matches(PyExc_ImportError))
            throw;
        why = text_of(nb::str(error.value()));
        return {};
    }
    nb::object found;
    try {
        found = importers.attr("camera_file")(*arguments);
    } catch (nb::python_error& error) {
        if (!error.matches(PyExc_RuntimeError))
            throw;
        throw Error(in_python(text_of(nb::str(error.value()))));
    }
    const auto [text, warnings] = nb::cast<std::pair<std::string, std::vector<std::string>>>(found);
    ImportedCamera camera = camera_of_text(text, name).file();
    camera.warnings.insert(camera.warnings.end(), warnings.begin(), warnings.end());
    return camera;
}

// Is this a file that `import_json_camera` is for? Then its message is the right one.
bool is_json_or_glb(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char first = 0;
    file >> first; // the first that is no blank
    return first == '{' || (first == 'g' && file.get() == 'l');
}

CameraObject load(const fs::path& path, const std::string& image, const std::string& node, const std::string& preset,
                  bool undistorted, nb::handle storage, const fs::path& depth) {
    ImportedCamera camera;
    const std::optional<Storage> stored = storage_named(storage);
    try {
        camera = import_json_camera(path, {.image = image,
                                           .node = node,
                                           .preset = preset,
                                           .undistorted = undistorted,
                                           .storage = stored,
                                           .depth = depth});
    } catch (const Error& error) {
        std::string why;
        const auto other =
            from_other_importers(path.string(),
                                 nb::make_tuple(path, image, node, preset, undistorted,
                                                stored ? std::optional(int(*stored)) : std::nullopt, depth),
                                 why);
        if (!other && (!fs::is_regular_file(path) || is_json_or_glb(path)))
            throw Error(in_python(error.what()));
        if (!other)
            throw Error(path.string() +
                        ": is no camera file, glTF or transforms.json, and this build of the package reads no other "
                        "format; convert it with fathom camera, or build from source (docs/python.md): " +
                        why);
        camera = *other;
    }
    warn(camera.warnings, path.string(), 2);
    return doubted(CameraObject(std::move(camera)), path.string(), 2);
}

nb::dict keys_of(const CameraObject& camera) {
    return nb::cast<nb::dict>(nb::object(nb::module_::import_("json").attr("loads")(camera.file().text)));
}

nb::dict dict_of(const CameraObject& camera) {
    if (camera.is_for_view_depth())
        throw std::invalid_argument(
            "a camera for view depth has no camera file, whose preset and packing are those of the stored "
            "depth; keep the camera that it comes from, and call for_view_depth() again");
    return keys_of(camera);
}

nb::object side(int pixels) {
    return pixels > 0 ? nb::object(nb::int_(pixels)) : nb::none();
}

std::string shown(const CameraObject& camera) {
    std::string text;
    for (const auto& [key, value] : keys_of(camera))
        text += (text.empty() ? "" : ", ") + text_of(nb::str(key)) + "=" + text_of(nb::repr(value));
    return "fathom.Camera(" + text + ")" + (camera.is_for_view_depth() ? ".for_view_depth()" : "");
}

// What `each` makes of each vector along the last axis of an array, NaN where it makes nothing.
template <Eigen::Index From, Eigen::Index To, typename Each>
nb::object of_each(nb::handle given, const char* name, const Each& each) {
    using Array = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
    const auto array =
        nb::cast<Array>(nb::object(nb::module_::import_("numpy").attr("ascontiguousarray")(given, "float64")));
    if (array.ndim() == 0 || array.shape(array.ndim() - 1) != From)
        throw std::invalid_argument(std::string(name) + " must have " + std::to_string(From) +
                                    " numbers along its last axis");
    std::vector<std::size_t> shape;
    for (std::size_t i = 0; i < array.ndim(); ++i)
        shape.push_back(array.shape(i));
    shape.back() = To;
    const std::size_t count = array.size() / From;
    auto* const made = new double[std::max<std::size_t>(count * To, 1)];
    const nb::capsule owner(made, [](void* data) noexcept { delete[] static_cast<double*>(data); });
    using FromVector = Eigen::Matrix<double, From, 1>;
    using ToVector = Eigen::Matrix<double, To, 1>;
    for (std::size_t i = 0; i < count; ++i) {
        const std::optional<ToVector> found = each(FromVector(Eigen::Map<const FromVector>(array.data() + i * From)));
        Eigen::Map<ToVector>(made + i * To) = found.value_or(ToVector::Constant(std::nan("")));
    }
    return nb::cast(nb::ndarray<nb::numpy, double>(made, shape.size(), shape.data(), owner));
}

// Of a camera whose size is known.
PixelRays rays_of(const CameraObject& camera) {
    const Camera& known = camera.file().camera;
    if (known.width == 0 || known.height == 0)
        throw std::invalid_argument(
            "the camera fits an image of any size, and its rays depend on the size; give width and height");
    return PixelRays(camera.of_size(known.width, known.height));
}

nb::object ray_of_pixels(const CameraObject& camera, nb::handle pixels) {
    return of_each<2, 3>(pixels, "pixels", [rays = rays_of(camera)](const Eigen::Vector2d& pixel) {
        return pixel.allFinite() ? rays.ray_of(pixel.x(), pixel.y()) : std::nullopt;
    });
}

nb::object pixel_of_directions(const CameraObject& camera, nb::handle directions) {
    return of_each<3, 2>(directions, "directions", [rays = rays_of(camera)](const Eigen::Vector3d& direction) {
        return direction.allFinite() && !direction.isZero(0) ? rays.pixel_of(direction) : std::nullopt;
    });
}

// What there is to do with a camera that is made.
void bind_uses(nb::class_<CameraObject>& camera) {
    camera
        .def("for_view_depth", &CameraObject::for_view_depth,
             "The same camera for view depth, as `linearize` makes it: normals(linearize(depth, c), "
             "c.for_view_depth()).")
        .def("ray_of", ray_of_pixels, nb::arg("pixels"),
             nb::sig("def ray_of(self, pixels: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
             "Unit rays of pixel positions (x, y), (..., 2) to (..., 3), in the axes of view space. Positions count "
             "from the corner of the first stored pixel, so that centres lie at + 0.5. NaN where no ray meets a "
             "pixel: beyond a lens's fold, or outside a fisheye's circle.")
        .def("pixel_of", pixel_of_directions, nb::arg("directions"),
             nb::sig("def pixel_of(self, directions: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
             "The pixel positions that see these directions of view space, (..., 3) to (..., 2): the inverse of "
             "ray_of. NaN where the camera sees nothing.")
        .def("to_dict", dict_of,
             "The keys of the camera file: Camera(**camera.to_dict()) is the same camera. A camera for view depth has "
             "none.")
        .def_prop_ro(
            "width", [](const CameraObject& c) { return side(c.file().camera.width); },
            nb::sig("def width(self) -> int | None"), "Pixels; None if the camera fits an image of any size.")
        .def_prop_ro(
            "height", [](const CameraObject& c) { return side(c.file().camera.height); },
            nb::sig("def height(self) -> int | None"), "Pixels; None if the camera fits an image of any size.")
        .def("__repr__", shown)
        .def(
            "__eq__",
            [](const CameraObject& a, const CameraObject& b) {
                return a.is_for_view_depth() == b.is_for_view_depth() && keys_of(a).equal(keys_of(b));
            },
            nb::is_operator(), nb::sig("def __eq__(self, other: object, /) -> bool"))
        .def("__hash__",
             [](const CameraObject& c) {
                 return nb::hash(nb::make_tuple(c.file().camera.width, c.file().camera.height));
             })
        .def("__getstate__", [](const CameraObject& c) { return std::pair(c.file().text, c.is_for_view_depth()); })
        .def("__setstate__", [](CameraObject& self, const std::pair<std::string, bool>& state) {
            const CameraObject stored = camera_of_text(state.first, source);
            new (&self) CameraObject(state.second ? stored.for_view_depth() : stored);
        });
}

void bind_presets(nb::module_& module) {
    module.def(
        "presets",
        [] {
            nb::dict known;
            for (const Preset& preset : presets())
                known[preset.name.c_str()] = preset.source;
            return known;
        },
        nb::sig("def presets() -> dict[str, str]"),
        "The sources that `preset` may name: name, and what writes such depth.");
    module.def("_preset_camera", [](const std::string& text, int width, int height) {
        return as_argument([&] {
            nlohmann::json keys = io::parsed_preset("preset " + text, text);
            camera_for(io::completed(source, {.keys = keys}, {}), width, height); // throws for another size
            keys["width"] = width;
            keys["height"] = height;
            return doubted(CameraObject(io::completed(source, {.keys = keys}, {})), source, 2);
        });
    });
}

} // namespace

std::string in_python(const std::string& said) {
    static const std::pair<std::regex, const char*> spoken[] = {
        {std::regex(R"( \(--(camera|channel)\))"), ""}, // which have no argument here
        {std::regex(R"(--preset ([^ ;,)]+(,[^ ;,)]+)*))"), R"(preset="$1")"},
        {std::regex(R"(--undistorted(?![\w-]))"), "undistorted=True"},
        {std::regex(R"(--(preset|image|node)(?![\w-]))"), "$1="}};
    std::string words = said;
    for (const auto& [option, argument] : spoken)
        words = std::regex_replace(words, option, argument);
    return words;
}

void warn(const std::vector<std::string>& warnings, const std::string& name, int frames) {
    if (warnings.empty())
        return;
    const nb::object category = nb::module_::import_("fathom._fathom").attr("CameraWarning");
    for (const std::string& warning : warnings)
        if (PyErr_WarnEx(category.ptr(), (name + ": " + in_python(warning)).c_str(), frames) != 0)
            throw nb::python_error();
}

const Camera& CameraObject::for_size(int width, int height) const {
    doubt(width, height, source, 2);
    return of_size(width, height);
}

const Camera& CameraObject::of_size(int width, int height) const {
    if (last_.width != width || last_.height != height) {
        const Camera camera = camera_for(file_, width, height);
        last_ = is_for_view_depth_ ? ViewDepth{{}, camera}.stored().camera : camera;
    }
    return last_;
}

CameraObject CameraObject::for_view_depth() const {
    CameraObject other(file_);
    other.is_doubted_ = is_doubted_;
    other.is_depth_doubted_ = is_depth_doubted_;
    other.file_.packing.reset();
    other.is_for_view_depth_ = true;
    return other;
}

void CameraObject::doubt(int width, int height, const std::string& name, int frames) const {
    if (is_doubted_ || width == 0 || height == 0)
        return;
    warn(key_doubts(file_.text, width, height), name, frames);
    is_doubted_ = true;
}

void CameraObject::doubt(const HostDepth& stored, const char* argument) const {
    if (is_depth_doubted_)
        return;
    std::vector<std::string> said;
    try {
        const Camera camera = last_;
        const Unlocked released;
        said = depth_doubts_of_sample(camera, stored);
    } catch (const std::invalid_argument&) { // the operation says it
        return;
    }
    warn(said, argument, 2);
    is_depth_doubted_ = true;
}

// A map of rays, as NumPy writes it.
RayMap rays_from_numpy(const fs::path& file) {
    using Array = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;
    if (file.extension() != ".npy")
        io::refuse(file, "is a map of rays, which the Python package reads from .npy: numpy.save(file, rays)");
    const nb::object numpy = nb::module_::import_("numpy");
    nb::object loaded;
    bool holds_floats = false;
    try {
        loaded = numpy.attr("load")(file.string());
        holds_floats = nb::cast<std::string>(loaded.attr("dtype").attr("kind")) == "f";
        loaded = numpy.attr("ascontiguousarray")(loaded, "float32");
    } catch (nb::python_error& error) {
        io::refuse(file, "cannot be read as a map of rays: " + text_of(nb::str(error.value())));
    }
    const auto rays = nb::cast<Array>(loaded);
    if (!holds_floats || rays.ndim() != 3 || rays.shape(2) != 3)
        io::refuse(file, "is no map of rays, which has rows, columns and three floats a pixel");
    return {static_cast<int>(rays.shape(1)), static_cast<int>(rays.shape(0)), {rays.data(), rays.data() + rays.size()}};
}

void bind_camera(nb::module_& module) {
    io::ray_reader() = rays_from_numpy;
    const auto warning =
        nb::steal(PyErr_NewExceptionWithDoc("fathom.CameraWarning",
                                            "A camera that can be used, but that hardly anybody means, by itself or "
                                            "for its depth. Each camera is told once.",
                                            PyExc_UserWarning, nullptr));
    module.attr("CameraWarning") = warning;
    nb::class_<CameraObject> camera(module, "Camera", R"(What stored depth means: projection, size, encoding, pose.

Camera(**keys) takes the keys of the camera file (docs/camera.md) as keyword arguments:

    Camera(width=640, height=480, intrinsics={"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5},
           encoding="view-z", scale=0.001, missing=0)

Numbers, text, lists, dicts and NumPy arrays will do; None leaves a key out. The keys of `perspective`, `intrinsics` and
`orthographic` may stand alone: Camera(fov_y_deg=60, near=0.1, far=50). Without width and height the camera fits an array
of any size. `preset` names what writes the depth, one of fathom.presets():

    Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)

Principal points are counted from the corner of the first pixel, unless pixel_origin="centre".

Two cameras are equal if their keys are.

Raises ValueError naming the key, its value and what would be right. Warns (CameraWarning) of keys that are probably wrong.)");
    camera
        .def(
            "__init__",
            [](CameraObject* self, const nb::kwargs& keys) {
                new (self) CameraObject(doubted(camera_of_keys(keys), source));
            },
            nb::arg("keys"))
        .def_static(
            "load", load, nb::arg("path"), nb::kw_only(), nb::arg("image") = "", nb::arg("node") = "",
            nb::arg("preset") = "", nb::arg("undistorted") = false, nb::arg("storage") = nb::none(),
            nb::arg("depth") = "",
            R"(Reads a camera file (JSON), glTF or transforms.json; with the importers of fathom_io also the header of an
OpenEXR image, calibrations of OpenCV and ROS, and COLMAP (docs/cameras.md).

image: of COLMAP or transforms.json, whose camera is meant. node: of glTF, its name or index. preset: what the values of
the depth mean, as in "carla" or "encoding=view-z". undistorted: the depth has been undistorted. storage: of the depth;
ROS counts integers in millimetres and floats in metres. depth: the depth's file, whose name chooses among images.

Raises fathom.Error, one line with the file's name.)")
        .def_static(
            "from_json", [](const std::string& text) { return doubted(camera_of_text(text, source), source); },
            nb::arg("text"), "The camera of a camera file's text.");
    bind_uses(camera);
    bind_presets(module);
}

} // namespace fathom::python
