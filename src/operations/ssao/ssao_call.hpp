#pragma once

#include "operations/bands.hpp"
#include "operations/ssao/ssao_method.hpp"
#include "params.h"
#include "runtime/scratch.hpp"
#include "runtime/table.hpp"

#include <fathom/image.hpp>
#include <fathom/ssao.hpp>
#include <fathom/tiles.hpp>

#include <array>
#include <memory>
#include <vector>

namespace fathom {

/// What lies between the passes, besides the planes.
struct PassBytes {
    std::size_t band;   ///< Inverse depth and the slices' sums are made in bands of rows that take at most so much.
    std::size_t shared; ///< Inverse depth that takes no more than this is made once for all passes that read it.
};

/// Is inverse depth made once for several passes? Not if it takes so much memory that each had better make its own.
bool shares_depth(int width, int height, const SsaoOptions& options, const PassBytes& bytes);

/// Rows of sums that are kept at a time: a power of two.
std::size_t rows_of_sums(std::size_t all, std::size_t row_bytes, const PassBytes& bytes);

/// Of a lattice of all pixels, or of every second one.
int longest_side_of(const Tile& tile, int every);

/// A slice table on the device.
struct DeviceSlices {
    static constexpr const char* name = "slices";
    SliceTable sizes; // without its values
    runtime::Table taps, turns, counts;

    std::size_t bytes() const { return 4 * static_cast<std::size_t>(taps.count + turns.count + counts.count); }
};

/// Depth on a face of a lens, where it differs from depth as it is stored.
struct OnFace {
    InverseDepthError error;
    Image depth;  ///< as inverse_depth() makes it
    Image blocks; ///< Of the face's whole image: which are needed, see kernels/faces/face_blocks.cl.
    int columns;  ///< of them
};

/// What the bands of a call share.
struct Workspace {
    runtime::Scratch scratch;
    PassBytes bytes;
    const StoredDepth& whole;    ///< whose sides the tables are made for
    const OnFace* face;          ///< if there is one
    std::array<Image, 3> planes; ///< fronts, backs and slopes, in turn of all pixels and of those at half resolution
};

/// One pass's camera, pixels and constants, and where its images come from.
struct Call {
    Workspace& workspace;
    const StoredDepth& stored;
    double radius;
    const SsaoOptions& options;
    const Device& device;
    CentreRays rays;
    PixelLattice lattice;
    params::split_params split;
    Counts chosen;
    std::shared_ptr<const DeviceSlices> table;
    params::occlusion_params occlusion;
    runtime::Scratch scratch;
    Image blocks;                ///< what each block is computed at; any table as long as the call works for all pixels
    params::block_params work{}; ///< which blocks this call works for: all, unless it is told

    Call(const StoredDepth& depth, double length, const SsaoOptions& asked, Workspace& shared);

    params::occlusion_params parameters(const PixelLattice& pixels) const;
    runtime::Kernel& kernel(const char* name, runtime::Defines defines, const char* program = "") const;
    std::size_t vectors(params::u32 columns) const;

    /// Works for the blocks that have this word, and for a margin around them.
    void work_for(const Image& words, params::block_params chosen, params::u32 wanted, params::u32 margin);

    /// Rows of all planes.
    Layout layout_of_rows(std::size_t count) const { return {static_cast<int>(split.stride), static_cast<int>(count)}; }
};

StoredDepth part_of(const StoredDepth& stored, const Region& rows);

/// Inverse depth of some rows, which begins with row `top` of the image.
struct DepthRows {
    Image image;
    int top;
};

/// Those of the whole image, if that is there already.
DepthRows depth_of(const Call& call, runtime::Scratch& scratch, const Image& whole, const Region& rows);

/// Bands for a pass that reads inverse depth; one where all of it is there already.
std::vector<Band> depth_bands(const Call& call, const Image& whole, int count, int halo, int rows_each);

/// What the filter and the upsampling make: OUTPUT of their kernels.
enum class Output { visibility, confidence, bent_normal };

int channels_of(Output output);

/// What is asked for, and where it goes.
struct Wanted {
    Output output;
    Image image;
};

/// Where the result of the filter goes: the region's columns, from its first row on.
params::grid_params result_grid(const Image& target, const Region& region);

struct Planes {
    Image fronts, backs, slopes;
};

/// The planes of the whole image. `depth` is its inverse depth, if that is there already.
Planes split_into_planes(Call& call, const Image& depth);

/// The slices of a region's pixels, and the means of their sums, in bands of rows of the planes.
void add_up(Call& call, const Planes& planes, const std::vector<Wanted>& results, const Region& region);

/// The passes over a depth image, or over a band of one.
void occlude(Workspace& workspace, const StoredDepth& stored, double radius, const SsaoOptions& options,
             const std::vector<Wanted>& results);

/// The same in bands, as the device's budget asks.
void occlude_in_bands(const StoredDepth& stored, double radius, const SsaoOptions& options,
                      const std::vector<Wanted>& results, const OnFace* face = nullptr);

/// Do two cameras see along the same rays through their lenses?
bool same_lens(const Camera& a, const Camera& b);

/// Occlusion through a lens: by pinholes that see a block of the image each. Waits for the device.
/// Throws: Error where the device's budget is too small.
void occlude_through_lens(const StoredDepth& stored, double radius, const SsaoOptions& options,
                          const std::vector<Wanted>& results);

/// The most bytes that this takes for itself, however near surfaces come.
std::size_t bytes_through_lens(const Tile& tile, const SsaoOptions& options);

/// The blocks of an image, if it has any, and those of them that are computed at all pixels.
struct WholeBlocks {
    Image words = {};
    params::block_params chosen{};
};

/// How thick what each pixel of the depth's image shows is taken to be, from the width of its silhouette: one float, scene units.
/// With half resolution, and where no block is computed at all pixels, it is that of every second pixel of every second row alone.
/// `depth`: inverse depth with its margins. What is no surface has some thickness, too.
Image silhouette_thickness(runtime::Scratch& scratch, const Image& depth, const Tile& stored, bool perspective,
                           const params::occlusion_params& occlusion, const Sampling& sampling,
                           const WholeBlocks& blocks);

} // namespace fathom
