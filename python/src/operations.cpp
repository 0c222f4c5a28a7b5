// The operations: keyword arguments to options structs. The names are those of the C++ options and of the program.
#include "operations.hpp"

#include "call.hpp"
#include "keywords.hpp"
#include "unlocked.hpp"

#include "description/operations.hpp"

#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/fog.hpp>
#include <fathom/lens_arguments.hpp>
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

// What all operations take, besides what is described.
struct Common {
    Word<Storage> storage;
    Target out;
    DeviceChoice device;

    // The last to take arguments.
    explicit Common(Keywords& keywords)
        : storage{keywords.take("storage")}, out{keywords.take("out")}, device{keywords.take("device")} {
        keywords.finish();
    }
};

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
    const bool is_scalar =
        !nb::hasattr(given, "shape") || nb::len(nb::object(given.attr("shape"))) == 0; // also one of NumPy's
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

nb::object linearize_of(const Pixels& depth, const CameraObject& camera, const nb::kwargs& given) {
    Keywords keywords("linearize", given);
    LinearizeOptions options;
    keywords.set(options);
    const Common common(keywords);
    Call call(depth, camera, common.storage, common.device);
    const Image result = call.result(common.out.given, "out");
    call.run([&] { linearize(call.depth(), result, options); });
    return call.take();
}

nb::object unproject_of(const Pixels& depth, const CameraObject& camera, const nb::kwargs& given) {
    Keywords keywords("unproject", given);
    UnprojectOptions options;
    keywords.set(options);
    const Common common(keywords);
    Call call(depth, camera, common.storage, common.device);
    const Image result = call.result(common.out.given, "out", options.channels);
    call.run([&] { unproject(call.depth(), result, options); });
    return call.take();
}

nb::object normals_of(const Pixels& depth, const CameraObject& camera, const nb::kwargs& given) {
    Keywords keywords("normals", given);
    NormalsOptions options;
    keywords.set(options);
    const Common common(keywords);
    Call call(depth, camera, common.storage, common.device);
    const Image result = call.result(common.out.given, "out", options.channels);
    call.run([&] { normals(call.depth(), result, options); });
    return call.take();
}

