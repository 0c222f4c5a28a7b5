// dof against the truth: edges, points, plain, ramp and bent images, layers before one another, in circles and polygons;
// then what it does where there is nothing to blur, or nothing to know, and tiles beyond whose halo something hides or ends.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "lens_blur.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using images::floats;
using images::same_bits;
using lens_blur::half_plane;
using lens_blur::Layer;

namespace {

// A lens whose circle is 1000 - 1000/z pixels: any circle below 1000 has its depth.
constexpr double k = 1000, g = 1000;
const CircleOfConfusion lens{.k = k, .g = g};

float depth_of(double circle) {
    return static_cast<float>(g / (k - circle));
}

/// An image and its depth, as functions of the pixel.
struct Picture {
    int width, height;
    std::vector<float> depth, color; // three channels

    Picture(int across, int down, const std::function<double(int, int)>& circle,
            const std::function<double(int, int)>& value)
        : width(across), height(down) {
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x) {
                depth.push_back(depth_of(circle(x, y)));
                const auto v = static_cast<float>(value(x, y));
                color.insert(color.end(), {v, 0.5f * v, 1 - v});
            }
    }
};

Camera camera_of(int width, int height) {
    return {.projection = perspective(1.0, static_cast<double>(width) / height, {0.01, 100}),
            .width = width,
            .height = height,
            .encoding = Encoding::view_z};
}

const Device& default_device() {
    return oracle::device();
}

/// All channels of the blurred picture.
std::vector<float> blurred(const Picture& picture, const CircleOfConfusion& coc, const DofOptions& options = {},
                           const Device& device = default_device()) {
    const Image depth = Image::from_host(device, Element::f32, picture.depth.data(), {picture.width, picture.height});
    const int channels = static_cast<int>(picture.color.size() / picture.depth.size());
    const Image color =
        Image::from_host(device, Element::f32, picture.color.data(), {picture.width, picture.height, channels});
    return floats(dof({depth, camera_of(picture.width, picture.height)}, color, coc, options));
}

std::vector<float> blurred(const Picture& picture, const DofOptions& options = {},
                           const Device& device = default_device()) {
    return blurred(picture, lens, options, device);
}

double first_channel(const std::vector<float>& image, int width, int x, int y) {
    return static_cast<double>(
        image[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x))]);
}

/// The worst difference, and the root of the mean square, of a row of pixels.
struct Off {
    double largest = 0, square = 0;
    long count = 0;

    void add(double difference) {
        largest = std::max(largest, std::abs(difference));
        square += difference * difference;
        ++count;
    }
    double rms() const { return std::sqrt(square / static_cast<double>(std::max(count, 1L))); }
    void add(const Off& other) {
        largest = std::max(largest, other.largest);
        square += other.square;
        count += other.count;
    }
};

struct Shape {
    const char* name;
    Aperture aperture;
    lens_blur::ApertureShape aperture_shape;
};
const Shape shapes[] = {{"circle", {}, {}},
                        {"triangle", {3, 0}, {3, 0}},
                        {"pentagon", {5, 17}, {5, 17}},
                        {"square", {4, 45}, {4, 45}},
                        {"hexagon", {6, 10}, {6, 10}},
                        {"anamorphic", {0, 0, 2}, {0, 0, 2}},
                        {"ellipse", {0, 30, 0.4}, {0, 30, 0.4}}};

// The error allowed to fast along a straight edge of a round aperture: it has three layers an octave and sums two or
// more rows at once.
constexpr double fast_rms_error = 0.01;

const std::pair<const char*, Quality> qualities[] = {
    {"balanced", Quality::balanced}, {"fast", Quality::fast}, {"accurate", Quality::accurate}};

/// Layers whose edges run down or across the image, `at` the pixel border, and what the truth makes of them: the value of the
/// layer nearest to the lens is the picture's.
struct Stack {
    std::vector<Layer> layers; // of x only
    int half;                  // pixels from the middle to the sides

    Picture picture(bool across) const {
        const auto front = [this, across](int x, int y) -> const Layer& {
            const double at = (across ? y : x) + 0.5 - half;
            for (const Layer& layer : layers)
                if (layer.here(at))
                    return layer;
            return layers.back();
        };
        return Picture(
            2 * half, 2 * half, [&](int x, int y) { return front(x, y).circle; },
            [&](int x, int y) { return front(x, y).color((across ? y : x) + 0.5 - half); });
    }
};

/// How a stack's middle row (column) differs from the truth where that changes, and by how much elsewhere.
Off judge(const Stack& stack, bool across, const DofOptions& options, const std::function<double(double)>& truth,
          int reach) {
    const Picture picture = stack.picture(across);
    const auto got = blurred(picture, options);
    Off off;
    for (int i = stack.half - reach; i < stack.half + reach; ++i) {
        const double value = first_channel(got, picture.width, across ? stack.half : i, across ? i : stack.half);
        off.add(value - truth(i + 0.5 - stack.half));
    }
    return off;
}

Layer everywhere(double circle, const std::function<double(double)>& color) {
    return {circle, [](double) { return true; }, color};
}
Layer left_of(double edge, double circle, double color) {
    return {circle, [edge](double x) { return x < edge; }, [color](double) { return color; }};
}

/// The truth along one axis.
std::function<double(double)> truth_of(const Stack& stack, bool across,
                                       const lens_blur::ApertureShape& aperture_shape) {
    static std::map<std::tuple<int, double, double, bool>, std::vector<double>> known;
    auto& shares = known[{aperture_shape.corners, aperture_shape.turned_degrees, aperture_shape.ratio, across}];
    if (shares.empty())
        shares = lens_blur::shares(aperture_shape, across);
    return [layers = stack.layers, &shares](double x) { return lens_blur::light(layers, shares, x); };
}

/// The same with edges that run down and edges that run across.
Off judge(const Stack& stack, Quality quality, int reach, const Shape& shape = shapes[0]) {
    Off off;
    for (const bool across : {false, true})
        off.add(judge(stack, across, {.aperture = shape.aperture, .quality = quality},
                      truth_of(stack, across, shape.aperture_shape), reach));
    return off;
}

/// Prints the measured errors. Checks the promised bound where there is one, otherwise the known size of the error.
void check(const Off& off, bool promised, double largest, double rms) {
    std::printf("  %.4f %.4f", off.largest, off.rms());
    CHECK(off.largest <= (promised ? dof_edge_error : largest));
    CHECK(off.rms() <= (promised ? dof_edge_rms_error : rms));
}

