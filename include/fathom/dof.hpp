#pragma once

#include <fathom/dof_masks.hpp>
#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/lens.hpp>
#include <fathom/quality.hpp>

#include <optional>
#include <variant>

namespace fathom {
#pragma GCC visibility push(default)

/// Shape of the aperture, inscribed in the circle of confusion.
struct Aperture {
    int blades = 0;              ///< corners of a regular polygon, 3 to 64; 0: a circle
    double rotation_degrees = 0; ///< counter-clockwise as seen behind the focus; at 0 a corner is on top
    /// Without blades: height over width of an ellipse before it is turned, 0.1 to 10, as anamorphic lenses have it. Its longer
    /// axis is the circle of confusion.
    double ratio = 1;
};

/// The same view without its near objects: same camera, same size. It shows what a blurred foreground hides.
struct CleanPlate {
    Image color; ///< as many channels as the picture's; of any type that a picture may have
    StoredDepth depth;
};

struct DofOptions {
    Aperture aperture = {};
    /// How finely circles and the aperture are resolved. `accurate` also keeps which part of the lens an edge leaves open at a
    /// pixel, and continues the surface behind the edge.
    /// Or a root mean square error of colours from 0 to 1.
    std::variant<Quality, MaxError> quality = Quality::balanced;
    Sky sky = Sky::blur;
    double max_coc_px = 512; ///< circles are clamped to ± this; 1 to 512
    /// Where it lies farther than the picture, by more than two layers, it shows what the picture hides.
    std::optional<CleanPlate> clean_plate = {};
};

/// Halo in pixels, added to half the max CoC (accurate: one and a half times it, and a pixel), that makes a tile bit-identical
/// to the full frame.
inline constexpr int dof_halo_columns = 96, dof_halo_rows = 32;

/// Error of a blurred straight edge, as a fraction of the step between two plain colours: at the worst pixel, and as the root
/// of the mean square over the pixels that the edge's circle covers. Balanced and accurate keep it for an edge within one
/// surface and for one surface before another, with circles of 2 to 256 pixels. Accurate also keeps it where one edge
/// occludes another, with circles of 2 to 64 pixels.
inline constexpr double dof_edge_error = 0.01;
inline constexpr double dof_edge_rms_error = 0.003;

/// Through `brown` a circle's picture is an ellipse of another size in each part of the image, and `dof` draws the circle of the axis.
/// It takes lenses whose `circle_deformation` is at most this. An edge is then off by up to 0.32 times that more.
inline constexpr double dof_shape_error = 0.15;

/// Depth of field: what a lens of a finite aperture makes of a sharp image.
///
/// In: RGB, or RGBA with the alpha multiplied in, as floats, halves, or 16 or 8 bits that count from 0 to 1; one stored depth
/// a pixel; and the lens as `circle_of_confusion` gives it. Out: the same size and type.
///
/// Every pixel's light is spread over its circle of confusion, nearer over farther. Beyond the image's border the picture is
/// taken to go on as it is inside. Where a blurred foreground hides a sharper surface, the clean plate shows it. Without a
/// clean plate `dof` guesses: the mean of the sharper surfaces behind, within the foreground's circle. `accurate` continues
/// the nearest pixel that lies behind instead.
///
/// A pixel keeps its colour bit for bit if its circle is at most one pixel and no other circle reaches it, or if k = g = 0.
/// Invalid pixels, and colours that are no numbers up to 1e30, take part in nothing. They show what reaches them, and keep
/// their own colour if nothing does. Same bits for any vector width or group size, and in a region but near its border:
/// `dof_halo_columns`.
/// Accuracy: `dof_edge_error`, `dof_edge_rms_error` for one edge. Balanced is not exact where one edge occludes another: the
/// error is up to a third of the colour step. Accurate is exact there if a single edge cuts the lens and the surface behind
/// goes on as it is seen beside the edge. Several edges are approximate, and a surface behind a second edge is not continued.
/// `inexact::dof_error` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for options out of range and images that do not fit; Error from the device.
/// Source: thin lens, Potmesil and Chakravarty 1981; layers by circle of confusion, Scofield 1992, Kraus and Strengert 2007;
/// the alpha of a layer and the colour of a hidden surface as derived in docs/depth-of-field.md.
Image dof(const StoredDepth& stored, const Image& color, const CircleOfConfusion& circle,
          const DofOptions& options = {}, const Launch& launch = {});

/// The same into an image of the caller's: of the color's size, type and channels, with any row stride. It shares no memory
/// with an input.
void dof(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& circle,
         const DofOptions& options = {}, const Launch& launch = {});

#pragma GCC visibility pop
} // namespace fathom
