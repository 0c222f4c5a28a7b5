// Signatures and stubs of the operations, printed from their descriptions.
#include "signature.hpp"

#include "call.hpp"
#include "keywords.hpp"

#include "text.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace fathom::python {
namespace {

using description::Kind;
using description::Operation;
using description::Option;
using Parameter = Signature::Parameter;

constexpr const char* common_text = R"(

ignore: an image of the depth's size, of any dtype: pixels that are not 0 there do not count, as if they were invalid.
storage: how elements hold depth, if their dtype and the camera's packing do not say it. out: where the result goes; its rows
may be any distance apart, its columns not. device: a fathom.Device, or "cpu", "gpu", one of devices(), its index, or a
part of a name. If depth is a fathom.Image, the result is one, too, and nothing is waited for.

Raises ValueError for bad arguments, fathom.Error for a camera of another size and from the device; NoDevice without one.)";

constexpr const char* lens_text = "What is missing of the lens comes from the camera. Relative depth needs blur_px, "
                                  "and focus_at or focus_range; its camera "
                                  "is None.\n";

constexpr const char* stub_head =
    R"(from typing import Any, Generic, Literal, NamedTuple, Protocol, TypeVar, Union, overload
import collections.abc
import typing

import numpy
from typing_extensions import Buffer

from ._fathom import BackDepth, Camera, Device, DeviceInfo, Image

class SupportsDlpack(Protocol):
    def __dlpack__(self, *args: Any, **options: Any) -> Any: ...

NumpyArray = numpy.ndarray

# What pixels are read from and written to. Lists are not among them.
Array = Union[numpy.ndarray, SupportsDlpack, Buffer]
Pixels = TypeVar("Pixels")
Out = TypeVar("Out", bound=Union[Array, Image])
)";

std::string definition(const std::string& name, const std::vector<Parameter>& arguments,
                       const std::vector<Parameter>& keywords, const std::string& result) {
    std::string text = "def " + name + "(";
    const auto add = [&](const Parameter& each) {
        text +=
            (text.back() == '(' ? "" : ", ") + each.name + ": " + each.type + (each.optional ? " | None = None" : "");
    };
    std::ranges::for_each(arguments, add);
    text += ", *";
    std::ranges::for_each(keywords, add);
    return text + ") -> " + result;
}

// One signature of several: what depth and `out` are, and which results are asked for, decides what is given back.
std::string overload(const Signature& function, const char* depth, const char* out, bool out_is_optional,
                     const char* asked, const std::string& result) {
    std::vector<Parameter> arguments = function.arguments, keywords = function.keywords;
    arguments.front().type = depth;
    for (Parameter& each : keywords) {
        if (each.name == "out")
            each = {"out", out, out_is_optional};
        else if (each.asks_for_result && function.may_be_alone && !asked)
            each.type = "Literal[False]";
        else if (asked && each.name == asked)
            each = {each.name, "Literal[True]", false};
    }
    return "@overload\n" + definition(function.name, arguments, keywords, result);
}

std::string overloads(const Signature& function) {
    std::vector<std::string> all;
    if (function.may_be_alone)
        all.push_back(overload(function, pixels, "Out", false, nullptr, "Out"));
    for (const auto& [depth, made] : {std::pair("Image", "Image"), std::pair("Array", "numpy.ndarray")}) {
        const std::string several = function.results + "[" + made + "]";
        for (const Parameter& each : function.keywords)
            if (each.asks_for_result && function.may_be_alone)
                all.push_back(overload(function, depth, "tuple", true, each.name.c_str(), several));
        if (function.may_be_alone)
            all.push_back(overload(function, depth, "None", true, nullptr, made));
        if (function.may_be_alone && !function.results.empty()) // a bool that nobody knows decides
            all.push_back(overload(function, depth, "Any", true, "", text(several, " | ", made)));
        if (!function.may_be_alone)
            all.push_back(overload(function, depth, "tuple", true, nullptr, several));
    }
    std::string text;
    for (const std::string& each : all)
        text += each + (&each == &all.back() ? ":\n    \"\"\"" + function.doc + "\"\"\"\n\n" : ": ...\n");
    return text;
}

