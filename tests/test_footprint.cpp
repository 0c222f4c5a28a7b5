// NaN and infinity in an input of every operation touch only the pixels that can see them: the others have the same bits. How
// far a pixel sees is what `reach` says, and for ssao less.
#include "catch.hpp"
#include "images.hpp"

#include <fathom/fathom.hpp>
#include <fathom/relative.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

using namespace fathom;
using images::same_bits;

namespace {

constexpr int width = 307, height = 300; // more than twice what the widest footprint needs
constexpr double nearest = 4, radius = 0.3;

Camera camera() {
    Camera camera;
    camera.projection = perspective(1.0, 1.0 * width / height, {0.5, 100});
    camera.width = width;
    camera.height = height;
    camera.encoding = Encoding::view_z;
    camera.view = Eigen::Matrix4d::Identity();
    return camera;
}

struct Inputs {
    std::vector<float> depth, color;

    Inputs() {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool is_smooth = y >= 128; // as blocks at half resolution are
                const double hills = nearest + 0.2 + (is_smooth ? 0.01 : 0.2) * std::sin(0.11 * x) * std::cos(0.07 * y);
                depth.push_back(static_cast<float>(is_smooth || x % 60 < 40 ? hills : hills + 2));
                for (int channel = 0; channel < 3; ++channel)
                    color.push_back(static_cast<float>((7 * x + 5 * y + 3 * channel) % 32) / 32);
            }
    }
};

/// What an operation makes of the inputs: all its images, pixel by pixel.
using Operation = std::function<std::vector<Image>(const StoredDepth&, const Image& color)>;

struct Subject {
    std::string name;
    Reach footprint; ///< on either side
    Operation run;
    bool takes_color = false;
    Camera seen_by = camera();
};

std::vector<std::vector<float>> results(const Device& device, const Inputs& inputs, const Operation& run,
                                        const Camera& seen_by = camera()) {
    const Layout size{width, height, 1}, color_size{width, height, 3};
    const StoredDepth stored{Image::from_host(device, Element::f32, inputs.depth.data(), size), seen_by};
    std::vector<std::vector<float>> all;
    for (const Image& image : run(stored, Image::from_host(device, Element::f32, inputs.color.data(), color_size)))
        all.push_back(images::floats(image));
    return all;
}

/// Where special values are put: alone, in a pair, and in a corner of the image.
constexpr std::array<std::array<int, 2>, 5> places{{{154, 150}, {155, 150}, {130, 155}, {170, 70}, {0, 0}}};

/// How far a change went beyond the footprints, and how far it went.
struct Changes {
    int columns = 0, rows = 0;
    long changed = 0, beyond = 0; // pixels of all images
};

Changes changes_of(const Subject& subject, const std::vector<std::vector<float>>& before,
                   const std::vector<std::vector<float>>& after) {
    Changes found;
    REQUIRE(before.size() == after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
        const std::size_t pixel = before[i].size() / (width * height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const std::size_t at = static_cast<std::size_t>(y * width + x) * pixel;
                bool same = true;
                for (std::size_t c = 0; c < pixel; ++c)
                    same &= same_bits(before[i][at + c], after[i][at + c]);
                if (same)
                    continue;
                ++found.changed;
                bool within = false;
                int columns = width, rows = height; // of the nearest place
                for (const auto& [column, row] : places) {
                    const int aside = std::abs(x - column), above = std::abs(y - row);
                    within |= aside <= subject.footprint.columns && above <= subject.footprint.rows;
                    if (std::max(aside, above) < std::max(columns, rows)) {
                        columns = aside;
                        rows = above;
                    }
                }
                found.beyond += !within;
                found.columns = std::max(found.columns, columns);
                found.rows = std::max(found.rows, rows);
            }
    }
    return found;
}

/// Metric depth is metres. Of the others every value between 0 and 1 is a depth.
Inputs inputs_for(const Camera& camera) {
    Inputs inputs;
    if (camera.encoding != Encoding::view_z && camera.encoding != Encoding::ray_distance)
        for (float& value : inputs.depth)
            value /= 16;
    return inputs;
}

