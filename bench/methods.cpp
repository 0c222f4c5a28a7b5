#include "methods.hpp"

#include "runtime/state.hpp"
#include "text.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <utility>

namespace fathom::bench {
namespace {

using Kind = Method::Kind;

void add_floors(std::vector<Method>& list, Baselines& kernels) {
    const auto add = [&](const std::string& name, std::function<Image(Case&)> run) {
        for (const char* suffix : {"", " (control)"})
            list.push_back({"copy", name + suffix, Kind::floor, Storage::float32, name, run});
    };
    const auto spread = [&](const char* kernel, int channels) {
        return [&kernels, kernel, channels](Case& on) {
            kernels.launch(kernel, on.stored().image, on.floats(channels));
            return on.floats(channels);
        };
    };
    add("copy", spread("copy", 1));
    add("spread", spread("spread", 3));
    add("fan out", spread("fan_out", 4));
    // Seven floats a pixel: depth and colour in, colour out, as a copy of 3 and a half.
    add("copy depth and RGB", [&kernels](Case& on) {
        const Layout flat{3 * on.width(), on.height()};
        const Image& from = on.stored().image;
        kernels.launch("copy", Image(on.device(), on.color().buffer(), Element::f32, flat),
                       Image(on.device(), on.floats(3).buffer(), Element::f32, flat));
        const int half = (on.height() + 1) / 2;
        kernels.launch("copy", from.region(0, 0, on.width(), half), on.floats(1).region(0, 0, on.width(), half));
        return on.floats(3);
    });
}

bool plain_perspective(const View& view) {
    const auto& frustum = *view.subject.frustum;
    return !frustum.is_orthographic && !frustum.plane && !frustum.reversed;
}

// The formulas that engines and simulators use, in float.
void add_formulas(std::vector<Method>& list, Baselines& kernels) {
    const auto add = [&](std::string name, const char* kernel, bool engine) {
        list.push_back({"linearize",
                        std::move(name),
                        Kind::baseline,
                        Storage::float32,
                        "copy",
                        [&kernels, kernel, engine](Case& on) {
                            const auto& frustum = *on.view().subject.frustum;
                            const auto near = static_cast<float>(frustum.near), far = static_cast<float>(frustum.far);
                            const float first = engine ? 1 / far - 1 / near : near, second = engine ? 1 / near : far;
                            kernels.launch(kernel, on.stored().image, on.floats(1), {first, second});
                            return on.floats(1);
                        },
                        {},
                        plain_perspective});
    };
    add("engine 1/(Zd+W)", "engine_fma", true);
    add("tutorial 2nf/(f+n-z(f-n))", "tutorial_ndc", false);
    add("simulator nf/(f-(f-n)d)", "simulator_ratio", false);
}

// At the image's corners, from the top left row by row: x and y of normalised device coordinates.
constexpr double corners[][2] = {{-1, 1}, {1, 1}, {-1, -1}, {1, -1}};

// Normalised depth is scale times the stored one, plus bias.
std::pair<double, double> depth_range(const Camera& camera) {
    if (camera.projection.convention.clip_z == ClipZ::zero_to_one)
        return {1, 0};
    return {2, -1};
}

// Popov 2016, equations 6 to 9, from the matrix in double as an engine has it. The scale's sign is turned: see
// docs/research.md.
void add_popov(std::vector<Method>& list, Baselines& kernels) {
    list.push_back(
        {"linearize", "Popov's listing 1", Kind::baseline, Storage::float32, "copy", [&kernels](Case& on) {
             const Eigen::Matrix4d p = on.camera().projection.matrix.cast<double>();
             const bool perspective = on.camera().projection.is_perspective();
             const auto [scale, bias] = depth_range(on.camera());
             const double over = perspective ? p(2, 3) : -p(2, 2), side = perspective ? 1 : -1;
             const double of_z = perspective ? p(2, 2) : -p(2, 3);
             const int column = perspective ? 2 : 3;
             std::array<float, 4> terms{};
             for (std::size_t i = 0; i < 4; ++i)
                 terms[i] =
                     static_cast<float>((bias + of_z - (corners[i][0] + side * p(0, column)) * p(2, 0) / p(0, 0) -
                                         (corners[i][1] + side * p(1, column)) * p(2, 1) / p(1, 1)) /
                                        over);
             kernels.launch(perspective ? "popov_perspective" : "popov_orthographic", on.stored().image, on.floats(1),
                            {static_cast<float>(scale / over), terms[0], terms[1], terms[2], terms[3]});
             return on.floats(1);
         }});
}

// Lenaerts 2014, part 2: the rays through the frustum's corners. A far corner that is infinitely far gives way to the middle
// of the depth range.
void add_lenaerts(std::vector<Method>& list, Baselines& kernels) {
    list.push_back(
        {"unproject", "Lenaerts' interpolated rays", Kind::baseline, Storage::float32, "spread", [&kernels](Case& on) {
             const Projection& projection = on.camera().projection;
             const Eigen::Matrix4d p = projection.matrix.cast<double>(), inverse = p.inverse();
             const double near = static_cast<double>(projection.clip_near()),
                          far = 0.5 * (near + static_cast<double>(projection.clip_far()));
             const auto [scale, bias] = depth_range(on.camera());
             cl_float16 rays{}, origins{};
             for (int i = 0; i < 4; ++i) {
                 const double x = corners[i][0], y = corners[i][1];
                 const Eigen::Vector3d nearest = (inverse * Eigen::Vector4d(x, y, near, 1)).hnormalized(),
                                       farther = (inverse * Eigen::Vector4d(x, y, far, 1)).hnormalized();
                 const Eigen::Vector3d ray = (farther - nearest) / (farther - nearest).z();
                 const Eigen::Vector3d origin = nearest - ray * nearest.z();
                 for (int k = 0; k < 3; ++k) {
                     rays.s[4 * i + k] = static_cast<float>(ray[k]);
                     origins.s[4 * i + k] = static_cast<float>(origin[k]);
                 }
                 rays.s[4 * i + 3] = static_cast<float>(p(2, 2) - p(2, 0) * (x + p(0, 2)) / p(0, 0) -
                                                        p(2, 1) * (y + p(1, 2)) / p(1, 1));
             }
             const cl_float4 m{static_cast<float>(p(3, 2)), static_cast<float>(p(2, 3)), static_cast<float>(p(3, 3)),
                               0};
             return kernels.vectors_from(on.stored().image, on.floats(3), "interpolated_rays", rays, origins, m,
                                         cl_float2{static_cast<float>(scale), static_cast<float>(bias)});
         }});
}

// Normals from distances that the library decodes, as their papers have them.
void add_translators(std::vector<Method>& list, Baselines& kernels) {
    const auto add = [&](std::string name, const char* kernel) {
        list.push_back({"normals",
                        std::move(name),
                        Kind::baseline,
                        Storage::float32,
                        "spread",
                        [&kernels, kernel](Case& on) {
                            linearize(on.stored(), on.floats(1));
                            return kernels.vectors_from(on.floats(1), on.floats(3), kernel, pinhole_of(on.camera()));
                        },
                        {},
                        [](const View& view) { return view.camera().projection.is_perspective(); }});
    };
    add("D2NT v3", "d2nt");
    add("3F2N", "three_filters");
}

// Positions, and the cross product of their differences, by the whole inverse matrix in float.
void add_matrix(std::vector<Method>& list, Baselines& kernels) {
    const auto add = [&](const char* operation, std::string name, const char* kernel, Storage storage) {
        list.push_back({operation, std::move(name), Kind::baseline, storage, "spread", [&kernels, kernel](Case& on) {
                            const Eigen::Matrix4f inverse = unprojection(on.camera()).transpose().cast<float>();
                            cl_float16 rows;
                            std::copy_n(inverse.data(), 16, rows.s);
                            return kernels.vectors_from(on.stored().image, on.floats(3), kernel, rows);
                        }});
    };
    add("unproject", "inverse matrix in float", "matrix_position", Storage::float32);
    add("normals", "cross product of differences", "cross_normals", Storage::float32);
}

void add_streams(std::vector<Method>& list) {
    for (const Storage storage : {Storage::float32, Storage::uint16}) {
        list.push_back({"linearize", "fathom", Kind::library, storage, "copy", [storage](Case& on) {
                            linearize(on.stored(storage), on.floats(1), {Background::decode});
                            return on.floats(1);
                        }});
        for (const auto& [name, method] : {std::pair{"neighbours", NormalMethod::neighbours},
                                           std::pair{"least squares", NormalMethod::least_squares}})
            list.push_back({"normals", name, Kind::library, storage, "spread", [storage, method = method](Case& on) {
                                normals(on.stored(storage), on.floats(3), {.method = method});
                                return on.floats(3);
                            }});
    }
    list.push_back({"unproject", "fathom", Kind::library, Storage::float32, "spread", [](Case& on) {
                        unproject(on.stored(), on.floats(3), {.background = Background::decode});
                        return on.floats(3);
                    }});
    list.push_back({"dof_masks", "fathom", Kind::library, Storage::float32, "fan out", [](Case& on) {
                        const DofMasks results = on.masks();
                        dof_masks(on.stored(), results, on.lens(),
                                  {.near_weight = true, .focus_weight = true, .far_weight = true});
                        return results.coc;
                    }});
}

Method occlusion(std::string name, const SsaoOptions& options, bool constant = false) {
    return {"ssao", std::move(name), Kind::library, Storage::float32, "copy", [options, constant](Case& on) {
                SsaoOptions asked = options;
                if (constant || on.as_thick_as_brute_force)
                    asked.thickness = on.brute_force_thickness();
                return ssao(on.stored(), on.radius(), asked).visibility;
            }};
}

void add_ssao(std::vector<Method>& list) {
    for (const bool half : {false, true}) {
        const char* const suffix = half ? ", half resolution" : "";
        for (const auto& [name, quality] :
             {std::pair{"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}})
            for (const bool constant : {false, true})
                list.push_back(
                    occlusion(text(name, suffix, constant ? constant_suffix : ""),
                              {.sampling = Sampling{.quality = quality,
                                                    .half_resolution = half ? std::optional(true) : std::nullopt}},
                              constant));
        if (!half)
            list.push_back({"ssao", text("accurate", backs_suffix), Kind::library, Storage::float32, "copy",
                            [](Case& on) {
                                const SsaoOptions options{.sampling = Sampling{.quality = Quality::accurate},
                                                          .thickness = on.backs()};
                                return ssao(on.stored(), on.radius(), options).visibility;
                            },
                            [](Case& on) { on.backs(); }});
        std::vector<std::pair<int, int>> explicit_counts{{1, 8}, {1, 16}, {2, 32}, {4, 32}, {4, 64}};
        if (half) // 1 x 16 is what `fast` does
            explicit_counts = {{1, 64}, {4, 64}};
        for (const auto& [slices, samples] : explicit_counts)
            list.push_back(
                occlusion(text(slices, " x ", samples, suffix),
                          {.sampling = Sampling{.slices = slices, .samples = samples, .half_resolution = half}}));
    }
    struct Swept {
        int slices, samples, jitter;
        double growth;
        bool half;
    };
    constexpr Swept swept[] = {
        {1, 8, 16, 4, false},  {1, 24, 16, 1, false}, {1, 24, 16, 2, false}, {1, 24, 16, 4, false},
        {1, 32, 16, 4, false}, {2, 16, 16, 4, false}, {2, 24, 16, 4, false}, {2, 32, 16, 2, false},
        {2, 32, 16, 4, false}, {3, 32, 16, 4, false}, {4, 16, 4, 4, false},  {4, 30, 4, 1, false},
        {4, 30, 4, 4, false},  {8, 32, 4, 4, false},  {1, 8, 16, 4, true},   {1, 16, 16, 1, true},
        {1, 16, 16, 4, true},  {1, 32, 16, 4, true},  {2, 32, 16, 4, true},  {4, 30, 4, 4, true},
    };
    for (const Swept& each : swept) {
        list.push_back(
            occlusion(text(each.slices, " x ", each.samples, each.jitter == 16 ? "" : ", jitter 4",
                           each.growth > 1 ? text(", growth ", each.growth) : "", each.half ? ", half resolution" : ""),
                      {.sampling = Sampling{.slices = each.slices,
                                            .samples = each.samples,
                                            .growth = each.growth,
                                            .jitter = each.jitter,
                                            .half_resolution = each.half}}));
        list.back().swept = true;
    }
}

void add_dof(std::vector<Method>& list, Baselines& kernels) {
    const auto add = [&](std::string name, Quality quality) {
        list.push_back(
            {"dof", std::move(name), Kind::library, Storage::float32, "copy depth and RGB", [quality](Case& on) {
                 dof(on.stored(), on.color(), on.floats(3), on.lens(), {.quality = quality});
                 return on.floats(3);
             }});
    };
    add("fast", Quality::fast);
    add("balanced", Quality::balanced);
    add("accurate", Quality::accurate);
    // Their kernels know only rows without a gap between them.
    constexpr int tile = 32;
    const auto gather = [&](const char* name, std::function<void(Case&, const DofMasks&)> start, bool tiles) {
        list.push_back({"dof",
                        name,
                        Kind::baseline,
                        Storage::float32,
                        "copy depth and RGB",
                        [=](Case& on) {
                            start(on, dof_masks(on.stored(), on.lens(),
                                                {.tile_px = tile, .tile_min_coc = tiles, .tile_max_coc = tiles}));
                            return on.floats(3);
                        },
                        {},
                        [](const View& view) { return view.camera().width % 16 == 0; }});
    };
    gather(
        "gather by the centre's circle",
        [&kernels](Case& on, const DofMasks& masks) {
            kernels.start("centre_gather", on.width(), on.height(), runtime::buffer_of(masks.coc),
                          runtime::buffer_of(on.color()), runtime::buffer_of(on.floats(3)), cl_int{on.width()},
                          cl_int{on.height()});
        },
        false);
    gather(
        "gather of 49 in rings",
        [&kernels](Case& on, const DofMasks& masks) {
            kernels.start("ring_gather", on.width(), on.height(), runtime::buffer_of(masks.coc),
                          runtime::buffer_of(masks.tile_min_coc), runtime::buffer_of(masks.tile_max_coc),
                          runtime::buffer_of(on.color()), runtime::buffer_of(on.floats(3)), cl_int{on.width()},
                          cl_int{on.height()}, cl_int{tile}, static_cast<cl_int>(masks.tile_min_coc.row_stride()));
        },
        true);
}

double bytes(const Image& image) {
    return image ? static_cast<double>(runtime::buffer_of(image).getInfo<CL_MEM_SIZE>()) : 0;
}

} // namespace

const char* kind_name(Kind kind) {
    switch (kind) {
    case Kind::library:
        return "library";
    case Kind::baseline:
        return "baseline";
    case Kind::opencv:
        return "opencv";
    case Kind::blender:
        return "blender";
    case Kind::python:
        return "python";
    case Kind::floor:
        return "floor";
    }
    return "";
}

std::vector<Method> methods(Baselines& kernels) {
    std::vector<Method> list;
    add_floors(list, kernels);
    add_streams(list);
    add_formulas(list, kernels);
    add_popov(list, kernels);
    add_matrix(list, kernels);
    add_lenaerts(list, kernels);
    add_translators(list, kernels);
    add_ssao(list);
    add_dof(list, kernels);
    return list;
}

double bytes_of(const Method& method, Case& on) {
    auto& scratch = on.device().state().scratch;
    scratch.clear();
    const Image result = method.run(on);
    on.device().finish();
    double sum = bytes(result) + bytes(on.stored(method.storage).image);
    if (method.operation == "dof")
        sum += bytes(on.color());
    if (method.name.ends_with(backs_suffix))
        sum += bytes(on.backs().image);
    if (method.operation == "dof_masks")
        sum += 3 * bytes(result);
    for (const runtime::ScratchBuffer& each : scratch)
        sum += static_cast<double>(each.size);
    return sum;
}

} // namespace fathom::bench
