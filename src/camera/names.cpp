// The names of finite choices, as the camera file and the program write them.

#include <fathom/camera.hpp>

#include <cstddef>

namespace fathom {
namespace {

// Names in the order of the enumerators, of which `last` is the last.
template <auto last, std::size_t count>
const char* named(const char* const (&names)[count], decltype(last) choice) {
    static_assert(count == static_cast<std::size_t>(last) + 1);
    const auto index = static_cast<std::size_t>(choice);
    return index < count ? names[index] : "unknown";
}

} // namespace

const char* to_string(Encoding encoding) {
    static constexpr const char* names[] = {"window",      "view-z", "ray-distance",  "linear",  "logarithmic",
                                            "exponential", "median", "pseudo-linear", "inverse", "inverse-range"};
    return named<Encoding::inverse_range>(names, encoding);
}

const char* to_string(Storage storage) {
    static constexpr const char* names[] = {"float32",       "float16",       "uint8",         "uint16",
                                            "uint24",        "uint24-high",   "rgb-low-first", "rgb-high-first",
                                            "rgb-low-first", "rgb-high-first"};
    return named<Storage::bgr8_red_high>(names, storage);
}

const char* to_string(Packing packing) {
    static constexpr const char* names[] = {"uint8",         "uint16-rotated", "uint24",         "uint24-high",
                                            "rgb-low-first", "rgb-high-first", "rgba-low-first", "rgba-high-first"};
    return named<Packing::rgba_red_high>(names, packing);
}

const char* to_string(Form form) {
    static constexpr const char* names[] = {"reciprocal",   "reciprocal-affine",   "affine", "rational", "exponential",
                                            "ray-distance", "inverse-ray-distance"};
    return named<Form::inverse_ray_distance>(names, form);
}

const char* to_string(Along along) {
    return along == Along::axis ? "axis" : along == Along::ray ? "ray" : "cube";
}

} // namespace fathom
