#pragma once

#include "description/range.hpp"

#include <fathom/image.hpp>
#include <fathom/lens_arguments.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace fathom::description {

/// What an option is set to.
enum class Kind {
    number,
    choice,
    flag,
    point,     ///< three finite numbers
    color,     ///< the same, red first
    direction, ///< the same, not all of them 0
    pixel,
    ray,        ///< a pixel and a distance along its ray
    lens,       ///< a circle of confusion, or the lens that makes one
    region,     ///< a part of the depth image
    fractions,  ///< from one number to another, of 0 to 1
    ends,       ///< a number and a greater one
    result,     ///< a flag that asks for a result of this name
    picture,    ///< 3 or 4 channels
    directions, ///< an image of 3 or 4 floats a pixel
    lengths,    ///< an image of one float a pixel
    depth,      ///< stored depth of the same camera
};
inline constexpr Kind a_result = Kind::result;

/// What a kind is to other programs, what will do for it in words, and the parts of one that several numbers make.
struct SaidOfKind {
    const char* name;
    const char* words = "";
    const char* parts = "";
    std::size_t whole = 0; ///< as many of its parts, the first ones, are whole numbers

    std::size_t count() const {
        return *parts ? 1 + static_cast<std::size_t>(std::ranges::count(std::string_view(parts), ',')) : 0;
    }
};
inline constexpr SaidOfKind said_of_kinds[] = {
    {"number"},
    {"choice"},
    {"flag", "yes or no"},
    {"three numbers", "three finite numbers", "X,Y,Z"},
    {"color", "three finite numbers", "R,G,B"},
    {"direction", "three finite numbers, one of which is not 0", "X,Y,Z"},
    {"pixel", "two whole numbers: x and y", "X,Y", 2},
    {"ray", "a pixel's two whole numbers and a distance ", "X,Y,D", 2},
    {"lens", "two numbers ", "K,G"},
    {"region", "four whole numbers: x, y, and a width and a height from 1", "X,Y,W,H", 4},
    {"fractions", "two numbers with 0 <= A <= B <= 1", "A,B"},
    {"ends", "two finite numbers with A < B", "A,B"},
    {"result", "yes or no"},
    {"picture", "an image of 3 or 4 channels"},
    {"directions", "an image of 3 or 4 floats a pixel"},
    {"lengths", "an image of one float a pixel"},
    {"depth", "stored depth of the same camera"}};

inline const SaidOfKind& said_of(Kind kind) {
    return said_of_kinds[static_cast<std::size_t>(kind)];
}

/// Of a tolerance, instead of a way to compute something.
inline constexpr Range tolerated_error = above(0).or_infinite();
/// Of a circle's k and g.
inline constexpr Range circle_numbers = from(0);
/// Of a distance along a pixel's ray.
inline constexpr Range ray_distance = above(0).or_infinite();

/// What will do for an option that is no number and no choice.
inline std::string in_words(Kind kind) {
    return said_of(kind).words + (kind == Kind::ray    ? ray_distance.limits()
                                  : kind == Kind::lens ? circle_numbers.limits() + ", k and g"
                                                       : "");
}

/// What an option is set to: a number, the index of a choice, yes or no, three numbers, or what its kind says.
using Value =
    std::variant<double, std::size_t, bool, std::array<double, 3>, std::array<double, 2>, LensArguments::Pixel,
                 LensArguments::AlongRay, Image, StoredDepth, Region, CircleOfConfusion>;

template <typename Type, typename... Types>
inline constexpr bool is_any_of = (std::is_same_v<Type, Types> || ...);

/// The value of a field; nothing of an image, and of an optional, whose own value is one.
template <typename Field>
std::optional<Value> value_of(const Field& field) {
    if constexpr (std::is_enum_v<Field>)
        return static_cast<std::size_t>(field);
    else if constexpr (is_any_of<Field, bool, Region, std::array<double, 2>>)
        return field;
    else if constexpr (std::is_convertible_v<Field, double>)
        return static_cast<double>(field);
    else if constexpr (requires { field[2]; })
        return std::array<double, 3>{field[0], field[1], field[2]};
    else
        return std::nullopt;
}

/// The value that numbers make; nothing if there are fewer or more, or if one that has to be whole is not. Pixels are negative in overscan.
inline std::optional<Value> value_of(Kind kind, const std::vector<double>& n) {
    const auto is_whole = [](double x) { return x == std::floor(x) && std::abs(x) <= 0x7fffffff; };
    const auto whole = [&](std::size_t i) { return static_cast<int>(n[i]); };
    const SaidOfKind& said = said_of(kind);
    if (n.empty() || n.size() != said.count() ||
        !std::all_of(n.begin(), n.begin() + static_cast<std::ptrdiff_t>(said.whole), is_whole))
        return std::nullopt;
    if (kind == Kind::pixel)
        return LensArguments::Pixel{whole(0), whole(1)};
    if (kind == Kind::ray)
        return LensArguments::AlongRay{{whole(0), whole(1)}, n[2]};
    if (kind == Kind::lens)
        return CircleOfConfusion{n[0], n[1]};
    if (kind == Kind::region)
        return Region{whole(0), whole(1), whole(2), whole(3)};
    if (n.size() == 2)
        return std::array{n[0], n[1]};
    return std::array{n[0], n[1], n[2]};
}