void check(const std::vector<Subject>& subjects) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (const int vector_width : {1, 4, 8, 16}) {
        const Device device = Device::open("cpu", {.vector_width = vector_width});
        for (const Subject& subject : subjects) {
            const Inputs whole = inputs_for(subject.seen_by);
            const auto before = results(device, whole, subject.run, subject.seen_by);
            Changes most;
            for (const float special : {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity})
                for (const bool of_depth : {true, false}) {
                    if (!of_depth && !subject.takes_color)
                        continue;
                    Inputs inputs = whole;
                    for (const auto& [x, y] : places)
                        if (const auto at = static_cast<std::size_t>(y * width + x); of_depth)
                            inputs.depth[at] = special;
                        else
                            inputs.color[3 * at + at % 3] = special; // the places have all three channels
                    const Changes found =
                        changes_of(subject, before, results(device, inputs, subject.run, subject.seen_by));
                    INFO(subject.name << ", " << special << " in " << (of_depth ? "depth" : "color") << ", "
                                      << vector_width << " pixels a work-item: as far as " << found.columns
                                      << " columns, " << found.rows << " rows");
                    CHECK(found.changed > 0);
                    CHECK(found.beyond == 0);
                    most.columns = std::max(most.columns, found.columns);
                    most.rows = std::max(most.rows, found.rows);
                }
            if (vector_width == 16)
                std::cout << "  " << subject.name << ": NaN and infinity reach " << most.columns << " columns and "
                          << most.rows << " rows; the footprint has " << subject.footprint.columns << " and "
                          << subject.footprint.rows << "\n";
        }
    }
}

/// Pixels that a length has at the nearest surface.
int pixels_of(double length) {
    return static_cast<int>(std::ceil(length / nearest * height / (2 * std::tan(0.5))));
}

Tile tile(const Camera& seen_by = camera()) {
    return {seen_by, Storage::float32, {0, 0, width, height}};
}

} // namespace

TEST_CASE("footprint: NaN and infinity touch nothing but what can see them") {
    check(
        {{"linearize", reach(tile(), LinearizeOptions{}),
          [](const StoredDepth& depth, const Image&) { return std::vector{linearize(depth).image}; }},
         {"unproject", reach(tile(), UnprojectOptions{}),
          [](const StoredDepth& depth, const Image&) { return std::vector{unproject(depth)}; }},
         {"fog", reach(tile(), FogOptions{.density = 0.1}),
          [](const StoredDepth& depth, const Image& color) { return std::vector{fog(depth, color, {.density = 0.1})}; },
          true},
         {"fog, thinner with the height", reach(tile(), FogOptions{.density = 0.1}),
          [](const StoredDepth& depth, const Image& color) {
              return std::vector{fog(depth, color, {.density = 0.1, .height_falloff = 0.2})};
          },
          true},
         {"normals of neighbours", reach(tile(), NormalsOptions{.method = NormalMethod::neighbours}),
          [](const StoredDepth& depth, const Image&) {
              return std::vector{normals(depth, {.method = NormalMethod::neighbours})};
          }},
         {"normals of least squares", reach(tile(), NormalsOptions{.method = NormalMethod::least_squares}),
          [](const StoredDepth& depth, const Image&) {
              return std::vector{normals(depth, {.method = NormalMethod::least_squares})};
          }}});
}

