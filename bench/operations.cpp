#include "operations.hpp"

#include "runtime/state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>

namespace fathom::bench {
namespace {

constexpr double near = 0.1, far = 1e5;    // where engines' formulas start to fail
constexpr CircleOfConfusion lens{20, 140}; // focused at 7: circles to 20 pixels behind, to ever more before
const char* const rgb = "copy, 1080p depth and RGB";

/// Made when it is first asked for: a room takes seconds.
using Place = std::function<Case&()>;

struct Row {
    std::string name, floor;
    Place place;
    std::function<void(Case&)> run;
    int every = 1;                               ///< rounds from one run to the next: more for what takes long
    bool baseline = false;                       ///< does what the library does in another way
    std::optional<oracle::Subject> decoded = {}; ///< the camera whose exact depth the result is compared with
    bool in_place = false;                       ///< overwrites what it reads
};

template <typename Make>
Place later(Make make) {
    return [make, made = std::make_shared<std::unique_ptr<Case>>()]() -> Case& {
        if (!*made)
            *made = std::make_unique<Case>(make());
        return **made;
    };
}

// Uniform stored depth, with a fraction close to 1 where distant surfaces lie.
Case random_frames(const Device& device, const oracle::Subject& subject, int count) {
    std::mt19937 random(20161);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<double> stored;
    for (long i = 0; i < static_cast<long>(subject.camera.width) * subject.camera.height; ++i) {
        const float d = uniform(random);
        stored.push_back(static_cast<double>(uniform(random) < 0.25f ? 1 - d * 1e-4f : d));
    }
    return {device, {"frames", {}, subject, 1, true}, stored, count};
}

Place room(const Device& device, Size size, bool is_orthographic = false) {
    const double aspect = 1.0 * size.first / size.second, half = std::min(3.9, 1.45 * aspect);
    const oracle::Subject camera =
        is_orthographic ? oracle::from_orthographic({-half, half, -half / aspect, half / aspect}, {0.1, 100})
                        : oracle::from_field_of_view(1.0, aspect, {0.1, 100});
    const View view{"room", scene::room(), oracle::named(camera, "room", size.first, size.second), 0.5, true};
    return later([=] { return Case(device, view, 1); });
}

// The rows, and what they run on.
struct Rows {
    const Device& device;
    Size size;
    Place frames;
    std::vector<Method> methods;
    std::vector<Row> list = {};

    Row& add(std::string name, const char* floor, const Place& place, std::function<void(Case&)> run, int every = 1) {
        return list.emplace_back(Row{std::move(name), floor, place, std::move(run), every});
    }

    /// A method of the charts.
    Row& charted(std::string name, const char* method, const char* floor, const Place& place, int every = 1) {
        const auto run = std::ranges::find(methods, method, &Method::name)->run;
        return add(
            std::move(name), floor, place, [run](Case& on) { run(on); }, every);
    }
    Row& charted(const char* name, const char* floor) { return charted(name, name, floor, frames); }

