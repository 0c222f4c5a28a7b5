// The module fathom._fathom: exceptions and devices. Images, cameras and operations have files of their own.
#include "arrays.hpp"

#include <fathom/error.hpp>
#include <fathom/probe.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <map>
#include <mutex>

namespace fathom::python {

void bind_camera(nb::module_& module);     // camera.cpp
void bind_images(nb::module_& module);     // images.cpp
void bind_operations(nb::module_& module); // operations.cpp

namespace {

// What `Device::open` takes, of anything but a `fathom.Device`.
std::string device_name_of(nb::handle given, const char* argument) {
    std::string wanted;
    std::size_t index = 0;
    if (given.is_none() || nb::try_cast(given, wanted))
        return wanted;
    if (nb::isinstance<DeviceInfo>(given))
        return std::to_string(nb::cast<const DeviceInfo&>(given).index);
    if (nb::try_cast(given, index))
        return std::to_string(index);
    throw std::invalid_argument(
        text(argument, ": ", nb::repr(given).c_str(),
             " is none; give a fathom.Device, one of fathom.devices(), its index, \"cpu\", \"gpu\", or "
             "a part of a name"));
}

// Lets the loader know the driver that the extra `cpu` brings.
void find_driver() {
    static bool is_found = false; // the interpreter lets one thread at a time import a module
    if (!is_found)
        nb::module_::import_("fathom._driver");
    is_found = true;
}

Device opened(const std::function<Device()>& open) {
    find_driver();
    const Unlocked released;
    try {
        return open();
    } catch (const NoDevice& error) {
        if (!list_devices().empty())
            throw;
        throw NoDevice(text(error.what(),
                            "; pip install \"fathom-depth[cpu]\" brings a driver for the CPU, which is taken where "
                            "/etc/OpenCL/vendors has none, OCL_ICD_VENDORS is not set, and FATHOM_CPU is not off"));
    }
}

void open_device(Device* self, nb::handle choice, int vector_width, int group_size, std::size_t memory_budget) {
    const DeviceOptions options{.vector_width = vector_width, .group_size = group_size, .memory_budget = memory_budget};
    const std::string wanted = device_name_of(choice, "wanted");
    new (self) Device(opened([&] { return Device::open(wanted, options); }));
}

Device of_handles(std::uintptr_t context, std::uintptr_t device, std::uintptr_t queue) {
    const Unlocked released;
    return {reinterpret_cast<cl_context>(context),      // NOLINT: they come from pyopencl's int_ptr
            reinterpret_cast<cl_device_id>(device),     // NOLINT
            reinterpret_cast<cl_command_queue>(queue)}; // NOLINT
}

void bind_devices(nb::module_& module) {
    using nb::arg;
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
            return text("<fathom.DeviceInfo ", info.index, ": ", info.name, " of ", info.platform, ">");
        });
    module.def(
        "devices",
        [] {
            find_driver();
            const Unlocked released;
            return list_devices();
        },
        "Every OpenCL device of every platform; an empty list where no driver is installed.");
    nb::class_<Device>(module, "Device", R"(An OpenCL device with a queue.

Device(wanted=None) opens "cpu", "gpu", one of devices(), its index, or a part of a name; by default a GPU where there is one,
the CPU otherwise. vector_width: 1, 4, 8 or 16; group_size: 1 to 1024. Nothing but time depends on these. memory_budget: bytes that
an operation may take beside its images; what does not fit is done in bands of rows, and 0 stands for what is fastest.

Raises NoDevice naming what is there, and ValueError.)")
        .def("__init__", open_device, arg("wanted") = nb::none(), nb::kw_only(), arg("vector_width") = 0,
             arg("group_size") = 0, arg("memory_budget") = 0,
             nb::sig("def __init__(self, wanted: Device | DeviceInfo | str | int | None = None, *, "
                     "vector_width: int = 0, group_size: int = 0, memory_budget: int = 0) -> None"))
        .def_static("from_int_ptr", of_handles, nb::kw_only(), arg("context"), arg("device"), arg("queue"),
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

} // namespace

Device device_of(nb::handle choice) {
    if (nb::isinstance<Device>(choice))
        return nb::cast<Device>(choice);
    const std::string wanted = device_name_of(choice, "device");
    return opened([&] {
        static std::mutex mutex;
        static auto& open = *new std::map<std::string, Device>; // drivers may be gone when static objects end
        const std::lock_guard lock(mutex);
        if (const auto at = open.find(wanted); at != open.end())
            return at->second;
        return open.emplace(wanted, Device::open(wanted)).first->second;
    });
}

} // namespace fathom::python

NB_MODULE(_fathom, module) {
    using namespace fathom::python;
    module.doc() = "Exact post-processing of depth images.";
    module.attr("_version") = FATHOM_VERSION;
    static_cast<void>(is_plain(module)); // looks NumPy's type up before threads could wait for each other
    const auto error = nb::exception<fathom::Error>(module, "Error", PyExc_RuntimeError);
    error.doc() = "A failure of the device, its driver or a file.";
    nb::exception<fathom::NoDevice>(module, "NoDevice", error.ptr()).doc() =
        "No OpenCL device answers to what was asked for.";
#ifdef NDEBUG
    nb::set_leak_warnings(false); // a daemon thread still holds objects when the interpreter ends
#endif
    module.def("_end_work", end_work);
    module.def("_begin_child", begin_child);
    bind_devices(module);
    bind_images(module);
    bind_camera(module);
    bind_operations(module);
}
