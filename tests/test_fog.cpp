// fog against numerical quadrature of the density along each ray, in double. The tolerance is fog_error of the larger colour.

#include "camera_over.hpp"
#include "catch.hpp"
#include "images.hpp"
#include "test_device.hpp"

#include <fathom/fog.hpp>

using namespace fathom;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr double radians = 0.017453292519943295;

const Device& device() {
    static const Device opened = test_device();
    return opened;
}

// A camera of metric depth, and the start and direction (of length 1 along the view axis) of a pixel's ray in view space.
// Written from the definitions of the projections; shares no code with the library.
struct View {
    Camera camera;
    bool perspective;
    double half_width, half_height;                       // at distance one, or anywhere
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity(); // from the screen's axes to those of view space

    Eigen::Vector2d place(int x, int y) const {
        return {((x + 0.5) / camera.width * 2 - 1) * half_width, (1 - (y + 0.5) / camera.height * 2) * half_height};
    }
    Eigen::Vector3d start(int x, int y) const {
        const Eigen::Vector2d at = place(x, y);
        return perspective ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(at.x(), at.y(), 0);
    }
    Eigen::Vector3d direction(int x, int y) const {
        const Eigen::Vector2d at = place(x, y);
        const Eigen::Vector3d along = turned * Eigen::Vector3d(at.x(), at.y(), -1);
        return perspective ? Eigen::Vector3d(along / -along.z()) : Eigen::Vector3d(0, 0, -1);
    }
};

// A camera at a height that looks up by an angle, turned about its axis.
Eigen::Matrix4d view_matrix(double height, double pitch, double roll) {
    Eigen::Isometry3d world = Eigen::Isometry3d::Identity(); // from view to world
    world.translate(Eigen::Vector3d(3, height, -2));
    world.rotate(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()));
    world.rotate(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
    return world.inverse().matrix();
}

View view_of(bool perspective_camera, int width, int height, const Eigen::Matrix4d& view) {
    View v{{}, perspective_camera, 0, 0};
    if (perspective_camera) {
        v.camera = camera_over(perspective(60 * radians, 1.5, {0.1, 1000}), width, height);
        v.half_height = std::tan(30 * radians);
        v.half_width = 1.5 * v.half_height;
    } else {
        v.camera = camera_over(orthographic({-6, 6, -4, 4}, {0.1, 1000}), width, height);
        v.half_width = 6, v.half_height = 4;
    }
    v.camera.encoding = Encoding::view_z;
    v.camera.view = view;
    return v;
}

