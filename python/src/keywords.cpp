// Keyword arguments of the operations, as their descriptions have them.
#include "keywords.hpp"

#include "text.hpp"

#include <nanobind/stl/array.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace fathom::python {
namespace {

using description::Option;
using description::Value;

bool is_whole(const Option& option) {
    return option.range.whole || option.range.few[0];
}

std::string annotation(const Option& option) {
    switch (option.kind) {
    case Option::Kind::number:
        return is_whole(option) ? "int" : "float";
    case Option::Kind::flag:
    case Option::Kind::result:
        return "bool";
    case Option::Kind::three:
        return "collections.abc.Sequence[float]";
    case Option::Kind::choice:
        break;
    }
    std::string literal;
    for (const char* choice : option.choices)
        literal += text(literal.empty() ? "typing.Literal['" : ", '", choice, "'");
    return literal + "]";
}

} // namespace

std::vector<Keyword> keywords_of(std::vector<Option> options) {
    std::vector<Keyword> keywords;
    for (Option& option : options) {
        PyObject* name = PyUnicode_InternFromString(option.name);
        keywords.push_back({std::move(option), name});
    }
    return keywords;
}

Keywords::Keywords(const char* function, const nb::kwargs& given) : function_(function) {
    items_.reserve(given.size());
    for (const auto& [name, value] : given)
        items_.push_back({name, value});
}

void Keywords::set(const std::vector<Keyword>& known,
                   const std::function<void(const Option&, const Value&)>& set_option) {
    std::vector<const Option*> given;
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
        const Option& option = keyword->option;
        for (const Option* other : given)
            if (option.excludes(*other))
                throw std::invalid_argument(
                    text(option.name, " and ", other->name, " exclude each other: give one of the two"));
        set_option(option, value_of(option, item.value));
        given.push_back(&option);
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

// What is wrong with the arguments, fathom/_calls.py finds out from the signature.
void Keywords::refuse() const {
    throw nb::type_error((std::string(function_) + "(): incompatible function arguments").c_str());
}

Value Keywords::value_of(const Option& option, nb::handle given) const {
    Value value;
    switch (option.kind) {
    case Option::Kind::number: {
        const nb::object whole = is_whole(option) ? nb::steal(PyNumber_Index(given.ptr())) : nb::borrow(given);
        const double number = whole.is_valid() ? PyFloat_AsDouble(whole.ptr()) : -1;
        if (PyErr_Occurred()) {
            PyErr_Clear();
            refuse();
        }
        value = number;
        break;
    }
    case Option::Kind::flag:
    case Option::Kind::result:
        if (!PyBool_Check(given.ptr()))
            refuse();
        return given.is(nb::handle(Py_True));
    case Option::Kind::three: {
        std::array<double, 3> numbers{};
        if (!nb::try_cast(given, numbers))
            refuse();
        value = numbers;
        break;
    }
    case Option::Kind::choice:
        for (std::size_t i = 0; i < option.choices.size(); ++i)
            if (PyUnicode_Check(given.ptr()) && PyUnicode_CompareWithASCIIString(given.ptr(), option.choices[i]) == 0)
                return i;
        throw std::invalid_argument(
            text(option.name, " = ", text_of(nb::repr(given)), " is unknown; it is ", option.accepted()));
    }
    if (!option.accepts(value))
        throw std::invalid_argument(text(option.name, " = ", text_of(nb::str(given)), " must be ", option.accepted()));
    return value;
}

std::string signature_of(const char* function, const std::string& arguments, const std::vector<Option>& options,
                         const std::string& more) {
    std::string keywords;
    for (const Option& option : options)
        if (more.find(text(", ", option.name, ": ")) == more.npos) // it takes more than what is described
            keywords += text(", ", option.name, ": ", annotation(option), " | None = None");
    return text("def ", function, "(", arguments, ", *", keywords, more, ") -> object");
}

std::string words_of(const std::vector<Option>& options) {
    std::string lines;
    for (const Option& option : options) {
        const std::string limits = option.kind == Option::Kind::number   ? option.range.limits()
                                   : option.kind == Option::Kind::choice ? option.accepted()
                                                                         : "";
        const std::string by_default = option.kind == Option::Kind::result || !option.by_default
                                           ? ""
                                           : text(limits.empty() ? "" : "; ", "default: ", *option.by_default);
        lines += text(option.name, ": ", option.words);
        if (!limits.empty() || !by_default.empty())
            lines += text(" (", limits, by_default, ")");
        lines += ".\n";
    }
    return lines;
}

} // namespace fathom::python
