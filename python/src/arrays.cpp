// Arrays of Python as images of a device, and back, without a copy where the device can read and write the array's memory.
#include "arrays.hpp"

#include "runtime/memory.hpp"
#include "unlocked.hpp"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <new>
#include <span>
#include <stdexcept>

namespace fathom::python {

void refuse(const char* argument, const std::string& what) {
    throw std::invalid_argument(std::string(argument) + ": " + what);
}

namespace {

using ReadArray = nb::ndarray<nb::ro>;
using WriteArray = nb::ndarray<>;

struct Type {
    Element element;
    const char* name;
    nb::dlpack::dtype dtype;
};

// In the order of Element.
const std::array<Type, 5> types{
    {{Element::u8, "uint8", nb::dtype<std::uint8_t>()},
     {Element::u16, "uint16", nb::dtype<std::uint16_t>()},
     {Element::u32, "uint32", nb::dtype<std::uint32_t>()},
     {Element::f16, "float16", {static_cast<std::uint8_t>(nb::dlpack::dtype_code::Float), 16, 1}},
     {Element::f32, "float32", nb::dtype<float>()}}};

const Type& type_of(Element element) {
    return types[static_cast<std::size_t>(element)];
}

std::string type_name(nb::dlpack::dtype dtype) {
    constexpr std::array<const char*, 7> codes{"int", "uint", "float", "handle", "bfloat", "complex", "bool"};
    const std::string name = dtype.code < codes.size() ? codes[dtype.code] : "type";
    return name == "bool" ? name : name + std::to_string(dtype.bits);
}

std::string shape_text(const std::vector<std::size_t>& shape) {
    std::string text;
    for (const std::size_t n : shape)
        text += (text.empty() ? "" : ", ") + std::to_string(n);
    return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

template <typename Array>
std::vector<std::size_t> sides_of(const Array& array) {
    std::vector<std::size_t> shape;
    for (std::size_t i = 0; i < array.ndim(); ++i)
        shape.push_back(array.shape(i));
    return shape;
}

std::string device_name(int type) {
    for (const auto& [known, name] : {std::pair(nb::device::cuda::value, "cuda"),
                                      {nb::device::opencl::value, "opencl"},
                                      {nb::device::vulkan::value, "vulkan"},
                                      {nb::device::metal::value, "metal"},
                                      {nb::device::rocm::value, "rocm"}})
        if (type == known)
            return name;
    return "DLPack type " + std::to_string(type);
}

// Refuses what lies in another memory than the CPU's before it is asked for, and what is not said by the memory alone.
void check_kind(nb::handle object, const char* argument) {
    const bool plain =
        std::string_view(nb::type_name(object.type()).c_str()) == "numpy.ndarray"; // most are, and have no mask
    if (!plain && nb::hasattr(object, "mask") && nb::hasattr(object, "filled"))
        refuse(argument,
               "a masked array's mask would be lost; make invalid pixels of it by .filled(numpy.nan), of integers by "
               ".filled(CODE) with the camera's missing=CODE");
    if (!PyObject_CheckBuffer(object.ptr()) && nb::ndarray_check(object) && nb::hasattr(object, "__dlpack_device__")) {
        const int type = nb::cast<int>(nb::object(object.attr("__dlpack_device__")()[0]));
        if (type != nb::device::cpu::value && type != nb::device::cuda_host::value)
            refuse(argument, "lies on the device " + device_name(type) + "; copy it to the CPU, as with .cpu()");
    }
}

// What DLPack gives. An interrupt passes through.
nb::object capsule_of(nb::handle object, const char* argument) {
    const nb::object dlpack = object.attr("__dlpack__");
    try {
        try {
            return dlpack(nb::arg("max_version") = nb::make_tuple(1, 0)); // which says whether it may be written
        } catch (nb::python_error& error) {
            if (!error.matches(PyExc_TypeError))
                throw;
            return dlpack();
        }
    } catch (nb::python_error& error) {
        if (!error.matches(PyExc_Exception))
            throw;
        refuse(argument, "does not give its memory: " + text_of(nb::str(error.value())));
    }
}

// Is this an array of that kind, ReadArray or WriteArray?
template <typename Array>
bool takes(nb::handle object, Array& array, const char* argument) {
    if (PyObject_CheckBuffer(object.ptr()) || !nb::hasattr(object, "__dlpack__"))
        return nb::try_cast(object, array);
    return nb::try_cast(capsule_of(object, argument), array); // nanobind would hide what is raised
}

// The dtypes of what an argument is for.
const char* dtypes_of(Holds holds) {
    return holds == Holds::numbers ? "float32"
           : holds == Holds::depth ? "float32, float16, uint32, uint16 or uint8"
                                   : "float32, float16, uint16 or uint8";
}

[[noreturn]] void refuse_object(nb::handle object, const char* argument, const char* dtypes) {
    if (nb::hasattr(object, "dtype"))
        refuse(argument, "its dtype is " + text_of(nb::str(nb::object(object.attr("dtype")))) +
                             ", which cannot be used as it lies; it must be " + dtypes +
                             " of this machine's byte order");
    refuse(argument, text_of(nb::type_name(object.type())) +
                         " is no array; it must have the buffer protocol or DLPack, as NumPy's arrays have");
}

struct Native {
    ReadArray array;
    bool converted = false; // to this machine's byte order, which takes a copy
};

// Anything that holds numbers, of any byte order and with gaps of any width.
Native read_array(nb::handle object, Holds holds, const char* argument) {
    check_kind(object, argument);
    ReadArray array;
    if (takes(object, array, argument))
        return {array};
    if (!nb::hasattr(object, "__array_interface__"))
        refuse_object(object, argument, dtypes_of(holds));
    const nb::object numpy = nb::module_::import_("numpy");
    const nb::object plain = numpy.attr("asarray")(object);
    const nb::object native = plain.attr("astype")(plain.attr("dtype").attr("newbyteorder")("="));
    if (!nb::try_cast(native, array))
        refuse(argument, "its dtype is " + text_of(nb::str(nb::object(plain.attr("dtype")))) + "; it must be " +
                             dtypes_of(holds));
    return {array, true};
}

Element checked_element(nb::dlpack::dtype dtype, Holds holds, const char* argument) {
    const bool numbers = holds == Holds::numbers;
    for (const Type& type : types)
        if (type.dtype == dtype && !(numbers && type.element != Element::f32) &&
            !(holds != Holds::depth && type.element == Element::u32))
            return type.element;
    const auto is = [&](nb::dlpack::dtype_code code) { return dtype.code == static_cast<std::uint8_t>(code); };
    using nb::dlpack::dtype_code;
    std::string cure;
    if (is(dtype_code::Bool))
        cure = "; that is a mask";
    else if (is(dtype_code::Float) || (numbers && (is(dtype_code::Int) || is(dtype_code::UInt))))
        cure = ", as .astype(numpy.float32) makes it";
    else if (is(dtype_code::Int) || is(dtype_code::UInt))
        cure = ", as .astype(numpy.uint16) makes it of numbers from 0 to 65535";
    refuse(argument, "its dtype is " + type_name(dtype) + "; it must be " + dtypes_of(holds) + cure);
}

// What an array's strides say, in elements; `tight_columns` is false for columns or channels with gaps or backwards, and for
// rows that go backwards, overlap or repeat.
struct Strided {
    Layout layout;
    std::ptrdiff_t row, column, channel;
    bool tight_columns;
};

template <typename Array>
Strided strided(const Array& array, const char* argument) {
    if (array.ndim() != 2 && array.ndim() != 3)
        refuse(argument, "its shape is " + shape_text(sides_of(array)) +
                             "; it must be (height, width) or (height, width, channels)");
    constexpr std::size_t most = 1u << 30;
    for (std::size_t i = 0; i < array.ndim(); ++i)
        if (array.shape(i) == 0 || array.shape(i) > most)
            refuse(argument,
                   "its shape is " + shape_text(sides_of(array)) + "; a side may be 1 to " + std::to_string(most));
    Strided s{};
    s.layout.height = static_cast<int>(array.shape(0));
    s.layout.width = static_cast<int>(array.shape(1));
    s.layout.channels = array.ndim() == 3 ? static_cast<int>(array.shape(2)) : 1;
    const std::ptrdiff_t columns = s.layout.width, channels = s.layout.channels;
    s.row = array.stride(0);
    s.column = array.stride(1);
    s.channel = array.ndim() == 3 ? array.stride(2) : 1;
    if (s.layout.height == 1)
        s.row = columns * channels;
    s.tight_columns =
        (channels == 1 || s.channel == 1) && (columns == 1 || s.column == channels) && s.row >= columns * channels;
    s.layout.row_stride = static_cast<std::size_t>(s.row);
    return s;
}

// An array without gaps.
std::shared_ptr<std::byte[]> compacted(const void* data, const Strided& from, std::size_t size) {
    const auto& [width, height, channels, row_stride] = from.layout;
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const std::shared_ptr<std::byte[]> copy(new std::byte[pixels * static_cast<std::size_t>(channels) * size]);
    std::byte* to = copy.get();
    const auto copy_all = [&]<std::size_t Size>(std::integral_constant<std::size_t, Size>) {
        const auto* bytes = static_cast<const std::byte*>(data);
        constexpr auto step = static_cast<std::ptrdiff_t>(Size);
        for (std::ptrdiff_t y = 0; y < height; ++y)
            for (std::ptrdiff_t x = 0; x < width; ++x)
                for (std::ptrdiff_t c = 0; c < channels; ++c, to += Size)
                    std::memcpy(to, bytes + (y * from.row + x * from.column + c * from.channel) * step, Size);
    };
    const Unlocked released;
    switch (size) {
    case 1:
        copy_all(std::integral_constant<std::size_t, 1>{});
        break;
    case 2:
        copy_all(std::integral_constant<std::size_t, 2>{});
        break;
    default:
        copy_all(std::integral_constant<std::size_t, 4>{});
    }
    return copy;
}

// Depth of signed 16 bits: codes, or floats where some are below 0.
HostImage image_of_shorts(const ReadArray& array, const char* argument) {
    Strided s = strided(array, argument);
    auto held = std::make_shared<HeldArray>(HeldArray{array});
    held->copy = compacted(array.data(), s, sizeof(std::int16_t));
    s.layout.row_stride = 0;
    const std::span codes(reinterpret_cast<const std::int16_t*>(held->copy.get()),
                          static_cast<std::size_t>(s.layout.width) * static_cast<std::size_t>(s.layout.height) *
                              static_cast<std::size_t>(s.layout.channels));
    if (std::ranges::none_of(codes, [](std::int16_t code) { return code < 0; }))
        return {held, Element::u16, s.layout, held->copy.get()};
    const std::shared_ptr<std::byte[]> floats(new std::byte[codes.size() * sizeof(float)]);
    std::ranges::copy(codes, reinterpret_cast<float*>(floats.get()));
    held->copy = floats;
    return {held, Element::f32, s.layout, floats.get()};
}

HostImage host_image_of(const ReadArray& array, Holds holds, const char* argument) {
    if ((holds == Holds::depth || holds == Holds::relative) && array.dtype() == nb::dtype<std::int16_t>())
        return image_of_shorts(array, argument);
    const Element element = checked_element(array.dtype(), holds, argument);
    Strided s = strided(array, argument);
    auto held = std::make_shared<HeldArray>(HeldArray{array});
    const void* data = array.data();
    if (!s.tight_columns) {
        held->copy = compacted(data, s, element_bytes(element));
        data = held->copy.get();
        s.layout.row_stride = 0;
    }
    return {held, element, s.layout, data};
}

// Kernels read and write elements at multiples of their size.
bool is_aligned(const ReadArray& array) {
    return reinterpret_cast<std::uintptr_t>(array.data()) % array.itemsize() == 0;
}

} // namespace

HeldArray::~HeldArray() {
    if (!waits)
        return;
    try {
        const Unlocked released;
        device.finish();
    } catch (const std::exception&) { // whoever uses the results is told
    }
}

HostDepth HostImage::depth(Storage storage) const {
    const std::size_t row = layout.row_stride > 0
                                ? layout.row_stride
                                : static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.channels);
    return {data, layout.width, layout.height, row * element_bytes(element), storage};
}

HostImage host_image(nb::handle object, Holds holds, const char* argument) {
    return host_image_of(read_array(object, holds, argument).array, holds, argument);
}

Image image_of(const HostImage& host, const Device& device) {
    const Unlocked released;
    return Image::from_host(device, host.element, host.data, host.layout);
}

// Kernels write fastest where rows begin at multiples of 64 bytes.
nb::object new_array(Element element, const Layout& layout) {
    const auto side = [](int n) { return static_cast<std::size_t>(n); };
    const std::size_t bytes = side(layout.width) * side(layout.height) * side(layout.channels) * element_bytes(element);
    void* data = runtime::allocate(bytes);
    if (!data)
        throw std::bad_alloc();
    const nb::capsule owner(data, [](void* memory) noexcept { runtime::give_back(memory); });
    const std::array<std::size_t, 3> shape{side(layout.height), side(layout.width), side(layout.channels)};
    return nb::cast(nb::ndarray<nb::numpy>(data, layout.channels == 1 ? 2 : 3, shape.data(), owner, nullptr,
                                           type_of(element).dtype),
                    nb::rv_policy::reference);
}

Storage storage_of(Element element, int channels, const Word<Storage>& said, const std::optional<Packing>& packing,
                   const char* argument) {
    const auto fits = [&](Storage storage) {
        return fathom::element_of(storage) == element && channels_of(storage) == channels;
    };
    const std::string holds = std::string("it holds ") + name_of(element) +
                              (channels == 1 ? "" : " in " + std::to_string(channels) + " channels");
    if (const auto storage = said.get("storage")) {
        if (!fits(*storage))
            refuse(argument, holds + ", which the storage " + text_of(nb::repr(said.given)) + " does not");
        return *storage;
    }
    if (packing == Packing::uint16_rotated)
        refuse(argument,
               "the camera's packing is \"uint16-rotated\", which is that of files; give (codes >> 3) | (codes << 13) "
               "as depth, and storage='uint16'");
    struct Rule {
        Storage storage;
        std::optional<Packing> packing; // that has to say so
    };
    for (const Rule& rule : {Rule{Storage::float32, {}},
                             {Storage::float16, {}},
                             {Storage::uint16, {}},
                             {Storage::uint24_high, Packing::uint24_high},
                             {Storage::uint24, {}},
                             {Storage::uint8, Packing::uint8},
                             {Storage::rgb8_red_low, Packing::rgb_red_low},
                             {Storage::rgb8_red_high, Packing::rgb_red_high}})
        if (fits(rule.storage) && (!rule.packing || packing == rule.packing))
            return rule.storage;
    if (element == Element::u8 && (channels == 1 || channels == 3))
        refuse(argument, holds + ", which may be a picture; say how depth is packed by storage=" +
                             (channels == 1 ? "'uint8'"
                                            : "'rgb8-red-low', 'rgb8-red-high' or, as OpenCV reads "
                                              "files, 'bgr8-red-low', 'bgr8-red-high'") +
                             ", or by the camera's packing");
    refuse(argument,
           holds + "; depth has one channel, or three of uint8" +
               (element == Element::u8 && channels == 4 ? ", as array[..., :3] makes it of a picture with alpha" : ""));
}

bool is_image(nb::handle object) {
    return nb::isinstance<DeviceImage>(object);
}

std::pair<void*, Layout> memory_of(nb::handle object, const char* argument, Element element, const Layout& layout) {
    check_kind(object, argument);
    WriteArray array;
    if (!takes(object, array, argument)) {
        if (ReadArray read_only; takes(object, read_only, argument))
            refuse(argument, "is read-only, or of a dtype that is no " + std::string(name_of(element)));
        refuse_object(object, argument, name_of(element));
    }
    std::vector<std::size_t> shape{static_cast<std::size_t>(layout.height), static_cast<std::size_t>(layout.width)};
    if (layout.channels > 1)
        shape.push_back(static_cast<std::size_t>(layout.channels));
    if (array.dtype() != type_of(element).dtype)
        refuse(argument, "its dtype is " + type_name(array.dtype()) + "; it must be " + name_of(element));
    if (sides_of(array) != shape)
        refuse(argument, "its shape is " + shape_text(sides_of(array)) + "; it must be " + shape_text(shape));
    const Strided s = strided(array, argument);
    if (!s.tight_columns)
        refuse(argument, "has gaps between its columns or channels, or rows that go backwards; only gaps between rows "
                         "will do");
    return {array.data(), s.layout};
}

const char* name_of(Element element) {
    return type_of(element).name;
}

Element element_of_name(const std::string& dtype) {
    for (const Type& type : types)
        if (dtype == type.name)
            return type.element;
    refuse("dtype", dtype + " is unknown; it is float32, float16, uint32, uint16 or uint8");
}

nb::tuple shape_of(const Image& image) {
    if (image.channels() == 1)
        return nb::make_tuple(image.height(), image.width());
    return nb::make_tuple(image.height(), image.width(), image.channels());
}

DeviceImage to_device(const Pixels& array, const Device& device) {
    if (is_image(array.given))
        return nb::cast<DeviceImage>(array.given);
    const Native given = read_array(array.given, Holds::depth, "array");
    const HostImage host = host_image_of(given.array, Holds::depth, "array");
    const std::shared_ptr<HeldArray>& held = host.held;
    Image image = image_of(host, device);
    held->device = device;
    held->waits = true;
    const char* no_target = nullptr;
    if (WriteArray writable; given.converted || held->copy || !is_aligned(given.array))
        no_target =
            "the Image is a copy of its array: rows lie one after the other in memory of this byte order, aligned to "
            "their elements, where a result may go";
    else if (!takes(array.given, writable, "array"))
        no_target = "the Image is of a read-only array";
    return {image, held, no_target, device.info().cpu ? host.depth(Storage::float32) : HostDepth{}};
}

nb::object to_numpy(const Image& image) {
    nb::object array = new_array(image.element(), {image.width(), image.height(), image.channels()});
    void* data = nb::cast<WriteArray>(array).data();
    const Unlocked released;
    image.download(data);
    return array;
}

HeldDepth host_depth(const Pixels& pixels, const CameraObject& camera, const Word<Storage>& storage,
                     const char* argument) {
    const nb::object array =
        is_image(pixels.given) ? to_numpy(nb::cast<const DeviceImage&>(pixels.given).image) : pixels.given;
    const HostImage host = host_image(array, Holds::depth, argument);
    return {host.depth(storage_of(host.element, host.layout.channels, storage, camera.file().packing, argument)),
            host.held};
}

std::pair<std::vector<float>, Layout> floats_of(const Pixels& pixels, const char* argument) {
    nb::object array = pixels.given;
    if (is_image(array)) {
        const Image& given = nb::cast<const DeviceImage&>(array).image;
        if (given.element() != Element::f32)
            refuse(argument, std::string("holds ") + name_of(given.element()) + "; it must hold float32");
        array = to_numpy(given);
    }
    const ReadArray read = read_array(array, Holds::numbers, argument).array;
    checked_element(read.dtype(), Holds::numbers, argument);
    Strided s = strided(read, argument);
    const std::shared_ptr<std::byte[]> copy = compacted(read.data(), s, sizeof(float));
    s.layout.row_stride = 0;
    const auto count = static_cast<std::size_t>(s.layout.width) * static_cast<std::size_t>(s.layout.height) *
                       static_cast<std::size_t>(s.layout.channels);
    std::vector<float> floats(count);
    std::memcpy(floats.data(), copy.get(), count * sizeof(float));
    return {std::move(floats), s.layout};
}

Numbers numbers_of(const Pixels& pixels, Holds holds, const char* argument) {
    const nb::object array =
        is_image(pixels.given) ? to_numpy(nb::cast<const DeviceImage&>(pixels.given).image) : pixels.given;
    const HostImage host = host_image(array, holds, argument);
    const auto [width, height, channels, stride] = host.layout;
    const auto in_row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    Numbers made{{}, {width, height, channels}, static_cast<int>(8 * element_bytes(host.element))};
    made.bits = host.element == Element::f16 ? 32 : made.bits;
    made.values.resize(in_row * static_cast<std::size_t>(height));
    const auto take = [&]<typename T>(T) {
        for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
            const auto* row = static_cast<const std::byte*>(host.data) + y * (stride > 0 ? stride : in_row) * sizeof(T);
            for (std::size_t i = 0; i < in_row; ++i) {
                T element;
                std::memcpy(&element, row + i * sizeof(T), sizeof(T)); // which may be unaligned
                made.values[y * in_row + i] = static_cast<float>(element);
            }
        }
    };
    const Unlocked released;
    switch (host.element) {
    case Element::u8:
        take(std::uint8_t{});
        break;
    case Element::u16:
        take(std::uint16_t{});
        break;
    case Element::f16:
        take(Eigen::half{});
        break;
    case Element::f32:
        take(float{});
        break;
    case Element::u32: // which neither has
        break;
    }
    return made;
}

nb::object new_floats(const Layout& layout, float*& data) {
    nb::object array = new_array(Element::f32, layout);
    data = static_cast<float*>(nb::cast<WriteArray>(array).data());
    return array;
}

} // namespace fathom::python