// The integral of density exp(-falloff (h0 + slope s - reference)) from `begin` to `end`: Gauss and Legendre's rule of eight
// points on stretches over which the density changes by less than a half.
double quadrature(const FogOptions& fog, double h0, double slope, double begin, double end) {
    constexpr double at[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    constexpr double weight[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    if (!(end > begin))
        return 0;
    const double rate = fog.height_falloff * std::abs(slope);
    // Farther than this from its lower end, the density is below the roundings of what lies there.
    if (fog.height_falloff * slope > 0)
        end = std::min(end, begin + 45 / rate);
    else if (rate > 0)
        begin = std::max(begin, end - 45 / rate);
    const int parts = std::max(1, static_cast<int>(std::ceil(rate * (end - begin) * 2)));
    double sum = 0;
    for (int part = 0; part < parts; ++part) {
        const double half = (end - begin) / parts / 2, middle = begin + (2 * part + 1) * half;
        for (int i = 0; i < 4; ++i)
            for (const double side : {-1.0, 1.0}) {
                const double s = middle + side * at[i] * half;
                sum += weight[i] * half * std::exp(-fog.height_falloff * (h0 + slope * s - fog.reference_height));
            }
    }
    return fog.density * sum;
}

// Part of the fog that a pixel of depth z has.
double share_of(const View& view, const FogOptions& fog, int x, int y, float z) {
    if (std::isnan(z) || (std::isinf(z) && fog.sky == FogSky::keep))
        return 0;
    const Eigen::Matrix4d world = view.camera.view->inverse();
    const Eigen::Vector3d up = fog.up.normalized(), direction = view.direction(x, y);
    const double h0 = up.dot(world.topLeftCorner<3, 3>() * view.start(x, y) + world.topRightCorner<3, 1>());
    const double slope = up.dot(world.topLeftCorner<3, 3>() * direction) / direction.norm();
    const double end = static_cast<double>(z) * direction.norm();
    const bool hidden = std::isinf(z) && !(fog.height_falloff * slope > 0);
    const double depth = hidden ? (fog.density > 0 ? HUGE_VAL : 0) : quadrature(fog, h0, slope, fog.start, end);
    return std::min(-std::expm1(-depth), static_cast<double>(static_cast<float>(fog.max_opacity)));
}

struct Picture {
    std::vector<float> depth, color;
};

Picture picture(int width, int height, int channels, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(0, 1);
    Picture made;
    for (int i = 0; i < width * height; ++i) {
        const float z = 0.1f * std::exp(value(random) * 9);
        made.depth.push_back(i % 29 == 5 ? infinity : i % 31 == 7 ? NAN : z);
        for (int c = 0; c < channels; ++c)
            made.color.push_back(value(random) * (c < 3 && i % 5 == 0 ? 40 : 1));
    }
    return made;
}

StoredDepth stored_of(const Device& on, const std::vector<float>& depth, const Camera& camera) {
    return {Image::from_host(on, Element::f32, depth.data(), {camera.width, camera.height}), camera};
}

std::vector<float> fogged(const Device& on, const Picture& given, const View& view, int channels,
                          const FogOptions& fog) {
    const Layout layout{view.camera.width, view.camera.height, channels};
    const Image color = Image::from_host(on, Element::f32, given.color.data(), layout);
    return images::floats(fathom::fog(stored_of(on, given.depth, view.camera), color, fog));
}

// The largest error, in 2^-24 of the larger of the two colours, of pixels that show one surface each.
double worst_error(const View& view, FogOptions fog, int channels, std::uint32_t seed = 1,
                   Arithmetic arithmetic = Arithmetic::automatic) {
    fog.whole_pixels = true;
    const int width = view.camera.width, height = view.camera.height;
    const Picture given = picture(width, height, channels, seed);
    const Device on = arithmetic == Arithmetic::automatic ? device() : test_device({.arithmetic = arithmetic});
    const std::vector<float> result = fogged(on, given, view, channels, fog);
    double worst = 0;
    for (int i = 0; i < width * height; ++i) {
        const auto first = static_cast<std::size_t>(i * channels);
        const double share = share_of(view, fog, i % width, i / width, given.depth[static_cast<std::size_t>(i)]);
        const double alpha =
            channels == 4 && fog.alpha == FogAlpha::premultiplied ? static_cast<double>(given.color[first + 3]) : 1;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto own = static_cast<double>(given.color[first + c]);
            const double of_fog = static_cast<double>(static_cast<float>(fog.fog_color[c])) * alpha;
            const double expected = own * (1 - share) + of_fog * share;
            const double off = std::abs(static_cast<double>(result[first + c]) - expected);
            worst = std::max(worst, off / std::max(std::abs(own), std::abs(of_fog)) * 0x1p24);
        }
        if (channels == 4)
            CHECK(images::same_bits(result[first + 3], given.color[first + 3]));
    }
    return worst;
}

void check_error(const char* what, double worst) {
    std::printf("  %-60s %.2f of 2^-24\n", what, worst);
    CHECK(worst * 0x1p-24 <= fog_error);
}

FogOptions height_fog(double density, double falloff, double start = 0) {
    return {.density = density, .start = start, .height_falloff = falloff, .reference_height = 1};
}

} // namespace

TEST_CASE("fog: uniform fog is one minus the exponential of the distance along the ray", "[fog]") {
    for (const bool perspective_camera : {true, false}) {
        const View view = view_of(perspective_camera, 67, 21, view_matrix(2, 0.2, 0.1));
        double worst = 0;
        for (const double density : {0.0, 1e-12, 1e-5, 0.01, 0.1, 3.0, 1e6})
            for (const double start : {0.0, 7.5})
                for (const int channels : {3, 4})
                    worst = std::max(worst, worst_error(view, {.density = density, .start = start}, channels));
        check_error(perspective_camera ? "uniform, perspective" : "uniform, orthographic", worst);
    }
}

