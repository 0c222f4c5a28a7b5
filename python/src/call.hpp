#pragma once

#include "arrays.hpp"

#include <fathom/lens_arguments.hpp>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

/// Calls of operations from Python.
namespace fathom::python {

/// `fathom.BackDepth`: a second layer of depth, where each pixel's solid ends.
struct BackDepth {
    nb::object depth;
};

/// What `Device::open` takes, of anything but a `fathom.Device`: None, one of `fathom.devices()`, its index, or a part of a name.
std::string device_name_of(nb::handle choice, const char* argument);

/// Lets the loader know the driver that the extra `cpu` brings. Called before devices are listed.
void find_driver();

/// Opens a device without the interpreter's lock. Where there is none at all, the message also says what becomes of the extra `cpu`.
Device opened(const std::function<Device()>& open);

/// The device that is meant. One that was opened by its name is opened once.
Device device_of(nb::handle choice);

/// Seconds that passed, and those that the calling thread worked.
using Seconds = std::pair<double, double>;
Seconds seconds_now();
Seconds seconds_since(const Seconds& start);

/// What all calls take beside an operation's own arguments; None of what is not given.
struct Common {
    nb::object depth, camera, storage, out, device, ignore;

    /// By their names among a function's arguments.
    explicit Common(const nb::dict& given);
};

/// One call of an operation: its inputs as images, its results, and the wait for them.
///
/// If the depth is an array, results are arrays, and the call returns when they are there. If it is a `fathom.Image`, they are
/// `fathom.Image`s, and the call returns at once unless another input or an `out` is an array.
class Call {
public:
    /// `camera`: None for relative depth, whose lens is given then. `picture`: whose size that gets, if there is one.
    Call(const Common& given, const CameraObject* camera, const LensArguments& lens = {}, nb::handle picture = {});
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    const StoredDepth& depth() const { return depth_; }

    /// More depth of the same camera.
    StoredDepth more_depth(nb::handle pixels, const char* argument) { return stored(pixels, argument, {}, {}); }
    Image image(nb::handle pixels, Holds holds, const char* argument, HostDepth* host = nullptr);

    /// Brings the depth to the size of a picture that shows the same, if it has another.
    void fit(const Image& picture);

    /// Adds a result: `target`'s memory, or new memory.
    Image result(nb::handle target, const char* argument, Element element, Layout layout);

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

    StoredDepth stored(nb::handle pixels, const char* argument, nb::handle storage, nb::handle ignore);
    StoredDepth of_relative(const Common& given, const LensArguments& lens, nb::handle picture);

    Device device_;
    const CameraObject* camera_; // none of relative depth
    StoredDepth depth_;
    bool makes_images_;
    bool waits_ = false;
    std::vector<std::shared_ptr<void>> kept_; // until the device has read it
    std::vector<Fetch> fetches_;
    std::vector<nb::object> objects_;
    std::size_t taken_ = 0;
};

} // namespace fathom::python
