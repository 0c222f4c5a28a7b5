#pragma once

#include "camera/rays.hpp"
#include "description/result.hpp"
#include "params.h"
#include "runtime/launch.hpp"

#include <fathom/camera.hpp>
#include <fathom/device.hpp>
#include <fathom/image.hpp>

#include <concepts>
#include <vector>

namespace fathom {

/// A count or a place that is known to be in range, as kernels take it.
params::u32 to_u32(std::integral auto value) {
    return static_cast<params::u32>(value);
}

/// A constant as the device reads it: the bits of a double, or two floats with the high part in the low word.
params::wide pack_wide(long double value, Arithmetic arithmetic);
/// The same for a row of constants, each times `unit`.
void pack_row(params::wide (&target)[4], const Affine& row, long double unit, Arithmetic arithmetic);

/// A quotient of sums is the same in any unit. This one keeps the low parts of two floats away from the denormals, and the largest
/// sum away from infinity. Metric values are so large already that 1 is the only safe one.
long double unit_of_quotient(const DepthForm& form, const Affine& numerator, const Affine& denominator);

/// Constants of the depth decoder. Pure: no device.
params::depth_params depth_parameters(const DepthForm& form, Storage storage, Background background,
                                      Arithmetic arithmetic);

/// Is depth stored in steps so large that slopes have to be fitted to more pixels?
bool is_coarse(const Tile& tile);

/// The error of inverse depth that storing it caused; through a lens that of the inverse of the number that is stored.
InverseDepthError stored_error(const Camera& camera, Storage storage);

/// Constants of the rays.
params::ray_params ray_parameters(const Rays& rays, Arithmetic arithmetic);

/// Does the image fit the storage and the camera?
/// Throws: std::invalid_argument naming both.
void check_stored(const StoredDepth& stored);

ImageSize size_of(const Image& image);

/// Throws: std::invalid_argument for a pixel outside an image of this size.
void check_pixel(const char* name, ImageSize size, int x, int y);

/// An image of a call, as messages name it.
struct NamedImage {
    const char* name;
    const Image& image;
};

/// Can an operation on the stored depth write such an image there, without touching `others`, its inputs and other results?
/// Throws: std::invalid_argument naming the image, what it is and what it must be.
void check_result(const StoredDepth& stored, const NamedImage& result, Element element, const Layout& shape,
                  const std::vector<NamedImage>& others = {});

/// The same for each of several results that is asked for. Each is another one's other.
/// Throws: std::invalid_argument also for an image of one that is not.
void check_results(const StoredDepth& stored, const std::vector<description::Result>& results,
                   std::vector<NamedImage> others);

/// Runs a call, with a new image for each result that is asked for, and gives it back.
template <typename Call>
Call run_into_new_images(Call call, const StoredDepth& stored, const Launch& launch) {
    for (const description::Result& result : description::results_of(call, stored))
        if (result.wanted)
            *result.image = Image(stored.image.device(), result.shape.element, result.shape.layout);
    call.run(stored, launch);
    return call;
}

/// The same for a result that has the size of the stored depth, a float in each channel, and may not share memory with
/// it.
void check_result(const StoredDepth& stored, const Image& result, int channels);

/// Does another input lie on the device of the stored depth?
void check_device(const StoredDepth& stored, const NamedImage& other);

/// Is it a picture of the depth's size: three channels, or four with an alpha?
/// Throws: std::invalid_argument naming the picture, what it is and what it must be.
void check_picture(const StoredDepth& stored, const NamedImage& picture, const char* cure = "");
inline constexpr const char* upsample_to_picture =
    "; upsample_along_edges makes depth of the size of a picture that shows the same";

/// The same of a picture of any size.
void check_picture_of_any_size(const StoredDepth& stored, const NamedImage& picture);

/// A picture's element, as kernels are built for it: ELEMENT of params.h.
int element_define(Element element);

/// Columns [begin, end) of the images, the first of which shows the camera's pixels from (x, y) on.
params::grid_params grid_parameters(const Image& source, const Image& result, int begin, int end, int x = 0, int y = 0);
inline params::grid_params grid_parameters(const StoredDepth& stored, const Image& result, int begin, int end) {
    return grid_parameters(stored.image, result, begin, end, stored.x, stored.y);
}

/// Where an image of one float a pixel lies in its buffer.
params::place_params place_parameters(const Image& image);

/// The device's vector width, or the largest that is no wider than that many columns.
int vector_width_for(const Device& device, int columns);

/// What a kernel runs over whose work items make so many columns each.
inline runtime::Range range_of(int width, int height, int vector_width = 1) {
    return {static_cast<std::size_t>((width - 1) / vector_width + 1), static_cast<std::size_t>(height)};
}

/// Should a result be written past the cache? Only aligned rows can be, and only large images gain.
bool worth_streaming(const Image& result, int vector_width);

/// What every kernel that decodes depth is built for.
runtime::Defines decoder_defines(const DepthForm& form, const Rays& rays, Storage storage, int vector_width,
                                 bool stream);

} // namespace fathom
