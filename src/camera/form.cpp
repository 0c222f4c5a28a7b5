// The simplest exact form of a camera.
//   q = (x, y, d, 1),  M = (viewport · projection)⁻¹,  Z = −(m₃·q)/(m₄·q)              distance along the view axis
// Every encoding is either that line, with most of its coefficients zero, or an exponential, or a length along a ray.
// Popov 2016, eq. 1, 3, 5–9; Kooima (median); Ulrich and Outerra (logarithmic); Lenaerts, part 2 (rays).

#include <fathom/camera.hpp>

#include "camera/circle_form.hpp"
#include "camera/form.hpp"
#include "camera/matrix.hpp"
#include "require.hpp"

#include <Eigen/Core>

#include <bit>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

using Real = long double;
using Matrix4 = Eigen::Matrix<Real, 4, 4>;

void check(const Camera& camera) {
    require_rounding();
    require(!camera.lens, "the camera has the lens ", camera.lens ? to_string(camera.lens->law) : "",
            ", and this takes straight rays only; the operations take lenses (dof: brown), and for all else undo the "
            "distortion (docs/cameras.md)");
    require(camera.width > 0 && camera.height > 0, "a camera for ", camera.width, " x ", camera.height,
            " pixels: both must be at least 1");
    const auto [low, high] = camera.depth_range;
    require(std::isfinite(low) && std::isfinite(high) && low != high, "depth_range = [", low, ", ", high,
            "] must be finite and its ends must differ");
    using enum Encoding;
    const Encoding encoding = camera.encoding;
    const auto only = [&](bool fits, const char* key, const char* which) {
        require(fits, key, " is for ", which, ", not for the ", to_string(encoding), " encoding");
    };
    require(std::isfinite(camera.scale) && camera.scale != 0, "scale = ", camera.scale,
            " must be finite, and other than 0");
    only(camera.scale > 0 || is_metric(encoding), "a scale below 0", "view-z, ray-distance and inverse");
    require(std::isfinite(camera.offset), "offset = ", camera.offset, " must be finite");
    only(camera.offset == 0 || encoding == inverse, "offset", "the inverse encoding");
    require(camera.along != Along::cube, "along = cube is for cameras with a lens");
    only(camera.along == Along::axis || encoding == linear || encoding == inverse || encoding == inverse_range,
         "along = ray", "linear, inverse and inverse-range");
    only(!camera.from_near_plane || encoding == ray_distance || encoding == logarithmic, "from_near_plane",
         "the ray-distance and logarithmic encodings");
}

double needed(const std::optional<double>& value, const char* key, Encoding encoding) {
    require(value.has_value(), "the ", to_string(encoding), " encoding needs ", key);
    require(std::isfinite(*value), key, " = ", *value, " must be finite for the ", to_string(encoding), " encoding");
    return *value;
}

// Coefficients that are zero but for the rounding of the inverse: below what long double can tell from the largest
// term over the whole image.
Affine without_noise(Affine row, const Camera& camera, Real largest_stored) {
    const Affine reach{largest_stored, static_cast<Real>(camera.width), static_cast<Real>(camera.height), 1};
    Real largest = 0;
    for (std::size_t i = 0; i < 4; ++i)
        largest = std::max(largest, std::abs(row[i] * reach[i]));
    for (std::size_t i = 0; i < 4; ++i) {
        if (std::abs(row[i] * reach[i]) < largest * 0x1p-60L)
            row[i] = 0;
    }
    return row;
}

bool has_pixel(const Affine& row) {
    return row[1] != 0 || row[2] != 0;
}

Affine divided(Affine row, Real by) {
    for (Real& value : row)
        value /= by;
    return row;
}