/// A scene of slopes with its horizon in row 0.
struct Outdoors {
    std::vector<lens_blur::Slope> layers;
    static constexpr int half = 64, above = 72, below = 80;

    Picture picture() const {
        const auto front = [this](int x, int y) -> const lens_blur::Slope& {
            return *std::ranges::find_if(layers,
                                         [&](const auto& l) { return l.here(x + 0.5 - half, y + 0.5 - above); });
        };
        return Picture(
            2 * half, above + below,
            [&](int x, int y) { return front(x, y).circle + front(x, y).each_row * (y + 0.5 - above); },
            [&](int x, int y) { return front(x, y).color; });
    }
};

/// Some pixels on both sides of column 0, in rows from `top` to before `bottom`, and what the lens makes of them.
struct Rim {
    int top, bottom;
    std::vector<std::pair<std::pair<int, int>, double>> truth = {};

    void look_at(const Outdoors& scene) {
        for (int y = top; y < bottom; y += 3)
            for (int x = -14; x < 14; x += 2)
                truth.push_back({{x, y}, lens_blur::light(scene.layers, {}, x + 0.5, y + 0.5)});
    }
    Off judge(const std::vector<float>& got) const {
        Off off;
        for (const auto& [at, light] : truth)
            off.add(first_channel(got, 2 * Outdoors::half, at.first + Outdoors::half, at.second + Outdoors::above) -
                    light);
        return off;
    }
};

/// Along one axis, of a disc cut into columns of a pixel: a pixel of the image is a square. Nearly r^2/4 + 1/12.
double variance_of_disc(double radius) {
    double sum = 0;
    for (int x = 1; x <= radius + 1; ++x)
        sum += 2 * x * x * (half_plane((x + 0.5) / radius) - half_plane((x - 0.5) / radius));
    return sum;
}

/// A picture and its depth as a clean plate; the images use the memory of the picture.
CleanPlate clean_plate_of(const Picture& picture, const Device& device = default_device()) {
    const Layout pixels{picture.width, picture.height};
    return {Image::from_host(device, Element::f32, picture.color.data(), {pixels.width, pixels.height, 3}),
            {Image::from_host(device, Element::f32, picture.depth.data(), pixels),
             camera_of(picture.width, picture.height)}};
}

/// A stack blurred with a clean plate that shows what lies behind its first layer.
std::vector<float> with_clean_plate(const Stack& stack, bool across, DofOptions options) {
    const Picture clean_plate = Stack{{stack.layers.begin() + 1, stack.layers.end()}, stack.half}.picture(across);
    options.clean_plate = clean_plate_of(clean_plate);
    return blurred(stack.picture(across), options);
}

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();

/// A picture with every circle from -30 to 30 pixels, sky, invalid pixels, edges and highlights.
Picture mixed(int width = 150, int height = 70) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(0, 1);
    Picture picture(
        width, height,
        [&](int x, int y) {
            return (x / 20 + y / 15) % 3 == 0 ? -15 + 0.1 * x : (x / 20 + y / 15) % 3 == 1 ? 0.2 * y : 30 - 0.1 * x;
        },
        [&](int, int) { return any(random); });
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(y * width + x); };
    for (int y = 5; y < 9 && y < height; ++y)
        for (int x = 20; x < 27 && x < width; ++x)
            picture.depth[at(x, y)] = x < 23 ? inf : not_a_number;
    for (int i = 0; i < 3 && width > 60 && height > 30; ++i) {
        picture.color[3 * at(40, 30) + static_cast<std::size_t>(i)] = 1e4f;
        picture.color[3 * at(60, 20) + static_cast<std::size_t>(i)] = i == 1 ? not_a_number : inf;
    }
    return picture;
}

} // namespace

TEST_CASE("dof: the truth by quadrature is the formula's", "[dof]") {
    const double radius = 10;
    const Stack edge{{everywhere(2 * radius, [](double x) { return x > 0 ? 1 : 0; })}, 0};
    const Stack two{{left_of(0, -8, 3), everywhere(12, [](double x) { return x > 3 ? 1 : 0.25; })}, 0};
    double worst = 0;
    for (double x = -11; x <= 11; x += 0.37) {
        worst = std::max(worst, std::abs(truth_of(edge, false, {})(x) - half_plane(x / radius)));
        const double a = -x / 4, b = (x - 3) / 6, m = std::max(a, b);
        const double stacked = 3 * half_plane(a) + 1 * (half_plane(m) - half_plane(a)) + 0.25 * (1 - half_plane(m));
        worst = std::max(worst, std::abs(truth_of(two, false, {})(x) - stacked));
    }
    std::printf("dof, quadrature against the formulas: %.1e\n", worst);
    CHECK(worst < 5e-4); // 4096 positions along the lens
}

TEST_CASE("dof: a straight edge is spread as the aperture says", "[dof]") {
    for (const auto& [quality_name, quality] : qualities) {
        std::printf("dof, %s, edge: radius: largest error, root mean square\n", quality_name);
        const bool promised = quality != Quality::fast;
        for (const Shape& shape : shapes) {
            std::printf("  %-9s", shape.name);
            for (const double radius :
                 {1.0, 1.3, 2.0, 2.7, 4.0, 5.6, 8.0, 11.0, 15.9, 16.0, 22.6, 32.0, 45.3, 64.0, 128.0}) {
                const bool ellipse = shape.aperture.ratio != 1;
                if ((shape.aperture.blades || ellipse) && radius > 64)
                    continue;
                if (ellipse && radius != 1.3 && radius != 2.7 && radius != 8 && radius != 22.6 && radius != 45.3)
                    continue; // half the radii are between those of the circle
                Off off;
                for (const double sign : {1.0, -1.0}) {
                    const int reach = static_cast<int>(radius) + 2;
                    const Stack edge{{everywhere(2 * sign * radius, [](double x) { return x > 0 ? 1 : 0; })},
                                     2 * reach}; // borders stay out of it
                    off.add(judge(edge, quality, reach, shape));
                }
                std::printf("  %g: %.4f %.4f", radius, off.largest, off.rms());
                INFO(shape.name << ", " << quality_name << ", radius " << radius);
                if (promised) {
                    CHECK(off.largest <= dof_edge_error);
                    CHECK(off.rms() <= dof_edge_rms_error);
                } else {
                    CHECK(off.rms() <=
                          (shape.aperture.blades == 3 || shape.aperture.blades == 4 ? 0.03 : fast_rms_error));
                }
            }
            std::printf("\n");
        }
    }
}

