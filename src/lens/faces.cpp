// A lens's image in blocks, each seen by a pinhole along the ray in its middle. A block is halved until that pinhole has few more
// pixels than the block and looks at nothing from far aside. So a distorted pinhole has one face, and a panorama 24.

#include "lens/faces.hpp"

#include "lens/patches.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace fathom::lens {
namespace {

using Vector = Eigen::Vector3d;

constexpr int unit = 16;              // pixels that blocks and parts of faces are multiples of
constexpr double steepest = 50;       // degrees from a face's axis to the rays of its block
constexpr double outermost = 75;      // degrees to the end of a face's image
constexpr double most_pixels = 1.4;   // of a face, over those of its block that have rays
constexpr int places = 64;            // in a row and a column of a block that are looked at
constexpr int around = 4;             // pixels around a block's rays in the face: of the interpolation and the filter
constexpr int besides = 12;           // pixels around them where blocks pass over into each other, and of the filter
constexpr int columns_at_once = 64;   // of ssao, from multiples of it on: as wide as its blocks
constexpr double nearest_pixel = 0.2; // that a position may be off, in pixels of the face

double radians(double degrees) {
    return degrees * std::numbers::pi / 180;
}

struct Seen {
    Face face;
    double angle = 0;  // from the face's axis to the farthest ray
    double rays = 0;   // the share of the block's pixels that have one
    bool ahead = true; // do all lie before the face?
};

// Rays of a block of pixels, in rows, those on its border among them; and the share of these pixels that have one.
std::pair<std::vector<Vector>, double> rays_of(const CameraLens& lens, const PixelBox& block) {
    const auto steps = [](int pixels) { return std::clamp(pixels - 1, 1, places); };
    const auto at = [](int first, int pixels, int step, int count) {
        return first + 0.5 + std::round(1.0 * (pixels - 1) * step / count);
    };
    const int across = steps(block.width()), down = steps(block.height());
    std::vector<Vector> rays;
    for (int j = 0; j <= down; ++j)
        for (int i = 0; i <= across; ++i)
            if (const auto ray =
                    lens.direction(at(block.left, block.width(), i, across), at(block.top, block.height(), j, down)))
                rays.push_back(*ray);
    return {rays, static_cast<double>(rays.size()) / ((across + 1) * (down + 1))};
}

// The ray in the block's middle with its derivatives, or that nearest to the mean of its rays.
std::optional<RayJets> middle_of(const CameraLens& lens, const PixelBox& block, const std::vector<Vector>& rays) {
    Vector mean = Vector::Zero();
    for (const Vector& ray : rays)
        mean += ray;
    const double x = 0.5 * (block.left + block.right), y = 0.5 * (block.top + block.bottom);
    if (const auto middle = lens.ray(x, y))
        return middle;
    std::optional<RayJets> best;
    double most = -1;
    constexpr int steps = 16;
    for (int j = 0; j < steps; ++j)
        for (int i = 0; i < steps; ++i)
            if (const auto ray = lens.ray(block.left + (i + 0.5) * block.width() / steps,
                                          block.top + (j + 0.5) * block.height() / steps)) {
                const double near = mean.dot(Vector((*ray)[0].value, (*ray)[1].value, (*ray)[2].value));
                if (near > most) {
                    most = near;
                    best = ray;
                }
            }
    return best;
}

Seen seen_by_face(const CameraLens& lens, const PixelBox& block, bool along_axis) {
    const auto [rays, share] = rays_of(lens, block);
    Seen seen;
    seen.rays = share;
    Face& face = seen.face;
    face.block = block;
    const auto middle = middle_of(lens, block, rays);
    if (!middle) { // no pixel of the block has a ray
        face.turn.setIdentity();
        face.focal = 1;
        face.half = unit;
        face.inner = {unit - 1, unit - 1, unit + 1, unit + 1};
        face.least = face.most = 1;
        return seen;
    }
    const auto part = [&](auto which) { return Vector((*middle)[0].*which, (*middle)[1].*which, (*middle)[2].*which); };
    const Vector ahead = part(&Jet::value).normalized(), by_x = part(&Jet::x), by_y = part(&Jet::y);
    const Vector right = (by_x - ahead.dot(by_x) * ahead).normalized();
    Vector down = ahead.cross(right);
    if (down.dot(by_y) < 0)
        down = -down;
    face.turn << right.transpose(), down.transpose(), ahead.transpose();
    face.focal = 1 / std::max(by_x.norm(), by_y.norm());
    constexpr double infinite = std::numeric_limits<double>::infinity();
    double left = infinite, top = infinite, most_right = -infinite, bottom = -infinite;
    face.least = infinite;
    face.most = 0;
    for (const Vector& ray : rays) {
        const Vector at = face.turn * ray;
        seen.angle = std::max(seen.angle, std::acos(std::clamp(at.z(), -1.0, 1.0)));
        seen.ahead &= at.z() > least_part_ahead;
        if (!(at.z() > least_part_ahead))
            continue;
        left = std::min(left, at.x() / at.z());
        most_right = std::max(most_right, at.x() / at.z());
        top = std::min(top, at.y() / at.z());
        bottom = std::max(bottom, at.y() / at.z());
        const double length = (along_axis ? std::max(lens.ahead(ray), least_ahead()) : 1) / at.z();
        face.least = std::min(face.least, length);
        face.most = std::max(face.most, length);
    }
    const double farthest = std::max({-left, most_right, -top, bottom, std::tan(radians(outermost))});
    face.half = (static_cast<int>(std::ceil(farthest * face.focal)) / unit + 2) * unit;
    // What is needed begins with a column of blocks, or just behind.
    const int before = (face.half + static_cast<int>(std::floor(left * face.focal)) - besides) % columns_at_once;
    if (before >= unit)
        face.half += (columns_at_once - before + unit - 1) / unit * unit;
    const auto column = [&](double tangent) { return static_cast<int>(std::floor(face.half + tangent * face.focal)); };
    face.inner = {std::max(column(left) - around, 0), std::max(column(top) - around, 0),
                  std::min(column(most_right) + around + 1, 2 * face.half),
                  std::min(column(bottom) + around + 1, 2 * face.half)};
    return seen;
}

void add_faces(std::vector<Face>& faces, const CameraLens& lens, const PixelBox& block, bool along_axis) {
    const Seen seen = seen_by_face(lens, block, along_axis);
    const Face& face = seen.face;
    const double pixels = 1.0 * face.inner.width() * face.inner.height(),
                 its_own = seen.rays * block.width() * block.height();
    const bool small = block.width() <= 2 * unit && block.height() <= 2 * unit;
    if (small || seen.rays == 0 ||
        (seen.ahead && seen.angle <= radians(steepest) && pixels <= most_pixels * its_own + 64 * 64)) {
        faces.push_back(face);
        return;
    }
    // Across the longer of its sides, in radians.
    const auto length = [&](bool across) {
        const double x = 0.5 * (block.left + block.right), y = 0.5 * (block.top + block.bottom);
        double sum = 0;
        Vector last = Vector::Zero();
        for (int i = 0; i <= places; ++i) {
            const double part = 1.0 * i / places;
            const auto ray = across ? lens.direction(block.left + 0.5 + part * (block.width() - 1), y)
                                    : lens.direction(x, block.top + 0.5 + part * (block.height() - 1));
            if (!ray)
                continue;
            if (!last.isZero(0))
                sum += (*ray - last).norm();
            last = *ray;
        }
        return sum;
    };
    const auto half_of = [](int pixels) { return (pixels / 2 + unit / 2) / unit * unit; };
    const bool wide = block.height() <= 2 * unit || (block.width() > 2 * unit && length(true) >= length(false));
    PixelBox first = block, second = block;
    if (wide)
        first.right = second.left = block.left + half_of(block.width());
    else
        first.bottom = second.top = block.top + half_of(block.height());
    add_faces(faces, lens, first, along_axis);
    add_faces(faces, lens, second, along_axis);
}

} // namespace

