// A device with a memory budget: the bits of one without, in no more scratch memory than that; and a line that names the budget
// that is needed.

#include "catch.hpp"
#include "images.hpp"
#include "operations/bands.hpp"
#include "operations/ssao/ssao_reach.hpp"
#include "runtime/state.hpp"
#include "ssao_call.hpp"

#include <fathom/fathom.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using namespace fathom::images;

namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20;

Device device_with(std::size_t budget, int vector_width = 0) {
    return Device::open("cpu", {.vector_width = vector_width, .memory_budget = budget});
}

// The budget that an Error names, in bytes.
std::size_t named_budget(const std::string& message) {
    const std::string before = "needs a memory budget of ";
    const std::size_t at = message.find(before);
    REQUIRE(at != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
    return std::stoul(message.substr(at + before.size())) * mebibyte;
}

std::size_t needed(const std::function<void(const Device&)>& call) {
    try {
        call(device_with(1));
    } catch (const Error& error) {
        return named_budget(error.what());
    }
    return 0;
}

// Does a call give the same results with any budget, and keep to it? `images` are the call's results on a device.
void check_budgets(const std::string& name, const std::function<std::vector<Image>(const Device&)>& images,
                   std::initializer_list<int> vector_widths = {16}) {
    std::vector<std::vector<float>> whole;
    const Device free = device_with(0);
    for (const Image& image : images(free))
        whole.push_back(floats(image));
    const std::size_t taken = free.state().most_scratch_bytes;
    const std::size_t least = needed([&](const Device& device) { images(device); });
    std::printf("%s: %.1f MiB of scratch memory, with a budget at least %.0f MiB\n", name.c_str(),
                static_cast<double>(taken) / mebibyte, static_cast<double>(least) / mebibyte);
    REQUIRE(least > 0);
    CHECK(least < taken);
    if (least > mebibyte)
        CHECK(needed([&](const Device&) { images(device_with(least - mebibyte)); }) == least);
    for (const int vector_width : vector_widths) {
        for (const std::size_t budget :
             {least, least + least / 4, (least + 2 * taken) / 2, 4 * taken + 64 * mebibyte}) {
            const Device device = device_with(budget, vector_width);
            const std::vector<Image> got = images(device);
            INFO(name << ", a budget of " << budget << " bytes, vector width " << vector_width);
            REQUIRE(got.size() == whole.size());
            for (std::size_t i = 0; i < got.size(); ++i)
                CHECK(same_bits(floats(got[i]), whole[i]));
            CHECK(device.state().most_scratch_bytes <= budget);
            CHECK(device.state().scratch_bytes <= budget);
        }
    }
}

// Steps and slopes, a floor that comes near the camera, and single invalid pixels.
struct Scene {
    Camera camera;
    std::vector<float> depth, behind;
    std::vector<std::uint16_t> millimetres;

    Scene(int width, int height, bool perspective_camera = true) {
        camera.width = width;
        camera.height = height;
        camera.projection = perspective_camera
                                ? perspective(1.2, 1.2 * width / height, {0.1, 100})
                                : orthographic({-2, 2, -2.0 * height / width, 2.0 * height / width}, {0.1, 100});
        camera.encoding = Encoding::view_z;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const int step = x / 37 % 3 + y / 29 % 2 + (x / 51 + y / 97) % 4;
                const bool hole = (x * 31 + y * 17) % 997 == 0;
                const double z = 3.0 - 1.2 * y / height + 0.02 * step + 1e-4 * ((x * 7 + y * 13) % 11);
                depth.push_back(hole ? std::nanf("") : static_cast<float>(z));
                behind.push_back(static_cast<float>(z + 0.01 * (1 + x / 20 % 5)));
                millimetres.push_back(hole ? 0 : static_cast<std::uint16_t>(std::lround(1000 * z)));
            }
        }
    }

    StoredDepth stored(const Device& device) const {
        return {Image::from_host(device, Element::f32, depth.data(), {camera.width, camera.height}), camera};
    }
    StoredDepth second(const Device& device) const {
        return {Image::from_host(device, Element::f32, behind.data(), {camera.width, camera.height}), camera};
    }
    StoredDepth coarse(const Device& device) const {
        Camera scaled = camera;
        scaled.scale = 0.001;
        return {Image::from_host(device, Element::u16, millimetres.data(), {camera.width, camera.height}), scaled,
                Storage::uint16};
    }
};

std::vector<Image> images_of(const Occlusion& occlusion) {
    std::vector<Image> all{occlusion.visibility};
    for (const Image& image : {occlusion.confidence, occlusion.bent_normal})
        if (image)
            all.push_back(image);
    return all;
}

} // namespace

