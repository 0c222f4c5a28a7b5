// Rays as bicubic Hermite patches: all that a device has to do is multiply and add.
//   u(s, t) = Σ b_i(s) b_j(t) · (u, h u_x, h u_y, h² u_xy) of the four corners
// with b₀ = 1 − b₁, b₁ = s²(3 − 2s), b₂ = s(1 − s)², b₃ = −s²(1 − s). A tile halves h until its patches are as near to the rays
// as patch_error says, so most of an image has h = 16, and where a lens folds each pixel has its own node.

#include "lens/patches.hpp"

#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fathom::lens {
namespace {

constexpr int tile_side = 1 << tile_shift;

double to_40_bits(double value) {
    constexpr double unit = 0x1p13 + 1; // Dekker: keeps 53 − 13 bits
    const double large = value * unit;
    return large - (large - value);
}

PatchNode rayless() {
    PatchNode node;
    node.fill(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    return node;
}

bool has_ray(const PatchNode& node) {
    return !std::isnan(node[0].x());
}

Eigen::Vector3d rounded(const Eigen::Vector3d& vector) {
    return vector.unaryExpr([](double each) { return to_40_bits(each); });
}

// At a position from the centre of the first pixel.
PatchNode node_at(const CameraLens& lens, double x, double y, double h) {
    const auto ray = lens.ray(x + 0.5, y + 0.5);
    if (!ray)
        return rayless();
    const auto& [a, b, c] = *ray;
    return {rounded({a.value, b.value, c.value}), rounded(h * Eigen::Vector3d(a.x, b.x, c.x)),
            rounded(h * Eigen::Vector3d(a.y, b.y, c.y)), rounded(h * h * Eigen::Vector3d(a.xy, b.xy, c.xy))};
}

// Hermite's four, and their derivatives.
std::array<double, 4> blend(double s) {
    return {1 - s * s * (3 - 2 * s), s * s * (3 - 2 * s), s * (1 - s) * (1 - s), -s * s * (1 - s)};
}
std::array<double, 4> blend_slope(double s) {
    return {-6 * s * (1 - s), 6 * s * (1 - s), (1 - s) * (1 - 3 * s), s * (3 * s - 2)};
}

using Corners = std::array<const PatchNode*, 4>; // of the patch: (0, 0), (1, 0), (0, 1), (1, 1)

Eigen::Vector3d blended(const Corners& corners, const std::array<double, 4>& across,
                        const std::array<double, 4>& down) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t x = i % 2, y = i / 2;
        const PatchNode& node = *corners[i];
        sum += across[x] * (down[y] * node[0] + down[y + 2] * node[2]) +
               across[x + 2] * (down[y] * node[1] + down[y + 2] * node[3]);
    }
    return sum;
}

std::size_t nodes_across(int shift) {
    return shift == 0 ? tile_side : (tile_side >> shift) + 1;
}

// The tiles of an image, one after the other.
class Builder {
public:
    Builder(const CameraLens& lens, int width, int height, bool along_axis)
        : lens_(lens), width_(width), height_(height), along_axis_(along_axis) {
        patches_.tiles_across = (width + tile_side - 1) / tile_side;
        patches_.nodes.assign(4, rayless()); // of tiles without any ray
    }

    Patches made() {
        int shift = tile_shift;
        for (int y = 0; y < height_; y += tile_side)
            for (int x = 0; x < width_; x += tile_side) {
                shift = lens_.law() == LensLaw::rays ? 0 : std::min(shift + 1, tile_shift); // neighbours are alike
                while (shift > 0 && !fits(x, y, shift))
                    --shift;
                patches_.tiles.push_back(add(x, y, shift));
            }
        return std::move(patches_);
    }

private:
    // Makes the nodes of a tile. Do all pixels have rays, and are the patches near enough to them?
    bool fits(int x, int y, int shift) {
        const int right = std::min(x + tile_side, width_) - 1, bottom = std::min(y + tile_side, height_) - 1;
        for (const int column : {x, right})
            for (const int row : {y, bottom})
                if (!lens_.direction(column + 0.5, row + 0.5))
                    return false;
        make_nodes(x, y, shift);
        const int h = 1 << shift;
        for (int row = y; row <= bottom; row += h)
            for (int column = x; column <= right; column += h)
                if (!is_near(corners(shift, (column - x) >> shift, (row - y) >> shift), column, row, h))
                    return false;
        return true;
    }

