// Triangles by their edges: weights that are affine on the screen, and attributes divided by w on the way.
//   attribute = Σ λᵢ aᵢ/wᵢ / Σ λᵢ/wᵢ        depth = Σ λᵢ (z_clip/w)ᵢ        λ: the point's weights on the screen

#include "articles/rasteriser.hpp"

namespace fathom::charts {
namespace {

ScreenCorner corner_of(const Eigen::Vector3d& point, const Screen& screen, DepthWriter writer) {
    const Eigen::Vector4d homogeneous(point.x(), point.y(), point.z(), 1);
    const Eigen::Vector4d clip = screen.projection.matrix.cast<double>() * homogeneous;
    const double w = clip.w(), z = -point.z();
    const double linear = (z - screen.near_plane) / (screen.far_plane - screen.near_plane);
    const double written = writer == DepthWriter::z_times_w ? (2 * linear - 1) * w : clip.z();
    return {(clip.x() / w + 1) / 2 * screen.width, (1 - clip.y() / w) / 2 * screen.height, 1 / w, (written / w + 1) / 2,
            z};
}

} // namespace

ScreenTriangle::ScreenTriangle(const Triangle& triangle, const Screen& screen, DepthWriter writer)
    : near_(screen.near_plane), far_(screen.far_plane), per_fragment_(writer == DepthWriter::linear) {
    for (std::size_t i = 0; i < 3; ++i)
        corners_[i] = corner_of(triangle[i], screen, writer);
}

std::array<double, 3> ScreenTriangle::weights(double x, double y) const {
    const auto twice_area = [](double ax, double ay, double bx, double by, double cx, double cy) {
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    };
    const auto& [a, b, c] = corners_;
    const double whole = twice_area(a.x, a.y, b.x, b.y, c.x, c.y);
    return {twice_area(x, y, b.x, b.y, c.x, c.y) / whole, twice_area(a.x, a.y, x, y, c.x, c.y) / whole,
            twice_area(a.x, a.y, b.x, b.y, x, y) / whole};
}

bool ScreenTriangle::covers(double x, double y) const {
    const auto [a, b, c] = weights(x, y);
    return a >= 0 && b >= 0 && c >= 0;
}

double ScreenTriangle::inverse_w(double x, double y) const {
    const auto share = weights(x, y);
    return share[0] * corners_[0].inverse_w + share[1] * corners_[1].inverse_w + share[2] * corners_[2].inverse_w;
}

double ScreenTriangle::depth(double x, double y) const {
    const auto share = weights(x, y);
    double attribute = 0, clip_depth = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        attribute += share[i] * corners_[i].z * corners_[i].inverse_w;
        clip_depth += share[i] * corners_[i].clip_depth;
    }
    return per_fragment_ ? (attribute / inverse_w(x, y) - near_) / (far_ - near_) : clip_depth;
}

DepthPicture rasterise(const std::vector<Triangle>& triangles, const Screen& screen, DepthWriter writer) {
    std::vector<ScreenTriangle> ready;
    for (const Triangle& triangle : triangles)
        ready.emplace_back(triangle, screen, writer);

    const std::size_t pixels = static_cast<std::size_t>(screen.width) * static_cast<std::size_t>(screen.height);
    DepthPicture picture{screen.width,
                         screen.height,
                         std::vector<int>(pixels, -1),
                         std::vector<double>(pixels),
                         std::vector<double>(pixels),
                         std::vector<double>(pixels)};
    std::size_t at = 0;
    for (int row = 0; row < screen.height; ++row) {
        for (int column = 0; column < screen.width; ++column, ++at) {
            const double x = column + 0.5, y = row + 0.5;
            double nearest = 0;
            for (std::size_t i = 0; i < ready.size(); ++i) {
                if (!ready[i].covers(x, y) || ready[i].inverse_w(x, y) <= nearest)
                    continue;
                nearest = ready[i].inverse_w(x, y);
                const double here = ready[i].depth(x, y);
                picture.triangle[at] = static_cast<int>(i);
                picture.depth[at] = here;
                picture.dx[at] = ready[i].depth(x + 1, y) - here;
                picture.dy[at] = ready[i].depth(x, y + 1) - here;
            }
        }
    }
    return picture;
}

Screen slanted_screen(int width, int height) {
    const double near = 1, far = 12, aspect = static_cast<double>(height) / width;
    return {perspective(FrustumEdges{-0.5, 0.5, -0.5 * aspect, 0.5 * aspect}, {near, far}), width, height, near, far};
}

std::vector<Triangle> slanted_plane(const Screen& screen) {
    // Corners on the screen, from 0 to 1; those inside are moved off the grid.
    constexpr std::size_t columns = 4, rows = 3;
    constexpr double moved[rows + 1][columns + 1][2] = {
        {{0, 0}, {0.03, 0}, {-0.04, 0}, {0.05, 0}, {0, 0}},
        {{0, 0.05}, {-0.05, 0.07}, {0.05, -0.05}, {-0.03, 0.06}, {0, -0.08}},
        {{0, -0.06}, {0.06, 0.02}, {-0.05, 0.06}, {0.04, -0.07}, {0, 0.05}},
        {{0, 0}, {-0.05, 0}, {0.04, 0}, {-0.04, 0}, {0, 0}}};
    const double aspect = static_cast<double>(screen.height) / screen.width;
    const auto point = [&](std::size_t row, std::size_t column) {
        const double x = static_cast<double>(column) / columns + moved[row][column][0];
        const double y = static_cast<double>(row) / rows + moved[row][column][1];
        const auto [a, b, c] = slanted_inverse_depth;
        const double z = 1 / (a * x + b * y + c);
        return Eigen::Vector3d((x - 0.5) * z / screen.near_plane, (0.5 - y) * aspect * z / screen.near_plane, -z);
    };
    std::vector<Triangle> triangles;
    for (std::size_t row = 0; row < rows; ++row) {
        for (std::size_t column = 0; column < columns; ++column) {
            const auto a = point(row, column), b = point(row, column + 1), c = point(row + 1, column),
                       d = point(row + 1, column + 1);
            const bool turned = (row + column) % 2 == 1;
            triangles.push_back({a, b, turned ? d : c});
            triangles.push_back({turned ? a : b, d, c});
        }
    }
    return triangles;
}

} // namespace fathom::charts
