// cv::Mat in and out.
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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

void check_not_empty(const cv::Mat& mat) {
    if (mat.empty())
        throw std::invalid_argument("matrix: it is empty; did cv::imread find and read the file?");
}

Layout layout_of(const cv::Mat& mat) {
    check_not_empty(mat);
    if (mat.dims != 2)
        throw std::invalid_argument("matrix: " + std::to_string(mat.dims) + " dimensions, " +
                                    std::to_string(mat.total()) + " elements; must be an image");
    if (mat.step[0] % mat.elemSize1() != 0)
        throw std::invalid_argument("matrix: rows " + std::to_string(mat.step[0]) +
                                    " bytes apart; must be whole elements");
    return {.width = mat.cols, .height = mat.rows, .channels = mat.channels(), .row_stride = mat.step1()};
}

// Stored depth, and the matrix that holds it while the device reads it.
struct Stored {
    cv::Mat values;
    StoredDepth depth;

    Stored(const Device& device, cv::InputArray array, Camera camera, std::optional<Storage> storage)
        : values(array.getMat()) {
        check_not_empty(values);
        if (values.type() == CV_8UC4)
            values = three_channels(values);
        if (camera.width == 0 && camera.height == 0) {
            camera.width = values.cols;
            camera.height = values.rows;
        }
        if (camera.width != values.cols || camera.height != values.rows)
            throw std::invalid_argument("matrix: " + std::to_string(values.cols) + " x " + std::to_string(values.rows) +
                                        " pixels; the camera is for " + std::to_string(camera.width) + " x " +
                                        std::to_string(camera.height) +
                                        " (a part of an image is a `StoredDepth` region)");
        depth = {to_device(device, values), camera, storage ? *storage : storage_of(values)};
    }

    cv::Size size() const { return values.size(); }

private:
    static cv::Mat three_channels(const cv::Mat& four) {
        cv::Mat three(four.size(), CV_8UC3);
        constexpr int from_to[] = {0, 0, 1, 1, 2, 2};
        cv::mixChannels(&four, 1, &three, 1, from_to, 3);
        return three;
    }
};

// A matrix that an operation writes into: where it lies, if the device can.
class Result {
public:
    Result(const Device& device, cv::OutputArray array, cv::Size size, int type) {
        array.create(size, type);
        mat_ = array.getMat();
        image_ = Image::onto_host(device, element_of(mat_), mat_.data, layout_of(mat_));
    }

    const Image& image() const { return image_; }

    // Waits for the device.
    void fetch() { image_.download(mat_.data, mat_.step1()); }

private:
    cv::Mat mat_;
    Image image_;
};

int checked_channels(int channels) {
    if (channels != 3 && channels != 4)
        throw std::invalid_argument("channels = " + std::to_string(channels) + " must be 3 or 4");
    return channels;
}

// The results of an operation that writes several images, some of them into matrices.
class Results {
public:
    explicit Results(const Device& device) : device_(device) {}

    // The image for what goes into the array, or somewhere if the array is not given.
    Image image(cv::OutputArray array, cv::Size size, int channels = 1) {
        if (!array.needed())
            return Image(device_, Element::f32, {size.width, size.height, channels});
        return results_.emplace_back(device_, array, size, CV_32FC(channels)).image();
    }

    void fetch() {
        for (Result& result : results_)
            result.fetch();
    }

private:
    Device device_;
    std::vector<Result> results_;
};

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
    case CV_8UC1:
    case CV_8UC3:
    case CV_8UC4:
        throw std::invalid_argument(
            "stored depth: a matrix of 8 bits is a picture, or packed depth; read the file with "
            "cv::IMREAD_UNCHANGED, or say the storage of packed depth (bgr8_red_low)");
    default:
        throw std::invalid_argument("stored depth: matrix of type " + std::to_string(stored.type()) +
                                    "; must be CV_32FC1, CV_16FC1, CV_16UC1 or CV_32SC1");
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

void linearize(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray depth,
               const LinearizeOptions& options, std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    Result result(device, depth, input.size(), CV_32FC1);
    linearize(input.depth, result.image(), options, launch);
    result.fetch();
}

void unproject(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray positions,
               const UnprojectOptions& options, std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    Result result(device, positions, input.size(), CV_32FC(checked_channels(options.channels)));
    unproject(input.depth, result.image(), options, launch);
    result.fetch();
}