    bool is_near(const Corners& corners, int x, int y, int h) const {
        // A smooth ray is off most in the middles of the patch and of its sides; in the middle alone two errors may cancel.
        constexpr double places[][2] = {{0.5, 0.5}, {0.5, 0}, {0, 0.5}, {1, 0.5}, {0.5, 1}};
        constexpr double reserve = 0.95,
                         widest = 1; // radians: one that goes around a panorama meets it at all these places
        double off = 0, ahead = 1;
        for (const PatchNode* corner : corners) {
            if ((*corner)[1].norm() > widest || (*corner)[2].norm() > widest)
                return false;
            ahead = std::min(ahead, lens_.ahead((*corner)[0]));
        }
        for (const auto& [s, t] : places) {
            const auto exact = lens_.direction(x + h * s + 0.5, y + h * t + 0.5);
            if (!exact)
                return false;
            const double here = (blended(corners, blend(s), blend(t)) - *exact).norm();
            if (std::isnan(here)) // a corner has no ray
                return false;
            off = std::max(off, here);
        }
        return off <= reserve * patch_error * (along_axis_ ? std::max(ahead, least_ahead()) : 1);
    }

    void make_nodes(int x, int y, int shift) {
        tile_.clear();
        const auto count = static_cast<int>(nodes_across(shift)), h = 1 << shift;
        for (int row = 0; row < count; ++row)
            for (int column = 0; column < count; ++column)
                tile_.push_back(node_at(lens_, x + column * h, y + row * h, h));
    }

    Corners corners(int shift, int column, int row) const {
        const std::size_t count = nodes_across(shift);
        const PatchNode* first = &tile_[static_cast<std::size_t>(row) * count + static_cast<std::size_t>(column)];
        return {first, first + 1, first + count, first + count + 1};
    }

    std::uint32_t add(int x, int y, int shift) {
        if (shift == 0)
            make_nodes(x, y, shift);
        if (std::ranges::none_of(tile_, has_ray))
            return tile_shift;
        const std::size_t place = patches_.nodes.size();
        require(place < (std::size_t{1} << 28), "the lens ", to_string(lens_.law()), " needs more than 2^28 nodes of ",
                "its rays in ", width_, " x ", height_, " pixels; give the image in parts");
        patches_.nodes.insert(patches_.nodes.end(), tile_.begin(), tile_.end());
        return static_cast<std::uint32_t>(place << 3) | static_cast<std::uint32_t>(shift);
    }

    const CameraLens& lens_;
    int width_, height_;
    bool along_axis_;
    Patches patches_;
    std::vector<PatchNode> tile_; // nodes of the tile that is made
};

} // namespace

double least_ahead() {
    return std::cos(steepest_angle_deg * std::numbers::pi / 180);
}

std::array<Eigen::Vector3d, 3> Patches::at(double x, double y) const {
    const auto column = static_cast<int>(x), row = static_cast<int>(y);
    const std::uint32_t tile =
        tiles[static_cast<std::size_t>((row >> tile_shift) * tiles_across + (column >> tile_shift))];
    const int shift = tile & 7, h = 1 << shift, inside = tile_side - 1;
    const std::size_t count = nodes_across(shift);
    const PatchNode* node = &nodes[(tile >> 3) + static_cast<std::size_t>((row & inside) >> shift) * count +
                                   static_cast<std::size_t>((column & inside) >> shift)];
    if (shift == 0)
        return {(*node)[0], (*node)[1], (*node)[2]};
    const Corners corners{node, node + 1, node + count, node + count + 1};
    const double s = (x - (column >> shift << shift)) / h, t = (y - (row >> shift << shift)) / h;
    return {blended(corners, blend(s), blend(t)), blended(corners, blend_slope(s), blend(t)) / h,
            blended(corners, blend(s), blend_slope(t)) / h};
}

Patches patches_of(const CameraLens& lens, int width, int height, bool along_axis) {
    lens.require_unfolded(width, height);
    return Builder(lens, width, height, along_axis).made();
}

std::vector<float> patch_floats(const Patches& patches, const CameraLens& lens, const Eigen::Matrix3d& turn) {
    std::vector<float> floats;
    floats.reserve(patches.nodes.size() * 20);
    const auto turned = [&](const Eigen::Vector3d& vector) {
        const Eigen::Vector3d there = rounded(turn * vector);
        return std::array{there.x(), there.y(), there.z(), lens.ahead(vector)};
    };
    for (const PatchNode& node : patches.nodes) {
        const auto ray = turned(node[0]);
        for (const double each : ray)
            floats.push_back(static_cast<float>(each));
        for (const double each : ray)
            floats.push_back(static_cast<float>(each - static_cast<double>(static_cast<float>(each))));
        for (std::size_t i = 1; i < node.size(); ++i)
            for (const double each : turned(node[i]))
                floats.push_back(static_cast<float>(each));
    }
    return floats;
}

} // namespace fathom::lens