std::vector<Face> faces_of(const CameraLens& lens, int width, int height, bool along_axis) {
    std::vector<Face> faces;
    add_faces(faces, lens, {0, 0, width, height}, along_axis);
    return faces;
}

namespace {

constexpr double steps_of_sine = 48; // so that the frames of a sequence share what is made for a part
constexpr int beyond = 20;           // pixels: slopes, samples between pixels, the filter and what is interpolated

// What spheres cover outwards, in tangents.
struct Covered {
    double left, top, right, bottom;

    // Around directions between these tangents.
    void add(const FaceTile& tile, double sine) {
        sine = std::ceil(sine * steps_of_sine) / steps_of_sine;
        // Of a direction with the tangents (a, b), the planes through the other axis that touch the sphere around it stand
        // asin(sine / cos) from its own, cos = sqrt((1 + a^2) / (1 + a^2 + b^2)).
        const auto end = [&](double a, double b) { // a outwards
            const double most = std::tan(radians(outermost)), part = sine * sine * (1 + a * a + b * b) / (1 + a * a);
            if (part >= 1)
                return std::max(most, a);
            const double tangent = std::sqrt(part / (1 - part));
            return std::max(a * tangent < 1 ? std::min((a + tangent) / (1 - a * tangent), most) : most, a);
        };
        const double aside = std::max(-tile.left, tile.right), above = std::max(-tile.top, tile.bottom);
        left = std::max(left, end(-tile.left, above));
        top = std::max(top, end(-tile.top, aside));
        right = std::max(right, end(tile.right, above));
        bottom = std::max(bottom, end(tile.bottom, aside));
    }

