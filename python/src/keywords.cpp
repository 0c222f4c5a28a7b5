// Keyword arguments of the operations, as their descriptions have them.
#include "keywords.hpp"

#include "text.hpp"

#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace fathom::python {
namespace {

using description::Kind;
using description::Option;
using description::Value;

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

} // namespace

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

std::string annotation(const Option& option) {
    const std::size_t numbers = said_of(option.kind).count(), whole = said_of(option.kind).whole;
    if (numbers > 0 && (whole == 0 || whole == numbers))
        return text("collections.abc.Sequence[", whole ? "int" : "float", "] | numpy.ndarray");
    std::string literal;
    switch (option.kind) {
    case Kind::number:
        return option.is_whole() ? "int" : "float";
    case Kind::flag:
    case Kind::result:
        return "bool";
    case Kind::ray:
        return "tuple[int, int, float]";
    case Kind::choice:
        for (const char* choice : option.choices())
            literal += text(literal.empty() ? "typing.Literal['" : ", '", choice, "'");
        return literal + "]";
    default:
        return option.kind == Kind::depth && option.needs.empty() ? "BackDepth" : pixels;
    }
}

std::vector<Keyword> keywords_of(std::vector<Option> options) {
    std::vector<Keyword> keywords;
    for (Option& option : options) {
        PyObject* name = PyUnicode_InternFromString(option.name);
        keywords.push_back({std::move(option), name});
    }
    return keywords;
}

Keywords::Keywords(const char* function, const std::vector<PyObject*>& names, const nb::args& given,
                   const nb::kwargs& named)
    : function_(function) {
    if (given.size() > names.size())
        refuse();
    items_.reserve(given.size() + named.size());
    for (std::size_t i = 0; i < given.size(); ++i) {
        if (named.size() > 0 && PyDict_Contains(named.ptr(), names[i]) != 0)
            refuse();
        items_.push_back({names[i], given[i]});
    }
    for (const auto& [name, value] : named)
        items_.push_back({name, value});
}

void Keywords::each(const std::vector<Keyword>& known, const std::function<void(const Option&, nb::handle)>& set) {
    for (Item& item : items_) {
        if (item.taken)
            continue;
        const auto is_its = [&](const Keyword& keyword) { return keyword.name == item.name.ptr(); };
        auto keyword = std::ranges::find_if(known, is_its);
        if (keyword == known.end()) // a name that was made while the program runs
            keyword = std::ranges::find_if(
                known, [&](const Keyword& each) { return PyUnicode_Compare(each.name, item.name.ptr()) == 0; });
        if (keyword == known.end())
            continue;
        item.taken = true;
        if (item.value.is_none())
            continue;
        const auto end =
            std::find_if(keyword, known.end(), [&](const Keyword& other) { return other.name != keyword->name; });
        if (end - keyword > 1) {
            const auto its =
                std::find_if(keyword, end, [&](const Keyword& one) { return is_kind(one.option, item.value); });
            if (its == end) {
                std::vector<const char*> kinds;
                std::transform(keyword, end, std::back_inserter(kinds),
                               [](const Keyword& one) { return kind_of(one.option); });
                throw std::invalid_argument(text(keyword->option.name, " = ", text_of(nb::repr(item.value)),
                                                 " is unknown; it is ", description::in_words(kinds)));
            }
            keyword = its;
        }
        set(keyword->option, item.value);
    }
}

nb::object Keywords::take(const char* name) {
    for (Item& item : items_)
        if (PyUnicode_CompareWithASCIIString(item.name.ptr(), name) == 0) {
            item.taken = true;
            return nb::borrow(item.value);
        }
    return nb::none();
}

void Keywords::finish() const {
    if (!std::ranges::all_of(items_, &Item::taken))
        refuse();
}

void Keywords::refuse() const {
    throw nb::type_error((std::string(function_) + "(): incompatible function arguments").c_str());
}

void Keywords::refuse(const char* name, nb::handle given, const char* kind) const {
    PyErr_Clear();
    throw nb::type_error(text(function_, "(): ", name, " must be ", kind, ", not ", in_short(given)).c_str());
}

Value Keywords::value_of(const Option& option, nb::handle given) const {
    const auto read = [&]() -> std::optional<Value> {
        if (option.kind == Kind::number) {
            const double number = PyFloat_AsDouble(given.ptr());
            if (!PyErr_Occurred())
                return number;
            if (PyErr_ExceptionMatches(PyExc_OverflowError))
                refuse(option.name, given, option.instead_of(HUGE_VAL).c_str());
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
        refuse(option.name, given,
               option.kind == Kind::flag || option.kind == Kind::result ? "True or False" : option.accepted().c_str());
    if (!option.accepts(*value))
        throw std::invalid_argument(
            text(option.name, " = ", text_of(nb::str(given)), " must be ", option.instead_of(*value)));
    return *value;
}

std::string words_of(const std::vector<Option>& options) {
    std::string lines;
    for (const Option& option : options) {
        const std::string limits = option.kind == Kind::choice ? option.accepted() : option.limits();
        const std::string value = option.default_in_words();
        const std::string by_default = option.kind == Kind::result || option.required || value == "none"
                                           ? ""
                                           : text(limits.empty() ? "" : "; ", "default: ", value);
        const bool is_another = &option != &options.front() && (&option)[-1].name == option.name; // of one name
        lines +=
            is_another ? text("    or ", option.accepted(), ": ", option.words) : text(option.name, ": ", option.words);
        if (!limits.empty() || !by_default.empty())
            lines += text(" (", limits, by_default, ")");
        lines += ".\n";
    }
    return lines;
}

} // namespace fathom::python
