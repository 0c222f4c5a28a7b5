// The operations, as their descriptions have them. python/generate.py writes the functions that call these with their arguments.
#include "camera.hpp"

#include "description/as_json.hpp"

#include <fathom/doubts.hpp>
#include <fathom/supersampled.hpp>

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <tuple>

namespace fathom::description {

// What Python has beside the operations of the program: depth of depth.
struct FillCall {
    static constexpr Said said{.name = "fill_invalid",
                               .summary =
                                   R"(Stored depth without holes, as a blur needs it where a sensor measured nothing.

An invalid pixel takes the value of the nearest valid pixel to its left or to its right, the farther one of the two; in a row
without valid pixels that above or below.)"};
    struct Options {
    } options = {};
    Image result = {};

    void run(const StoredDepth& stored, const Launch&) const { fill_invalid(stored, result); }
};

struct GrowCall {
    static constexpr Said said{
        .name = "grow_foreground",
        .summary =
            R"(Stored depth whose near surfaces are larger by some pixels, for a blur where depth is soft or lies beside its picture's edges.

Each pixel takes the value of the nearest surface that is at most so many pixels away. One is best for the depth of
neural networks. Invalid pixels stay invalid.)",
        .arguments = {"pixels"}};
    Required pixels = 0;
    Image result = {};

    void run(const StoredDepth& stored, const Launch&) const {
        grow_foreground(stored, result, static_cast<int>(pixels));
    }
};

template <typename Visitor, Is<FillCall::Options> Options>
void describe(const Visitor&, Options&) {}

template <typename Visitor, Is<GrowCall> Call>
void describe(const Visitor& v, Call& call) {
    v("pixels", call.pixels, grown_pixels, "how many pixels");
}

template <typename Visitor, typename Call>
requires Is<Call, FillCall> || Is<Call, GrowCall>
void describe_results(const Visitor& v, Call& call, const StoredDepth& stored) {
    v("result", call.result, true, like(stored.image), light(""), "stored depth");
}

} // namespace fathom::description

namespace fathom::python {
namespace {

using description::Kind;
using description::Option;
using description::Value;
using Floats = nb::ndarray<float, nb::numpy, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

const std::vector<description::Operation>& operations() {
    static const auto& all = *new auto([] {
        std::vector<description::Operation> all = description::operations();
        all.push_back(description::operation_of<description::FillCall>());
        all.push_back(description::operation_of<description::GrowCall>());
        for (description::Operation& operation : all)
            for (Option& option : operation.options)
                if (option.name == std::string_view("as"))
                    option.name = "as_"; // "as" is Python's own
        return all;
    }());
    return all;
}

const description::Operation& operation_of(std::string_view name) {
    return *std::ranges::find(operations(), name, &description::Operation::name);
}

// An argument; None if there is none of that name.
nb::handle in(const nb::dict& arguments, const char* name) {
    PyObject* const held = PyDict_GetItemString(arguments.ptr(), name);
    return held ? held : Py_None;
}

HostFloats on_host(const Floats& floats) {
    const auto side = [&](std::size_t i) { return i < floats.ndim() ? static_cast<int>(floats.shape(i)) : 1; };
    return {floats.data(), side(1), side(0), side(2)};
}

// A value on one line of a message, which is no longer than a line.
std::string in_short(nb::handle value) {
    return nb::cast<std::string>(in_python("fathom._arrays", "in_short")(value));
}

// What is given for an option that is no image.
Value value_of(const Option& option, nb::handle given) {
    std::optional<Value> value;
    std::vector<double> numbers;
    if (option.kind == Kind::number) {
        if (const double number = PyFloat_AsDouble(given.ptr()); !PyErr_Occurred())
            value = number;
        PyErr_Clear();
    } else if (option.kind == Kind::choice) {
        const auto is_given = [&](const char* choice) {
            return PyUnicode_Check(given.ptr()) && PyUnicode_CompareWithASCIIString(given.ptr(), choice) == 0;
        };
        const auto choices = option.choices();
        value = static_cast<std::size_t>(std::ranges::find_if(choices, is_given) - choices.begin());
    } else if (option.kind == Kind::flag || option.kind == Kind::result) {
        if (PyBool_Check(given.ptr()))
            value = given.is(nb::handle(Py_True));
    } else if (nb::try_cast(given, numbers))
        value = description::value_of(option.kind, numbers);
    if (!value)
        throw nb::type_error(text(option.name, " = ", in_short(given), " must be ", option.accepted()).c_str());
    if (!option.accepts(*value))
        throw std::invalid_argument(text(option.name, " = ", in_short(given), " must be ", option.instead_of(*value)));
    return *value;
}

// Of several options of one name, as `thickness` has them: the kind of the one that takes such a thing.
Kind kind_for(nb::handle given) {
    if (PyUnicode_Check(given.ptr()))
        return Kind::choice;
    if (nb::isinstance<BackDepth>(given))
        return Kind::depth;
    const bool is_array = nb::hasattr(given, "shape") && nb::len(nb::object(given.attr("shape"))) > 0;
    return PyNumber_Check(given.ptr()) && !is_array ? Kind::number : Kind::lengths;
}

// What is given for an operation's options. Images are still to be set.
struct Parsed {
    std::shared_ptr<void> call;
    LensArguments lens = {};
    DepthRepair repair = {};
    std::vector<description::Given> together = {}; // but defaults, which may be given beside anything
    std::vector<std::pair<const Option*, nb::handle>> images = {};

