// How many rows a sphere covers, which the bands of a memory budget are planned by. That results keep their bits and their budget
// stands in test_contract.cpp.

#include "catch.hpp"
#include "operations/ssao/ssao_plan.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

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
