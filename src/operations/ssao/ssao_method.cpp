// What the options of ssao mean for its passes.

#include "operations/ssao/ssao_method.hpp"

#include "operations/parameters.hpp"
#include "operations/ssao/pixel_lattice.hpp"

namespace fathom {

Counts counts_of(const Sampling& sampling) {
    constexpr Counts of_quality[] = {{1, 6, 16, 1}, {1, 32, 16, 1}, {4, 30, 4, 2}};
    Counts chosen = of_quality[static_cast<int>(sampling.quality)];
    chosen.slices = sampling.slices.value_or(chosen.slices);
    chosen.samples = sampling.samples.value_or(chosen.samples);
    chosen.jitter = sampling.jitter.value_or(chosen.jitter);
    chosen.growth = sampling.growth.value_or(chosen.growth);
    return chosen;
}

const HalfResolution& half_of(Quality quality) {
    static constexpr HalfResolution of_quality[] = {
        {1, 22, 16, 2.3, 48, 48}, {2, 26, 16, 3, 128, 192}, {3, 66, 16, 2, 64, 192}};
    return of_quality[static_cast<int>(quality)];
}

bool chooses_blocks(const Tile& tile, const SsaoOptions& options) {
    const PixelLattice half = pixel_lattice(tile, 2);
    const Sampling& sampling = sampling_of(options);
    return !sampling.half_resolution && !sampling.slices && !sampling.samples && !sampling.growth && !sampling.jitter &&
           half.width > 0 && half.height > 0;
}

SsaoOptions half_options(const SsaoOptions& options) {
    SsaoOptions few = options;
    Sampling& sampling = std::get<Sampling>(few.sampling);
    sampling.half_resolution = true;
    const HalfResolution& half = half_of(sampling.quality);
    sampling.slices = half.slices;
    sampling.samples = half.samples;
    sampling.jitter = half.jitter;
    sampling.growth = half.growth;
    return few;
}

std::vector<int> passes_of(const Tile& tile, const SsaoOptions& options) {
    if (chooses_blocks(tile, options))
        return {1, 2};
    return {is_half(options) ? 2 : 1};
}

int sums_of(const SsaoOptions& options) {
    return options.bent_normal ? 6 : options.confidence ? 3 : 2;
}

bool fits_normals(const Tile& tile, const SsaoOptions& options) {
    return !options.normals && (options.tolerance > 1 || is_coarse(tile));
}

bool has_slopes(const SsaoOptions& options) {
    return options.normals && options.normals.channels() == 1;
}

Region region_of(const StoredDepth& stored, const SsaoOptions& options) {
    return options.region.value_or(Region{0, 0, stored.image.width(), stored.image.height()});
}

} // namespace fathom