// Large apertures are summed over cells of up to 8 x 8 pixels: an edge lies anywhere in one.
TEST_CASE("dof: a straight edge is as exact wherever it lies between the cells that are summed", "[dof]") {
    std::printf("dof, edges in 8 places: radius: largest error, root mean square of the worst\n");
    for (const auto& [quality_name, quality] : {qualities[0], qualities[1]}) {
        std::printf("  %-8s", quality_name);
        for (const double radius : {9.0, 14.0, 16.0, 19.0, 28.0, 33.0, 56.0, 71.0}) {
            Off worst;
            double rms = 0;
            for (int place = 0; place < 8; ++place) {
                const int reach = static_cast<int>(radius) + 2 + place;
                const Stack edge{{everywhere(2 * radius, [place](double x) { return x > place ? 1 : 0; })}, 2 * reach};
                const Off off = judge(edge, quality, reach);
                worst.add(off);
                rms = std::max(rms, off.rms());
            }
            std::printf("  %g: %.4f %.4f", radius, worst.largest, rms);
            INFO(quality_name << ", radius " << radius);
            CHECK(rms <= (quality == Quality::fast ? fast_rms_error : dof_edge_rms_error));
            if (quality != Quality::fast)
                CHECK(worst.largest <= dof_edge_error);
        }
        std::printf("\n");
    }
}

TEST_CASE("dof: one layer before another bleeds nowhere", "[dof]") {
    const auto plain = [](double) { return 0.0; };
    for (const auto& [quality_name, quality] : qualities) {
        std::printf(
            "dof, %s, radius: sharp before blurred, blurred before sharp, both before the focus, both behind it, "
            "across it: largest error, root mean square\n",
            quality_name);
        const bool promised = quality != Quality::fast;
        for (const double radius : {1.0, 2.0, 3.3, 8.0, 16.0, 27.0, 64.0}) {
            const int reach = 2 * static_cast<int>(radius) + 2, half = 2 * reach + 8;
            const std::pair<double, double> circles[] = {
                {0, 2 * radius}, {-2 * radius, 0}, {-2 * radius, -radius}, {radius, 2 * radius}, {-radius, 2 * radius}};
            std::printf("  %-4g", radius);
            for (const auto& [front, back] : circles) {
                const Stack stack{{left_of(0, front, 1), everywhere(back, plain)}, half};
                const Off off = judge(stack, quality, reach);
                INFO(quality_name << ", radius " << radius << ", circles " << front << " and " << back);
                check(off, promised, 0.02, 0.006);
                if (front == 0)
                    CHECK(off.largest <= 1e-6);
            }
            std::printf("\n");
        }
    }
}

// What part of a layer the one before it hides depends on where in the lens it is hidden: shares alone cannot know. Where the
// hidden part has another colour than the rest, the error is of the order of what is hidden, unless the part is kept.
TEST_CASE("dof: two edges before one another are known to be off, unless accurate", "[dof]") {
    for (const auto& [quality_name, quality] : qualities) {
        std::printf(
            "dof, %s, two edges: sharp behind, across the focus, both before it, both behind it: largest error, "
            "root mean square\n",
            quality_name);
        const bool accurate = quality == Quality::accurate;
        for (const double radius : {2.0, 4.5, 8.0, 13.0, 20.0, 32.0}) {
            if (!accurate && radius != 2 && radius != 8 && radius != 32)
                continue;
            const int reach = 2 * static_cast<int>(radius) + 2, half = 2 * reach + 8;
            std::printf("  %-4g", radius);
            for (const auto& [front, back] :
                 {std::pair{-2 * radius, 0.0}, {-2 * radius, radius}, {-2 * radius, -radius}, {radius, 2 * radius}}) {
                Off off;
                for (const double part : {0.25, 0.5, 1.0}) {
                    if (!accurate && part != 0.5)
                        continue;
                    const double at = std::max(1.0, std::round(part * radius)); // something behind is seen
                    const auto step = [at](double x) { return x > at ? 1.0 : 0.0; };
                    const Stack stack{{left_of(0, front, 1), everywhere(back, step)}, half};
                    off.add(judge(stack, quality, reach));
                }
                INFO(quality_name << ", radius " << radius << ", circles " << front << " and " << back);
                check(off, accurate, 0.25, 0.06);
            }
            std::printf("\n");
        }
    }
    std::printf("dof, accurate, two edges, as above, radius 13:\n");
    for (const Shape& shape : shapes) {
        constexpr double radius = 13;
        constexpr int reach = 28, half = 64;
        std::printf("  %-9s", shape.name);
        for (const auto& [front, back] :
             {std::pair{-2 * radius, 0.0}, {-2 * radius, radius}, {-2 * radius, -radius}, {radius, 2 * radius}}) {
            const Stack stack{{left_of(0, front, 1), everywhere(back, [](double x) { return x > 6 ? 1.0 : 0.0; })},
                              half};
            INFO(shape.name << ", circles " << front << " and " << back);
            check(judge(stack, Quality::accurate, reach, shape), true, 0, 0);
        }
        std::printf("\n");
    }
}

// A half-plane before a wall, whose colours are filtered over a box of `width` pixels while depth is a point sample, as every
// antialiased render has them.
namespace {
struct Antialiased {
    double angle, offset, front, behind, width;
    static constexpr int half = 40;

    double distance(int x, int y) const {
        return (x + 0.5 - half) * std::cos(angle) + (y + 0.5 - half) * std::sin(angle) - offset;
    }
    Picture picture() const {
        constexpr int samples = 16;
        const auto covered = [&](int x, int y) {
            int inside = 0;
            for (int i = 0; i < samples * samples; ++i) {
                const double dx = ((i % samples + 0.5) / samples - 0.5) * width,
                             dy = ((i / samples + 0.5) / samples - 0.5) * width;
                inside += distance(x, y) + dx * std::cos(angle) + dy * std::sin(angle) < 0;
            }
            return static_cast<double>(inside) / (samples * samples);
        };
        return Picture(
            2 * half, 2 * half, [&](int x, int y) { return distance(x, y) < 0 ? front : behind; },
            [&](int x, int y) {
                return std::abs(distance(x, y)) > 2 ? (distance(x, y) < 0 ? 0.2 : 0.8) : 0.8 - 0.6 * covered(x, y);
            });
    }
};
} // namespace

