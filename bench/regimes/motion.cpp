// Results over time: a camera that moves by fractions of a pixel a frame, and a focus that is pulled. Edges are slanted, so that
// at every moment some pixel passes from one side to the other.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/lens.hpp"
#include "regimes/regime.hpp"
#include "regimes/walls.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace fathom::regimes {
namespace {

constexpr int width = 144, height = 112, margin = 40; // what lies within the margin is judged
constexpr int frames = 60;
constexpr double slant = 0.3; // radians from upright
constexpr double near_diameter = 24;
constexpr const char* exact = "exact blur of the pixels";
constexpr double most_flicker = 1.5, most_jump = 1; // times the truth's, and times the error
// The rms error of a picture of 8 bits by rounding alone. An error below it is not seen, so that its changes are not held
// against it: two frames' errors that have nothing in common differ by the square root of 2 times the error, however small.
const double rounding = 1 / (255 * std::sqrt(12));

// What is looked at: of each there are two panels.
constexpr const char* of_ssao = "ssao";
constexpr const char* of_near_edge = "dof, near edge";
constexpr const char* of_focus_pull = "dof, focus pull";
std::string flicker(const std::string& what) {
    return what + ": second difference over time, times the truth's";
}
std::string jump(const std::string& what) {
    return what + ": change of the error in a frame, times the error";
}

// Distance of a pixel's centre from the edge, which has moved so far to the right.
double from_edge(int x, int y, double moved) {
    return (x + 0.5 - width / 2.0 - moved) * std::cos(slant) + (y + 0.5 - height / 2.0) * std::sin(slant);
}

using Frame = std::vector<double>;

template <typename ValueAt>
Frame frame_of(ValueAt value_at) {
    Frame frame;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            frame.push_back(value_at(x, y));
    return frame;
}

double rms(const std::function<double(std::size_t)>& at) {
    double sum = 0;
    for (int y = margin; y < height - margin; ++y)
        for (int x = margin; x < width - margin; ++x)
            sum += std::pow(at(static_cast<std::size_t>(y * width + x)), 2);
    return std::sqrt(sum / ((width - 2 * margin) * (height - 2 * margin)));
}

// What a method gives over time, beside the truth.
struct Film {
    std::vector<Frame> got, truth;

    double flickers() const {
        const auto second = [](const std::vector<Frame>& film) {
            double sum = 0;
            for (std::size_t t = 1; t + 1 < film.size(); ++t)
                sum +=
                    std::pow(rms([&](std::size_t i) { return film[t + 1][i] - 2 * film[t][i] + film[t - 1][i]; }), 2);
            return std::sqrt(sum);
        };
        return second(got) / second(truth);
    }

    double jumps() const {
        double largest = 0, error = 0;
        for (std::size_t t = 0; t < got.size(); ++t) {
            const auto off = [&](std::size_t at, std::size_t i) { return got[at][i] - truth[at][i]; };
            error += std::pow(rms([&](std::size_t i) { return off(t, i); }), 2) / static_cast<double>(got.size());
            if (t > 0)
                largest = std::max(largest, rms([&](std::size_t i) { return off(t, i) - off(t - 1, i); }));
        }
        return largest / std::max(std::sqrt(error), rounding);
    }
};

void add(Regime& regime, const char* what, const char* curve, double parameter, const Film& film) {
    regime.panel(flicker(what)).curve(curve).points.push_back({parameter, film.flickers()});
    regime.panel(jump(what)).curve(curve).points.push_back({parameter, film.jumps()});
}

// A floor beside a wall without an end, from above. A pixel is a unit wide.
Film occlusion(const Device& device, Quality quality, double speed) {
    constexpr double radius = 24;
    Camera camera =
        camera_over(orthographic({-width / 2.0, width / 2.0, -height / 2.0, height / 2.0}, {0.5, 1e4}), width, height);
    camera.encoding = Encoding::view_z;
    SsaoOptions options{.sampling = Sampling{.quality = quality}};
    options.thickness = std::numeric_limits<double>::infinity();
    Film film;
    for (int t = 0; t < frames; ++t) {
        const auto from_foot = [&](int x, int y) { return from_edge(x, y, speed * t); };
        std::vector<float> depth;
        for (const double d : frame_of(from_foot))
            depth.push_back(d < 0 ? 1.0f : static_cast<float>(1 + 2 * radius));
        const auto visibility =
            images::floats(ssao(images::stored_of(device, depth, camera), radius, options).visibility);
        film.got.emplace_back(visibility.begin(), visibility.end());
        film.truth.push_back(frame_of([&](int x, int y) {
            const double d = from_foot(x, y);
            return d < 0 ? 1.0 : beside_wall(d / radius);
        }));
    }
    return film;
}

// How much of a pixel lies beyond the edge, as a picture without steps has it.
double covered(double from_edge) {
    return std::clamp(from_edge + 0.5, 0.0, 1.0);
}

// A white half-plane before the focus and a black ground behind it: the edge of a circle's diameter.
Film near_edge(double speed, const std::function<Frame(const Frame& beyond)>& blur) {
    Film film;
    for (int t = 0; t < frames; ++t) {
        const Frame beyond = frame_of([&](int x, int y) { return -from_edge(x, y, speed * t); });
        film.got.push_back(blur(beyond));
        film.truth.push_back(beyond);
        for (double& value : film.truth.back())
            value = half_plane(value / (near_diameter / 2));
    }
    return film;
}

// The same blur of the same pixels without a method's shortcuts: every pixel before the edge spreads its colour over a disc,
// and hides what is behind as much. Depth has no part of a pixel, so that this edge moves in steps, too.
Frame exact_blur(const Frame& beyond) {
    constexpr double diameter = near_diameter;
    const int reach = static_cast<int>(diameter / 2) + 1;
    Frame blurred(beyond.size(), 0.0);
    for (int y = margin; y < height - margin; ++y)
        for (int x = margin; x < width - margin; ++x) {
            double weight = 0, color = 0;
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx) {
                    const double share = covered(diameter / 2 - std::hypot(dx, dy));
                    const double d = beyond[static_cast<std::size_t>((y + dy) * width + x + dx)];
                    weight += share;
                    color += d > 0 ? share * covered(d) : 0;
                }
            blurred[static_cast<std::size_t>(y * width + x)] = color / weight;
        }
    return blurred;
}