    bool has(std::string_view name) const {
        return std::ranges::any_of(together, [&](const auto& each) { return each.option->name == name; });
    }
};

Parsed parsed(const description::Operation& operation, const nb::dict& arguments) {
    Parsed made{operation.make(nullptr)};
    const std::array<void*, 3> structs{&made.lens, made.call.get(), &made.repair}; // as `listed` has their options
    for (const auto& [key, given] : arguments) {
        if (given.is_none())
            continue;
        const std::string_view name = PyUnicode_AsUTF8AndSize(key.ptr(), nullptr);
        const Option* found = nullptr;
        void* its = nullptr;
        for (std::size_t i = 0; i < structs.size(); ++i)
            for (const Option& option : *operation.listed()[i])
                if (option.name == name && (!found || option.kind == kind_for(given)))
                    std::tie(found, its) = std::pair(&option, structs[i]);
        if (found && found->is_image()) {
            made.images.emplace_back(found, given);
            made.together.push_back({found});
        } else if (found) {
            const Value value = value_of(*found, given);
            if (found->is_default(value))
                continue;
            made.together.push_back({found, value});
            if (const auto* circle = std::get_if<CircleOfConfusion>(&value))
                made.lens.circle = {static_cast<double>(circle->k), static_cast<double>(circle->g)};
            else
                found->set_field(static_cast<char*>(its) + found->offset, value);
        }
    }
    const auto spelled = [](const Option& option) { return std::string(option.name); };
    if (const std::string wrong = wrong_together(operation, made.together, spelled); !wrong.empty())
        throw std::invalid_argument(wrong);
    return made;
}

const CameraObject& camera_in(const nb::dict& arguments) {
    const nb::handle camera = in(arguments, "camera");
    if (!nb::isinstance<CameraObject>(camera))
        throw nb::type_error(
            text("camera = ", in_short(camera),
                 " must be a fathom.Camera, as fathom.Camera(**keys) makes one; None is for relative depth")
                .c_str());
    return nb::cast<const CameraObject&>(camera);
}

// Warnings, in the name of whoever has called the function that calls this module.
void warn(const std::vector<std::string>& said, const char* name) {
    if (!said.empty())
        in_python("fathom._camera", "warn")(said, name);
}

// One call of an operation: its inputs as images, its results, and the wait for them.
//
// If the depth is an array, results are arrays, and the call returns when they are there. If it is a `fathom.Image`, they are
// `fathom.Image`s, and the call returns at once unless another input or an `out` is an array, or results are means of larger ones. The
// arguments outlive it.
class Call {
public:
    explicit Call(const nb::dict& arguments)
        : arguments_(arguments), makes_images_(nb::isinstance<DeviceImage>(in(arguments, "depth"))) {
        const nb::handle device = in(arguments, "device");
        const nb::handle given = in(arguments, "supersampled");
        if (!given.is_none() && (!nb::try_cast(given, factor) || factor < 1 || factor > most_supersampled))
            throw std::invalid_argument(
                text("supersampled = ", in_short(given), " must be a whole number from 1 to ", most_supersampled));
        device_ = makes_images_ && device.is_none() ? nb::cast<DeviceImage&>(in(arguments, "depth")).image.device()
                                                    : device_of(device);
    }

