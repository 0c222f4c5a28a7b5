// The operations, as their descriptions have them. python/generate.py writes the functions that call these.
#include "call.hpp"
#include "unlocked.hpp"

#include "description/as_json.hpp"
#include "text.hpp"

#include <fathom/doubts.hpp>
#include <fathom/linearize.hpp>

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

namespace fathom::python {
namespace {

using description::Kind;
using description::Option;
using description::Value;

const std::vector<description::Operation>& operations() {
    static const auto all = [] {
        std::vector<description::Operation> all = description::operations();
        for (description::Operation& operation : all)
            for (Option& option : operation.options)
                if (option.name == std::string_view("as"))
                    option.name = "as_";
        return all;
    }();
    return all;
}

// A value as a message shows it: on one line, and not longer than a line.
std::string in_short(nb::handle value) {
    const nb::object words = nb::module_::import_("reprlib").attr("repr")(value).attr("split")();
    return text_of(nb::str(nb::str(" ").attr("join")(words)));
}

// What may be given for an option of several of its name.
const char* kind_of(const Option& option) {
    switch (option.kind) {
    case Kind::number:
        return "a number";
    case Kind::choice:
        return "'silhouette'";
    case Kind::depth:
        return "a fathom.BackDepth";
    default:
        return "an array";
    }
}

bool is_kind(const Option& option, nb::handle given) {
    switch (option.kind) {
    case Kind::number: // also one of NumPy's
        return PyNumber_Check(given.ptr()) &&
               (!nb::hasattr(given, "shape") || nb::len(nb::object(given.attr("shape"))) == 0);
    case Kind::choice:
        return PyUnicode_Check(given.ptr()) && PyUnicode_CompareWithASCIIString(given.ptr(), option.choices()[0]) == 0;
    case Kind::depth:
        return nb::isinstance<BackDepth>(given);
    default:
        return !PyUnicode_Check(given.ptr()) && !nb::isinstance<BackDepth>(given);
    }
}

// Is it a function that takes `color`, a picture that gives its results their size, though it computes nothing of the picture?
bool takes_size_of_picture(const description::Operation& operation) {
    return std::string_view(operation.name) == description::DofMasksCall::said.name;
}

[[noreturn]] void refuse_type(const std::string& function, const char* name, const std::string& kind, nb::handle given,
                              const char* cure = "") {
    PyErr_Clear();
    throw nb::type_error(text(function, "(): ", name, " must be ", kind, ", not ", in_short(given), cure).c_str());
}

// What is given for an option that is no image.
Value value_of(const std::string& function, const Option& option, nb::handle given) {
    const auto read = [&]() -> std::optional<Value> {
        if (option.kind == Kind::number) {
            const double number = PyFloat_AsDouble(given.ptr());
            if (!PyErr_Occurred())
                return number;
            if (PyErr_ExceptionMatches(PyExc_OverflowError))
                refuse_type(function, option.name, option.instead_of(HUGE_VAL), given);
            return std::nullopt;
        }
        if (PyBool_Check(given.ptr()) && (option.kind == Kind::flag || option.kind == Kind::result))
            return given.is(nb::handle(Py_True));
        std::vector<double> numbers;
        return nb::try_cast(given, numbers) ? description::value_of(option.kind, numbers) : std::nullopt;
    };
    if (option.kind == Kind::choice) {
        for (std::size_t i = 0; i < option.choices().size(); ++i)
            if (PyUnicode_Check(given.ptr()) && PyUnicode_CompareWithASCIIString(given.ptr(), option.choices()[i]) == 0)
                return i;
        throw std::invalid_argument(
            text(option.name, " = ", in_short(given), " is unknown; it is ", option.accepted()));
    }
    const std::optional<Value> value = read();
    if (!value)
        refuse_type(function, option.name,
                    option.kind == Kind::flag || option.kind == Kind::result ? "True or False" : option.accepted(),
                    given);
    if (!option.accepts(*value))
        throw std::invalid_argument(
            text(option.name, " = ", text_of(nb::str(given)), " must be ", option.instead_of(*value)));
    return *value;
}

// Options with the object of their name. Those of one name lie side by side.
using Named = std::vector<std::pair<const Option*, PyObject*>>;

Named named(const std::vector<Option>& options) {
    Named all;
    for (const Option& option : options)
        all.emplace_back(&option, PyUnicode_InternFromString(option.name));
    return all;
}

// Calls `set` with what is given of options; of several of one name with the one whose kind it is.
template <typename Set>
void each_given(const Named& options, const nb::dict& given, const Set& set) {
    for (auto first = options.begin(); first != options.end();) {
        const auto end =
            std::find_if(first, options.end(), [&](const auto& other) { return other.second != first->second; });
        const nb::handle value = PyDict_GetItem(given.ptr(), first->second);
        if (value.is_valid() && !value.is_none()) {
            auto its = first;
            if (end - first > 1)
                its = std::find_if(first, end, [&](const auto& one) { return is_kind(*one.first, value); });
            if (its == end) {
                std::vector<const char*> kinds;
                std::transform(first, end, std::back_inserter(kinds),
                               [](const auto& one) { return kind_of(*one.first); });
                throw std::invalid_argument(text(first->first->name, " = ", text_of(nb::repr(value)),
                                                 " is unknown; it is ", description::in_words(kinds)));
            }
            set(*its->first, value);
        }
        first = end;
    }
}

const CameraObject* camera_in(const Common& common, const std::string& function, bool may_be_none) {
    if (nb::isinstance<CameraObject>(common.camera))
        return &nb::cast<const CameraObject&>(common.camera);
    if (may_be_none && common.camera.is_none())
        return nullptr;
    refuse_type(function, "camera", "a fathom.Camera", common.camera,
                nb::isinstance<nb::dict>(common.camera)  ? "; fathom.Camera(**keys) makes one"
                : function == "dof" || function == "fog" ? "; depth and camera come first, then color"
                                                         : "");
}

// The targets of several results: None, or a tuple with one for each field, as an earlier call returned it. A result that is
// not asked for has none.
nb::object target_of(nb::handle out, std::size_t field, std::size_t fields, bool asked, const std::string& name) {
    if (out.is_none())
        return nb::none();
    if (!nb::isinstance<nb::tuple>(out) || nb::len(out) != fields)
        throw std::invalid_argument("out: must be a tuple of " + std::to_string(fields) +
                                    " arrays or None, one for each field of the result");
    nb::object target = nb::borrow(out)[field];
    if (!asked && !target.is_none())
        throw std::invalid_argument(name + ": is given, but the call does not ask for this result");
    return target;
}

// An operation with what its calls need at hand.
struct Bound {
    const description::Operation& operation;
    Named options, lens, repair;
    std::vector<std::string> outs = {"out"}; // names of a single result, and of each of several, in messages
    const Option* circle = nullptr;          // that a lens makes
    const Option* radius = nullptr;          // of ambient occlusion, which a camera may have

