// The operations: keyword arguments to options structs. The names are those of the C++ options and of the program.
#include "operations.hpp"

#include "call.hpp"
#include "unlocked.hpp"

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/fog.hpp>
#include <fathom/lens.hpp>
#include <fathom/linearize.hpp>
#include <fathom/normals.hpp>
#include <fathom/photograph.hpp>
#include <fathom/ssao.hpp>
#include <fathom/unproject.hpp>

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <variant>

namespace fathom::python {
namespace {

using nb::arg;
using Number = std::optional<double>;
using Count = std::optional<int>;
using Flag = std::optional<bool>;
using Vector = std::optional<std::array<double, 3>>;

// None is the default, which the options struct has already.
template <typename Option, typename Given>
void set(Option& option, const std::optional<Given>& given) {
    if (given)
        option = *given;
}

void set(Eigen::Vector3d& option, const Vector& given) {
    if (given)
        option = Eigen::Map<const Eigen::Vector3d>(given->data());
}

int checked_channels(const Count& given) {
    const int channels = given.value_or(3);
    if (channels != 3 && channels != 4)
        throw std::invalid_argument("channels = " + std::to_string(channels) + " must be 3 or 4");
    return channels;
}

// The way to compute something that is asked for: a word, or the tolerance instead of it.
template <typename Method>
std::variant<Method, MaxError> method_or(const Number& max_error, const Word<Method>& word, Method otherwise,
                                         const char* name) {
    word.set(otherwise, name);
    if (!max_error)
        return otherwise;
    if (word.is_given())
        throw std::invalid_argument(std::string("max_error chooses the ") + name + " itself: give one of the two");
    return MaxError{*max_error};
}

// `thickness=`: a number, an array with one for each pixel, 'silhouette', or a BackDepth.
std::optional<Thickness> thickness_of(const ThicknessGiven& thickness, Call& call) {
    const nb::object& given = thickness.given;
    if (!given.is_valid() || given.is_none())
        return std::nullopt;
    if (nb::isinstance<BackDepth>(given))
        return call.more_depth({nb::cast<const BackDepth&>(given).depth}, "thickness");
    if (nb::isinstance<nb::str>(given)) {
        if (text_of(nb::borrow<nb::str>(given)) == "silhouette")
            return Silhouette{};
        throw std::invalid_argument("thickness = " + text_of(nb::repr(given)) +
                                    " is unknown; it is a number, an array, 'silhouette' or a fathom.BackDepth");
    }
    double number = 0;
    const bool is_scalar = !nb::hasattr(given, "shape") || nb::len(nb::object(given.attr("shape"))) == 0; // also one of NumPy's
    if (is_scalar && nb::try_cast(given, number))
        return number;
    return call.image({given}, Holds::numbers, "thickness");
}

nb::object result_type(const char* name) {
    return nb::module_::import_("fathom._results").attr(name);
}

// The targets of several results: None, or a tuple with one for each field, as an earlier call returned it. A result that is
// not asked for has none.
nb::object target_of(const Target& out, std::size_t field, std::size_t fields, bool asked, const char* name) {
    if (!out.given.is_valid() || out.given.is_none())
        return nb::none();
    if (!nb::isinstance<nb::tuple>(out.given) || nb::len(out.given) != fields)
        throw std::invalid_argument("out: must be a tuple of " + std::to_string(fields) +
                                    " arrays or None, one for each field of the result");
    nb::object target = out.given[field];
    if (!asked && !target.is_none())
        throw std::invalid_argument(std::string(name) + ": is given, but the call does not ask for this result");
    return target;
}

nb::object linearize_of(const Pixels& depth, const CameraObject& camera, const Word<Background>& background,
                        const Word<Storage>& storage, const Target& out, const DeviceChoice& device) {
    LinearizeOptions options;
    background.set(options.background, "background");
    Call call(depth, camera, storage, device);
    const Image result = call.result(out.given, "out");
    call.run([&] { linearize(call.depth(), result, options); });
    return call.take();
}

nb::object unproject_of(const Pixels& depth, const CameraObject& camera, const Word<Space>& space, const Vector& origin,
                        const Count& channels, const Word<Background>& background, const Word<Storage>& storage,
                        const Target& out, const DeviceChoice& device) {
    UnprojectOptions options;
    space.set(options.space, "space");
    set(options.origin, origin);
    options.channels = checked_channels(channels);
    background.set(options.background, "background");
    Call call(depth, camera, storage, device);
    const Image result = call.result(out.given, "out", options.channels);
    call.run([&] { unproject(call.depth(), result, options); });
    return call.take();
}

nb::object normals_of(const Pixels& depth, const CameraObject& camera, const Word<NormalMethod>& method,
                      const Number& max_error, const Word<Space>& space, const Count& channels, const Number& tolerance,
                      const Number& noise, const Word<Storage>& storage, const Target& out,
                      const DeviceChoice& device) {
    NormalsOptions options;
    options.method = method_or(max_error, method, NormalMethod::automatic, "method");
    space.set(options.space, "space");
    options.channels = checked_channels(channels);
    set(options.tolerance, tolerance);
    set(options.noise, noise);
    Call call(depth, camera, storage, device);
    const Image result = call.result(out.given, "out", options.channels);
    call.run([&] { normals(call.depth(), result, options); });
    return call.take();
}

nb::object ssao_of(const Pixels& depth, const CameraObject& camera, const Number& radius, const Word<Quality>& quality,
                   const Count& slices, const Count& samples, const Count& jitter, const Flag& half_resolution,
                   const Number& max_error, const ThicknessGiven& thickness, const Number& falloff,
                   const Word<Border>& border, const std::optional<std::int64_t>& seed,
                   const std::optional<std::array<int, 4>>& region, const Number& tolerance, const Pixels& normals,
                   const Word<Space>& normals_space, const Flag& bent_normal, const Flag& confidence,
                   const Word<Storage>& storage, const Target& out, const DeviceChoice& device) {
    SsaoOptions options;
    Sampling sampling{.slices = slices, .samples = samples, .jitter = jitter, .half_resolution = half_resolution};
    quality.set(sampling.quality, "quality");
    if (max_error && (quality.is_given() || slices || samples || jitter || half_resolution))
        throw std::invalid_argument(
            "max_error chooses the quality, slices, samples, jitter and half_resolution itself: give them or it");
    options.sampling = sampling;
    if (max_error)
        options.sampling = MaxError{*max_error};
    set(options.falloff, falloff);
    border.set(options.border, "border");
    if (seed && (*seed < 0 || *seed > std::numeric_limits<std::uint32_t>::max()))
        throw std::invalid_argument("seed = " + std::to_string(*seed) + " must be 0 to 4294967295");
    options.seed = static_cast<std::uint32_t>(seed.value_or(options.seed));
    set(options.tolerance, tolerance);
    normals_space.set(options.normals_space, "normals_space");
    set(options.bent_normal, bent_normal);
    set(options.confidence, confidence);
    const Number length = radius ? radius : camera.file().lens.ao_distance;
    if (!length)
        throw std::invalid_argument(
            "radius: missing, and the camera has no \"ao_distance\"; give a length in scene units");

    Call call(depth, camera, storage, device);
    Layout layout{call.depth().image.width(), call.depth().image.height()};
    if (region) {
        const auto [x, y, width, height] = *region;
        static_cast<void>(call.depth().image.region(x, y, width, height)); // throws where it does not fit
        options.region = {x, y, width, height};
        layout = {width, height};
    }
    options.thickness = thickness_of(thickness, call);
    if (normals)
        options.normals = call.image(normals, Holds::numbers, "normals");
    const bool several = options.bent_normal || options.confidence;
    const auto target = [&](std::size_t field, bool asked, const char* name) {
        return several ? target_of(out, field, 3, asked, name) : out.given;
    };
    const nb::object visibility_target = target(0, true, "out.visibility"),
                     bent_target = target(1, options.bent_normal, "out.bent_normal"),
                     confidence_target = target(2, options.confidence, "out.confidence");
    const Layout directions{layout.width, layout.height, 3};
    Occlusion results;
    results.visibility = call.result(visibility_target, "out", Element::f32, layout);
    if (options.bent_normal)
        results.bent_normal = call.result(bent_target, "out.bent_normal", Element::f32, directions);
    if (options.confidence)
        results.confidence = call.result(confidence_target, "out.confidence", Element::f32, layout);
    call.run([&] { ssao(call.depth(), results, *length, options); });
    if (!several)
        return call.take();
    const nb::object visibility = call.take();
    const nb::object bent = options.bent_normal ? call.take() : nb::none();
    static const nb::handle type = result_type("Occlusion").release(); // as long as the process
    return type(visibility, bent, options.confidence ? call.take() : nb::none());
}

// A lens as the arguments and the camera give it, as the program takes it.
struct LensArguments {
    Number focus;
    std::optional<std::array<int, 2>> focus_at;
    std::optional<std::tuple<int, int, double>> focus_along;
    Number f_stop, focal_length_mm, sensor_mm, mm_per_unit;
    std::optional<std::array<double, 2>> circle;