TEST_CASE("footprint: NaN and infinity touch nothing but what can see them, of operations that look far", "[slow]") {
    constexpr double lens_px = 12; // the largest circle
    constexpr CircleOfConfusion lens{40, 180};
    constexpr double long_radius = 0.8; // 50 pixels and more: `fast` has blocks at half resolution
    const int rays = pixels_of(radius) + 16, given_rays = rays + normals_reach_neighbours,
              block_rays = std::max(ssao_block_halo, pixels_of(long_radius) + 16);
    const auto visibility = [](const StoredDepth& depth, std::optional<bool> half) {
        return std::vector{
            ssao(depth, long_radius, {.sampling = Sampling{.quality = Quality::fast, .half_resolution = half}})
                .visibility};
    };
    const auto of_inputs = [&](std::optional<bool> half) {
        return results(Device::open("cpu"), Inputs(),
                       [&](const StoredDepth& depth, const Image&) { return visibility(depth, half); });
    };
    const bool blocks_differ = of_inputs({}) != of_inputs(false);
    CHECK(blocks_differ);
    std::vector<Subject> subjects{
        {"normals of a noisy sensor", reach(tile(), NormalsOptions{.noise = 1e-3}),
         [](const StoredDepth& depth, const Image&) { return std::vector{normals(depth, {.noise = 1e-3})}; }},
        {"ssao",
         {rays, rays},
         [](const StoredDepth& depth, const Image&) {
             const Occlusion all =
                 ssao(depth, radius,
                      {.sampling = Sampling{.half_resolution = false}, .bent_normal = true, .confidence = true});
             return std::vector{all.visibility, all.bent_normal, all.confidence};
         }},
        {"ssao in half resolution where it is worth it",
         {block_rays, block_rays},
         [=](const StoredDepth& depth, const Image&) { return visibility(depth, {}); }},
        {"ssao in half resolution",
         {block_rays, block_rays},
         [=](const StoredDepth& depth, const Image&) { return visibility(depth, true); }},
        {"ssao with normals, a second layer of depth and a map of thicknesses",
         {given_rays, given_rays},
         [](const StoredDepth& depth, const Image&) {
             const Image given = normals(depth, {.method = NormalMethod::neighbours}), z = linearize(depth).image;
             return std::vector{
                 ssao(depth, radius,
                      {.sampling = Sampling{.half_resolution = false}, .thickness = depth, .normals = given})
                     .visibility,
                 ssao(depth, radius, {.sampling = Sampling{.half_resolution = false}, .thickness = z, .normals = given})
                     .visibility};
         }}};
    // The masks of discs, and the means along an axis that tell mixed pixels.
    const DofMasksOptions masks{.max_coc_px = lens_px,
                                .near_weight = true,
                                .focus_weight = true,
                                .far_weight = true,
                                .max_near_coc = true,
                                .near_alpha = true,
                                .disocclusion = true,
                                .mixed_pixels = true};
    subjects.push_back({"dof_masks", reach(tile(), masks), [=](const StoredDepth& depth, const Image&) {
                            const DofMasks all = dof_masks(depth, lens, masks);
                            return std::vector{all.coc,          all.near_weight, all.focus_weight, all.far_weight,
                                               all.max_near_coc, all.near_alpha,  all.disocclusion, all.mixed_pixels};
                        }});
    for (const auto& [name, quality] : {std::pair{"dof fast", Quality::fast},
                                        {"dof balanced", Quality::balanced},
                                        {"dof accurate", Quality::accurate}}) {
        for (const bool plated : {false, true}) {
            const DofOptions blur{.quality = quality, .max_coc_px = lens_px};
            subjects.push_back({std::string(name) + (plated ? " with a clean plate" : ""), reach(tile(), blur),
                                [=](const StoredDepth& depth, const Image& color) {
                                    DofOptions asked = blur;
                                    if (plated)
                                        asked.clean_plate = CleanPlate{color, depth};
                                    return std::vector{dof(depth, color, lens, asked)};
                                },
                                true});
        }
    }
    check(subjects);
}

TEST_CASE("footprint: NaN and infinity touch nothing but what can see them, however depth is stored") {
    std::vector<Subject> subjects;
    const auto add = [&](const std::string& name, const Camera& seen_by) {
        subjects.push_back({"linearize, " + name,
                            {},
                            [](const StoredDepth& depth, const Image&) { return std::vector{linearize(depth).image}; },
                            false,
                            seen_by});
        subjects.push_back({"unproject, " + name,
                            {},
                            [](const StoredDepth& depth, const Image&) { return std::vector{unproject(depth)}; },
                            false,
                            seen_by});
        subjects.push_back(
            {"normals, " + name, reach(tile(seen_by), NormalsOptions{.method = NormalMethod::least_squares}),
             [](const StoredDepth& depth, const Image&) { return std::vector{normals(depth)}; }, false, seen_by});
    };
    for (const auto& [name, encoding] : {std::pair{"window", Encoding::window},
                                         {"ray distance", Encoding::ray_distance},
                                         {"linear", Encoding::linear},
                                         {"logarithmic", Encoding::logarithmic},
                                         {"exponential", Encoding::exponential},
                                         {"median", Encoding::median},
                                         {"inverse", Encoding::inverse},
                                         {"inverse range", Encoding::inverse_range}}) {
        Camera seen_by = camera();
        seen_by.encoding = encoding;
        seen_by.near_plane = 0.5;
        seen_by.far_plane = 100;
        seen_by.median = 5;
        add(name, seen_by);
    }
    Camera tilted = camera();
    tilted.encoding = Encoding::window;
    tilted.projection = with_oblique_near_plane(tilted.projection, Eigen::Vector4d(0.1, 0.2, -1, -0.6));
    add("oblique near plane", tilted);
    Camera parallel = camera();
    parallel.encoding = Encoding::window;
    parallel.projection = orthographic({-2, 2, -2, 2}, {0.5, 100});
    add("orthographic", parallel);
    const Camera relative = relative_camera(width, height, RelativeOrder::high_is_near);
    constexpr double lens_px = 12;
    const DofOptions blur{.quality = Quality::balanced, .max_coc_px = lens_px};
    subjects.push_back({"dof of relative depth", reach(tile(relative), blur),
                        [=](const StoredDepth& depth, const Image& color) {
                            const CircleOfConfusion lens = relative_circle(60, 0.3, RelativeOrder::high_is_near);
                            return std::vector{dof(depth, color, lens, blur)};
                        },
                        true, relative});
    check(subjects);
}
