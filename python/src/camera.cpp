// fathom._fathom._Camera, of which fathom/_camera.py makes fathom.Camera: a camera file's text, and what the importers find.
#include "camera.hpp"

#include "camera_file/file.hpp"
#include "camera_file/imported.hpp"
#include "camera_file/json_object.hpp"
#include "camera_file/known_words.hpp"
#include "camera_file/lens_key.hpp"

#include <fathom/error.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/presets.hpp>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fathom::python {
namespace {

template <int Count>
using Vectors = nb::ndarray<double, nb::shape<-1, Count>, nb::c_contig, nb::device::cpu>;

// What the caller said is wrong, and no file.
template <typename Make>
auto as_argument(const Make& make) {
    try {
        return make();
    } catch (const Error& error) {
        throw std::invalid_argument(error.what());
    }
}

// `source` stands in messages where a file's name would, and leads to the files that the text names.
void make_camera(CameraObject* self, const std::string& text, const std::filesystem::path& source) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
    new (self) CameraObject{as_argument([&] {
        return io::completed(source, {.keys = io::parsed_json(source, {bytes, text.size()})}, {});
    })};
}

void make_for_view_depth(CameraObject* self, const CameraObject& other) {
    new (self) CameraObject{other.file, true, other.are_keys_told, other.told};
    self->file.packing.reset();
    self->file.gamma.reset();
}

// The keys of a preset's text, for an image of this size.
std::string keys_of_preset(const std::string& text, int width, int height) {
    return as_argument([&] {
        nlohmann::json keys = io::parsed_preset("preset " + text, text);
        camera_for(io::completed("Camera", {.keys = keys}, {}), width, height); // throws for another size
        keys["width"] = width;
        keys["height"] = height;
        return keys.dump();
    });
}

// What is probably wrong with the keys of a camera that has a size.
std::vector<std::string> doubts_of(const CameraObject& camera) {
    const auto& [width, height] = std::pair(camera.file.camera.width, camera.file.camera.height);
    camera.are_keys_told = width > 0 && height > 0;
    return camera.are_keys_told ? key_doubts(camera.file.text, width, height) : std::vector<std::string>{};
}

PixelRays rays_of(const CameraObject& camera) {
    return PixelRays(camera.of_size(camera.file.camera.width, camera.file.camera.height));
}

// Vectors for which there is nothing keep the NaN that they have.
void write_rays(const CameraObject& camera, const Vectors<2>& pixels, const Vectors<3>& rays) {
    const PixelRays its = rays_of(camera);
    for (std::size_t i = 0; i < pixels.shape(0); ++i)
        if (std::isfinite(pixels(i, 0)) && std::isfinite(pixels(i, 1)))
            if (const auto ray = its.ray_of(pixels(i, 0), pixels(i, 1)))
                std::copy_n(ray->data(), 3, &rays(i, 0));
}

void write_pixels(const CameraObject& camera, const Vectors<3>& directions, const Vectors<2>& pixels) {
    const PixelRays its = rays_of(camera);
    for (std::size_t i = 0; i < directions.shape(0); ++i) {
        const Eigen::Vector3d direction(directions(i, 0), directions(i, 1), directions(i, 2));
        if (direction.allFinite() && !direction.isZero(0))
            if (const auto pixel = its.pixel_of(direction))
                std::copy_n(pixel->data(), 2, &pixels(i, 0));
    }
}

RayMap map_of_rays(const std::filesystem::path& file) {
    using Rays = nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
    try {
        const auto rays = nb::cast<Rays>(in_python("fathom._camera", "map_of_rays")(file));
        return {
            static_cast<int>(rays.shape(1)), static_cast<int>(rays.shape(0)), {rays.data(), rays.data() + rays.size()}};
    } catch (nb::python_error& error) {
        if (!error.matches(PyExc_Exception))
            throw;
        io::refuse(file, nb::str(error.value()).c_str());
    }
}

nb::object side(int pixels) {
    return pixels > 0 ? nb::object(nb::int_(pixels)) : nb::none();
}

nb::dict known_presets() {
    nb::dict known;
    for (const Preset& preset : presets())
        known[preset.name.c_str()] = preset.source;
    return known;
}

} // namespace

void bind_camera(nb::module_& module) {
    io::ray_reader() = map_of_rays;
    nb::class_<CameraObject>(module, "_Camera")
        .def("__init__", make_camera)
        .def("__init__", make_for_view_depth)
        .def("_doubts", doubts_of)
        .def("_write_rays", write_rays)
        .def("_write_pixels", write_pixels)
        .def_prop_ro(
            "width", [](const CameraObject& camera) { return side(camera.file.camera.width); },
            nb::sig("def width(self) -> int | None"), "Pixels; None if the camera fits an image of any size.")
        .def_prop_ro(
            "height", [](const CameraObject& camera) { return side(camera.file.camera.height); },
            nb::sig("def height(self) -> int | None"), "Pixels; None if the camera fits an image of any size.")
        .def_prop_ro("_text", [](const CameraObject& camera) { return camera.file.text; })
        .def_ro("_is_for_view_depth", &CameraObject::is_for_view_depth);
    module.def("_camera_file", camera_file<import_json_camera>);
    module.def("_keys_of_preset", keys_of_preset);
    module.def("_object_of", io::object_of);
    module.def("presets", known_presets, nb::sig("def presets() -> dict[str, str]"),
               "The sources that `preset` may name: name, and what writes such depth.");
}

} // namespace fathom::python
