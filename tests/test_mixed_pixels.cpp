// dof_masks: pixels whose depth was averaged over an edge, against scenes in which it is known which pixels those are.

#include "catch.hpp"
#include "stability.hpp"
#include "test_device.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/precision.hpp>
#include <fathom/unproject.hpp>

using namespace fathom;

namespace {

using stability::camera_of;
using stability::infinity;

constexpr int width = 104, height = 80;

// Inverse depth at a position of the image, and which surface that is: 0 behind, 1 before it, 2 the background.
struct Sample {
    double q;
    int surface;
};
using Scene = std::function<Sample(double x, double y)>;

// How a scene's inverse depth is stored.
struct Stored {
    std::string name;
    Camera camera;
    bool codes = false; // of 16 bits
};

std::vector<Stored> ways() {
    const double aspect = static_cast<double>(width) / height;
    const DepthSpan span{0.5, 50}, reversed{0.5, infinity, DepthOrder::reversed};
    std::vector<Stored> list{
        {"window", camera_of(perspective(1.0, aspect, span), width, height)},
        {"reversed, infinite", camera_of(perspective(1.0, aspect, reversed, Convention::direct3d()), width, height)},
        {"orthographic", camera_of(orthographic({-2, 2, -1.5, 1.5}, span), width, height)},
        {"16 bits", camera_of(perspective(1.0, aspect, span), width, height), true},
        {"view z", camera_of(perspective(1.0, aspect, span), width, height)}};
    list.back().camera.encoding = Encoding::view_z;
    return list;
}

// Inverse depths from 0.1 to 0.5 are depths from 10 to 2; for an orthographic camera from 40 to 2. What is stored is affine in
// them, but for view depth.
struct Encoder {
    double slope, start;
    bool inverse;

    explicit Encoder(const Stored& way) : inverse(way.name == "view z") {
        const auto stored = [&](double q) {
            const double z = way.name == "orthographic" ? 50 - 96 * q : 1 / q;
            return static_cast<double>(stored_depth(way.camera, Storage::float32, 0.5, 0.5, z));
        };
        slope = (stored(0.5) - stored(0.1)) / 0.4;
        start = stored(0.1) - 0.1 * slope;
        background = way.name == "reversed, infinite" ? 0.0 : inverse ? 1e10 : 1.0;
    }
    double background;
    double stored(const Sample& s) const {
        return s.surface == 2 ? background : inverse ? 1 / s.q : start + slope * s.q;
    }
    double inverse_depth(double v) const { return inverse ? 1 / v : (v - start) / slope; }
};

struct Picture {
    std::vector<float> values;
    std::vector<bool> mixed;   // by at least an eighth of the step in inverse depth
    std::vector<bool> several; // surfaces in the pixel
};

Picture rendered(const Scene& scene, const Stored& way, int samples) {
    const Encoder encoder(way);
    Picture picture;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double sum = 0, least = infinity, most = -infinity;
            int surfaces = 0;
            for (int i = 0; i < samples * samples; ++i) {
                const Sample s = scene(x + (i % samples + 0.5) / samples, y + (i / samples + 0.5) / samples);
                const double value = encoder.stored(s), q = encoder.inverse_depth(value);
                sum += value;
                least = std::min(least, q);
                most = std::max(most, q);
                surfaces |= 1 << s.surface;
            }
            const double value = sum / (samples * samples);
            const bool several = surfaces == 3 || surfaces > 4;
            const double share = several ? (encoder.inverse_depth(value) - least) / (most - least) : 0;
            picture.several.push_back(several);
            picture.mixed.push_back(several && share > 0.125 && share < 0.875);
            picture.values.push_back(static_cast<float>(value));
        }
    return picture;
}

// Calls `use` with the picture as depth.
void with_stored(const Picture& picture, const Stored& way, const std::function<void(const StoredDepth&)>& use) {
    static const Device device = test_device();
    std::vector<std::uint16_t> codes;
    for (const float value : picture.values)
        codes.push_back(static_cast<std::uint16_t>(std::lround(std::min(value, 1.0f) * 65535)));
    const Storage storage = way.codes ? Storage::uint16 : Storage::float32;
    const void* data = way.codes ? static_cast<const void*>(codes.data()) : picture.values.data();
    use({Image::from_host(device, element_of(storage), data, {width, height}), way.camera, storage});
}

std::vector<float> mask_of(const Picture& picture, const Stored& way) {
    std::vector<float> mask(picture.values.size());
    const bool is_orthographic = way.name == "orthographic";
    with_stored(picture, way, [&](const StoredDepth& stored) {
        dof_masks(stored, {20, 100, 0, is_orthographic}, {.mixed_pixels = true}).mixed_pixels.download(mask.data());
    });
    return mask;
}

