// A failure of every call to OpenCL, one after the other, while cv::UMat are read and written.
#include "faults.hpp"
#include "layer.hpp"
#include "operations.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core/ocl.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

using namespace fathom;
using operations::Bytes;

namespace {

constexpr int width = 41, height = 24;

/// Another queue of OpenCV's context.
class Queue {
public:
    explicit Queue(cl_command_queue_properties properties)
        : queue_(clCreateCommandQueue(context(), id(), properties, nullptr)) {}
    ~Queue() { clReleaseCommandQueue(queue_); }
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    Device device() const { return {context(), id(), queue_}; }

private:
    static cl_context context() { return static_cast<cl_context>(cv::ocl::Context::getDefault().ptr()); }
    static cl_device_id id() { return static_cast<cl_device_id>(cv::ocl::Device::getDefault().ptr()); }

    cl_command_queue queue_;
};

/// Matrices that are made and filled before anything fails.
struct Matrices {
    cv::UMat depth, color, points, picture;
    cv::Mat host;

    Matrices() {
        std::vector<float> values = operations::depth(width, height);
        cv::Mat(height, width, CV_32F, values.data()).copyTo(depth);
        cv::UMat(height, width + 2, CV_32FC3, cv::Scalar(0.25, 0.5, 0.75)).colRange(1, width + 1).copyTo(color);
        points.create(height, width, CV_32FC3);
        cv::UMat wide(height + 1, width + 4, CV_32FC3, cv::Scalar::all(0));
        picture = wide(cv::Rect(3, 1, width, height)); // rows with gaps, behind an odd offset
    }
};

struct Call {
    const char* name;
    std::function<cv::UMat(const Device&, Matrices&)> run;
};

const std::vector<Call> calls{
    {"unproject",
     [](const Device& device, Matrices& m) {
         unproject(device, m.depth, operations::camera(width, height), m.points);
         return m.points;
     }},
    {"unproject into a new matrix",
     [](const Device& device, Matrices& m) {
         cv::UMat made;
         unproject(device, m.depth, operations::camera(width, height), made);
         return made;
     }},
    {"fog of a region",
     [](const Device& device, Matrices& m) {
         fog(device, m.depth, operations::camera(width, height), m.color, m.picture, {.density = 0.02});
         return m.picture;
     }},
    {"normals of distances",
     [](const Device& device, Matrices& m) {
         cv::UMat z; // goes before the device has read it
         linearize(device, m.depth, operations::camera(width, height), z);
         Camera camera = operations::camera(width, height);
         camera.encoding = Encoding::view_z;
         normals(device, z, camera, m.points);
         return m.points;
     }},
    {"an image of a matrix",
     [](const Device& device, Matrices& m) {
         const Image depth = to_device(device, m.depth);
         const Image z = linearize({depth, operations::camera(width, height), Storage::float32}).image;
         m.host = to_mat(z);
         return cv::UMat();
     }},
};

Bytes bytes_of(const cv::UMat& result, const Matrices& matrices) {
    cv::Mat copy = matrices.host;
    if (copy.empty())
        result.copyTo(copy);
    return {copy.data, copy.data + copy.total() * copy.elemSize()};
}

/// What OpenCV asks of a driver for itself, and reports in its own way or does without.
bool is_opencvs(const std::string& function) {
    return function == "clCreateBuffer" || function == "clEnqueueMapBuffer" || function == "clEnqueueUnmapMemObject" ||
           function.starts_with("clEnqueueRead") || function.starts_with("clEnqueueWrite") ||
           function.starts_with("clEnqueueCopy") || function == "clFinish";
}

struct Outcome {
    cv::UMat result;
    std::string exception;
    bool of_fathom = false, of_opencv = false;
};

Outcome outcome(const Call& call, const Device& device, Matrices& matrices) {
    Outcome seen;
    try {
        seen.result = call.run(device, matrices);
    } catch (const Error& error) {
        seen.exception = error.what();
        seen.of_fathom = true;
    } catch (const cv::Exception& error) {
        seen.exception = error.what();
        seen.of_opencv = true;
    } catch (const std::exception& error) {
        seen.exception = error.what();
    }
    return seen;
}

/// What the program holds when everything has ended. The driver tells later that a command has, and OpenCV frees the buffers that
/// waited for it when it is asked for the next one.
std::string held_at_rest(const Device& device, const std::string& expected) {
    cv::ocl::finish();
    device.finish();
    for (int i = 0; i < 200 && layer::held() != expected; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        cv::UMat(1, 1, CV_8U).release();
    }
    return layer::held();
}

void fail_everywhere(const Call& call, const Device& device) {
    Faults faults;
    const bool mapped = device.context() != static_cast<cl_context>(cv::ocl::Context::getDefault().ptr());
    const auto run = [&] {
        Matrices matrices;
        const Outcome seen = outcome(call, device, matrices);
        if (!seen.exception.empty())
            faults.add("without a failure: " + seen.exception);
        return bytes_of(seen.result, matrices);
    };
    const Bytes expected = run();
    run();
    std::vector<std::string> points;
    {
        Matrices matrices;
        cv::ocl::finish();
        layer::reset();
        outcome(call, device, matrices);
        points = layer::points();
    }
    const std::string before = held_at_rest(device, {});
    for (std::size_t point = 0; point < points.size(); ++point) {
        if (mapped && (points[point] == "clEnqueueMapBuffer" || points[point] == "clEnqueueUnmapMemObject"))
            continue; // OpenCV asserts then in the matrix's destructor, which ends the process
        const std::string where = points[point] + " fails";
        {
            Matrices matrices;
            cv::ocl::finish();
            layer::fail(point, layer::Failure::once);
            const Outcome seen = outcome(call, device, matrices);
            layer::reset();
            if (seen.exception.empty())
                faults.check(is_opencvs(points[point]) && bytes_of(seen.result, matrices) == expected,
                             where + ", and the call succeeds");
            else
                faults.check(seen.of_fathom || (seen.of_opencv && is_opencvs(points[point])),
                             where + ", and what comes out is neither a fathom::Error nor OpenCV's: " + seen.exception);
            cv::ocl::finish();
            device.finish();
        }
        faults.check(run() == expected, where + ", and the next call has other bits");
        const std::string after = held_at_rest(device, before);
        faults.check(after == before, where + ", and the program holds " + after + ", not " + before);
    }
    CHECK(!points.empty());
    std::printf("  %-30s %4zu points\n", call.name, points.size());
}

} // namespace

TEST_CASE("failures: a call on cv::UMat fails", "[umat]") {
    REQUIRE(cv::ocl::useOpenCL()); // OPENCV_OPENCL_DEVICE=:CPU: makes OpenCV use a CPU device
    REQUIRE(layer::loaded());
    const Device opencvs = opencv_device(), elsewhere = Device::open("1");
    const Queue queue(0), out_of_order(CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
    for (const Call& call : calls) {
        DYNAMIC_SECTION(call.name << " in OpenCV's queue") {
            fail_everywhere(call, opencvs);
        }
        DYNAMIC_SECTION(call.name << " in another queue") {
            fail_everywhere(call, queue.device());
        }
        DYNAMIC_SECTION(call.name << " in a queue out of order") {
            fail_everywhere(call, out_of_order.device());
        }
        DYNAMIC_SECTION(call.name << " in another context") {
            fail_everywhere(call, elsewhere);
        }
    }
}
