// fathom.check: what is probably wrong with a camera and its depth.
#include "bindings.hpp"

#include "call.hpp"
#include "keywords.hpp"
#include "unlocked.hpp"

#include "text.hpp"

#include <fathom/dof.hpp>
#include <fathom/doubts.hpp>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fathom::python {
namespace {

// What operations say of lengths: the radius, the lens or the circle instead of it, the sky, and the widest circle.
std::vector<Keyword> described_lengths() {
    std::vector<description::Option> lengths;
    for (const description::Operation& operation : operations()) {
        if (operation.name == std::string_view("dof"))
            std::ranges::copy_if(operation.lens, std::back_inserter(lengths), std::not_fn(description::is_of_relative));
        for (const description::Option& option : operation.options)
            if (const std::string_view name = option.name;
                name == "radius" || (operation.name == std::string_view("dof") &&
                                     (name == "circle" || name == "sky" || name == "max_coc_px")))
                lengths.push_back(option);
    }
    return keywords_of(std::move(lengths));
}

struct Lengths {
    std::optional<double> radius;
    LensArguments lens;
    description::DofCall call; // its sky and widest circle
    bool has_lens = false;
};

Lengths lengths_of(Keywords& keywords) {
    static const auto& known = *new std::vector<Keyword>(described_lengths()); // as long as the process
    Lengths read;
    const description::Operation& dof = description::operation<description::DofCall>();
    keywords.each(known, [&](const description::Option& option, nb::handle given) {
        const description::Value value = keywords.value_of(option, given);
        const bool of_lens =
            std::ranges::count(dof.lens, std::string_view(option.name), &description::Option::name) > 0;
        read.has_lens =
            read.has_lens || ((of_lens || option.kind == description::Kind::lens) && !option.is_default(value));
        if (option.name == std::string_view("radius"))
            read.radius = std::get<double>(value);
        else if (of_lens)
            option.set(read.lens, value);
        else if (const auto* circle = std::get_if<CircleOfConfusion>(&value))
            read.lens.circle = {static_cast<double>(circle->k), static_cast<double>(circle->g)};
        else
            dof.set(&read.call, option, value);
    });
    return read;
}

std::vector<std::string> check(const nb::args& arguments, const nb::kwargs& named) {
    static const auto& names =
        *new std::vector{PyUnicode_InternFromString("depth"), PyUnicode_InternFromString("camera")};
    Keywords keywords("check", names, arguments, named);
    const Pixels depth{keywords.take("depth")};
    const nb::object camera_given = keywords.take("camera");
    if (!nb::isinstance<CameraObject>(camera_given))
        keywords.refuse();
    const auto& camera = nb::cast<const CameraObject&>(camera_given);
    const Word<Storage> storage{keywords.take("storage")};
    auto [radius, lens, call, has_lens] = lengths_of(keywords); // refused whatever else is wrong
    keywords.finish();
    const HeldDepth held = host_depth(depth, camera, storage, "depth");
    const Camera seen = camera.of_size(held.stored.width, held.stored.height);
    std::vector<std::string> said = key_doubts(camera.file().text, seen.width, seen.height);
    CircleOfConfusion circle;
    if (has_lens) {
        lens = completed(lens, camera.file().lens, seen.projection);
        std::optional<Call> of_pixel;
        if (lens.focus_at)
            of_pixel.emplace(depth, camera, storage, DeviceOption{nb::none()});
        circle = circle_for(lens, of_pixel ? of_pixel->depth()
                                           : StoredDepth{.image = {}, .camera = seen, .storage = held.stored.storage});
    }
    const Unlocked released;
    for (const std::string& doubt : depth_doubts(seen, held.stored))
        said.push_back(in_python(doubt));
    if (!said.empty())
        return said; // or one mistake would be told twice
    if (radius)
        said = radius_doubts(seen, held.stored, *radius);
    if (has_lens)
        for (const std::string& doubt :
             lens_doubts(seen, held.stored, lens, circle, call.options.sky, call.options.max_coc_px))
            said.push_back(doubt);
    return said;
}

} // namespace

void bind_check(nb::module_& module) {
    std::string signature = text("def check(depth: fathom._operations.Array | Image, camera: Camera, *, storage: ",
                                 nb::detail::make_caster<Word<Storage>>::Name.text, " | None = None");
    for (const Keyword& each : described_lengths())
        signature += text(", ", each.option.name, ": ", annotation(each.option), " | None = None");
    static const auto& kept = *new std::string(signature + ") -> list[str]"); // nanobind keeps its address
    module.def("check", check, nb::sig(kept.c_str()),
               R"(What is probably wrong with the camera for this depth: a sentence each, with the cure.

If nothing is, and a radius of ssao or a lens of dof is given, what is probably wrong with that: it reaches nothing or
everything that the image shows, or counts in another unit. What a lens lacks the camera gives, as for dof.

depth, storage, and what concerns lengths: as for the operations. All pixels count: about 50 ms for 1920 x 1080. Only
focus_at needs a device. The first call of an operation with a camera looks at a sample of its depth, in at most a
millisecond, and warns (CameraWarning) of the same.

Returns a list of str, empty if nothing looks wrong. Raises ValueError and fathom.Error as linearize does.)");
}

} // namespace fathom::python
