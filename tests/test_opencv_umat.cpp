// cv::UMat in OpenCV's own context: the same bits as cv::Mat, in the matrices' own buffers, without a wait.
// OpenCV 4.6 uses a CPU device only if the environment says so; CTest does (groups.cmake).
#include "catch.hpp"
#include "opencv_forms.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core/ocl.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

using namespace fathom;
using namespace fathom::opencv_forms;

namespace {

/// Where the environment asks for OpenCV's OpenCL, it must be there.
bool opencv_has_opencl() {
    if (!std::getenv("OPENCV_OPENCL_DEVICE")) {
        WARN("skipped: OPENCV_OPENCL_DEVICE=:CPU: is not set, without which OpenCV uses no CPU device");
        return false;
    }
    REQUIRE(cv::ocl::useOpenCL());
    return true;
}

const Device& cpu() {
    static const Device opened = Device::open("cpu");
    return opened;
}

cl_command_queue opencv_queue() {
    return static_cast<cl_command_queue>(cv::ocl::Queue::getDefault().ptr());
}

cl_mem buffer_of(const cv::UMat& umat) {
    return static_cast<cl_mem>(umat.u->handle);
}

cv::UMat on_device(const cv::Mat& mat) {
    cv::UMat umat;
    mat.copyTo(umat);
    return umat;
}

cv::Mat on_host(const cv::UMat& umat) {
    cv::Mat mat;
    umat.copyTo(mat);
    return mat;
}

cv::Mat linearized(const cv::Mat& stored) {
    cv::Mat result;
    linearize(cpu(), stored, camera(), result);
    return result;
}

/// Where the first byte lies: mapping a buffer of a CPU device moves nothing.
unsigned char* address_of(const cv::UMat& umat) {
    const auto buffer = static_cast<cl_mem>(umat.handle(cv::ACCESS_RW));
    void* const mapped = clEnqueueMapBuffer(opencv_queue(), buffer, CL_TRUE, CL_MAP_READ | CL_MAP_WRITE, 0,
                                            umat.u->size, 0, nullptr, nullptr, nullptr);
    REQUIRE(mapped != nullptr);
    clEnqueueUnmapMemObject(opencv_queue(), buffer, mapped, 0, nullptr, nullptr);
    cv::ocl::finish();
    return static_cast<unsigned char*>(mapped) + umat.offset;
}

/// OpenCV's pool of buffers, which it has on some devices only.
class Pool {
public:
    Pool() { set(std::size_t{1} << 26); }
    ~Pool() { set(before_); }
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

private:
    static void set(std::size_t bytes) {
        cv::ocl::getOpenCLAllocator()->getBufferPoolController()->setMaxReservedSize(bytes);
    }

    std::size_t before_ = cv::ocl::getOpenCLAllocator()->getBufferPoolController()->getMaxReservedSize();
};

/// Nothing that a queue is given later starts before this is opened.
class Gate {
public:
    explicit Gate(cl_command_queue queue) {
        cl_context context = nullptr;
        clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(context), &context, nullptr);
        event_ = clCreateUserEvent(context, nullptr);
        REQUIRE(clEnqueueBarrierWithWaitList(queue, 1, &event_, nullptr) == CL_SUCCESS);
    }
    ~Gate() {
        open();
        clReleaseEvent(event_);
    }
    Gate(const Gate&) = delete;
    Gate& operator=(const Gate&) = delete;

    void open() {
        if (!std::exchange(open_, true))
            clSetUserEventStatus(event_, CL_COMPLETE);
    }

private:
    cl_event event_ = nullptr;
    bool open_ = false;
};

cl_int status_of(cl_event event) {
    cl_int status = CL_QUEUED;
    REQUIRE(clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof(status), &status, nullptr) == CL_SUCCESS);
    return status;
}

