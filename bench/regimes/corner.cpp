#include "regimes/corner.hpp"

#include "images.hpp"
#include "regimes/normal_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom::regimes {
namespace {

using Eigen::Vector3d;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int margin = 4; // pixels, at the border and beside the edge

/// Depth as a buffer holds it, and how it is handed to the library.
struct Stored {
    std::vector<float> floats;
    std::vector<std::uint16_t> codes16;
    std::vector<std::uint32_t> codes24;
    std::vector<std::uint8_t> bytes;
    StoredDepth depth;
    double fixed_half_step = 0; // of the stored value between 0 and 1, besides a float's own
};

std::vector<float> rounded(const std::vector<double>& values, int bits) {
    const double highest = std::exp2(bits) - 1;
    std::vector<float> result(values.size());
    std::ranges::transform(values, result.begin(), [highest](double value) {
        return static_cast<float>(std::round(std::clamp(value, 0.0, 1.0) * highest) / highest);
    });
    return result;
}

Stored store(const Device& device, const scene::Rendered& truth, Camera camera, Buffer buffer) {
    Stored stored;
    if (buffer.bits < 32)
        stored.fixed_half_step = 0.5 / (std::exp2(buffer.bits) - 1);
    if (buffer.bits == 16 && buffer.known) {
        stored.codes16 = scene::codes16(truth, camera);
        stored.depth = images::stored_of(device, stored.codes16, camera, Storage::uint16);
    } else if (buffer.bits == 24 && buffer.known) {
        stored.codes24 = scene::codes24(truth, camera);
        stored.depth = images::stored_of(device, stored.codes24, camera, Storage::uint24);
        if (buffer.packed) {
            for (const std::uint32_t code : stored.codes24)
                for (const int shift : {0, 8, 16})
                    stored.bytes.push_back(static_cast<std::uint8_t>(code >> shift & 255));
            stored.depth = images::stored_of(device, stored.bytes, camera, Storage::rgb8_red_low);
        }
    } else {
        stored.floats = buffer.bits < 32 ? rounded(truth.exact, buffer.bits) : truth.stored;
        if (buffer.bits < 32 && buffer.known)
            camera.depth_bits = buffer.bits;
        stored.depth = images::stored_of(device, stored.floats, camera);
    }
    return stored;
}

/// Half of the step between the stored values around this one.
long double half_step(const Stored& stored, double exact) {
    const double of_float = stored.floats.empty() ? 0 : std::ldexp(0.5, std::ilogb(exact) - 23);
    return stored.fixed_half_step + of_float;
}

/// How far storing a depth may have moved it: to what half a step more or less decodes to. A perspective's 1/z is affine in
/// the stored value and the pixel.
double depth_bound(const DepthForm& form, long double half, int x, int y, double z, double exact) {
    const Affine& row = form.denominator;
    const auto moved = [&](long double by) {
        const long double there = std::clamp(exact + by, 0.0L, 1.0L);
        const long double inverse = row[0] * there + row[1] * (x + 0.5L) + row[2] * (y + 0.5L) + row[3];
        return inverse > 0 ? static_cast<double>(std::abs(1 / inverse - z)) : infinity;
    };
    return std::max(moved(half), moved(-half)) + linearize_ulp_fp64 * 0x1p-23 * z;
}

/// At most 90 degrees; a missing normal counts as 90 degrees too.
double angle_degrees(const Vector3d& got, const Vector3d& truth) {
    if (got.isZero())
        return 90;
    return std::atan2(got.cross(truth).norm(), std::max(got.dot(truth), 0.0)) * 180 / std::numbers::pi;
}

double true_visibility(double from_edge) {
    const double a = std::acos(std::min(from_edge / corner_radius, 1.0));
    return 1 - (a - std::sin(a) * std::cos(a)) / std::numbers::pi;
}

void raise(double& largest, double value) {
    largest = std::max(largest, std::abs(value));
}

double circle_of(const CircleOfConfusion& lens, double z) {
    return static_cast<double>(coc_at(lens, z));
}

/// What is moved to the camera centre may have any circle; what is moved to the far plane is background, and infinitely
/// far.
double circle_bound(const CircleOfConfusion& lens, double z, double moved, bool background) {
    const double towards = moved < z ? circle_of(lens, z) - circle_of(lens, z - moved) : infinity;
    const double away = background ? circle_of(lens, infinity) - circle_of(lens, z) : 0; // otherwise less than towards
    const double size = std::max(std::abs(circle_of(lens, z)), static_cast<double>(lens.k));
    return std::max(towards, away) + coc_ulp * 0x1p-23 * size;
}

/// Largest errors of depth and circle, and their bounds.
void judge_depth(const Corner& corner, const Stored& stored, const CircleOfConfusion& lens, CornerErrors& errors) {
    const scene::Rendered& truth = corner.truth();
    const DepthForm form = depth_form(corner.camera());
    const bool reversed = corner.camera().projection.order == DepthOrder::reversed;
    const auto z = images::floats(linearize(stored.depth, {Background::decode}).image);
    const auto circle = images::floats(dof_masks(stored.depth, lens).coc);
    for (int y = 0; y < truth.height; ++y)
        for (int x = 0; x < truth.width; ++x) {
            const auto i = static_cast<std::size_t>(y * truth.width + x);
            if (!corner.judged(i))
                continue;
            const double exact = truth.z[i];
            const long double half = half_step(stored, truth.exact[i]);
            const double bound = depth_bound(form, half, x, y, exact, truth.exact[i]);
            raise(errors.depth, static_cast<double>(z[i]) / exact - 1);
            raise(errors.depth_bound, bound / exact);
            raise(errors.circle, static_cast<double>(circle[i]) - circle_of(lens, exact));
            raise(errors.circle_bound,
                  circle_bound(lens, exact, bound, (reversed ? truth.exact[i] : 1 - truth.exact[i]) <= half));
        }
}

void judge_normals(const Corner& corner, const Stored& stored, CornerErrors& errors) {
    const scene::Rendered& truth = corner.truth();
    errors.normal = corner.normals_off(images::floats(normals(stored.depth, {.method = NormalMethod::neighbours})));
    errors.fitted = corner.normals_off(images::floats(normals(stored.depth, {.method = NormalMethod::least_squares})));
    const NormalBound bound(stored.depth.camera, stored.depth.storage);
    for (int y = margin; y < truth.height - margin; ++y)
        for (int x = margin; x < truth.width - margin; ++x) {
            const auto i = static_cast<std::size_t>(y * truth.width + x);
            if (corner.judged(i) && corner.away_from_edges(x, y))
                raise(errors.normal_bound, bound.degrees(x, y, truth.z[i], truth.normal[i]));
        }
}

} // namespace

