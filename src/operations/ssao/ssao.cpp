// Ambient occlusion from stored depth, in bands of rows. Here is what may be asked for, and what of it each band does.

#include <fathom/ssao.hpp>

#include "description/check.hpp"
#include "description/ssao.hpp"
#include "operations/cheapest.hpp"
#include "operations/parameters.hpp"
#include "operations/ssao/ssao_call.hpp"
#include "operations/ssao/ssao_method.hpp"
#include "operations/ssao/ssao_plan.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"

#include <algorithm>
#include <vector>

namespace fathom {
namespace {

void check_size(const Image& image, const StoredDepth& stored, const char* what) {
    check_device(stored, {what, image});
    const int width = stored.image.width(), height = stored.image.height();
    require(image.width() == width && image.height() == height, "the ", what, " are ",
            ImageSize{image.width(), image.height()}, " pixels, the depth ", ImageSize{width, height});
    require(image.element() == Element::f32, "the ", what, " must be floats");
}

// How far a second layer's rays may differ from the first's, relative to their length: other clip planes round them.
constexpr long double rays_rounding = 1e-6L;

bool same_rays(const StoredDepth& a, const StoredDepth& b) {
    if (a.camera.lens || b.camera.lens)
        return same_lens(a.camera, b.camera) && a.x == b.x && a.y == b.y;
    const CentreRays first = centre_rays(camera_rays(a.camera)), second = centre_rays(camera_rays(b.camera));
    const auto same = [](const auto& one, const auto& other) {
        return (one - other).norm() <= rays_rounding * one.norm();
    };
    return first.perspective == second.perspective && same(first.direction, second.direction) &&
           same(first.origin, second.origin) && a.x == b.x && a.y == b.y;
}

void check_sampling(const StoredDepth& stored, const Sampling& sampling) {
    if (sampling.half_resolution.value_or(false)) {
        const PixelLattice half = pixel_lattice(stored, 2);
        require(half.width > 0 && half.height > 0, "half_resolution looks from even columns and rows, and the depth's ",
                ImageSize{stored.image.width(), stored.image.height()}, " pixels at (", stored.x, ", ", stored.y,
                ") have none");
    }
}

void check_thickness(const StoredDepth& stored, const SsaoOptions& options) {
    if (const auto* map = thickness_as<Image>(options)) {
        require(static_cast<bool>(*map), "the thickness map has no image");
        check_size(*map, stored, "thicknesses");
        require(map->channels() == 1, "the thickness map must have one channel");
    }
    if (const auto* back = thickness_as<StoredDepth>(options)) {
        check_stored(*back);
        check_device(stored, {"the second layer", back->image});
        const ImageSize size{back->image.width(), back->image.height()};
        require(size.width == stored.image.width() && size.height == stored.image.height(), "the second layer is ",
                size, " pixels, the depth ", ImageSize{stored.image.width(), stored.image.height()});
        require(same_rays(stored, *back),
                "the second layer is seen along other rays than the depth: both need the same frustum and place in it, "
                "whatever their clip range and encoding");
    }
}

void check(const StoredDepth& stored, double radius, const SsaoOptions& options) {
    check_stored(stored);
    require<ImageTooLarge>(std::max(stored.image.width(), stored.image.height()) <= longest_side, "an image of ",
                           ImageSize{stored.image.width(), stored.image.height()}, " pixels: at most ", longest_side,
                           " in a row or column");
    description::Check{}("radius", radius, description::ssao_radius);
    describe(description::Check{}, options);
    if (const auto* sampling = std::get_if<Sampling>(&options.sampling))
        check_sampling(stored, *sampling);
    check_thickness(stored, options);
    require(
        !stored.camera.lens || options.border == Border::open,
        "border clamp repeats pixels along straight lines, and the camera has a lens, which bends them; leave it out");
    if (options.normals) {
        check_size(options.normals, stored, "normals");
        require(options.normals.channels() == 3 || options.normals.channels() == 4,
                "normals: channels = ", options.normals.channels(), " must be 3 or 4");
        require(options.normals_space == Space::view || stored.camera.view,
                "normals in the world need the camera's view matrix, and it has none");
    }
    if (options.region) {
        const auto& [x, y, region_width, region_height] = *options.region;
        static_cast<void>(stored.image.region(x, y, region_width, region_height)); // throws if it does not fit
    }
}

std::vector<Wanted> wanted(const SsaoOptions& options, const Occlusion& results) {
    std::vector<Wanted> all{{Output::visibility, results.visibility}};
    if (options.confidence)
        all.push_back({Output::confidence, results.confidence});
    if (options.bent_normal)
        all.push_back({Output::bent_normal, results.bent_normal});
    return all;
}

void check_results(const StoredDepth& stored, const Occlusion& given, const SsaoOptions& options) {
    const Image none;
    const auto* back = thickness_as<StoredDepth>(options);
    const auto* map = thickness_as<Image>(options);
    description::SsaoCall call{.options = options, .results = given};
    check_results(stored, description::results_of(call, stored),
                  {{"the second layer", back ? back->image : none},
                   {"the thickness map", map ? *map : none},
                   {"the normals", options.normals}});
}

} // namespace

void occlude_in_bands(const StoredDepth& stored, double radius, const SsaoOptions& options,
                      const std::vector<Wanted>& results, const OnFace* face) {
    const Region region = region_of(stored, options);
    const int width = stored.image.width();
    const SsaoPlan plan = ssao_plan(stored, radius, options);
    Workspace workspace{runtime::Scratch(stored.image.device()), plan.bytes, stored, face, {}};
    const std::size_t elements = plane_bytes(stored, options, most_read(plan.bands)) / sizeof(float);
    for (Image& plane : workspace.planes)
        plane = workspace.scratch.image(Element::f32, {static_cast<int>(elements), 1});
    for (const Band& band : plan.bands) {
        const Region rows{0, band.first, width, band.last - band.first};
        SsaoOptions here = options;
        here.region = Region{region.x, band.begin - band.first, region.width, band.end - band.begin};
        if (const auto* map = thickness_as<Image>(options))
            here.thickness = map->region(rows.x, rows.y, rows.width, rows.height);
        if (options.normals)
            here.normals = options.normals.region(rows.x, rows.y, rows.width, rows.height);
        if (const auto* back = thickness_as<StoredDepth>(options))
            here.thickness = part_of(*back, rows);
        std::vector<Wanted> wanted_here = results;
        for (Wanted& result : wanted_here)
            result.image = result.image.region(0, band.begin - region.y, region.width, band.end - band.begin);
        occlude(workspace, part_of(stored, rows), radius, here, wanted_here);
    }
}

void ssao(const StoredDepth& stored, const Occlusion& results, double radius, const SsaoOptions& options,
          const Launch& launch) {
    check(stored, radius, options);
    if (std::holds_alternative<MaxError>(options.sampling))
        return ssao(stored, results, radius, chosen(stored, options), launch);
    check_results(stored, results, options);
    const std::vector<Wanted> all_wanted = wanted(options, results);
    const runtime::Launched launched(stored.image.device(), launch);
    if (stored.camera.lens)
        occlude_through_lens(stored, radius, options, all_wanted);
    else
        occlude_in_bands(stored, radius, options, all_wanted);
    launched.done();
}

Occlusion ssao(const StoredDepth& stored, double radius, const SsaoOptions& options, const Launch& launch) {
    check(stored, radius, options);
    return run_into_new_images(description::SsaoCall{.radius = radius, .options = options}, stored, launch).results;
}

} // namespace fathom