Frame blurred_by(const Device& device, Quality quality, const Frame& beyond) {
    const auto at = [&](int x, int y) { return beyond[static_cast<std::size_t>(y * width + x)]; };
    const Picture picture(
        width, height, [&](int x, int y) { return at(x, y) > 0 ? -near_diameter : near_diameter / 2; },
        [&](int x, int y) { return covered(at(x, y)); });
    return picture.blurred(device, quality);
}

// An edge on one surface behind the focus, whose circle grows with every frame.
Film pulled_focus(const Device& device, Quality quality, double speed) {
    constexpr double first = 4;
    Film film;
    for (int t = 0; t < frames; ++t) {
        const double diameter = first + speed * t;
        const auto beyond = [](int x, int y) { return from_edge(x, y, 0); };
        const Picture picture(
            width, height, [&](int, int) { return diameter; }, [&](int x, int y) { return covered(beyond(x, y)); });
        film.got.push_back(picture.blurred(device, quality));
        film.truth.push_back(frame_of([&](int x, int y) { return half_plane(beyond(x, y) / (diameter / 2)); }));
    }
    return film;
}

} // namespace

Regime motion(const Device& device) {
    Regime regime{"motion", "pixels a frame"};
    constexpr double speeds[] = {0.025, 0.1, 0.2, 0.4};
    for (const Way& way : ways)
        for (const double speed : speeds) {
            add(regime, of_ssao, way.name, speed, occlusion(device, way.quality, speed));
            add(regime, of_near_edge, way.name, speed,
                near_edge(speed, [&](const Frame& beyond) { return blurred_by(device, way.quality, beyond); }));
            add(regime, of_focus_pull, way.name, speed, pulled_focus(device, way.quality, speed));
        }
    for (const double speed : speeds)
        add(regime, of_near_edge, exact, speed, near_edge(speed, exact_blur));

    const char* why = "wanted: steady to watch";
    for (const Way& way : ways) {
        const bool fast = way.quality == Quality::fast;
        regime.boundaries.push_back({flicker(of_ssao), way.name, most_flicker, 0, none, why});
        regime.boundaries.push_back(fast ? Boundary{jump(of_ssao), way.name, most_jump, 0, none, why}
                                         : Boundary{jump(of_ssao), way.name, most_jump, 0.2, 0.4, why});
        regime.boundaries.push_back({jump(of_near_edge), way.name, most_jump, 0, none, why});
        regime.boundaries.push_back({flicker(of_focus_pull), way.name, most_flicker, 0.1, 0.025, why});
        regime.boundaries.push_back(way.quality == Quality::accurate
                                        ? Boundary{jump(of_focus_pull), way.name, most_jump, 0.2, 0.4, why}
                                        : Boundary{jump(of_focus_pull), way.name, most_jump, 0, none, why});
    }
    for (const char* const curve : {exact, "accurate", "balanced"})
        regime.boundaries.push_back({flicker(of_near_edge), curve, most_flicker, 0.4, 0.2, why});
    regime.boundaries.push_back({flicker(of_near_edge), "fast", most_flicker, 0.2, 0.1, why});
    return regime;
}

} // namespace fathom::regimes