    // An input, and where it lies if that is the host's memory.
    std::pair<Image, HostDepth> input(nb::handle pixels, const char* holds, const char* argument) {
        if (nb::isinstance<DeviceImage>(pixels)) {
            const auto& its = nb::cast<DeviceImage&>(pixels);
            return {its.image, its.host};
        }
        waits_ = true;
        const HostImage& array = kept_.emplace_back(host_image(pixels, holds, argument));
        return {image_of(array, device_), array.depth()};
    }

    // Stored depth. What is probably wrong is told before the first pixel is computed.
    StoredDepth depth_of(const CameraObject& camera, nb::handle pixels, const char* argument, nb::handle storage) {
        auto [image, host] = input(pixels, "depth", argument);
        const int width = image.width(), height = image.height();
        host.storage = storage_of(image.element(), image.channels(), storage, camera.file, argument);
        require(width % factor == 0 && height % factor == 0, argument, " is ", width, " x ", height,
                " pixels, of which supersampled = ", factor, " makes no whole number");
        const Camera& own = camera.file.camera;
        const int by = own.width == width && own.height == height ? 1 : factor;
        const StoredDepth depth{image, fathom::supersampled(camera.of_size(width / by, height / by), by), host.storage};
        if (!camera.are_keys_told)
            warn(key_doubts(camera.file.text, width / by, height / by), "Camera");
        camera.are_keys_told = true;
        const bool is_asked = host.data && in(arguments_, "ignore").is_none();
        if (const DepthSketch seen = is_asked ? sketch_of(host) : DepthSketch{};
            is_asked && !(camera.told && are_alike(*camera.told, seen))) {
            std::vector<std::string> said;
            try {
                const Unlocked released;
                said = depth_doubts_of_sample(depth.camera, host);
            } catch (const std::invalid_argument&) { // the operation says it
            }
            warn(said, argument);
            camera.told = seen;
        }
        return depth;
    }

    StoredDepth depth(const CameraObject& camera) {
        const StoredDepth depth = depth_of(camera, in(arguments_, "depth"), "depth", in(arguments_, "storage"));
        const nb::handle ignore = in(arguments_, "ignore");
        if (ignore.is_none())
            return depth;
        const Layout layout{depth.image.width(), depth.image.height()};
        const auto mask = nb::cast<Mask>(in_python("fathom._arrays", "mask")(ignore, shape_of(layout)));
        const Unlocked released;
        return ignore_pixels(depth, Image::from_host(device_, Element::u8, mask.data(), layout));
    }

    std::optional<Edges> edges() const {
        static const Option option{{"keep", "sharpen"}, "edges"}; // as Edges has them
        const nb::handle given = in(arguments_, "edges");
        if (given.is_none())
            return std::nullopt;
        return static_cast<Edges>(std::get<std::size_t>(value_of(option, given)));
    }

