#pragma once

#include <fathom/device.hpp>
#include <fathom/image.hpp>

#include <nanobind/nanobind.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
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
    nb::object given;

    bool is_given() const { return given.is_valid() && !given.is_none(); }

    /// Leaves the choice as it is if none was given.
    /// Throws: std::invalid_argument naming the argument, what was given, and all words.
    void set(Choice& choice, const char* argument) const {
        if (!is_given())
            return;
        const std::string_view literal = words<Choice>.text;
        std::vector<std::string_view> known;
        for (std::size_t at = literal.find('\''); at != literal.npos;) {
            const std::size_t end = literal.find('\'', at + 1);
            known.push_back(literal.substr(at + 1, end - at - 1));
            at = literal.find('\'', end + 1);
        }
        std::string list;
        for (std::size_t i = 0; i < known.size(); ++i) {
            if (nb::isinstance<nb::str>(given) && text_of(nb::borrow<nb::str>(given)) == known[i]) {
                choice = static_cast<Choice>(i);
                return;
            }
            list += (i == 0 ? "" : i + 1 == known.size() ? " or " : ", ") + std::string(known[i]);
        }
        throw std::invalid_argument(std::string(argument) + " = " + text_of(nb::repr(given)) + " is unknown; it is " +
                                    list);
    }

    std::optional<Choice> get(const char* argument) const {
        Choice choice{};
        set(choice, argument);
        return is_given() ? std::optional(choice) : std::nullopt;
    }
};

} // namespace fathom::python

template <typename Choice>
struct nanobind::detail::type_caster<fathom::python::Word<Choice>> {
    NB_TYPE_CASTER(fathom::python::Word<Choice>, fathom::python::words<Choice>)

    bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
        value.given = borrow(source);
        return true;
    }
};
