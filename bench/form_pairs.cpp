// What a kernel that is built for less saves, on the same input.
//
// Three runs a round in random order: the kernel that the camera needs, the wider one, and the first again as a control. A
// figure is a ratio of medians, its spread the quartiles of the rounds' own ratios. Once with frames that lie in memory, as
// frames from elsewhere do, once with one that stays in the cache, where arithmetic is all that is left to save.

#include "form_pairs.hpp"

#include "camera/eye_rays.hpp"
#include "forms.hpp"
#include "frames.hpp"
#include "measure.hpp"
#include "room_depth.hpp"
#include "views.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

namespace fathom::bench {
namespace {

// Where the pixels lie, and how often a run goes over them.
struct Place {
    const char* name;
    const Device& device;
    int width, height;
    int repeats;
    std::function<Image()> stored = {}; // of the current frame
    std::function<void()> next = {};    // goes on to another
};

// The same work by two kernels.
struct Pair {
    std::string operation, camera, least, wider;
    std::function<Image()> run_least, run_wider;                       // and what they wrote to
    std::function<double(std::size_t pixel, float stored)> exact = {}; // of float32 depth
    double size = 0; // differences are counted in units of the last place of this, or of a larger value's
};

struct Agreement {
    double same = 0;                             // share of values with the same bits
    double apart = 0;                            // most units in the last place between two values
    double error_least = NAN, error_wider = NAN; // worst, in units in the last place of the exact value
};

struct Named {
    const char* name;
    Camera camera;
    Storage storage = Storage::float32;
};

std::vector<Named> cameras(int width, int height) {
    const DepthSpan span{0.1, 1e5};
    const Projection centred = perspective(1.0, 16.0 / 9, span), box = orthographic({-8, 8, -4.5, 4.5}, span);
    Projection tilted = centred;
    tilted.matrix(3, 0) = 0.06L;
    tilted.matrix(3, 1) = -0.04L;
    const auto of = [&](Projection projection, Encoding encoding = Encoding::window) {
        Camera camera;
        camera.projection = std::move(projection);
        camera.width = width;
        camera.height = height;
        camera.encoding = encoding;
        camera.median = 5;
        return camera;
    };
    return {{"perspective", of(centred)},
            {"perspective, uint16", of(centred), Storage::uint16},
            {"oblique near plane", of(with_oblique_near_plane(centred, {0.1, 0.2, -1, -2}))},
            {"orthographic", of(box)},
            {"oblique orthographic", of(with_oblique_near_plane(box, {0.1, 0.2, -1, -2}))},
            {"median", of(centred, Encoding::median)},
            {"ray distance", of(centred, Encoding::ray_distance)},
            {"fourth row with x and y", of(tilted)}};
}

const Image& source(const Frames& frames, Storage storage) {
    return storage == Storage::uint16 ? frames.stored16() : frames.stored();
}

// The kernels of one camera and what each is a case of.
void add_linearize(std::vector<Pair>& pairs, Frames& frames, const Named& named) {
    const Model least = least_model(named.camera, named.storage);
    const auto run = [&frames, named](const Model& model) {
        return [&frames, named, model] {
            linearize_as(model, {source(frames, named.storage), named.camera, named.storage}, frames.result());
            return frames.result();
        };
    };
    const auto width = static_cast<std::size_t>(frames.width());
    const auto exact = [named, width](std::size_t pixel, float stored) {
        const auto x = static_cast<double>(pixel % width) + 0.5, y = static_cast<double>(pixel / width) + 0.5;
        return static_cast<double>(view_depth(named.camera, named.storage, x, y, static_cast<double>(stored)));
    };
    for (const Model& wider : wider_models(least)) {
        pairs.push_back(Pair{"linearize", named.name, least.name, wider.name, run(least), run(wider)});
        if (named.storage == Storage::float32)
            pairs.back().exact = exact;
    }
}

// Rays that cover one depth a step, against those that each cover their own.
void add_rays(std::vector<Pair>& pairs, Frames& frames, const Named& named) {
    const Model least = least_model(named.camera);
    if (!least.rays.w_is_depth || least.form.form == Form::ray_distance)
        return;
    const Model wider = with_depth_of_each_ray(least);
    const auto add = [&](const char* operation, auto launch, const Image& (Frames::*target)() const) {
        const auto run = [&](const Model& model) {
            return [&frames, camera = named.camera, model, launch, target] {
                launch(model, {frames.stored(), camera}, (frames.*target)());
                return (frames.*target)();
            };
        };
        pairs.push_back(Pair{operation, named.name, "w = z", "w = (z - eye) / depth(x, y)", run(least), run(wider)});
    };
    add("unproject", unproject_as, &Frames::positions);
    if (eye_rays(least.rays).perspective)
        add("inverse depth", inverse_depth_as, &Frames::result);
}

// A lens of f/2 and 50 mm focused at 5; telecentric under an orthographic projection.
void add_circles(std::vector<Pair>& pairs, Frames& frames, const Named& named) {
    const bool is_orthographic = !named.camera.projection.is_perspective();
    const CircleOfConfusion circle = is_orthographic ? CircleOfConfusion{.k = 20, .g = 4, .telecentric = true}
                                                     : CircleOfConfusion{.k = 20, .g = 100};
    const std::vector<CircleModel> models = circle_models(named.camera, circle);
    const auto run = [&](const CircleModel& model) {
        return [&frames, camera = named.camera, model, circle] {
            circle_as(model, circle, {frames.stored(), camera}, frames.result());
            return frames.result();
        };
    };
    for (std::size_t i = 1; i < models.size(); ++i) {
        pairs.push_back({.operation = "dof_masks",
                         .camera = named.name,
                         .least = models[0].name,
                         .wider = models[i].name,
                         .run_least = run(models[0]),
                         .run_wider = run(models[i]),
                         .size = static_cast<double>(circle.k)});
    }
}

// What is solid behind a pixel: the same everywhere, or an image of it.
std::vector<Pair> thicknesses(const StoredDepth& room) {
    const Layout layout{room.image.width(), room.image.height()};
    const auto size = static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.height);
    constexpr float thin = 0.25f;
    const auto run = [&](SsaoOptions options) { return [room, options] { return ssao(room, options).visibility; }; };
    SsaoOptions constant{.radius = 0.5}, image{.radius = 0.5};
    constant.thickness = thin;
    image.thickness_map = uploaded(room.image.device(), layout, std::vector<float>(size, thin));
    return {Pair{"ssao", "perspective, a room", "thickness, one for all", "thickness, an image", run(constant),
                 run(image)}};
}

std::vector<Pair> chosen(std::vector<Pair> pairs, const std::string& only) {
    std::erase_if(pairs, [&](const Pair& p) {
        return (p.operation + '\n' + p.camera + '\n' + p.least + '\n' + p.wider).find(only) == std::string::npos;
    });
    return pairs;
}

std::vector<Pair> pairs_of(Frames& frames, const std::string& only) {
    std::vector<Pair> pairs;
    for (const Named& named : cameras(frames.width(), frames.height())) {
        add_linearize(pairs, frames, named);
        if (named.storage == Storage::float32 && named.camera.encoding == Encoding::window)
            add_rays(pairs, frames, named), add_circles(pairs, frames, named);
    }
    return chosen(std::move(pairs), only);
}

std::vector<float> values(const Image& image) {
    std::vector<float> all(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                           static_cast<std::size_t>(image.channels()));
    image.download(all.data());
    return all;
}

double ulp(double value) {
    return std::ldexp(1.0, std::ilogb(value) - 23);
}

double error_in_ulp(float got, double exact) {
    return std::abs(static_cast<double>(got) - exact) / ulp(exact);
}

// In units of the last place; infinite where only one is a number, or only one infinite.
double difference(float a, float b, double size) {
    if (!std::isfinite(a) || !std::isfinite(b))
        return INFINITY;
    const double largest = std::max({size, static_cast<double>(std::abs(a)), static_cast<double>(std::abs(b))});
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) / ulp(largest);
}

