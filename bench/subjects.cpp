#include "subjects.hpp"

#include "quad.hpp"

#include <cmath>
#include <cstring>
#include <thread>

namespace fathom::bench {
namespace {

const DepthSpan span{bench_near, bench_far};

Camera camera(const Frames& frames, Projection projection) {
    Camera c;
    c.projection = std::move(projection);
    c.width = frames.width();
    c.height = frames.height();
    return c;
}

Projection centred() {
    return perspective(1.0, 16.0 / 9, span);
}

// All threads at once: what the memory can do.
void copy_on_threads(const float* from, float* to, std::size_t size) {
    const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
    std::vector<std::jthread> workers;
    for (std::size_t i = 0; i < threads; ++i) {
        const std::size_t begin = size * i / threads, end = size * (i + 1) / threads;
        workers.emplace_back([=] { std::memcpy(to + begin, from + begin, (end - begin) * sizeof(float)); });
    }
}

// The truth of a camera whose matrix is the doubles it was given, by elimination in quadruple precision: the third and
// fourth rows of (viewport projection)^-1 for a projection without off-diagonal elements but the third row's.
Quad perspective_depth(float stored) {
    const Quad d = stored, near = bench_near, far = bench_far;
    return 1 / ((1 - d) / near + d / far);
}

struct Plane {
    double a, b, c, d;
};
constexpr Plane oblique_plane{0.1, 0.2, -1, -2};

// Lengyel 2005, eq. 7 and 10, for the symmetric perspective above, in quadruple precision.
Quad oblique_depth(const Frames& frames, int px, int py, float stored) {
    const Quad slope_y = tanq(Quad{1.0} / 2), slope_x = slope_y * Quad{16.0 / 9};
    const Quad a = oblique_plane.a, b = oblique_plane.b, c = oblique_plane.c, d = oblique_plane.d;
    const Quad far = bench_far; // the corner of the far plane farthest inside the plane is (+, +): a, b > 0
    const Quad inside = a * slope_x * far + b * slope_y * far - c * far + d;
    const Quad scale = 2 * far / inside; // (v_f - v_n)(M4.Q)/(C.Q), Q in view space with w = 1
    const Quad x = (2 * (px + Quad{0.5}) / frames.width() - 1) * slope_x;
    const Quad y = (1 - 2 * (py + Quad{0.5}) / frames.height()) * slope_y;
    // z_ndc Z = -Z + scale ((a x + b y - c) Z + d)
    const Quad ndc = 2 * static_cast<Quad>(stored) - 1;
    return scale * d / (ndc + 1 - scale * (a * x + b * y - c));
}

Quad ray_depth(const Frames& frames, int px, int py, float stored) {
    const Quad slope_y = tanq(Quad{1.0} / 2), slope_x = slope_y * Quad{16.0 / 9};
    const Quad x = (2 * (px + Quad{0.5}) / frames.width() - 1) * slope_x;
    const Quad y = (1 - 2 * (py + Quad{0.5}) / frames.height()) * slope_y;
    return stored / sqrtq(1 + x * x + y * y);
}

} // namespace

std::vector<Subject> subjects(Frames& frames, Baselines& plain, Baselines& streaming) {
    std::vector<Subject> list;
    const LinearizeOptions decode{Background::decode};
    const auto add = [&](std::string name, std::string floor, std::function<void()> run,
                         std::function<Quad(int, int, float)> truth = {}, std::function<void()> after = {}) {
        list.push_back({std::move(name), std::move(floor), std::move(run), std::move(after), std::move(truth)});
    };
    const auto baseline = [&](std::string name, const char* kernel, std::vector<float> extra,
                              std::function<Quad(int, int, float)> truth) {
        add(
            std::move(name), "copy",
            [&, kernel, extra] {
                if (extra.size() == 2) {
                    plain.launch(kernel, frames.stored(), frames.result(), {extra[0], extra[1]});
                } else {
                    plain.launch(kernel, frames.stored(), frames.result());
                }
            },
            std::move(truth));
    };
    const auto decoder = [&](std::string name, const Camera& c, std::function<Quad(int, int, float)> truth) {
        add(
            std::move(name), "copy",
            [&, c, decode] {
                linearize({frames.stored(), c}, frames.result(), decode);
            },
            std::move(truth));
    };
    const auto reciprocal = [](int, int, float d) { return perspective_depth(d); };

    add("copy", "copy", [&] { plain.launch("copy", frames.stored(), frames.result()); });
    add("copy (control)", "copy", [&] { plain.launch("copy", frames.stored(), frames.result()); });
    add("copy, streaming stores", "copy", [&] { streaming.launch("copy", frames.stored(), frames.result()); });
    if (frames.device().info().cpu) {
        // Plain memory of the same size: what the device's images lie in is the driver's business.
        struct Memory {
            std::vector<float> from, to;
        };
        const std::size_t size = static_cast<std::size_t>(frames.width()) * static_cast<std::size_t>(frames.height());
        auto memory = std::make_shared<std::vector<Memory>>(
            frames.count(), Memory{std::vector<float>(size, 1), std::vector<float>(size)});
        add("memcpy, all threads", "copy", [&frames, memory, size] {
            Memory& m = (*memory)[frames.current()];
            copy_on_threads(m.from.data(), m.to.data(), size);
        });
    }

    const Camera perspective_camera = camera(frames, centred());
    decoder("linearize reciprocal", perspective_camera, reciprocal);
    Camera parallel = camera(frames, orthographic({-8, 8, -4.5, 4.5}, span));
    decoder("linearize affine", parallel, [](int, int, float d) {
        return Quad{bench_near} + static_cast<Quad>(d) * (Quad{bench_far} - Quad{bench_near});
    });
    const Eigen::Vector4d plane(oblique_plane.a, oblique_plane.b, oblique_plane.c, oblique_plane.d);
    decoder("linearize oblique", camera(frames, with_oblique_near_plane(centred(), plane)),
            [&](int x, int y, float d) { return oblique_depth(frames, x, y, d); });
    Camera exponential = perspective_camera;
    exponential.encoding = Encoding::exponential;
    exponential.near = bench_near;
    exponential.far = bench_far;
    const auto exponential_depth = [](int, int, float d) {
        return Quad{bench_near} * powq(Quad{bench_far} / Quad{bench_near}, d);
    };
    decoder("linearize exponential", exponential, exponential_depth);
    Camera logarithmic = exponential;
    logarithmic.encoding = Encoding::logarithmic;
    decoder("linearize logarithmic", logarithmic,
            [](int, int, float d) { return expm1q(log1pq(Quad{bench_far}) * static_cast<Quad>(d)); });
    Camera ray = perspective_camera;
    ray.encoding = Encoding::ray_distance;
    decoder("linearize ray distance", ray, [&](int x, int y, float d) { return ray_depth(frames, x, y, d); });
    Camera median = perspective_camera;
    median.encoding = Encoding::median;
    median.median = 5;
    decoder("linearize rational (median)", median,
            [](int, int, float d) { return Quad{5} * static_cast<Quad>(d) / (1 - static_cast<Quad>(d)); });
    add("linearize reciprocal, uint16", "copy", [&, perspective_camera, decode] {
        linearize({frames.stored16(), perspective_camera, Storage::uint16}, frames.result(), decode);
    });
    const auto in_place = [&](std::string name, const Camera& c) {
        add(
            std::move(name), "copy",
            [&, c, decode] {
                linearize_in_place({frames.in_place(), c}, decode);
            },
            {}, [&] { frames.restore_in_place(); });
    };
    in_place("linearize reciprocal, in place", perspective_camera);
    in_place("linearize affine, in place", parallel);
    in_place("linearize oblique, in place", camera(frames, with_oblique_near_plane(centred(), plane)));

    add(
        "halve, in place (ceiling)", "copy", [&] { plain.launch("rewrite", frames.in_place(), frames.in_place()); }, {},
        [&] { frames.restore_in_place(); });

    const auto near = static_cast<float>(bench_near), far = static_cast<float>(bench_far);
    baseline("engine 1/(Zd+W)", "engine_fma", {1 / far - 1 / near, 1 / near}, reciprocal);
    baseline("tutorial 2nf/(f+n-z(f-n))", "tutorial_ndc", {near, far}, reciprocal);
    baseline("simulator nf/(f-(f-n)d)", "simulator_ratio", {near, far}, reciprocal);
    baseline("exponential, exp2 builtin", "builtin_exponential", {near, std::log2(far / near)}, exponential_depth);

    add("spread", "spread", [&] { plain.launch("spread", frames.stored(), frames.positions()); });
    add("spread (control)", "spread", [&] { plain.launch("spread", frames.stored(), frames.positions()); });
    const auto positions = [&](std::string name, const Camera& c, const UnprojectOptions& options) {
        add(std::move(name), "spread", [&, c, options] {
            unproject({frames.stored(), c}, frames.positions(), options);
        });
    };
    const UnprojectOptions view{.background = Background::decode};
    UnprojectOptions world = view;
    world.space = Space::world;
    Camera moved = perspective_camera;
    moved.view = Eigen::Matrix4d::Identity();
    moved.view->topRightCorner<3, 1>() = Eigen::Vector3d(1, 2, 3);
    positions("unproject perspective", perspective_camera, view);
    positions("unproject perspective, world", moved, world);
    positions("unproject orthographic", parallel, view);
    positions("unproject oblique", camera(frames, with_oblique_near_plane(centred(), plane)), view);

    const auto normals_of = [&](std::string name, const Camera& c, const NormalsOptions& options) {
        add(std::move(name), "spread", [&, c, options] { normals({frames.stored(), c}, frames.positions(), options); });
    };
    normals_of("normals neighbours", perspective_camera, {.method = NormalMethod::neighbours});
    normals_of("normals neighbours, ortho.", parallel, {.method = NormalMethod::neighbours});
    normals_of("normals least squares", perspective_camera, {.method = NormalMethod::least_squares});
    return list;
}

} // namespace fathom::bench