    PixelBox pixels_of(const Face& face) const {
        const auto down_to = [](double pixel) { return static_cast<int>(std::floor(pixel / unit)) * unit; };
        const int size = 2 * face.half;
        const auto first = [&](double tangents) {
            return std::clamp(down_to(face.half - tangents * face.focal - beyond), 0, size);
        };
        const auto last = [&](double tangents) {
            return std::clamp(-down_to(-(face.half + tangents * face.focal + beyond)), 0, size);
        };
        return {first(left) / columns_at_once * columns_at_once, first(top), last(right), last(bottom)};
    }
};

Covered inner_of(const Face& face) {
    const auto tangent = [&](int pixel) { return (pixel - face.half) / face.focal; };
    return {-tangent(face.inner.left), -tangent(face.inner.top), tangent(face.inner.right), tangent(face.inner.bottom)};
}

// Where a ray meets a face, if that looks at it.
std::optional<Eigen::Vector2d> tangents_of(const Face& face, const Vector& ray) {
    const Vector at = face.turn * ray;
    if (!(at.z() > least_part_ahead))
        return std::nullopt;
    return Eigen::Vector2d(at.x() / at.z(), at.y() / at.z());
}

} // namespace

PixelBox with_margin(const Face& face, double sine) {
    Covered covered = inner_of(face);
    covered.add({0, 0, -covered.left, -covered.top, covered.right, covered.bottom}, sine);
    return covered.pixels_of(face);
}

PixelBox with_margin(const Face& face, const std::vector<FaceTile>& tiles, const std::vector<double>& sines) {
    Covered covered = inner_of(face);
    for (std::size_t i = 0; i < tiles.size(); ++i)
        covered.add(tiles[i], sines[i]);
    return covered.pixels_of(face);
}

std::vector<FaceTile> tiles_of(const CameraLens& lens, const Face& face) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    std::vector<FaceTile> tiles;
    for (int top = face.block.top; top < face.block.bottom; top += unit)
        for (int left = face.block.left; left < face.block.right; left += unit) {
            const int right = std::min(left + unit, face.block.right), bottom = std::min(top + unit, face.block.bottom);
            FaceTile tile{left / unit, top / unit, infinite, infinite, -infinite, -infinite};
            bool all = lens.law() != LensLaw::rays; // the rays of neighbours may be anywhere
            const auto look = [&](int x, int y) {
                const auto ray = lens.direction(x + 0.5, y + 0.5);
                const auto at = ray ? tangents_of(face, *ray) : std::nullopt;
                all &= at.has_value();
                if (!at)
                    return;
                tile.left = std::min(tile.left, at->x());
                tile.right = std::max(tile.right, at->x());
                tile.top = std::min(tile.top, at->y());
                tile.bottom = std::max(tile.bottom, at->y());
            };
            // With the pixels beside the block where its face's results pass over into others'.
            const int end_x = right + (right == face.block.right ? fade : 0),
                      end_y = bottom + (bottom == face.block.bottom ? fade : 0);
            for (const int y : {top, (top + bottom) / 2, end_y - 1})
                for (const int x : {left, (left + right) / 2, end_x - 1})
                    look(x, y);
            if (!all) // where rays end, they may turn without end, and behind the face tangents grow without end
                for (int y = top; y < end_y; ++y)
                    for (int x = left; x < end_x; ++x)
                        look(x, y);
            if (tile.left <= tile.right)
                tiles.push_back(tile);
        }
    return tiles;
}

