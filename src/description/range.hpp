#pragma once

#include "text.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

/// What an operation's arguments are, said once: the checks of the library, the program's options, Python's keywords and the
/// pages' tables are made of it.
namespace fathom::description {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// What a number may be: an interval, or one of a few whole numbers. Never NaN.
struct Range {
    double least = -infinity, most = infinity;
    bool least_excluded = false, most_excluded = false;
    bool whole = false, infinite = false;       ///< may it be infinite at an end that the interval has not?
    std::optional<double> beside = {};          ///< also this number, which is not of the interval
    std::array<std::optional<double>, 3> few{}; ///< instead of an interval

    constexpr Range or_infinite() const {
        Range range = *this;
        range.infinite = true;
        return range;
    }
    constexpr Range or_just(double number) const {
        Range range = *this;
        range.beside = number;
        return range;
    }

    bool holds(double value) const {
        if (few[0])
            return value == few[0] || value == few[1] || value == few[2];
        if (value == beside)
            return true;
        const bool above = least_excluded ? value > least : value >= least,
                   below = most_excluded ? value < most : value <= most;
        return above && below && (infinite || std::isfinite(value)) && (!whole || value == std::floor(value));
    }

    /// "above 0", "1 to 64", "1, 4 or 16"; nothing if any finite number will do.
    std::string limits() const {
        if (few[0])
            return few[2] ? text(*few[0], ", ", *few[1], " or ", *few[2]) : text(*few[0], " or ", *few[1]);
        std::string words = beside ? text(*beside, ", or ") : "";
        if (most < infinity)
            words += text(least, most_excluded ? " to less than " : " to ", exact(most));
        else if (least > -infinity)
            words += text(least_excluded ? "above " : "from ", least);
        return words + (infinite ? ", or inf" : "");
    }

    /// The same as what a value is: "a number above 0", "a whole number from 1 to 64".
    std::string in_words(bool says_finite = false) const {
        const std::string words = limits();
        if (few[0])
            return words;
        const char* kind = whole ? "a whole number" : says_finite ? "a finite number" : "a number";
        return text(kind, words.empty() ? "" : most < infinity && !beside ? " from " : beside ? ": " : " ", words);
    }

    /// What somebody has to give instead of this value: "a finite number above 0" if it is infinite.
    std::string instead_of(double value) const { return in_words(std::isinf(value) && !infinite); }

    /// Without an exponent.
    static std::string exact(double number) {
        return number == std::floor(number) ? text(static_cast<long long>(number)) : text(number);
    }
};

inline constexpr Range any_number{};

constexpr Range from(double least) {
    return {.least = least};
}
constexpr Range above(double least) {
    return {.least = least, .least_excluded = true};
}
constexpr Range between(double least, double most) {
    return {.least = least, .most = most};
}
constexpr Range from_to_less_than(double least, double most) {
    return {.least = least, .most = most, .most_excluded = true};
}
constexpr Range whole(double least, double most) {
    return {.least = least, .most = most, .whole = true};
}
template <typename... Number>
constexpr Range one_of(Number... numbers) {
    return {.few = {numbers...}};
}

/// "fast, balanced or accurate".
template <typename Names>
std::string in_words(const Names& names) {
    std::string list;
    for (auto name = names.begin(); name != names.end(); ++name)
        list += text(name == names.begin() ? "" : name + 1 == names.end() ? " or " : ", ", *name);
    return list;
}

/// A struct of options that is only read, or set.
template <typename Options, typename Struct>
concept Is = std::is_same_v<std::remove_const_t<Options>, Struct>;

} // namespace fathom::description