/// Another queue of OpenCV's context.
class Queue {
public:
    Queue() : queue_(clCreateCommandQueue(context(), id(), 0, nullptr)) {}
    ~Queue() { clReleaseCommandQueue(queue_); }
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    Device device() const { return {context(), id(), queue_}; }
    cl_command_queue get() const { return queue_; }

private:
    static cl_context context() { return static_cast<cl_context>(cv::ocl::Context::getDefault().ptr()); }
    static cl_device_id id() { return static_cast<cl_device_id>(cv::ocl::Device::getDefault().ptr()); }

    cl_command_queue queue_;
};

} // namespace

TEST_CASE("opencv umat: the device is OpenCV's own", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device({.vector_width = 4});
    CHECK(device.context() == cv::ocl::Context::getDefault().ptr());
    CHECK(device.id() == cv::ocl::Device::getDefault().ptr());
    CHECK(device.queue() == opencv_queue());
    CHECK(device.options().vector_width == 4);
}

TEST_CASE("opencv umat: every operation gives the bits of cv::Mat, and reuses a result that fits", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const cv::Mat stored = depths(), color = picture();
    const cv::UMat stored_umat = on_device(stored), color_umat = on_device(color);
    const Part stored_part(stored), color_part(color);
    const cv::UMat stored_around = on_device(stored_part.around), color_around = on_device(color_part.around);
    const auto within = [](const cv::UMat& around, cv::Size size) {
        return around(cv::Rect(cv::Point(5, 3), size)); // odd offsets
    };
    for (const Given& form : forms(opencv_device(), cpu(), stored, color)) {
        INFO(form.name);
        cv::UMat fresh;
        form.run(stored_umat, color_umat, fresh);
        CHECK(same(on_host(fresh), form.expected));

        cv::UMat reused = on_device(cv::Mat(form.expected.size(), form.expected.type(), cv::Scalar::all(7)));
        const cv::UMatData* const data = reused.u;
        form.run(stored_umat, color_umat, reused);
        CHECK(reused.u == data);
        CHECK(same(on_host(reused), form.expected));

        cv::UMat other(3, 3, CV_8UC1);
        form.run(stored_umat, color_umat, other);
        CHECK(same(on_host(other), form.expected));

        cv::Mat mixed; // cv::UMat in, cv::Mat out, and the other way round
        form.run(stored_umat, color, mixed);
        CHECK(same(mixed, form.expected));
        cv::UMat mixed_umat;
        form.run(stored, color_umat, mixed_umat);
        CHECK(same(on_host(mixed_umat), form.expected));

        Part onto(cv::Mat::zeros(form.expected.size(), form.expected.type()));
        const cv::UMat onto_around = on_device(onto.around);
        cv::UMat onto_within = within(onto_around, form.expected.size());
        form.run(within(stored_around, stored.size()), within(color_around, color.size()), onto_within);
        CHECK(onto_within.u == onto_around.u);
        CHECK(same(on_host(onto_within), form.expected));
        const cv::Mat before = onto.around.clone();
        onto_around.copyTo(onto.around);
        CHECK(onto.same_around(before));
    }
}

TEST_CASE("opencv umat: kernels read and write the matrices' own memory, and the call does not wait for them",
          "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device();
    const cv::Mat stored = depths(), color = picture();
    for (const Given& form : forms(device, cpu(), stored, color)) {
        INFO(form.name);
        cv::UMat input = on_device(cv::Mat(stored.size(), CV_32FC1, cv::Scalar(0.25)));
        cv::UMat picture = on_device(color);
        cv::UMat result = on_device(cv::Mat(form.expected.size(), form.expected.type(), cv::Scalar::all(7)));
        const auto* const to = address_of(result);
        auto* const from = address_of(input);
        const auto bytes = [](const cv::Mat& mat) { return mat.total() * mat.elemSize(); };
        if (std::string_view(form.name) == "dof") { // which waits itself
            std::memcpy(from, stored.data, bytes(stored));
            form.run(input, picture, result);
            device.finish();
        } else {
            Gate gate(device.queue());
            form.run(input, picture, result);
            std::memcpy(from, stored.data, bytes(stored)); // after the call, and the kernels see it
            CHECK(to[0] == (form.expected.depth() == CV_32F ? 0 : 7));
            gate.open();
            device.finish();
        }
        CHECK(std::memcmp(to, form.expected.data, bytes(form.expected)) == 0);
    }
}