FaceBlocks blocks_of(const Face& face, const std::vector<FaceTile>& tiles, int size) {
    const int columns = (2 * face.half + size - 1) / size;
    FaceBlocks blocks{columns, std::vector<std::uint32_t>(static_cast<std::size_t>(columns) * columns)};
    const auto block = [&](double tangent, int more) {
        return std::clamp(static_cast<int>(face.half + tangent * face.focal + more) / size, 0, columns - 1);
    };
    const Covered inner = inner_of(face); // beyond which a pixel takes the results at its ends
    for (const FaceTile& tile : tiles) {
        const int first = block(std::min(tile.left, inner.right), -besides),
                  last = block(std::max(tile.right, -inner.left), besides);
        for (int row = block(std::min(tile.top, inner.bottom), -besides);
             row <= block(std::max(tile.bottom, -inner.top), besides); ++row)
            for (int column = first; column <= last; ++column)
                blocks.needed[static_cast<std::size_t>(row * columns + column)] = 1;
    }
    return blocks;
}

namespace {

constexpr double farthest_place = 1.0 / 64; // pixels that a polynomial may be off
constexpr double place_step = 1024; // parts of a pixel, so that hosts whose sines differ in their last bits agree

// Factors of 1, i and i^2 in the polynomial through three values at these indices.
Eigen::Matrix3d powers_of(double last) {
    Eigen::Matrix3d values;
    const double at[] = {0, std::floor(last / 2), last};
    for (int i = 0; i < 3; ++i)
        values.row(i) << 1, at[i], at[i] * at[i];
    return values.inverse();
}

// The polynomial of a tile, if there is one: by rows of powers of the row, columns of powers of the column.
std::optional<std::array<Eigen::Matrix3d, 2>> polynomial(const CameraLens& lens, const Face& face, int left, int top,
                                                         int last_column, int last_row) {
    const auto place = [&](int column, int row) -> std::optional<Eigen::Vector2d> {
        const auto ray = lens.direction(left + column + 0.5, top + row + 0.5);
        const auto at = ray ? tangents_of(face, *ray) : std::nullopt;
        return at ? std::optional<Eigen::Vector2d>(*at * face.focal) : std::nullopt;
    };
    std::array<Eigen::Matrix3d, 2> values;
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
            const auto at = place(i * last_column / 2, j * last_row / 2);
            if (!at)
                return std::nullopt;
            for (int k = 0; k < 2; ++k)
                values[static_cast<std::size_t>(k)](j, i) = std::round((*at)[k] * place_step) / place_step;
        }
    const Eigen::Matrix3d across = powers_of(last_column), down = powers_of(last_row);
    for (Eigen::Matrix3d& each : values)
        each = down * each * across.transpose();
    for (const int row : {last_row / 4, 3 * last_row / 4})
        for (const int column : {last_column / 4, 3 * last_column / 4}) {
            const auto at = place(column, row);
            const Eigen::RowVector3d of_row(1, row, row * row);
            const Vector of_column(1, column, column * column);
            if (!at || !(std::abs((of_row * values[0] * of_column).value() - at->x()) <= farthest_place) ||
                !(std::abs((of_row * values[1] * of_column).value() - at->y()) <= farthest_place))
                return std::nullopt;
        }
    return values;
}

using Position = std::optional<Eigen::Vector2d>;

// Of a place in a face's image, in pixels.
Vector direction_of(const Face& face, double x, double y) {
    return Vector(face.turn.transpose() * Vector((x - face.half) / face.focal, (y - face.half) / face.focal, 1))
        .normalized();
}

// As near to another place as whole turns of a panorama bring it.
Position unwrapped(const Position& at, const Position& beside, double turn) {
    if (!at || !beside || turn == 0)
        return at;
    return Eigen::Vector2d(at->x() + turn * std::round((beside->x() - at->x()) / turn), at->y());
}

void add_node(std::vector<float>& nodes, const Position& at) {
    constexpr double finest = 256; // parts of a pixel, so that hosts whose sines differ in their last bits agree
    constexpr float none = std::numeric_limits<float>::quiet_NaN();
    nodes.push_back(at ? static_cast<float>(std::round(at->x() * finest) / finest) : none);
    nodes.push_back(at ? static_cast<float>(std::round(at->y() * finest) / finest) : none);
}

} // namespace

