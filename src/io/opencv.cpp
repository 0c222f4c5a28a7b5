// cv::Mat and cv::UMat as images, and images as they. Operations on them are defined by opencv_form.hpp.
#include "opencv_form.hpp"

#include "require.hpp"

#include <opencv2/core/check.hpp>
#include <opencv2/core/ocl.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

namespace fathom {

using io::Matrices;

namespace {

Storage storage_of_type(int type) {
    switch (type) {
    case CV_32FC1:
        return Storage::float32;
    case CV_16FC1:
        return Storage::float16;
    case CV_16UC1:
        return Storage::uint16;
    case CV_32SC1:
        return Storage::uint24;
    case CV_8UC1:
    case CV_8UC3:
    case CV_8UC4:
        throw std::invalid_argument(
            "stored depth: a matrix of 8 bits is a picture, or packed depth; read the file with "
            "cv::IMREAD_UNCHANGED, or say the storage of packed depth (bgr8_red_low)");
    default:
        throw std::invalid_argument(text("stored depth: matrix of type ", cv::typeToString(type),
                                         "; must be CV_32FC1, CV_16FC1, CV_16UC1 or CV_32SC1"));
    }
}

Image stored_image(Matrices& matrices, cv::InputArray array) {
    if (array.empty() || array.dims() > 2 || array.type() != CV_8UC4)
        return matrices.read(array);
    const cv::Mat four = array.getMat();
    cv::Mat three(four.size(), CV_8UC3);
    constexpr int from_to[] = {0, 0, 1, 1, 2, 2};
    cv::mixChannels(&four, 1, &three, 1, from_to, 3);
    return matrices.read(three);
}

// The camera of a region of a larger matrix: that of the whole, which is cropped, or the region's own.
Camera of_region(const Camera& camera, cv::InputArray array) {
    cv::Size whole;
    cv::Point at;
    if (!array.isSubmatrix() || array.dims() > 2 || !(array.isMat() || array.isUMat()))
        return camera;
    array.isUMat() ? array.getUMat().locateROI(whole, at) : array.getMat().locateROI(whole, at);
    const cv::Size region = array.size();
    if (region == whole || camera.width == region.width)
        return camera;
    require(camera.width != 0 || camera.height != 0, "matrix: ", region.width, " x ", region.height,
            " pixels, a region of ", whole.width, " x ", whole.height,
            ", and the camera has no size; give it that of the whole, or that of the region if it is the region's own");
    return camera.width == whole.width && camera.height == whole.height
               ? cropped(camera, at.x, at.y, region.width, region.height)
               : camera;
}

} // namespace

StoredDepth io::stored_depth(Matrices& matrices, cv::InputArray array, Camera camera, std::optional<Storage> storage) {
    const Image image = stored_image(matrices, array);
    camera = of_region(camera, array);
    if (camera.width == 0 && camera.height == 0) {
        camera.width = image.width();
        camera.height = image.height();
    }
    require(camera.width == image.width() && camera.height == image.height(), "matrix: ", image.width(), " x ",
            image.height(), " pixels; the camera is for ", camera.width, " x ", camera.height,
            " (a part of an image is a `StoredDepth` region)");
    return {image, camera, storage ? *storage : storage_of_type(array.type())};
}

Device opencv_device(const DeviceOptions& options) {
    if (!cv::ocl::useOpenCL())
        return Device::open({}, options);
    return Device(static_cast<cl_context>(cv::ocl::Context::getDefault().ptr()),
                  static_cast<cl_device_id>(cv::ocl::Device::getDefault().ptr()),
                  static_cast<cl_command_queue>(cv::ocl::Queue::getDefault().ptr()), options);
}

Storage storage_of(const cv::Mat& stored) {
    return storage_of_type(stored.type());
}
Storage storage_of(const cv::UMat& stored) {
    return storage_of_type(stored.type());
}

Image to_device(const Device& device, const cv::Mat& mat) {
    return io::image_in(device, mat);
}

Image to_device(const Device& device, const cv::UMat& umat) {
    const std::optional<Image> image = io::image_in(device, umat, cv::ACCESS_READ);
    if (!image)
        return io::copy_of(device, umat);
    io::follow_opencv(device);
    return *image;
}

cv::Mat to_mat(const Image& image) {
    cv::Mat mat(image.height(), image.width(), io::mat_type(image.element(), image.channels()));
    image.download(mat.data, mat.step1());
    return mat;
}

} // namespace fathom

// A cv::UMat of OpenCV's own context is worked on in its buffer, in the order of
// OpenCV's queue and without a wait. Any other matrix is host memory.