Agreement compared(const Pair& pair, const Place& place) {
    const std::vector<float> least = values(pair.run_least()), wider = values(pair.run_wider());
    Agreement agreement;
    std::size_t same = 0;
    for (std::size_t i = 0; i < least.size(); ++i) {
        if (std::bit_cast<std::uint32_t>(least[i]) == std::bit_cast<std::uint32_t>(wider[i]) ||
            (std::isnan(least[i]) && std::isnan(wider[i])))
            ++same;
        else
            agreement.apart = std::fmax(agreement.apart, difference(least[i], wider[i], pair.size));
    }
    agreement.same = static_cast<double>(same) / static_cast<double>(least.size());
    if (!pair.exact)
        return agreement;
    const std::vector<float> depth = values(place.stored());
    constexpr std::size_t stride = 37;
    for (std::size_t i = 0; i < least.size(); i += stride) {
        const double exact = pair.exact(i, depth[i]);
        if (!(std::abs(exact) < 1e30) || std::isnan(least[i]) || exact == 0)
            continue;
        agreement.error_least = std::fmax(agreement.error_least, error_in_ulp(least[i], exact));
        agreement.error_wider = std::fmax(agreement.error_wider, error_in_ulp(wider[i], exact));
    }
    return agreement;
}

struct Ratio {
    double seconds, wider, low, high, control;
};

