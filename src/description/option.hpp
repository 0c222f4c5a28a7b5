#pragma once

#include "description/field.hpp"
#include "description/lens.hpp"
#include "description/range.hpp"

#include <fathom/image.hpp>
#include <fathom/lens.hpp>
#include <fathom/required.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>

namespace fathom::description {

/// What an option is set to: a number, the index of a choice, yes or no, three numbers, or what its kind says.
using Value =
    std::variant<double, std::size_t, bool, std::array<double, 3>, Image, StoredDepth, Region, CircleOfConfusion>;

/// One option of an operation, for whoever sets it: the program, Python, a page.
struct Option {
    using Kind = description::Kind;

    const char* name = ""; ///< as C++ and Python spell it
    const char* words = "";
    Kind kind = Kind::number;
    Range range = {};                           ///< of a number
    Three three = {};                           ///< of three numbers
    std::vector<const char*> choices = {};      ///< in the order of the enumerators
    std::optional<std::string> by_default = {}; ///< nothing: it has to be given
    std::ptrdiff_t offset = 0;                  ///< of the field in its struct
    void (*set_field)(void*, const Value&) = nullptr;
    std::optional<std::size_t> alternative = {}; ///< Fields of one variant exclude each other unless this is the same.

    template <typename Options>
    void set(Options& options, const Value& value) const {
        set_field(reinterpret_cast<char*>(&options) + offset, value);
    }

    bool excludes(const Option& other) const { return offset == other.offset && alternative != other.alternative; }
    /// Are they images of one field, neither of which is of use alone?
    bool belongs_to(const Option& other) const {
        return is_image() && other.is_image() && offset == other.offset && !excludes(other);
    }
    bool is_image() const { return kind >= Kind::picture && kind <= Kind::depth; }

    /// What will do: "a number above 0", "blur or sharp".
    std::string accepted() const {
        static constexpr const char* by_kind[] = {"",
                                                  "",
                                                  "yes or no",
                                                  "three numbers",
                                                  "yes or no",
                                                  "an image of 3 or 4 channels",
                                                  "an image of 3 or 4 floats a pixel",
                                                  "an image of one float a pixel",
                                                  "stored depth of the same camera",
                                                  "four whole numbers: x, y, width and height",
                                                  ""};
        if (kind == Kind::lens)
            return text("two numbers ", circle_numbers.limits(), ", k and g");
        if (kind == Kind::three && three == Three::direction)
            return "three numbers, one of which is not 0";
        return kind == Kind::number   ? range.in_words()
               : kind == Kind::choice ? in_words(choices)
                                      : by_kind[static_cast<std::size_t>(kind)];
    }

    bool accepts(const Value& value) const {
        if (const auto* index = std::get_if<std::size_t>(&value))
            return *index < choices.size();
        if (const auto* circle = std::get_if<CircleOfConfusion>(&value))
            return circle_numbers.holds(static_cast<double>(circle->k)) &&
                   circle_numbers.holds(static_cast<double>(circle->g));
        if (const auto* number = std::get_if<double>(&value))
            return range.holds(*number);
        const auto* numbers = std::get_if<std::array<double, 3>>(&value);
        return !numbers || (std::ranges::all_of(*numbers, [](double n) { return std::isfinite(n); }) &&
                            (three != Three::direction || *numbers != std::array<double, 3>{}));
    }
};

template <typename Type, typename... Types>
inline constexpr bool is_any_of = (std::is_same_v<Type, Types> || ...);

/// Lists the options of a struct, which holds their defaults.
class List {
public:
    List(const void* options, std::vector<Option>& listed) : options_(options), listed_(listed) {}

    template <typename Field>
    void operator()(const char* name, Field&& field, const Range& range, const char* words,
                    const char* by_default = nullptr) const {
        add(field, by_default, {.name = name, .words = words, .range = range});
    }
    template <typename Field>
    void operator()(const char* name, Field&& field, std::initializer_list<const char*> choices, const char* words,
                    const char* by_default = nullptr) const {
        add(field, by_default, {.name = name, .words = words, .kind = Option::Kind::choice, .choices = choices});
    }
    template <typename Field>
    void operator()(const char* name, Field&& field, Three three, const char* words,
                    const char* by_default = nullptr) const {
        add(field, by_default, {.name = name, .words = words, .kind = Option::Kind::three, .three = three});
    }
    template <typename Field>
    void operator()(const char* name, Field&& field, Kind kind, const char* words = "",
                    const char* by_default = nullptr) const {
        add(field, by_default, {.name = name, .words = words, .kind = kind});
    }

private:
    template <typename Field>
    void add(Field& field, const char* by_default, Option option) const {
        if constexpr (OfVariant<Field>) {
            using Variant = std::remove_reference_t<decltype(field.variant)>;
            const auto* held = field.find();
            finish(field.variant, option, by_default ? by_default : held ? default_of(*held, option) : "none");
            listed_.back().alternative = field.index();
            listed_.back().set_field = [](void* variant, const Value& value) {
                assign(Field::make(*static_cast<Variant*>(variant)), value);
            };
        } else {
            finish(field, option, by_default ? by_default : default_of(field, option));
            listed_.back().set_field = [](void* own, const Value& value) { assign(*static_cast<Field*>(own), value); };
        }
    }
    void finish(const auto& field, Option& option, std::optional<std::string> by_default) const {
        option.by_default = std::move(by_default);
        option.offset = reinterpret_cast<const char*>(&field) - static_cast<const char*>(options_);
        listed_.push_back(std::move(option));
    }

    template <typename Field>
    static std::optional<std::string> default_of(const Field& field, const Option& option) {
        if constexpr (is_any_of<Field, Required, CircleOfConfusion, Image>)
            return std::nullopt;
        else if constexpr (std::is_enum_v<Field>)
            return option.choices[static_cast<std::size_t>(field)];
        else if constexpr (std::is_same_v<Field, bool>)
            return field ? "yes" : "no";
        else if constexpr (std::is_arithmetic_v<Field>)
            return text(field);
        else if constexpr (requires { field[2]; })
            return text(field[0], ",", field[1], ",", field[2]);
        else
            return "none"; // of an optional, and of images
    }

    template <typename Field>
    static void assign(Field& field, const Value& value) {
        if constexpr (std::is_same_v<Field, Required>)
            field.value = std::get<double>(value);
        else if constexpr (std::is_enum_v<Field>)
            field = static_cast<Field>(std::get<std::size_t>(value));
        else if constexpr (std::is_empty_v<Field>)
            return; // it has one value
        else if constexpr (is_any_of<Field, double, bool, Image, StoredDepth, Region, CircleOfConfusion>)
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
