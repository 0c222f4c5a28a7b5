#include "subjects.hpp"

#include "quad.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
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

// Lengyel 2005, eq. 7, 9 and 10, for the symmetric perspective above, in quadruple precision.
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

using Truth = std::function<Quad(int, int, float)>;

// The rows, and what they run on.
struct Rows {
    Frames& frames;
    Baselines& plain;
    Baselines& streaming;
    std::vector<Subject> list;

    void add(std::string name, std::string floor, std::function<void()> run, Truth truth = {},
             std::function<void()> after = {}) {
        list.push_back({.name = std::move(name),
                        .floor = std::move(floor),
                        .run = std::move(run),
                        .after = std::move(after),
                        .truth = std::move(truth)});
    }
};

Camera perspective_camera(const Frames& frames) {
    return camera(frames, centred());
}

Camera orthographic_camera(const Frames& frames) {
    return camera(frames, orthographic({-8, 8, -4.5, 4.5}, span));
}

Camera oblique_camera(const Frames& frames) {
    const Eigen::Vector4d plane(oblique_plane.a, oblique_plane.b, oblique_plane.c, oblique_plane.d);
    return camera(frames, with_oblique_near_plane(centred(), plane));
}

// A centred perspective with depth stored in another way.
Camera encoded_camera(const Frames& frames, Encoding encoding) {
    Camera c = perspective_camera(frames);
    c.encoding = encoding;
    if (encoding == Encoding::exponential || encoding == Encoding::logarithmic) {
        c.near = bench_near;
        c.far = bench_far;
    }
    if (encoding == Encoding::median)
        c.median = 5;
    return c;
}

Quad exponential_depth(int, int, float stored) {
    return Quad{bench_near} * powq(Quad{bench_far} / Quad{bench_near}, stored);
}

Quad reciprocal_depth(int, int, float stored) {
    return perspective_depth(stored);
}

void add_copies(Rows& rows) {
    Frames& frames = rows.frames;
    Baselines &plain = rows.plain, &streaming = rows.streaming;
    rows.add("copy", "copy", [&] { plain.launch("copy", frames.stored(), frames.result()); });
    rows.add("copy (control)", "copy", [&] { plain.launch("copy", frames.stored(), frames.result()); });
    rows.add("copy, streaming stores", "copy", [&] { streaming.launch("copy", frames.stored(), frames.result()); });
    if (!frames.device().info().cpu)
        return;
    // Plain memory of the same size: what the device's images lie in is the driver's business.
    struct Memory {
        std::vector<float> from, to;
    };
    const std::size_t size = static_cast<std::size_t>(frames.width()) * static_cast<std::size_t>(frames.height());
    auto memory = std::make_shared<std::vector<Memory>>(frames.count(),
                                                        Memory{std::vector<float>(size, 1), std::vector<float>(size)});
    rows.add("memcpy, all threads", "copy", [&frames, memory, size] {
        Memory& m = (*memory)[frames.current()];
        copy_on_threads(m.from.data(), m.to.data(), size);
    });
}

void add_linearize(Rows& rows) {
    Frames& frames = rows.frames;
    const LinearizeOptions decode{Background::decode};
    const auto add = [&](std::string name, const Camera& c, Truth truth) {
        rows.add(
            std::move(name), "copy",
            [&frames, c, decode] {
                linearize({frames.stored(), c}, frames.result(), decode);
            },
            std::move(truth));
    };
    add("linearize reciprocal", perspective_camera(frames), reciprocal_depth);
    add("linearize affine", orthographic_camera(frames), [](int, int, float d) {
        return Quad{bench_near} + static_cast<Quad>(d) * (Quad{bench_far} - Quad{bench_near});
    });
    add("linearize oblique", oblique_camera(frames),
        [&](int x, int y, float d) { return oblique_depth(frames, x, y, d); });
    add("linearize exponential", encoded_camera(frames, Encoding::exponential), exponential_depth);
    add("linearize logarithmic", encoded_camera(frames, Encoding::logarithmic),
        [](int, int, float d) { return expm1q(log1pq(Quad{bench_far}) * static_cast<Quad>(d)); });
    add("linearize ray distance", encoded_camera(frames, Encoding::ray_distance),
        [&](int x, int y, float d) { return ray_depth(frames, x, y, d); });
    add("linearize rational (median)", encoded_camera(frames, Encoding::median),
        [](int, int, float d) { return Quad{5} * static_cast<Quad>(d) / (1 - static_cast<Quad>(d)); });
    rows.add("linearize reciprocal, uint16", "copy", [&frames, c = perspective_camera(frames), decode] {
        linearize({frames.stored16(), c, Storage::uint16}, frames.result(), decode);
    });
}