    /// The camera for the frames.
    oracle::Subject sized(oracle::Subject subject, Encoding encoding = Encoding::window) const {
        Camera& camera = subject.camera;
        camera.encoding = encoding;
        camera.median = 5;
        if (encoding == Encoding::exponential || encoding == Encoding::logarithmic)
            camera.near_plane = near, camera.far_plane = far;
        return oracle::named(std::move(subject), to_string(encoding), size.first, size.second);
    }
    oracle::Subject perspective(Encoding encoding = Encoding::window) const {
        return sized(oracle::from_field_of_view(1.0, 16.0 / 9, {near, far}), encoding);
    }
    oracle::Subject orthographic() const { return sized(oracle::from_orthographic({-8, 8, -4.5, 4.5}, {near, far})); }
    oracle::Subject oblique() const { return oracle::with_oblique_near_plane(perspective(), {0.1, 0.2, -1, -2}); }
};

void add_linearize(Rows& rows) {
    const LinearizeOptions decode{Background::decode};
    const auto add = [&](std::string name, const oracle::Subject& subject) {
        rows.add(std::move(name), "copy", rows.frames,
                 [decode, c = subject.camera](Case& on) {
                     linearize({on.stored().image, c}, on.floats(1), decode);
                 })
            .decoded = subject;
    };
    add("linearize reciprocal", rows.perspective());
    add("linearize affine", rows.orthographic());
    add("linearize oblique", rows.oblique());
    add("linearize exponential", rows.perspective(Encoding::exponential));
    add("linearize logarithmic", rows.perspective(Encoding::logarithmic));
    add("linearize ray distance", rows.perspective(Encoding::ray_distance));
    add("linearize rational (median)", rows.perspective(Encoding::median));
    rows.add("linearize reciprocal, uint16", "copy", rows.frames,
             [decode](Case& on) { linearize(on.stored(Storage::uint16), on.floats(1), decode); });
    rows.add("linearize reciprocal, in place", "copy", rows.frames,
             [decode, c = rows.perspective().camera](Case& on) {
                 linearize({on.in_place(), c}, on.in_place(), decode);
             })
        .in_place = true;
    for (const char* formula : {"engine 1/(Zd+W)", "tutorial 2nf/(f+n-z(f-n))", "simulator nf/(f-(f-n)d)"})
        rows.charted(formula, "copy").decoded = rows.perspective();
}

void add_points(Rows& rows) {
    const auto add = [&](std::string name, const Camera& camera, Space space = Space::view) {
        rows.add(std::move(name), "spread", rows.frames, [=](Case& on) {
            UnprojectOptions options;
            options.space = space;
            options.background = Background::decode;
            unproject({on.stored().image, camera}, on.floats(3), options);
        });
    };
    Camera moved = rows.perspective().camera;
    moved.view = Eigen::Matrix4d::Identity();
    moved.view->topRightCorner<3, 1>() = Eigen::Vector3d(1, 2, 3);
    add("unproject perspective", rows.perspective().camera);
    add("unproject perspective, world", moved, Space::world);
    add("unproject orthographic", rows.orthographic().camera);
    add("unproject oblique", rows.oblique().camera);
    const auto add_normals = [&](std::string name, const Camera& camera, const NormalsOptions& options) {
        rows.add(std::move(name), "spread", rows.frames, [=](Case& on) {
            normals({on.stored().image, camera}, on.floats(3), options);
        });
    };
    const Camera perspective = rows.perspective().camera;
    add_normals("normals neighbours", perspective, {.method = NormalMethod::neighbours});
    add_normals("normals neighbours, ortho.", rows.orthographic().camera, {.method = NormalMethod::neighbours});
    add_normals("normals least squares", perspective, {.method = NormalMethod::least_squares});
    add_normals("normals noise 9e-4", perspective, {.noise = 9e-4});
}

// In a room of the frames' size, radii in its widths at the median depth.
void add_ssao(Rows& rows) {
    constexpr int seldom = 16; // seconds each
    const auto add = [&](std::string name, const Place& place, Quality quality, double fraction, int every = 4) {
        rows.add(
            std::move(name), "copy", place,
            [=](Case& on) {
                ssao(on.stored(), fraction * on.median_width(), {.sampling = Sampling{.quality = quality}});
            },
            every);
    };
    const Place usual = room(rows.device, rows.size);
    add("ssao fast, 5 %", usual, Quality::fast, 0.05);
    add("ssao balanced, 5 %", usual, Quality::balanced, 0.05);
    add("ssao accurate, 5 %", usual, Quality::accurate, 0.05);
    add("ssao fast, 40 %", usual, Quality::fast, 0.4);
    add("ssao balanced, 40 %", usual, Quality::balanced, 0.4);
    add("ssao accurate, 40 %", usual, Quality::accurate, 0.4, seldom);
    add("ssao balanced, 5 %, ortho.", room(rows.device, rows.size, true), Quality::balanced, 0.05);
}

void add_masks(Rows& rows) {
    rows.charted("fan out", "fan out");
    rows.charted("fan out (control)", "fan out");
    const DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};
    const auto add = [&](std::string name, const Camera& camera, bool mixed = false) {
        DofMasksOptions asked = weights;
        asked.mixed_pixels = mixed;
        rows.add(std::move(name), "fan out", rows.frames, [=](Case& on) {
            dof_masks({on.stored().image, camera}, on.masks(mixed), lens, asked);
        });
    };
    const Camera perspective_camera = rows.perspective().camera;
    const DepthSpan infinite{near, std::numeric_limits<double>::infinity(), DepthOrder::reversed};
    add("dof_masks standard", perspective_camera);
    add("dof_masks reversed infinite",
        rows.sized(oracle::from_field_of_view(1.0, 16.0 / 9, infinite, Convention::direct3d())).camera);
    add("dof_masks oblique", rows.oblique().camera);
    add("dof_masks view-z", rows.perspective(Encoding::view_z).camera);
    add("dof_masks and mixed pixels", perspective_camera, true);
    rows.add("dof_masks standard, new images", "fan out", rows.frames, [=](Case& on) {
        dof_masks({on.stored().image, perspective_camera}, lens, weights);
    });
    rows.add("linearize, then dof_masks", "fan out", rows.frames,
             [=](Case& on) {
                 linearize({on.stored().image, perspective_camera}, on.floats(1), {Background::decode});
                 dof_masks(ViewDepth{on.floats(1), perspective_camera}.stored(), on.masks(), lens, weights);
             })
        .baseline = true;
}

// In a room of 1920 × 1080, in focus at the table.
void add_dof(Rows& rows) {
    const Place place = room(rows.device, {1920, 1080});
    rows.charted(rgb, "copy depth and RGB", rgb, place);
    rows.charted(rgb + std::string(" (control)"), "copy depth and RGB (control)", rgb, place);
    const auto add_fog = [&](std::string name, const FogOptions& options) {
        rows.add(std::move(name), rgb, place, [options](Case& on) {
            StoredDepth depth = on.stored();
            depth.camera.view = Eigen::Matrix4d::Identity();
            fog(depth, on.color(), on.floats(3), options);
        });
    };
    add_fog("fog uniform", {.density = 0.05});
    add_fog("fog height", {.density = 0.2, .height_falloff = 0.5});
    const auto circles_to = [](Case& on, double largest) {
        on.focus = 4.5;
        on.max_coc_px = largest;
        return on.lens();
    };
    const auto add = [&](std::string name, double largest, DofOptions options = {}, int every = 4) {
        rows.add(
            std::move(name), rgb, place,
            [=](Case& on) mutable { dof(on.stored(), on.color(), on.floats(3), circles_to(on, largest), options); },
            every);
    };
    add("dof balanced, 64 px", 64);
    add("dof fast, 64 px", 64, {.quality = Quality::fast});
    add("dof accurate, 64 px", 64, {.quality = Quality::accurate}, 16);
    add("dof balanced, 64 px, six blades", 64, {.aperture = {.blades = 6}});
    add("dof balanced, 64 px, 2 : 1", 64, {.aperture = {.ratio = 2}});
    rows.add(
        "dof balanced, 64 px, with a clean plate", rgb, place,
        [=, wall = Image()](Case& on) mutable { // all over, in the picture's colours
            if (!wall) {
                wall = Image(on.device(), Element::f32, {on.width(), on.height()});
                runtime::queue_of(on.device())
                    .enqueueFillBuffer(runtime::buffer_of(wall), std::ranges::max(images::floats(on.stored().image)), 0,
                                       Image::allocation(Element::f32, {on.width(), on.height()}));
            }
            DofOptions options;
            options.clean_plate = CleanPlate{on.color(), {wall, on.camera()}};
            dof(on.stored(), on.color(), on.floats(3), circles_to(on, 64), options);
        },
        4);
    add("dof balanced, 16 px", 16);
    add("dof balanced, 256 px", 256);
    add("dof balanced, all in focus", 1);
}

std::vector<Row> all_rows(Rows rows) {
    rows.charted("copy", "copy");
    rows.charted("copy (control)", "copy");
    add_linearize(rows);
    rows.charted("spread", "spread");
    rows.charted("spread (control)", "spread");
    add_points(rows);
    add_ssao(rows);
    add_masks(rows);
    add_dof(rows);
    return std::move(rows.list);
}

// Rows with `text` in their names and the floors that they need.
std::vector<Row> chosen(std::vector<Row> list, const std::string& text) {
    if (text.empty())
        return list;
    std::set<std::string> names;
    for (const Row& row : list)
        if (row.name.find(text) != std::string::npos)
            names.insert({row.name, row.floor, row.floor + " (control)"});
    std::erase_if(list, [&](const Row& row) { return !names.contains(row.name); });
    for (Row& row : list)
        row.every = 1;
    return list;
}

// Over a sample of pixels, in units in the last place of the exact value.
Deviation error_of(const Row& row, Case& on) {
    row.run(on);
    const std::vector<float> stored = images::floats(on.stored().image), result = images::floats(on.floats(1));
    const oracle::Truth truth(*row.decoded, Storage::float32);
    const auto width = static_cast<std::size_t>(on.width());
    constexpr std::size_t stride = 37;
    std::vector<double> errors;
    for (std::size_t i = 0; i < stored.size(); i += stride) {
        const auto x = static_cast<double>(i % width) + 0.5, y = static_cast<double>(i / width) + 0.5;
        const oracle::Quad exact = truth.depth(static_cast<double>(stored[i]), x, y);
        if (exact > 0 && exact < 1e38)
            errors.push_back(oracle::error_in_ulp(result[i], exact));
    }
    return summary("ulp", errors);
}

// What a row's name says of it.
Figures described(const Row& row, const Case& on) {
    const std::string& name = row.name;
    const std::string word = name.substr(0, name.find_first_of(" ,"));
    const bool formula = row.decoded && word != "linearize";
    const bool own = word == "linearize" || word == "unproject" || word == "normals" || word.starts_with("dof") ||
                     word == "ssao" || word == "fog";
    return {.operation = formula ? "linearize"
                         : own   ? word
                                 : "copy",
            .method = own && name.size() > word.size() ? name.substr(word.size() + 1) : name,
            .kind = formula || row.baseline ? "baseline"
                    : own                   ? "library"
                                            : "floor",
            .storage = name.find("uint16") != std::string::npos ? "uint16" : "float32",
            .scene = on.view().name,
            .width = on.width(),
            .height = on.height(),
            .floor = row.floor};
}

} // namespace