TEST_CASE("fog: height fog is the integral of its density along the ray", "[fog]") {
    for (const bool perspective_camera : {true, false}) {
        double worst = 0;
        for (const double pitch : {0.0, 0.5, -0.5, 1.4, -1.4}) {
            const View view = view_of(perspective_camera, 35, 13, view_matrix(2, pitch, 0.3));
            for (const auto& [density, falloff] :
                 {std::pair{1e-9, 0.3}, {0.02, 0.3}, {0.3, 1e-7}, {5.0, 2.0}, {1e5, 8.0}, {1e-4, 0.05}})
                for (const double start : {0.0, 3.0})
                    worst = std::max(worst, worst_error(view, height_fog(density, falloff, start), 3));
        }
        check_error(perspective_camera ? "height, perspective" : "height, orthographic", worst);
    }
}

TEST_CASE("fog: level rays and those nearly level lose nothing", "[fog]") {
    // An odd number of rows: the middle one is level. The tilt then makes it almost so.
    double worst = 0;
    for (const double pitch : {0.0, 1e-16, 1e-12, -1e-9, 1e-6, -1e-4})
        for (const bool perspective_camera : {true, false})
            for (const double falloff : {1e-3, 0.5, 20.0})
                worst = std::max(worst, worst_error(view_of(perspective_camera, 33, 9, view_matrix(1.5, pitch, 0)),
                                                    height_fog(0.05, falloff), 3));
    check_error("level rays", worst);
}

TEST_CASE("fog: a screen that is turned from the view axis loses nothing, nor does its sky", "[fog]") {
    double worst = 0;
    const Eigen::Matrix4d straight = perspective(60 * radians, 1.5, {0.1, 1000}).matrix.cast<double>();
    for (const Arithmetic arithmetic : {Arithmetic::automatic, Arithmetic::two_float})
        for (const double pitch : {-0.4, 0.7}) // the second one looks up: the sky shows above height fog
            for (const double falloff : {0.0, 0.05, 3.0})
                for (const double start : {0.0, 3.0}) {
                    View view = view_of(true, 35, 13, view_matrix(2, pitch, 0.3));
                    view.turned = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix();
                    Eigen::Matrix4d from_view = Eigen::Matrix4d::Identity();
                    from_view.topLeftCorner<3, 3>() = view.turned.transpose();
                    view.camera.projection = from_matrix(straight * from_view);
                    worst = std::max(worst, worst_error(view, height_fog(0.05, falloff, start), 3, 1, arithmetic));
                }
    check_error("turned screen", worst);
}

TEST_CASE("fog: the opacity ends, and a straight alpha does not weigh the fog", "[fog]") {
    FogOptions fog{.density = 0.2, .max_opacity = 0.6, .fog_color = {2, 0.1, 0}};
    const View view = view_of(true, 35, 13, view_matrix(2, 0.2, 0));
    check_error("opacity of 0.6", worst_error(view, fog, 3));
    fog.alpha = FogAlpha::straight;
    check_error("straight alpha", worst_error(view, fog, 4));
}

TEST_CASE("fog: the sky is hidden, left alone, or seen through what fog lies above", "[fog]") {
    const View view = view_of(true, 5, 4, view_matrix(2, 0, 0)); // two rows up, two rows down
    Picture given = picture(5, 4, 3, 9);
    std::ranges::fill(given.depth, infinity);
    const auto red = [&](const FogOptions& fog, std::size_t row) {
        return fogged(device(), given, view, 3, fog)[15 * row];
    };
    FogOptions uniform{.density = 1e-6, .fog_color = {0.25, 0, 0}};
    CHECK(red(uniform, 0) == 0.25f);
    CHECK(red(uniform, 3) == 0.25f);
    uniform.sky = FogSky::keep;
    CHECK(red(uniform, 0) == given.color[0]);
    uniform.sky = FogSky::fog;
    uniform.density = 0;
    CHECK(red(uniform, 0) == given.color[0]);
    FogOptions thin = height_fog(0.01, 0.5);
    thin.fog_color = {0.25, 0, 0};
    CHECK(red(thin, 3) == 0.25f);
    CHECK(red(thin, 0) != 0.25f);
    check_error("sky", worst_error(view, thin, 3));
}

