// cv::Mat in and out.
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <stdexcept>
#include <string>

namespace fathom {
namespace {

[[noreturn]] void refuse_type(const cv::Mat& mat) {
    throw std::invalid_argument("matrix: type " + std::to_string(mat.type()) +
                                "; must be CV_32F, CV_16F, CV_16U, CV_32S or CV_8U with interleaved channels");
}

Element element_of(const cv::Mat& mat) {
    switch (mat.depth()) {
    case CV_8U:
        return Element::u8;
    case CV_16U:
        return Element::u16;
    case CV_32S:
        return Element::u32;
    case CV_16F:
        return Element::f16;
    case CV_32F:
        return Element::f32;
    default:
        refuse_type(mat);
    }
}

int mat_type(const Image& image) {
    switch (image.element()) {
    case Element::u8:
        return CV_8UC(image.channels());
    case Element::u16:
        return CV_16UC(image.channels());
    case Element::u32:
        return CV_32SC(image.channels());
    case Element::f16:
        return CV_16FC(image.channels());
    case Element::f32:
        break;
    }
    return CV_32FC(image.channels());
}

Layout layout_of(const cv::Mat& mat) {
    if (mat.empty() || mat.dims != 2)
        throw std::invalid_argument("matrix: " + std::to_string(mat.dims) + " dimensions, " +
                                    std::to_string(mat.total()) + " elements; must be an image that is not empty");
    if (mat.step[0] % mat.elemSize1() != 0)
        throw std::invalid_argument("matrix: rows " + std::to_string(mat.step[0]) +
                                    " bytes apart; must be whole elements");
    return {.width = mat.cols, .height = mat.rows, .channels = mat.channels(), .row_stride = mat.step1()};
}

StoredDepth stored_depth(const Device& device, const cv::Mat& stored, Camera camera) {
    if (camera.width == 0 && camera.height == 0) {
        camera.width = stored.cols;
        camera.height = stored.rows;
    }
    if (camera.width != stored.cols || camera.height != stored.rows)
        throw std::invalid_argument("matrix: " + std::to_string(stored.cols) + " x " + std::to_string(stored.rows) +
                                    " pixels; the camera is for " + std::to_string(camera.width) + " x " +
                                    std::to_string(camera.height) + " (a part of an image is a `StoredDepth` region)");
    return {to_device(device, stored), camera, storage_of(stored)};
}

} // namespace

Storage storage_of(const cv::Mat& stored) {
    switch (stored.type()) {
    case CV_32FC1:
        return Storage::float32;
    case CV_16FC1:
        return Storage::float16;
    case CV_16UC1:
        return Storage::uint16;
    case CV_32SC1:
        return Storage::uint24;
    case CV_8UC3:
        return Storage::rgb8_red_low;
    default:
        throw std::invalid_argument("stored depth: matrix of type " + std::to_string(stored.type()) +
                                    "; must be CV_32FC1, CV_16FC1, CV_16UC1, CV_32SC1 or CV_8UC3");
    }
}

Image to_device(const Device& device, const cv::Mat& mat) {
    return Image::from_host(device, element_of(mat), mat.data, layout_of(mat));
}

cv::Mat to_mat(const Image& image) {
    cv::Mat mat(image.height(), image.width(), mat_type(image));
    image.download(mat.data, mat.step1());
    return mat;
}

cv::Mat linearize(const Device& device, const cv::Mat& stored, const Camera& camera, const LinearizeOptions& options) {
    cv::Mat z(stored.size(), CV_32FC1);
    const auto onto = Image::onto_host(device, Element::f32, z.data, layout_of(z));
    linearize(stored_depth(device, stored, camera), onto, options);
    onto.download(z.data, z.step1());
    return z;
}

cv::Mat unproject(const Device& device, const cv::Mat& stored, const Camera& camera, const UnprojectOptions& options) {
    if (options.channels != 3 && options.channels != 4)
        throw std::invalid_argument("channels = " + std::to_string(options.channels) + " must be 3 or 4");
    cv::Mat positions(stored.size(), CV_32FC(options.channels));
    const auto onto = Image::onto_host(device, Element::f32, positions.data, layout_of(positions));
    unproject(stored_depth(device, stored, camera), onto, options);
    onto.download(positions.data, positions.step1());
    return positions;
}

} // namespace fathom