void add_linearize_in_place(Rows& rows) {
    Frames& frames = rows.frames;
    const auto restore = [&] { frames.restore_in_place(); };
    const auto add = [&](std::string name, const Camera& c) {
        const auto run = [&frames, c] { linearize_in_place({frames.in_place(), c}, {Background::decode}); };
        rows.add(std::move(name), "copy", run, {}, restore);
    };
    add("linearize reciprocal, in place", perspective_camera(frames));
    add("linearize affine, in place", orthographic_camera(frames));
    add("linearize oblique, in place", oblique_camera(frames));
    Baselines& plain = rows.plain;
    rows.add(
        "halve, in place (ceiling)", "copy", [&] { plain.launch("rewrite", frames.in_place(), frames.in_place()); }, {},
        restore);
}

void add_formulas(Rows& rows) {
    Frames& frames = rows.frames;
    Baselines& plain = rows.plain;
    const auto add = [&](std::string name, const char* kernel, float first, float second, Truth truth) {
        rows.add(
            std::move(name), "copy",
            [&, kernel, first, second] {
                plain.launch(kernel, frames.stored(), frames.result(), {first, second});
            },
            std::move(truth));
    };
    const auto near = static_cast<float>(bench_near), far = static_cast<float>(bench_far);
    add("engine 1/(Zd+W)", "engine_fma", 1 / far - 1 / near, 1 / near, reciprocal_depth);
    add("tutorial 2nf/(f+n-z(f-n))", "tutorial_ndc", near, far, reciprocal_depth);
    add("simulator nf/(f-(f-n)d)", "simulator_ratio", near, far, reciprocal_depth);
    add("exponential, exp2 builtin", "builtin_exponential", near, std::log2(far / near), exponential_depth);
}

void add_unproject(Rows& rows) {
    Frames& frames = rows.frames;
    Baselines& plain = rows.plain;
    rows.add("spread", "spread", [&] { plain.launch("spread", frames.stored(), frames.positions()); });
    rows.add("spread (control)", "spread", [&] { plain.launch("spread", frames.stored(), frames.positions()); });
    const auto add = [&](std::string name, const Camera& c, const UnprojectOptions& options) {
        rows.add(std::move(name), "spread", [&frames, c, options] {
            unproject({frames.stored(), c}, frames.positions(), options);
        });
    };
    const UnprojectOptions view{.background = Background::decode};
    UnprojectOptions world = view;
    world.space = Space::world;
    Camera moved = perspective_camera(frames);
    moved.view = Eigen::Matrix4d::Identity();
    moved.view->topRightCorner<3, 1>() = Eigen::Vector3d(1, 2, 3);
    add("unproject perspective", perspective_camera(frames), view);
    add("unproject perspective, world", moved, world);
    add("unproject orthographic", orthographic_camera(frames), view);
    add("unproject oblique", oblique_camera(frames), view);
}

void add_normals(Rows& rows) {
    Frames& frames = rows.frames;
    const auto add = [&](std::string name, const Camera& c, NormalMethod method) {
        rows.add(std::move(name), "spread", [&frames, c, method] {
            normals({frames.stored(), c}, frames.positions(), {.method = method});
        });
    };
    add("normals neighbours", perspective_camera(frames), NormalMethod::neighbours);
    add("normals neighbours, ortho.", orthographic_camera(frames), NormalMethod::neighbours);
    add("normals least squares", perspective_camera(frames), NormalMethod::least_squares);
}

} // namespace

std::vector<Subject> subjects(Frames& frames, Baselines& plain, Baselines& streaming) {
    Rows rows{frames, plain, streaming, {}};
    add_copies(rows);
    add_linearize(rows);
    add_linearize_in_place(rows);
    add_formulas(rows);
    add_unproject(rows);
    add_normals(rows);
    std::ranges::move(ssao_subjects(frames.device(), frames.width(), frames.height()), std::back_inserter(rows.list));
    std::ranges::move(dof_subjects(frames, plain, streaming), std::back_inserter(rows.list));
    return std::move(rows.list);
}

} // namespace fathom::bench
