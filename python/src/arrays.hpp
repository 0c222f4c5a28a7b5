#pragma once

#include "unlocked.hpp"

#include "runtime/memory.hpp"
#include "text.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/device.hpp>
#include <fathom/findings.hpp>
#include <fathom/image.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

/// Arrays of Python as images of a device, without a copy where the device can read and write the array's memory.
/// fathom/_arrays.py has what takes a copy, and says what is wrong with an array.
namespace fathom::python {

namespace nb = nanobind;

using ReadArray = nb::ndarray<nb::ro>;
using WriteArray = nb::ndarray<>;

/// A function of one of the package's files.
inline nb::object in_python(const char* file, const char* function) {
    return nb::module_::import_(file).attr(function);
}

/// The device that is meant: a `fathom.Device`, or None, one of `fathom.devices()`, its index, or a part of a name. One that was
/// opened by its name is opened once.
Device device_of(nb::handle choice);

struct Type {
    const char* name;
    nb::dlpack::dtype dtype;
};

/// In the order of Element.
inline const std::array types{Type{"uint8", nb::dtype<std::uint8_t>()}, Type{"uint16", nb::dtype<std::uint16_t>()},
                              Type{"uint32", nb::dtype<std::uint32_t>()},
                              Type{"float16", {static_cast<std::uint8_t>(nb::dlpack::dtype_code::Float), 16, 1}},
                              Type{"float32", nb::dtype<float>()}};

inline const Type& type_of(Element element) {
    return types[static_cast<std::size_t>(element)];
}

/// An array's memory, or that of a copy.
struct HostImage {
    ReadArray array;
    Element element;
    Layout layout;