TEST_CASE("bands of rows that reach differently are of one height, and keep to their budget", "[bands][budget]") {
    const auto bytes = [](int read, int made) { return static_cast<std::size_t>(100 * read + 10 * made); };
    RowNeeds rows{10, 1010, 1100, {}, bytes, 64};
    for (int row = rows.begin; row < rows.end; ++row)
        rows.reaches.push_back(5 + row / 20);
    for (const std::size_t budget : {std::size_t{27000}, std::size_t{40000}, std::size_t{60000}, std::size_t{200000}}) {
        const std::vector<Band> all = bands(rows, budget, "this");
        int made = rows.begin;
        for (const Band& band : all) {
            REQUIRE(band.begin == made);
            made = band.end;
            CHECK((band.end == rows.end || band.end - band.begin == all[0].end - all[0].begin));
            CHECK(bytes(band.last - band.first, band.end - band.begin) <= budget);
            int first = rows.height, last = 0;
            for (int row = band.begin; row < band.end; ++row) {
                const int reach = rows.reaches[static_cast<std::size_t>(row - rows.begin)];
                first = std::min(first, std::max(row - reach, 0));
                last = std::max(last, std::min(row + reach + 1, rows.height));
            }
            CHECK(std::pair(band.first, band.last) == std::pair(first, last));
        }
        CHECK(made == rows.end);
    }
    std::string message;
    try {
        bands(rows, 1000, "this");
    } catch (const Error& error) {
        message = error.what();
    }
    CHECK(message == "this needs a memory budget of 1 MiB, and has less than 1; raise it");
}

// The oracle: points of the sphere, projected.
TEST_CASE("ssao: a sphere covers the rows that it is said to", "[ssao][budget]") {
    const Camera cameras[] = {Scene(200, 300).camera, Scene(200, 300, false).camera};
    std::minstd_rand random(7);
    const auto number = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::minstd_rand::max());
    };
    double tightest = 1;
    for (const Camera& camera : cameras) {
        const CentreRays rays = centre_rays(camera_rays(camera));
        const Eigen::Matrix<double, 3, 3> direction = rays.direction.cast<double>(),
                                          origin = rays.origin.cast<double>();
        // The pixel of a point: it is where its ray's and the point's cross product is nothing.
        const auto row_of = [&](const Eigen::Vector3d& point) {
            Eigen::Matrix3d columns;
            if (rays.perspective)
                columns = direction;
            else
                columns << origin.col(0), origin.col(1), direction.col(2);
            const Eigen::Vector3d pixel =
                columns.inverse() * (rays.perspective ? point : Eigen::Vector3d(point - origin.col(2)));
            return rays.perspective ? pixel.y() / pixel.z() : pixel.y();
        };
        for (int n = 0; n < 40; ++n) {
            const Eigen::Vector3d pixel(number(0, 200), number(0, 300), 1);
            const double w = number(1, 5), radius = number(0.01, 0.8);
            const Eigen::Vector3d centre = rays.perspective ? Eigen::Vector3d(direction * pixel * w)
                                                            : Eigen::Vector3d(origin * pixel + direction.col(2) * w);
            const double rows = rows_of_sphere(rays, radius, pixel.y(), rays.perspective ? 1 / w : -w);
            double most = 0;
            for (int i = 0; i < 360; ++i) {
                for (int j = 0; j <= 180; ++j) {
                    const double a = std::numbers::pi * i / 180, b = std::numbers::pi * j / 180;
                    const Eigen::Vector3d point =
                        centre +
                        radius * Eigen::Vector3d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
                    most = std::max(most, std::abs(row_of(point) - pixel.y()));
                }
            }
            CHECK(most <= rows * (1 + 1e-9));
            tightest = std::min(tightest, most / rows);
        }
    }
    std::printf("a sphere's rows: the farthest point lies at %.4f of them at least\n", tightest);
    CHECK(tightest > 0.999);
    const CentreRays rays = centre_rays(camera_rays(cameras[0]));
    CHECK(std::isinf(rows_of_sphere(rays, 2, 150, 1)));
}