    CircleOfConfusion circle_for(const StoredDepth& stored, const LensDefaults& defaults) const {
        const bool lens = focus || focus_at || focus_along || f_stop || focal_length_mm || sensor_mm;
        if (circle) {
            if (lens)
                throw std::invalid_argument("circle is given instead of a lens; leave one of the two out");
            const bool perspective = depth_form(stored.camera, stored.storage).perspective;
            const long double centre = perspective ? camera_rays(stored.camera).centre_depth : 0;
            return {(*circle)[0], (*circle)[1], centre, !perspective};
        }
        if (focus.has_value() + focus_at.has_value() + focus_along.has_value() > 1)
            throw std::invalid_argument("focus, focus_at and focus_along are three ways to say one depth; give one");
        const auto needed = [](const Number& given, const Number& otherwise, const char* name, const char* key) {
            if (!given && !otherwise)
                throw std::invalid_argument(std::string(name) + ": missing, and the camera has no \"" + key + "\"");
            return given ? *given : *otherwise;
        };
        Lens made{.f_stop = needed(f_stop, defaults.f_stop, "f_stop", "f_stop"),
                  .focus = focus_at      ? depth_at(stored, (*focus_at)[0], (*focus_at)[1])
                           : focus_along ? along_ray(stored)
                                         : needed(focus, defaults.focus, "focus", "focus"),
                  .focal_length_mm = focal_length_mm ? focal_length_mm : defaults.focal_length_mm,
                  .sensor_mm = sensor_mm ? sensor_mm : defaults.sensor_mm};
        set(made.mm_per_unit, mm_per_unit);
        return circle_of_confusion(made, stored.camera);
    }

private:
    double along_ray(const StoredDepth& stored) const {
        const auto [x, y, distance] = *focus_along;
        return depth_along_ray(stored.camera, x + 0.5, y + 0.5, distance);
    }
};

nb::object dof_masks_of(const Pixels& depth, const CameraObject& camera, const Number& focus,
                        const std::optional<std::array<int, 2>>& focus_at,
                        const std::optional<std::tuple<int, int, double>>& focus_along, const Number& f_stop,
                        const Number& focal_length_mm, const Number& sensor_mm, const Number& mm_per_unit,
                        const std::optional<std::array<double, 2>>& circle, const Number& sharp_px,
                        const Number& transition_px, const Word<Sky>& sky, const Number& max_coc_px,
                        const Flag& near_weight, const Flag& focus_weight, const Flag& far_weight,
                        const Flag& max_near_coc, const Flag& near_alpha, const Flag& disocclusion,
                        const Flag& mixed_pixels, const Count& tile_px, const Flag& tile_min_coc,
                        const Flag& tile_max_coc, const Word<Storage>& storage, const Target& out,
                        const DeviceChoice& device) {
    DofMasksOptions options;
    set(options.sharp_px, sharp_px);
    set(options.transition_px, transition_px);
    sky.set(options.sky, "sky");
    set(options.max_coc_px, max_coc_px);
    set(options.near_weight, near_weight);
    set(options.focus_weight, focus_weight);
    set(options.far_weight, far_weight);
    set(options.max_near_coc, max_near_coc);
    set(options.near_alpha, near_alpha);
    set(options.disocclusion, disocclusion);
    set(options.mixed_pixels, mixed_pixels);
    set(options.tile_px, tile_px);
    set(options.tile_min_coc, tile_min_coc);
    set(options.tile_max_coc, tile_max_coc);

    Call call(depth, camera, storage, device);
    const LensArguments lens{focus, focus_at, focus_along, f_stop, focal_length_mm, sensor_mm, mm_per_unit, circle};
    const Layout pixels{call.depth().image.width(), call.depth().image.height()};
    const int tile = std::max(options.tile_px, 1); // what is less is refused below
    const Layout tiles{(pixels.width - 1) / tile + 1, (pixels.height - 1) / tile + 1};
    struct Field {
        const char* name;
        Image DofMasks::*image;
        bool wanted;
        const Layout& layout;
    };
    const std::array<Field, 10> fields{{
        {"out.coc", &DofMasks::coc, true, pixels},
        {"out.near_weight", &DofMasks::near_weight, options.near_weight, pixels},
        {"out.focus_weight", &DofMasks::focus_weight, options.focus_weight, pixels},
        {"out.far_weight", &DofMasks::far_weight, options.far_weight, pixels},
        {"out.max_near_coc", &DofMasks::max_near_coc, options.max_near_coc, pixels},
        {"out.near_alpha", &DofMasks::near_alpha, options.near_alpha, pixels},
        {"out.disocclusion", &DofMasks::disocclusion, options.disocclusion, pixels},
        {"out.mixed_pixels", &DofMasks::mixed_pixels, options.mixed_pixels, pixels},
        {"out.tile_min_coc", &DofMasks::tile_min_coc, options.tile_min_coc, tiles},
        {"out.tile_max_coc", &DofMasks::tile_max_coc, options.tile_max_coc, tiles},
    }};
    DofMasks results;
    for (std::size_t i = 0; i < fields.size(); ++i) {
        const auto& [name, image, wanted, layout] = fields[i];
        const nb::object target = target_of(out, i, fields.size(), wanted, name);
        if (wanted)
            results.*image = call.result(target, name, Element::f32, layout);
    }
    call.run([&] { dof_masks(call.depth(), results, lens.circle_for(call.depth(), camera.file().lens), options); });
    nb::list made;
    for (const Field& field : fields)
        made.append(field.wanted ? call.take() : nb::none());
    static const nb::handle type = result_type("DofMasks").release(); // as long as the process
    return type(*made);
}

nb::object dof_of(const Pixels& depth, const CameraObject& camera, const Pixels& color, const Number& focus,
                  const std::optional<std::array<int, 2>>& focus_at,
                  const std::optional<std::tuple<int, int, double>>& focus_along, const Number& f_stop,
                  const Number& focal_length_mm, const Number& sensor_mm, const Number& mm_per_unit,
                  const std::optional<std::array<double, 2>>& circle, const Count& blades,
                  const Number& rotation_degrees, const Number& ratio, const Word<Quality>& quality,
                  const Number& max_error, const Word<Sky>& sky, const Number& max_coc_px, const Pixels& clean_plate,
                  const Pixels& clean_plate_depth, const Word<Storage>& storage, const Target& out,
                  const DeviceChoice& device) {
    DofOptions options;
    options.quality = method_or(max_error, quality, Quality::balanced, "quality");
    set(options.aperture.blades, blades);
    set(options.aperture.rotation_degrees, rotation_degrees);
    set(options.aperture.ratio, ratio);
    sky.set(options.sky, "sky");
    set(options.max_coc_px, max_coc_px);
    if (static_cast<bool>(clean_plate) != static_cast<bool>(clean_plate_depth))
        throw std::invalid_argument("clean_plate and clean_plate_depth belong together; give both, or none");

    Call call(depth, camera, storage, device);
    const Image picture = call.image(color, Holds::picture, "color");
    if (clean_plate)
        options.clean_plate = {call.image(clean_plate, Holds::picture, "clean_plate"),
                               call.more_depth(clean_plate_depth, "clean_plate_depth")};
    const LensArguments lens{focus, focus_at, focus_along, f_stop, focal_length_mm, sensor_mm, mm_per_unit, circle};
    const Image result =
        call.result(out.given, "out", picture.element(), {picture.width(), picture.height(), picture.channels()});
    call.run([&] { dof(call.depth(), picture, result, lens.circle_for(call.depth(), camera.file().lens), options); });
    return call.take();
}

nb::object fog_of(const Pixels& depth, const CameraObject& camera, const Pixels& color, double density,
                  const Number& max_opacity, const Number& start, const Vector& fog_color, const Number& height_falloff,
                  const Number& reference_height, const Vector& up, const Word<FogSky>& sky,
                  const Word<FogAlpha>& alpha, const Word<Storage>& storage, const Target& out,
                  const DeviceChoice& device) {
    FogOptions options{.density = density};
    set(options.max_opacity, max_opacity);
    set(options.start, start);
    set(options.fog_color, fog_color);
    set(options.height_falloff, height_falloff);
    set(options.reference_height, reference_height);
    set(options.up, up);
    sky.set(options.sky, "sky");
    alpha.set(options.alpha, "alpha");
    Call call(depth, camera, storage, device);
    const Image picture = call.image(color, Holds::picture, "color");
    const double most = picture.element() == Element::u8 ? 255 : 65535;
    if (const bool whole = picture.element() == Element::u8 || picture.element() == Element::u16;
        whole && fog_color && std::ranges::any_of(*fog_color, [](double value) { return value > 1; }))
        throw std::invalid_argument("fog_color = " + text_of(nb::str(nb::cast(std::tuple_cat(*fog_color)))) +
                                    ": 1 is white, so it is 0 to 1 for " + name_of(picture.element()) +
                                    ", too; divide by " + std::to_string(static_cast<int>(most)));
    const Image result =
        call.result(out.given, "out", picture.element(), {picture.width(), picture.height(), picture.channels()});
    call.run([&] { fog(call.depth(), picture, result, options); });
    return call.take();
}

nb::object fill_invalid_of(const Pixels& depth, const CameraObject& camera, const Word<Storage>& storage,
                           const Target& out, const DeviceChoice& device) {
    Call call(depth, camera, storage, device);
    const Image& image = call.depth().image;
    const Image result =
        call.result(out.given, "out", image.element(), {image.width(), image.height(), image.channels()});
    call.run([&] { fill_invalid(call.depth(), result); });
    return call.take();
}

double depth_at_of(const Pixels& depth, const CameraObject& camera, int x, int y, const Word<Storage>& storage,
                   const DeviceChoice& device) {
    Call call(depth, camera, storage, device);
    double z = 0;
    call.run([&] { z = depth_at(call.depth(), x, y); });
    return z;
}

nb::object restore_highlights_of(const Pixels& color, double peak) {
    auto [light, layout] = floats_of(color, "color");
    restore_highlights(light, layout.channels, peak);
    float* made = nullptr;
    nb::object result = new_floats(layout, made);
    std::ranges::copy(light, made);
    return result;
}

nb::object upsample_along_edges_of(const Pixels& depth, const Pixels& color) {
    const auto [values, small] = floats_of(depth, "depth");
    const auto [light, large] = floats_of(color, "color");
    std::vector<float> fine;
    {
        const Unlocked released;
        fine = upsample_along_edges({values.data(), small.width, small.height, small.channels},
                                    {light.data(), large.width, large.height, large.channels});
    }
    float* made = nullptr;
    nb::object result = new_floats({large.width, large.height}, made);
    std::ranges::copy(fine, made);
    return result;
}

// What the same call costs in C++: seconds, and those of them that the calling thread works. python/tests compares.
Seconds seconds_of_linearize(const nb::ndarray<float, nb::ndim<2>, nb::c_contig>& depth, const CameraObject& camera,
                             const nb::ndarray<float, nb::ndim<2>, nb::c_contig>& out, const DeviceChoice& choice) {
    const Device device = device_of(choice);
    const Layout layout{static_cast<int>(depth.shape(1)), static_cast<int>(depth.shape(0))};
    const Camera& of_size = camera.for_size(layout.width, layout.height);
    const Unlocked released;
    const Seconds start = seconds_now();
    {
        const Image image = Image::from_host(device, Element::f32, depth.data(), layout);
        const Image result = Image::onto_host(device, Element::f32, out.data(), layout);
        linearize({image, of_size, Storage::float32}, result);
        result.download(out.data());
    } // buffers are released within the time, as Python's are
    return seconds_since(start);
}

// Arguments that may be left out, in groups that several operations share.
#define OPTION(name) arg(name) = nb::none()
#define LENS                                                                                                           \
    OPTION("focus"), OPTION("focus_at"), OPTION("focus_along"), OPTION("f_stop"), OPTION("focal_length_mm"),           \
        OPTION("sensor_mm"), OPTION("mm_per_unit"), OPTION("circle")
#define COMMON OPTION("storage"), OPTION("out"), OPTION("device")

constexpr const char* linearize_text = R"(Distance along the view axis, from stored depth.

depth: (H, W) float32, float16, uint16 or uint32, or (H, W, 3) uint8; or a fathom.Image. uint32 holds 24 bits: the high byte
is a stencil that is left out, unless storage is 'uint24-high', which leaves out the low one.
background: what background pixels become: 'inf' (default), the far plane's distance ('decode'), or 'nan'.

Returns (H, W) float32 in scene units, positive in front of the camera. Invalid pixels are NaN.)";

constexpr const char* unproject_text = R"(Positions, from stored depth.

space: axes of the positions: the camera's ('view', default) or the world's ('world', which needs a camera with a view).
origin: world positions are relative to this point (x, y, z). channels: 3, or 4 with w = 1 (0 without a position).
background: 'inf' (default) and 'nan': no position; 'decode': on the far plane.

Returns (H, W, 3) float32: x, y, z in scene units. Pixels without a position are NaN.)";