std::vector<Figures> operations(const Device& device, Size size, int frames, const Effort& effort) {
    Baselines kernels(device);
    const oracle::Subject camera =
        oracle::named(oracle::from_field_of_view(1.0, 16.0 / 9, {near, far}), "frames", size.first, size.second);
    const int count = frames > 0 ? frames : std::max(2, static_cast<int>(0.5e9 / (8.0 * size.first * size.second)) + 1);
    const std::vector<Row> rows =
        chosen(all_rows({device, size, later([=] { return random_frames(device, camera, count); }), methods(kernels)}),
               effort.only);
    std::vector<Work> work;
    for (const Row& row : rows) {
        Case& on = row.place();
        row.run(on);
        on.complete();
        work.push_back({.before = [&on] { on.next(); },
                        .run = [&] { row.run(row.place()); },
                        .after = [&] { row.in_place ? row.place().restore() : void(); },
                        .every = row.every});
    }
    const auto samples = measured(device, work, effort.rounds, effort.clock);
    std::map<std::string, double> floors;
    for (std::size_t i = 0; i < rows.size(); ++i)
        floors[rows[i].name] = median(samples[i]);
    std::vector<Figures> figures;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        Case& on = rows[i].place();
        Figures& row = figures.emplace_back(described(rows[i], on));
        row.seconds = samples[i];
        row.floor_seconds = floors.at(row.floor);
        if (rows[i].decoded)
            row.error = error_of(rows[i], on);
        effort.report(row);
    }
    return figures;
}

} // namespace fathom::bench
