#pragma once

#include "lens/laws.hpp"

#include <fathom/camera.hpp>

namespace fathom::lens {

/// A camera's lens between its stored pixels and its view space: rows from the top or from the bottom, and the camera's axes.
class CameraLens {
public:
    /// Throws: std::invalid_argument for a camera without pixels, and for numbers that no lens has.
    explicit CameraLens(const Camera& camera);

    /// The unit ray through a position that is counted from the corner of the first stored pixel, and its derivatives by pixels.
    std::optional<RayJets> ray(double x, double y) const;
    /// The same without derivatives, in less time.
    std::optional<Eigen::Vector3d> direction(double x, double y) const;

    /// The position in which a direction is seen.
    std::optional<Eigen::Vector2d> pixel(const Eigen::Vector3d& direction) const;

    /// A ray's part along the view axis.
    double ahead(const Eigen::Vector3d& ray) const { return to_view_.z() * ray.z(); }

    /// The part of such an image that lies beyond a fold within 90 degrees of the axis; 0 without one.
    double part_beyond_fold(int width, int height) const;
    /// Where it folds, and by which coefficient: "folds 41 degrees from its axis …".
    std::string fold_words() const;

    /// Throws: std::invalid_argument where the lens folds within 90 degrees of its axis, and more than half of such an image lies
    /// beyond. A fisheye's circle may cover less.
    void require_unfolded(int width, int height) const;

    /// Radians that a pixel on the axis is wide, and high.
    Eigen::Vector2d pixel_on_axis() const;

    const Laws& laws() const { return laws_; }
    LensLaw law() const { return model_.law; }

    /// Pixels of a whole turn of a panorama; 0 for other lenses.
    double turn() const { return turn_; }

private:
    LensModel model_;
    Laws laws_;
    Eigen::Vector3d to_view_; ///< signs of the axes, from X right, Y down, Z ahead and back
    double down_ = 1;         ///< −1 where stored rows go up
    double first_ = 0;        ///< the top of the image, as stored rows count it
    double turn_ = 0;         ///< pixels of a whole turn of a panorama; 0 for other lenses
    double width_;
};

} // namespace fathom::lens
