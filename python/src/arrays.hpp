#pragma once

#include "camera.hpp"
#include "words.hpp"

#include <fathom/findings.hpp>
#include <fathom/image.hpp>
#include <fathom/photograph.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Arrays of Python as images of a device, and back.
namespace fathom::python {

/// `fathom.Image`: an image on a device. If it is an array's memory, it keeps the array, and waits for the device before it
/// lets it go.
struct DeviceImage {
    Image image;
    std::shared_ptr<void> array = {};
    const char* no_target = nullptr; ///< why no result may go here, if none may
    HostDepth host = {};             ///< where that memory lies, if the device reads it there
};

/// An argument that holds pixels: an array, or a `fathom.Image`.
struct Pixels {
    static constexpr auto annotation = nb::detail::const_name("fathom._operations.Array | Image");
    nb::object given;
    explicit operator bool() const { return given.is_valid() && !given.is_none(); }
};

/// The type of an argument that holds pixels, for the stubs.
inline constexpr const char* pixels = "Array | Image";

/// What an argument is for, which says what dtypes it may have.
enum class Holds { depth, relative, picture, numbers };

/// Throws: std::invalid_argument.
[[noreturn]] void refuse(const char* argument, const std::string& what);

/// Keeps an array until the device has done with it. The interpreter's lock is held where one is made and where it ends.
struct HeldArray {
    nb::ndarray<nb::ro> array;
    std::shared_ptr<std::byte[]> copy = {};
    Device device = {}; ///< waited for at the end, if there is one
    bool waits = false;

    ~HeldArray();
};

/// An array's memory, or a copy of it whose rows have no gaps.
struct HostImage {
    std::shared_ptr<HeldArray> held;
    Element element;
    Layout layout;
    const void* data;

    HostDepth depth(Storage storage) const;
};

HostImage host_image(nb::handle object, Holds holds, const char* argument);

Image image_of(const HostImage& host, const Device& device);

bool is_image(nb::handle object);

/// How elements of this type are read: as `said`, as the camera's packing says, or as their type says.
Storage storage_of(Element element, int channels, const Word<Storage>& said, const std::optional<Packing>& packing,
                   const char* argument);

/// New memory for a result.
nb::object new_array(Element element, const Layout& layout);

/// Where a result of this type and size goes in an array of the caller's.
/// Throws: std::invalid_argument for one that does not fit.
std::pair<void*, Layout> memory_of(nb::handle object, const char* argument, Element element, const Layout& layout);

/// Uploads an array; shares it on a CPU device.
DeviceImage to_device(const Pixels& array, const Device& device);

/// A new NumPy array with the pixels of an image.
nb::object to_numpy(const Image& image);

Element element_of_name(const std::string& dtype);
const char* name_of(Element element);

/// Depth in host memory, and what keeps it there.
struct HeldDepth {
    HostDepth stored;
    std::shared_ptr<void> memory;
};

/// The depth of an array, or of a `fathom.Image`, which is copied. Neither needs a device.
HeldDepth host_depth(const Pixels& pixels, const CameraObject& camera, const Word<Storage>& storage,
                     const char* argument);

/// The pixels of an array or a `fathom.Image` of float32, one row after the other.
std::pair<std::vector<float>, Layout> floats_of(const Pixels& pixels, const char* argument);

/// An array's or a `fathom.Image`'s elements as floats, one row after the other, and the bits of one. Codes are not scaled.
struct Numbers {
    std::vector<float> values;
    Layout layout;
    int bits;

    HostFloats floats() const { return {values.data(), layout.width, layout.height, layout.channels}; }
};
Numbers numbers_of(const Pixels& pixels, Holds holds, const char* argument);

/// A new NumPy array. Its content is undefined, and `data` is where it lies.
nb::object new_floats(const Layout& layout, float*& data);

/// (height, width), or with channels if there are several.
nb::tuple shape_of(const Image& image);

} // namespace fathom::python