TEST_CASE("ssao: a budget keeps the bits", "[ssao][budget][exhaustive]") {
    const Scene scene(401, 1803), parallel(401, 1803, false);
    std::vector<std::pair<std::string, std::function<std::vector<Image>(const Device&)>>> calls;
    const auto add = [&](const char* name, const SsaoCall& options, const Scene& of) {
        calls.emplace_back(
            name, [options, &of](const Device& device) { return images_of(ssao(of.stored(device), options)); });
    };
    SsaoCall call;
    call.radius = 0.06;
    for (const auto& [quality, name] :
         {std::pair{Quality::fast, "fast"}, {Quality::balanced, "balanced"}, {Quality::accurate, "accurate"}}) {
        sampling_of(call).quality = quality;
        add(name, call, scene);
    }
    sampling_of(call).quality = Quality::fast;
    call.confidence = call.bent_normal = true;
    add("fast, with a bent normal and confidence", call, scene);
    sampling_of(call).half_resolution = true;
    add("at half resolution", call, scene);
    sampling_of(call).half_resolution = false;
    add("at full resolution", call, scene);
    call.confidence = call.bent_normal = false;
    sampling_of(call).half_resolution.reset();
    add("orthographic", call, parallel);
    call.border = Border::clamp;
    call.region = Region{13, 301, 350, 1211};
    add("a region with a border", call, scene);
    call.region.reset();
    call.falloff = 0.7;
    sampling_of(call).samples = 3;
    sampling_of(call).jitter = 4;
    add("with three samples", call, scene);
    sampling_of(call).samples.reset();
    sampling_of(call).jitter.reset();
    call.thickness = Silhouette{};
    add("with silhouettes", call, scene);
    for (const auto& [name, images] : calls)
        check_budgets("ssao " + name, images);

    SsaoCall plain;
    plain.radius = 0.06;
    sampling_of(plain).quality = Quality::fast;
    check_budgets("ssao of every vector width",
                  [&](const Device& device) { return images_of(ssao(scene.stored(device), plain)); }, {1, 4, 8});
    check_budgets("ssao of millimetres",
                  [&](const Device& device) { return images_of(ssao(scene.coarse(device), plain)); });
    check_budgets("ssao of a part", [&](const Device& device) {
        return images_of(ssao(scene.stored(device).region(7, 5, 383, 1795), plain));
    });
    check_budgets("ssao with a second layer", [&](const Device& device) {
        SsaoCall layered = plain;
        layered.thickness = scene.second(device);
        return images_of(ssao(scene.stored(device), layered));
    });
    const std::vector<float> towards = floats(normals(scene.stored(device_with(0))));
    check_budgets("ssao with given normals", [&](const Device& device) {
        SsaoCall given = plain;
        given.normals = Image::from_host(device, Element::f32, towards.data(), {401, 1803, 3});
        return images_of(ssao(scene.stored(device), given));
    });
}

TEST_CASE("dof: a budget keeps the bits", "[dof][budget][exhaustive]") {
    constexpr int width = 401, height = 1803;
    const Scene scene(width, height);
    std::vector<float> colors[2];
    std::minstd_rand random(5);
    for (std::vector<float>& rgb : colors)
        for (int i = 0; i < 3 * width * height; ++i)
            rgb.push_back(i % 4999 == 0 ? 1e4f : static_cast<float>(random() % 1024) / 1024.0f);
    const CircleOfConfusion lens{.k = 80, .g = 190}; // circles of -29 to 19 pixels
    for (const auto& [quality, name] :
         {std::pair{Quality::fast, "fast"}, {Quality::balanced, "balanced"}, {Quality::accurate, "accurate"}}) {
        for (const bool plated : {false, true}) {
            const auto images = [&, quality = quality](const Device& device) {
                const auto color = [&](int i) {
                    return Image::from_host(device, Element::f32, colors[i].data(), {width, height, 3})
                        .region(3, 5, width - 3, height - 5);
                };
                const auto part = [&](const StoredDepth& depth) { return depth.region(3, 5, width - 3, height - 5); };
                DofOptions options{.quality = quality};
                if (plated)
                    options.clean_plate = CleanPlate{color(1), part(scene.second(device))};
                return std::vector<Image>{dof(part(scene.stored(device)), color(0), lens, options)};
            };
            check_budgets(std::string("dof ") + name + (plated ? ", with a clean plate" : ""), images,
                          quality == Quality::fast && !plated ? std::initializer_list<int>{16, 8, 4, 1}
                                                              : std::initializer_list<int>{16});
        }
    }
}

TEST_CASE("normals and mixed pixels: a budget keeps the bits", "[normals][dof_masks][budget][exhaustive]") {
    const Scene scene(1009, 3001);
    for (const auto& [name, options] :
         {std::pair{"neighbours", NormalsOptions{.method = NormalMethod::neighbours}},
          {"least squares", NormalsOptions{.method = NormalMethod::least_squares}},
          {"noise", NormalsOptions{.method = NormalMethod::least_squares, .noise = 0.003}}})
        check_budgets(std::string("normals, ") + name,
                      [&, options = options](const Device& device) {
                          return std::vector<Image>{normals(scene.stored(device), options)};
                      },
                      {16, 8, 4, 1});
    const CircleOfConfusion lens{.k = 80, .g = 190};
    check_budgets("mixed pixels", [&](const Device& device) {
        const DofMasks masks = dof_masks(scene.stored(device), lens, {.mixed_pixels = true});
        return std::vector<Image>{masks.coc, masks.mixed_pixels};
    });
}

