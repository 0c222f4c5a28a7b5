// Cameras: the names of their finite choices, as the camera file and the program write them, and the camera of a part of an image.

#include <fathom/camera.hpp>

#include "require.hpp"

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
    static constexpr const char* names[] = {"uint8",          "uint16-rotated",  "uint16-swapped", "uint13",
                                            "uint24",         "uint24-high",     "rgb-low-first",  "rgb-high-first",
                                            "rgba-low-first", "rgba-high-first", "base-255"};
    return named<Packing::base_255>(names, packing);
}

const char* to_string(Form form) {
    static constexpr const char* names[] = {"reciprocal",   "reciprocal-affine",   "affine", "rational", "exponential",
                                            "ray-distance", "inverse-ray-distance"};
    return named<Form::inverse_ray_distance>(names, form);
}

const char* to_string(Along along) {
    return along == Along::axis ? "axis" : along == Along::ray ? "ray" : "cube";
}

// A part of an image. In pixels r = (1 + s y) H/2 from the first row, s = ±1, so that rows from r₀ on are
//   y' = y H/h + s ((H − 2 r₀)/h − 1),   and so for columns, with s = 1
// which multiplies the projection's rows and adds a part of its fourth. Depth is untouched.
Camera cropped(const Camera& camera, int x, int y, int width, int height) {
    require(camera.width > 0 && camera.height > 0 && width > 0 && height > 0, "a part of ", width, " x ", height,
            " pixels of an image of ", camera.width, " x ", camera.height, ": all of them must be at least 1");
    Camera part = camera;
    part.width = width;
    part.height = height;
    const bool rows_go_up = (camera.rows == Rows::bottom_up) == (camera.projection.convention.clip_y == ClipY::up);
    const auto change = [&](Eigen::Index row, long double whole, long double first, long double pixels,
                            long double sign) {
        auto& matrix = part.projection.matrix;
        matrix.row(row) =
            matrix.row(row) * (whole / pixels) + matrix.row(3) * (sign * ((whole - 2 * first) / pixels - 1));
    };
    change(0, camera.width, x, width, 1);
    change(1, camera.height, y, height, rows_go_up ? 1 : -1);
    for (auto* lens : {&part.lens, &part.raw_lens})
        if (*lens) { // which counts from the top
            (*lens)->cx -= x;
            (*lens)->cy -= camera.rows == Rows::top_down ? y : camera.height - height - y;
        }
    return part;
}

} // namespace fathom