constexpr const char* normals_text = R"(Surface normals, from stored depth.

method: 'automatic' (default; fits planes to depth of 16 bits and fewer and to noisy depth), 'neighbours' or 'least-squares'.
max_error: a mean error in degrees, instead of a method. space: 'view' (default) or 'world'. channels: 3, or 4 with the
validity. tolerance: how far depth may be off, in half steps of its storage (default 1). noise: standard deviation of a
sensor's noise over the depth, such as 9e-4; planes are then fitted to wider windows (default 0).

Returns (H, W, 3) float32 of unit length, towards the camera. Invalid and background pixels are 0, 0, 0.)";

constexpr const char* ssao_text =
    R"(Ambient occlusion, from stored depth: how much of the hemisphere above each pixel is open.

radius: how far occlusion reaches, scene units (default: "ao_distance" of the camera).
quality: 'fast', 'balanced' (default) or 'accurate'; slices (1 to 64), samples (1 to 256) and jitter (1, 4 or 16) are instead
of what it sets. max_error: an rms error of visibility, instead of all these.
thickness: of surfaces along their rays, scene units; inf suits terrain (default: a quarter of the radius). An array has one for
each pixel, (H, W) float32. 'silhouette': each pixel's object is as thick as it is wide in the image. fathom.BackDepth(depth):
solids end at a second layer of depth.
falloff: fraction of the radius over which occluders fade out, 0 to 1 (default 0). border: 'open' (default) or 'clamp'.
half_resolution: True computes a quarter of the pixels, False all (default: the quality chooses for each block of 64 x 64
pixels; with slices, samples or jitter all). region: the part (x, y, width, height) that is computed. seed: turns the
jitter. tolerance: how far depth may be off, in half steps of its storage (default 1).
normals: (H, W, 3) float32 of unit length, which nobody checks, with the axes normals_space: 'view' (default) or 'world'
(default: normals from depth).

