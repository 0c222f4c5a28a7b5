// Bands of rows, which a memory budget needs, and how far a sphere reaches. That results keep their bits and their budget
// stands in test_contract.cpp.

#include "catch.hpp"
#include "operations/bands.hpp"
#include "operations/ssao/ssao_plan.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

TEST_CASE("bands make every row once and read what lies within their halo", "[bands]") {
    for (const auto& [rows, halo, made_bytes, least] :
         {std::tuple{1, 0, 0, 1}, {2, 1, 0, 1}, {7, 5, 0, 2}, {100, 5, 0, 1}, {1001, 1, 0, 1}, {540, 36, 160, 18}}) {
        for (const std::size_t budget : {std::size_t{1}, std::size_t{640}, std::size_t{6400}, std::size_t{1} << 40}) {
            const auto bytes = [made_bytes = made_bytes](int read, int made) {
                return static_cast<std::size_t>(64 * read + made_bytes * made);
            };
            int made = 0;
            const std::vector<Band> all = bands({0, rows, rows, {halo}, bytes, least}, budget);
            for (const Band& band : all) {
                REQUIRE(band.begin == made);
                REQUIRE(band.end > band.begin);
                made = band.end;
                CHECK(band.first == std::max(band.begin - halo, 0));
                CHECK(band.last == std::min(band.end + halo, rows));
                const int lowest = std::max(least, (band.last - band.first - (band.end - band.begin)) / 8);
                CHECK((bytes(band.last - band.first, band.end - band.begin) <= budget ||
                       band.end - band.begin <= lowest));
                CHECK((band.end - band.begin >= least || band.end == rows));
            }
            CHECK(made == rows);
            CHECK((all.size() == 1 || bytes(rows, rows) > budget));
            CHECK(bands({0, rows, rows, std::vector<int>(static_cast<std::size_t>(rows), halo), bytes, least}, budget)
                      .size() == all.size());
        }
    }
}

TEST_CASE("bands: the budget that is named is the smallest one that works", "[bands]") {
    constexpr std::size_t mebibyte = std::size_t{1} << 20;
    // Low bands take more than some higher ones do.
    const auto bytes = [](int read, int made) {
        return static_cast<std::size_t>(read + (made < 100 ? 90 : 0)) * mebibyte;
    };
    const RowNeeds rows{0, 1000, 1000, {40}, bytes, 64};
    std::size_t smallest = 0;
    const auto works = [&](std::size_t budget) {
        try {
            bands(rows, budget, "this");
            return true;
        } catch (const Error& error) {
            std::size_t named = 0;
            REQUIRE(std::sscanf(error.what(), "this needs a memory budget of %zu MiB", &named) == 1);
            if (smallest == 0)
                smallest = named * mebibyte;
            CHECK(named * mebibyte == smallest);
            return false;
        }
    };
    CHECK(!works(1));
    CHECK(works(smallest));
    CHECK(!works(smallest - 1));
    CHECK(bytes(64 + 80, 64) > smallest);
}

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
    const Camera cameras[] = {
        {.projection = perspective(1.2, 1.2 * 200 / 300, {0.1, 100}), .width = 200, .height = 300},
        {.projection = orthographic({-2, 2, -3, 3}, {0.1, 100}), .width = 200, .height = 300}};
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
