// The operations, as their descriptions have them: arguments, results, types and words.
#include "bindings.hpp"

#include "call.hpp"
#include "keywords.hpp"
#include "signature.hpp"
#include "unlocked.hpp"

#include "description/as_json.hpp"
#include "description/photograph.hpp"
#include "text.hpp"

#include <fathom/lens_arguments.hpp>
#include <fathom/linearize.hpp>
#include <fathom/photograph.hpp>

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace fathom::python {
namespace {

using description::Kind;
using description::Option;
using nb::arg;

// What all operations take, besides what is described.
struct Common {
    Word<Storage> storage;
    Target out;
    DeviceOption device;
    Pixels ignore;

    // The last to take arguments.
    explicit Common(Keywords& keywords)
        : storage{keywords.take("storage")}, out{keywords.take("out")}, device{keywords.take("device")},
          ignore{keywords.take("ignore")} {
        keywords.finish();
    }
};

// The targets of several results: None, or a tuple with one for each field, as an earlier call returned it. A result that is
// not asked for has none.
nb::object target_of(const Target& out, std::size_t field, std::size_t fields, bool asked, const std::string& name) {
    if (!out.given.is_valid() || out.given.is_none())
        return nb::none();
    if (!nb::isinstance<nb::tuple>(out.given) || nb::len(out.given) != fields)
        throw std::invalid_argument("out: must be a tuple of " + std::to_string(fields) +
                                    " arrays or None, one for each field of the result");
    nb::object target = out.given[field];
    if (!asked && !target.is_none())
        throw std::invalid_argument(name + ": is given, but the call does not ask for this result");
    return target;
}

// An operation with what its calls need at hand.
struct Bound {
    const description::Operation& operation;
    std::vector<Keyword> keywords;
    std::vector<Keyword> lens;       // of the circle, if it takes one
    std::vector<Keyword> repair;     // of its depth
    std::vector<PyObject*> names;    // of the arguments that need none
    std::vector<std::string> outs;   // names of the results in messages, and that of a single one
    const Option* circle = nullptr;  // that a lens makes
    const Option* radius = nullptr;  // of ambient occlusion, which a camera may have
    nb::object results = nb::none(); // the type of several
};

using Given = std::vector<std::pair<const Option*, nb::handle>>;

std::string own_name(const Option& option) {
    return option.name;
}

void set_radius(const Bound& bound, void* made, const Given& given, const CameraObject& camera) {
    if (!bound.radius || std::ranges::count(given, bound.radius, &Given::value_type::first) > 0)
        return;
    bound.operation.set(made, *bound.radius,
                        description::default_radius(camera.file().lens, "the camera", bound.radius->name));
}

// Colours are 0 to 1, also those of integers.
void check_color(const Option& option, nb::handle given, const Image& picture) {
    const bool bytes = picture.element() == Element::u8;
    if (!bytes && picture.element() != Element::u16)
        return;
    const auto color = nb::cast<std::array<double, 3>>(given);
    if (std::ranges::any_of(color, [](double value) { return value > 1; }))
        throw std::invalid_argument(text(option.name, " = ", text_of(nb::str(nb::cast(std::tuple_cat(color)))),
                                         ": 1 is white, so it is 0 to 1 for ", name_of(picture.element()),
                                         ", too; divide by ", bytes ? 255 : 65535));
}

// The picture that a result is made of, if there is one.
Pixels picture_in(const Given& given) {
    for (const auto& [option, value] : given)
        if (option->kind == Kind::picture && option->required)
            return {nb::borrow(value)};
    return {};
}

// The images, and what is to be seen with them only.
void set_images(const Bound& bound, void* made, const Given& given, Call& call) {
    Image picture;
    for (const auto& [option, value] : given) {
        if (option->kind == Kind::region) {
            const auto read = description::value_of(option->kind, nb::cast<std::vector<double>>(value));
            const auto [x, y, width, height] = std::get<Region>(*read);
            static_cast<void>(call.depth().image.region(x, y, width, height)); // throws where it does not fit
        } else if (option->is_image()) {
            const Pixels pixels{nb::isinstance<BackDepth>(value) ? nb::cast<const BackDepth&>(value).depth
                                                                 : nb::borrow(value)};
            if (option->kind == Kind::depth) {
                bound.operation.set(made, *option, call.more_depth(pixels, option->name));
                continue;
            }
            const Image image =
                call.image(pixels, option->kind == Kind::picture ? Holds::picture : Holds::numbers, option->name);
            if (!picture)
                picture = image;
            if (option->required)
                call.fit(image);
            bound.operation.set(made, *option, image);
        }
    }
    for (const auto& [option, value] : given)
        if (picture && option->kind == Kind::color)
            check_color(*option, value, picture);
}

nb::object call_of(const Bound& bound, const nb::args& arguments, const nb::kwargs& named) {
    const description::Operation& operation = bound.operation;
    Keywords keywords(operation.name, bound.names, arguments, named);
    const Pixels depth{keywords.take("depth")};
    const nb::object camera_given = keywords.take("camera");
    const bool has_camera = nb::isinstance<CameraObject>(camera_given);
    if (!has_camera && (bound.lens.empty() || !camera_given.is_none()))
        keywords.refuse();
    const Pixels color{takes_size_of_picture(bound.operation) ? keywords.take("color") : nb::none()};
    std::shared_ptr<void> options = operation.make(nullptr);
    LensArguments lens;
    DepthRepair repair;
    Given given;
    std::vector<description::Given> together;
    keywords.each(bound.lens, [&](const Option& option, nb::handle value) {
        together.push_back({&option, keywords.value_of(option, value)});
        option.set(lens, *together.back().value);
    });
    keywords.each(bound.repair, [&](const Option& option, nb::handle value) {
        together.push_back({&option, keywords.value_of(option, value)});
        option.set(repair, *together.back().value);
    });
    keywords.each(bound.keywords, [&](const Option& option, nb::handle value) {
        given.emplace_back(&option, value);
        together.push_back({&option});
        if (option.is_image())
            return;
        together.back().value = keywords.value_of(option, value);
        const description::Value& read = *together.back().value;
        if (option.is_default(read)) // which may be given beside anything
            return;
        if (const auto* circle = std::get_if<CircleOfConfusion>(&read))
            lens.circle = {static_cast<double>(circle->k), static_cast<double>(circle->g)};
        else
            operation.set(options.get(), option, read);
    });
    const Common common(keywords);
    for (const Keyword& each : bound.keywords)
        if (each.option.required && std::ranges::count(given, &each.option, &Given::value_type::first) == 0)
            keywords.refuse();
    std::erase_if(together, [](const description::Given& each) { // the default, which a panel hands on, says nothing
        return each.value && each.option->is_default(*each.value);
    });
    if (const std::string wrong = wrong_together(operation, together, own_name); !wrong.empty())
        throw std::invalid_argument(wrong);
    if (!has_camera && !lens.relative)
        throw nb::type_error(
            text(operation.name, "(): camera must be a fathom.Camera, not None, which is for relative depth").c_str());
    std::optional<Call> opened;
    if (lens.relative) {
        if (has_camera)
            refuse("camera", "relative depth has none; give None");
        if (common.storage.get("storage"))
            refuse("storage", "the dtype of relative depth says how it is read; leave storage out");
        lens = completed(lens, {}, relative_camera(1, 1, *lens.relative).projection);
        opened.emplace(depth, lens, color ? color : picture_in(given), common.device, common.ignore);
    } else {
        const auto& camera = nb::cast<const CameraObject&>(camera_given);
        set_radius(bound, options.get(), given, camera);
        opened.emplace(depth, camera, common.storage, common.device, common.ignore);
    }
    Call& call = *opened;
    const std::shared_ptr<void> made = std::move(options); // whose images end before the arrays that they lie in
    if (color)
        call.fit(call.image(color, Holds::picture, "color"));
    set_images(bound, made.get(), given, call);
    const std::vector<description::Result> results = operation.results_of(made.get(), call.depth());
    const bool alone = !operation.results ||
                       (operation.first_alone && std::ranges::count(results, true, &description::Result::wanted) == 1);
    for (std::size_t i = 0; i < results.size(); ++i) {
        const auto& [name, image, wanted, shape, content, words] = results[i];
        const std::string& out = alone ? bound.outs.back() : bound.outs[i];
        const nb::object target = alone ? common.out.given : target_of(common.out, i, results.size(), wanted, out);
        if (wanted)
            *image = call.result(target, out.c_str(), shape.element, shape.layout);
    }
    call.run([&] {
        if (bound.circle && has_camera)
            lens = completed(lens, nb::cast<const CameraObject&>(camera_given).file().lens,
                             call.depth().camera.projection);
        if (bound.circle)
            operation.set(made.get(), *bound.circle, circle_for(lens, call.depth()));
        operation.run(made.get(), bound.repair.empty() ? call.depth() : repaired(call.depth(), repair, lens), {});
    });
    if (alone)
        return call.take();
    nb::list fields;
    for (const description::Result& result : results)
        fields.append(result.wanted ? call.take() : nb::none());
    return bound.results(*fields);
}

// The type of an operation's results: a named tuple whose fields are documented.
nb::object result_type(const description::Operation& operation, const std::vector<description::Result>& results) {
    nb::list names;
    for (const description::Result& result : results)
        names.append(result.name);
    const nb::object type =
        nb::module_::import_("collections").attr("namedtuple")(operation.results, names, nb::arg("module") = "fathom");
    type.attr("__doc__") = text("Results of `", operation.name, "`; None for what was not asked for.");
    for (const description::Result& result : results)
        type.attr(result.name).attr("__doc__") = words_of(result);
    return type;
}

PyObject* interned(const char* name) {
    return PyUnicode_InternFromString(name);
}

// Lives as long as the process.
const Bound& bound(const description::Operation& operation) {
    auto& made = *new Bound{operation,
                            keywords_of(operation.options),
                            keywords_of(operation.lens),
                            keywords_of(operation.repair),
                            {interned("depth"), interned("camera")},
                            {}};
    for (const char* name : operation.arguments)
        if (name)
            made.names.push_back(interned(name));
    for (const Keyword& each : made.keywords) {
        if (each.option.kind == Kind::lens)
            made.circle = &each.option;
        if (std::string_view(each.option.name) == "radius")
            made.radius = &each.option;
    }
    const std::shared_ptr<void> call = operation.make(nullptr);
    const std::vector<description::Result> results = operation.results_of(call.get(), {});
    for (const description::Result& result : results)
        made.outs.push_back(text("out.", result.name));
    made.outs.emplace_back("out");
    if (operation.results)
        made.results = nb::borrow(result_type(operation, results).release());
    return made;
}

// Depth of which `move(depth, result)` makes other depth.
template <typename Move>
nb::object moved(Call& call, const Target& out, const Move& move) {
    const Image& image = call.depth().image;
    const Image result =
        call.result(out.given, "out", image.element(), {image.width(), image.height(), image.channels()});
    call.run([&] { move(call.depth(), result); });
    return call.take();
}

nb::object fill_invalid_of(const Pixels& depth, const CameraObject& camera, const Pixels& ignore,
                           const Word<Storage>& storage, const Target& out, const DeviceOption& device) {
    Call call(depth, camera, storage, device, ignore);
    return moved(call, out, [](const StoredDepth& stored, const Image& result) { fill_invalid(stored, result); });
}

nb::object grow_foreground_of(const Pixels& depth, const CameraObject& camera, int pixels, const Pixels& ignore,
                              const Word<Storage>& storage, const Target& out, const DeviceOption& device) {
    Call call(depth, camera, storage, device, ignore);
    return moved(call, out,
                 [=](const StoredDepth& stored, const Image& result) { grow_foreground(stored, result, pixels); });
}

double depth_at_of(const Pixels& depth, const CameraObject& camera, int x, int y, const Word<Storage>& storage,
                   const DeviceOption& device) {
    Call call(depth, camera, storage, device);
    double z = 0;
    call.run([&] { z = depth_at(call.depth(), x, y); });
    return z;
}

nb::object restore_highlights_of(const Pixels& color, double highlights) {
    auto [light, layout] = floats_of(color, "color");
    restore_highlights(light, layout.channels, highlights);
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
                             const nb::ndarray<float, nb::ndim<2>, nb::c_contig>& out, const DeviceOption& choice) {
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

constexpr const char* fill_invalid_text =
    R"(Stored depth without holes, as a blur needs it where a sensor measured nothing.

An invalid pixel takes the value of the nearest valid pixel to its left or to its right, the farther one of the two; in a row
without valid pixels that above or below.

Returns an array of the shape and dtype of depth.)";

constexpr const char* grow_foreground_text =
    R"(Stored depth whose near surfaces are larger by some pixels, for a blur where depth is soft or lies beside its picture's edges.

Each pixel takes the value of the nearest surface that is at most so many pixels away. One is best for the depth of
neural networks. Invalid pixels stay invalid.

Returns an array of the shape and dtype of depth.)";

constexpr const char* depth_at_text =
    R"(The depth at pixel x, y, counted from 0: what a lens focuses on. inf for the background.

Raises ValueError for a pixel outside the image, or that is invalid.)";