Returns (H, W) float32: visibility, 1 open and 0 blocked. Invalid pixels are NaN. With bent_normal=True or confidence=True a
named tuple Occlusion(visibility, bent_normal, confidence): (H, W, 3) mean open directions in view space, of unit length, and
the fraction of samples that hit valid pixels inside the image. `out` is a tuple then, too.)";

constexpr const char* dof_masks_text =
    R"(Circles of confusion and masks of what is near, in focus and far, from stored depth.
@LENS@
sharp_px: circles up to this are in focus (default 1); transition_px: circles larger by this are not at all (default 1).
sky: the background is infinitely far ('blur', default), 'sharp', or left out ('exclude'). max_coc_px: circles end there.
near_weight, focus_weight, far_weight, max_near_coc, near_alpha, disocclusion, mixed_pixels, tile_min_coc, tile_max_coc: True
where that mask is wanted, too. tile_px: pixels across of the tiles whose extremes those are, 1 to 65536 (default 16).

Returns a named tuple DofMasks of (H, W) float32; None for masks that were not wanted. coc: diameter in pixels, positive
behind the focus, NaN for invalid pixels. near_weight + focus_weight + far_weight = 1. `out` is such a tuple.)";

constexpr const char* dof_text = R"(A picture as a lens shows it that is focused on one depth.