// z = numerator·(v, x, y, 1) / denominator·(v, x, y, 1), in the simplest form it has.
void set_rational(DepthForm& form, const Affine& numerator, const Affine& denominator) {
    if (is_constant(denominator)) {
        form.form = Form::affine;
        form.numerator = divided(numerator, denominator[3]);
        form.reason = has_pixel(numerator)
                          ? "orthographic rays and a tilted near plane: z is affine in the stored value and the pixel"
                          : "z is affine in the stored value";
    } else if (is_constant(numerator)) {
        form.denominator = divided(denominator, numerator[3]);
        form.form = has_pixel(denominator) ? Form::reciprocal_affine : Form::reciprocal;
        form.reason = has_pixel(denominator) ? "a tilted near plane: 1/z is affine in the stored value and the pixel"
                                             : "1/z is affine in the stored value";
    } else {
        form.form = Form::rational;
        form.numerator = numerator;
        form.denominator = denominator;
        form.reason = has_pixel(denominator) || has_pixel(numerator)
                          ? "the projection's fourth row depends on x and y: z is a quotient of two affine functions"
                          : "z is a quotient of two affine functions of the stored value";
    }
}

// The reciprocal form counts from the end of the range that is nearest to the pole, where its sum cannot cancel. That
// needs the end to be exact: 0, or the larger end.
bool can_recentre(const DepthForm& form) {
    const Real at_low = form.denominator[0] * form.lowest + form.denominator[3];
    const Real at_high = form.denominator[0] * form.highest + form.denominator[3];
    if (at_low < 0 || (at_high < 0 && std::isfinite(form.highest)))
        return false;
    const bool low_is_far = form.denominator[0] > 0;
    const float end = low_is_far ? form.lowest : form.highest;
    return end == 0 || (!low_is_far && std::abs(form.highest) >= std::abs(form.lowest));
}

// Under an infinite far plane 1/z ends at 0; what the rounding of the inverse leaves there would put the pole inside the
// range.
void end_at_infinity(DepthForm& form) {
    const Real at_high = form.denominator[0] * form.highest + form.denominator[3];
    if (std::abs(at_high) < std::abs(form.denominator[3]) * 0x1p-60L)
        form.denominator[3] = -form.denominator[0] * form.highest;
}

// The largest float not above a limit and the smallest not below: rounding a limit never refuses the limit itself.
float rounded_down(double value) {
    const float nearest = static_cast<float>(value);
    return nearest > value ? std::nextafter(nearest, -std::numeric_limits<float>::infinity()) : nearest;
}
float rounded_up(double value) {
    return -rounded_down(-value);
}

std::uint32_t half_bits(const char* name, float value) {
    const auto half = static_cast<Eigen::half>(value);
    require(static_cast<float>(half) == value, name, " = ", value, " is not a float16 value");
    return Eigen::numext::bit_cast<std::uint16_t>(half);
}

// The end of the depth range at which the far plane lies.
bool far_is_low(const Camera& camera) {
    if (camera.encoding == Encoding::linear || camera.encoding == Encoding::pseudo_linear)
        return camera.near_plane > camera.far_plane; // a ramp whose white is near
    return camera.encoding == Encoding::window && camera.projection.order == DepthOrder::reversed;
}

// Bits of a stored value that the camera names.
std::uint32_t bits_of(const char* name, double value, Storage storage) {
    require(!std::isnan(value), name, " must be a number");
    value += 0.0; // not -0, which is the same number
    if (storage == Storage::float32)
        return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    if (storage == Storage::float16)
        return half_bits(name, static_cast<float>(value));
    require(value >= 0 && value <= storage_max(storage) && value == std::floor(value), name, " = ", value, " is not a ",
            to_string(storage), " code (0 to ", storage_max(storage), ")");
    return static_cast<std::uint32_t>(value);
}

