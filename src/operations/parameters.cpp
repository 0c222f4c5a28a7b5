// From options and a camera to the kernels' plain structs: what every operation on stored depth shares.

#include "operations/parameters.hpp"

#include "camera/form.hpp"
#include "require.hpp"
#include "text.hpp"

#include <Eigen/QR>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace fathom {
namespace {

// Results below this size stay in the cache for their next reader.
constexpr std::size_t streaming_bytes = std::size_t{16} << 20;

int storage_define(Storage storage) {
    static constexpr int defines[] = {STORAGE_FLOAT32, STORAGE_FLOAT16, STORAGE_UINT8,
                                      STORAGE_UINT16,  STORAGE_UINT24,  STORAGE_UINT24}; // in the order of Storage
    const auto index = static_cast<std::size_t>(storage);
    return index < std::size(defines) ? defines[index] : STORAGE_RGB8;
}

static_assert(static_cast<int>(Form::reciprocal) == FORM_RECIPROCAL &&
              static_cast<int>(Form::reciprocal_affine) == FORM_RECIPROCAL_AFFINE &&
              static_cast<int>(Form::affine) == FORM_AFFINE && static_cast<int>(Form::rational) == FORM_RATIONAL &&
              static_cast<int>(Form::exponential) == FORM_EXPONENTIAL &&
              static_cast<int>(Form::ray_distance) == FORM_RAY_DISTANCE &&
              static_cast<int>(Form::inverse_ray_distance) == FORM_INVERSE_RAY_DISTANCE);

/// Which bits of stored values are compared with those of a number. -0 is 0.
void set_number(const std::optional<std::uint32_t>& number, Storage storage, params::u32& bits, params::u32& mask) {
    const params::u32 sign = storage == Storage::float32 ? 0x80000000u : storage == Storage::float16 ? 0x8000u : 0;
    bits = number.value_or(1);
    mask = !number ? 0 : *number == 0 ? ~sign : ~0u;
}

float high(long double value) {
    return static_cast<float>(value);
}
float low(long double value) {
    return static_cast<float>(value - high(value));
}

// 1/z = s(v): count t from the end of the stored range where s is smallest, so that z = (1/|s'|) / (t + s(end)/|s'|)
// is a sum of positive terms. All of it is counted in units of 2^-32, so that the inverse of a denormal t is a float,
// unless the gain would then be none: such depths are infinite before t is denormal.
void set_reciprocal(params::depth_params& p, const DepthForm& form) {
    const long double slope = form.denominator[0];
    const float end = slope > 0 ? form.lowest : form.highest;
    const float unit = form.highest <= 0x1p95f && std::abs(slope) > 0x1p-95L ? 0x1p32f : 1.0f;
    const long double pole = unit * (slope * end + form.denominator[3]) / std::abs(slope);
    const long double gain = unit / std::abs(slope);
    p.sign = slope > 0 ? unit : -unit;
    p.end = unit * (slope > 0 ? -end : end);
    p.gain_high = high(gain);
    p.gain_low = low(gain);
    p.pole_high = high(pole);
    p.pole_low = low(pole);
}

bool depends_on_pixel(const Affine& row) {
    return row[1] != 0 || row[2] != 0;
}

// What a pixel holds, in a message: "3 bytes".
struct Elements {
    Element element;
    int count;

    friend std::ostream& operator<<(std::ostream& stream, const Elements& elements) {
        static constexpr const char* names[][2] = {{" byte", " bytes"},
                                                   {" 16-bit integer", " 16-bit integers"},
                                                   {" 32-bit integer", " 32-bit integers"},
                                                   {" half", " halves"},
                                                   {" float", " floats"}}; // in the order of Element
        return stream << elements.count << names[static_cast<std::size_t>(elements.element)][elements.count != 1];
    }
};

Elements elements_of(const Image& image) {
    return {image.element(), image.channels()};
}

} // namespace

long double unit_of_quotient(const DepthForm& form, const Affine& numerator, const Affine& denominator) {
    if (form.form != Form::rational)
        return 1;
    const auto exponent = [](const Affine& row) {
        long double largest = std::numeric_limits<long double>::min();
        for (const long double coefficient : row)
            largest = std::max(largest, std::abs(coefficient));
        return std::ilogb(largest);
    };
    return std::ldexp(1.0L, std::min(40 - exponent(denominator), 100 - exponent(numerator)));
}

params::wide pack_wide(long double value, Arithmetic arithmetic) {
    if (arithmetic == Arithmetic::fp64)
        return std::bit_cast<params::wide>(static_cast<double>(value));
    return params::wide{std::bit_cast<std::uint32_t>(low(value))} << 32 | std::bit_cast<std::uint32_t>(high(value));
}

