#pragma once

#include <fathom/image.hpp>
#include <fathom/lens.hpp>
#include <fathom/projection.hpp>
#include <fathom/relative.hpp>

#include <array>
#include <functional>
#include <optional>
#include <string>

/// A lens as a caller gives it who has a camera with a lens of its own and an image to focus on.
namespace fathom {
#pragma GCC visibility push(default)

/// A lens of which some may be missing. The focus is said in one of three ways.
struct LensArguments {
    struct Pixel {
        int x, y; ///< of the image
    };
    struct AlongRay {
        Pixel pixel;
        double distance;
    };

    std::optional<double> focus = {};   ///< `Lens::focus`
    std::optional<Pixel> focus_at = {}; ///< the surface that this pixel shows, see `depth_at`
    std::optional<AlongRay> focus_along =
        {}; ///< the point at this distance along the pixel's ray, see `depth_along_ray`
    std::optional<double> f_stop = {}, focal_length_mm = {}, sensor_mm = {}; ///< those of `Lens`
    double mm_per_unit = 1000;
    std::optional<std::array<double, 2>> circle = {}; ///< k and g of a `CircleOfConfusion`, instead of a lens
    /// The depth has no unit, and these stand instead of a lens; `focus_at` may say the focus, too.
    std::optional<RelativeOrder> relative = {};
    std::optional<double> blur_px = {};                       ///< see `relative_circle`
    std::optional<std::array<double, 2>> focus_range = {};    ///< see `RelativeOptions`
    std::optional<std::array<double, 2>> relative_range = {}; ///< the same
};

/// What is done with depth before a blur.
struct DepthRepair {
    enum class Invalid { keep, fill };

    Invalid invalid = Invalid::keep; ///< see `fill_invalid`
    int grow_foreground = 0;         ///< see `grow_foreground`
};

/// How messages name the camera, and an option: `--f-stop` for f_stop.
struct LensWords {
    std::string camera = "the camera";
    std::function<std::string(const std::string& option)> option = [](const std::string& name) { return name; };
};

/// Takes what is not given from the camera.
/// Throws: std::invalid_argument, which names the option, for a lens that is still incomplete, or that says something in two
/// ways; for a default that no lens has; under a perspective for a focus within the focal length.
LensArguments completed(LensArguments lens, const LensDefaults& defaults, const Projection& projection,
                        const LensWords& words = {});

/// What is read of relative depth for such a lens.
/// Throws: std::invalid_argument for options that have no such value.
RelativeOptions relative_options(const LensArguments& lens);

/// The depth that a lens is focused on, along the view axis, scene units.
/// Throws: std::invalid_argument for a pixel outside the image, one without a depth, and a lens without a focus.
double focus_of(const LensArguments& lens, const StoredDepth& stored);

/// The circle of confusion of a complete lens for an image.
/// Relative depth is that of `relative_values`, under a `relative_camera`.
/// Throws: std::invalid_argument as `focus_of` and `circle_of_confusion`, and for a lens that says something in two ways.
CircleOfConfusion circle_for(const LensArguments& lens, const StoredDepth& stored);

/// The depth for a blur.
StoredDepth repaired(const StoredDepth& stored, const DepthRepair& repair);

#pragma GCC visibility pop
} // namespace fathom
