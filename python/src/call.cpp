// One call of an operation from Python, and the device that it is for.
#include "call.hpp"

#include "unlocked.hpp"

#include <fathom/error.hpp>
#include <fathom/linearize.hpp>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <mutex>
#include <stdexcept>

namespace fathom::python {

Seconds seconds_now() {
    if (!Call::is_timed)
        return {};
    timespec worked{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &worked);
    return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
            static_cast<double>(worked.tv_sec) + 1e-9 * static_cast<double>(worked.tv_nsec)};
}

Seconds seconds_since(const Seconds& start) {
    const Seconds now = seconds_now();
    return {now.first - start.first, now.second - start.second};
}

std::string device_name_of(nb::handle given, const char* argument) {
    std::string wanted;
    if (!given.is_valid() || given.is_none() || nb::try_cast(given, wanted))
        return wanted;
    if (nb::isinstance<DeviceInfo>(given))
        return std::to_string(nb::cast<const DeviceInfo&>(given).index);
    if (PyIndex_Check(given.ptr()) && !PyBool_Check(given.ptr())) {
        const Py_ssize_t index = PyNumber_AsSsize_t(given.ptr(), nullptr);
        PyErr_Clear();
        if (index >= 0)
            return std::to_string(index);
    }
    refuse(argument, text_of(nb::repr(given)) +
                         " is none; give a fathom.Device, one of fathom.devices(), its index, \"cpu\", "
                         "\"gpu\", or a part of a name");
}

void find_driver() {
    static bool is_found = false; // the interpreter lets one thread at a time import a module
    if (!is_found)
        nb::module_::import_("fathom._driver");
    is_found = true;
}

Device opened(const std::function<Device()>& open) {
    find_driver();
    try {
        const Unlocked released;
        return open();
    } catch (const NoDevice& error) {
        if (!list_devices().empty())
            throw;
        throw NoDevice(error.what() +
                       ("; " + text_of(nb::str(nb::module_::import_("fathom._no_driver").attr("cure")()))));
    }
}

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

namespace {

using Mask = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig>;

bool is_given(nb::handle object) {
    return object.is_valid() && !object.is_none();
}

// Pixels that do not count. Anything that NumPy compares with 0 will do.
nb::object mask_of(nb::handle ignore, int width, int height) {
    const nb::module_ numpy = nb::module_::import_("numpy");
    const nb::object given = numpy.attr("asarray")(on_host(ignore));
    const std::string shape = text_of(nb::str(nb::object(given.attr("shape")))),
                      of_depth = text_of(nb::str(nb::make_tuple(height, width)));
    if (shape != of_depth)
        refuse("ignore", "its shape is " + shape + "; it must be that of the depth, " + of_depth);
    return numpy.attr("ascontiguousarray")(numpy.attr("not_equal")(given, 0));
}

} // namespace

Common::Common(const nb::dict& given) {
    for (const auto& [name, object] : {std::pair("depth", &depth),
                                       {"camera", &camera},
                                       {"storage", &storage},
                                       {"out", &out},
                                       {"device", &device},
                                       {"ignore", &ignore}}) {
        PyObject* held = PyDict_GetItemString(given.ptr(), name);
        *object = nb::borrow(held ? held : Py_None);
    }
}

Call::Call(const Common& given, const CameraObject* camera, const LensArguments& lens, nb::handle picture)
    : camera_(camera), makes_images_(is_image(given.depth)) {
    last_run = {};
    device_ = makes_images_ && !is_given(given.device) ? nb::cast<DeviceImage&>(given.depth).image.device()
                                                       : device_of(given.device);
    depth_ = camera ? stored(given.depth, "depth", given.storage, given.ignore) : of_relative(given, lens, picture);
}

StoredDepth Call::of_relative(const Common& given, const LensArguments& lens, nb::handle picture) {
    auto [values, bits] = floats_of(given.depth, Holds::relative, "depth");
    const HostFloats held = on_host(values);
    if (is_given(given.ignore))
        nb::cast(values).attr("__setitem__")(mask_of(given.ignore, held.width, held.height), std::nan(""));
    HostFloats light;
    std::optional<Floats> color;
    if (is_given(picture)) {
        auto [codes, color_bits] = floats_of(picture, Holds::picture, "color");
        if (color_bits < 32)
            nb::cast(codes).attr("__itruediv__")(nb::module_::import_("numpy").attr("float32")((1 << color_bits) - 1));
        color = codes;
        light = on_host(*color);
    }
    const auto made = std::make_shared<RelativeValues>();
    try {
        const Unlocked released;
        *made = relative_values(held, bits, relative_options(lens), light);
    } catch (const std::invalid_argument& error) {
        refuse("depth", error.what());
    }
    warn(made->doubts, "depth", 2);
    kept_.push_back(made);
    waits_ = true;
    return {Image::from_host(device_, Element::f32, made->values.data(), {made->width, made->height}),
            relative_camera(made->width, made->height, *lens.relative), Storage::float32};
}