TEST_CASE("opencv umat: a float matrix may be its own result", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device();
    const cv::Mat stored = depths(), expected = linearized(stored);
    cv::UMat both = on_device(stored);
    const cl_mem buffer = buffer_of(both);
    linearize(device, both, camera(), both);
    CHECK(buffer_of(both) == buffer);
    CHECK(same(on_host(both), expected));

    const cv::UMat around = on_device(Part(stored).around);
    cv::UMat part = around(cv::Rect(5, 3, 30, 20)), shifted = around(cv::Rect(6, 3, 30, 20));
    CHECK_THROWS_WITH(linearize(device, part, camera(), shifted), "the result shares memory with the stored depth");
    linearize(device, part, camera(), part);
    CHECK(same(on_host(part), expected));

    cv::UMat codes = on_device(cv::Mat(20, 30, CV_16UC1, cv::Scalar(40000)));
    const cv::UMat kept = codes;
    linearize(device, codes, camera(), codes); // another type: a new matrix
    CHECK(codes.type() == CV_32FC1);
    CHECK(on_host(kept).at<ushort>(3, 4) == 40000);
}

TEST_CASE("opencv umat: what the host wrote through a cv::Mat is seen, and what the device wrote, too", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const cv::Mat stored = depths(), expected = linearized(stored);
    cv::UMat input = on_device(cv::Mat::zeros(stored.size(), CV_32FC1)), result = on_device(stored);
    stored.copyTo(input.getMat(cv::ACCESS_WRITE));
    CHECK(same(result.getMat(cv::ACCESS_READ), stored)); // a host copy, which is obsolete from the next line on
    linearize(opencv_device(), input, camera(), result);
    CHECK(same(on_host(result), expected));
    CHECK(same(result.getMat(cv::ACCESS_READ), expected));
}

TEST_CASE("opencv umat: a matrix that a cv::Mat holds mapped is worked on through the host", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device();
    const cv::Mat stored = depths(), expected = linearized(stored);
    const cv::UMat input = on_device(stored);
    cv::UMat result = on_device(cv::Mat::zeros(stored.size(), CV_32FC1)), second;
    {
        const cv::Mat mapped = input.getMat(cv::ACCESS_READ), onto = result.getMat(cv::ACCESS_RW);
        linearize(device, input, camera(), result);
        CHECK(same(onto, expected));
        linearize(device, input, camera(), second);
        CHECK(same(mapped, stored));
    }
    CHECK(same(on_host(result), expected));
    CHECK(same(on_host(second), expected));
    linearize(device, input, camera(), input.getMat(cv::ACCESS_RW)); // in place, through the mapped memory
    CHECK(same(on_host(input), expected));
}

TEST_CASE("opencv umat: a device of another context and a matrix made without OpenCL give the same bits", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const cv::Mat stored = depths(), color = picture();
    const cv::UMat input = on_device(stored), picture = on_device(color);
    for (const Given& form : forms(cpu(), cpu(), stored, color)) {
        INFO(form.name);
        cv::UMat result = on_device(cv::Mat(form.expected.size(), form.expected.type(), cv::Scalar::all(7))), fresh;
        const cv::UMatData* const data = result.u;
        form.run(input, picture, result);
        CHECK(result.u == data);
        CHECK(same(on_host(result), form.expected));
        form.run(input, picture, fresh);
        CHECK(same(on_host(fresh), form.expected));
    }
    const cv::Mat expected = linearized(stored);
    cv::ocl::setUseOpenCL(false);
    const cv::UMat host = on_device(stored);
    cv::UMat host_result(stored.size(), CV_32FC1);
    cv::ocl::setUseOpenCL(true);
    REQUIRE(host.u->handle == nullptr);
    linearize(opencv_device(), host, camera(), host_result);
    CHECK(same(on_host(host_result), expected));
    cv::UMat result;
    linearize(opencv_device(), host, camera(), result);
    CHECK(same(on_host(result), expected));
}

