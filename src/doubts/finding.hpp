#pragma once

#include <fathom/camera.hpp>

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace fathom {

/// What is wrong with what is said of an image. Two findings of one kind answer one question.
enum class Fault {
    nothing_measured, ///< no value has a depth
    bits,             ///< codes hold something else than a number, or in another order
    picture,
    planes, ///< flat surfaces are bent
    invalid,
    unit,
    buffer,
    number, ///< stands for no depth
    filtered,
    panorama,
    projection,
    range,
    lens,
};

/// "nothing-measured" and so on.
const char* to_string(Fault fault);

/// A member of a camera file, and the value that it should have.
struct Key {
    const char* name;
    /// Of "orthographic" near and far, of "gamma" `gamma_of_srgb` or a power.
    std::variant<double, bool, std::array<double, 2>, Encoding, Packing, Along> value;
};

/// A change of a camera file, which is tried before it is told.
struct Cure {
    std::vector<Key> keys;
    std::string when = {};  ///< "if they are millimetres": before "say KEYS"
    std::string words = {}; ///< in place of that
};

/// Members of JSON: `"scale": 0.001, "missing": 0`.
std::string in_words(const std::vector<Key>& keys);

struct Finding {
    Fault fault;
    std::string cause;
    std::vector<Cure> cures = {};
    std::string otherwise = {}; ///< where no cure is left: what no key says, or only who knows a number
    bool has_no_unit = false;   ///< are the values no lengths, so that their unit means nothing?
};

/// A sentence with its cures.
std::string in_words(const Finding& finding);

} // namespace fathom