namespace fathom::io {
namespace {

constexpr int depths[] = {CV_8U, CV_16U, CV_32S, CV_16F, CV_32F}; // in the order of Element

template <typename Matrix>
Element element_of(const Matrix& matrix) {
    const auto* depth = std::ranges::find(depths, matrix.depth());
    require(depth != std::end(depths), "matrix: type ", cv::typeToString(matrix.type()),
            "; must be CV_32F, CV_16F, CV_16U, CV_32S or CV_8U with interleaved channels");
    return static_cast<Element>(depth - depths);
}

template <typename Matrix>
Layout layout_of(const Matrix& matrix) {
    require(!matrix.empty(), "matrix: it is empty; did cv::imread find and read the file?");
    require(matrix.dims == 2, "matrix: ", matrix.dims, " dimensions, ", matrix.total(), " elements; must be an image");
    require(matrix.step[0] % matrix.elemSize1() == 0, "matrix: rows ", matrix.step[0],
            " bytes apart; must be whole elements");
    return {.width = matrix.cols, .height = matrix.rows, .channels = matrix.channels(), .row_stride = matrix.step1()};
}

void check(const Device& device, cl_int code, const char* what) {
    if (code != CL_SUCCESS)
        throw Error(text(device.info().name, " refused ", what, ": OpenCL returned ", code));
}

cl_command_queue opencv_queue() {
    return static_cast<cl_command_queue>(cv::ocl::Queue::getDefault().ptr());
}

// A cv::UMat that was made while OpenCV used no OpenCL has no buffer, and with shared virtual memory its handle is
// none.
bool in_context_of(const Device& device, const cv::UMat& umat) {
    if (umat.u->currAllocator != cv::ocl::getOpenCLAllocator() || !umat.u->handle ||
        cv::ocl::Context::getDefault(false).useSVM())
        return false;
    cl_context context = nullptr;
    check(device,
          clGetMemObjectInfo(static_cast<cl_mem>(umat.u->handle), CL_MEM_CONTEXT, sizeof(context), &context, nullptr),
          "a cv::UMat");
    return context == device.context();
}

// Its memory is a cv::Mat's, which may be gone or changed once the call has returned. OpenCV's own kernels wait then,
// too.
bool is_temporary(const cv::UMat& umat) {
    return umat.u->tempUMat();
}

// A matrix of the caller's kind, made in the caller's way.
cv::Mat another(const cv::Mat& callers, cv::Size size, int type) {
    cv::Mat made;
    made.allocator = callers.allocator;
    made.create(size, type);
    return made;
}
cv::UMat another(const cv::UMat& callers, cv::Size size, int type) {
    cv::UMat made;
    made.allocator = callers.allocator;
    made.create(size, type, callers.usageFlags);
    return made;
}

// Buffers that OpenCV's pool must not give to another cv::UMat before the device has done with them. OpenCV's own
// kernels keep theirs in the same way. The driver's thread, which runs the callback, must not call OpenCL: if it is the last
// owner, it leaves the buffer to be freed by a later call.
using Kept = std::vector<cv::UMatData*>;

void CL_CALLBACK let_go(cl_event, cl_int, void* kept) {
    const std::unique_ptr<Kept> all(static_cast<Kept*>(kept));
    for (cv::UMatData* each : *all) {
        if (std::atomic_ref(each->urefcount).fetch_sub(1) != 1)
            continue;
        each->flags |= cv::UMatData::ASYNC_CLEANUP;
        try {
            each->currAllocator->deallocate(each);
        } catch (const cv::Exception&) {
            continue; // it is mapped by a cv::Mat that outlives it, and stays
        }
    }
}

// Throws nothing, so that the count is always given back.
cl_int keep_until(cl_event done, std::unique_ptr<Kept> kept) noexcept {
    for (cv::UMatData* each : *kept)
        std::atomic_ref(each->urefcount).fetch_add(1);
    const cl_int code = clSetEventCallback(done, CL_COMPLETE, let_go, kept.get());
    if (code == CL_SUCCESS) {
        (void)kept.release(); // let_go has it
        return code;
    }
    for (cv::UMatData* each : *kept)
        std::atomic_ref(each->urefcount).fetch_sub(1); // the caller still has one
    return code;
}

std::string size_and_type(cv::Size size, int type) {
    return text(ImageSize{size.width, size.height}, " pixels of ", cv::typeToString(type));
}

} // namespace

int mat_type(Element element, int channels) {
    return CV_MAKETYPE(depths[static_cast<std::size_t>(element)], channels);
}

std::optional<Image> image_in(const Device& device, const cv::UMat& umat, cv::AccessFlag access) {
    const Layout layout = layout_of(umat);
    const Element element = element_of(umat);
    if (!in_context_of(device, umat) || umat.u->refcount != 0)
        return {};
    const auto buffer = static_cast<cl_mem>(umat.handle(access)); // which brings what the host wrote to the device
    return Image(device, buffer, element, layout, umat.offset / umat.elemSize1());
}

Image image_in(const Device& device, const cv::Mat& mat) {
    const Layout layout = layout_of(mat);
    return Image::from_host(device, element_of(mat), mat.data, layout);
}

Image copy_of(const Device& device, const cv::UMat& umat) {
    const Layout layout = layout_of(umat);
    const Image image(device, element_of(umat), {layout.width, layout.height, layout.channels});
    const cv::Mat mat = umat.getMat(cv::ACCESS_READ);
    const std::size_t row = static_cast<std::size_t>(mat.cols) * mat.elemSize(),
                      pitch = image.row_stride() * element_bytes(image.element());
    for (int y = 0; y < mat.rows; ++y)
        check(device,
              clEnqueueWriteBuffer(device.queue(), image.buffer(), CL_TRUE, static_cast<std::size_t>(y) * pitch, row,
                                   mat.ptr(y), 0, nullptr, nullptr),
              "a copy of a cv::UMat");
    return image;
}

void follow_opencv(const Device& device) {
    const cl_command_queue opencv = opencv_queue();
    if (device.queue() == opencv)
        return;
    cl_event done = nullptr;
    check(device, clEnqueueMarkerWithWaitList(opencv, 0, nullptr, &done), "to follow OpenCV's queue");
    cl_int code = clFlush(opencv);
    if (code == CL_SUCCESS)
        code = clEnqueueBarrierWithWaitList(device.queue(), 1, &done, nullptr);
    clReleaseEvent(done);
    check(device, code, "to follow OpenCV's queue");
}

Image Matrices::read(cv::InputArray array) {
    if (array.isUMat() && !array.empty()) {
        const cv::UMat umat = array.getUMat();
        if (const std::optional<Image> image = image_in(device_, umat, cv::ACCESS_READ)) {
            umats_.push_back(umat);
            return *image;
        }
        mapped_.push_back(umat);
    }
    mats_.push_back(array.getMat());
    return image_in(device_, mats_.back());
}

Image Matrices::write(cv::OutputArray array, cv::Size size, int type) {
    require(array.needed(), "result: no matrix is given");
    for (const Result& other : results_)
        require(other.array.getObj() != array.getObj(), "result: one matrix is given for two results");
    const bool same_size = array.dims() <= 2 && array.size() == size, same_type = array.type() == type;
    if ((!same_size && array.fixedSize()) || (!same_type && array.fixedType()))
        throw std::invalid_argument(
            text("result: ", array.dims() <= 2 ? size_and_type(array.size(), array.type()) : "more than two dimensions",
                 ", which cannot change; must be ", size_and_type(size, type)));
    const bool fits = same_size && same_type;

    Result result{array, !fits, {}, {}, {}};
    if (array.isUMat()) {
        const cv::UMat& callers = array.getUMatRef();
        result.umat = fits ? callers : another(callers, size, type);
        if (std::optional<Image> image = image_in(device_, result.umat, cv::ACCESS_WRITE)) {
            result.image = std::move(*image);
            umats_.push_back(result.umat);
        } else {
            result.mat = result.umat.getMat(cv::ACCESS_RW);
        }
    } else if (array.isMat()) {
        const cv::Mat& callers = array.getMatRef();
        result.mat = fits ? callers : another(callers, size, type);
    } else { // a vector or the like, which OpenCV makes fit
        array.create(size, type);
        result.mat = array.getMat();
    }
    if (!result.mat.empty())
        result.image = Image::onto_host(device_, element_of(result.mat), result.mat.data, layout_of(result.mat));
    return results_.emplace_back(std::move(result)).image;
}

bool Matrices::host_takes_part() const {
    return !mats_.empty() || std::ranges::any_of(umats_, is_temporary);
}

void Matrices::let_opencv_follow() const {
    const cl_command_queue own = device_.queue(), opencv = opencv_queue();
    auto kept = std::make_unique<Kept>();
    for (const cv::UMat& umat : umats_)
        kept->push_back(umat.u);
    cl_event done = nullptr;
    check(device_, clEnqueueMarkerWithWaitList(own, 0, nullptr, &done), "an event");
    cl_int code = clFlush(own);
    if (code == CL_SUCCESS && own != opencv)
        code = clEnqueueBarrierWithWaitList(opencv, 1, &done, nullptr);
    if (code == CL_SUCCESS)
        code = keep_until(done, std::move(kept));
    clReleaseEvent(done);
    check(device_, code, "to let OpenCV's queue follow");
}

void Matrices::run(const std::function<void()>& operation) {
    if (!umats_.empty())
        follow_opencv(device_);
    operation();
    try {
        for (Result& result : results_) {
            if (!result.mat.empty())
                result.image.download(result.mat.data, result.mat.step1());
        }
        if (host_takes_part())
            device_.finish();
        else if (!umats_.empty())
            let_opencv_follow();
    } catch (...) {
        clFinish(device_.queue()); // the matrices are about to go
        throw;
    }
    for (const Result& result : results_) {
        if (result.made_anew && result.array.isUMat())
            result.array.getUMatRef() = result.umat;
        else if (result.made_anew && result.array.isMat())
            result.array.getMatRef() = result.mat;
    }
}

} // namespace fathom::io