TEST_CASE("opencv umat: another queue of OpenCV's context takes its place between OpenCV's commands", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Queue queue;
    const Device device = queue.device();
    const cv::Mat stored = depths(), before(stored.size(), CV_32FC1, cv::Scalar(7));
    const cv::Mat expected = linearized(stored);
    const cv::UMat values = on_device(stored);
    cv::UMat input = on_device(before), result = on_device(before), copy = on_device(before);
    const auto* const seen = address_of(copy);
    linearize(device, input, camera(), result); // builds the kernel
    cv::ocl::finish();

    {
        Gate opencv(opencv_queue());
        values.copyTo(input); // OpenCV's queue, before
        cl_event done = nullptr;
        linearize(device, input, camera(), result, {}, {}, {.queue = nullptr, .wait = {}, .event = &done});
        std::this_thread::sleep_for(std::chrono::milliseconds(50)); // it would have ended by now
        CHECK(status_of(done) != CL_COMPLETE);
        clReleaseEvent(done);
        opencv.open();
        Gate own(queue.get());
        linearize(device, input, camera(), result);
        result.copyTo(copy); // OpenCV's queue, after
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        CHECK(std::memcmp(seen, before.data, sizeof(float)) == 0);
    }
    cv::ocl::finish(); // OpenCV's queue alone
    CHECK(same(on_host(copy), expected));

    const cv::UMat later = on_device(before);
    values.copyTo(later);
    CHECK(same(to_mat(linearize({to_device(device, later), camera()}).image), expected));
}

TEST_CASE("opencv umat: a matrix that goes while the device needs it keeps its buffer until then", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Pool pool;
    const Device device = opencv_device();
    Camera seen = camera();
    seen.width = 311; // a size that no other matrix here has
    seen.height = 207;
    cv::Mat stored(seen.height, seen.width, CV_32FC1), expected;
    cv::randu(stored, 0.5f, 0.95f);
    linearize(cpu(), stored, seen, expected);
    cv::UMat input = on_device(stored), result(stored.size(), CV_32FC1);
    const cl_mem buffer = buffer_of(input);
    input.release();
    input.create(stored.size(), CV_32FC1);
    REQUIRE(buffer_of(input) == buffer); // the pool does give buffers to others
    stored.copyTo(input);
    {
        Gate gate(device.queue());
        linearize(device, input, seen, result);
        input.release();
        const cv::UMat next(stored.size(), CV_32FC1);
        CHECK(buffer_of(next) != buffer);
    }
    CHECK(same(on_host(result), expected));
    CHECK(result.u->urefcount == 1); // it is let go once the kernels have ended
}

TEST_CASE("opencv umat: the call waits for a matrix that is a cv::Mat's memory", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device();
    cv::Mat stored = depths(), onto(stored.size(), CV_32FC1, cv::Scalar(7));
    const cv::Mat expected = linearized(stored);
    cl_event done = nullptr;
    const Launch launch{.queue = nullptr, .wait = {}, .event = &done};
    cv::UMat result;
    linearize(device, stored.getUMat(cv::ACCESS_READ), camera(), result, {}, {}, launch);
    CHECK(status_of(done) == CL_COMPLETE);
    clReleaseEvent(done);
    CHECK(same(on_host(result), expected));
    linearize(device, on_device(stored), camera(), onto.getUMat(cv::ACCESS_RW), {}, {}, launch);
    CHECK(status_of(done) == CL_COMPLETE);
    clReleaseEvent(done);
    CHECK(same(onto, expected));
}

