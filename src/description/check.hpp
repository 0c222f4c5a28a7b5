#pragma once

#include "description/value.hpp"

#include "text.hpp"

#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

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

/// Refuses options of a struct that exclude each other. `each(visitor)` describes it, and `by_default` one of the same type that
/// says nothing; `spelled` gives names in messages.
void check_exclusions(const auto& relations, const auto& options, const auto& by_default, const auto& each,
                      const auto& spelled) {
    const auto is_set = [&](const std::string_view wanted) {
        bool set = false;
        each([&](const char* name, const auto& field, const Accepts&, const auto&...) {
            using Field = std::remove_cvref_t<decltype(field)>;
            if (name != wanted)
                return;
            if constexpr (OfVariant<Field>)
                set = field.find() != nullptr;
            else if constexpr (requires { field.has_value(); })
                set = field.has_value();
            else if constexpr (requires { field != field; }) {
                // What is described lies in the struct itself, so that the default lies at the same place of the other one.
                const auto offset = reinterpret_cast<const char*>(&field) - reinterpret_cast<const char*>(&options);
                set = field != *reinterpret_cast<const Field*>(reinterpret_cast<const char*>(&by_default) + offset);
            }
        });
        return set;
    };
    for (const auto& [option, others] : relations)
        for (const char* other : others)
            if (option && other && is_set(option) && is_set(other))
                throw std::invalid_argument(excluding(spelled(option), spelled(other)));
}

/// Refuses values of a call's options, and options that exclude each other.
template <typename Call>
void check_options(const decltype(Call::options)& options) {
    describe(Check{}, options);
    static const decltype(Call::options) by_default = Call{}.options;
    check_exclusions(
        Call::said.excluding, options, by_default, [&](const auto& visitor) { describe(visitor, options); },
        [](const char* name) { return std::string(name); });
}

} // namespace fathom::description