    // `picture`: whose size that gets, if there is one.
    StoredDepth relative_depth(const LensArguments& lens, nb::handle picture) {
        const auto [values, bits, light] = nb::cast<std::tuple<Floats, int, std::optional<Floats>>>(
            in_python("fathom._arrays", "relative")(in(arguments_, "depth"), picture, in(arguments_, "ignore")));
        RelativeOptions options = relative_options(lens);
        options.edges = edges().value_or(Edges::sharpen);
        try {
            const Unlocked released;
            relative_ = relative_values(on_host(values), bits, options, light ? on_host(*light) : HostFloats{});
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(text("depth: ", error.what()));
        }
        warn(relative_.doubts, "depth");
        require(relative_.width % factor == 0 && relative_.height % factor == 0, "depth is ", relative_.width, " x ",
                relative_.height, " pixels, of which supersampled = ", factor, " makes no whole number");
        waits_ = true;
        return {Image::from_host(device_, Element::f32, relative_.values.data(), {relative_.width, relative_.height}),
                relative_camera(relative_.width, relative_.height, *lens.relative), Storage::float32};
    }

    // A result: `target`'s memory, or new memory.
    Image result(nb::handle target, const char* argument, Element element, const Layout& layout) {
        nb::object object = nb::borrow(target);
        if (target.is_none())
            object =
                makes_images_ ? nb::cast(DeviceImage{Image(device_, element, layout)}) : new_array(element, layout);
        results.append(object);
        if (nb::isinstance<DeviceImage>(object)) {
            const auto& there = nb::cast<DeviceImage&>(object);
            if (there.no_target)
                throw std::invalid_argument(text(argument, ": ", there.no_target));
            return there.image;
        }
        const auto [data, its] = memory_of(object, argument, element, layout);
        waits_ = true;
        const Unlocked released;
        fetches_.push_back({Image::onto_host(device_, element, data, its), data, its.row_stride});
        return std::get<Image>(fetches_.back());
    }

    // The same of a frame that is larger than the result, which gets the means of its squares.
    Image result_of_frame(nb::handle target, const char* argument, Element element, const Layout& layout,
                          bool directions) {
        const Image small =
            result(target, argument, element, {layout.width / factor, layout.height / factor, layout.channels});
        if (factor == 1)
            return small;
        const Image large(device_, element, layout);
        averages_.emplace_back(large, small, directions);
        return large;
    }

    // Calls the operation without the interpreter's lock, and waits if arrays take part.
    void run(const std::function<void()>& operation) {
        const Unlocked released;
        try {
            operation();
            for (const auto& [large, small, directions] : averages_)
                average_squares(large, small, directions);
            for (const auto& [image, data, row_stride] : fetches_)
                image.download(data, row_stride);
            if (waits_ && fetches_.empty())
                device_.finish();
        } catch (...) {
            try {
                device_.finish(); // arrays go when this call ends
            } catch (const std::exception&) {
            }
            throw;
        }
    }