nb::object ssao_of(const Pixels& depth, const CameraObject& camera, const Number& radius, const nb::kwargs& given) {
    Keywords keywords("ssao", given);
    SsaoOptions options;
    const nb::object thickness = keywords.take("thickness"); // described is only one of its kinds
    keywords.set(options);
    const Pixels normals{keywords.take("normals")};
    const auto region = keywords.take_as<std::array<int, 4>>("region");
    const Common common(keywords);
    const Number length = radius ? radius : camera.file().lens.ao_distance;
    if (!length)
        throw std::invalid_argument(
            "radius: missing, and the camera has no \"ao_distance\"; give a length in scene units");

    Call call(depth, camera, common.storage, common.device);
    Layout layout{call.depth().image.width(), call.depth().image.height()};
    if (region) {
        const auto [x, y, width, height] = *region;
        static_cast<void>(call.depth().image.region(x, y, width, height)); // throws where it does not fit
        options.region = {x, y, width, height};
        layout = {width, height};
    }
    options.thickness = thickness_of({thickness}, call);
    if (normals)
        options.normals = call.image(normals, Holds::numbers, "normals");
    const bool several = options.bent_normal || options.confidence;
    const auto target = [&](std::size_t field, bool asked, const char* name) {
        return several ? target_of(common.out, field, 3, asked, name) : common.out.given;
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
    Number focus, f_stop, focal_length_mm, sensor_mm;
    double mm_per_unit = 1000;
    std::optional<std::array<int, 2>> focus_at;
    std::optional<std::tuple<int, int, double>> focus_along;
    std::optional<std::array<double, 2>> circle;

    explicit LensArguments(Keywords& keywords)
        : focus_at(keywords.take_as<std::array<int, 2>>("focus_at")),
          focus_along(keywords.take_as<std::tuple<int, int, double>>("focus_along")),
          circle(keywords.take_as<std::array<double, 2>>("circle")) {
        keywords.set(*this);
    }

    CircleOfConfusion circle_for(const StoredDepth& stored, const LensDefaults& defaults) const {
        fathom::LensArguments lens{.focus = focus,
                                   .f_stop = f_stop,
                                   .focal_length_mm = focal_length_mm,
                                   .sensor_mm = sensor_mm,
                                   .mm_per_unit = mm_per_unit,
                                   .circle = circle};
        if (focus_at)
            lens.focus_at = fathom::LensArguments::Pixel{(*focus_at)[0], (*focus_at)[1]};
        if (focus_along) {
            const auto [x, y, distance] = *focus_along;
            lens.focus_along = fathom::LensArguments::AlongRay{{x, y}, distance};
        }
        return fathom::circle_for(completed(lens, defaults, stored.camera.projection), stored);
    }
};

template <typename Visitor>
void describe(const Visitor& v, LensArguments& lens) {
    description::describe_lens(v, lens);
}

nb::object dof_masks_of(const Pixels& depth, const CameraObject& camera, const nb::kwargs& given) {
    Keywords keywords("dof_masks", given);
    const LensArguments lens(keywords);
    DofMasksOptions options;
    keywords.set(options);
    const Common common(keywords);

    Call call(depth, camera, common.storage, common.device);
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
        const nb::object target = target_of(common.out, i, fields.size(), wanted, name);
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

nb::object dof_of(const Pixels& depth, const CameraObject& camera, const Pixels& color, const nb::kwargs& given) {
    Keywords keywords("dof", given);
    const LensArguments lens(keywords);
    DofOptions options;
    keywords.set(options);
    const Pixels clean_plate{keywords.take("clean_plate")}, clean_plate_depth{keywords.take("clean_plate_depth")};
    const Common common(keywords);
    if (static_cast<bool>(clean_plate) != static_cast<bool>(clean_plate_depth))
        throw std::invalid_argument("clean_plate and clean_plate_depth belong together; give both, or none");

    Call call(depth, camera, common.storage, common.device);
    const Image picture = call.image(color, Holds::picture, "color");
    if (clean_plate)
        options.clean_plate = {call.image(clean_plate, Holds::picture, "clean_plate"),
                               call.more_depth(clean_plate_depth, "clean_plate_depth")};
    const Image result = call.result(common.out.given, "out", picture.element(),
                                     {picture.width(), picture.height(), picture.channels()});
    call.run([&] { dof(call.depth(), picture, result, lens.circle_for(call.depth(), camera.file().lens), options); });
    return call.take();
}

nb::object fog_of(const Pixels& depth, const CameraObject& camera, const Pixels& color, double density,
                  const nb::kwargs& given) {
    Keywords keywords("fog", given);
    FogOptions options{.density = density};
    keywords.set(options);
    const Common common(keywords);
    Call call(depth, camera, common.storage, common.device);
    const Image picture = call.image(color, Holds::picture, "color");
    const double most = picture.element() == Element::u8 ? 255 : 65535;
    if (const bool whole = picture.element() == Element::u8 || picture.element() == Element::u16;
        whole && std::ranges::any_of(options.fog_color, [](double value) { return value > 1; }))
        throw std::invalid_argument("fog_color = " + text_of(nb::str(nb::cast(std::tuple_cat(options.fog_color)))) +
                                    ": 1 is white, so it is 0 to 1 for " + name_of(picture.element()) +
                                    ", too; divide by " + std::to_string(static_cast<int>(most)));
    const Image result = call.result(common.out.given, "out", picture.element(),
                                     {picture.width(), picture.height(), picture.channels()});
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

constexpr const char* pixels = "fathom._results.Array | Image";

constexpr const char* linearize_text = R"(Distance along the view axis, from stored depth.

depth: (H, W) float32, float16, uint16 or uint32, or (H, W, 3) uint8; or a fathom.Image. uint32 holds 24 bits: the high byte
is a stencil that is left out, unless storage is 'uint24-high', which leaves out the low one.
@OPTIONS@
Returns (H, W) float32 in scene units, positive in front of the camera. Invalid pixels are NaN.)";

constexpr const char* unproject_text = R"(Positions, from stored depth.

@OPTIONS@
Returns (H, W, 3) float32: x, y, z in scene units. Pixels without a position are NaN.)";

constexpr const char* normals_text = R"(Surface normals, from stored depth.

@OPTIONS@
Returns (H, W, 3) float32 of unit length, towards the camera. Invalid and background pixels are 0, 0, 0.)";

