#pragma once

#include "description/check.hpp"
#include "description/operations.hpp"

#include "require.hpp"

#include <fathom/image.hpp>
#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

/// The form on matrices of any operation: include/fathom/opencv.hpp declares them, and CMake defines each by `form`.
namespace fathom::io {

/// The type of a matrix that holds such an image.
int mat_type(Element element, int channels);

/// The image in a cv::UMat's own memory, if the device can work there: OpenCV keeps it in a buffer of the device's
/// context, and no cv::Mat holds it mapped.
/// Throws: std::invalid_argument for a matrix that is no image.
std::optional<Image> image_in(const Device& device, const cv::UMat& umat, cv::AccessFlag access);

/// The image in a cv::Mat: its memory on a CPU device, a copy on any other.
Image image_in(const Device& device, const cv::Mat& mat);

/// An image that holds a copy of a cv::UMat, whatever the device.
Image copy_of(const Device& device, const cv::UMat& umat);

/// What the device's queue is given from now on waits for what OpenCV's queue was given before.
void follow_opencv(const Device& device);

/// The matrices that one call of an operation reads and writes, as images on the device. A result whose matrix has
/// another size or type is made anew. It reaches the caller only after the operation did not throw.
class Matrices {
public:
    explicit Matrices(const Device& device) : device_(device) {}

    const Device& device() const { return device_; }
    Image read(cv::InputArray array);

    /// Throws: std::invalid_argument for an array that cannot take this size and type.
    Image write(cv::OutputArray array, cv::Size size, int type);

    /// Runs the operation after what OpenCV's queue was given before, and before what that is given later. Waits for
    /// the operation if host memory takes part.
    void run(const std::function<void()>& operation);

private:
    struct Result {
        cv::OutputArray array;
        bool made_anew;
        cv::UMat umat; // outlives the cv::Mat that maps it
        cv::Mat mat;   // empty if the device writes into the cv::UMat
        Image image;
    };

    bool host_takes_part() const;
    void let_opencv_follow() const;

    Device device_;
    std::vector<cv::UMat> mapped_; // outlive the cv::Mats that map them
    std::vector<cv::Mat> mats_;    // that the device reads
    std::vector<cv::UMat> umats_;  // in whose memory the device reads or writes
    std::vector<Result> results_;
};

StoredDepth stored_depth(Matrices& matrices, cv::InputArray array, Camera camera, std::optional<Storage> storage);

/// The call whose options these are.
template <typename Options, typename Call, typename... Calls>
auto call_with(const std::tuple<Call, Calls...>* = nullptr) {
    if constexpr (std::is_same_v<decltype(Call::options), Options>)
        return Call{};
    else
        return call_with<Options, Calls...>();
}
template <typename Options, typename... Calls>
auto call_of(const std::tuple<Calls...>*) {
    return call_with<Options, Calls...>();
}

/// The arguments of one call, each taken by its type.
template <typename Call>
struct FormArguments {
    Call call;
    Matrices matrices;
    std::map<std::string_view, const cv::_OutputArray*> results = {};
    std::vector<const cv::_InputArray*> pictures = {};
    std::optional<Storage> storage = {};
    Launch launch = {};

    void take(const cv::_InputArray& picture) { pictures.push_back(&picture); }
    void take(double radius) { call.radius = radius; }
    void take(const CircleOfConfusion& circle) { call.circle = circle; }
    void take(const decltype(Call::options)& options) { call.options = options; }
    void take(const std::optional<Storage>& given) { storage = given; }
    void take(const Launch& given) { launch = given; }
    void take(const cv::_OutputArray& result) { results = {{"result", &result}}; }
    void take(const OcclusionArrays& r) {
        results = {{"visibility", &r.visibility}, {"bent_normal", &r.bent_normal}, {"confidence", &r.confidence}};
    }
    void take(const DofMaskArrays& r) {
        results = {{"coc", &r.coc},
                   {"near_weight", &r.near_weight},
                   {"focus_weight", &r.focus_weight},
                   {"far_weight", &r.far_weight},
                   {"max_near_coc", &r.max_near_coc},
                   {"near_alpha", &r.near_alpha},
                   {"disocclusion", &r.disocclusion},
                   {"mixed_pixels", &r.mixed_pixels},
                   {"tile_min_coc", &r.tile_min_coc},
                   {"tile_max_coc", &r.tile_max_coc}};
    }

    // The matrix of a result, or none. A form with one matrix has that of the first.
    const cv::_OutputArray& matrix_of(const description::Result& result, bool is_first) const {
        const auto found = results.find(is_first && results.size() == 1 ? "result" : result.name);
        return found == results.end() ? static_cast<const cv::_OutputArray&>(cv::noArray()) : *found->second;
    }

    // Where a result goes: into its matrix, or somewhere if the first of several has none.
    void place(const description::Result& result, const cv::_OutputArray& array, bool may_be_missing) {
        const Layout& layout = result.shape.layout;
        require(layout.width > 0 && layout.height > 0, "region: ", layout.width, " x ", layout.height,
                " pixels; must have at least one");
        if (may_be_missing && !array.needed())
            *result.image = Image(matrices.device(), result.shape.element, layout);
        else
            *result.image =
                matrices.write(array, {layout.width, layout.height}, mat_type(result.shape.element, layout.channels));
    }
};

template <typename Options, typename... Arguments>
void form(const Device& device, cv::InputArray stored, const Camera& camera, const Arguments&... given) {
    using Call = decltype(call_of<Options>(static_cast<description::Calls*>(nullptr)));
    FormArguments<Call> arguments{.call = {}, .matrices = Matrices(device)};
    (arguments.take(given), ...);
    Call& call = arguments.call;
    describe(description::Check{}, call.options);
    const StoredDepth input = stored_depth(arguments.matrices, stored, camera, arguments.storage);
    if constexpr (requires { call.color; })
        call.color = arguments.matrices.read(*arguments.pictures.front());

    const std::vector<description::Result> results = description::results_of(call, input);
    for (std::size_t i = 1; i < results.size(); ++i) {
        const auto& [name, image, wanted, shape, content, words] = results[i];
        const bool has_matrix = arguments.matrix_of(results[i], false).needed();
        require(!wanted || has_matrix, name, " is asked for and has no matrix to be written into");
        require(wanted || !has_matrix, name, " has a matrix to be written into, but the options do not ask for it");
    }
    for (std::size_t i = 0; i < results.size(); ++i)
        if (results[i].wanted)
            arguments.place(results[i], arguments.matrix_of(results[i], i == 0), i == 0 && results.size() > 1);
    arguments.matrices.run([&] {
        if constexpr (requires { call.color; })
            if (call.color.width() != input.image.width() || call.color.height() != input.image.height())
                return call.run(upsample_along_edges(input, call.color), arguments.launch);
        call.run(input, arguments.launch);
    });
}

} // namespace fathom::io
