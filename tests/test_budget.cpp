// What a memory budget needs: bands of rows that reach differently, how far a sphere reaches, and the least that does for masks.
// That results keep their bits and their budget stands in test_contract.cpp.

#include "catch.hpp"
#include "images.hpp"
#include "operations/bands.hpp"
#include "operations/ssao/ssao_plan.hpp"
#include "runtime/state.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

Device device_with(std::size_t budget, int vector_width = 0) {
    return test_device({.vector_width = vector_width, .memory_budget = budget});
}

// Steps and slopes, a floor that comes near the camera, and single invalid pixels.
struct Scene {
    Camera camera;
    std::vector<float> depth;

    Scene(int width, int height, bool perspective_camera = true) {
        camera.width = width;
        camera.height = height;
        camera.projection = perspective_camera
                                ? perspective(1.2, 1.2 * width / height, {0.1, 100})
                                : orthographic({-2, 2, -2.0 * height / width, 2.0 * height / width}, {0.1, 100});
        camera.encoding = Encoding::view_z;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const int step = x / 37 % 3 + y / 29 % 2 + (x / 51 + y / 97) % 4;
                const bool hole = (x * 31 + y * 17) % 997 == 0;
                const double z = 3.0 - 1.2 * y / height + 0.02 * step + 1e-4 * ((x * 7 + y * 13) % 11);
                depth.push_back(hole ? std::nanf("") : static_cast<float>(z));
            }
    }

    StoredDepth stored(const Device& device) const {
        return {Image::from_host(device, Element::f32, depth.data(), {camera.width, camera.height}), camera};
    }
};

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
    CHECK_THROWS_WITH(bands(rows, 1000, "this"), "this needs a memory budget of 1 MiB; raise it");
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
            for (int i = 0; i < 360; ++i)
                for (int j = 0; j <= 180; ++j) {
                    const double a = std::numbers::pi * i / 180, b = std::numbers::pi * j / 180;
                    const Eigen::Vector3d point =
                        centre +
                        radius * Eigen::Vector3d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
                    most = std::max(most, std::abs(row_of(point) - pixel.y()));
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

TEST_CASE("near field: the least budget is one row of blocks, and does not grow with the discs",
          "[near_field][dof_masks][budget]") {
    constexpr int width = 45, height = 1100;
    constexpr std::size_t weights = 48 * 256 * sizeof(float), tables = 5000;
    const Scene scene(width, height);
    const DofMasksOptions options{
        .near_weight = true, .focus_weight = true, .far_weight = true, .near_alpha = true, .disocclusion = true};
    for (const double k : {10.0, 1200.0}) { // discs of up to 4 and 460 pixels
        const CircleOfConfusion lens{.k = k, .g = 2.4 * k};
        const auto masks = [&](const Device& device) { return dof_masks(scene.stored(device), lens, options); };
        const DofMasks whole = masks(device_with(0));
        for (const int vector_width : {16, 4}) {
            const Device device = device_with(weights + tables, vector_width);
            const DofMasks got = masks(device);
            for (const auto mask : {&DofMasks::coc, &DofMasks::near_weight, &DofMasks::focus_weight,
                                    &DofMasks::far_weight, &DofMasks::near_alpha, &DofMasks::disocclusion})
                CHECK(same_bits(floats(got.*mask), floats(whole.*mask)));
            CHECK(device.state().most_scratch_bytes <= weights + tables);
        }
        CHECK_THROWS_WITH(masks(device_with(weights)),
                          "dof_masks of 45 x 1100 pixels needs a memory budget of 1 MiB; raise it");
    }
}
