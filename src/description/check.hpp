#pragma once

#include "description/field.hpp"
#include "description/range.hpp"

#include "require.hpp"

#include <Eigen/Core>

#include <initializer_list>
#include <optional>
#include <type_traits>

namespace fathom::description {

/// Refuses values that are not what their description says.
/// Throws: std::invalid_argument with the name, the value and what will do.
struct Check {
    void operator()(const char* name, double value, const Range& range, const auto&...) const {
        if (!range.holds(value)) // words are made only then: every call checks dozens of values
            throw std::invalid_argument(text(name, " = ", value, " must be ", range.instead_of(value)));
    }
    template <typename Number>
    void operator()(const char* name, const std::optional<Number>& value, const Range& range, const auto&...) const {
        if (value)
            (*this)(name, static_cast<double>(*value), range);
    }
    template <typename Choice>
    requires std::is_enum_v<Choice>
    void operator()(const char* name, const Choice& value, std::initializer_list<const char*> names,
                    const auto&...) const {
        const auto index = static_cast<std::size_t>(value);
        if (index >= names.size())
            throw std::invalid_argument(text(name, " = ", static_cast<int>(value), " must be ", in_words(names)));
    }
    template <typename Numbers>
    requires requires(const Numbers& numbers) { numbers[2]; }
    void operator()(const char* name, const Numbers& value, Three kind, const auto&...) const {
        const Eigen::Vector3d numbers{value[0], value[1], value[2]};
        require(numbers.allFinite(), name, " = (", numbers.transpose(), ") must be finite");
        require(kind != Three::direction || numbers.norm() > 0, name, " = (", numbers.transpose(), ") must not be 0");
    }
    void operator()(const char*, const auto&, Kind, const auto&...) const {} // an operation sees whether images fit

    template <OfVariant Field>
    void operator()(const char* name, const Field& field, const Range& range, const auto&...) const {
        if (const auto* value = field.find())
            (*this)(name, *value, range);
    }
    template <OfVariant Field>
    void operator()(const char* name, const Field& field, std::initializer_list<const char*> names,
                    const auto&...) const {
        if constexpr (std::is_enum_v<typename Field::Type>)
            if (const auto* value = field.find())
                (*this)(name, *value, names);
    }
};

} // namespace fathom::description
