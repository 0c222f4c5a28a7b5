#pragma once

#include "description/range.hpp"

#include <fathom/device.hpp>
#include <fathom/image.hpp>

#include <nanobind/nanobind.h>

#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// Finite choices as Python has them: the words of the program, in the order of the enumerators.
namespace fathom::python {

namespace nb = nanobind;
using nb::detail::const_name;

/// The type that the stubs show, which is the table of words as well.
template <typename Choice>
inline constexpr auto words = const_name("str");
template <>
inline constexpr auto words<Arithmetic> = const_name("typing.Literal['automatic', 'fp64', 'two-float']");
template <>
inline constexpr auto words<Storage> =
    const_name("typing.Literal['float32', 'float16', 'uint8', 'uint16', 'uint24', 'uint24-high', 'rgb8-red-low', "
               "'rgb8-red-high', 'bgr8-red-low', 'bgr8-red-high']");

// The last word of a table is the last enumerator.
static_assert(static_cast<int>(Arithmetic::two_float) == 2 && static_cast<int>(Storage::bgr8_red_high) == 9);

/// Text as UTF-8; escaped where it has half a character (a lone surrogate).
inline std::string text_of(const nb::str& text) {
    Py_ssize_t size = 0;
    if (const char* utf8 = PyUnicode_AsUTF8AndSize(text.ptr(), &size))
        return {utf8, static_cast<std::size_t>(size)};
    PyErr_Clear();
    const auto escaped = nb::steal<nb::bytes>(PyUnicode_AsEncodedString(text.ptr(), "utf-8", "backslashreplace"));
    return {escaped.c_str(), escaped.size()};
}

/// What a caller gave for a finite choice: any object, as long as nobody asks what it means.
template <typename Choice>
struct Word {
    static constexpr auto annotation = words<Choice>;
    nb::object given;

    bool is_given() const { return given.is_valid() && !given.is_none(); }

    /// Throws: std::invalid_argument naming the argument, what was given, and all words.
    std::optional<Choice> get(const char* argument) const {
        if (!is_given())
            return std::nullopt;
        std::vector<std::string> known;
        std::istringstream type(words<Choice>.text);
        for (std::string before, word; std::getline(type, before, '\'') && std::getline(type, word, '\'');)
            known.push_back(word);
        if (nb::isinstance<nb::str>(given))
            for (std::size_t i = 0; i < known.size(); ++i)
                if (text_of(nb::borrow<nb::str>(given)) == known[i])
                    return static_cast<Choice>(i);
        throw std::invalid_argument(std::string(argument) + " = " + text_of(nb::repr(given)) + " is unknown; it is " +
                                    description::in_words(known));
    }
};

/// A message of the importers, whose options are the program's, with Python's arguments.
inline std::string in_python(const std::string& said) {
    static const std::pair<std::regex, const char*> spoken[] = {
        {std::regex(R"( \(--(camera|channel)\))"), ""}, // which have no argument here
        {std::regex(R"(--preset ([^ ;,)]+(,[^ ;,)]+)*))"), R"(preset="$1")"},
        {std::regex(R"(--undistorted(?![\w-]))"), "undistorted=True"},
        {std::regex(R"(--(preset|image|node)(?![\w-]))"), "$1="}};
    std::string words = said;
    for (const auto& [option, argument] : spoken)
        words = std::regex_replace(words, option, argument);
    return words;
}

} // namespace fathom::python

/// Takes any object: what is wrong with it, the operation says.
template <typename Argument>
requires requires {
    Argument::annotation;
}
struct nanobind::detail::type_caster<Argument> {
    NB_TYPE_CASTER(Argument, Argument::annotation)

    bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
        value.given = borrow(source);
        return true;
    }
};