Ratio measured(const Pair& pair, const Place& place, int rounds, Clock clock) {
    const auto repeated = [&](const std::function<Image()>& run) {
        return Work{place.next, [&place, &run] {
                        for (int i = 0; i < place.repeats; ++i)
                            run();
                    }};
    };
    const std::vector<Work> work{repeated(pair.run_least), repeated(pair.run_wider), repeated(pair.run_least)};
    const auto times = measured(place.device, work, rounds, clock);
    std::vector<double> ratios;
    for (std::size_t i = 0; i < times[0].size(); ++i)
        ratios.push_back(times[1][i] / times[0][i]);
    const double least = median(times[0]);
    return {least / place.repeats, median(times[1]) / least, quantile(ratios, 0.25), quantile(ratios, 0.75),
            median(times[2]) / least};
}

void add_rows(Table& table, const std::vector<Pair>& pairs, const Place& place, int rounds, Clock clock) {
    if (pairs.empty())
        return;
    const bool fp64 = place.device.options().arithmetic == Arithmetic::fp64;
    const char* arithmetic = fp64 ? "fp64" : "two floats";
    std::printf("\n%s, %d x %d in %s, %d rounds; x: time of the wider kernel, of the same one as control\n", arithmetic,
                place.width, place.height, place.name, rounds);
    std::printf("%-12s %-23s %-23s %-30s %7s %6s %12s %7s %8s %8s %7s %7s\n", "", "camera", "kernel", "wider", "ms",
                "x", "quartiles", "control", "same", "apart", "ulp", "wider");
    for (const Pair& pair : pairs) {
        const Agreement agreement = compared(pair, place);
        const Ratio r = measured(pair, place, rounds, clock);
        std::printf("%-12s %-23s %-23s %-30s %7.3f %6.3f %5.3f-%6.3f %7.3f %7.3f%% %8.3g %7.3g %7.3g\n",
                    pair.operation.c_str(), pair.camera.c_str(), pair.least.c_str(), pair.wider.c_str(),
                    1e3 * r.seconds, r.wider, r.low, r.high, r.control, 100 * agreement.same, agreement.apart,
                    agreement.error_least, agreement.error_wider);
        std::fflush(stdout);
        table.add({pair.operation, pair.camera, pair.least, pair.wider, arithmetic, place.name, 1e3 * r.seconds,
                   r.wider, r.low, r.high, r.control, agreement.same, agreement.apart, agreement.error_least,
                   agreement.error_wider});
    }
}

Place place_of(const char* name, Frames& frames, int repeats) {
    return {name,
            frames.device(),
            frames.width(),
            frames.height(),
            repeats,
            [&frames] { return frames.stored(); },
            [&frames] { frames.next(); }};
}

} // namespace

Table form_pairs(const Device& device, int width, int height, const std::string& only, int rounds, Clock clock) {
    Table table(device, {"operation", "camera", "kernel", "wider", "arithmetic", "place", "ms", "ratio", "ratio_q25",
                         "ratio_q75", "control", "same_bits", "ulp_apart", "ulp_off", "ulp_off_wider"});
    std::vector<Arithmetic> arithmetics{device.options().arithmetic};
    if (arithmetics[0] == Arithmetic::fp64)
        arithmetics.push_back(Arithmetic::two_float);
    for (const Arithmetic arithmetic : arithmetics) {
        DeviceOptions options = device.options();
        options.arithmetic = arithmetic;
        const Device own = Device::open(device.info().name, options);
        {
            const int count = std::max(2, static_cast<int>(0.5e9 / (8.0 * width * height)) + 1);
            Frames frames(own, width, height, count);
            add_rows(table, pairs_of(frames, only), place_of("memory", frames, 1), rounds, clock);
        }
        Frames frame(own, 1024, 256, 1);
        add_rows(table, pairs_of(frame, only), place_of("the cache", frame, 32), rounds, clock);
        const Camera camera = room_view(960, 540).camera();
        const StoredDepth room{uploaded(own, {960, 540}, room_depth(camera)), camera};
        add_rows(table, chosen(thicknesses(room), only), {"memory", own, 960, 540, 1}, std::min(rounds, 11), clock);
    }
    return table;
}

} // namespace fathom::bench