// Bits of the stored value that means "nothing here" unless the camera names one: the far plane's, or that of infinity. None
// where the storage cannot hold it.
std::optional<std::uint32_t> default_background(const Camera& camera, Storage storage) {
    double value = 0;
    if (camera.encoding == Encoding::inverse) {
        value = -camera.offset;
        if (!is_float(storage) && (value < 0 || value > storage_max(storage) || value != std::floor(value)))
            return std::nullopt;
        if (storage == Storage::float16 && static_cast<double>(static_cast<Eigen::half>(value)) != value)
            return std::nullopt;
    } else if (is_metric(camera.encoding)) {
        value = std::copysign(std::numeric_limits<double>::infinity(), camera.scale);
        if (!is_float(storage))
            return std::nullopt;
    } else {
        value = camera.depth_range[far_is_low(camera) ? 0 : 1] * storage_max(storage);
        if (!is_float(storage))
            value = std::round(value);
    }
    return bits_of("background", value, storage);
}

void set_special_values(DepthForm& form, const Camera& camera, Storage storage) {
    if (camera.missing)
        form.missing = bits_of("missing", *camera.missing, storage);
    if (!camera.background)
        form.background = default_background(camera, storage);
    else if (!std::isnan(*camera.background)) // NaN: no value is the background
        form.background = bits_of("background", *camera.background, storage);
    if (camera.missing && camera.background)
        require(form.missing != form.background, "missing and background are both ", *camera.missing,
                "; a value can mean one of them only");
    if (form.missing == form.background)
        form.background.reset();

    const auto [low, high] = camera.depth_range;
    const bool larger_is_farther = is_metric(camera.encoding)
                                       ? (camera.scale > 0) != (camera.encoding == Encoding::inverse)
                                   : far_is_low(camera) ? low > high
                                                        : high > low;
    form.farther = larger_is_farther ? 1.0f : -1.0f;
    const bool exactly_65504 = camera.background_from_largest_half && storage == Storage::float32;
    const double half_end = static_cast<double>(form.farther) * 65504;
    if (exactly_65504 && !camera.background && form.missing != bits_of("background", half_end, storage))
        form.background = bits_of("background", half_end, storage);
    if (!camera.background_from && !camera.background_from_largest_half)
        return;
    double from = camera.background_from.value_or(static_cast<double>(form.farther) * (exactly_65504 ? 1e10 : 65504));
    require(!std::isnan(from), "background_from must be a number");
    if (storage == Storage::float16 && std::isfinite(from)) // half floats end there: what lies beyond was clipped
        from = std::clamp(from, -65504.0, 65504.0);
    form.background_from = rounded_down(form.farther * from);
}

void set_stored_range(DepthForm& form, const Camera& camera, Storage storage) {
    const double largest = storage_max(storage);
    if (is_metric(camera.encoding)) {
        // Counted forwards from the value of nothing (or of infinity), or backwards from it where the scale is below 0.
        const bool inverse = camera.encoding == Encoding::inverse, forwards = camera.scale > 0;
        const double end = inverse ? 0.0 - camera.offset : 0; // not -0
        form.lowest = is_float(storage) ? -std::numeric_limits<float>::infinity() : 0;
        form.highest = is_float(storage) ? std::numeric_limits<float>::infinity() : static_cast<float>(largest);
        if (inverse && is_float(storage)) { // finite in the units of set_reciprocal; no disparity is that large
            form.lowest = -0x1p95f;
            form.highest = 0x1p95f;
        }
        if (camera.encoding == Encoding::view_z) // an orthographic camera sees what lies behind it
            return;
        if (forwards)
            form.lowest =
                is_float(storage) ? rounded_up(end) : std::max(form.lowest, static_cast<float>(std::ceil(end)));
        else
            form.highest =
                is_float(storage) ? rounded_down(end) : std::min(form.highest, static_cast<float>(std::floor(end)));
    } else {
        const auto [a, b] = camera.depth_range;
        form.lowest = rounded_down(std::min(a, b) * largest);
        form.highest = rounded_up(std::max(a, b) * largest);
    }
}

// u = slope · v + start runs from 0 to 1 over the depth range.
struct Normalised {
    Real slope, start;
};

Normalised normalised(const Camera& camera, Storage storage) {
    const Real low = camera.depth_range[0], high = camera.depth_range[1];
    return {1 / (static_cast<Real>(storage_max(storage)) * (high - low)), -low / (high - low)};
}

