// One call of an operation from Python, and the device that it is for.
#include "call.hpp"

#include "unlocked.hpp"

#include <fathom/error.hpp>
#include <fathom/linearize.hpp>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>
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

std::string device_name_of(const DeviceOption& choice, const char* argument) {
    const nb::handle given = choice.given;
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

Device device_of(const DeviceOption& choice) {
    if (nb::isinstance<Device>(choice.given))
        return nb::cast<Device>(choice.given);
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

// Pixels that do not count. Anything that NumPy compares with 0 will do.
Mask mask_of(const Pixels& ignore, int width, int height) {
    const nb::module_ numpy = nb::module_::import_("numpy");
    const nb::object given = is_image(ignore.given) ? to_numpy(nb::cast<const DeviceImage&>(ignore.given).image)
                                                    : nb::object(numpy.attr("asarray")(ignore.given));
    const std::string shape = text_of(nb::str(nb::object(given.attr("shape")))),
                      of_depth = text_of(nb::str(nb::make_tuple(height, width)));
    if (shape != of_depth)
        refuse("ignore", "its shape is " + shape + "; it must be that of the depth, " + of_depth);
    return nb::cast<Mask>(nb::object(numpy.attr("ascontiguousarray")(numpy.attr("not_equal")(given, 0))));
}

} // namespace

Call::Call(const Pixels& depth, const CameraObject& camera, const Word<Storage>& storage, const DeviceOption& device,
           const Pixels& ignore)
    : Call(depth, &camera, storage, device) {
    depth_ = stored(depth, "depth", ignore);
}

Call::Call(const Pixels& depth, const LensArguments& lens, const Pixels& color, const DeviceOption& device,
           const Pixels& ignore)
    : Call(depth, nullptr, {}, device) {
    Numbers given = numbers_of(depth, Holds::relative, "depth");
    const auto [width, height, channels, _] = given.layout;
    if (ignore) {
        const Mask mask = mask_of(ignore, width, height);
        for (std::size_t i = 0; i < given.values.size(); ++i)
            if (mask.data()[i / static_cast<std::size_t>(channels)])
                given.values[i] = std::numeric_limits<float>::quiet_NaN();
    }
    Numbers picture;
    if (color)
        picture = numbers_of(color, Holds::picture, "color");
    if (picture.bits < 32)
        for (float& code : picture.values)
            code /= picture.bits == 8 ? 255.0f : 65535.0f;
    const auto made = std::make_shared<RelativeValues>();
    try {
        const Unlocked released;
        *made = relative_values(given.floats(), given.bits, relative_options(lens), picture.floats());
    } catch (const std::invalid_argument& error) {
        refuse("depth", error.what());
    }
    warn(made->doubts, "depth");
    kept_.push_back(made);
    waits_ = true;
    depth_ = {Image::from_host(device_, Element::f32, made->values.data(), {made->width, made->height}),
              relative_camera(made->width, made->height, *lens.relative), Storage::float32};
}

Call::Call(const Pixels& depth, const CameraObject* camera, const Word<Storage>& storage, const DeviceOption& device)
    : camera_(camera), storage_(storage), makes_images_(is_image(depth.given)) {
    last_run = {};
    const bool chosen = device.given.is_valid() && !device.given.is_none();
    device_ = makes_images_ && !chosen ? nb::cast<DeviceImage&>(depth.given).image.device() : device_of(device);
}

Call::~Call() {
    const Seconds start = seconds_now();
    fetches_.clear();
    depth_.image = {};
    add_to_last_run(seconds_since(start));
}

// `host`: where an array lies, whose values nobody has given a meaning.
Image Call::image(const Pixels& pixels, Holds holds, const char* argument, HostDepth* host) {
    const auto look_at = [&](const HostDepth& lies, Element element) {
        if (host && reinterpret_cast<std::uintptr_t>(lies.data) % element_bytes(element) == 0)
            *host = lies;
    };
    if (is_image(pixels.given)) {
        const auto& shared = nb::cast<DeviceImage&>(pixels.given);
        if (shared.array)
            kept_.push_back(shared.array);
        look_at(shared.host, shared.image.element());
        return shared.image;
    }
    waits_ = true;
    const HostImage array = host_image(pixels.given, holds, argument);
    kept_.push_back(array.held);
    look_at(array.depth(Storage::float32), array.element);
    const Seconds start = seconds_now();
    Image made = image_of(array, device_);
    add_to_last_run(seconds_since(start));
    return made;
}

StoredDepth Call::without(const StoredDepth& stored, const Pixels& ignore) const {
    const Layout layout{stored.image.width(), stored.image.height()};
    const Mask mask = mask_of(ignore, layout.width, layout.height);
    const Unlocked released;
    return ignore_pixels(stored, Image::from_host(device_, Element::u8, mask.data(), layout));
}

StoredDepth Call::stored(const Pixels& pixels, const char* argument, const Pixels& ignore) {
    HostDepth host;
    const Image stored = image(pixels, Holds::depth, argument, &host);
    const Camera& camera = camera_->for_size(stored.width(), stored.height());
    host.storage = storage_of(stored.element(), stored.channels(), storage_, camera_->file().packing, argument);
    StoredDepth depth{stored, camera, host.storage};
    std::vector<std::byte> left; // of an array without the pixels that do not count
    if (ignore) {
        depth = without(depth, ignore);
        if (host.data) {
            host.row_bytes = static_cast<std::size_t>(host.width) * static_cast<std::size_t>(stored.channels()) *
                             element_bytes(stored.element());
            left.resize(host.row_bytes * static_cast<std::size_t>(host.height));
            depth.image.download(left.data());
            host.data = left.data();
        }
    }
    if (host.data)
        camera_->doubt(host, argument);
    return depth;
}

StoredDepth Call::more_depth(const Pixels& pixels, const char* argument) {
    storage_ = {};
    return stored(pixels, argument);
}

void Call::fit(const Image& picture) {
    const Image& image = depth_.image;
    if (picture.width() == image.width() && picture.height() == image.height())
        return;
    const Unlocked released;
    depth_ = upsample_along_edges(depth_, picture);
}

Image Call::result(nb::handle target, const char* argument, Element element, Layout layout) {
    const bool given = target.is_valid() && !target.is_none();
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