void pack_row(params::wide (&target)[4], const Affine& row, long double unit, Arithmetic arithmetic) {
    for (std::size_t i = 0; i < 4; ++i)
        target[i] = pack_wide(row[i] * unit, arithmetic);
}

params::depth_params depth_parameters(const DepthForm& form, Storage storage, Background background,
                                      Arithmetic arithmetic) {
    params::depth_params p{};
    const bool inverse_ray = form.form == Form::inverse_ray_distance;
    // The inverse of the largest float is no denormal then.
    const long double unit = inverse_ray ? 0x1p24L : unit_of_quotient(form, form.numerator, form.denominator);
    pack_row(p.numerator, form.numerator, inverse_ray ? unit / params::inverse_ray_unit : unit, arithmetic);
    pack_row(p.denominator, form.denominator, unit, arithmetic);
    p.rate = pack_wide(form.rate, arithmetic);
    p.start = pack_wide(form.start, arithmetic);
    p.amplitude = pack_wide(form.amplitude, arithmetic);
    p.offset = pack_wide(form.offset, arithmetic);
    if (form.form == Form::reciprocal)
        set_reciprocal(p, form);
    p.lowest = form.lowest;
    p.highest = form.highest;
    p.least_depth = form.least_depth;
    p.background_depth = background == Background::nan ? std::numeric_limits<float>::quiet_NaN()
                                                       : std::numeric_limits<float>::infinity();
    const bool decode = background == Background::decode;
    set_number(decode ? std::nullopt : form.background, storage, p.background, p.background_mask);
    p.farther = form.farther;
    p.background_from =
        form.background_from && !decode ? *form.background_from : std::numeric_limits<float>::quiet_NaN();
    set_number(form.missing, storage, p.missing, p.missing_mask);
    p.has_special = form.missing || (form.background_from && !decode);
    p.code_shift = storage == Storage::uint24_high ? 8 : 0;
    const bool first_is_highest = storage == Storage::rgb8_red_high || storage == Storage::bgr8_red_low;
    p.byte_weights[0] = first_is_highest ? 1u << 16 : 1u;
    p.byte_weights[1] = 1u << 8;
    p.byte_weights[2] = first_is_highest ? 1u : 1u << 16;
    return p;
}

// A distance is up to the square root of three times one along a cube's axis.
InverseDepthError stored_error(const Camera& camera, Storage storage) {
    InverseDepthError error = inverse_depth_error(straightened(camera), storage);
    if (camera.lens && counted_along(camera) == Along::cube)
        error.quadratic *= std::numbers::sqrt3_v<float>;
    return error;
}

bool is_coarse(const Tile& tile) {
    const bool few_bits =
        tile.storage == Storage::uint8 || tile.storage == Storage::uint16 || tile.storage == Storage::float16;
    return few_bits || tile.camera.depth_bits.value_or(32) <= 16;
}

params::ray_params ray_parameters(const Rays& rays, Arithmetic arithmetic) {
    params::ray_params p{};
    const Rays::Matrix length = Eigen::HouseholderQR<Rays::Matrix>(rays.direction).matrixQR();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            p.origin[i][j] = pack_wide(rays.origin(i, j), arithmetic);
            p.direction[i][j] = pack_wide(rays.direction(i, j), arithmetic);
            p.length[i][j] = pack_wide(j < i ? 0 : length(i, j), arithmetic);
        }
        p.depth[i] = pack_wide(rays.depth(i), arithmetic);
    }
    p.centre_depth = pack_wide(rays.centre_depth, arithmetic);
    return p;
}

ImageSize size_of(const Image& image) {
    return {image.width(), image.height()};
}

void check_pixel(const char* name, ImageSize size, int x, int y) {
    require(x >= 0 && y >= 0 && x < size.width && y < size.height, name, " = (", x, ", ", y,
            ") lies outside the image of ", size);
}

void check_stored(const StoredDepth& stored) {
    const Image& image = stored.image;
    require(static_cast<bool>(image), "the stored depth has no image");
    const Elements taken{element_of(stored.storage), channels_of(stored.storage)};
    require(image.element() == taken.element && image.channels() == taken.count, "the stored depth holds ",
            elements_of(image), " a pixel; ", to_string(stored.storage), " takes ", taken);
    const Camera& camera = stored.camera;
    require(stored.x >= 0 && stored.y >= 0 && stored.x <= camera.width - image.width() &&
                stored.y <= camera.height - image.height(),
            "the image (", size_of(image), " at ", stored.x, ", ", stored.y, ") does not fit the camera's ",
            camera.width, " x ", camera.height, " pixels");
}