void set_exponential(DepthForm& form, Normalised u, Real rate, Real amplitude, Real offset) {
    form.form = Form::exponential;
    form.rate = rate * u.slope;
    form.start = rate * u.start;
    form.amplitude = amplitude;
    form.offset = offset;
}

// The camera centre is where clip space is (0, 0, 1, 0), the third column of the unprojection; it need not be the
// origin of view space. What the rounding of the inverse leaves of an origin is taken away.
Eigen::Matrix<Real, 3, 1> centre_of(const Matrix4& m) {
    const Real noise = m.topRows<3>().cwiseAbs().maxCoeff() * 0x1p-50L;
    const auto certain = [&](Real value) { return std::abs(value) < noise ? Real{0} : value / m(3, 2); };
    return m.col(2).head<3>().unaryExpr(certain);
}

float centre_depth(const Camera& camera) {
    const Real depth = -centre_of(unprojection(camera)).z();
    return std::isfinite(depth) ? static_cast<float>(depth) : 0.0f;
}

// z = distance · D_z/|D|, counted from the camera centre or from the near plane. Before, the form gives the distance.
void set_along_ray(DepthForm& form, const Camera& camera) {
    const bool inverse = form.form != Form::affine;
    form.form = inverse ? Form::inverse_ray_distance : Form::ray_distance;
    if (inverse) { // what is nearer than 2^-100 is beyond the floats of the kernel
        const auto nearest = static_cast<float>(0x1p100L / form.denominator[0]);
        if (nearest > 0)
            form.highest = std::min(form.highest, nearest);
        else
            form.lowest = std::max(form.lowest, nearest);
    }
    form.offset = camera_rays(camera).centre_depth; // refuses a camera without rays
    if (camera.from_near_plane)
        form.offset += needed(camera.near_plane, "near", camera.encoding);
    form.reason = inverse ? "z is the inverse of the stored value times the cosine of the pixel's ray"
                          : "z is the stored length times the cosine of the pixel's ray";
}

// View depth that a step of length 1 along the pixel's ray covers.
Real cosine(const Rays& rays, Real x, Real y) {
    const Eigen::Matrix<Real, 3, 1> pixel(x, y, 1), direction = rays.direction * pixel;
    return rays.depth.dot(pixel) / direction.norm();
}

void set_window(DepthForm& form, const Camera& camera, Storage storage) {
    const Matrix4 m = unprojection(camera);
    const Real largest = storage_max(storage);
    const auto row = [&](int i, Real sign) {
        return without_noise({sign * m(i, 2) / largest, sign * m(i, 0), sign * m(i, 1), sign * m(i, 3)}, camera,
                             form.highest);
    };
    set_rational(form, row(2, -1), row(3, 1));
}

} // namespace

double storage_max(Storage storage) {
    switch (storage) {
    case Storage::float32:
    case Storage::float16:
        return 1;
    case Storage::uint8:
        return 255;
    case Storage::uint16:
        return 65535;
    default:
        return 16777215;
    }
}

bool is_metric(Encoding encoding) {
    return encoding == Encoding::view_z || encoding == Encoding::ray_distance || encoding == Encoding::inverse;
}

bool is_along_ray(const DepthForm& form) {
    return form.form == Form::ray_distance || form.form == Form::inverse_ray_distance;
}

StoredKind kind_of(const DepthForm& form, float value, std::uint32_t bits) {
    const auto is = [&](const std::optional<std::uint32_t>& number) {
        return number && (bits == *number || (*number == 0 && value == 0)); // -0, too
    };
    if (is(form.missing))
        return StoredKind::missing;
    const bool nothing = is(form.background) || (form.background_from && form.farther * value >= *form.background_from);
    return nothing ? StoredKind::background : StoredKind::depth;
}