color: (H, W, 3), or (H, W, 4) with the alpha multiplied in: float32, float16, uint16 or uint8. Light is blurred: make linear
values of sRGB first, as docs/python.md does.
@LENS@
blades: corners of the aperture, 3 to 64 (default 0: a circle); rotation_degrees: turns it; ratio: height over width of an
ellipse, 0.1 to 10. quality: 'fast', 'balanced' (default) or 'accurate'. max_error: an rms error of colors, instead of it.
sky: the background is infinitely far ('blur', default), 'sharp', or left out ('exclude'). max_coc_px: 1 to 512 (default).
clean_plate, clean_plate_depth: the picture and the depth without near objects.

Returns an array of the shape and dtype of color.)";

constexpr const char* fog_text = R"(A picture with fog.

color: as for dof. density: exp(-density * r) of the light is left after a distance r in scene units. max_opacity: 0 to 1
(default 1). start: distance along the ray at which the fog begins. fog_color: three numbers in the picture's order of channels
(default 0.5, 0.6, 0.7); 1 is white in pictures of integers, too. height_falloff: density falls by exp(-height_falloff * h)
above reference_height along up (default 0, 1, 0), which needs a camera with a view. sky: 'fog' (default) or 'keep'. alpha:
'premultiplied' (default) or 'straight'.