constexpr const char* restore_highlights_text =
    R"(A picture whose white is brighter, which a file of integers has cut off.

color: (H, W, 3) or (H, W, 4) float32, linear light from 0 to 1. Light from 0.97 on grows smoothly, to highlights times of itself at 1,
so that a blur shows lamps as bright discs. Two channels have to be that bright, or one of a saturated colour: pale surfaces
stay as they are. Try 1.05 for a JPEG.

Returns (H, W, 3) or (H, W, 4) float32.)";

constexpr const char* upsample_along_edges_text =
    R"(Depth on the grid of a picture of another size, with its edges where the picture has them.

depth: (h, w) float32, NaN where nothing is known. color: (H, W, 3) or (H, W, 4) float32, linear light. Both show the same.

Returns (H, W) float32.)";

} // namespace

void bind_operations(nb::module_& module) {
    nb::dict functions, results;
    std::vector<Signature> signatures;
    const auto add = [&](const Signature& signature, auto function, const auto&... arguments) {
        const auto& kept = *new std::pair(signature, signature.in_words()); // nanobind keeps their addresses
        functions[kept.first.name.c_str()] = nb::cpp_function(function, nb::name(kept.first.name.c_str()), arguments...,
                                                              nb::sig(kept.second.c_str()), kept.first.doc.c_str());
        signatures.push_back(signature);
    };
    for (const description::Operation& operation : operations()) {
        const Bound& its = bound(operation);
        add(signature_of(operation),
            [&its](const nb::args& arguments, const nb::kwargs& named) { return call_of(its, arguments, named); });
        if (operation.results)
            results[operation.results] = its.results;
    }
    add(signature_of("fill_invalid", fill_invalid_text), fill_invalid_of, arg("depth"), arg("camera"), nb::kw_only(),
        arg("ignore") = nb::none(), arg("storage") = nb::none(), arg("out") = nb::none(), arg("device") = nb::none());
    Signature grown = signature_of(
        "grow_foreground", text(grow_foreground_text, "\n\npixels: ", description::grown_pixels.limits(), ".").c_str());
    grown.arguments.push_back({"pixels", "int", false});
    add(grown, grow_foreground_of, arg("depth"), arg("camera"), arg("pixels"), nb::kw_only(),
        arg("ignore") = nb::none(), arg("storage") = nb::none(), arg("out") = nb::none(), arg("device") = nb::none());
    module.attr("_operations") = functions; // fathom/_operations.py
    module.attr("_results") = results;
    module.def("_stub", [signatures] { return stub_of(signatures); });
    module.def("depth_at", depth_at_of, arg("depth"), arg("camera"), arg("x"), arg("y"), nb::kw_only(),
               arg("storage") = nb::none(), arg("device") = nb::none(), depth_at_text);
    module.def("restore_highlights", restore_highlights_of, arg("color"), arg("highlights"), restore_highlights_text,
               nb::sig("def restore_highlights(color: fathom._operations.Array | Image, highlights: float) -> "
                       "fathom._operations.NumpyArray"));
    module.def(
        "upsample_along_edges", upsample_along_edges_of, arg("depth"), arg("color"), upsample_along_edges_text,
        nb::sig("def upsample_along_edges(depth: fathom._operations.Array | Image, color: fathom._operations.Array | "
                "Image) -> fathom._operations.NumpyArray"));
    module.def(
        "options",
        [] {
            nlohmann::ordered_json all = nlohmann::ordered_json::array();
            for (const description::Operation& operation : operations())
                all.push_back(as_json(operation));
            return nb::module_::import_("json").attr("loads")(all.dump());
        },
        nb::sig("def options() -> list[dict[str, typing.Any]]"),
        "What each operation takes and gives, for panels of other programs: names, ranges, defaults, words.");
    module.def("_seconds_of_linearize", seconds_of_linearize, arg("depth"), arg("camera"), arg("out"),
               arg("device") = nb::none());
    module.def("_time_calls", [] { Call::is_timed = true; });
    module.def("_seconds_of_last_run", [] { return Call::last_run; });
}

} // namespace fathom::python