    nb::list results;
    int factor = 1; ///< of how many pixels each way is one of the results the mean?

private:
    const nb::dict& arguments_;
    bool makes_images_, waits_ = false;
    Device device_;
    std::vector<HostImage> kept_; // until the device has read them
    RelativeValues relative_;
    std::vector<std::tuple<Image, void*, std::size_t>> fetches_;
    std::vector<std::tuple<Image, Image, bool>> averages_;
};

// The depth of a call, and the lens that relative depth has to have.
StoredDepth depth_of(Call& call, const nb::dict& arguments, LensArguments& lens) {
    if (!lens.relative)
        return call.depth(camera_in(arguments));
    for (const char* none : {"camera", "storage"})
        if (!in(arguments, none).is_none())
            throw std::invalid_argument(text(none, ": relative depth has none; give None"));
    lens = completed(lens, {}, relative_camera(1, 1, *lens.relative).projection);
    return call.relative_depth(lens, in(arguments, "color"));
}

// Sets the images, and brings the depth to the size of the picture that it belongs to.
void set_images(const description::Operation& operation, const Parsed& its, void* made, Call& call,
                const nb::dict& arguments, StoredDepth& depth) {
    Image shown;
    const auto fit = [&](const Image& picture) {
        const Unlocked released;
        const bool is_other = picture.width() != depth.image.width() || picture.height() != depth.image.height();
        require(!is_other || call.factor == 1,
                "color has another size than depth; supersampled needs both in the size of the large frame");
        if (is_other)
            depth = upsample_along_edges(depth, picture);
        shown = picture;
    };
    const nb::handle color = in(arguments, "color");
    if (!color.is_none() && !its.has("color")) // of which nothing is computed
        fit(call.input(color, "picture", "color").first);
    for (const auto& [option, given] : its.images) {
        const nb::object pixels =
            nb::isinstance<BackDepth>(given) ? nb::cast<const BackDepth&>(given).depth : nb::borrow(given);
        if (option->kind == Kind::depth) {
            operation.set(made, *option, call.depth_of(camera_in(arguments), pixels, option->name, nb::none()));
            continue;
        }
        const Image image =
            call.input(pixels, option->kind == Kind::picture ? "picture" : "numbers", option->name).first;
        if (option->required)
            fit(image);
        operation.set(made, *option, image);
    }
    if (const bool sharpens = call.edges() == Edges::sharpen; sharpens && !its.lens.relative) {
        const Unlocked released;
        depth = sharpen_edges(depth, shown);
    }
}

// Sets the images of results. Is the first of them all that is asked for?
bool set_results(const description::Operation& operation, void* made, Call& call, nb::handle out,
                 const StoredDepth& depth) {
    const std::vector<description::Result> results = operation.results_of(made, depth);
    const bool alone = !operation.results ||
                       (operation.first_alone && std::ranges::count(results, true, &description::Result::wanted) == 1);
    if (!alone && !out.is_none() && (!nb::isinstance<nb::tuple>(out) || nb::len(out) != results.size()))
        throw std::invalid_argument(
            text("out: must be a tuple of ", results.size(), " arrays or None, one for each field of the result"));
    for (std::size_t i = 0; i < results.size(); ++i) {
        const auto& [field, image, wanted, shape, content, words] = results[i];
        const nb::object target = alone || out.is_none() ? nb::borrow(out) : nb::object(out[i]);
        if (wanted)
            *image = call.result_of_frame(target, alone ? "out" : text("out.", field).c_str(), shape.element,
                                          shape.layout, content.of == description::Content::Of::directions);
        else
            call.results.append(nb::none());
    }
    return alone;
}

nb::object run(const std::string& name, const nb::dict& arguments) {
    const description::Operation& operation = operation_of(name);
    Parsed its = parsed(operation, arguments);
    const auto end = operation.options.end();
    for (const Option& option : operation.options)
        if (option.required && !its.has(option.name))
            throw nb::type_error(text(option.name, " = None must be ", option.accepted()).c_str());
    const auto radius = std::ranges::find(operation.options, std::string_view("radius"), &Option::name);
    if (radius != end && !its.has("radius"))
        operation.set(its.call.get(), *radius,
                      description::default_radius(camera_in(arguments).file.lens, "the camera", "radius"));

    Call call(arguments);
    const std::shared_ptr<void> made = std::move(its.call); // whose images end before the arrays that they lie in
    StoredDepth depth = depth_of(call, arguments, its.lens);
    set_images(operation, its, made.get(), call, arguments, depth);
    its.repair.grow_foreground *= call.factor;
    if (call.factor > 1)
        operation.supersample(made.get(), call.factor);
    const bool alone = set_results(operation, made.get(), call, in(arguments, "out"), depth);
    const auto circle = std::ranges::find(operation.options, Kind::lens, &Option::kind);
    const LensDefaults* const defaults = its.lens.relative ? nullptr : &camera_in(arguments).file.lens;
    call.run([&] {
        if (circle != end) {
            if (defaults)
                its.lens = completed(its.lens, *defaults, depth.camera.projection);
            operation.set(made.get(), *circle, circle_for(supersampled(its.lens, call.factor), depth));
        }
        operation.run(made.get(), operation.repair.empty() ? depth : repaired(depth, its.repair), {});
    });
    return alone ? nb::object(call.results[0]) : nb::object(call.results);
}

double depth_at_of(const nb::dict& arguments, nb::handle pixel) {
    static const Option at{{Kind::pixel}, "pixel"};
    const auto [x, y] = std::get<LensArguments::Pixel>(value_of(at, pixel));
    Call call(arguments);
    const StoredDepth depth = call.depth(camera_in(arguments));
    double z = 0;
    call.run([&, x = x, y = y] { z = depth_at(depth, x, y); });
    return z;
}

std::vector<std::string> check(const nb::dict& arguments) {
    Parsed its = parsed(operation_of("dof"), arguments);
    const Parsed of_radius = parsed(operation_of("ssao"), arguments);
    const CameraObject& camera = camera_in(arguments);
    const HostImage host = host_image(in(arguments, "depth"), "depth", "depth");
    const HostDepth stored =
        host.depth(storage_of(host.element, host.layout.channels, in(arguments, "storage"), camera.file, "depth"));
    const Camera seen = camera.of_size(stored.width, stored.height);
    std::vector<std::string> said = key_doubts(camera.file.text, seen.width, seen.height);
    const auto& options = static_cast<const description::DofCall*>(its.call.get())->options;
    const bool has_lens = its.together.size() > static_cast<std::size_t>(its.has("sky") + its.has("max_coc_px"));
    CircleOfConfusion circle;
    if (has_lens) {
        its.lens = completed(its.lens, camera.file.lens, seen.projection);
        circle = circle_for(its.lens, {.image = {}, .camera = seen, .storage = stored.storage});
    }
    const Unlocked released;
    const auto add = [&](const std::vector<std::string>& more) { said.insert(said.end(), more.begin(), more.end()); };
    add(depth_doubts(seen, stored));
    const bool is_right = said.empty(); // or one mistake would be told twice
    if (is_right && of_radius.has("radius"))
        add(radius_doubts(seen, stored, static_cast<const description::SsaoCall*>(of_radius.call.get())->radius));
    if (is_right && has_lens)
        add(lens_doubts(seen, stored, its.lens, circle, options.sky, options.max_coc_px));
    return said;
}

// All operations as JSON, and what python/generate.py has to know beside that.
nb::list described() {
    nb::list all;
    for (const description::Operation& operation : operations()) {
        nb::list arguments;
        for (const char* name : operation.arguments)
            if (name)
                arguments.append(name);
        all.append(nb::make_tuple(as_json(operation).dump(), arguments, operation.results, operation.first_alone,
                                  operation.supersample != nullptr));
    }
    return all;
}

} // namespace

void bind_operations(nb::module_& module) {
    module.def("_run", run);
    module.def("_depth_at", depth_at_of);
    module.def("_check", check);
    module.def("_described", described);
    module.def("_restore_highlights", [](const Floats& light, double highlights) {
        restore_highlights({light.data(), light.size()}, on_host(light).channels, highlights);
    });
    nb::class_<ShotFrame>(module, "_ShotFrame");
    module.def("_shot_frame", [](const Floats& stored) {
        const Unlocked released;
        return shot_frame(on_host(stored));
    });
    module.def("_steady_ranges", [](const std::vector<ShotFrame>& frames) {
        const Unlocked released;
        std::vector<std::array<double, 2>> ranges;
        for (const auto& [least, greatest, is_first] : steady_ranges(frames))
            ranges.push_back({least, greatest});
        return ranges;
    });
    module.def("_upsample_along_edges", [](const Floats& depth, const Floats& color, const Floats& to) {
        const Unlocked released;
        std::ranges::copy(upsample_along_edges(on_host(depth), on_host(color)), to.data());
    });
}

} // namespace fathom::python