TEST_CASE("fog: what has no depth keeps its colour, and so does what is not finite", "[fog]") {
    const View view = view_of(true, 4, 1, view_matrix(2, 0, 0));
    const Picture given{{NAN, -1, 5, 5}, {1, 2, 3, 4, 5, 6, NAN, infinity, 1, -infinity, 1, 1}};
    for (const FogOptions& fog : {FogOptions{.density = 1}, height_fog(1, 0.2)}) {
        const std::vector<float> result = fogged(device(), given, view, 3, fog);
        for (const std::size_t i : {0, 1, 2, 3, 4, 5, 6, 7, 9})
            CHECK((images::same_bits(result[i], given.color[i]) || (std::isnan(result[i]) && i == 6)));
        CHECK(result[8] != 1);
    }
}

TEST_CASE("fog: pictures of halves and of integers are those of floats, rounded", "[fog]") {
    const int width = 37, height = 3;
    const View view = view_of(true, width, height, view_matrix(2, 0, 0));
    const Picture given = picture(width, height, 4, 5);
    const FogOptions fog{.density = 0.1};
    const auto check_codes = [&]<typename Code>(Code most, Element element) {
        std::vector<Code> codes;
        Picture exact = given;
        for (float& value : exact.color) {
            codes.push_back(static_cast<Code>(std::lround(std::min(value, 1.0f) * static_cast<float>(most))));
            value = static_cast<float>(codes.back()) / static_cast<float>(most);
        }
        std::vector<Code> expected;
        for (const float value : fogged(device(), exact, view, 4, fog))
            expected.push_back(static_cast<Code>(std::floor(static_cast<double>(value) * most + 0.5)));
        for (const int vector_width : {16, 8, 4, 1}) {
            const Device on = test_device({.vector_width = vector_width});
            const Image color = Image::from_host(on, element, codes.data(), {width, height, 4});
            std::vector<Code> result(codes.size());
            fathom::fog(stored_of(on, given.depth, view.camera), color, fog).download(result.data());
            CHECK(result == expected);
        }
    };
    check_codes(std::uint8_t{255}, Element::u8);
    check_codes(std::uint16_t{65535}, Element::u16);
    const std::size_t values = given.color.size();
    for (const Element element : {Element::f16, Element::u16}) {
        const std::vector<std::uint16_t> zeros(values);
        const Image color = Image::from_host(device(), element, zeros.data(), {width, height, 4});
        const Image result = fathom::fog(stored_of(device(), given.depth, view.camera), color,
                                         {.density = 1e9, .fog_color = {1, 1, 1}, .alpha = FogAlpha::straight});
        std::vector<std::uint16_t> got(values);
        result.download(got.data());
        CHECK(got[0] == (element == Element::f16 ? 0x3c00 : 0xffff));
        CHECK(got[3] == 0);
    }
}