TEST_CASE("dof: no pixel beside an antialiased edge is darker or lighter than both its sides", "[dof]") {
    constexpr double most = 0.02;
    double worst = 0;
    for (const auto& [front, behind] : {std::pair{-30.0, 0.0},
                                        {-12.0, 4.0},
                                        {-8.0, 0.0},
                                        {-7.0, 0.0},
                                        {-6.0, 0.0},
                                        {-5.0, 0.0},
                                        {-4.0, 0.0},
                                        {-3.0, 0.0},
                                        {-2.0, 8.0},
                                        {0.0, 20.0},
                                        {2.0, 12.0},
                                        {10.0, 36.0}})
        for (const double angle : {0.0, 0.46, 0.79, 2.0})
            for (const double offset : {0.1, 0.45})
                for (const Quality quality : {Quality::balanced, Quality::accurate}) {
                    const Picture picture = Antialiased{angle, offset, front, behind, 1}.picture();
                    const auto got = blurred(picture, {.quality = quality});
                    for (int y = 8; y < picture.height - 8; ++y)
                        for (int x = 8; x < picture.width - 8; ++x) {
                            const double value = first_channel(got, picture.width, x, y);
                            worst = std::max({worst, 0.2 - value, value - 0.8});
                        }
                }
    std::printf("dof, antialiased edges: beyond both sides by %.4f at most\n", worst);
    CHECK(worst <= most);
}

TEST_CASE("dof: an antialiased edge has the same bits whether red or blue comes first", "[dof]") {
    std::mt19937 random(2);
    for (const double angle : {0.3, 0.79, 2.0}) {
        Picture picture = Antialiased{angle, 0.1, -12, 4, 1.5}.picture();
        for (float& value : picture.color) // so that sums are rounded
            value *= 1 + 0.01f * static_cast<float>(random() % 1000) / 1000;
        const auto turned = [](std::vector<float> color) {
            for (std::size_t i = 0; i < color.size(); i += 3)
                std::swap(color[i], color[i + 2]);
            return color;
        };
        Picture blue_first = picture;
        blue_first.color = turned(picture.color);
        CHECK(same_bits(turned(blurred(blue_first)), blurred(picture)));
    }
}

// Beside a foreground of circle c, a sharp wall shows what the disc of diameter c leaves open. The pixels beyond the edge had
// up to a half of the foreground's colour, which made a dashed outline: they were off by 0.18.
TEST_CASE("dof: an antialiased foreground leaves no outline on the sharp wall behind it", "[dof]") {
    constexpr double most = 0.05; // of which half a pixel's part of a disc of 30 pixels is 0.0127
    for (const auto& [name, quality] : qualities) {
        double worst = 0;
        for (const double angle : {0.0, 0.3, 0.46, 0.79, 2.0})
            for (const double width : {1.0, 2.0}) {
                const Antialiased edge{angle, 0.1, -30, 0, width};
                const auto got = blurred(edge.picture(), {.quality = quality});
                for (int y = 24; y < 56; ++y)
                    for (int x = 24; x < 56; ++x)
                        if (edge.distance(x, y) > 0) {
                            const double covered = half_plane(-edge.distance(x, y) / 15);
                            const double truth = 0.2 * covered + 0.8 * (1 - covered);
                            worst = std::max(worst, std::abs(first_channel(got, 2 * Antialiased::half, x, y) - truth));
                        }
            }
        std::printf("dof, %s, a wall beyond an antialiased edge: off by %.4f\n", name, worst);
        INFO(name);
        CHECK(worst <= most);
    }
}

// Beside a lamp before the focus the ground comes out of focus, by a hundredth of a pixel a frame. A lamp of one pixel fills
// 1 / (pi 0.75^2) = 0.566 of a disc that is 1.5 pixels wide. It had 1 until the ground's circle passed one pixel.
TEST_CASE("dof: in a focus pull nothing jumps where circles pass one pixel", "[dof]") {
    constexpr int half = 16;
    constexpr double lamp = 4, most_change = 0.06 * lamp, most_off = 0.02 * lamp;
    const double truth = lamp / (3.14159265358979 * 0.75 * 0.75);
    for (const auto& [name, quality] : qualities)
        for (const double circle : {-20.0, -3.0, -1.5, -1.2, 1.2, 1.5, 2.0, 12.0})
            for (const double side : {-1.0, 1.0}) {
                std::vector<float> before;
                for (int frame = 97; frame <= 103; ++frame) {
                    const auto is_lamp = [](int x, int y) { return x == half && y == half; };
                    const Picture picture(
                        2 * half, 2 * half, [&](int x, int y) { return is_lamp(x, y) ? circle : side * frame / 100; },
                        [&](int x, int y) { return is_lamp(x, y) ? lamp : 0.0; });
                    const auto got = blurred(picture, {.quality = quality});
                    INFO(name << ", lamp " << circle << ", ground " << side * frame / 100);
                    if (circle == -1.5 && side > 0 && quality != Quality::fast)
                        CHECK(std::abs(first_channel(got, picture.width, half, half) - truth) <= most_off);
                    float change = 0;
                    for (std::size_t i = 0; i < before.size(); ++i)
                        change = std::max(change, std::abs(got[i] - before[i]));
                    CHECK(change <= most_change);
                    before = got;
                }
            }
}