Returns an array of the shape and dtype of color.)";

constexpr const char* fill_invalid_text = R"(Stored depth without holes, as a blur needs it where a sensor measured nothing.

An invalid pixel takes the value of the nearest valid pixel to its left or to its right, the farther one of the two; in a row
without valid pixels that above or below.

Returns an array of the shape and dtype of depth.)";

constexpr const char* depth_at_text =
    R"(The depth at pixel x, y, counted from 0: what a lens focuses on. inf for the background.

Raises ValueError for a pixel outside the image, or that is invalid.)";

constexpr const char* restore_highlights_text =
    R"(A picture whose white is brighter, which a file of integers has cut off.

color: (H, W, 3) or (H, W, 4) float32, linear light from 0 to 1. Light from 0.97 on grows smoothly, to peak times of itself at 1,
so that a blur shows lamps as bright discs. Try 1.05 for a JPEG.

Returns (H, W, 3) or (H, W, 4) float32.)";

constexpr const char* upsample_along_edges_text =
    R"(Depth on the grid of a picture of another size, with its edges where the picture has them.

depth: (h, w) float32, NaN where nothing is known. color: (H, W, 3) or (H, W, 4) float32, linear light. Both show the same.

Returns (H, W) float32.)";

constexpr const char* common_text = R"(

