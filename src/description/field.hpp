#pragma once

#include <cstddef>
#include <optional>
#include <type_traits>
#include <variant>

namespace fathom::description {

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