// A straight edge between two surfaces at every angle, as a picture shows it that has the mean of each pixel, by 32 x 32 samples.
// Each side's colour and fog are the same all over, so that the truth is the same mean of both sides' foggy colours.
TEST_CASE("fog: each side of an antialiased edge has its own fog", "[fog]") {
    constexpr int size = 24, samples = 32;
    // Two pixels along the nearest of 16 ways may lead to a pixel of which a hundredth is on the other side.
    constexpr double most_off = 0.005;
    constexpr float near_z = 2, far_z = 30;
    const FogOptions fog{.density = 0.1, .fog_color = {0.5, 0.55, 0.6}};
    View view = view_of(true, size, size, view_matrix(2, 0, 0));
    std::mt19937 random(5);
    std::uniform_real_distribution<double> value(0, 1);
    double worst = 0, worst_whole = 0;
    for (int round = 0; round < 60; ++round) {
        INFO(round);
        const double angle = 6.283185307179586 * value(random), at = value(random) - 0.5;
        const auto is_near = [&](double x, double y) {
            return (x - size / 2.0) * std::cos(angle) + (y - size / 2.0) * std::sin(angle) < at;
        };
        std::array<double, 3> near{}, far{};
        for (std::size_t k = 0; k < 3; ++k) {
            near[k] = 0.3 * value(random);
            far[k] = 0.5 + 0.5 * value(random);
        }
        const bool is_sky = round % 3 == 0;
        Picture given;
        std::vector<double> part;
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                int count = 0;
                for (int i = 0; i < samples * samples; ++i)
                    count += is_near(x + (i % samples + 0.5) / samples, y + (i / samples + 0.5) / samples);
                part.push_back(static_cast<double>(count) / (samples * samples));
                given.depth.push_back(is_near(x + 0.5, y + 0.5) ? near_z : is_sky ? infinity : far_z);
                for (std::size_t k = 0; k < 3; ++k)
                    given.color.push_back(static_cast<float>(part.back() * near[k] + (1 - part.back()) * far[k]));
            }
        FogOptions whole = fog;
        whole.whole_pixels = true;
        const std::vector<float> got = fogged(device(), given, view, 3, fog),
                                 as_whole = fogged(device(), given, view, 3, whole);
        for (int y = 2; y < size - 2; ++y)
            for (int x = 2; x < size - 2; ++x) {
                const auto i = static_cast<std::size_t>(y * size + x);
                const double near_fog = share_of(view, fog, x, y, near_z),
                             far_fog = share_of(view, fog, x, y, is_sky ? infinity : far_z);
                for (std::size_t k = 0; k < 3; ++k) {
                    const double exact = part[i] * (near[k] * (1 - near_fog) + fog.fog_color[k] * near_fog) +
                                         (1 - part[i]) * (far[k] * (1 - far_fog) + fog.fog_color[k] * far_fog);
                    worst = std::max(worst, std::abs(static_cast<double>(got[3 * i + k]) - exact));
                    worst_whole = std::max(worst_whole, std::abs(static_cast<double>(as_whole[3 * i + k]) - exact));
                }
                bool is_edge = false; // within two pixels
                for (int j = 0; j < 25; ++j)
                    is_edge |= given.depth[i + static_cast<std::size_t>((j / 5) * size + j % 5) -
                                           static_cast<std::size_t>(2 * size + 2)] != given.depth[i];
                for (std::size_t k = 0; k < 3 && !is_edge; ++k)
                    CHECK(images::same_bits(got[3 * i + k], as_whole[3 * i + k]));
            }
    }
    std::printf("  an antialiased edge: off by %.4f, as whole pixels by %.4f\n", worst, worst_whole);
    CHECK(worst <= most_off);
    CHECK(worst_whole > 10 * most_off);
}

TEST_CASE("fog: options out of range and images that do not fit are refused by name", "[fog]") {
    View view = view_of(true, 4, 2, view_matrix(2, 0, 0));
    const Picture given = picture(4, 2, 3, 6);
    view.camera.view.reset();
    CHECK_THROWS_WITH(fogged(device(), given, view, 3, {.density = 0, .height_falloff = 1}),
                      ContainsSubstring("view matrix"));
    const StoredDepth depth = stored_of(device(), given.depth, view.camera);
    CHECK_THROWS_AS(fathom::fog(depth, Image(device(), Element::f32, {4, 3, 3}), {.density = 0}),
                    std::invalid_argument);
    CHECK_THROWS_AS(fathom::fog(depth, Image(device(), Element::f32, {4, 2, 2}), {.density = 0}),
                    std::invalid_argument);
    const Image color(device(), Element::f32, {4, 2, 3});
    CHECK_THROWS_AS(fathom::fog(depth, color, color, {.density = 0}), std::invalid_argument);
}
