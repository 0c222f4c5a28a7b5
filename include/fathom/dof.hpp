#pragma once

#include <fathom/dof_masks.hpp>
#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/lens.hpp>
#include <fathom/quality.hpp>

#include <optional>

namespace fathom {

/// The hole that light comes through, inscribed in the circle of confusion.
struct Aperture {
    int blades = 0;              ///< corners of a regular polygon, 3 to 64; 0: a circle
    double rotation_degrees = 0; ///< counter-clockwise as seen behind the focus; at 0 a corner is on top
    /// Of no polygon: height over width before it is turned, 0.1 to 10, of an ellipse whose longer axis is the circle of
    /// confusion, as anamorphic lenses have them.
    double ratio = 1;
};

/// What a picture would show without what is near: through the same lens and camera, of the picture's size.
struct CleanPlate {
    Image color; ///< as many channels as the picture's; of any type that a picture may have
    StoredDepth depth;
};

struct DofOptions {
    Aperture aperture = {};
    /// How finely circles are told apart and how finely the aperture is drawn. `accurate` also keeps which part of the lens
    /// is left at a pixel, and continues what lies behind an edge.
    Quality quality = Quality::balanced;
    /// Instead of it: the root mean square error of colours from 0 to 1 that the choice may have in the scenes of
    /// docs/performance.md, and the cheapest that has no more is taken (`cheapest_method` of choice.hpp).
    std::optional<double> max_error = {};
    Sky sky = Sky::blur;
    double max_coc_px = 512; ///< circles are clamped to ± this; 1 to 512
    /// Where it lies farther than the picture, by more than two slices, it is what the picture hides.
    std::optional<CleanPlate> clean_plate = {};
};

/// What a region needs on every side, besides half the max CoC (accurate: one and a half and a pixel), to have the
/// bits of the whole within.
inline constexpr int dof_halo_columns = 96, dof_halo_rows = 32;

/// What the balanced and the accurate quality's blur differs from the lens's by, as a share of the step between two plain
/// colours: a straight edge in one surface or of one before another, circles of 2 to 256 pixels, at its worst pixel and as
/// the root of the mean square over the pixels that the edge's circle covers. The accurate quality's also where the edge lies
/// before an edge behind it, with circles of 2 to 64 pixels.
inline constexpr double dof_edge_error = 0.01;
inline constexpr double dof_edge_rms_error = 0.003;

/// Depth of field: what a lens of a finite aperture makes of a sharp image.
///
/// In: RGB, or RGBA with the alpha multiplied in, as floats, halves, or 16 or 8 bits that count from 0 to 1; one stored depth
/// a pixel; and the lens as `circle_of_confusion` gives it. Out: the same size and type.
///
/// Every pixel's light is spread over its circle of confusion, nearer over farther. What lies beyond the image's border is taken
/// to be like what lies inside. Where a blurred foreground hides what is sharper, the clean plate shows it; without a clean
/// plate it is taken to be like the mean of what lies behind and is sharper within the foreground's circle. In the accurate
/// quality what any edge hides is the clean plate's, or like the nearest pixel that lies behind. A pixel whose circle is at most
/// one pixel, and that no other's reaches, keeps its colour, as do all with a circle of k = g = 0, bit for bit. What is no
/// surface, or has a colour that is no number up to 1e30, takes part in nothing and shows what reaches it: NaN where nothing
/// does (0 in integers). Same bits for any lane count or group size, and in a region but near its border: `dof_halo_columns`.
/// Accuracy: `dof_edge_error`, `dof_edge_rms_error` for one edge. Balanced not where an edge before another hides a part of it
/// that has another colour: which part that is, shares of a layer do not tell, and it is off by up to a third of the step.
/// Accurate there too, where one edge is all that the lens is cut by and what lies behind goes on
/// as it is seen beside the edge. What is left of the lens beside or between several edges is told by its share and its
/// first moment only, and what is hidden behind a second edge is not continued.
/// Throws: std::invalid_argument for options out of range and images that do not fit; Error from the device.
/// Source: thin lens, Potmesil and Chakravarty 1981; layers by circle of confusion, Scofield 1992, Kraus and Strengert 2007;
/// the share of a layer and the colour of what is hidden as derived in docs/depth-of-field.md.
Image dof(const StoredDepth& stored, const Image& color, const CircleOfConfusion& coc, const DofOptions& options = {},
          const Launch& launch = {});

/// The same into an image of the caller's: of the color's size, type and channels, with any row stride. It shares no memory
/// with an input.
void dof(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
         const DofOptions& options = {}, const Launch& launch = {});

} // namespace fathom