storage: how elements hold depth, if their dtype and the camera's packing do not say it. out: where the result goes; its rows
may be any distance apart, its columns not. device: a fathom.Device, or "cpu", "gpu", one of devices(), its index, or a
part of a name. If depth is a fathom.Image, the result is one, too, and nothing is waited for.

Raises ValueError for bad arguments, fathom.Error for a camera of another size and from the device; NoDevice without one.)";

constexpr const char* lens_text =
    R"(focus: depth that is sharp, scene units along the view axis; or focus_at: a pixel (x, y) that is; or focus_along: (x, y, d), the
point at distance d along a pixel's ray. f_stop: focal length over aperture. focal_length_mm, sensor_mm (its width): one of
them, or both. What is missing comes from the camera. mm_per_unit: millimetres in a scene unit (default 1000).
circle: (k, g) instead of a lens: circles are k - g/z pixels wide, or g z - k for an orthographic camera.)";

std::string documented(std::string text) {
    constexpr std::string_view lens = "@LENS@";
    if (const std::size_t at = text.find(lens); at != text.npos)
        text.replace(at, lens.size(), lens_text);
    return text + common_text;
}

} // namespace

void bind_operations(nb::module_& module) {
    const auto def = [&](const char* name, auto function, const char* text, const auto&... arguments) {
        module.def(name, function, arguments..., documented(text).c_str()); // nanobind copies the text
    };
    def("linearize", linearize_of, linearize_text, arg("depth"), arg("camera"), nb::kw_only(), OPTION("background"),
        COMMON);
    def("unproject", unproject_of, unproject_text, arg("depth"), arg("camera"), nb::kw_only(), OPTION("space"),
        OPTION("origin"), OPTION("channels"), OPTION("background"), COMMON);
    def("normals", normals_of, normals_text, arg("depth"), arg("camera"), nb::kw_only(), OPTION("method"),
        OPTION("max_error"), OPTION("space"), OPTION("channels"), OPTION("tolerance"), OPTION("noise"), COMMON);
    def("ssao", ssao_of, ssao_text, arg("depth"), arg("camera"), OPTION("radius"), nb::kw_only(), OPTION("quality"),
        OPTION("slices"), OPTION("samples"), OPTION("jitter"), OPTION("half_resolution"), OPTION("max_error"),
        OPTION("thickness"), OPTION("falloff"), OPTION("border"), OPTION("seed"), OPTION("region"), OPTION("tolerance"),
        OPTION("normals"), OPTION("normals_space"), OPTION("bent_normal"), OPTION("confidence"), COMMON);
    def("dof_masks", dof_masks_of, dof_masks_text, arg("depth"), arg("camera"), nb::kw_only(), LENS, OPTION("sharp_px"),
        OPTION("transition_px"), OPTION("sky"), OPTION("max_coc_px"), OPTION("near_weight"), OPTION("focus_weight"),
        OPTION("far_weight"), OPTION("max_near_coc"), OPTION("near_alpha"), OPTION("disocclusion"),
        OPTION("mixed_pixels"), OPTION("tile_px"), OPTION("tile_min_coc"), OPTION("tile_max_coc"), COMMON);
    def("dof", dof_of, dof_text, arg("depth"), arg("camera"), arg("color"), nb::kw_only(), LENS, OPTION("blades"),
        OPTION("rotation_degrees"), OPTION("ratio"), OPTION("quality"), OPTION("max_error"), OPTION("sky"),
        OPTION("max_coc_px"), OPTION("clean_plate"), OPTION("clean_plate_depth"), COMMON);
    def("fill_invalid", fill_invalid_of, fill_invalid_text, arg("depth"), arg("camera"), nb::kw_only(), COMMON);
    module.def("depth_at", depth_at_of, arg("depth"), arg("camera"), arg("x"), arg("y"), nb::kw_only(),
               OPTION("storage"), OPTION("device"), depth_at_text);
    module.def("restore_highlights", restore_highlights_of, arg("color"), arg("peak"), restore_highlights_text,
               nb::sig("def restore_highlights(color: fathom._results.Array | Image, peak: float) -> "
                       "fathom._results.NumpyArray"));
    module.def("upsample_along_edges", upsample_along_edges_of, arg("depth"), arg("color"), upsample_along_edges_text,
               nb::sig("def upsample_along_edges(depth: fathom._results.Array | Image, color: fathom._results.Array | "
                       "Image) -> fathom._results.NumpyArray"));
    module.def("_seconds_of_linearize", seconds_of_linearize, arg("depth"), arg("camera"), arg("out"),
               OPTION("device"));
    module.def("_seconds_of_last_run", [] { return Call::last_run; });
    def("fog", fog_of, fog_text, arg("depth"), arg("camera"), arg("color"), arg("density"), nb::kw_only(),
        OPTION("max_opacity"), OPTION("start"), OPTION("fog_color"), OPTION("height_falloff"),
        OPTION("reference_height"), OPTION("up"), OPTION("sky"), OPTION("alpha"), COMMON);
}

} // namespace fathom::python
