#pragma once

#include "description/field.hpp"
#include "description/range.hpp"

#include "require.hpp"

#include <Eigen/Core>

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
        } else if constexpr (std::is_enum_v<Field>) {
            if (static_cast<std::size_t>(field) >= accepts.choices.size())
                throw std::invalid_argument(
                    text(name, " = ", static_cast<int>(field), " must be ", in_words(accepts.choices)));
        } else if constexpr (std::is_convertible_v<Field, double>) { // words are made where a value is refused only
            if (const auto value = static_cast<double>(field);
                accepts.kind == Kind::number && !accepts.range.holds(value))
                throw std::invalid_argument(text(name, " = ", value, " must be ", accepts.range.instead_of(value)));
        } else if constexpr (requires { field[2]; }) {
            const Eigen::Vector3d three{field[0], field[1], field[2]};
            require(three.allFinite() && (accepts.kind != Kind::direction || three.norm() > 0), name, " = (",
                    three.transpose(), ") must be ", in_words(accepts.kind));
        } else if constexpr (requires { field.width + 1; }) {
            const auto& [x, y, width, height] = field;
            require(holds_pixels(field), name, " = (", x, ", ", y, ", ", width, ", ", height, ") must be ",
                    in_words(accepts.kind));
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