void check_device(const StoredDepth& stored, const NamedImage& other) {
    const Device &its = other.image.device(), &device = stored.image.device();
    require(its.context() == device.context(), other.name, " lies on another device than the stored depth");
    require(its.queue() == device.queue(), other.name,
            " belongs to another Device than the stored depth, with a queue of its own; open one Device for both");
}

void check_picture(const StoredDepth& stored, const NamedImage& picture, const char* cure) {
    const auto& [name, image] = picture;
    check_picture_of_any_size(stored, picture);
    require(image.width() == stored.image.width() && image.height() == stored.image.height(), name, " is ",
            size_of(image), " pixels, the depth ", size_of(stored.image), stored.camera.lens ? "" : cure);
}

void check_picture_of_any_size(const StoredDepth& stored, const NamedImage& picture) {
    const auto& [name, image] = picture;
    require(static_cast<bool>(image), name, " has no image");
    check_device(stored, picture);
    require(image.channels() == 3 || image.channels() == 4, name, " has ", image.channels(),
            " channels; it must have 3, or 4 with an alpha");
    require(image.element() != Element::u32, name, " must be floats, halves, or of 8 or 16 bits");
}

void check_result(const StoredDepth& stored, const NamedImage& result, Element element, const Layout& shape,
                  const std::vector<NamedImage>& others) {
    const auto& [name, image] = result;
    require(static_cast<bool>(image), name, " has no image to be written into");
    require(image.width() == shape.width && image.height() == shape.height, name, " is ", size_of(image),
            " pixels; it must be ", shape.width, " x ", shape.height);
    require(image.element() == element && image.channels() == shape.channels, name, " holds ", elements_of(image),
            " a pixel; it must hold ", Elements{element, shape.channels});
    check_device(stored, result);
    require(image.writable(), name, " is a buffer with CL_MEM_READ_ONLY, which kernels may not write");
    for (const NamedImage& other : others)
        require(!image.overlaps(other.image), name, " shares memory with ", other.name);
}

void check_results(const StoredDepth& stored, const std::vector<description::Result>& results,
                   std::vector<NamedImage> others) {
    others.push_back({"the stored depth", stored.image});
    for (const description::Result& result : results) {
        const NamedImage named{result.name, *result.image};
        require(result.wanted || !named.image, named.name,
                " has an image to be written into, but the options do not ask for it");
        if (!result.wanted)
            continue;
        check_result(stored, named, result.shape.element, result.shape.layout, others);
        others.push_back(named);
    }
}

void check_result(const StoredDepth& stored, const Image& result, int channels) {
    check_result(stored, {"the result", result}, Element::f32, {stored.image.width(), stored.image.height(), channels},
                 {{"the stored depth", stored.image}});
}

int element_define(Element element) {
    static constexpr int none = -1, defines[] = {ELEMENT_U8, ELEMENT_U16, none, ELEMENT_HALF, ELEMENT_FLOAT};
    return defines[static_cast<std::size_t>(element)];
}

params::grid_params grid_parameters(const Image& source, const Image& result, int begin, int end, int x, int y) {
    return {source.offset(),
            result.offset(),
            to_u32(source.row_stride()),
            to_u32(result.row_stride()),
            to_u32(begin),
            to_u32(end),
            to_u32(source.height()),
            to_u32(x),
            to_u32(y),
            0};
}

params::place_params place_parameters(const Image& image) {
    return {.offset = image.offset(), .stride = to_u32(image.row_stride()), .reserved = 0};
}

int vector_width_for(const Device& device, int columns) {
    int vector_width = device.options().vector_width;
    while (vector_width > columns)
        vector_width = vector_width == 4 ? 1 : vector_width / 2;
    return vector_width;
}

bool worth_streaming(const Image& result, int vector_width) {
    const std::size_t size =
        static_cast<std::size_t>(result.height()) * result.row_stride() * element_bytes(result.element());
    return vector_width > 1 && result.width() % vector_width == 0 && size >= streaming_bytes &&
           result.aligned_to(static_cast<std::size_t>(vector_width) * element_bytes(result.element()));
}

runtime::Defines decoder_defines(const DepthForm& form, const Rays& rays, Storage storage, int vector_width,
                                 bool stream) {
    return {{"V", vector_width},
            {"STREAM", stream},
            {"FORM", static_cast<int>(form.form)},
            {"STORAGE", storage_define(storage)},
            {"PIXEL_TERMS", depends_on_pixel(form.numerator) || depends_on_pixel(form.denominator)},
            {"W_IS_DEPTH", rays.w_is_depth}};
}

} // namespace fathom