constexpr const char* ssao_text =
    R"(Ambient occlusion, from stored depth: how much of the hemisphere above each pixel is open.

radius: how far occlusion reaches, scene units (default: "ao_distance" of the camera).
@OPTIONS@thickness may also be an array, (H, W) float32, with one for each pixel; 'silhouette': each pixel's object is as thick as it
is wide in the image; or fathom.BackDepth(depth): solids end at a second layer of depth.
region: the part (x, y, width, height) that is computed. normals: (H, W, 3) float32 of unit length, which nobody checks
(default: from depth).

Returns (H, W) float32: visibility, 1 open and 0 blocked. Invalid pixels are NaN. With bent_normal=True or confidence=True a
named tuple Occlusion(visibility, bent_normal, confidence): (H, W, 3) mean open directions in view space, of unit length, and
the fraction of samples that hit valid pixels inside the image. `out` is a tuple then, too.)";

constexpr const char* lens_text =
    R"(focus_at: a pixel (x, y) that is sharp, instead of focus; or focus_along: (x, y, d), the point at distance d along a pixel's ray.
circle: (k, g) instead of a lens: circles are k - g/z pixels wide, or g z - k for an orthographic camera.
What is missing of the lens comes from the camera.
)";

constexpr const char* dof_masks_text =
    R"(Circles of confusion and masks of what is near, in focus and far, from stored depth.

@OPTIONS@
Returns a named tuple DofMasks of (H, W) float32; None for masks that were not wanted. coc: diameter in pixels, positive
behind the focus, NaN for invalid pixels. near_weight + focus_weight + far_weight = 1. `out` is such a tuple.)";

constexpr const char* dof_text = R"(A picture as a lens shows it that is focused on one depth.

color: (H, W, 3), or (H, W, 4) with the alpha multiplied in: float32, float16, uint16 or uint8. Light is blurred: make linear
values of sRGB first, as docs/python.md does.
@OPTIONS@clean_plate, clean_plate_depth: the picture and the depth without near objects.

Returns an array of the shape and dtype of color.)";

constexpr const char* fog_text = R"(A picture with fog.

color: as for dof. density: exp(-density * r) of the light is left after a distance r in scene units.
@OPTIONS@
Returns an array of the shape and dtype of color.)";

constexpr const char* fill_invalid_text =
    R"(Stored depth without holes, as a blur needs it where a sensor measured nothing.

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

// What a lens takes beside its described options stands below them.
std::string with_words_of_lens(const char* words) {
    std::string doc = words;
    constexpr std::string_view place = "@OPTIONS@";
    return doc.insert(doc.find(place) + place.size(), lens_text);
}

