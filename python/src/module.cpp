// The module fathom._fathom: devices, images and exceptions. Operations and cameras have files of their own.
#include "call.hpp"
#include "camera.hpp"
#include "unlocked.hpp"

#include "description/range.hpp"

#include <fathom/device.hpp>
#include <fathom/error.hpp>
#include <fathom/probe.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace fathom::python {

void bind_camera(nb::module_& module);     // camera.cpp
void bind_end(nb::module_& module);        // unlocked.cpp
void bind_operations(nb::module_& module); // operations.cpp

namespace {

template <typename Handle>
Handle handle_of(std::uintptr_t pointer) {
    return reinterpret_cast<Handle>(pointer); // NOLINT: it comes from pyopencl's int_ptr
}

template <typename Handle>
std::uintptr_t int_ptr(Handle handle) {
    return reinterpret_cast<std::uintptr_t>(handle);
}

void bind_device_infos(nb::module_& module) {
    nb::class_<DeviceInfo>(module, "DeviceInfo", "What a device says about itself.")
        .def_ro("index", &DeviceInfo::index, "Position in devices(), which Device() takes.")
        .def_ro("name", &DeviceInfo::name)
        .def_ro("platform", &DeviceInfo::platform)
        .def_ro("version", &DeviceInfo::version)
        .def_ro("cpu", &DeviceInfo::cpu)
        .def_ro("fp64", &DeviceInfo::fp64)
        .def_ro("compute_units", &DeviceInfo::compute_units)
        .def_ro("memory_bytes", &DeviceInfo::memory_bytes)
        .def_ro("denormals", &DeviceInfo::denormals, "Does the driver say that it keeps them? So with the next two.")
        .def_ro("correct_rounding", &DeviceInfo::correct_rounding, "Of quotients and square roots.")
        .def_ro("fma", &DeviceInfo::fma)
        .def_ro("native_vector_width", &DeviceInfo::native_vector_width, "Floats that one instruction computes.")
        .def("__repr__", [](const DeviceInfo& info) {
            return "<fathom.DeviceInfo " + std::to_string(info.index) + ": " + info.name + " of " + info.platform + ">";
        });
    module.def(
        "devices",
        [] {
            find_driver();
            const Unlocked released;
            return list_devices();
        },
        "Every OpenCL device of every platform; an empty list where no driver is installed.");
}

void bind_devices(nb::module_& module) {
    nb::class_<Device>(module, "Device", R"(An OpenCL device with a queue.

Device(wanted=None) opens "cpu", "gpu", one of devices(), its index, or a part of a name; by default a GPU where there is one,
the CPU otherwise. arithmetic: 'automatic', 'fp64' or 'two-float'; vector_width: 1, 4, 8 or 16; group_size: 1 to 1024. Nothing but
time depends on these. memory_budget: bytes that an operation may take beside its images; what does not fit is done in bands of
rows, and 0 stands for what is fastest.

Raises NoDevice naming what is there, and ValueError.)")
        .def(
            "__init__",
            [](Device* self, nb::handle choice, const std::optional<std::string>& named_arithmetic, int vector_width,
               int group_size, std::size_t memory_budget) {
                DeviceOptions options{
                    .vector_width = vector_width, .group_size = group_size, .memory_budget = memory_budget};
                static constexpr std::array names{"automatic", "fp64", "two-float"};
                const std::string arithmetic = named_arithmetic.value_or(names[0]);
                const auto named = std::ranges::find(names, arithmetic);
                if (named == names.end())
                    throw std::invalid_argument("arithmetic = '" + arithmetic + "' is unknown; it is " +
                                                description::in_words(names));
                options.arithmetic = static_cast<Arithmetic>(named - names.begin());
                const std::string wanted = device_name_of(choice, "wanted");
                new (self) Device(opened([&] { return Device::open(wanted, options); }));
            },
            nb::arg("wanted") = nb::none(), nb::kw_only(), nb::arg("arithmetic") = nb::none(),
            nb::arg("vector_width") = 0, nb::arg("group_size") = 0, nb::arg("memory_budget") = 0,
            nb::sig("def __init__(self, wanted: Device | DeviceInfo | str | int | None = None, *, "
                    "arithmetic: typing.Literal['automatic', 'fp64', 'two-float'] | None = None, "
                    "vector_width: int = 0, group_size: int = 0, memory_budget: int = 0) -> None"))
        .def_static(
            "from_int_ptr",
            [](std::uintptr_t context, std::uintptr_t device, std::uintptr_t queue) {
                const Unlocked released;
                return Device(handle_of<cl_context>(context), handle_of<cl_device_id>(device),
                              handle_of<cl_command_queue>(queue));
            },
            nb::kw_only(), nb::arg("context"), nb::arg("device"), nb::arg("queue"),
            R"(Takes part in a program that has a context and a queue already. All three are retained.

With pyopencl: Device.from_int_ptr(context=context.int_ptr, device=device.int_ptr, queue=queue.int_ptr).)")
        .def_prop_ro("info", &Device::info)
        .def(
            "probe_arithmetic", [](const Device& device) { return to_string(probe_arithmetic(device)); },
            nb::call_guard<Unlocked>(),
            R"(How the device rounds, as a kernel finds it with 2^20 hard cases: 'exact', 'exact, without double', or what is not.

Devices with the same answer give the same bits if it begins with 'exact'.)")
        .def("finish", &Device::finish, nb::call_guard<Unlocked>(),
             "Waits until everything that was started has ended.")
        .def("__repr__", [](const Device& device) { return "<fathom.Device " + device.info().name + ">"; });
}

void check_copy(nb::handle copy) {
    if (copy.is(nb::handle(Py_False)))
        throw std::invalid_argument("an Image gives a copy of its pixels; leave copy=False out");
}

Layout layout_of(const std::vector<int>& shape, std::size_t row_stride) {
    if (shape.size() != 2 && shape.size() != 3)
        throw std::invalid_argument("shape: must be (height, width) or (height, width, channels)");
    return {shape[1], shape[0], shape.size() == 3 ? shape[2] : 1, row_stride};
}

DeviceImage image_in_buffer(const Device& device, std::uintptr_t buffer, const std::string& dtype,
                            const std::vector<int>& shape, std::size_t row_stride, std::size_t offset) {
    const Layout layout = layout_of(shape, row_stride);
    const Layout tight{layout.width, layout.height, layout.channels,
                       row_stride ? row_stride
                                  : static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.channels)};
    const Image image(device, handle_of<cl_mem>(buffer), element_of_name(dtype), tight, offset);
    cl_mem_flags flags = 0;
    if (clGetMemObjectInfo(image.buffer(), CL_MEM_FLAGS, sizeof flags, &flags, nullptr) != CL_SUCCESS)
        throw Error("the OpenCL driver does not tell the flags of a buffer");
    return {image, {}, flags & CL_MEM_READ_ONLY ? "the Image is of a read-only buffer" : nullptr};
}