namespace {

// All masks of the near field, or some, in images of their own or in the middle of others, which differ in their rows.
std::vector<Image> near_field_masks(const StoredDepth& stored, const CircleOfConfusion& lens,
                                    const DofMasksOptions& options, bool inside) {
    const Device& device = stored.image.device();
    DofMasks masks;
    std::vector<Image> all;
    const auto add = [&](bool asked, Image DofMasks::*mask) {
        if (!asked)
            return;
        const int width = stored.image.width(), height = stored.image.height();
        const int margin = inside ? 1 + 2 * static_cast<int>(all.size()) : 0;
        masks.*mask = Image(device, Element::f32, {width + 2 * margin, height + 2 * margin})
                          .region(margin, margin, width, height);
        all.push_back(masks.*mask);
    };
    add(true, &DofMasks::coc);
    add(options.near_weight, &DofMasks::near_weight);
    add(options.focus_weight, &DofMasks::focus_weight);
    add(options.far_weight, &DofMasks::far_weight);
    add(options.max_near_coc, &DofMasks::max_near_coc);
    add(options.near_alpha, &DofMasks::near_alpha);
    add(options.disocclusion, &DofMasks::disocclusion);
    add(options.mixed_pixels, &DofMasks::mixed_pixels);
    dof_masks(stored, masks, lens, options);
    device.finish();
    return all;
}

} // namespace

TEST_CASE("near field: a budget keeps the bits", "[near_field][dof_masks][budget]") {
    const Scene scene(277, 1303);
    const CircleOfConfusion lens{.k = 80, .g = 190}; // circles from -29 pixels on
    const DofMasksOptions all{.near_weight = true,
                              .focus_weight = true,
                              .far_weight = true,
                              .max_near_coc = true,
                              .near_alpha = true,
                              .disocclusion = true,
                              .mixed_pixels = true};
    const auto check_masks = [&](const char* name, const DofMasksOptions& options, bool inside,
                                 std::initializer_list<int> vector_widths) {
        const auto images = [&](const Device& device) {
            return near_field_masks(scene.stored(device), lens, options, inside);
        };
        check_budgets(std::string("near field, ") + name, images, vector_widths);
    };
    check_masks("all masks", all, false, {16});
    check_masks("all masks, inside of other images", all, true, {16, 8, 4, 1});
    check_masks("one weight", {.focus_weight = true}, true, {16});
    check_masks("two weights", {.near_weight = true, .far_weight = true}, false, {16});
    check_masks("near alpha", {.near_alpha = true}, true, {16});
    check_masks("disocclusion", {.disocclusion = true}, true, {16});
    check_budgets("near field of a part", [&](const Device& device) {
        return near_field_masks(scene.stored(device).region(7, 5, 259, 1295), lens, all, true);
    });
}

TEST_CASE("near field: the least budget is one row of blocks, and does not grow with the discs",
          "[near_field][dof_masks][budget]") {
    constexpr int width = 45, height = 1100;
    constexpr std::size_t weights = 48 * 256 * sizeof(float), tables = 5000;
    const Scene scene(width, height);
    const DofMasksOptions options{
        .near_weight = true, .focus_weight = true, .far_weight = true, .near_alpha = true, .disocclusion = true};
    for (const double k : {10.0, 1200.0}) { // discs of up to 4 and 460 pixels
        const CircleOfConfusion lens{.k = k, .g = 2.4 * k};
        const auto masks = [&](const Device& device) {
            return near_field_masks(scene.stored(device), lens, options, true);
        };
        const std::vector<Image> whole = masks(device_with(0));
        for (const int vector_width : {16, 4}) {
            const Device device = device_with(weights + tables, vector_width);
            const std::vector<Image> got = masks(device);
            for (std::size_t i = 0; i < got.size(); ++i)
                CHECK(same_bits(floats(got[i]), floats(whole[i])));
            CHECK(device.state().most_scratch_bytes <= weights + tables);
        }
        CHECK_THROWS_WITH(
            masks(device_with(weights)),
            "dof_masks of 45 x 1100 pixels needs a memory budget of 1 MiB, and has less than 1; raise it");
    }
}

TEST_CASE("operations of single pixels take no memory for themselves", "[budget]") {
    const Scene scene(401, 300);
    const Device device = device_with(1);
    const StoredDepth stored = scene.stored(device);
    const Image color(device, Element::f32, {401, 300, 3});
    linearize(stored);
    unproject(stored);
    fog(stored, color, {.density = 0.1});
    constexpr DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};
    DofMasksOptions with_tiles = weights;
    with_tiles.tile_min_coc = with_tiles.tile_max_coc = true;
    dof_masks(stored, {.k = 80, .g = 190}, with_tiles);
    near_field_masks(stored, {.k = 80, .g = 190}, weights, true);
    device.finish();
    CHECK(device.state().most_scratch_bytes == 0);
}