// What is found; in the two outermost rows and columns, where neighbours are missing, only what is wrong counts. Where all edges
// are upright, rows have all that they need.
struct Count {
    int mixed = 0, found = 0, pure = 0, wrong = 0;
    void add(const Picture& picture, const std::vector<float>& mask, bool upright = false) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto i = static_cast<std::size_t>(y * width + x);
                const bool inside = x >= 2 && x < width - 2 && (upright || (y >= 2 && y < height - 2));
                mixed += inside && picture.mixed[i];
                found += inside && picture.mixed[i] && mask[i] == 1;
                pure += !picture.several[i];
                wrong += !picture.several[i] && mask[i] != 0;
            }
    }
    void print(const std::string& what) const {
        std::printf("mixed pixels, %-44s %5d of %5d found, %4d of %d wrong\n", what.c_str(), found, mixed, wrong, pure);
    }
};

// 1/z of a plane through the image's middle.
double plane(double x, double y, double q, double gx, double gy) {
    return q + gx * (x - width / 2.0) + gy * (y - height / 2.0);
}

// A slanted half-plane before another, or before the background, its edge turned by an angle.
Scene edge(double degrees, bool before_sky) {
    const double a = degrees * std::numbers::pi / 180;
    return [=](double x, double y) -> Sample {
        if ((x - 52.3) * std::cos(a) + (y - 40.6) * std::sin(a) < 0)
            return {plane(x, y, 0.4, 2e-4, -3e-4), 1};
        return {plane(x, y, 0.15, -1e-4, 2e-4), before_sky ? 2 : 0};
    };
}

} // namespace

TEST_CASE("mixed pixels: pixels averaged over an edge are found, and surfaces are not", "[dof_masks][mixed_pixels]") {
    for (const Stored& way : ways())
        for (const int samples : {2, 4}) {
            Count edges, sharp;
            for (const bool sky : {false, true})
                for (int angle = 0; angle < 180; angle += 15) {
                    const Scene scene = edge(angle, sky);
                    const Picture picture = rendered(scene, way, samples), aliased = rendered(scene, way, 1);
                    edges.add(picture, mask_of(picture, way), angle == 0);
                    sharp.add(aliased, mask_of(aliased, way));
                }
            edges.print(way.name + ", edges, " + std::to_string(samples * samples) + " samples");
            sharp.print(way.name + ", edges, 1 sample");
            CHECK(edges.mixed >= (way.name == "view z" ? 300 : 1000));
            CHECK(edges.found == edges.mixed);
            CHECK(edges.wrong == 0);
            CHECK(sharp.wrong == 0);
        }
}

TEST_CASE("mixed pixels: planes and creases have none, however they are tilted", "[dof_masks][mixed_pixels]") {
    for (const Stored& way : ways()) {
        Count smooth;
        for (const double steep : {0.0, 1e-4, 1e-3, 3e-3})
            for (int angle = 0; angle < 360; angle += 45) {
                const double gx = steep * std::cos(angle * std::numbers::pi / 180),
                             gy = steep * std::sin(angle * std::numbers::pi / 180);
                const auto tilted = [=](double x, double y) { return std::clamp(plane(x, y, 0.3, gx, gy), 0.05, 0.5); };
                const auto flat = [=](double x, double y) -> Sample { return {tilted(x, y), 0}; };
                const auto ridge = [=](double x, double y) -> Sample {
                    return {std::max(tilted(x, y), plane(x, y, 0.3, -gy, gx / 2)), 0};
                };
                for (const Scene& scene : {Scene(flat), Scene(ridge)}) {
                    const Picture picture = rendered(scene, way, 2);
                    smooth.add(picture, mask_of(picture, way));
                }
            }
        smooth.print(way.name + ", planes and creases");
        CHECK(smooth.wrong == 0);
    }
}

// The oracle: the mask of `dof_masks`, and the positions without it.
TEST_CASE("unproject: mixed pixels have no position, and all others keep theirs", "[mixed_pixels]") {
    for (const Stored& way : ways())
        for (const int channels : {3, 4}) {
            const Picture picture = rendered(edge(30, false), way, 4);
            const std::vector<float> mask = mask_of(picture, way);
            const auto positions = [&](bool without) {
                std::vector<float> made(mask.size() * static_cast<std::size_t>(channels));
                with_stored(picture, way, [&](const StoredDepth& stored) {
                    unproject(stored, {.channels = channels, .no_mixed_pixels = without}).download(made.data());
                });
                return made;
            };
            const std::vector<float> all = positions(false), got = positions(true);
            int wrong = 0, mixed = 0;
            for (std::size_t i = 0; i < all.size(); ++i) {
                const std::size_t pixel = i / static_cast<std::size_t>(channels);
                const bool is_w = i % static_cast<std::size_t>(channels) == 3;
                mixed += mask[pixel] == 1;
                wrong += mask[pixel] == 1 ? !(is_w ? got[i] == 0 : std::isnan(got[i])) : got[i] != all[i];
            }
            CHECK(mixed > 100);
            CHECK(wrong == 0);
        }
}