// A blurred foreground before a sharp sphere, and a blurred wall of lamps behind both: the wall went on behind the foreground where
// the sphere does, as a block with hard edges, up to 0.54 of the lamps away from its neighbours. The truth looks through points of
// the lens.
TEST_CASE("dof: no block of a bright wall stands where a foreground hides something sharp", "[dof]") {
    constexpr int size = 160, margin = 20, points = 16, around = 3;
    constexpr double lamp = 4, most = 0.25 * lamp; // beyond the largest step of the truth within `around` pixels
    const auto is_blob = [](double x, double y) { return std::hypot(x - 85, y - 80) < 22; };
    const auto is_arm = [](double x, double y) {
        return (x - 110) * 0.6 - (y - 70) * 0.8 > 0 ||
               (std::abs((x - 80) * 0.7 + (y - 90) * 0.7) < 14 && (x - 80) * 0.7 - (y - 90) * 0.7 > -25);
    };
    const auto is_sphere = [](double x, double y) { return std::hypot(x - 50, y - 105) < 26; };
    const auto wall = [](double x, double y) {
        return static_cast<int>(std::floor(x / 24) + std::floor(y / 24)) % 2 != 0 ? lamp : 0.3;
    };
    for (const std::function<bool(double, double)>& is_near :
         {std::function<bool(double, double)>(is_blob), std::function<bool(double, double)>(is_arm)}) {
        constexpr double near_circle = -30, wall_circle = 12;
        const auto seen = [&](double x, double y, double u, double v) { // through a point of the lens
            return is_near(x + u * near_circle / 2, y + v * near_circle / 2) ? 0.3
                   : is_sphere(x, y)                                         ? 0.6
                                     : wall(x + u * wall_circle / 2, y + v * wall_circle / 2);
        };
        const Picture picture(
            size, size, [&](int x, int y) { return is_near(x, y)     ? near_circle
                                                   : is_sphere(x, y) ? 0
                                                                     : wall_circle; },
            [&](int x, int y) { return seen(x, y, 0, 0); });
        std::vector<double> truth;
        for (int i = 0; i < size * size; ++i) {
            double sum = 0, count = 0;
            for (int k = 0; k < points * points; ++k) {
                const double u = (2 * (k % points) + 1.0) / points - 1, v = (2 * (k / points) + 1.0) / points - 1;
                if (u * u + v * v > 1)
                    continue;
                sum += seen(i % size, i / size, u, v);
                ++count;
            }
            truth.push_back(sum / count);
        }
        const auto got = blurred(picture);
        const auto steps = [](const auto& value, int x, int y) {
            return std::max(std::abs(value(x + 1, y) - value(x, y)), std::abs(value(x, y + 1) - value(x, y)));
        };
        const auto of_truth = [&](int x, int y) { return truth[static_cast<std::size_t>(y * size + x)]; };
        const auto of_got = [&](int x, int y) { return first_channel(got, size, x, y); };
        double worst = 0;
        for (int y = margin; y < size - margin; ++y)
            for (int x = margin; x < size - margin; ++x) {
                double allowed = 0;
                for (int j = -around; j <= around; ++j)
                    for (int i = -around; i <= around; ++i)
                        allowed = std::max(allowed, steps(of_truth, x + i, y + j));
                worst = std::max(worst, steps(of_got, x, y) - allowed);
            }
        std::printf("dof, behind a foreground: a step of %.3f beyond those of the truth\n", worst);
        CHECK(worst <= most);
    }
}

// What lies straight behind a blurred object is hidden, and a sky has so large a circle that it reaches everywhere: it must
// not shine through the floor before it.
TEST_CASE("dof: no far sky shows where a near object hides the floor before it", "[dof]") {
    constexpr double radius = 11.7; // between two layers
    const auto everywhere = [](double, double) { return true; };
    const auto floor = [](double, double y) { return y > 0; };
    const lens_blur::Slope near{-2 * radius, 0, [](double x, double) { return x < 0; }, 0.4}, sky{80, 0, everywhere, 1};
    const std::pair<const char*, Outdoors> scenes[] = {
        {"floor in focus", {{near, {0, 0, floor, 0}, sky}}},
        {"floor through the focus", {{near, {12, -0.3, floor, 0}, sky}}},
        {"floor behind the focus", {{near, {9, -0.1, floor, 0}, sky}}},
        {"second object", {{near, {-6, 0, [](double x, double y) { return x < 30 && y > 0; }, 0}, sky}}},
        {"no floor", {{near, sky}}}};
    std::printf("dof, a blurred object before a sky of radius 40: rim over the floor, over the horizon, over the sky: "
                "largest error, root mean square\n");
    for (const auto& [name, scene] : scenes) {
        Rim rims[] = {{20, 38}, {-12, 12}, {-30, -14}};
        for (Rim& rim : rims)
            rim.look_at(scene);
        for (const auto& [quality_name, quality] : qualities) {
            const auto got = blurred(scene.picture(), {.quality = quality});
            std::printf("  %-24s %-8s", name, quality_name);
            for (const Rim& rim : rims) {
                const Off off = rim.judge(got);
                std::printf("  %.4f %.4f", off.largest, off.rms());
                INFO(name << ", " << quality_name << ", rows from " << rim.top);
                // Over the horizon two edges meet; accurate continues the floor with the circle it has beside the rim.
                const bool horizon = rim.top < 0 && rim.bottom > 0, accurate = quality == Quality::accurate;
                CHECK(off.largest <= (horizon ? 0.25 : accurate ? 0.02 : dof_edge_error));
                CHECK(off.rms() <= (horizon ? 0.06 : quality == Quality::fast ? fast_rms_error : dof_edge_rms_error));
            }
            std::printf("\n");
        }
    }
}

TEST_CASE("dof: what a blurred foreground hides is the clean plate's, where there is one", "[dof]") {
    const auto stripes = [](double x) { return 0.5 + 0.5 * std::sin(0.7 * x); };
    const auto step = [](double x) { return x < -3 ? 0.0 : 1.0; };
    for (const auto& [quality_name, quality] : qualities) {
        std::printf("dof, %s, clean plate: radius: largest error with it, without it\n", quality_name);
        for (const double radius : {4.0, 12.0, 30.0}) {
            std::printf("  %-3g", radius);
            const int reach = static_cast<int>(radius) + 2;
            const Layer half_plane = left_of(0, -2 * radius, 0.8);
            const Layer pole{-2 * radius, [](double x) { return std::abs(x) < 3; }, [](double) { return 0.8; }};
            for (const bool edge : {true, false}) {
                const Layer& front = edge ? half_plane : pole;
                for (const auto& [circle, behind] : std::vector<std::pair<double, std::function<double(double)>>>{
                         {0.0, stripes}, {0.0, step}, {radius, step}}) {
                    const Stack stack{{front, everywhere(circle, behind)}, 3 * reach};
                    const auto truth = truth_of(stack, false, {});
                    const auto given = with_clean_plate(stack, false, {.quality = quality});
                    const auto guessed = blurred(stack.picture(false), {.quality = quality});
                    Off known, unknown;
                    for (int i = stack.half - 2 * reach; i < stack.half + 2 * reach; ++i) {
                        const double exact = truth(i + 0.5 - stack.half);
                        known.add(first_channel(given, 2 * stack.half, i, stack.half) - exact);
                        unknown.add(first_channel(guessed, 2 * stack.half, i, stack.half) - exact);
                    }
                    std::printf("  %.4f %.4f", known.largest, unknown.largest);
                    INFO(quality_name << ", radius " << radius << ", behind with a circle of " << circle);
                    if (quality != Quality::fast && (circle == 0 || (edge && quality == Quality::accurate)))
                        CHECK(known.largest <= dof_edge_error);
                    CHECK(known.largest <= 0.7 * unknown.largest);
                    CHECK(unknown.largest >= 0.02); // there is something to guess
                }
            }
            std::printf("\n");
        }
    }
}

