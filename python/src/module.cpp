// The module fathom._fathom: devices, images and exceptions. Operations and cameras have files of their own.
#include "call.hpp"
#include "camera.hpp"
#include "operations.hpp"

#include <fathom/device.hpp>
#include <fathom/error.hpp>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace fathom::python {
namespace {

template <typename Handle> Handle handle_of(std::uintptr_t pointer) {
    return reinterpret_cast<Handle>(pointer); // NOLINT: it comes from pyopencl's int_ptr
}

template <typename Handle> std::uintptr_t int_ptr(Handle handle) {
    return reinterpret_cast<std::uintptr_t>(handle);
}

void bind_devices(nb::module_& module) {
    nb::class_<DeviceInfo>(module, "DeviceInfo", "What a device says about itself.")
        .def_ro("index", &DeviceInfo::index, "Position in devices(), which Device() takes.")
        .def_ro("name", &DeviceInfo::name)
        .def_ro("platform", &DeviceInfo::platform)
        .def_ro("version", &DeviceInfo::version)
        .def_ro("cpu", &DeviceInfo::cpu)
        .def_ro("fp64", &DeviceInfo::fp64)
        .def_ro("compute_units", &DeviceInfo::compute_units)
        .def_ro("memory_bytes", &DeviceInfo::memory_bytes)
        .def("__repr__", [](const DeviceInfo& info) {
            return "<fathom.DeviceInfo " + std::to_string(info.index) + ": " + info.name + " of " + info.platform + ">";
        });
    module.def("devices", &list_devices, nb::call_guard<nb::gil_scoped_release>(),
               "Every OpenCL device of every platform; an empty list where no driver is installed.");

    nb::class_<Device>(module, "Device", R"(An OpenCL device with a queue.

Device(wanted="") opens "cpu", "gpu", an index in devices(), or a part of a name; by default a GPU where there is one, the CPU
otherwise. arithmetic: 'automatic', 'fp64' or 'two-float'; vector_width: 1, 4, 8 or 16; group_size: 1 to 1024. Nothing but
time depends on these.

Raises NoDevice naming what is there, and ValueError.)")
        .def(
            "__init__",
            [](Device* self, const std::string& wanted, const Word<Arithmetic>& arithmetic, int vector_width,
               int group_size) {
                DeviceOptions options{.vector_width = vector_width, .group_size = group_size};
                arithmetic.set(options.arithmetic, "arithmetic");
                const nb::gil_scoped_release released;
                new (self) Device(Device::open(wanted, options));
            },
            nb::arg("wanted") = "", nb::kw_only(), nb::arg("arithmetic") = nb::none(), nb::arg("vector_width") = 0,
            nb::arg("group_size") = 0)
        .def_static(
            "from_int_ptr",
            [](std::uintptr_t context, std::uintptr_t device, std::uintptr_t queue) {
                const nb::gil_scoped_release released;
                return Device(handle_of<cl_context>(context), handle_of<cl_device_id>(device),
                              handle_of<cl_command_queue>(queue));
            },
            nb::kw_only(), nb::arg("context"), nb::arg("device"), nb::arg("queue"),
            R"(Takes part in a program that has a context and a queue already. All three are retained.

With pyopencl: Device.from_int_ptr(context=context.int_ptr, device=device.int_ptr, queue=queue.int_ptr).)")
        .def_prop_ro("info", &Device::info)
        .def("finish", &Device::finish, nb::call_guard<nb::gil_scoped_release>(),
             "Waits until everything that was started has ended.")
        .def("__repr__", [](const Device& device) { return "<fathom.Device " + device.info().name + ">"; });
}

Layout layout_of(const std::vector<int>& shape, std::size_t row_stride) {
    if (shape.size() != 2 && shape.size() != 3)
        throw std::invalid_argument("shape: must be (height, width) or (height, width, channels)");
    return {shape[1], shape[0], shape.size() == 3 ? shape[2] : 1, row_stride};
}

void bind_images(nb::module_& module) {
    nb::class_<DeviceImage>(module, "Image", R"(An image on a device, for operations that follow each other without a download.

Image(array, device=None) is the array's memory on a CPU device, and a copy on any other. Leave the array alone until the
results are there: until numpy() or Device.finish(). Operations on an Image give Images.)")
        .def(
            "__init__",
            [](DeviceImage* self, const Pixels& array, const DeviceChoice& device) {
                new (self) DeviceImage(to_device(array, device_of(device)));
            },
            nb::arg("array"), nb::arg("device") = nb::none())
        .def_static(
            "from_int_ptr",
            [](const Device& device, std::uintptr_t buffer, const std::string& dtype, const std::vector<int>& shape,
               std::size_t row_stride, std::size_t offset) {
                const Layout layout = layout_of(shape, row_stride);
                const Layout tight{layout.width, layout.height, layout.channels,
                                   row_stride ? row_stride
                                              : static_cast<std::size_t>(layout.width) *
                                                    static_cast<std::size_t>(layout.channels)};
                return DeviceImage{
                    Image(device, handle_of<cl_mem>(buffer), element_of_name(dtype), tight, offset)};
            },
            nb::arg("device"), nb::arg("buffer"), nb::kw_only(), nb::arg("dtype"), nb::arg("shape"),
            nb::arg("row_stride") = 0, nb::arg("offset") = 0,
            R"(An image in an OpenCL buffer that is there already, as `buffer.int_ptr` of pyopencl. The buffer is retained.

dtype: "float32", "float16", "uint32", "uint16" or "uint8". shape: (height, width) or (height, width, channels). row_stride:
elements from one row to the next (default: without a gap). offset: elements before the first pixel.)")
        .def("numpy", [](const DeviceImage& image) { return to_numpy(image.image); },
             "Waits for the image, and copies it into a new NumPy array.")
        .def_prop_ro("shape", [](const DeviceImage& image) { return shape_of(image.image); },
                     "(height, width), or (height, width, channels).")
        .def_prop_ro("dtype", [](const DeviceImage& image) { return name_of(image.image.element()); },
                     "As NumPy calls it: \"float32\".")
        .def_prop_ro("row_stride", [](const DeviceImage& image) { return image.image.row_stride(); }, "Elements.")
        .def_prop_ro("device", [](const DeviceImage& image) { return image.image.device(); })
        .def_prop_ro("int_ptr", [](const DeviceImage& image) { return int_ptr(image.image.buffer()); },
                     "The OpenCL buffer, for pyopencl.Buffer.from_int_ptr(image.int_ptr).")
        .def("__repr__", [](const DeviceImage& image) {
            return std::string("<fathom.Image ") + nb::str(shape_of(image.image)).c_str() + " " +
                   name_of(image.image.element()) + " on " + image.image.device().info().name + ">";
        });
}

} // namespace
} // namespace fathom::python

NB_MODULE(_fathom, module) {
    using namespace fathom::python;
    module.doc() = "Exact post-processing of depth images.";
    module.attr("__version__") = FATHOM_VERSION;
    const auto error = nb::exception<fathom::Error>(module, "Error", PyExc_RuntimeError);
    error.doc() = "A failure of the device, its driver or a file.";
    nb::exception<fathom::NoDevice>(module, "NoDevice", error.ptr()).doc() =
        "No OpenCL device answers to what was asked for.";
    bind_camera(module);
    bind_devices(module);
    bind_images(module);
    bind_operations(module);
}