Corner::Corner(const Camera& camera, double edge, double from) : camera_(camera), edge_(edge), from_(from) {
    const double half = std::numbers::sqrt2 / 2;
    truth_ = scene::render({scene::Plane{{edge, 0, -corner_depth}, {half, 0, half}},
                            scene::Plane{{edge, 0, -corner_depth}, {-half, 0, half}}},
                           camera);
}

SsaoOptions Corner::options() {
    SsaoOptions options;
    options.thickness = infinity;
    options.border = Border::clamp; // the corner goes on above and below
    return options;
}

bool Corner::away_from_edges(int x, int y) const {
    if (x < margin || y < margin || x >= truth_.width - margin || y >= truth_.height - margin)
        return false;
    const auto at = [&](int column) {
        return truth_.position[static_cast<std::size_t>(y * truth_.width + column)].x() - edge_;
    };
    return at(x - margin) * at(x + margin) > 0; // false where either is no number
}

double Corner::normals_off(const std::vector<float>& normals) const {
    double largest = 0;
    for (int y = 0; y < truth_.height; ++y)
        for (int x = 0; x < truth_.width; ++x) {
            const auto i = static_cast<std::size_t>(y * truth_.width + x);
            if (judged(i) && away_from_edges(x, y))
                raise(largest,
                      angle_degrees({normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]}, truth_.normal[i]));
        }
    return largest;
}

double Corner::visibility_off(const std::vector<float>& visibility) const {
    double sum = 0;
    long pixels = 0;
    for (std::size_t i = 0; i < visibility.size(); ++i) {
        const double from_edge = std::numbers::sqrt2 * std::abs(truth_.position[i].x() - edge_);
        if (!judged(i) || from_edge > corner_radius)
            continue;
        const double got = std::isnan(visibility[i]) ? 1 : static_cast<double>(visibility[i]);
        sum += std::pow(got - true_visibility(from_edge), 2);
        ++pixels;
    }
    return std::sqrt(sum / static_cast<double>(pixels));
}

CornerErrors corner_errors(const Device& device, const Corner& corner, Buffer buffer, const CircleOfConfusion& lens) {
    const Stored stored = store(device, corner.truth(), corner.camera(), buffer);
    CornerErrors errors;
    judge_depth(corner, stored, lens, errors);
    judge_normals(corner, stored, errors);
    errors.visibility =
        corner.visibility_off(images::floats(ssao(stored.depth, corner_radius, Corner::options()).visibility));
    return errors;
}

double plane_lost(const Device& device, const Camera& camera, Buffer buffer) {
    const scene::Rendered truth = scene::render({scene::Plane{{0, 0, -corner_depth}, {0.5, 0, 0.866}}}, camera);
    const Stored stored = store(device, truth, camera, buffer);
    double sum = 0;
    SsaoOptions options = Corner::options();
    options.border = Border::open; // a plane does not go on as its border's pixels
    const auto visibility = images::floats(ssao(stored.depth, corner_radius, options).visibility);
    for (const float v : visibility)
        sum += std::pow(1 - static_cast<double>(v), 2);
    return std::sqrt(sum / static_cast<double>(visibility.size()));
}

void add(Regime& regime, const std::string& curve, double parameter, const CornerErrors& errors) {
    const auto put = [&](const char* quantity, double error, double bound) {
        regime.panel(quantity).curve(curve).points.push_back({parameter, error, bound});
    };
    put(quantity::depth, errors.depth, errors.depth_bound);
    put(quantity::normal, errors.normal, errors.normal_bound);
    put(quantity::visibility, errors.visibility, none);
    put(quantity::circle, errors.circle, errors.circle_bound);
}

} // namespace fathom::regimes