// Shape and words of what an operation gives.
std::string words_of_results(const Operation& operation) {
    const std::shared_ptr<void> call = operation.make(nullptr);
    const std::vector<description::Result> results = operation.results_of(call.get(), {});
    if (!operation.results)
        return text("Returns ", words_of(results.front()), ".");
    std::string words = operation.first_alone
                            ? text("Returns ", words_of(results.front()), ". If another is asked for, a")
                            : std::string("Returns a");
    words += text(" named tuple ", operation.results,
                  ", with None for what was not asked for. `out` is such a tuple then.\n");
    for (const description::Result& result : results)
        words += text(result.name, ": ", words_of(result), &result == &results.back() ? "" : "\n");
    return words;
}

} // namespace

std::string Signature::in_words() const {
    return definition(name, arguments, keywords, "object");
}

Signature signature_of(const char* name, const char* doc) {
    return {.name = name,
            .doc = text(doc, common_text),
            .arguments = {{"depth", pixels, false}, {"camera", "Camera", false}},
            .keywords = {{"ignore", pixels},
                         {"storage", nb::detail::make_caster<Word<Storage>>::Name.text},
                         {"out", text(pixels, " | tuple")},
                         {"device", "Device | DeviceInfo | str | int"}}};
}

Signature signature_of(const Operation& operation) {
    std::vector<Option> options;
    for (const std::vector<Option>* listed : operation.listed())
        options.insert(options.end(), listed->begin(), listed->end());
    std::vector<Parameter> arguments, keywords;
    for (const Option& option : options) {
        const bool is_argument = std::ranges::any_of(
            operation.arguments, [&](const char* name) { return name && std::string_view(name) == option.name; });
        std::vector<Parameter>& all = is_argument ? arguments : keywords;
        if (!all.empty() && all.back().name == option.name)
            all.back().type += " | " + annotation(option);
        else
            all.push_back({option.name, annotation(option), !option.required, option.kind == Kind::result});
    }
    const bool has_picture = takes_size_of_picture(operation);
    if (has_picture)
        keywords.push_back({"color", pixels});
    const std::string doc =
        text(operation.summary, "\n\n", words_of(options), operation.lens.empty() ? "" : lens_text,
             has_picture ? "color: a picture in linear light, whose size and edges the results are to have.\n" : "",
             "\n", words_of_results(operation));
    Signature made = signature_of(operation.name, doc.c_str());
    if (!operation.lens.empty())
        made.arguments.back().type = "Camera | None";
    made.arguments.insert(made.arguments.end(), arguments.begin(), arguments.end());
    made.keywords.insert(made.keywords.begin(), keywords.begin(), keywords.end());
    made.results = operation.results ? operation.results : "";
    made.may_be_alone = !operation.results || operation.first_alone;
    return made;
}

std::string words_of(const description::Result& result) {
    const bool is_light = result.content.of == description::Content::Of::light;
    if (is_light)
        return text("an array of the shape and dtype of color: ", result.words);
    const std::string channels = result.shape.layout.channels > 1 ? text(", ", result.shape.layout.channels) : "";
    return text("(", result.shape.sides, channels, ") float32: ", result.words);
}

std::string stub_of(const std::vector<Signature>& functions) {
    std::string stub = stub_head, names;
    for (const Operation& operation : operations()) {
        if (!operation.results)
            continue;
        const std::shared_ptr<void> call = operation.make(nullptr);
        names += text("\"", operation.results, "\", ");
        stub += text("\nclass ", operation.results, "(NamedTuple, Generic[Pixels]):\n");
        for (const description::Result& result : operation.results_of(call.get(), {}))
            stub += text("    ", result.name, ": Pixels", result.wanted ? "\n" : " | Any\n");
    }
    for (const Signature& function : functions) {
        names += text("\"", function.name, "\", ");
        stub += "\n" + overloads(function);
    }
    return text(stub, "\n__all__ = [", names, "]\n");
}

} // namespace fathom::python
