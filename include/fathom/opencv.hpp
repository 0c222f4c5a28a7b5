#pragma once

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/fog.hpp>
#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/linearize.hpp>
#include <fathom/normals.hpp>
#include <fathom/ssao.hpp>
#include <fathom/unproject.hpp>

#include <opencv2/core/mat.hpp>

#include <optional>

/// Every operation on OpenCV's matrices, cv::Mat and cv::UMat alike, with the options of its form on images.
///
/// In: stored depth as `storage_of` reads it, or as `storage` says. A camera without a width and a height takes the
/// matrix's; `circle_of_confusion` needs a camera that has them.
/// Packed depth (CV_8UC3, CV_8UC4) needs its storage, such as `Storage::bgr8_red_low`. A fourth byte is dropped, which
/// takes a copy on the host.
/// Out: a matrix whose size and type fit is written where it lies, continuous or not; any other is made anew, and a cv::Mat that
/// showed a region then shows one no more. A call that throws std::invalid_argument leaves every matrix as it was.
/// Positions and normals are x, y, z. Pictures are B, G, R, and A with alpha multiplied in.
///
/// On a CPU device results are computed in a cv::Mat's memory, and no matrix is copied. Such a call returns when its results
/// are there.
///
/// A cv::UMat in the context of the device, as `opencv_device` gives it, is read and written in its own buffer on any device.
/// If all matrices of a call are such, it does not wait for its kernels, as the form on images does not: OpenCV's next step
/// does, or reading the result. A cv::UMat that is a cv::Mat's memory makes it wait. Otherwise a cv::UMat is mapped and treated
/// as a cv::Mat, with the same bits: on a device of another context, while OpenCV uses no OpenCL, and while a cv::Mat holds it
/// mapped.
///
/// Throws: as the form on images, and std::invalid_argument for a matrix of another type or size, and for a result that is
/// asked for without a matrix, or has one without being asked for. What OpenCV cannot allocate or map is a cv::Exception.
namespace fathom {
#pragma GCC visibility push(default)

/// OpenCV's own device, context and queue, in which cv::UMat needs no copy; `Device::open` where OpenCV uses no OpenCL,
/// so that the same calls work there. OpenCV 4.6 leaves a CPU alone unless the environment has
/// `OPENCV_OPENCL_DEVICE=:CPU:`. Make it once and keep it: an operation on images refuses those of two devices.
Device opencv_device(const DeviceOptions& options = {});

/// The storage that a matrix holds by its type: CV_32F, CV_16F, CV_16U, CV_32S (uint24).
/// Throws: std::invalid_argument for any other type. Bytes may be a picture by mistake, so packed depth has to be said.
Storage storage_of(const cv::Mat& stored);
Storage storage_of(const cv::UMat& stored);

/// The device's view of a matrix: shared memory on a CPU device, a copy on any other. The matrix must outlive it, so
/// that a temporary one does not compile.
Image to_device(const Device& device, const cv::Mat& mat);
Image to_device(const Device& device, const cv::Mat&& mat) = delete;

/// The same for a cv::UMat: its buffer in the context of the device, after all that OpenCV was told to do to it; a copy
/// on any other. Before OpenCV changes the matrix, `Device::finish` what reads the image.
Image to_device(const Device& device, const cv::UMat& umat);
Image to_device(const Device& device, const cv::UMat&& umat) = delete;

/// A device image as a new matrix.
cv::Mat to_mat(const Image& image);

/// View depth (CV_32FC1); see linearize.hpp. A float matrix may be its own result.
void linearize(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray depth,
               const LinearizeOptions& options = {}, std::optional<Storage> storage = {}, const Launch& launch = {});

/// Positions (CV_32FC3 or CV_32FC4); see unproject.hpp.
void unproject(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray positions,
               const UnprojectOptions& options = {}, std::optional<Storage> storage = {}, const Launch& launch = {});

/// Normals (CV_32FC3, or CV_32FC4 with the validity); see normals.hpp.
void normals(const Device& device, cv::InputArray stored, const Camera& camera, cv::OutputArray result,
             const NormalsOptions& options = {}, std::optional<Storage> storage = {}, const Launch& launch = {});

/// Where the results of `ssao` go: those that the options ask for. Visibility, too, may be left out.
struct OcclusionArrays {
    cv::OutputArray visibility = cv::noArray();  ///< CV_32FC1
    cv::OutputArray bent_normal = cv::noArray(); ///< CV_32FC3
    cv::OutputArray confidence = cv::noArray();  ///< CV_32FC1
};

/// Ambient occlusion; see ssao.hpp.
void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius,
          const OcclusionArrays& results, const SsaoOptions& options = {}, std::optional<Storage> storage = {},
          const Launch& launch = {});

/// The same for visibility alone.
void ssao(const Device& device, cv::InputArray stored, const Camera& camera, double radius, cv::OutputArray visibility,
          const SsaoOptions& options = {}, std::optional<Storage> storage = {}, const Launch& launch = {});

/// Where the masks of `dof_masks` go (CV_32FC1): those that the options ask for. The circle, too, may be left out.
struct DofMaskArrays {
    cv::OutputArray coc = cv::noArray();
    cv::OutputArray near_weight = cv::noArray();
    cv::OutputArray focus_weight = cv::noArray();
    cv::OutputArray far_weight = cv::noArray();
    cv::OutputArray max_near_coc = cv::noArray();
    cv::OutputArray near_alpha = cv::noArray();
    cv::OutputArray disocclusion = cv::noArray();
    cv::OutputArray mixed_pixels = cv::noArray();
    cv::OutputArray tile_min_coc = cv::noArray();
    cv::OutputArray tile_max_coc = cv::noArray();
};

/// The circle of confusion and masks; see dof_masks.hpp.
void dof_masks(const Device& device, cv::InputArray stored, const Camera& camera, const CircleOfConfusion& circle,
               const DofMaskArrays& results, const DofMasksOptions& options = {}, std::optional<Storage> storage = {},
               const Launch& launch = {});

/// A blurred picture of the type of `color`: CV_32FC3, CV_16FC3, CV_16UC3, CV_8UC3, or four channels with an alpha; see
/// dof.hpp.
void dof(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         const CircleOfConfusion& circle, cv::OutputArray result, const DofOptions& options = {},
         std::optional<Storage> storage = {}, const Launch& launch = {});

/// A picture with fog, of the type of `color`, which is any that `dof` takes; see fog.hpp. `FogOptions::fog_color` has the
/// order of the picture's channels: B, G, R as OpenCV reads files.
void fog(const Device& device, cv::InputArray stored, const Camera& camera, cv::InputArray color,
         cv::OutputArray result, const FogOptions& options, std::optional<Storage> storage = {},
         const Launch& launch = {});

#pragma GCC visibility pop
} // namespace fathom