Call::~Call() {
    const Seconds start = seconds_now();
    fetches_.clear();
    depth_.image = {};
    add_to_last_run(seconds_since(start));
}

// `host`: where an array lies, whose values nobody has given a meaning.
Image Call::image(nb::handle pixels, Holds holds, const char* argument, HostDepth* host) {
    const auto look_at = [&](const HostDepth& lies, Element element) {
        if (host && reinterpret_cast<std::uintptr_t>(lies.data) % element_bytes(element) == 0)
            *host = lies;
    };
    if (is_image(pixels)) {
        const auto& shared = nb::cast<DeviceImage&>(pixels);
        if (shared.array)
            kept_.push_back(shared.array);
        look_at(shared.host, shared.image.element());
        return shared.image;
    }
    waits_ = true;
    const HostImage array = host_image(pixels, holds, argument);
    kept_.push_back(array.held);
    look_at(array.depth(Storage::float32), array.element);
    const Seconds start = seconds_now();
    Image made = image_of(array, device_);
    add_to_last_run(seconds_since(start));
    return made;
}

StoredDepth Call::stored(nb::handle pixels, const char* argument, nb::handle storage, nb::handle ignore) {
    HostDepth host;
    const Image image = this->image(pixels, Holds::depth, argument, &host);
    const Camera& camera = camera_->for_size(image.width(), image.height());
    host.storage = storage_of(image.element(), image.channels(), storage, camera_->file().packing, argument);
    StoredDepth depth{image, camera, host.storage};
    std::vector<std::byte> left; // of an array without the pixels that do not count
    if (is_given(ignore)) {
        const Layout layout{image.width(), image.height()};
        const auto mask = nb::cast<Mask>(mask_of(ignore, layout.width, layout.height));
        {
            const Unlocked released;
            depth = ignore_pixels(depth, Image::from_host(device_, Element::u8, mask.data(), layout));
        }
        if (host.data) {
            host.row_bytes = static_cast<std::size_t>(host.width) * static_cast<std::size_t>(image.channels()) *
                             element_bytes(image.element());
            left.resize(host.row_bytes * static_cast<std::size_t>(host.height));
            depth.image.download(left.data());
            host.data = left.data();
        }
    }
    if (host.data)
        camera_->doubt(host, argument);
    return depth;
}

void Call::fit(const Image& picture) {
    const Image& image = depth_.image;
    if (picture.width() == image.width() && picture.height() == image.height())
        return;
    const Unlocked released;
    depth_ = upsample_along_edges(depth_, picture);
}

Image Call::result(nb::handle target, const char* argument, Element element, Layout layout) {
    const bool given = is_given(target);
    if (given && is_image(target)) {
        const auto& there = nb::cast<DeviceImage&>(target);
        if (there.no_target)
            refuse(argument, there.no_target);
        objects_.push_back(nb::borrow(target));
        return there.image;
    }
    if (!given && makes_images_) {
        const Image image(device_, element, layout);
        objects_.push_back(nb::cast(DeviceImage{image}));
        return image;
    }
    const nb::object object = given ? nb::borrow(target) : new_array(element, layout);
    if (nb::isinstance<nb::tuple>(object))
        refuse(argument, "a tuple is given, but this call has one result; give one array");
    const auto [data, its] = memory_of(object, argument, element, layout);
    waits_ = true;
    objects_.push_back(object);
    const Unlocked released;
    const Seconds start = seconds_now();
    fetches_.push_back({Image::onto_host(device_, element, data, its), data, its.row_stride});
    add_to_last_run(seconds_since(start));
    return fetches_.back().image;
}

thread_local Seconds Call::last_run;

void Call::add_to_last_run(const Seconds& more) {
    last_run.first += more.first;
    last_run.second += more.second;
}

void Call::run(const std::function<void()>& operation) {
    const Unlocked released;
    const Seconds start = seconds_now();
    try {
        operation();
        for (const Fetch& fetch : fetches_)
            fetch.image.download(fetch.data, fetch.row_stride);
        if (waits_ && fetches_.empty())
            device_.finish();
        add_to_last_run(seconds_since(start));
    } catch (...) {
        try {
            device_.finish(); // arrays go when this call ends
        } catch (const std::exception&) {
        }
        throw;
    }
}

} // namespace fathom::python