    HostDepth depth(Storage storage = Storage::float32) const {
        return {array.data(), layout.width, layout.height, layout.row_stride * element_bytes(element), storage};
    }
};

/// `fathom.Image`: an image on a device. If it is an array's memory, it keeps the array until the device has done with it.
struct DeviceImage {
    Image image;
    std::shared_ptr<ReadArray> array = {};
    const char* no_target = nullptr; ///< why no result may go here, if none may
    HostDepth host = {};             ///< where that memory lies, if the device reads it there
};

/// `fathom.BackDepth`: a second layer of depth, where each pixel's solid ends.
struct BackDepth {
    nb::object depth;
};

inline std::optional<Element> element_of(nb::dlpack::dtype dtype, std::string_view holds) {
    const auto type = std::ranges::find(types, dtype, &Type::dtype);
    const auto element = static_cast<Element>(type - types.begin());
    const bool fits = type != types.end() && (holds == "depth" || element != Element::u32) &&
                      (holds != "numbers" || element == Element::f32);
    return fits ? std::optional(element) : std::nullopt;
}

/// The layout of an image; none where elements are not aligned, where columns or channels have gaps, and where rows go backwards
/// or overlap.
template <typename Array>
std::optional<Layout> layout_of(const Array& array) {
    if (array.ndim() != 2 && array.ndim() != 3)
        return {};
    for (std::size_t i = 0; i < array.ndim(); ++i)
        if (array.shape(i) == 0 || array.shape(i) > std::size_t{1} << 30)
            return {};
    const auto side = [&](std::size_t i) { return i < array.ndim() ? static_cast<std::int64_t>(array.shape(i)) : 1; };
    const std::int64_t least = side(1) * side(2), row = side(0) == 1 ? least : array.stride(0);
    const bool is_tight = (side(2) == 1 || array.stride(2) == 1) && (side(1) == 1 || array.stride(1) == side(2));
    if (!is_tight || row < least || reinterpret_cast<std::uintptr_t>(array.data()) % array.itemsize() != 0)
        return {};
    return Layout{static_cast<int>(side(1)), static_cast<int>(side(0)), static_cast<int>(side(2)),
                  static_cast<std::size_t>(row)};
}

/// (height, width), or with channels if there are several.
inline nb::tuple shape_of(const Layout& layout) {
    return layout.channels == 1 ? nb::make_tuple(layout.height, layout.width)
                                : nb::make_tuple(layout.height, layout.width, layout.channels);
}

/// Is it one of NumPy's own arrays, which have no mask and lie in the CPU's memory?
inline bool is_plain(nb::handle object) {
    static const PyObject* const arrays = in_python("numpy", "ndarray").release().ptr();
    return object.type().ptr() == arrays;
}

/// An array of Python. `holds`: a key of _arrays.DTYPES, which says what dtypes it may have.
inline HostImage host_image(nb::handle object, const char* holds, const char* argument) {
    ReadArray array;
    const auto is_taken = [&](nb::handle given) {
        return nb::try_cast(given, array) && element_of(array.dtype(), holds) && layout_of(array);
    };
    if (!is_plain(object) || !is_taken(object))
        array = nb::cast<ReadArray>(in_python("fathom._arrays", "readable")(object, holds, argument));
    return {array, element_of(array.dtype(), holds).value(), layout_of(array).value()};
}

inline Image image_of(const HostImage& host, const Device& device) {
    const Unlocked released;
    return Image::from_host(device, host.element, host.array.data(), host.layout);
}

/// Where a result of this type and size goes in an array of the caller's.
inline std::pair<void*, Layout> memory_of(nb::handle object, const char* argument, Element element,
                                          const Layout& layout) {
    if (!is_plain(object))
        in_python("fathom._arrays", "check_kind")(object, argument);
    WriteArray array;
    std::optional<Layout> its;
    if (nb::try_cast(object, array) && array.dtype() == type_of(element).dtype)
        its = layout_of(array);
    if (!its || its->width != layout.width || its->height != layout.height || its->channels != layout.channels)
        in_python("fathom._arrays", "refuse_target")(object, argument, type_of(element).name, shape_of(layout));
    return {array.data(), *its};
}

/// New memory for a result. Kernels write fastest where rows begin at multiples of 64 bytes.
inline nb::object new_array(Element element, const Layout& layout) {
    const std::array shape{static_cast<std::size_t>(layout.height), static_cast<std::size_t>(layout.width),
                           static_cast<std::size_t>(layout.channels)};
    void* data = runtime::allocate(shape[0] * shape[1] * shape[2] * element_bytes(element));
    if (!data)
        throw std::bad_alloc();
    const nb::capsule owner(data, [](void* memory) noexcept { runtime::give_back(memory); });
    return nb::cast(nb::ndarray<nb::numpy>(data, layout.channels == 1 ? 2 : 3, shape.data(), owner, nullptr,
                                           type_of(element).dtype),
                    nb::rv_policy::reference);
}

/// How elements of this type are read: as a caller said, as the camera's packing says, or as their type says.
inline Storage storage_of(Element element, int channels, nb::handle said, const CameraFile& camera,
                          const char* argument) {
    const std::optional<Packing>& packing = camera.packing;
    const auto refuse = [&](const char* what, const char* cure) {
        throw std::invalid_argument(text(argument, ": the camera's ", what, ", which is that of files; give ", cure));
    };
    if (camera.gamma)
        refuse("values went through a \"gamma\"",
               "what they were before, (depth / LARGEST) ** GAMMA, and a camera without it");
    Storage storage = element == Element::f32            ? Storage::float32
                      : element == Element::f16          ? Storage::float16
                      : element == Element::u16          ? Storage::uint16
                      : packing == Packing::uint24_high  ? Storage::uint24_high
                      : packing == Packing::uint8        ? Storage::uint8
                      : packing == Packing::rgb_red_low  ? Storage::rgb8_red_low
                      : packing == Packing::rgb_red_high ? Storage::rgb8_red_high
                                                         : Storage::uint24;
    if (!said.is_none())
        storage = static_cast<Storage>(nb::cast<int>(in_python("fathom._arrays", "storage_index")(said)));
    else if (packing == Packing::uint16_rotated)
        refuse("packing is \"uint16-rotated\"", "(codes >> 3) | (codes << 13), and storage='uint16'");
    else if (packing == Packing::uint16_swapped)
        refuse("packing is \"uint16-swapped\"", "codes.byteswap(), and storage='uint16'");
    else if (packing == Packing::uint13)
        refuse("packing is \"uint13\"", "codes & 0x1fff, and storage='uint16'");
    else if (packing == Packing::base_255)
        refuse("packing is \"base-255\"", "((B / 255 + G) / 255 + R) / 255 as floats, and storage='float32'");
    if (fathom::element_of(storage) != element || channels_of(storage) != channels)
        throw std::invalid_argument(text(
            argument, ": it holds ", type_of(element).name, " in ", channels, channels == 1 ? " channel" : " channels",
            ", which is not the storage of depth that is said; it has one channel, or three of uint8. As uint8 may be "
            "a "
            "picture, the camera's packing or storage= has to say how it holds depth: 'uint8', 'rgb8-red-low', "
            "'rgb8-red-high' or, as OpenCV reads files, 'bgr8-red-low' or 'bgr8-red-high'"));
    return storage;
}

} // namespace fathom::python