nb::object array_of(const DeviceImage& image, const nb::object& dtype, const nb::object& copy) {
    check_copy(copy);
    const nb::object array = to_numpy(image.image);
    return dtype.is_none() ? array : nb::object(array.attr("astype")(dtype));
}

nb::object dlpack_of(const DeviceImage& image, const nb::kwargs& options) {
    if (options.contains("copy"))
        check_copy(options["copy"]);
    return to_numpy(image.image).attr("__dlpack__")(**options);
}

std::string shown_image(const DeviceImage& image) {
    return std::string("<fathom.Image ") + text_of(nb::str(nb::object(nb::cast(image).attr("shape")))) + " " +
           name_of(image.image.element()) + " on " + image.image.device().info().name + ">";
}

void bind_images(nb::module_& module) {
    nb::class_<DeviceImage>(module, "Image",
                            R"(An image on a device, for operations that follow each other without a download.

On a CPU device Image(array, device=None) is the array's memory: leave the array alone until the results are there, until
numpy() or Device.finish(). It is a copy on any other device, and of arrays that are not aligned to their elements, of another
byte order, with gaps between columns or channels, or whose rows go backwards or overlap. Such copies, and Images of read-only
arrays, are no `out`. Operations on an Image give Images.

numpy.asarray(image) and DLPack wait for the image, and copy it.)")
        .def(
            "__init__",
            [](DeviceImage* self, nb::handle array, nb::handle device) {
                new (self) DeviceImage(to_device(array, device_of(device)));
            },
            nb::arg("array"), nb::arg("device") = nb::none(),
            nb::sig("def __init__(self, array: fathom._operations.Array | Image, "
                    "device: Device | DeviceInfo | str | int | None = None) -> None"))
        .def_static(
            "from_int_ptr", image_in_buffer, nb::arg("device"), nb::arg("buffer"), nb::kw_only(), nb::arg("dtype"),
            nb::arg("shape"), nb::arg("row_stride") = 0, nb::arg("offset") = 0,
            R"(An image in an OpenCL buffer that is there already, as `buffer.int_ptr` of pyopencl. The buffer is retained.

dtype: "float32", "float16", "uint32", "uint16" or "uint8". shape: (height, width) or (height, width, channels). row_stride:
elements from one row to the next (default: without a gap). offset: elements before the first pixel.)")
        .def(
            "numpy", [](const DeviceImage& image) { return to_numpy(image.image); },
            nb::sig("def numpy(self) -> fathom._operations.NumpyArray"),
            "Waits for the image, and copies it into a new NumPy array.")
        .def("__array__", array_of, nb::arg("dtype") = nb::none(), nb::arg("copy") = nb::none(),
             nb::sig("def __array__(self, dtype: typing.Any = None, copy: bool | None = None) -> "
                     "fathom._operations.NumpyArray"),
             "The same, for NumPy.")
        .def("__dlpack__", dlpack_of, nb::arg("options"),
             nb::sig("def __dlpack__(self, **options: typing.Any) -> typing.Any"), "A copy on the CPU.")
        .def("__dlpack_device__", [](const DeviceImage&) { return std::pair(nb::device::cpu::value, 0); })
        .def_prop_ro(
            "shape",
            [](const DeviceImage& image) {
                return shape_of({image.image.width(), image.image.height(), image.image.channels()});
            },
            "(height, width), or (height, width, channels).")
        .def_prop_ro(
            "dtype", [](const DeviceImage& image) { return name_of(image.image.element()); },
            "As NumPy calls it: \"float32\".")
        .def_prop_ro(
            "row_stride", [](const DeviceImage& image) { return image.image.row_stride(); }, "Elements.")
        .def_prop_ro("device", [](const DeviceImage& image) { return image.image.device(); })
        .def_prop_ro(
            "int_ptr", [](const DeviceImage& image) { return int_ptr(image.image.buffer()); },
            "The OpenCL buffer, for pyopencl.Buffer.from_int_ptr(image.int_ptr).")
        .def("__repr__", shown_image);
}

void bind_back_depth(nb::module_& module) {
    nb::class_<BackDepth>(
        module, "BackDepth",
        R"(A thickness for `ssao`: each pixel's solid ends at a second layer of depth, of the same camera and size.
Where it is NaN or lies in front of the first, a quarter of the radius counts.

    fathom.ssao(depth, camera, 0.5, thickness=fathom.BackDepth(back)))")
        .def(
            "__init__", [](BackDepth* self, nb::handle depth) { new (self) BackDepth{nb::borrow(depth)}; },
            nb::arg("depth"), nb::sig("def __init__(self, depth: fathom._operations.Array | Image) -> None"));
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
#ifdef NDEBUG
    nb::set_leak_warnings(false); // a daemon thread still holds objects when the interpreter ends
#endif
    bind_end(module);
    bind_camera(module);
    bind_device_infos(module);
    bind_devices(module);
    bind_images(module);
    bind_back_depth(module);
    bind_operations(module);
}
