// dof's range: a blur is a mean, so each channel lies between the least and the greatest colour that can reach the pixel. Thousands
// of small random images that are made to break it, and one colour, which stays one colour.

#include "catch.hpp"
#include "images.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

#include <bit>

#include <random>

using namespace fathom;
using images::floats;

namespace {

// A lens whose circle is 300 - 300/z pixels.
constexpr double k = 300, g = 300;
const CircleOfConfusion lens{.k = k, .g = g};

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

// What sums of floats leave: a result may pass what reaches it by so much of the largest colour around it.
constexpr double rounding = 64 * 0x1p-24;
// A picture of one colour differs from it by at most so many units in its last place: colours of running sums hold the rounding of
// all that was summed, divided by how much of an aperture is known. That is more in larger pictures.
constexpr double plain_ulp = 40, plain_ulp_of_large = 160;

/// A small picture that is made to break the range, its depth, and how it is blurred.
struct Trial {
    int width = 0, height = 0, channels = 3;
    std::vector<float> depth, color, plate_depth, plate;
    bool in_halves = false, through_lens = false; // how the depth is stored and seen
    DofOptions options;
    std::string what;
};

class Maker {
public:
    explicit Maker(unsigned seed) : random_(seed) {}

    /// `plain`: a larger picture of one colour.
    Trial make(Quality quality, bool plain = false) {
        Trial trial;
        plain_ = plain;
        trial.width = whole(1, plain ? 160 : 72);
        trial.height = whole(1, plain ? 60 : 40);
        trial.channels = whole(3, 4);
        trial.options.quality = quality;
        if (one_of(4))
            trial.options.aperture =
                one_of(2) ? Aperture{whole(3, 8), real(0, 90), 1} : Aperture{0, real(0, 90), real(0.3, 3)};
        if (one_of(5))
            trial.options.sky = one_of(2) ? Sky::sharp : Sky::exclude;
        widest_ = std::array{3.0, 9.0, 30.0, 120.0}[static_cast<std::size_t>(whole(0, 3))];
        if (one_of(6))
            trial.options.max_coc_px = std::max(1.0, real(0.3, 1) * widest_);
        const std::vector<double> circles = surfaces(trial);
        for (const double circle : circles)
            trial.depth.push_back(depth_of(circle));
        trial.color = colors(trial, circles);
        if (one_of(4)) {
            const double behind = real(-widest_, widest_);
            trial.plate_depth.assign(trial.depth.size(), depth_of(behind));
            Trial plate = trial;
            trial.plate = colors(plate, circles);
            trial.what += " before a clean plate";
        }
        damage(trial);
        if ((trial.in_halves = one_of(4)))
            trial.what += " in halves";
        if ((trial.through_lens = one_of(4)))
            trial.what += " through a lens";
        return trial;
    }

private:
    int whole(int least, int most) { return std::uniform_int_distribution(least, most)(random_); }
    double real(double least, double most) { return std::uniform_real_distribution(least, most)(random_); }
    bool one_of(int many) { return whole(1, many) == 1; }

    static float depth_of(double circle) { return static_cast<float>(g / (k - circle)); }

    /// The circle of every pixel: walls that slope, halves, discs, hair and noise.
    std::vector<double> surfaces(Trial& trial) {
        const auto count = static_cast<std::size_t>(trial.width * trial.height);
        std::vector<double> circles(count, one_of(3) ? 0 : real(-widest_, widest_));
        const double slope = one_of(2) ? 0 : real(-1, 1);
        each(trial, [&](int x, int y, std::size_t i) { circles[i] += slope * (x + 0.5 * y) * 0.05 * widest_ / 10; });
        for (int n = whole(0, 4); n > 0; --n) {
            const double circle = one_of(4) ? 0 : real(-widest_, widest_);
            const int kind = whole(0, 4);
            const double a = real(0, 6.3), at_x = real(0, trial.width), at_y = real(0, trial.height),
                         radius = real(0.3, 15);
            trial.what += std::array{" half", " disc", " hair", " speckles", " bars"}[static_cast<std::size_t>(kind)];
            each(trial, [&](int x, int y, std::size_t i) {
                const double away = (x - at_x) * std::cos(a) + (y - at_y) * std::sin(a);
                const bool here = kind == 0   ? away > 0
                                  : kind == 1 ? std::hypot(x - at_x, y - at_y) < radius
                                  : kind == 2 ? std::abs(away) < 0.6
                                  : kind == 3 ? one_of(9)
                                              : static_cast<int>(std::abs(away)) % 4 == 0;
                if (here)
                    circles[i] = circle;
            });
        }
        if (one_of(5)) {
            trial.what += " noise";
            for (double& circle : circles)
                circle = real(-widest_, widest_);
        }
        return circles;
    }

