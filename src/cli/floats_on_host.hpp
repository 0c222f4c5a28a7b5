#pragma once

#include <fathom/device.hpp>
#include <fathom/image.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

namespace fathom::cli {

/// The floats that `make` writes into an image, for the host: a CPU writes them where they are read, and nothing is copied.
template <typename Make>
cv::Mat floats_on_host(const Image& source, int channels, const Make& make) {
    const Device& device = source.device();
    if (!device.info().cpu) {
        const Image image(device, Element::f32, {source.width(), source.height(), channels});
        make(image);
        return to_mat(image);
    }
    cv::Mat mat(source.height(), source.width(), CV_32FC(channels));
    const Image image = to_device(device, mat);
    make(image);
    image.download(mat.data, mat.step1());
    return mat;
}

} // namespace fathom::cli