Matrix4 unprojection(const Camera& camera) {
    check(camera);
    const Projection& projection = camera.projection;
    require(!projection.matrix.isZero(0), "the camera has no projection; make one with perspective, orthographic or "
                                          "from_matrix");
    const Projection::ThirdRow third = projection.third_row();
    Projection from_end = projection;
    from_end.matrix.row(2) = third.row;
    const Matrix4 inverse = checked_inverse(from_end.matrix_in_opengl_axes(), "the projection");

    // Pixel and stored depth to clip space, depth counted from the third row's end of the volume. Row 0 is the top of the
    // screen unless the rows or y run the other way.
    const bool first_row_is_clip_top = (camera.rows == Rows::top_down) == (projection.convention.clip_y == ClipY::up);
    const Real y_sign = first_row_is_clip_top ? -1 : 1;
    const Real clip_low = projection.convention.clip_z == ClipZ::negative_one_to_one ? -1 : 0;
    const Real low = camera.depth_range[0], high = camera.depth_range[1];
    Matrix4 clip = Matrix4::Zero();
    clip(0, 0) = Real{2} / camera.width;
    clip(0, 3) = -1;
    clip(1, 1) = y_sign * 2 / camera.height;
    clip(1, 3) = -y_sign;
    clip(2, 2) = (1 - clip_low) / (high - low);
    clip(2, 3) = -(third.clip_value == clip_low ? low : high) * clip(2, 2);
    clip(3, 3) = 1;
    const Matrix4 result = inverse * clip;
    const Real across = result.col(0).head<2>().norm(), down = result.col(1).head<2>().norm();
    if (across > 0 && down > 0) // or the rays run across the view axis
        check_pixel_aspect(across, down, most_aspect_of_rays);
    return result;
}

DepthForm depth_form(const Camera& camera, Storage storage) {
    check(camera);
    DepthForm form{};
    form.numerator = form.denominator = {0, 0, 0, 1};
    form.perspective = camera.projection.is_perspective();
    form.least_depth = form.perspective ? centre_depth(camera) : -std::numeric_limits<float>::infinity();
    set_special_values(form, camera, storage);
    set_stored_range(form, camera, storage);
    const Normalised u = normalised(camera, storage);
    const Real scale = camera.scale;
    const auto near_plane = [&]() -> Real { return needed(camera.near_plane, "near", camera.encoding); };
    const auto far_plane = [&]() -> Real { return needed(camera.far_plane, "far", camera.encoding); };
    const auto check_order = [](Real near, Real far) {
        require(near > 0 && far > near, "near = ", near, " and far = ", far, " must satisfy 0 < near < far");
    };

    switch (camera.encoding) {
    case Encoding::window:
        set_window(form, camera, storage);
        break;
    case Encoding::view_z:
    case Encoding::ray_distance:
        set_rational(form, {scale, 0, 0, 0}, {0, 0, 0, 1});
        break;
    case Encoding::inverse:
        set_rational(form, {0, 0, 0, scale}, {1, 0, 0, camera.offset});
        break;
    case Encoding::inverse_range: {
        const Real near = near_plane(), far = far_plane();
        check_order(near, far);
        const Real difference = 1 / far - 1 / near;
        set_rational(form, {0, 0, 0, 1}, {difference * u.slope, 0, 0, 1 / near + difference * u.start});
        break;
    }
    case Encoding::linear:
    case Encoding::pseudo_linear: {
        const Real near = near_plane(), far = far_plane();
        require(near != far, "near = ", near, " and far = ", far, " must differ");
        set_rational(form, {(far - near) * u.slope, 0, 0, near + (far - near) * u.start}, {0, 0, 0, 1});
        if (camera.encoding == Encoding::pseudo_linear)
            form.reason += ", exactly so at vertices only";
        break;
    }
    case Encoding::median: {
        const Real median = needed(camera.median, "median", camera.encoding);
        require(median > 0, "median = ", median, " must be above 0");
        set_rational(form, {median * u.slope, 0, 0, median * u.start}, {-u.slope, 0, 0, 1 - u.start});
        break;
    }
    case Encoding::logarithmic: {
        const Real far = far_plane(), c = camera.log_c;
        require(far > 0, "far = ", far, " must be above 0 for the logarithmic encoding");
        require(std::isfinite(c) && c > 0, "log_c = ", c, " must be above 0");
        set_exponential(form, u, std::log2(c * far + 1), 1 / c, camera.from_near_plane ? near_plane() : 0);
        form.reason = "z grows exponentially with the stored logarithm";
        break;
    }
    case Encoding::exponential: {
        const Real near = near_plane(), far = far_plane();
        check_order(near, far);
        set_exponential(form, u, std::log2(far / near), near, near);
        form.reason = "z grows exponentially with the stored value";
        break;
    }
    }
    if (camera.encoding == Encoding::ray_distance || camera.along == Along::ray)
        set_along_ray(form, camera);
    if (form.form == Form::reciprocal)
        end_at_infinity(form);
    if (form.form == Form::reciprocal && !can_recentre(form)) {
        form.form = Form::reciprocal_affine;
        form.reason = "1/z is affine in the stored value, with its pole inside or beside an uneven depth range";
    }
    return form;
}

