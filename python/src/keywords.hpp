#pragma once

#include "words.hpp"

#include "description/option.hpp"

#include <nanobind/nanobind.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fathom::python {

/// An option that is described, and its name as Python's calls have it: the same object for each call.
struct Keyword {
    description::Option option;
    PyObject* name;
};

std::vector<Keyword> keywords_of(std::vector<description::Option> options);

/// The keyword arguments of a call of an operation. Each is taken by whoever knows its name; None counts as not given.
class Keywords {
public:
    Keywords(const char* function, const nb::kwargs& given);

    /// Sets what is given of the options that are described.
    /// Throws: nb::type_error for what is no such value, std::invalid_argument for one that the description does not accept.
    template <typename Options>
    void set(Options& options) {
        static const std::vector<Keyword>& known = *new std::vector(keywords_of(description::options_of(options)));
        set(known,
            [&](const description::Option& option, const description::Value& value) { option.set(options, value); });
    }
    void set(const std::vector<Keyword>& known,
             const std::function<void(const description::Option&, const description::Value&)>& set_option);

    /// One that is not described as an option: an image, a device.
    nb::object take(const char* name);

    /// The same as a value of a type.
    /// Throws: nb::type_error for any other.
    template <typename Value>
    std::optional<Value> take_as(const char* name) {
        const nb::object given = take(name);
        if (given.is_none())
            return std::nullopt;
        Value value;
        if (!nb::try_cast(given, value))
            refuse();
        return value;
    }

    /// Throws: nb::type_error if nobody has taken one of them.
    void finish() const;

private:
    struct Item {
        nb::handle name, value;
        bool taken = false;
    };

    [[noreturn]] void refuse() const;
    description::Value value_of(const description::Option& option, nb::handle given) const;

    const char* function_;
    std::vector<Item> items_;
};

/// A signature for the stubs: `arguments`, then the options that are described, then `more`.
std::string signature_of(const char* function, const std::string& arguments,
                         const std::vector<description::Option>& options, const std::string& more);

/// What the options mean, a line each.
std::string words_of(const std::vector<description::Option>& options);

} // namespace fathom::python
