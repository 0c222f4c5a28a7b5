// Images of cv::Mat and cv::UMat. Operations on them are defined by opencv_form.hpp.
#include "opencv_form.hpp"

#include "require.hpp"

#include <opencv2/core/check.hpp>
#include <opencv2/core/ocl.hpp>

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

template <typename Matrix>
Matrix three_channels(const Matrix& four) {
    std::vector<Matrix> three(1);
    three[0].create(four.size(), CV_8UC3);
    constexpr int from_to[] = {0, 0, 1, 1, 2, 2};
    cv::mixChannels(std::vector<Matrix>{four}, three, from_to, 3);
    return three[0];
}

Image stored_image(Matrices& matrices, cv::InputArray array) {
    if (array.empty() || array.dims() > 2 || array.type() != CV_8UC4)
        return matrices.read(array);
    if (array.isUMat())
        return matrices.read(three_channels(array.getUMat()));
    return matrices.read(three_channels(array.getMat()));
}

} // namespace

StoredDepth io::stored_depth(Matrices& matrices, cv::InputArray array, Camera camera, std::optional<Storage> storage) {
    const Image image = stored_image(matrices, array);
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