TEST_CASE("dof: a clean plate that hides nothing changes no bit, and one that does not fit is refused", "[dof]") {
    const int side = 90;
    const Picture picture(
        side, side, [](int x, int y) { return x > 40 ? 7.3 : -21 + 0.3 * y; },
        [](int x, int y) { return (x * 7 + y * 3) % 11 / 11.0; });
    const Image color = Image::from_host(default_device(), Element::f32, picture.color.data(), {side, side, 3});
    const StoredDepth depth{Image::from_host(default_device(), Element::f32, picture.depth.data(), {side, side}),
                            camera_of(side, side)};
    for (const auto& [quality_name, quality] : qualities) {
        INFO(quality_name);
        CHECK(blurred(picture, {.quality = quality, .clean_plate = CleanPlate{color, depth}}) ==
              blurred(picture, {.quality = quality}));
    }
    const auto refused = [&](const Image& clean_plate, const StoredDepth& its_depth, const std::string& message) {
        CHECK_THROWS_WITH(dof(depth, color, lens, {.clean_plate = CleanPlate{clean_plate, its_depth}}), message);
    };
    const auto image = [](int across, int down, int channels) {
        return Image(default_device(), Element::f32, {across, down, channels});
    };
    refused(image(side, 80, 3), depth, "the clean plate is 90 x 80 pixels, the depth 90 x 90");
    refused(image(side, side, 4), depth, "the clean plate has 4 channels, color 3");
    refused(color, {image(80, side, 1), camera_of(80, side)},
            "the clean plate's depth is 80 x 90 pixels, the clean plate 90 x 90");
    CHECK_THROWS_WITH(dof(depth, image(side, side, 3), color, lens, {.clean_plate = CleanPlate{color, depth}}),
                      "the result shares memory with the clean plate");
}

// The images hold the largest layer around the circle, twice its radius.
TEST_CASE("dof: a point's light becomes the aperture, all of it", "[dof]") {
    std::printf("dof, point: radius: energy - 1, variance across and down over the disc's\n");
    for (const auto& [quality_name, quality] : qualities) {
        std::printf("  %s:", quality_name);
        for (const double radius : {1.0, 2.7, 6.0, 11.0, 16.0, 23.0, 40.0, 64.0})
            for (const double sign : {1.0, -1.0}) {
                const int half = static_cast<int>(2.5 * radius) + 16, side = 2 * half + 1;
                const Picture point(
                    side, side, [&](int, int) { return 2 * sign * radius; },
                    [&](int x, int y) { return x == half && y == half ? 1e4 : 0; });
                const auto got = blurred(point, {.quality = quality});
                double energy = 0, across = 0, down = 0;
                for (int y = 0; y < side; ++y)
                    for (int x = 0; x < side; ++x) {
                        const double value = first_channel(got, side, x, y) / 1e4;
                        energy += value;
                        across += value * (x - half) * (x - half);
                        down += value * (y - half) * (y - half);
                    }
                const double expected = variance_of_disc(radius);
                if (sign > 0)
                    std::printf("  %g: %+.1e %.4f %.4f", radius, energy - 1, across / expected, down / expected);
                const double variance_error = quality != Quality::fast ? 0.02 : 0.08;
                INFO(quality_name << ", radius " << radius);
                CHECK(std::abs(energy - 1) <= 1e-5);
                CHECK(std::abs(across / expected - 1) <= variance_error);
                CHECK(std::abs(down / expected - 1) <= variance_error);
            }
        std::printf("\n");
    }
}

namespace {

/// How many values of a tile at the left differ from the whole's, farther from its right end and rows than the reach and the halo.
long differences_in_tile(const Picture& picture, const DofOptions& options, int reach) {
    constexpr int across = 240;
    const int aside = reach + dof_halo_columns, above = std::min(reach + dof_halo_rows, picture.height / 2 - 1);
    const CleanPlate all = clean_plate_of(picture);
    const auto whole = floats(dof(all.depth, all.color, lens, options));
    const auto part = floats(dof(all.depth.region(0, 0, across, picture.height),
                                 all.color.region(0, 0, across, picture.height), lens, options));
    long differ = 0;
    for (int y = above; y < picture.height - above; ++y)
        for (int x = 0; x < 3 * (across - aside); ++x)
            differ += !same_bits(part[static_cast<std::size_t>(3 * across * y + x)],
                                 whole[static_cast<std::size_t>(3 * picture.width * y + x)]);
    return differ;
}

} // namespace

// A tile's pixels are blurred alike, and what decides how lies within its halo, however far a tile reaches beyond it.
TEST_CASE("dof: a tile with a halo is blurred as in the whole, whatever hides or ends beyond its halo", "[dof]") {
    constexpr int width = 512, height = 96;
    std::mt19937 random(9);
    std::uniform_real_distribution<double> any(0, 1);
    const auto color = [&](int, int) { return any(random); };
    for (int at = 192; at < 448; at += 8) {
        INFO("column " << at);
        // A sharp post, the only thing that hides another.
        const Picture post(
            width, height, [at](int x, int) { return x >= at && x < at + 4 ? 0 : 8; }, color);
        CHECK(differences_in_tile(post, {.quality = Quality::accurate, .max_coc_px = 8}, 13) == 0);
        for (const auto& [name, quality] : {qualities[0], qualities[1]})
            for (const double radius : {2.0, 4.0, 20.0}) { // where a foreground, steep and blurred, ends
                const Picture foreground(
                    width, height,
                    [at, radius](int x, int y) { return x == at ? 0 : -2 * radius + 0.4 * radius * ((x + y) % 5) / 5; },
                    color);
                INFO(name << ", radius " << radius);
                CHECK(differences_in_tile(foreground, {.quality = quality, .max_coc_px = 2 * radius},
                                          static_cast<int>(radius)) == 0);
            }
    }
}