// An operation with the options that are described. nanobind keeps the signature's address.
template <typename Function, typename... Arguments>
void define(nb::module_& module, const char* name, Function function, const std::string& positional,
          const std::vector<description::Option>& options, const std::string& more, const char* words,
          const Arguments&... arguments) {
    const std::string common =
        text(", storage: ", nb::detail::make_caster<Word<Storage>>::Name.text, " | None = None, out: ", pixels,
             " | tuple | None = None, device: Device | DeviceInfo | str | int | None = None");
    const auto& signature = *new std::string(
        signature_of(name, text("depth: ", pixels, ", camera: Camera", positional), options, more + common));
    std::string doc = words;
    constexpr std::string_view place = "@OPTIONS@";
    doc.replace(doc.find(place), place.size(), words_of(options));
    module.def(name, function, arg("depth"), arg("camera"), arguments..., arg("options"), nb::sig(signature.c_str()),
               (doc + common_text).c_str());
}

} // namespace

void bind_operations(nb::module_& module) {
    const auto with_lens = [](const std::vector<description::Option>& options) {
        nb::kwargs none;
        Keywords keywords("", none);
        std::vector<description::Option> all = description::options_of(LensArguments(keywords));
        all.insert(all.end(), options.begin(), options.end());
        return all;
    };
    const std::string
        lens = ", focus_at: collections.abc.Sequence[int] | None = None, focus_along: tuple[int, int, float] "
               "| None = None, circle: collections.abc.Sequence[float] | None = None",
        color = text(", color: ", pixels), image = text(pixels, " | None = None");
    const std::string dof_doc = with_words_of_lens(dof_text), masks_doc = with_words_of_lens(dof_masks_text);
    std::vector<description::Option> fog_options = description::options_of(FogOptions{.density = 0});
    std::erase_if(fog_options, [](const description::Option& option) { return !option.by_default; }); // an argument

    define(module, "linearize", linearize_of, "", description::options_of(LinearizeOptions{}), "", linearize_text);
    define(module, "unproject", unproject_of, "", description::options_of(UnprojectOptions{}), "", unproject_text);
    define(module, "normals", normals_of, "", description::options_of(NormalsOptions{}), "", normals_text);
    define(module, "ssao", ssao_of, ", radius: float | None = None", description::options_of(SsaoOptions{}),
         text(", thickness: float | typing.Literal['silhouette'] | ", pixels, " | BackDepth | None = None",
              ", region: collections.abc.Sequence[int] | None = None, normals: ", image), ssao_text,
         arg("radius") = nb::none());
    define(module, "dof_masks", dof_masks_of, "", with_lens(description::options_of(DofMasksOptions{})), lens,
         masks_doc.c_str());
    define(module, "dof", dof_of, color, with_lens(description::options_of(DofOptions{})),
         text(lens, ", clean_plate: ", image, ", clean_plate_depth: ", image), dof_doc.c_str(), arg("color"));
    define(module, "fog", fog_of, color + ", density: float", fog_options, "", fog_text, arg("color"), arg("density"));
    module.def("fill_invalid", fill_invalid_of, arg("depth"), arg("camera"), nb::kw_only(), arg("storage") = nb::none(),
               arg("out") = nb::none(), arg("device") = nb::none(), text(fill_invalid_text, common_text).c_str());
    module.def("depth_at", depth_at_of, arg("depth"), arg("camera"), arg("x"), arg("y"), nb::kw_only(),
               arg("storage") = nb::none(), arg("device") = nb::none(), depth_at_text);
    module.def("restore_highlights", restore_highlights_of, arg("color"), arg("peak"), restore_highlights_text,
               nb::sig("def restore_highlights(color: fathom._results.Array | Image, peak: float) -> "
                       "fathom._results.NumpyArray"));
    module.def("upsample_along_edges", upsample_along_edges_of, arg("depth"), arg("color"), upsample_along_edges_text,
               nb::sig("def upsample_along_edges(depth: fathom._results.Array | Image, color: fathom._results.Array | "
                       "Image) -> fathom._results.NumpyArray"));
    module.def("_seconds_of_linearize", seconds_of_linearize, arg("depth"), arg("camera"), arg("out"),
               arg("device") = nb::none());
    module.def("_seconds_of_last_run", [] { return Call::last_run; });
}

} // namespace fathom::python
