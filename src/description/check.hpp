#pragma once

#include "description/value.hpp"

#include "text.hpp"

#include <stdexcept>
#include <string>

namespace fathom::description {

/// Refuses values that are not what their description says.
/// Throws: std::invalid_argument with the name, the value and what will do.
struct Check {
    template <typename Field>
    void operator()(const char* name, const Field& field, const Accepts& accepts, const auto&...) const {
        if constexpr (OfVariant<Field>) {
            if (const auto* value = field.find())
                (*this)(name, *value, accepts);
        } else if constexpr (requires { field.has_value(); }) {
            if (field)
                (*this)(name, *field, accepts);
        } else if (const auto value = value_of(field); value && !accepts.accepts(*value)) {
            throw std::invalid_argument(text(name, " = ", in_words(*value), " must be ", accepts.instead_of(*value)));
        } // an operation sees whether images fit
    }
};

/// What is wrong with two options.
inline std::string excluding(const std::string& one, const std::string& other) {
    return one + " and " + other + " exclude each other: give one of the two";
}

} // namespace fathom::description