TEST_CASE("dof: a pinhole changes no bit, and neither do circles up to a pixel", "[dof]") {
    const Picture picture = mixed();
    const Device& device = default_device();
    const Camera camera = camera_of(picture.width, picture.height);
    const Image depth = Image::from_host(device, Element::f32, picture.depth.data(), {picture.width, picture.height});
    const Image color =
        Image::from_host(device, Element::f32, picture.color.data(), {picture.width, picture.height, 3});
    const CircleOfConfusion pinhole = circle_of_confusion(
        {.f_stop = std::numeric_limits<double>::infinity(), .focus = 2, .focal_length_mm = 50, .sensor_mm = 36},
        camera);
    CHECK(same_bits(floats(dof({depth, camera}, color, pinhole)), picture.color));

    const Picture sharp(
        150, 70, [](int x, int y) { return ((x + y) % 21 - 10) / 10.0; },
        [](int x, int y) { return (x * 37 + y * 11) % 101 / 50.0; });
    for (const auto& [name, quality] : qualities)
        CHECK(same_bits(blurred(sharp, {.quality = quality}), sharp.color));
}

TEST_CASE("dof: what is no number in colour or depth goes nowhere", "[dof]") {
    constexpr int side = 90;
    for (const auto& [name, quality] : qualities)
        for (const double circle : {0.0, 3.0, 14.0, -14.0, 40.0}) {
            Picture clean(
                side, side, [&](int, int) { return circle; }, [](int x, int y) { return (x + y) % 7 / 7.0; });
            Picture damaged = clean;
            const std::size_t at = 45 * side + 45;
            damaged.color[3 * at] = not_a_number;
            damaged.color[3 * (at + 1) + 1] = inf;
            damaged.color[3 * (at + 2) + 2] = quality == Quality::fast ? -inf : 2e38f;
            damaged.depth[at + 3] = not_a_number;
            damaged.depth[at + 4] = -1;
            const auto before = blurred(clean, {.quality = quality}), after = blurred(damaged, {.quality = quality});
            long spread = 0, beyond = 0;
            for (int y = 0; y < side; ++y)
                for (int x = 0; x < side; ++x) {
                    const auto i = static_cast<std::size_t>(3 * (y * side + x));
                    const bool reached =
                        std::hypot(std::max({45 - x, x - 49, 0}), y - 45) <= std::abs(circle) / 2 * 1.2 + 9;
                    const bool damaged_itself = y == 45 && x >= 45 && x <= 49;
                    for (std::size_t c = i; c < i + 3; ++c) {
                        spread += !std::isfinite(after[c]) && !damaged_itself;
                        beyond += !reached && !(std::abs(after[c] - before[c]) <= 1e-6f); // a rounding of running sums
                    }
                    if (damaged_itself)
                        CHECK((std::abs(circle) > 1
                                   ? std::isfinite(after[i])
                                   : std::memcmp(&after[i], &damaged.color[i], 3 * sizeof(float)) == 0));
                }
            INFO(name << ", circle " << circle);
            CHECK(spread == 0);
            CHECK(beyond == 0);
        }
}

TEST_CASE("dof: alpha is spread like colour, and none stays none", "[dof]") {
    Picture picture = mixed();
    std::vector<float> color;
    for (std::size_t i = 0; i < picture.depth.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c)
            color.push_back(c < 3 ? picture.color[3 * i + c] : picture.color[3 * i]);
    const auto three = blurred(picture);
    Picture four = picture;
    four.color = color;
    const auto with_alpha = blurred(four);
    for (std::size_t i = 0; i < picture.depth.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c)
            REQUIRE(same_bits(with_alpha[4 * i + c], three[3 * i + c]));
        REQUIRE(same_bits(with_alpha[4 * i + 3], three[3 * i]));
    }
    std::fill(four.color.begin(), four.color.end(), 0.0f);
    for (const float value : blurred(four))
        REQUIRE((value == 0 || std::isnan(value)));
}

TEST_CASE("dof: halves and integers are what their floats would be", "[dof]") {
    const Picture picture(
        130, 50, [](int x, int y) { return (x / 13 + y / 10) % 2 ? -7.0 : 12.0; },
        [](int x, int y) { return (x * 7 + y * 13) % 256 / 255.0; });
    const Device& device = default_device();
    const StoredDepth depth{
        Image::from_host(device, Element::f32, picture.depth.data(), {picture.width, picture.height}),
        camera_of(picture.width, picture.height)};
    const Layout layout{picture.width, picture.height, 3};
    const auto check_codes = [&]<typename Code>(Code most, Element element) {
        std::vector<Code> codes, got(picture.color.size());
        Picture exact = picture;
        for (float& value : exact.color) {
            codes.push_back(static_cast<Code>(std::lround(value * static_cast<float>(most))));
            value = static_cast<float>(codes.back()) / static_cast<float>(most);
        }
        dof(depth, Image::from_host(device, element, codes.data(), layout), lens).download(got.data());
        const auto expected = blurred(exact);
        for (std::size_t i = 0; i < got.size(); ++i)
            REQUIRE(got[i] == std::floor(std::clamp(static_cast<double>(expected[i]), 0.0, 1.0) * most + 0.5));
    };
    check_codes(std::uint8_t{255}, Element::u8);
    check_codes(std::uint16_t{65535}, Element::u16);
    // Halves that are exact: multiples of 1/1024 up to 1.
    std::vector<std::uint16_t> halves;
    for (const float value : picture.color)
        halves.push_back(value > 0.5f ? 0x3c00 : 0x3400); // 1 and 0.25
    Picture of_halves = picture;
    for (std::size_t i = 0; i < halves.size(); ++i)
        of_halves.color[i] = halves[i] == 0x3c00 ? 1.0f : 0.25f;
    std::vector<std::uint16_t> got_halves(halves.size());
    dof(depth, Image::from_host(device, Element::f16, halves.data(), layout), lens).download(got_halves.data());
    const auto from_halves = blurred(of_halves);
    for (std::size_t i = 0; i < halves.size(); ++i) {
        const int exponent = (got_halves[i] >> 10 & 31) - 25;
        const float value = std::ldexp(static_cast<float>((got_halves[i] & 1023) + 1024), exponent);
        REQUIRE(std::abs(from_halves[i] - value) <= 0x1p-11f * value * 1.001f);
    }
}