    explicit Bound(const description::Operation& its)
        : operation(its), options(named(its.options)), lens(named(its.lens)), repair(named(its.repair)) {
        for (const Option& each : its.options) {
            if (each.kind == Kind::lens)
                circle = &each;
            if (std::string_view(each.name) == "radius")
                radius = &each;
        }
        for (const description::Result& result : its.results_of(its.make(nullptr).get(), {}))
            outs.push_back(text("out.", result.name));
    }
};

const Bound& bound(const std::string& name) {
    static const auto& all =
        *new std::vector<Bound>(operations().begin(), operations().end()); // as long as the process
    return *std::ranges::find(all, name, [](const Bound& each) { return std::string_view(each.operation.name); });
}

using Given = std::vector<std::pair<const Option*, nb::handle>>;

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

// The images, and what is to be seen with them only.
void set_images(const Bound& bound, void* made, const Given& given, Call& call) {
    Image picture;
    for (const auto& [option, value] : given) {
        if (option->kind == Kind::region) {
            const auto read = description::value_of(option->kind, nb::cast<std::vector<double>>(value));
            const auto [x, y, width, height] = std::get<Region>(*read);
            static_cast<void>(call.depth().image.region(x, y, width, height)); // throws where it does not fit
        } else if (option->is_image()) {
            const nb::object pixels =
                nb::isinstance<BackDepth>(value) ? nb::cast<const BackDepth&>(value).depth : nb::borrow(value);
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

nb::object run(const std::string& name, const nb::dict& arguments) {
    const Bound& its = bound(name);
    const description::Operation& operation = its.operation;
    const Common common(arguments);
    const CameraObject* camera = camera_in(common, name, !its.lens.empty());
    std::shared_ptr<void> options = operation.make(nullptr);
    LensArguments lens;
    DepthRepair repair;
    Given given;
    std::vector<description::Given> together;
    each_given(its.lens, arguments, [&](const Option& option, nb::handle value) {
        together.push_back({&option, value_of(name, option, value)});
        option.set(lens, *together.back().value);
    });
    each_given(its.repair, arguments, [&](const Option& option, nb::handle value) {
        together.push_back({&option, value_of(name, option, value)});
        option.set(repair, *together.back().value);
    });
    each_given(its.options, arguments, [&](const Option& option, nb::handle value) {
        given.emplace_back(&option, value);
        together.push_back({&option});
        if (option.is_image())
            return;
        together.back().value = value_of(name, option, value);
        const Value& read = *together.back().value;
        if (option.is_default(read)) // which may be given beside anything
            return;
        if (const auto* circle = std::get_if<CircleOfConfusion>(&read))
            lens.circle = {static_cast<double>(circle->k), static_cast<double>(circle->g)};
        else
            operation.set(options.get(), option, read);
    });
    for (const auto& [option, _] : its.options)
        if (option->required && std::ranges::count(given, option, &Given::value_type::first) == 0)
            refuse_type(name, option->name, option->accepted(), nb::none());
    std::erase_if(together, [](const description::Given& each) { // the default, which a panel hands on, says nothing
        return each.value && each.option->is_default(*each.value);
    });
    if (const std::string wrong =
            wrong_together(operation, together, [](const Option& option) { return std::string(option.name); });
        !wrong.empty())
        throw std::invalid_argument(wrong);

    nb::object color = takes_size_of_picture(operation) ? nb::borrow(arguments["color"]) : nb::none(), picture = color;
    if (!camera && !lens.relative)
        throw nb::type_error(
            text(name, "(): camera must be a fathom.Camera, not None, which is for relative depth").c_str());
    if (lens.relative) {
        if (camera)
            refuse("camera", "relative depth has none; give None");
        if (storage_named(common.storage))
            refuse("storage", "the dtype of relative depth says how it is read; leave storage out");
        lens = completed(lens, {}, relative_camera(1, 1, *lens.relative).projection);
        for (const auto& [option, value] : given)
            if (option->kind == Kind::picture && option->required)
                picture = nb::borrow(value);
    } else if (its.radius && std::ranges::count(given, its.radius, &Given::value_type::first) == 0) {
        operation.set(options.get(), *its.radius,
                      description::default_radius(camera->file().lens, "the camera", its.radius->name));
    }
    Call call(common, lens.relative ? nullptr : camera, lens, picture);
    const std::shared_ptr<void> made = std::move(options); // whose images end before the arrays that they lie in
    if (!color.is_none())
        call.fit(call.image(color, Holds::picture, "color"));
    set_images(its, made.get(), given, call);
    const std::vector<description::Result> results = operation.results_of(made.get(), call.depth());
    const bool alone = !operation.results ||
                       (operation.first_alone && std::ranges::count(results, true, &description::Result::wanted) == 1);
    for (std::size_t i = 0; i < results.size(); ++i) {
        const auto& [result, image, wanted, shape, content, words] = results[i];
        const std::string& out = its.outs[alone ? 0 : i + 1];
        const nb::object target = alone ? common.out : target_of(common.out, i, results.size(), wanted, out);
        if (wanted)
            *image = call.result(target, out.c_str(), shape.element, shape.layout);
    }
    call.run([&] {
        if (its.circle && camera)
            lens = completed(lens, camera->file().lens, call.depth().camera.projection);
        if (its.circle)
            operation.set(made.get(), *its.circle, circle_for(lens, call.depth()));
        operation.run(made.get(), its.repair.empty() ? call.depth() : repaired(call.depth(), repair, lens), {});
    });
    if (alone)
        return call.take();
    nb::list fields;
    for (const description::Result& result : results)
        fields.append(result.wanted ? call.take() : nb::none());
    return fields;
}

Option grown() {
    return {{description::grown_pixels}, "pixels", "how many pixels", nullptr, {}, true};
}

// Stored depth without holes, or with near surfaces that are larger by so many pixels.
nb::object moved(const nb::dict& arguments, nb::handle pixels) {
    const Common common(arguments);
    const char* function = arguments.contains("pixels") ? "grow_foreground" : "fill_invalid";
    const CameraObject* camera = camera_in(common, function, false);
    const auto by = static_cast<int>(std::get<double>(value_of(function, grown(), pixels)));
    Call call(common, camera);
    const Image& image = call.depth().image;
    const Image result =
        call.result(common.out, "out", image.element(), {image.width(), image.height(), image.channels()});
    call.run([&] {
        if (arguments.contains("pixels"))
            grow_foreground(call.depth(), result, by);
        else
            fill_invalid(call.depth(), result);
    });
    return call.take();
}

double depth_at_of(const nb::dict& arguments, nb::handle pixel) {
    const Option at{{Kind::pixel}, "pixel"};
    const auto named = std::get<LensArguments::Pixel>(value_of("depth_at", at, pixel));
    const Common common(arguments);
    Call call(common, camera_in(common, "depth_at", false));
    double z = 0;
    call.run([&] { z = depth_at(call.depth(), named.x, named.y); });
    return z;
}

nb::object restore_highlights_of(nb::handle color, double highlights) {
    const auto [light, bits] = floats_of(color, Holds::numbers, "color");
    restore_highlights({light.data(), light.size()}, on_host(light).channels, highlights);
    return nb::cast(light);
}

nb::object upsample_along_edges_of(nb::handle depth, nb::handle color) {
    const auto [values, bits] = floats_of(depth, Holds::numbers, "depth");
    const auto [light, light_bits] = floats_of(color, Holds::numbers, "color");
    const HostFloats large = on_host(light);
    nb::object made = new_array(Element::f32, {large.width, large.height});
    const auto to = nb::cast<Floats>(made);
    {
        const Unlocked released;
        std::ranges::copy(upsample_along_edges(on_host(values), large), to.data());
    }
    return made;
}

// What operations say of lengths: the radius, the lens or the circle instead of it, the sky, and the widest circle.
const std::vector<Option>& described_lengths() {
    static const auto& all = *new auto([] {
        std::vector<Option> lengths;
        for (const description::Operation& operation : operations()) {
            const bool is_dof = operation.name == std::string_view("dof");
            if (is_dof)
                std::ranges::copy_if(operation.lens, std::back_inserter(lengths),
                                     std::not_fn(description::is_of_relative));
            for (const Option& option : operation.options)
                if (const std::string_view name = option.name;
                    name == "radius" || (is_dof && (name == "circle" || name == "sky" || name == "max_coc_px")))
                    lengths.push_back(option);
        }
        return lengths;
    }());
    return all;
}

std::vector<std::string> check(const nb::dict& arguments) {
    const Common common(arguments);
    const CameraObject& camera = *camera_in(common, "check", false);
    static const auto& known = *new Named(named(described_lengths()));
    const description::Operation& dof = description::operation<description::DofCall>();
    std::optional<double> radius;
    LensArguments lens;
    description::DofCall call; // its sky and widest circle
    bool has_lens = false;
    each_given(known, arguments, [&](const Option& option, nb::handle given) { // refused whatever else is wrong
        const Value value = value_of("check", option, given);
        const bool of_lens = std::ranges::count(dof.lens, std::string_view(option.name), &Option::name) > 0;
        has_lens = has_lens || ((of_lens || option.kind == Kind::lens) && !option.is_default(value));
        if (option.name == std::string_view("radius"))
            radius = std::get<double>(value);
        else if (of_lens)
            option.set(lens, value);
        else if (const auto* circle = std::get_if<CircleOfConfusion>(&value))
            lens.circle = {static_cast<double>(circle->k), static_cast<double>(circle->g)};
        else
            dof.set(&call, option, value);
    });
    const HostImage host = host_image(on_host(common.depth), Holds::depth, "depth");
    const HostDepth stored =
        host.depth(storage_of(host.element, host.layout.channels, common.storage, camera.file().packing, "depth"));
    const Camera seen = camera.of_size(stored.width, stored.height);
    std::vector<std::string> said = key_doubts(camera.file().text, seen.width, seen.height);
    CircleOfConfusion circle;
    if (has_lens) {
        lens = completed(lens, camera.file().lens, seen.projection);
        std::optional<Call> of_pixel;
        if (lens.focus_at)
            of_pixel.emplace(common, &camera);
        circle = circle_for(lens, of_pixel ? of_pixel->depth()
                                           : StoredDepth{.image = {}, .camera = seen, .storage = stored.storage});
    }
    const Unlocked released;
    for (const std::string& doubt : depth_doubts(seen, stored))
        said.push_back(in_python(doubt));
    if (!said.empty())
        return said; // or one mistake would be told twice
    if (radius)
        said = radius_doubts(seen, stored, *radius);
    if (has_lens)
        for (const std::string& doubt :
             lens_doubts(seen, stored, lens, circle, call.options.sky, call.options.max_coc_px))
            said.push_back(doubt);
    return said;
}

std::string words_of(const description::Result& result) {
    if (result.content.of == description::Content::Of::light)
        return text("an array of the shape and dtype of color: ", result.words);
    const std::string channels = result.shape.layout.channels > 1 ? text(", ", result.shape.layout.channels) : "";
    return text("(", result.shape.sides, channels, ") float32: ", result.words);
}

// What python/generate.py makes functions of: the operations, and the options of `check`.
nlohmann::ordered_json descriptions() {
    nlohmann::ordered_json all = nlohmann::ordered_json::array(), lengths = all;
    for (const description::Operation& operation : operations()) {
        nlohmann::ordered_json json = as_json(operation), shown = nlohmann::ordered_json::array();
        for (const description::Result& result : operation.results_of(operation.make(nullptr).get(), {}))
            shown.push_back({result.name, words_of(result), result.wanted});
        json["shown_results"] = shown;
        json["arguments"] = nlohmann::ordered_json::array();
        for (const char* name : operation.arguments)
            if (name)
                json["arguments"].push_back(name);
        json["several"] = operation.results ? operation.results : "";
        json["first_alone"] = operation.first_alone;
        json["has_lens"] = !operation.lens.empty();
        json["sized_by_picture"] = takes_size_of_picture(operation);
        all.push_back(json);
    }
    for (const Option& option : described_lengths())
        lengths.push_back(as_json(option));
    return nlohmann::ordered_json::array({all, lengths, as_json(grown())});
}

nb::object in_objects(const nlohmann::ordered_json& json) {
    return nb::module_::import_("json").attr("loads")(json.dump());
}

// What the same call costs in C++: seconds, and those of them that the calling thread works. python/tests compares.
Seconds seconds_of_linearize(const nb::ndarray<float, nb::ndim<2>, nb::c_contig>& depth, const CameraObject& camera,
                             const nb::ndarray<float, nb::ndim<2>, nb::c_contig>& out, nb::handle choice) {
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

} // namespace

void bind_operations(nb::module_& module) {
    using nb::arg;
    module.def("_run", run);
    module.def("_moved", moved, arg(), arg().none());
    module.def("_depth_at", depth_at_of, arg(), arg().none());
    module.def("_check", check);
    module.def("_restore_highlights", restore_highlights_of, arg().none(), arg());
    module.def("_upsample_along_edges", upsample_along_edges_of, arg().none(), arg().none());
    module.def("_descriptions", [] { return in_objects(descriptions()); });
    module.def("_storages", [] { return std::vector<std::string>(storage_names.begin(), storage_names.end()); });
    module.def(
        "options",
        [] {
            nlohmann::ordered_json all = nlohmann::ordered_json::array();
            for (const description::Operation& operation : operations())
                all.push_back(as_json(operation));
            return in_objects(all);
        },
        nb::sig("def options() -> list[dict[str, typing.Any]]"),
        "What each operation takes and gives, for panels of other programs: names, ranges, defaults, words.");
    module.def("_seconds_of_linearize", seconds_of_linearize, arg("depth"), arg("camera"), arg("out"),
               arg("device") = nb::none());
    module.def("_time_calls", [] { Call::is_timed = true; });
    module.def("_seconds_of_last_run", [] { return Call::last_run; });
}

} // namespace fathom::python
