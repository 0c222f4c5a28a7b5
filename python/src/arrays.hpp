#pragma once

#include "camera.hpp"

#include <fathom/findings.hpp>
#include <fathom/image.hpp>
#include <fathom/photograph.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>

/// Arrays of Python as images of a device, and back.
namespace fathom::python {

using ReadArray = nb::ndarray<nb::ro>;

/// Text as UTF-8; escaped where it has half a character (a lone surrogate).
std::string text_of(const nb::str& text);

/// Keeps an array until the device has done with it. The interpreter's lock is held where one is made and where it ends.
struct HeldArray {
    ReadArray array;
    Device device = {}; ///< waited for at the end, if there is one
    bool waits = false;

    ~HeldArray();
};

/// An array's memory, or a copy of it whose rows have no gaps.
struct HostImage {
    std::shared_ptr<HeldArray> held;
    Element element;
    Layout layout;
    bool is_copy = false;

    HostDepth depth(Storage storage) const;
};

/// `fathom.Image`: an image on a device. If it is an array's memory, it keeps the array, and waits for the device before it
/// lets it go.
struct DeviceImage {
    Image image;
    std::shared_ptr<void> array = {};
    const char* no_target = nullptr; ///< why no result may go here, if none may
    HostDepth host = {};             ///< where that memory lies, if the device reads it there
};

/// What an argument is for, which says what dtypes it may have.
enum class Holds { depth, relative, picture, numbers };

/// Throws: std::invalid_argument.
[[noreturn]] void refuse(const char* argument, const std::string& what);

HostImage host_image(nb::handle object, Holds holds, const char* argument);
Image image_of(const HostImage& host, const Device& device);
bool is_image(nb::handle object);

/// In the order of the enumerators.
inline constexpr std::array storage_names{"float32",      "float16",      "uint8",        "uint16",
                                          "uint24",       "uint24-high",  "rgb8-red-low", "rgb8-red-high",
                                          "bgr8-red-low", "bgr8-red-high"};
static_assert(static_cast<std::size_t>(Storage::bgr8_red_high) + 1 == storage_names.size());

/// How elements of this type are read: as a caller said, as the camera's packing says, or as their type says.
Storage storage_of(Element element, int channels, nb::handle said, const std::optional<Packing>& packing,
                   const char* argument);
/// The storage of this name, which may be None.
std::optional<Storage> storage_named(nb::handle name);

/// New memory for a result.
nb::object new_array(Element element, const Layout& layout);

/// Where a result of this type and size goes in an array of the caller's.
/// Throws: std::invalid_argument for one that does not fit.
std::pair<void*, Layout> memory_of(nb::handle object, const char* argument, Element element, const Layout& layout);

/// Uploads an array; shares it on a CPU device.
DeviceImage to_device(nb::handle array, const Device& device);

/// A new NumPy array with the pixels of an image; another object as it is.
nb::object to_numpy(const Image& image);
nb::object on_host(nb::handle object);

Element element_of_name(const std::string& dtype);
const char* name_of(Element element);

/// The elements of an array or a `fathom.Image` as float32, in a new array whose rows lie one after the other, and the bits of
/// one. Codes are not scaled.
using Floats = nb::ndarray<float, nb::numpy, nb::c_contig>;
std::pair<Floats, int> floats_of(nb::handle pixels, Holds holds, const char* argument);
HostFloats on_host(const Floats& floats);

/// (height, width), or with channels if there are several.
nb::tuple shape_of(const Layout& layout);

} // namespace fathom::python