TEST_CASE("dof: images that do not fit are refused", "[dof]") {
    const Device& device = default_device();
    const StoredDepth depth{Image(device, Element::f32, {20, 10}), camera_of(20, 10)};
    const auto refused = [&](const Image& color, const CircleOfConfusion& coc) {
        CHECK_THROWS_AS(dof(depth, color, coc), std::invalid_argument);
    };
    const Image color(device, Element::f32, {20, 10, 3});
    refused(Image(device, Element::f32, {20, 11, 3}), lens);
    refused(Image(device, Element::f32, {20, 10, 1}), lens);
    refused(Image(device, Element::u32, {20, 10, 3}), lens);
    refused(color, {.k = std::nan(""), .g = 1});
    const int wide = 4'194'241;
    const StoredDepth row{Image(device, Element::f32, {wide, 1}), camera_of(wide, 1)};
    CHECK_THROWS_AS(dof(row, Image(device, Element::f32, {wide, 1, 3}), lens), ImageTooLarge);
    CHECK_THROWS_AS(dof(depth, color, color, lens), std::invalid_argument);
    CHECK_THROWS_AS(dof(depth, color, Image(device, Element::u8, {20, 10, 3}), lens), std::invalid_argument);
}

TEST_CASE("dof: rows from the bottom up turn nothing", "[dof]") {
    // Of two pixels equally near all but the fast quality take the upper one as what lies behind: their picture has none.
    const Stack edges{{left_of(-4, -20, 1), everywhere(12, [](double y) { return y > 3 ? 1.0 : 0.2; })}, 45};
    const Picture picture = edges.picture(true);
    for (const Quality quality : {Quality::balanced, Quality::accurate}) {
        const auto rows = static_cast<std::size_t>(picture.height);
        Picture upside_down = picture;
        for (std::size_t y = 0; y < rows; ++y) {
            std::copy_n(&picture.depth[90 * y], 90, &upside_down.depth[90 * (rows - 1 - y)]);
            std::copy_n(&picture.color[270 * y], 270, &upside_down.color[270 * (rows - 1 - y)]);
        }
        const Device& device = default_device();
        Camera camera = camera_of(90, picture.height);
        camera.rows = Rows::bottom_up;
        const Image depth = Image::from_host(device, Element::f32, upside_down.depth.data(), {90, picture.height});
        const Image color = Image::from_host(device, Element::f32, upside_down.color.data(), {90, picture.height, 3});
        const Aperture triangle{3, 20};
        const auto got = floats(dof({depth, camera}, color, lens, {.aperture = triangle, .quality = quality}));
        const auto expected = blurred(picture, {.aperture = triangle, .quality = quality});
        double worst = 0;
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t i = 0; i < 270; ++i) {
                const float a = got[270 * (rows - 1 - y) + i], b = expected[270 * y + i];
                if (std::isfinite(a) || std::isfinite(b))
                    worst = std::max(worst, std::abs(static_cast<double>(a - b)) /
                                                std::max(1.0, std::abs(static_cast<double>(b))));
            }
        std::printf("dof, rows from the bottom up: off by %.1e\n", worst);
        CHECK(worst < 1e-4); // the order of sums
    }
}

TEST_CASE("dof: pixels that are not square have circles that are not round", "[dof]") {
    constexpr int side = 101, half = side / 2;
    constexpr double radius = 12, stretch = 0.5; // a circle's height over its width
    const Picture point(
        side, side, [](int, int) { return 2 * radius; }, [](int x, int y) { return x == half && y == half ? 1 : 0; });
    const Device& device = default_device();
    Camera camera = camera_of(side, side);
    camera.projection = perspective(1.0, stretch, {0.01, 100});
    const Image depth = Image::from_host(device, Element::f32, point.depth.data(), {side, side});
    const Image color = Image::from_host(device, Element::f32, point.color.data(), {side, side, 3});
    const auto got = floats(dof({depth, camera}, color, lens));
    double across = 0, down = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            across += first_channel(got, side, x, y) * (x - half) * (x - half);
            down += first_channel(got, side, x, y) * (y - half) * (y - half);
        }
    const PixelScale pixels = pixel_scale(camera);
    const double height = radius * static_cast<double>(pixels.y / pixels.x);
    std::printf("dof, circles of %g x %g pixels: variance over the ellipse's %.4f %.4f\n", radius, height,
                across / variance_of_disc(radius), down / variance_of_disc(height));
    CHECK(std::abs(height / radius - stretch) < 1e-6);
    CHECK(std::abs(across / variance_of_disc(radius) - 1) < 0.01);
    CHECK(std::abs(down / variance_of_disc(height) - 1) < 0.01);
}

TEST_CASE("dof: the sky is blurred, kept sharp or left out", "[dof]") {
    constexpr int width = 96, height = 64;
    Picture picture(
        width, height, [](int, int) { return 0.0; }, [](int x, int y) { return (x + y) % 2; });
    for (std::size_t i = 0; i < picture.depth.size(); ++i)
        if (i % width >= width / 2)
            picture.depth[i] = inf;
    const CircleOfConfusion circle{.k = 20, .g = 20 * static_cast<double>(depth_of(0))};
    const auto of = [&](Sky sky) { return blurred(picture, circle, {.sky = sky}); };
    const auto blurry = of(Sky::blur), sharp = of(Sky::sharp), without = of(Sky::exclude);
    CHECK(same_bits(sharp, picture.color));
    for (int x = 0; x < width; ++x) {
        const auto at = static_cast<std::size_t>(3 * (height / 2 * width + x));
        INFO("column " << x);
        if (x < width / 2) {
            CHECK(blurry[at] == picture.color[at]);
            CHECK(without[at] == picture.color[at]);
        } else {
            CHECK(std::abs(blurry[at] - 0.5f) < 0.1f);
            CHECK(without[at] == picture.color[at]);
        }
    }
}