    /// Colours of surfaces, mixed along edges in some pictures, with their alpha multiplied in.
    std::vector<float> colors(Trial& trial, const std::vector<double>& circles) {
        const int kind = plain_ ? 6 : whole(0, 6);
        trial.what += std::array{" two values",     " random",   " lamps of 400", " lamps of 65504",
                                 " lamps on black", " surfaces", " one colour"}[static_cast<std::size_t>(kind)];
        const bool mixed = one_of(2);
        const double one = real(0, 1);
        const auto salt = static_cast<std::uint32_t>(random_());
        const auto surface = [&](int x, int y, int channel) {
            const auto i = static_cast<std::size_t>(std::clamp(y, 0, trial.height - 1) * trial.width +
                                                    std::clamp(x, 0, trial.width - 1));
            std::minstd_rand own(static_cast<std::uint32_t>(std::lround(circles[i] * 16)) * 97u +
                                 static_cast<std::uint32_t>(channel) + salt);
            own.discard(3);
            return channel == 3 ? (own() % 2 != 0 ? 1.0 : 0.0) : static_cast<double>(own() % 1000) / 999;
        };
        std::vector<float> color;
        each(trial, [&](int x, int y, std::size_t) {
            std::array<double, 4> value{};
            const bool lamp = one_of(40);
            for (int channel = 0; channel < 4; ++channel) {
                auto& v = value[static_cast<std::size_t>(channel)];
                switch (kind) {
                case 0:
                    v = one_of(2) ? 0.45 : 0.5;
                    break;
                case 1:
                    v = real(0, 1);
                    break;
                case 2:
                    v = lamp ? 400 : one;
                    break;
                case 3:
                    v = lamp ? 65504 : one;
                    break;
                case 4:
                    v = lamp ? 400 : 0;
                    break;
                case 5: {
                    v = surface(x, y, channel);
                    if (mixed)
                        v = 0.25 * (2 * v + surface(x - 1, y, channel) + surface(x, y + 1, channel));
                    break;
                }
                default:
                    v = one;
                }
            }
            const double alpha = trial.channels == 3 || kind == 6 ? 1
                                 : kind == 5                      ? value[3]
                                 : one_of(3)                      ? real(0, 1)
                                                                  : 1;
            for (std::size_t channel = 0; channel < 3; ++channel)
                color.push_back(static_cast<float>(value[channel] * alpha));
            if (trial.channels == 4)
                color.push_back(static_cast<float>(alpha));
        });
        return color;
    }

    void damage(Trial& trial) {
        if (!one_of(3))
            return;
        trial.what += " with holes";
        for (std::size_t i = 0; i < trial.depth.size(); ++i) {
            if (one_of(15))
                trial.depth[i] = one_of(2) ? not_a_number : std::numeric_limits<float>::infinity();
            if (one_of(15))
                trial.color[i * static_cast<std::size_t>(trial.channels)] = not_a_number;
        }
    }

    template <typename F>
    static void each(const Trial& trial, const F& f) {
        for (int y = 0; y < trial.height; ++y)
            for (int x = 0; x < trial.width; ++x)
                f(x, y, static_cast<std::size_t>(y * trial.width + x));
    }