FacePlaces places_of(const CameraLens& lens, int width, int height, const std::vector<Face>& faces) {
    constexpr std::size_t numbers_of_tile = 24;
    FacePlaces places{(width + unit - 1) / unit, {}};
    const int down = (height + unit - 1) / unit;
    places.numbers.resize(static_cast<std::size_t>(places.tiles_across * down) * numbers_of_tile,
                          std::numeric_limits<float>::quiet_NaN());
    for (const Face& face : faces)
        for (int top = face.block.top; top < face.block.bottom; top += unit)
            for (int left = face.block.left; left < face.block.right; left += unit) {
                const int last_column = std::min(unit, width - left) - 1, last_row = std::min(unit, height - top) - 1;
                if (last_column < 4 || last_row < 4)
                    continue;
                const auto found = polynomial(lens, face, left, top, last_column, last_row);
                if (!found)
                    continue;
                float* to = places.numbers.data() +
                            static_cast<std::size_t>(top / unit * places.tiles_across + left / unit) * numbers_of_tile;
                for (int j = 0; j < 3; ++j, to += 8) {
                    std::fill(to, to + 8, 0.0f);
                    for (int i = 0; i < 3; ++i)
                        for (int k = 0; k < 2; ++k)
                            to[2 * i + k] = static_cast<float>((*found)[static_cast<std::size_t>(k)](j, i));
                }
            }
    return places;
}

FacePositions positions_of(const CameraLens& lens, const Face& face, const PixelBox& part) {
    FacePositions positions{part.width() / unit, {}, {0, 0}};
    const auto direction = [&](double x, double y) { // of the middle of a pixel of the part
        return direction_of(face, part.left + x + 0.5, part.top + y + 0.5);
    };
    // The corners of all tiles.
    const int across = part.width() / unit + 1, down = part.height() / unit + 1;
    std::vector<Position> corners;
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i)
            corners.push_back(lens.pixel(direction(i * unit, j * unit)));
    const auto corner = [&](int x, int y) -> const Position& {
        return corners[static_cast<std::size_t>(y / unit * across + x / unit)];
    };
    std::vector<Position> nodes;
    const auto fits = [&](int left, int top, int shift) {
        const int h = 1 << shift, count = (unit >> shift) + 1;
        nodes.clear();
        for (int j = 0; j < count; ++j)
            for (int i = 0; i < count; ++i) {
                const int x = left + i * h, y = top + j * h;
                const Position at = x % unit == 0 && y % unit == 0 ? corner(x, y) : lens.pixel(direction(x, y));
                if (!at)
                    return false;
                nodes.push_back(unwrapped(at, nodes.empty() ? at : nodes.front(), lens.turn()));
            }
        for (int j = 0; j + 1 < count; ++j)
            for (int i = 0; i + 1 < count; ++i) {
                const auto node = [&](int a, int b) {
                    return *nodes[static_cast<std::size_t>((j + b) * count + i + a)];
                };
                const Eigen::Vector2d middle = (node(0, 0) + node(1, 0) + node(0, 1) + node(1, 1)) / 4;
                const auto ray = lens.direction(middle.x(), middle.y());
                const Vector truth = direction(left + (i + 0.5) * h, top + (j + 0.5) * h);
                if (!ray || !((*ray - truth).norm() * face.focal <= nearest_pixel))
                    return false;
            }
        return true;
    };
    int shift = tile_shift;
    for (int top = 0; top < part.height(); top += unit)
        for (int left = 0; left < part.width(); left += unit) {
            const int right = left + unit, bottom = top + unit;
            const bool any = corner(left, top) || corner(right, top) || corner(left, bottom) || corner(right, bottom);
            shift = std::min(shift + 1, tile_shift);
            while (shift > 0 && !fits(left, top, shift))
                --shift;
            const auto first = static_cast<std::uint32_t>(positions.nodes.size() / 2);
            positions.tiles.push_back(first << 3 | static_cast<std::uint32_t>(shift));
            if (shift > 0)
                std::ranges::for_each(nodes, [&](const Position& at) { add_node(positions.nodes, at); });
            for (int y = top; shift == 0 && y < bottom; ++y)
                for (int x = left; x < right; ++x)
                    add_node(positions.nodes, any ? lens.pixel(direction(x, y)) : Position());
        }
    return positions;
}

} // namespace fathom::lens