TEST_CASE("opencv umat: an image of a matrix is its buffer, or a copy on another device", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const Device device = opencv_device();
    for (const int type : {CV_8UC3, CV_16UC1, CV_32SC1, CV_16FC1, CV_32FC1, CV_32FC3, CV_32FC4}) {
        INFO(cv::typeToString(type));
        cv::Mat mat(20, 31, type);
        cv::randu(mat.reshape(1), 0, 100);
        const cv::UMat umat = on_device(mat), part = umat(cv::Rect(3, 5, 17, 9));
        const Image whole = to_device(device, umat), within = to_device(device, part);
        CHECK(whole.buffer() == buffer_of(umat));
        CHECK(within.buffer() == buffer_of(umat));
        CHECK(within.overlaps(whole));
        CHECK(same(to_mat(whole), mat));
        CHECK(same(to_mat(within), mat(cv::Rect(3, 5, 17, 9)).clone()));
        CHECK(same(to_mat(to_device(cpu(), umat)), mat));
        CHECK(same(to_mat(to_device(cpu(), part)), mat(cv::Rect(3, 5, 17, 9)).clone()));
    }
    const cv::UMat empty, doubles(2, 2, CV_64FC1), fits(2, 2, CV_16UC1);
    for (const Device& each : {device, cpu()}) {
        CHECK_THROWS_WITH(to_device(each, empty), ContainsSubstring("empty"));
        CHECK_THROWS_WITH(to_device(each, doubles), ContainsSubstring("CV_64FC1"));
    }
    CHECK(storage_of(fits) == Storage::uint16);
    CHECK_THROWS_AS(storage_of(doubles), std::invalid_argument);
}

template <typename Matrix>
concept goes_to_device = requires(const Device& device, Matrix&& matrix) {
    to_device(device, std::forward<Matrix>(matrix));
};
static_assert(goes_to_device<cv::UMat&> && goes_to_device<const cv::UMat&>);
static_assert(!goes_to_device<cv::UMat> && !goes_to_device<const cv::UMat>);

TEST_CASE("opencv umat: what does not fit is refused, and nothing is written", "[opencv]") {
    if (!opencv_has_opencl())
        return;
    const cv::Mat stored = depths(), untouched(20, 30, CV_32FC1, cv::Scalar(7));
    const cv::UMat input = on_device(stored), codes(20, 30, CV_64FC1), empty;
    constexpr int sizes[] = {4, 5, 6};
    const cv::UMat volume(3, sizes, CV_32FC1);
    cv::UMat result = on_device(untouched), small = on_device(untouched(cv::Rect(0, 0, 7, 5)));
    Camera nan = camera();
    nan.scale = std::numeric_limits<double>::quiet_NaN();
    for (const Device& device : {opencv_device(), cpu()}) {
        for (cv::UMat* each : {&result, &small}) {
            const auto refused = [&](const cv::UMat& in, const Camera& seen, const char* why) {
                const cv::UMatData* const data = each->u;
                const cv::Mat before = on_host(*each);
                CHECK_THROWS_WITH(linearize(device, in, seen, *each), ContainsSubstring(why));
                CHECK_THROWS_AS(linearize(device, in, seen, *each), std::invalid_argument);
                CHECK(each->u == data);
                CHECK(same(on_host(*each), before));
            };
            refused(empty, camera(), "empty");
            refused(codes, camera(), "CV_64FC1");
            refused(volume, camera(), "3 dimensions");
            refused(on_device(stored(cv::Rect(0, 0, 7, 7)).clone()), camera(),
                    "7 x 7 pixels; the camera is for 30 x 20");
            refused(input, nan, "scale");
        }
        const cv::UMat fixed = small;
        CHECK_THROWS_WITH(linearize(device, input, camera(), fixed),
                          "result: 7 x 5 pixels of CV_32FC1, which cannot change; must be 30 x 20 pixels of CV_32FC1");
        CHECK_THROWS_WITH(linearize(device, input, camera(), cv::noArray()), "result: no matrix is given");
        cv::UMat both;
        CHECK_THROWS_WITH(
            ssao(device, input, camera(), 0.5, {.visibility = both, .confidence = both}, {.confidence = true}),
            "result: one matrix is given for two results");
        CHECK(both.empty());
    }
    CHECK(same(on_host(result), untouched));
    cv::UMat after;
    linearize(opencv_device(), input, camera(), after); // the next call is right
    CHECK(same(on_host(after), to_mat(linearize({to_device(cpu(), stored), camera()}).image)));
}
