#pragma once

#include <fathom/device.hpp>
#include <fathom/findings.hpp>
#include <fathom/image.hpp>
#include <fathom/opencv.hpp>
#include <fathom/photograph.hpp>

#include <opencv2/core.hpp>

namespace fathom::io {

/// Pixels in a matrix's memory.
inline HostDepth on_host(const cv::Mat& values, Storage storage) {
    return {values.data, values.cols, values.rows, values.step, storage};
}

inline HostFloats on_host(const cv::Mat& floats) {
    return {floats.ptr<float>(), floats.cols, floats.rows, floats.channels(), floats.step1()};
}

/// Floats that an operation writes, for the host: a CPU writes them where they are read, and nothing is copied.
class FloatsOnHost {
public:
    FloatsOnHost(const Device& device, cv::Size size, int channels) {
        if (device.info().cpu) {
            mat_.create(size, CV_32FC(channels));
            image_ = to_device(device, mat_);
        } else {
            image_ = Image(device, Element::f32, {size.width, size.height, channels});
        }
    }

    const Image& image() const { return image_; }

    /// What was written, once it is there.
    cv::Mat mat() const {
        if (mat_.empty())
            return to_mat(image_);
        image_.download(mat_.data, mat_.step1());
        return mat_;
    }

private:
    cv::Mat mat_; // none where the device has memory of its own
    Image image_;
};

/// The floats that `make` writes into an image.
template <typename Make>
cv::Mat floats_on_host(const Image& source, int channels, const Make& make) {
    const FloatsOnHost floats(source.device(), {source.width(), source.height()}, channels);
    make(floats.image());
    return floats.mat();
}

} // namespace fathom::io
