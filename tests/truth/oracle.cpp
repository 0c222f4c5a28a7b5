#include "oracle.hpp"

#include "quad.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace oracle {
namespace {

using namespace fathom;

Quad quad(double value) {
    return value;
}

Matrix to_quad(const Eigen::Matrix4d& matrix) {
    Matrix result;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            result[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = matrix(i, j);
    return result;
}

// Gauss and Jordan, the largest pivot of each column.
Matrix inverted(Matrix a) {
    Matrix b{};
    for (std::size_t i = 0; i < 4; ++i)
        b[i][i] = 1;
    for (std::size_t column = 0; column < 4; ++column) {
        std::size_t pivot = column;
        for (std::size_t i = column + 1; i < 4; ++i)
            pivot = fabsq(a[i][column]) > fabsq(a[pivot][column]) ? i : pivot;
        std::swap(a[column], a[pivot]);
        std::swap(b[column], b[pivot]);
        const Quad divisor = a[column][column];
        for (std::size_t j = 0; j < 4; ++j) {
            a[column][j] /= divisor;
            b[column][j] /= divisor;
        }
        for (std::size_t i = 0; i < 4; ++i) {
            const Quad factor = i == column ? 0 : a[i][column];
            for (std::size_t j = 0; j < 4; ++j) {
                a[i][j] -= factor * a[column][j];
                b[i][j] -= factor * b[column][j];
            }
        }
    }
    return b;
}

Quad length(const Point& p) {
    return sqrtq(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}

// From the axes of a convention to x right, y up, −z ahead, and back.
std::array<Quad, 3> flip(ViewAxes axes) {
    return {1, quad(axes == ViewAxes::opencv ? -1 : 1), quad(axes == ViewAxes::opengl ? 1 : -1)};
}

double storage_largest(Storage storage) {
    if (storage == Storage::float32 || storage == Storage::float16)
        return 1;
    return storage == Storage::uint8 ? 255 : storage == Storage::uint16 ? 65535 : 16777215;
}

bool counts_as_is(Encoding encoding) {
    return encoding == Encoding::view_z || encoding == Encoding::inverse || encoding == Encoding::ray_distance;
}

Subject subject_of(const Projection& projection, std::optional<Frustum> frustum) {
    Subject subject;
    subject.camera.projection = projection;
    subject.camera.width = subject.camera.height = 16384;
    subject.frustum = frustum;
    return subject;
}

} // namespace

Subject from_field_of_view(double fov_y, double aspect, DepthSpan span, Convention convention) {
    const Quad slope = tanq(quad(fov_y) / 2);
    return subject_of(perspective(fov_y, aspect, span, convention),
                      Frustum{false, -slope * aspect, slope * aspect, -slope, slope, span.near_plane, span.far_plane,
                              span.order == DepthOrder::reversed});
}

Subject from_edges(FrustumEdges e, DepthSpan span, Convention convention) {
    const Quad near = span.near_plane;
    return subject_of(perspective(e, span, convention),
                      Frustum{false, e.left / near, e.right / near, e.bottom / near, e.top / near, near, span.far_plane,
                              span.order == DepthOrder::reversed});
}

Subject from_intrinsics(Intrinsics k, DepthSpan span, Convention convention) {
    const Quad fx = k.fx, fy = k.fy, cx = k.cx, cy = k.cy;
    Subject subject = subject_of(perspective(k, span, convention),
                                 Frustum{false, -cx / fx, (k.width - cx) / fx, (cy - k.height) / fy, cy / fy,
                                         span.near_plane, span.far_plane, span.order == DepthOrder::reversed});
    subject.camera.width = k.width;
    subject.camera.height = k.height;
    return subject;
}

Subject from_orthographic(FrustumEdges e, DepthSpan span, Convention convention) {
    return subject_of(orthographic(e, span, convention),
                      Frustum{true, e.left, e.right, e.bottom, e.top, span.near_plane, span.far_plane,
                              span.order == DepthOrder::reversed});
}

Subject from_matrix(const Eigen::Matrix4d& matrix, Convention convention) {
    Subject subject = subject_of(fathom::from_matrix(matrix, convention), std::nullopt);
    subject.matrix = to_quad(matrix);
    return subject;
}

Subject with_oblique_near_plane(Subject subject, const Eigen::Vector4d& plane) {
    subject.camera.projection = fathom::with_oblique_near_plane(subject.camera.projection, plane);
    subject.frustum->plane = {plane[0], plane[1], plane[2], plane[3]};
    return subject;
}

Subject named(Subject subject, std::string name, int width, int height) {
    subject.name = std::move(name);
    subject.camera.width = width;
    subject.camera.height = height;
    return subject;
}

Eigen::Matrix4d perspective_matrix(double slope_x, double slope_y, double near, double far) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
    m(0, 0) = 1 / slope_x;
    m(1, 1) = 1 / slope_y;
    m(2, 2) = -(far + near) / (far - near);
    m(2, 3) = -2 * far * near / (far - near);
    m(3, 2) = -1;
    return m;
}

Eigen::Matrix4d tilted(Eigen::Matrix4d matrix, double by_x, double by_y) {
    matrix(3, 0) = by_x;
    matrix(3, 1) = by_y;
    return matrix;
}

Eigen::Matrix4d moved(Eigen::Matrix4d matrix, const Eigen::Vector3d& centre) {
    Eigen::Matrix4d shift = Eigen::Matrix4d::Identity();
    shift.topRightCorner<3, 1>() = -centre;
    return matrix * shift;
}

Truth::Truth(const Subject& subject, Storage storage)
    : camera_(subject.camera), storage_(storage), frustum_(subject.frustum) {
    const Quad largest = storage_largest(storage);
    quotient_.v_low = counts_as_is(camera_.encoding) ? 0 : camera_.depth_range[0] * largest;
    quotient_.v_high = counts_as_is(camera_.encoding) ? 1 : camera_.depth_range[1] * largest;
    if (frustum_)
        set_frustum(*frustum_);
    else
        set_matrix(subject.matrix);
    if (camera_.encoding != Encoding::window)
        set_encoding();
}

void Truth::set_frustum(const Frustum& f) {
    const Quad columns = camera_.width, rows = camera_.height;
    const bool top_down = camera_.rows == Rows::top_down;
    const Sum x{0, 0, (f.right - f.left) / columns, 0, f.left};
    const Sum y{0, 0, 0, (top_down ? f.bottom - f.top : f.top - f.bottom) / rows, top_down ? f.top : f.bottom};
    const auto along_s = [&](Quad near, Quad far) { return f.reversed ? Sum{far, near} : Sum{near, far}; };
    is_orthographic_ = f.is_orthographic;
    quotient_.numerator.one = quotient_.denominator.one = 1;
    Sum& varying = f.is_orthographic ? quotient_.numerator : quotient_.denominator;
    if (!f.plane) {
        varying = f.is_orthographic ? along_s(f.near, f.far) : along_s(1 / f.near, 1 / f.far);
        return;
    }

    std::array<Quad, 4> c = *f.plane;
    for (std::size_t i = 0; i < 3; ++i)
        c[i] *= flip(camera_.projection.convention.view_axes)[i];
    const Quad across = (c[0] * f.left > c[0] * f.right ? c[0] * f.left : c[0] * f.right) +
                        (c[1] * f.bottom > c[1] * f.top ? c[1] * f.bottom : c[1] * f.top);
    if (f.is_orthographic) {
        const Quad k = across - c[2] * f.far + c[3];
        varying = along_s(0, -k / c[2]);
        varying.x = c[0] * x.x / c[2];
        varying.y = c[1] * y.y / c[2];
        varying.one = (c[0] * x.one + c[1] * y.one + c[3]) / c[2];
    } else {
        const Quad k = across - c[2] + c[3] / f.far;
        varying = along_s(0, k / c[3]);
        varying.x = -c[0] * x.x / c[3];
        varying.y = -c[1] * y.y / c[3];
        varying.one = -(c[0] * x.one + c[1] * y.one - c[2]) / c[3];
    }
}

void Truth::set_matrix(const Matrix& matrix) {
    Matrix canonical = matrix;
    for (auto& row : canonical)
        for (std::size_t j = 0; j < 3; ++j)
            row[j] *= flip(camera_.projection.convention.view_axes)[j];
    inverse_ = inverted(canonical);

    const bool up = (camera_.projection.convention.clip_y == ClipY::up) == (camera_.rows == Rows::top_down);
    const Quad clip_low = camera_.projection.convention.clip_z == ClipZ::negative_one_to_one ? -1 : 0;
    const auto row = [&](std::size_t i, Quad sign) {
        const auto& m = inverse_[i];
        const Quad y_sign = up ? -1 : 1;
        return Sum{sign * m[2] * clip_low, sign * m[2], sign * 2 * m[0] / camera_.width,
                   sign * y_sign * 2 * m[1] / camera_.height, sign * (m[3] - m[0] - y_sign * m[1])};
    };
    quotient_.numerator = row(2, -1);
    quotient_.denominator = row(3, 1);
    is_orthographic_ = canonical[3][0] == 0 && canonical[3][1] == 0 && canonical[3][2] == 0;
    if (!is_orthographic_ && inverse_[3][2] != 0)
        for (std::size_t i = 0; i < 3; ++i)
            centre_[i] = inverse_[i][2] / inverse_[3][2];
}

void Truth::set_encoding() {
    Sum &n = quotient_.numerator, &d = quotient_.denominator;
    n = d = {};
    const auto value = [](const std::optional<double>& field) { return quad(field.value_or(0)); };
    switch (camera_.encoding) {
    case Encoding::view_z:
        n.high = camera_.scale;
        d.one = 1;
        break;
    case Encoding::inverse:
        n.one = camera_.scale;
        d.high = 1;
        d.one = camera_.offset;
        break;
    case Encoding::inverse_range:
        n.one = 1;
        d.low = 1 / value(camera_.near_plane);
        d.high = 1 / value(camera_.far_plane);
        break;
    case Encoding::linear:
    case Encoding::pseudo_linear:
        n.low = value(camera_.near_plane);
        n.high = value(camera_.far_plane);
        d.one = 1;
        break;
    case Encoding::median: // m (1 + t)/(1 − t) with t = 2u − 1
        n.high = value(camera_.median);
        d.low = 1;
        break;
    case Encoding::logarithmic:
        rate_ = log1pq(camera_.log_c * value(camera_.far_plane));
        amplitude_ = 1 / quad(camera_.log_c);
        break;
    case Encoding::exponential:
        rate_ = logq(value(camera_.far_plane) / value(camera_.near_plane));
        amplitude_ = offset_ = value(camera_.near_plane);
        break;
    default:
        break;
    }
}

Quad Truth::depth(double v, double x, double y) const {
    if (is_infinitely_far(v))
        return HUGE_VAL;
    if (camera_.along == Along::ray)
        return along_ray(quotient_.at(v, x, y), x, y);
    switch (camera_.encoding) {
    case Encoding::ray_distance:
        return along_ray(quad(camera_.scale) * v, x, y) + beyond_centre();
    case Encoding::logarithmic:
    case Encoding::exponential:
        return amplitude_ * expm1q(rate_ * (v - quotient_.v_low) / (quotient_.v_high - quotient_.v_low)) + offset_;
    default:
        return quotient_.at(v, x, y);
    }
}

// From whichever side it is counted: scale / 0 has the sign of neither.
bool Truth::is_infinitely_far(double v) const {
    return camera_.encoding == Encoding::inverse && v == -camera_.offset;
}

Quad Truth::beyond_centre() const {
    return camera_.from_near_plane ? quad(camera_.near_plane.value_or(0)) : Quad{0};
}

bool Truth::in_range(double v) const {
    const bool is_float = storage_ == Storage::float32 || storage_ == Storage::float16;
    switch (camera_.encoding) {
    case Encoding::view_z:
        return !std::isnan(v);
    case Encoding::ray_distance:
        return camera_.scale < 0 ? v <= 0 : v >= 0;
    case Encoding::inverse:
        if (camera_.scale < 0)
            return v <= -camera_.offset && (is_float ? v >= -0x1p95 : v >= 0);
        return (is_float ? v >= 0 || camera_.offset != 0 : v >= 0) && v >= -camera_.offset && !(is_float && v > 0x1p95);
    default: {
        const double a = static_cast<double>(quotient_.v_low), b = static_cast<double>(quotient_.v_high);
        const double low = std::min(a, b), high = std::max(a, b);
        const auto beside = [](double limit, double towards) {
            const auto nearest = static_cast<float>(limit);
            const bool outside = towards < limit ? nearest <= limit : nearest >= limit;
            return outside ? nearest : std::nextafter(nearest, static_cast<float>(towards));
        };
        return v >= beside(low, -HUGE_VAL) && v <= beside(high, HUGE_VAL);
    }
    }
}

Point Truth::on_ray(Quad depth, Quad x, Quad y) const {
    const Quad from_left = x / camera_.width, from_first = y / camera_.height;
    if (frustum_) {
        const Frustum& f = *frustum_;
        const Quad from_top = camera_.rows == Rows::top_down ? from_first : 1 - from_first;
        const Quad right = f.left + (f.right - f.left) * from_left, up = f.top + (f.bottom - f.top) * from_top;
        return f.is_orthographic ? Point{right, up, -depth} : Point{right * depth, up * depth, -depth};
    }
    // The clip z at which the ray reaches the depth: −(b₃ + c u₃) = depth (b₄ + c u₄).
    const bool up = (camera_.projection.convention.clip_y == ClipY::up) == (camera_.rows == Rows::top_down);
    const Quad clip_x = 2 * from_left - 1, clip_y = up ? 1 - 2 * from_first : 2 * from_first - 1;
    std::array<Quad, 4> base;
    for (std::size_t i = 0; i < 4; ++i)
        base[i] = inverse_[i][0] * clip_x + inverse_[i][1] * clip_y + inverse_[i][3];
    const Quad clip_z = -(base[2] + depth * base[3]) / (inverse_[2][2] + depth * inverse_[3][2]);
    const Quad w = base[3] + clip_z * inverse_[3][2];
    Point point;
    for (std::size_t i = 0; i < 3; ++i)
        point[i] = (base[i] + clip_z * inverse_[i][2]) / w;
    return point;
}

Quad Truth::along_ray(Quad distance, Quad x, Quad y) const {
    // Any two points of the ray give its direction; orthographic rays start where the view depth is 0.
    const Quad start = -centre_[2];
    const Point a = is_orthographic_ ? on_ray(start, x, y) : centre_, b = on_ray(start + 1, x, y);
    return start + distance / length({b[0] - a[0], b[1] - a[1], b[2] - a[2]});
}

Point Truth::to_own(Point canonical) const {
    for (std::size_t i = 0; i < 3; ++i)
        canonical[i] *= flip(camera_.projection.convention.view_axes)[i];
    return canonical;
}

Point Truth::position(Quad depth, double x, double y) const {
    return to_own(on_ray(depth, x, y));
}

Point Truth::in_world(const Point& position, const Eigen::Vector3d& origin) const {
    const Matrix inverse = inverted(to_quad(*camera_.view));
    Point world;
    for (std::size_t i = 0; i < 3; ++i) {
        world[i] = inverse[i][3] - origin[static_cast<Eigen::Index>(i)];
        for (std::size_t j = 0; j < 3; ++j)
            world[i] += inverse[i][j] * position[j];
    }
    return world;
}

Quad Truth::condition(Form form, double v, double x, double y) const {
    const Quad range = quotient_.v_high - quotient_.v_low;
    const auto of = [&](const Sum& s) -> Quad {
        const Quad a = (s.high - s.low) / range * v;
        const Quad c = s.one + (s.low * quotient_.v_high - s.high * quotient_.v_low) / range;
        return (fabsq(a) + fabsq(s.x * x) + fabsq(s.y * y) + fabsq(c)) / fabsq(a + s.x * x + s.y * y + c);
    };
    switch (form) {
    case Form::affine:
        return of(quotient_.numerator);
    case Form::reciprocal_affine:
        return of(quotient_.denominator);
    case Form::rational:
        return of(quotient_.numerator) + of(quotient_.denominator);
    case Form::exponential: {
        // amplitude (e^(slope v + start) − 1) + offset: the sum within, as far as z feels it, and the sum without
        const Quad slope = rate_ / range, start = -slope * quotient_.v_low, z = depth(v, x, y);
        const Quad within = amplitude_ * expq(slope * v + start) * (fabsq(slope * v) + fabsq(start));
        return (within + fabsq(z - offset_) + fabsq(offset_)) / fabsq(z);
    }
    case Form::ray_distance:
    case Form::inverse_ray_distance: {
        // The sum with the place that the distance is counted from, and 2^-12 times that of the distance itself
        const Quad z = depth(v, x, y), from = beyond_centre() - centre_[2];
        const Quad distance = camera_.encoding == Encoding::ray_distance ? 0
                              : form == Form::ray_distance               ? of(quotient_.numerator)
                                                                         : of(quotient_.denominator);
        return (fabsq(z - from) + fabsq(from)) / fabsq(z) + 0x1p-12 * distance;
    }
    default:
        return 1; // counted from the end nearest to the pole: both terms are positive
    }
}

double ulp(Quad value) {
    const Quad size = fabsq(value);
    const int exponent = size == 0 ? -126 : std::max(ilogbq(size), -126);
    return std::ldexp(1.0, std::min(exponent, 127) - 23);
}

double error_in_ulp(float got, Quad exact) {
    const Quad first_infinite = 0x1.ffffffp127;
    if (std::isinf(got) && fabsq(exact) >= first_infinite && std::signbit(got) == (exact < 0))
        return 0;
    if (std::isinf(got) != (isinfq(exact) != 0))
        return std::numeric_limits<double>::infinity();
    return static_cast<double>(fabsq(got - exact) / ulp(exact));
}

} // namespace oracle