void normals(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray result,
             const NormalsOptions& options, std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    Result onto(device, result, input.size(), CV_32FC(checked_channels(options.channels)));
    normals(input.depth, onto.image(), options, launch);
    onto.fetch();
}

void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius, cv::OutputArray visibility,
          const SsaoOptions& options, std::optional<Storage> storage, const Launch& launch) {
    ssao(device, stored, camera, radius, visibility, cv::noArray(), cv::noArray(), options, storage, launch);
}

void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius, cv::OutputArray visibility,
          cv::OutputArray bent_normal, cv::OutputArray confidence, const SsaoOptions& options,
          std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    const cv::Size size = options.region ? cv::Size(options.region->width, options.region->height) : input.size();
    if (size.width < 1 || size.height < 1)
        throw std::invalid_argument("region: " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                                    " pixels; must have at least one");
    SsaoOptions asked = options;
    asked.bent_normal = bent_normal.needed();
    asked.confidence = confidence.needed();
    Results results(device);
    Occlusion images{.visibility = results.image(visibility, size), .bent_normal = {}, .confidence = {}};
    if (asked.bent_normal)
        images.bent_normal = results.image(bent_normal, size, 3);
    if (asked.confidence)
        images.confidence = results.image(confidence, size);
    ssao(input.depth, images, radius, asked, launch);
    results.fetch();
}

void dof_masks(const Device& device, cv::InputArray stored, const Camera& camera, const CircleOfConfusion& coc,
               const DofMaskArrays& results, const DofMasksOptions& options, std::optional<Storage> storage,
               const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    DofMasksOptions asked = options;
    asked.weights = results.near_weight.needed() || results.focus_weight.needed() || results.far_weight.needed();
    asked.max_near_coc = results.max_near_coc.needed();
    asked.near_alpha = results.near_alpha.needed();
    asked.disocclusion = results.disocclusion.needed();
    asked.mixed_pixels = results.mixed_pixels.needed();
    const bool tiles = results.tile_min_coc.needed() || results.tile_max_coc.needed();
    if (tiles && options.tile_px < 1)
        throw std::invalid_argument("tile_px = " + std::to_string(options.tile_px) +
                                    " must be at least 1 for the extremes of tiles");
    if (!tiles)
        asked.tile_px = 0;

    Results onto(device);
    DofMasks images;
    const auto give = [&](bool wanted, Image DofMasks::*image, cv::OutputArray array, cv::Size size) {
        if (wanted)
            images.*image = onto.image(array, size);
    };
    const cv::Size size = input.size();
    give(true, &DofMasks::coc, results.coc, size);
    give(asked.weights, &DofMasks::near_weight, results.near_weight, size);
    give(asked.weights, &DofMasks::focus_weight, results.focus_weight, size);
    give(asked.weights, &DofMasks::far_weight, results.far_weight, size);
    give(asked.max_near_coc, &DofMasks::max_near_coc, results.max_near_coc, size);
    give(asked.near_alpha, &DofMasks::near_alpha, results.near_alpha, size);
    give(asked.disocclusion, &DofMasks::disocclusion, results.disocclusion, size);
    give(asked.mixed_pixels, &DofMasks::mixed_pixels, results.mixed_pixels, size);
    if (tiles) {
        const cv::Size grid((size.width - 1) / asked.tile_px + 1, (size.height - 1) / asked.tile_px + 1);
        give(true, &DofMasks::tile_min_coc, results.tile_min_coc, grid);
        give(true, &DofMasks::tile_max_coc, results.tile_max_coc, grid);
    }
    dof_masks(input.depth, images, coc, asked, launch);
    onto.fetch();
}

void dof(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         const CircleOfConfusion& coc, cv::OutputArray result, const DofOptions& options,
         std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    const cv::Mat picture = color.getMat();
    const Image image = to_device(device, picture);
    Result onto(device, result, picture.size(), picture.type());
    dof(input.depth, image, onto.image(), coc, options, launch);
    onto.fetch();
}

void fog(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         cv::OutputArray result, const FogOptions& options, std::optional<Storage> storage, const Launch& launch) {
    const Stored input(device, stored, camera, storage);
    const cv::Mat picture = color.getMat();
    const Image image = to_device(device, picture);
    Result onto(device, result, picture.size(), picture.type());
    FogOptions in_order = options;
    std::swap(in_order.color[0], in_order.color[2]); // a matrix is B, G, R
    fog(input.depth, image, onto.image(), in_order, launch);
    onto.fetch();
}

} // namespace fathom
