#pragma once

#include "description/field.hpp"
#include "description/range.hpp"

#include "require.hpp"

#include <Eigen/Core>

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
        } // an operation sees whether images fit
    }
};

} // namespace fathom::description