    std::mt19937 random_;
    double widest_ = 0;
    bool plain_ = false;
};

struct Seen {
    double worst = 0; // beyond the range, of the largest colour around
    double plain = 0; // ulp that one colour is off by
    long pixels = 0, outside = 0;
    void add(const Seen& other) {
        worst = std::max(worst, other.worst);
        plain = std::max(plain, other.plain);
        pixels += other.pixels;
        outside += other.outside;
    }
};

/// The least and the greatest of each row, and then column, that lies within so many pixels.
struct Bounds {
    std::vector<double> least, greatest;
};

Bounds bounds(const Trial& trial, const Reach& reach, int channel) {
    const auto count = static_cast<std::size_t>(trial.width * trial.height);
    Bounds b{std::vector<double>(count, INFINITY), std::vector<double>(count, -INFINITY)};
    const auto take = [&](const std::vector<float>& color, std::size_t i) {
        for (int c = 0; c < trial.channels; ++c)
            if (!(std::abs(color[i * static_cast<std::size_t>(trial.channels) + static_cast<std::size_t>(c)]) <= 1e30f))
                return;
        const auto v = static_cast<double>(
            color[i * static_cast<std::size_t>(trial.channels) + static_cast<std::size_t>(channel)]);
        b.least[i] = std::min(b.least[i], v);
        b.greatest[i] = std::max(b.greatest[i], v);
    };
    for (std::size_t i = 0; i < count; ++i) {
        take(trial.color, i);
        if (!trial.plate.empty())
            take(trial.plate, i);
    }
    const auto widen = [&](int lines, int line_step, int length, int step, int by) {
        for (int line = 0; line < lines; ++line) {
            std::vector<double> least, greatest;
            for (int i = 0; i < length; ++i) {
                least.push_back(b.least[static_cast<std::size_t>(line * line_step + i * step)]);
                greatest.push_back(b.greatest[static_cast<std::size_t>(line * line_step + i * step)]);
            }
            for (int i = 0; i < length; ++i) {
                const int first = std::max(i - by, 0), end = std::min(i + by + 1, length);
                b.least[static_cast<std::size_t>(line * line_step + i * step)] =
                    *std::min_element(least.begin() + first, least.begin() + end);
                b.greatest[static_cast<std::size_t>(line * line_step + i * step)] =
                    *std::max_element(greatest.begin() + first, greatest.begin() + end);
            }
        }
    };
    widen(trial.height, trial.width, trial.width, 1, reach.columns);
    widen(trial.width, 1, trial.height, trial.width, reach.rows);
    return b;
}

/// Is no light of a picture with an alpha beyond it?
bool is_within_alpha(const std::vector<float>& colors) {
    for (std::size_t i = 0; i < colors.size(); i += 4)
        if (std::max({colors[i], colors[i + 1], colors[i + 2]}) > colors[i + 3])
            return false;
    return true;
}

/// Depth without the digits that a half has no room for, and its bits in one.
float cut_to_half(float z) {
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(z) & ~0x1fffu);
}
std::uint16_t half_of(float z) {
    constexpr std::uint32_t smaller_exponent = 127 - 15;
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(z), sign = bits >> 16 & 0x8000u;
    return static_cast<std::uint16_t>(std::isnan(z)   ? 0x7e00u
                                      : std::isinf(z) ? sign | 0x7c00u
                                                      : sign | ((bits >> 13 & 0x3ffffu) - (smaller_exponent << 10)));
}
bool fits_half(float z) {
    return !std::isfinite(z) || (std::abs(z) < 65504 && std::abs(z) > 1e-4f);
}

