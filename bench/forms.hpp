#pragma once

#include "operations/circle.hpp"

#include <fathom/fathom.hpp>

#include <string>
#include <vector>

namespace fathom::bench {

/// What a kernel that decodes depth is built for. The library asks for the least that is exact for a camera; here it may be
/// asked for more, on the same input.
struct Model {
    std::string name; ///< for people: "1/z affine", "quotient with x and y"
    DepthForm form;
    Rays rays;
    bool pixel_terms; ///< are terms of the pixel summed, be they zero?
};

/// What the library builds for this camera.
Model least_model(const Camera& camera, Storage storage = Storage::float32);

/// Every kernel that the least one is a case of, with the same constants and zeros or ones for the rest: wider forms, terms of
/// the pixel that are zero, and, for ray distance, a depth of each pixel's own that is one step's.
std::vector<Model> wider_models(const Model& least);

/// The same with w = (z - eye_depth) / depth(x, y), depth being 1 at every pixel, instead of w = z.
Model with_depth_of_each_ray(Model model);

/// kernels/linearize.cl for that model, the background decoded like any other value.
void linearize_as(const Model& model, const StoredDepth& stored, const Image& view_depth);

/// kernels/unproject.cl likewise, to three floats a pixel.
void unproject_as(const Model& model, const StoredDepth& stored, const Image& positions);

/// kernels/inverse_depth.cl likewise: the first pass of `normals` and `ssao`.
void inverse_depth_as(const Model& model, const StoredDepth& stored, const Image& inverse_depth);

/// The circle of confusion by another of the laws in kernels/circle.h.
struct CircleModel {
    std::string name;
    Model depth;
    CircleForm form;
};

/// What the library builds for this camera, and then every law that it is a case of.
std::vector<CircleModel> circle_models(const Camera& camera, const CircleOfConfusion& circle);

/// kernels/dof_masks.cl by that law, the circle alone.
void circle_as(const CircleModel& model, const CircleOfConfusion& circle, const StoredDepth& stored,
               const Image& result);

} // namespace fathom::bench