void check_pixel_aspect(long double across, long double down, double most) {
    require(across <= most * down && down <= most * across, "pixels that see ", across / down,
            " times as much across as down: a camera's are at most ", most,
            " times as wide as high, or as high as wide; check fx and fy, or the aspect");
}

Camera straightened(const Camera& camera) {
    if (!camera.lens)
        return camera;
    const bool of_buffer = camera.encoding == Encoding::window; // of the pinhole whose picture was warped
    require(!of_buffer || camera.lens->law == LensLaw::brown,
            "the encoding window is of a projection, and the camera has the lens ", to_string(camera.lens->law),
            "; say what the values are: view-z, ray-distance, linear, inverse or another one");
    require(!camera.from_near_plane, "from_near_plane is of a projection, and the camera has the lens ",
            to_string(camera.lens->law), "; leave it out");
    require(camera.along == Along::axis || camera.encoding != Encoding::ray_distance,
            "along = ", to_string(camera.along), " is not for the ray-distance encoding, which says it already");
    Camera straight = camera;
    straight.lens.reset();
    straight.along = Along::axis;
    if (of_buffer) {
        const auto& m = camera.projection.matrix;
        require(m(2, 0) == 0 && m(2, 1) == 0 && m(3, 0) == 0 && m(3, 1) == 0,
                "the projection's near plane or its image plane is tilted, and the camera has a lens; its depth-buffer "
                "values must depend on the depth alone");
    } else {
        straight.projection = perspective(1, 1, {1, 2}, camera.projection.convention);
    }
    if (camera.encoding == Encoding::ray_distance)
        straight.encoding = Encoding::view_z;
    return straight;
}

double forwards(const Camera& camera) {
    return camera.projection.convention.view_axes == ViewAxes::opengl ? -1 : 1;
}

Along counted_along(const Camera& camera) {
    return camera.encoding == Encoding::ray_distance ? Along::ray : camera.along;
}

bool has_plane_in_focus(const Camera& camera) {
    return !camera.lens || camera.lens->law == LensLaw::brown;
}

Rays straight_rays(const Camera& camera) {
    return camera.lens ? Rays{} : camera_rays(camera);
}

