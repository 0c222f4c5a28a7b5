#pragma once

#include "description/lens.hpp"
#include "description/value.hpp"

#include <fathom/required.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>

namespace fathom::description {

/// One option of an operation, for whoever sets it: the program, Python, a page.
struct Option : Accepts {
    const char* name = ""; ///< as C++ and Python spell it
    const char* words = "";
    const char* default_words = nullptr; ///< where the default is no value
    std::optional<Value> by_default = {};
    bool required = false;
    std::ptrdiff_t offset = 0; ///< of the field in its struct
    void (*set_field)(void*, const Value&) = nullptr;
    std::optional<std::size_t> alternative = {}; ///< which one of a variant it sets
    /// Names of options: it is of no use without one of the first, and none of the second may be given beside it. "space=world" is
    /// an option of this value.
    std::vector<std::string_view> needs = {}, excludes = {};

    template <typename Options>
    void set(Options& options, const Value& value) const {
        set_field(reinterpret_cast<char*>(&options) + offset, value);
    }

    bool is_whole() const { return range.whole || range.few[0]; }
    bool is_image() const { return kind >= Kind::picture && kind <= Kind::depth; }

    bool is_default(const Value& value) const {
        const auto is_same = [&](const auto& own) {
            if constexpr (requires { own == own; })
                return own == std::get<std::remove_cvref_t<decltype(own)>>(value);
            else
                return false;
        };
        return by_default && by_default->index() == value.index() && std::visit(is_same, *by_default);
    }

    /// "512", "by quality", "none".
    std::string default_in_words() const {
        if (default_words || !by_default)
            return default_words ? default_words : "none";
        if (const auto* index = std::get_if<std::size_t>(&*by_default))
            return choices()[*index];
        if (const auto* yes = std::get_if<bool>(&*by_default))
            return *yes ? "yes" : "no";
        if (const auto* number = std::get_if<double>(&*by_default))
            return text(*number);
        const auto [x, y, z] = std::get<std::array<double, 3>>(*by_default);
        return text(x, ",", y, ",", z);
    }
};

/// Lists the options of a struct, which holds their defaults.
class List {
public:
    List(const void* options, std::vector<Option>& listed) : options_(options), listed_(listed) {}

    template <typename Field>
    void operator()(const char* name, Field&& field, const Accepts& accepts, const char* words = "",
                    const char* default_words = nullptr) const {
        using Own = std::remove_reference_t<Field>;
        Option& option = listed_.emplace_back(Option{accepts, name, words, default_words});
        if constexpr (OfVariant<Own>) {
            if (const auto* held = field.find(); held && !default_words)
                option.by_default = value_of(*held);
            option.offset = offset_of(field.variant);
            option.alternative = field.index();
            option.set_field = [](void* variant, const Value& value) {
                assign(Own::make(*static_cast<std::remove_reference_t<decltype(field.variant)>*>(variant)), value);
            };
        } else {
            option.required = !default_words && is_any_of<Own, Required, Image>;
            if (!default_words && !option.required)
                option.by_default = value_of(field);
            option.offset = offset_of(field);
            option.set_field = [](void* own, const Value& value) { assign(*static_cast<Own*>(own), value); };
        }
    }

private:
    std::ptrdiff_t offset_of(const auto& field) const {
        return reinterpret_cast<const char*>(&field) - static_cast<const char*>(options_);
    }

    template <typename Field>
    static void assign(Field& field, const Value& value) {
        if constexpr (std::is_same_v<Field, Required>)
            field.value = std::get<double>(value);
        else if constexpr (std::is_enum_v<Field>)
            field = static_cast<Field>(std::get<std::size_t>(value));
        else if constexpr (std::is_empty_v<Field>)
            return; // it has one value
        else if constexpr (is_any_of<Field, double, bool, std::array<double, 2>, LensArguments::Pixel,
                                     LensArguments::AlongRay, Image, StoredDepth, Region, CircleOfConfusion>)
            field = std::get<Field>(value);
        else if constexpr (std::is_arithmetic_v<Field>)
            field = static_cast<Field>(std::get<double>(value));
        else if constexpr (requires { field[2]; })
            field = std::apply([](auto... n) { return Field{n...}; }, std::get<std::array<double, 3>>(value));
        else
            assign(field.emplace(), value);
    }

    const void* options_;
    std::vector<Option>& listed_;
};

/// The options of a struct in the order of its description, which holds their defaults.
template <typename Options>
std::vector<Option> options_of(Options options) {
    std::vector<Option> listed;
    describe(List(&options, listed), options);
    return listed;
}

} // namespace fathom::description