/// "0.5", "(1, 2, 3)".
inline std::string in_words(const Value& value) {
    if (const auto* region = std::get_if<Region>(&value))
        return text("(", region->x, ", ", region->y, ", ", region->width, ", ", region->height, ")");
    if (const auto* three = std::get_if<std::array<double, 3>>(&value))
        return text("(", (*three)[0], ", ", (*three)[1], ", ", (*three)[2], ")");
    if (const auto* two = std::get_if<std::array<double, 2>>(&value))
        return text("(", (*two)[0], ", ", (*two)[1], ")");
    const auto* index = std::get_if<std::size_t>(&value);
    return index ? text(static_cast<int>(*index)) : text(std::get<double>(value));
}

/// What an option accepts: numbers of a range, one of a few words, or what its kind says.
struct Accepts {
    constexpr Accepts(const Range& numbers) : kind(Kind::number), range(numbers) {}
    constexpr Accepts(std::initializer_list<const char*> words) : kind(Kind::choice), count(words.size()) {
        std::ranges::copy(words, all_choices.begin());
    }
    constexpr Accepts(Kind its) : kind(its) {}

    Kind kind;
    Range range = {}; ///< of a number
    std::array<const char*, 4> all_choices = {};
    std::size_t count = 0;

    /// In the order of the enumerators.
    constexpr std::span<const char* const> choices() const { return {all_choices.data(), count}; }

    /// What will do: "a number above 0", "blur or sharp".
    std::string accepted() const {
        return kind == Kind::number   ? range.in_words()
               : kind == Kind::choice ? description::in_words(choices())
                                      : description::in_words(kind);
    }

    /// The same beside a type that says whether it is one number, several or a word.
    std::string limits() const {
        return kind == Kind::number ? range.limits() : said_of(kind).count() > 0 ? description::in_words(kind) : "";
    }

    bool accepts(const Value& value) const {
        const auto will_do = [&](const auto& own) {
            using Own = std::remove_cvref_t<decltype(own)>;
            if constexpr (std::is_same_v<Own, double>)
                return kind != Kind::number || range.holds(own);
            else if constexpr (std::is_same_v<Own, std::size_t>)
                return own < count;
            else if constexpr (std::is_same_v<Own, CircleOfConfusion>)
                return circle_numbers.holds(static_cast<double>(own.k)) &&
                       circle_numbers.holds(static_cast<double>(own.g));
            else if constexpr (std::is_same_v<Own, LensArguments::AlongRay>)
                return ray_distance.holds(own.distance);
            else if constexpr (std::is_same_v<Own, Region>)
                return own.width >= 1 && own.height >= 1; // the image has to hold it, too
            else if constexpr (std::is_same_v<Own, std::array<double, 2>>)
                return kind == Kind::fractions ? 0 <= own[0] && own[0] <= own[1] && own[1] <= 1
                                               : std::isfinite(own[0]) && own[0] < own[1] && std::isfinite(own[1]);
            else if constexpr (requires { own[2]; })
                return std::ranges::all_of(own, [](double n) { return std::isfinite(n); }) &&
                       (kind != Kind::direction || own != Own{});
            else
                return true;
        };
        return std::visit(will_do, value);
    }

    /// What somebody has to give instead of a value that will not do.
    std::string instead_of(const Value& value) const {
        const auto* number = std::get_if<double>(&value);
        return kind == Kind::number && number ? range.instead_of(*number) : accepted();
    }
};

/// An alternative of a variant, or what an optional holds, as a field: setting it makes the variant hold it.
template <typename Alternative, typename Variant>
struct AlternativeField {
    using Type = Alternative;
    Variant& variant;

    const Type* find() const { return of(variant); }
    static std::size_t index() { return index_in(static_cast<std::remove_const_t<Variant>*>(nullptr)); }
    static Type& make(std::remove_const_t<Variant>& variant) {
        if (!of(variant))
            variant = Alternative{};
        return const_cast<Type&>(*of(variant));
    }

private:
    template <typename... Alternatives>
    static std::size_t index_in(const std::variant<Alternatives...>*) {
        return std::variant<Alternatives...>(Alternative{}).index();
    }
    static std::size_t index_in(const Type*) { return 0; }
    template <typename Held>
    static std::size_t index_in(const std::optional<Held>*) {
        return index_in(static_cast<const Held*>(nullptr));
    }
    template <typename... Alternatives>
    static const Type* of(const std::variant<Alternatives...>& held) {
        return std::get_if<Alternative>(&held);
    }
    static const Type* of(const Type& held) { return &held; }
    template <typename Held>
    static const Type* of(const std::optional<Held>& held) {
        return held ? of(*held) : nullptr;
    }
};

template <auto Member>
struct MemberOf;
template <typename Struct, typename Member, Member Struct::*pointer>
struct MemberOf<pointer> {
    using Alternative = Struct;
    using Type = Member;
};

/// A member of an alternative.
template <auto Member, typename Variant>
struct MemberField {
    using Whole = AlternativeField<typename MemberOf<Member>::Alternative, Variant>;
    using Type = typename MemberOf<Member>::Type;
    Variant& variant;

    const Type* find() const {
        const auto* whole = Whole{variant}.find();
        return whole ? &(whole->*Member) : nullptr;
    }
    static std::size_t index() { return Whole::index(); }
    static Type& make(std::remove_const_t<Variant>& variant) { return Whole::make(variant).*Member; }
};

template <typename Alternative, typename Variant>
AlternativeField<Alternative, Variant> in(Variant& variant) {
    return {variant};
}
template <auto Member, typename Variant>
MemberField<Member, Variant> in(Variant& variant) {
    return {variant};
}

template <typename Field>
concept OfVariant = requires(const Field& field) {
    field.find();
};

} // namespace fathom::description