Rays camera_rays(const Camera& camera) {
    using Vector3 = Eigen::Matrix<Real, 3, 1>;
    using Row = Eigen::Matrix<Real, 1, 3>;
    const Matrix4 m = unprojection(camera);
    const Affine centre_row = without_noise({m(3, 2), m(0, 2), m(1, 2), m(2, 2)}, camera, 1);
    const Real centre_w = centre_row[0];

    // A pixel's ray runs through its point of stored depth 0 and the camera centre, where clip space is (0, 0, 1, 0).
    Eigen::Matrix<Real, 4, 3> point;
    point << m.col(0), m.col(1), m.col(3);
    const Affine w_row = without_noise({0, point(3, 0), point(3, 1), point(3, 2)}, camera, 0);
    point.row(3) << w_row[1], w_row[2], w_row[3];

    Rays result;
    Vector3 centre = Vector3::Zero();
    if (centre_w != 0) {
        centre = centre_of(m);
        result.direction = point.topRows<3>() - centre * point.row(3);
    } else {
        require(w_row[1] == 0 && w_row[2] == 0, "the projection has its camera centre at infinity and a fourth row "
                                                "with x and y: its rays are not supported");
        result.direction.col(2) = m.col(2).head<3>();
    }

    // Make one step of direction cover a view depth of one, unless that varies from pixel to pixel.
    const Row ahead = -result.direction.row(2);
    const Affine ahead_row = without_noise({0, ahead(0), ahead(1), ahead(2)}, camera, 0);
    result.depth << ahead_row[1], ahead_row[2], ahead_row[3];
    require(result.depth.cwiseAbs().maxCoeff() > 0,
            "the projection's rays run across the view axis: they have no depth");
    result.w_is_depth = !has_pixel(ahead_row);
    result.centre_depth = -centre.z();
    if (result.w_is_depth) {
        result.direction /= result.depth(2);
        result.direction.row(2) = Row(0, 0, -1);
        result.depth = Row(0, 0, 1);
        if (centre_w != 0) {
            result.origin = -result.centre_depth * result.direction;
            result.origin.col(2) += centre;
        } else {
            const Eigen::Matrix<Real, 3, 3> start = point.topRows<3>() / w_row[3];
            result.origin = start + result.direction.col(2) * start.row(2);
        }
        result.origin.row(2).setZero();
    } else {
        result.origin.col(2) = centre;
    }

    // From the OpenGL axes to the projection's own.
    const ViewAxes axes = camera.projection.convention.view_axes;
    const Vector3 flip(1, axes == ViewAxes::opencv ? -1 : 1, axes == ViewAxes::opengl ? 1 : -1);
    result.origin = flip.asDiagonal() * result.origin;
    result.direction = flip.asDiagonal() * result.direction;
    return result;
}

long double view_depth(const Camera& camera, Storage storage, double x, double y, double stored) {
    const DepthForm form = depth_form(camera, storage);
    return view_depth(form, is_along_ray(form) ? camera_rays(camera) : Rays{}, x, y, stored);
}

long double view_depth(const DepthForm& form, const Rays& rays, double x, double y, double stored) {
    const auto sum = [&](const Affine& row) { return row[0] * stored + row[1] * x + row[2] * y + row[3]; };
    if (form.form == Form::exponential)
        return form.amplitude * std::expm1(std::log(2.0L) * (form.rate * stored + form.start)) + form.offset;
    const Real z = sum(form.numerator) / sum(form.denominator);
    return is_along_ray(form) ? z * cosine(rays, x, y) + form.offset : z;
}

long double stored_depth(const Camera& camera, Storage storage, double x, double y, double z) {
    const DepthForm form = depth_form(camera, storage);
    if (form.form == Form::exponential)
        return (std::log1p((z - form.offset) / form.amplitude) / std::log(2.0L) - form.start) / form.rate;
    const Real distance = is_along_ray(form) ? (z - form.offset) / cosine(camera_rays(camera), x, y) : Real{z};
    // n₀ v + n = z (m₀ v + m), n and m being what does not depend on v; at infinity only m counts.
    const auto rest = [&](const Affine& row) { return row[1] * x + row[2] * y + row[3]; };
    const Affine &n = form.numerator, &m = form.denominator;
    if (std::isinf(distance))
        return m[0] == 0 ? std::numeric_limits<Real>::infinity() : -rest(m) / m[0];
    return (rest(n) - distance * rest(m)) / (distance * m[0] - n[0]);
}

} // namespace fathom
