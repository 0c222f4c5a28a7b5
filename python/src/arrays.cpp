// Arrays of Python as images of a device, and back, without a copy where the device can read and write the array's memory.
#include "arrays.hpp"

#include "description/range.hpp"
#include "runtime/memory.hpp"
#include "unlocked.hpp"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <new>
#include <stdexcept>

namespace fathom::python {

std::string text_of(const nb::str& text) {
    Py_ssize_t size = 0;
    if (const char* utf8 = PyUnicode_AsUTF8AndSize(text.ptr(), &size))
        return {utf8, static_cast<std::size_t>(size)};
    PyErr_Clear();
    const auto escaped = nb::steal<nb::bytes>(PyUnicode_AsEncodedString(text.ptr(), "utf-8", "backslashreplace"));
    return {escaped.c_str(), escaped.size()};
}

void refuse(const char* argument, const std::string& what) {
    throw std::invalid_argument(std::string(argument) + ": " + what);
}

namespace {

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
    static const PyObject* const arrays = nb::object(nb::module_::import_("numpy").attr("ndarray")).release().ptr();
    const bool plain = object.type().ptr() == arrays; // most are, and have no mask
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

nb::object numpy(const char* function) {
    return nb::module_::import_("numpy").attr(function);
}

// An array of NumPy that is this memory, and one of whatever NumPy made.
nb::object as_numpy(const ReadArray& array) {
    return nb::cast(nb::ndarray<nb::numpy, nb::ro>(array));
}

HostImage host_image_of(ReadArray array, Holds holds, const char* argument) {
    Strided s = strided(array, argument);
    bool is_copy = false;
    const bool is_depth = holds == Holds::depth || holds == Holds::relative;
    if (is_depth && array.dtype() == nb::dtype<std::int16_t>()) { // codes, or floats where some are below 0
        const nb::object codes = numpy("ascontiguousarray")(as_numpy(array));
        const bool has_negative = nb::cast<int>(nb::object(codes.attr("min")())) < 0;
        array = nb::cast<ReadArray>(has_negative ? codes.attr("astype")("float32") : codes.attr("view")("uint16"));
        is_copy = true;
    }
    const Element element = checked_element(array.dtype(), holds, argument);
    if (!is_copy && !s.tight_columns) {
        array = nb::cast<ReadArray>(numpy("ascontiguousarray")(as_numpy(array)));
        is_copy = true;
    }
    if (is_copy)
        s.layout.row_stride = 0;
    return {std::make_shared<HeldArray>(HeldArray{array}), element, s.layout, is_copy};
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
    return {held->array.data(), layout.width, layout.height, row * element_bytes(element), storage};
}

HostImage host_image(nb::handle object, Holds holds, const char* argument) {
    return host_image_of(read_array(object, holds, argument).array, holds, argument);
}

Image image_of(const HostImage& host, const Device& device) {
    const Unlocked released;
    return Image::from_host(device, host.element, host.held->array.data(), host.layout);
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

std::optional<Storage> storage_named(nb::handle name) {
    if (!name.is_valid() || name.is_none())
        return std::nullopt;
    const auto known = std::ranges::find_if(storage_names, [&](const char* each) {
        return PyUnicode_Check(name.ptr()) && PyUnicode_CompareWithASCIIString(name.ptr(), each) == 0;
    });
    if (known == storage_names.end())
        throw std::invalid_argument("storage = " + text_of(nb::repr(name)) + " is unknown; it is " +
                                    description::in_words(storage_names));
    return static_cast<Storage>(known - storage_names.begin());
}

Storage storage_of(Element element, int channels, nb::handle said, const std::optional<Packing>& packing,
                   const char* argument) {
    const auto fits = [&](Storage storage) {
        return fathom::element_of(storage) == element && channels_of(storage) == channels;
    };
    const std::string holds = std::string("it holds ") + name_of(element) +
                              (channels == 1 ? "" : " in " + std::to_string(channels) + " channels");
    if (const auto storage = storage_named(said)) {
        if (!fits(*storage))
            refuse(argument, holds + ", which the storage " + text_of(nb::repr(said)) + " does not");
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

nb::tuple shape_of(const Layout& layout) {
    return layout.channels == 1 ? nb::make_tuple(layout.height, layout.width)
                                : nb::make_tuple(layout.height, layout.width, layout.channels);
}

DeviceImage to_device(nb::handle given, const Device& device) {
    if (is_image(given))
        return nb::cast<DeviceImage>(given);
    const Native native = read_array(given, Holds::depth, "array");
    const HostImage host = host_image_of(native.array, Holds::depth, "array");
    Image image = image_of(host, device);
    host.held->device = device;
    host.held->waits = true;
    const char* no_target = nullptr;
    if (WriteArray writable; native.converted || host.is_copy || !is_aligned(native.array))
        no_target =
            "the Image is a copy of its array: rows lie one after the other in memory of this byte order, aligned to "
            "their elements, where a result may go";
    else if (!takes(given, writable, "array"))
        no_target = "the Image is of a read-only array";
    return {image, host.held, no_target, device.info().cpu ? host.depth(Storage::float32) : HostDepth{}};
}

nb::object to_numpy(const Image& image) {
    nb::object array = new_array(image.element(), {image.width(), image.height(), image.channels()});
    void* data = nb::cast<WriteArray>(array).data();
    const Unlocked released;
    image.download(data);
    return array;
}

nb::object on_host(nb::handle object) {
    return is_image(object) ? to_numpy(nb::cast<const DeviceImage&>(object).image) : nb::borrow(object);
}

std::pair<Floats, int> floats_of(nb::handle pixels, Holds holds, const char* argument) {
    const HostImage host = host_image(on_host(pixels), holds, argument);
    const nb::object floats = numpy("array")(as_numpy(host.held->array), "float32", nb::arg("order") = "C");
    const std::size_t bytes = element_bytes(host.element);
    return {nb::cast<Floats>(floats), host.element == Element::f16 ? 32 : static_cast<int>(8 * bytes)};
}

HostFloats on_host(const Floats& floats) {
    return {floats.data(), static_cast<int>(floats.shape(1)), static_cast<int>(floats.shape(0)),
            floats.ndim() == 3 ? static_cast<int>(floats.shape(2)) : 1};
}

} // namespace fathom::python
