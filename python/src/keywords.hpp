#pragma once

#include "call.hpp"

#include "description/operations.hpp"

#include <nanobind/nanobind.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::python {

/// The operations, whose options have names that are no words of Python.
const std::vector<description::Operation>& operations();

/// An option that is described, and its name as Python's calls have it: the same object for each call.
struct Keyword {
    description::Option option;
    PyObject* name;
};

std::vector<Keyword> keywords_of(std::vector<description::Option> options);

/// The arguments of a call of an operation. Each is taken by whoever knows its name; None counts as not given.
class Keywords {
public:
    /// `names` are those of the arguments that need none.
    Keywords(const char* function, const std::vector<PyObject*>& names, const nb::args& given, const nb::kwargs& named);

    /// Calls `set` with what is given of the options that are described; of several of one name with the one whose kind it is.
    void each(const std::vector<Keyword>& known,
              const std::function<void(const description::Option&, nb::handle)>& set);

    /// What is given for an option that is no image.
    /// Throws: nb::type_error for what is no such value, std::invalid_argument for one that the description does not accept.
    description::Value value_of(const description::Option& option, nb::handle given) const;

    /// One that is not described as an option: a device.
    nb::object take(const char* name);

    /// Throws: nb::type_error if nobody has taken one of them. What is wrong, fathom/_calls.py finds out from the signature.
    void finish() const;
    [[noreturn]] void refuse() const;

private:
    struct Item {
        nb::handle name, value;
        bool taken = false;
    };

    /// `kind` has in words what it must be.
    [[noreturn]] void refuse(const char* name, nb::handle given, const char* kind) const;

    const char* function_;
    std::vector<Item> items_;
};

/// Does it take `color`, a picture that gives its results their size, though it computes nothing of the picture?
inline bool takes_size_of_picture(const description::Operation& operation) {
    return std::string_view(operation.name) == description::DofMasksCall::said.name;
}

/// The type of what an option takes, for the stubs.
std::string annotation(const description::Option& option);

/// What the options mean, a line each.
std::string words_of(const std::vector<description::Option>& options);

} // namespace fathom::python
