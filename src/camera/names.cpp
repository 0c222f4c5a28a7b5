// The names of finite choices, as the camera file and the program write them.

#include <fathom/camera.hpp>

namespace fathom {

const char* to_string(Encoding encoding) {
    switch (encoding) {
    case Encoding::window:
        return "window";
    case Encoding::view_z:
        return "view-z";
    case Encoding::ray_distance:
        return "ray-distance";
    case Encoding::linear:
        return "linear";
    case Encoding::logarithmic:
        return "logarithmic";
    case Encoding::exponential:
        return "exponential";
    case Encoding::median:
        return "median";
    case Encoding::pseudo_linear:
        return "pseudo-linear";
    case Encoding::inverse:
        return "inverse";
    case Encoding::inverse_range:
        return "inverse-range";
    }
    return "unknown";
}

const char* to_string(Storage storage) {
    switch (storage) {
    case Storage::float32:
        return "float32";
    case Storage::float16:
        return "float16";
    case Storage::uint8:
        return "uint8";
    case Storage::uint16:
        return "uint16";
    case Storage::uint24:
        return "uint24";
    case Storage::uint24_high:
        return "uint24-high";
    case Storage::rgb8_red_low:
    case Storage::bgr8_red_low:
        return "rgb-low-first";
    case Storage::rgb8_red_high:
    case Storage::bgr8_red_high:
        return "rgb-high-first";
    }
    return "unknown";
}

const char* to_string(Packing packing) {
    switch (packing) {
    case Packing::uint8:
        return "uint8";
    case Packing::uint24:
        return "uint24";
    case Packing::uint24_high:
        return "uint24-high";
    case Packing::rgb_red_low:
        return "rgb-low-first";
    case Packing::rgb_red_high:
        return "rgb-high-first";
    case Packing::rgba_red_low:
        return "rgba-low-first";
    case Packing::rgba_red_high:
        return "rgba-high-first";
    }
    return "unknown";
}

const char* to_string(Form form) {
    switch (form) {
    case Form::reciprocal:
        return "reciprocal";
    case Form::reciprocal_affine:
        return "reciprocal-affine";
    case Form::affine:
        return "affine";
    case Form::rational:
        return "rational";
    case Form::exponential:
        return "exponential";
    case Form::ray_distance:
        return "ray-distance";
    case Form::inverse_ray_distance:
        return "inverse-ray-distance";
    }
    return "unknown";
}

const char* to_string(Along along) {
    return along == Along::axis ? "axis" : "ray";
}

} // namespace fathom
