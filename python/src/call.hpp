#pragma once

#include "camera.hpp"
#include "words.hpp"

#include <fathom/findings.hpp>
#include <fathom/image.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <atomic>
#include <functional>
#include <memory>
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

/// `fathom.BackDepth`: a second layer of depth, where each pixel's solid ends.
struct BackDepth {
    nb::object depth;
};

/// The same, for what is written.
struct Target {
    static constexpr auto annotation = nb::detail::const_name("fathom._operations.Array | Image | tuple");
    nb::object given;
};

/// `device=`: None, a `fathom.Device`, or what `Device::open` takes.
struct DeviceOption {
    static constexpr auto annotation = nb::detail::const_name("Device | DeviceInfo | str | int");
    nb::object given;
};

/// What an argument is for, which says what dtypes it may have.
enum class Holds { depth, picture, numbers };

/// What `Device::open` takes, of anything but a `fathom.Device`.
std::string device_name_of(const DeviceOption& choice, const char* argument);

/// The device that is meant. One that was opened by its name is opened once.
Device device_of(const DeviceOption& choice);

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

/// A new NumPy array. Its content is undefined, and `data` is where it lies.
nb::object new_floats(const Layout& layout, float*& data);

/// (height, width), or with channels if there are several.
nb::tuple shape_of(const Image& image);

/// Seconds that passed, and those that the calling thread worked.
using Seconds = std::pair<double, double>;

Seconds seconds_now();
Seconds seconds_since(const Seconds& start);

/// One call of an operation: its inputs as images, its results, and the wait for them.
///
/// If the depth is an array, results are arrays, and the call returns when they are there. If it is a `fathom.Image`, they are
/// `fathom.Image`s, and the call returns at once unless another input or an `out` is an array.
class Call {
public:
    /// `operation` stands in messages.
    Call(const Pixels& depth, const CameraObject& camera, const Word<Storage>& storage, const DeviceOption& device,
         const Pixels& ignore = {});

    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    const StoredDepth& depth() const { return depth_; }

    /// More depth of the same camera.
    StoredDepth more_depth(const Pixels& pixels, const char* argument);
    Image image(const Pixels& pixels, Holds holds, const char* argument) {
        return image(pixels, holds, argument, nullptr);
    }

    /// Adds a result: `target`'s memory, or new memory.
    Image result(nb::handle target, const char* argument, Element element, Layout layout);
    Image result(nb::handle target, const char* argument, int channels = 1) {
        return result(target, argument, Element::f32, {depth_.image.width(), depth_.image.height(), channels});
    }

    /// Calls the operation without the interpreter's lock, and waits if arrays take part.
    void run(const std::function<void()>& operation);

    /// Are calls timed? For the tests: to ask for the time of a thread takes a system call.
    static inline std::atomic<bool> is_timed = false;
    /// What the last call in this thread took in the library, if it was timed: arrays as images, `run`, and images' ends.
    static thread_local Seconds last_run;
    static void add_to_last_run(const Seconds& more);

    /// The object of the next result, in the order in which they were added.
    nb::object take() { return objects_.at(taken_++); }

private:
    struct Fetch {
        Image image;
        void* data;
        std::size_t row_stride;
    };

    StoredDepth stored(const Pixels& pixels, const char* argument, const Pixels& ignore = {});
    StoredDepth without(const StoredDepth& stored, const Pixels& ignore) const;
    Image image(const Pixels& pixels, Holds holds, const char* argument, HostDepth* host);

    Device device_;
    const CameraObject& camera_;
    Word<Storage> storage_;
    StoredDepth depth_;
    bool makes_images_;
    bool waits_ = false;
    std::vector<std::shared_ptr<void>> kept_; // until the device has read it
    std::vector<Fetch> fetches_;
    std::vector<nb::object> objects_;
    std::size_t taken_ = 0;
};

} // namespace fathom::python
