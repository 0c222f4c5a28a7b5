// fathom.Image and fathom.BackDepth.
#include "arrays.hpp"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace fathom::python {
namespace {

// Waits for the device before it lets the array go. The interpreter's lock is held then.
std::shared_ptr<ReadArray> held(const ReadArray& array, const Device& device) {
    return {new ReadArray(array), [device](ReadArray* kept) {
                try {
                    const Unlocked released;
                    device.finish();
                } catch (const std::exception&) { // whoever uses the results is told
                }
                delete kept;
            }};
}

DeviceImage to_device(nb::handle given, nb::handle choice) {
    if (nb::isinstance<DeviceImage>(given))
        return nb::cast<DeviceImage>(given);
    const Device device = device_of(choice);
    const HostImage host = host_image(given, "depth", "array");
    WriteArray own;
    const bool is_target = nb::try_cast(given, own) && own.data() == host.array.data();
    return {
        image_of(host, device), held(host.array, device),
        is_target
            ? nullptr
            : "the Image is of a read-only array, or a copy of one where no result can go: of another byte order or "
              "alignment, or with gaps between columns",
        device.info().cpu ? host.depth() : HostDepth{}};
}

nb::object to_numpy(const DeviceImage& image) {
    const Image& its = image.image;
    nb::object array = new_array(its.element(), {its.width(), its.height(), its.channels()});
    void* data = nb::cast<WriteArray>(array).data();
    const Unlocked released;
    its.download(data);
    return array;
}

nb::object to_numpy_as(const DeviceImage& image, nb::handle dtype, nb::handle copy) {
    if (copy.is(nb::handle(Py_False)))
        throw std::invalid_argument("an Image gives a copy of its pixels; leave copy=False out");
    nb::object array = to_numpy(image);
    return dtype.is_none() ? array : array.attr("astype")(dtype);
}

DeviceImage image_in_buffer(const Device& device, std::uintptr_t pointer, std::string_view dtype,
                            const std::vector<int>& shape, std::size_t row_stride, std::size_t offset) {
    const auto type = std::ranges::find(types, dtype, &Type::name);
    if (type == types.end() || (shape.size() != 2 && shape.size() != 3))
        throw std::invalid_argument(text("dtype: ", dtype,
                                         " must be float32, float16, uint32, uint16 or uint8, and shape (height, "
                                         "width) or (height, width, channels)"));
    const int channels = shape.size() == 3 ? shape[2] : 1;
    if (row_stride == 0)
        row_stride = static_cast<std::size_t>(shape[1]) * static_cast<std::size_t>(channels);
    const auto buffer = reinterpret_cast<cl_mem>(pointer); // NOLINT: it comes from pyopencl's int_ptr
    const Image image(device, buffer, static_cast<Element>(type - types.begin()),
                      {shape[1], shape[0], channels, row_stride}, offset);
    cl_mem_flags flags = 0;
    clGetMemObjectInfo(image.buffer(), CL_MEM_FLAGS, sizeof flags, &flags, nullptr);
    return {image, {}, flags & CL_MEM_READ_ONLY ? "the Image is of a read-only buffer" : nullptr};
}

nb::tuple shape_of_image(const DeviceImage& image) {
    return shape_of({image.image.width(), image.image.height(), image.image.channels()});
}

} // namespace

void bind_images(nb::module_& module) {
    using nb::arg;
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
                new (self) DeviceImage(to_device(array, device));
            },
            arg("array").none(), arg("device") = nb::none(),
            nb::sig("def __init__(self, array: fathom._arrays.Array | Image, "
                    "device: Device | DeviceInfo | str | int | None = None) -> None"))
        .def_static(
            "from_int_ptr", image_in_buffer, arg("device"), arg("buffer"), nb::kw_only(), arg("dtype"), arg("shape"),
            arg("row_stride") = 0, arg("offset") = 0,
            R"(An image in an OpenCL buffer that is there already, as `buffer.int_ptr` of pyopencl. The buffer is retained.

dtype: "float32", "float16", "uint32", "uint16" or "uint8". shape: (height, width) or (height, width, channels). row_stride:
elements from one row to the next (default: without a gap). offset: elements before the first pixel.)")
        .def("numpy", to_numpy, nb::sig("def numpy(self) -> fathom._arrays.NumpyArray"),
             "Waits for the image, and copies it into a new NumPy array.")
        .def(
            "__array__", to_numpy_as, arg("dtype") = nb::none(), arg("copy") = nb::none(),
            nb::sig(
                "def __array__(self, dtype: typing.Any = None, copy: bool | None = None) -> fathom._arrays.NumpyArray"))
        .def(
            "__dlpack__",
            [](const DeviceImage& image, const nb::kwargs& options) {
                return to_numpy(image).attr("__dlpack__")(**options);
            },
            arg("options"), nb::sig("def __dlpack__(self, **options: typing.Any) -> typing.Any"), "A copy on the CPU.")
        .def("__dlpack_device__", [](const DeviceImage&) { return std::pair(nb::device::cpu::value, 0); })
        .def_prop_ro("shape", shape_of_image, "(height, width), or (height, width, channels).")
        .def_prop_ro(
            "dtype", [](const DeviceImage& image) { return type_of(image.image.element()).name; },
            "As NumPy calls it: \"float32\".")
        .def_prop_ro(
            "row_stride", [](const DeviceImage& image) { return image.image.row_stride(); }, "Elements.")
        .def_prop_ro("device", [](const DeviceImage& image) { return image.image.device(); })
        .def_prop_ro(
            "int_ptr", [](const DeviceImage& image) { return reinterpret_cast<std::uintptr_t>(image.image.buffer()); },
            "The OpenCL buffer, for pyopencl.Buffer.from_int_ptr(image.int_ptr).")
        .def("__repr__", [](const DeviceImage& image) {
            return text("<fathom.Image ", nb::repr(shape_of_image(image)).c_str(), " ",
                        type_of(image.image.element()).name, " on ", image.image.device().info().name, ">");
        });
    nb::class_<BackDepth>(
        module, "BackDepth",
        R"(A thickness for `ssao`: each pixel's solid ends at a second layer of depth, of the same camera and size.
Where it is NaN or lies in front of the first, a quarter of the radius counts.

    fathom.ssao(depth, camera, 0.5, thickness=fathom.BackDepth(back)))")
        .def(nb::init<nb::object>(), nb::arg("depth"),
             nb::sig("def __init__(self, depth: fathom._arrays.Array | Image) -> None"));
}

} // namespace fathom::python