Seen judge(const Trial& trial, const Device& device) {
    Camera camera{.projection = perspective(1.0, 1.0 * trial.width / trial.height, {0.01, 100}),
                  .width = trial.width,
                  .height = trial.height,
                  .encoding = Encoding::view_z};
    if (trial.through_lens) { // brown, the only law that dof takes, which makes circles 8 % smaller in a corner
        const double focal = std::max(trial.width, trial.height);
        camera.lens =
            LensModel{LensLaw::brown, focal, focal, 0.5 * trial.width, 0.5 * trial.height, {-0.06, 0.01, 0, 0}};
    }
    const auto image = [&](const std::vector<float>& values, int channels) {
        return Image::from_host(device, Element::f32, values.data(), {trial.width, trial.height, channels});
    };
    DofOptions options = trial.options;
    if (!trial.plate.empty())
        options.clean_plate = CleanPlate{image(trial.plate, trial.channels), {image(trial.plate_depth, 1), camera}};
    std::vector<float> depth = trial.depth;
    std::vector<std::uint16_t> halves; // the image reads this memory
    StoredDepth stored{image(depth, 1), camera};
    if (trial.in_halves && std::ranges::all_of(depth, fits_half)) {
        std::ranges::transform(trial.depth, std::back_inserter(halves), half_of);
        std::ranges::transform(trial.depth, depth.begin(), cut_to_half);
        stored.image = Image::from_host(device, Element::f16, halves.data(), {trial.width, trial.height});
        stored.storage = Storage::float16;
    }
    const auto blurred = floats(dof(stored, image(trial.color, trial.channels), lens, options));
    double widest = 0;
    for (const float z : depth)
        if (z == z)
            widest = std::max(widest, std::abs(k - g / static_cast<double>(z)));
    for (const float z : trial.plate_depth)
        widest = std::max(widest, std::abs(k - g / static_cast<double>(z)));
    Reach reach = fathom::reach(stored, options, widest);
    reach.columns -= dof_halo_columns;
    reach.rows -= dof_halo_rows;
    reach.columns += 4;
    reach.rows += 4;
    Seen seen;
    if (trial.channels == 4 && is_within_alpha(trial.color) && is_within_alpha(trial.plate))
        for (std::size_t i = 0; i < blurred.size(); i += 4)
            for (std::size_t channel = 0; channel < 3; ++channel)
                seen.outside += blurred[i + channel] > blurred[i + 3] + static_cast<float>(rounding);
    for (int channel = 0; channel < trial.channels; ++channel) {
        const Bounds b = bounds(trial, reach, channel);
        for (std::size_t i = 0; i < b.least.size(); ++i) {
            const std::size_t at = i * static_cast<std::size_t>(trial.channels) + static_cast<std::size_t>(channel);
            const double is = blurred[at], was = trial.color[at];
            ++seen.pixels;
            if (is == was || (std::isnan(is) && std::isnan(was)))
                continue;
            const double size = std::max(std::abs(b.least[i]), std::abs(b.greatest[i]));
            const double off = std::max(b.least[i] - is, is - b.greatest[i]);
            if (!(off <= rounding * size))
                ++seen.outside;
            seen.worst = std::max(seen.worst, std::isnan(off) ? INFINITY : off > 0 ? off / size : 0);
            if (b.least[i] == b.greatest[i] && b.least[i] != 0)
                seen.plain = std::max(seen.plain, std::abs(is - b.least[i]) / b.least[i] * 0x1p24);
        }
    }
    return seen;
}

} // namespace

TEST_CASE("dof: no result leaves the colours within its reach", "[dof][ranges][slow]") {
    const Device device = test_device();
    const char* const wanted = std::getenv("RANGE_IMAGES");
    const unsigned images = wanted ? static_cast<unsigned>(std::atoi(wanted)) : 2000;
    for (const auto& [name, quality] : {std::pair{"balanced", Quality::balanced}, std::pair{"fast", Quality::fast},
                                        std::pair{"accurate", Quality::accurate}}) {
        Seen all;
        int printed = 0;
        for (unsigned seed = 0; seed < images; ++seed) {
            const Trial trial = Maker(seed).make(quality);
            const Seen seen = judge(trial, device);
            if ((seen.worst > rounding || seen.plain > plain_ulp) && ++printed < 12)
                std::printf("    %s %u: %d x %d, %d channels,%s: %.3g beyond, %.0f ulp, %ld outside\n", name, seed,
                            trial.width, trial.height, trial.channels, trial.what.c_str(), seen.worst, seen.plain,
                            seen.outside);
            all.add(seen);
        }
        std::printf("  %-10s %ld values, %ld outside, worst %.3g, one colour %.0f ulp\n", name, all.pixels, all.outside,
                    all.worst, all.plain);
        CHECK(all.outside == 0);
        CHECK(all.plain <= plain_ulp);
        double large = 0;
        for (unsigned seed = 0; seed < images / 5; ++seed) {
            const Trial trial = Maker(seed).make(quality, true);
            const Seen seen = judge(trial, device);
            if (seen.plain > plain_ulp_of_large)
                std::printf("    %s %u: %d x %d, %d channels,%s: %.3g beyond, %.0f ulp, %ld outside\n", name, seed,
                            trial.width, trial.height, trial.channels, trial.what.c_str(), seen.worst, seen.plain,
                            seen.outside);
            large = std::max(large, seen.plain);
        }
        std::printf("  %-10s one colour of up to 160 x 60 pixels: %.0f ulp\n", name, large);
        CHECK(large <= plain_ulp_of_large);
    }
}
