// Every operation on cv::Mat and cv::UMat: what the caller's arrays become on the device is matrices.cpp's.
#include <fathom/opencv.hpp>

#include "matrices.hpp"
#include "require.hpp"

#include <opencv2/core/check.hpp>
#include <opencv2/core/ocl.hpp>

#include <vector>

namespace fathom {

using io::Matrices;

namespace {

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

StoredDepth stored_depth(Matrices& matrices, cv::InputArray array, Camera camera, std::optional<Storage> storage) {
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

cv::Size size_of(const StoredDepth& stored) {
    return {stored.image.width(), stored.image.height()};
}

int checked_channels(int channels) {
    require(channels == 3 || channels == 4, "channels = ", channels, " must be 3 or 4");
    return channels;
}

// Where floats go: into the array, or somewhere if it is not given.
Image given_or_new(Matrices& matrices, cv::OutputArray array, cv::Size size) {
    if (!array.needed())
        return Image(matrices.device(), Element::f32, {size.width, size.height});
    return matrices.write(array, size, CV_32FC1);
}

void check_given(bool asked, const char* name, cv::OutputArray array) {
    require(!asked || array.needed(), name, " is asked for and has no matrix to be written into");
    require(asked || !array.needed(), name, " has a matrix to be written into, but the options do not ask for it");
}

} // namespace

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
    cv::Mat mat(image.height(), image.width(), mat_type(image));
    image.download(mat.data, mat.step1());
    return mat;
}

void linearize(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray depth,
               const LinearizeOptions& options, std::optional<Storage> storage, const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const Image result = matrices.write(depth, size_of(input), CV_32FC1);
    matrices.run([&] { linearize(input, result, options, launch); });
}

void unproject(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray positions,
               const UnprojectOptions& options, std::optional<Storage> storage, const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const Image result = matrices.write(positions, size_of(input), CV_32FC(checked_channels(options.channels)));
    matrices.run([&] { unproject(input, result, options, launch); });
}

void normals(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray result,
             const NormalsOptions& options, std::optional<Storage> storage, const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const Image onto = matrices.write(result, size_of(input), CV_32FC(checked_channels(options.channels)));
    matrices.run([&] { normals(input, onto, options, launch); });
}

void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius, cv::OutputArray visibility,
          const SsaoOptions& options, std::optional<Storage> storage, const Launch& launch) {
    ssao(device, stored, camera, radius, {.visibility = visibility}, options, storage, launch);
}

void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius,
          const OcclusionArrays& results, const SsaoOptions& options, std::optional<Storage> storage,
          const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const cv::Size size = options.region ? cv::Size(options.region->width, options.region->height) : size_of(input);
    require(size.width > 0 && size.height > 0, "region: ", size.width, " x ", size.height,
            " pixels; must have at least one");
    check_given(options.bent_normal, "bent_normal", results.bent_normal);
    check_given(options.confidence, "confidence", results.confidence);
    Occlusion images{
        .visibility = given_or_new(matrices, results.visibility, size), .bent_normal = {}, .confidence = {}};
    if (options.bent_normal)
        images.bent_normal = matrices.write(results.bent_normal, size, CV_32FC3);
    if (options.confidence)
        images.confidence = matrices.write(results.confidence, size, CV_32FC1);
    matrices.run([&] { ssao(input, images, radius, options, launch); });
}

void dof_masks(const Device& device, cv::InputArray stored, const Camera& camera, const CircleOfConfusion& coc,
               const DofMaskArrays& results, const DofMasksOptions& options, std::optional<Storage> storage,
               const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    require(options.tile_px >= 1, "tile_px = ", options.tile_px, " must be 1 to 65536");
    const cv::Size size = size_of(input),
                   tiles((size.width - 1) / options.tile_px + 1, (size.height - 1) / options.tile_px + 1);
    struct Result {
        bool asked;
        const char* name;
        cv::OutputArray array;
        Image DofMasks::*image;
        cv::Size size;
    };
    const Result all[] = {{options.near_weight, "near_weight", results.near_weight, &DofMasks::near_weight, size},
                          {options.focus_weight, "focus_weight", results.focus_weight, &DofMasks::focus_weight, size},
                          {options.far_weight, "far_weight", results.far_weight, &DofMasks::far_weight, size},
                          {options.max_near_coc, "max_near_coc", results.max_near_coc, &DofMasks::max_near_coc, size},
                          {options.near_alpha, "near_alpha", results.near_alpha, &DofMasks::near_alpha, size},
                          {options.disocclusion, "disocclusion", results.disocclusion, &DofMasks::disocclusion, size},
                          {options.mixed_pixels, "mixed_pixels", results.mixed_pixels, &DofMasks::mixed_pixels, size},
                          {options.tile_min_coc, "tile_min_coc", results.tile_min_coc, &DofMasks::tile_min_coc, tiles},
                          {options.tile_max_coc, "tile_max_coc", results.tile_max_coc, &DofMasks::tile_max_coc, tiles}};
    for (const Result& result : all)
        check_given(result.asked, result.name, result.array);
    DofMasks images{.coc = given_or_new(matrices, results.coc, size)};
    for (const Result& result : all)
        if (result.asked)
            images.*result.image = matrices.write(result.array, result.size, CV_32FC1);
    matrices.run([&] { dof_masks(input, images, coc, options, launch); });
}

void dof(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         const CircleOfConfusion& coc, cv::OutputArray result, const DofOptions& options,
         std::optional<Storage> storage, const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const Image image = matrices.read(color);
    const Image onto = matrices.write(result, color.size(), color.type());
    matrices.run([&] { dof(input, image, onto, coc, options, launch); });
}

void fog(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         cv::OutputArray result, const FogOptions& options, std::optional<Storage> storage, const Launch& launch) {
    Matrices matrices(device);
    const StoredDepth input = stored_depth(matrices, stored, camera, storage);
    const Image image = matrices.read(color);
    const Image onto = matrices.write(result, color.size(), color.type());
    matrices.run([&] { fog(input, image, onto, options, launch); });
}

} // namespace fathom
