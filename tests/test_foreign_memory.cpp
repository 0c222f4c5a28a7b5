// Images in memory that others laid out: any offset and row stride, sub-buffers, host memory, and queues of either
// kind.
// Depth is decoded to the bits that it gives in images of its own, and nothing is written beside them.
#include "own_context.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

using Bytes = std::vector<unsigned char>;
using Buffer = std::shared_ptr<_cl_mem>;

constexpr unsigned char guard = 0xff; // floats and halves of such bytes are NaN

const Device& cpu() {
    static const Device opened = test_device();
    return opened;
}

/// A program's own context, with a queue of either kind.
struct Context {
    OwnContext own{cpu().id()};
    Device in_order = own.device(), any_order = own.out_of_order();

    Buffer buffer(std::size_t size, const void* content = nullptr) const {
        const cl_mem_flags flags = CL_MEM_READ_WRITE | (content ? CL_MEM_COPY_HOST_PTR : 0);
        cl_mem made = clCreateBuffer(own.get(), flags, size, const_cast<void*>(content), nullptr);
        REQUIRE(made != nullptr);
        return {made, clReleaseMemObject};
    }
};

/// What may hold an image.
enum class Holder { buffer, sub_buffer, host_memory };

/// Where an image lies in it.
struct Placement {
    const char* name;
    Holder holder;
    std::size_t offset, padding; ///< elements before the image, and between its rows
};

const std::vector<Placement> placements{
    {"tight rows", Holder::buffer, 0, 0},
    {"tight rows from an odd element on", Holder::buffer, 13, 0},
    {"odd gaps between rows", Holder::buffer, 0, 5},
    {"odd gaps and an odd offset", Holder::buffer, 129, 7},
    {"a sub-buffer", Holder::sub_buffer, 0, 0},
    {"a sub-buffer with an odd offset and gaps", Holder::sub_buffer, 3, 11},
    {"host memory with an odd offset and gaps", Holder::host_memory, 1, 3},
};

/// What an image holds.
struct Shape {
    Element element;
    int width, height, channels;

    std::size_t row() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels); }
    std::size_t each() const { return element_bytes(element); }
};

/// An image in foreign memory that is full of guards elsewhere.
class Foreign {
public:
    Foreign(const Context& context, const Device& device, const Placement& placement, const Shape& shape,
            const Bytes& content = {})
        : placement_(placement), shape_(shape) {
        const std::size_t stride = shape.row() + placement.padding, rows = static_cast<std::size_t>(shape.height);
        start_ = placement.holder == Holder::sub_buffer ? 3 * origin_step() : 0;
        const std::size_t size =
            (placement.offset + (rows - 1) * stride + shape.row()) * shape.each(); // not one byte more
        bytes_.assign(start_ + size + (placement.holder == Holder::sub_buffer ? origin_step() : 0), guard);
        for (std::size_t y = 0; y < rows && !content.empty(); ++y)
            std::memcpy(bytes_.data() + first_of(y), content.data() + y * shape.row() * shape.each(),
                        shape.row() * shape.each());
        if (placement.holder == Holder::host_memory) {
            cl_mem made = clCreateBuffer(context.own.get(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size,
                                         bytes_.data(), nullptr);
            whole_ = {made, clReleaseMemObject};
        } else {
            whole_ = context.buffer(bytes_.size(), bytes_.data());
        }
        Buffer held = whole_;
        if (placement.holder == Holder::sub_buffer) {
            const cl_buffer_region region{start_, size};
            cl_mem part =
                clCreateSubBuffer(whole_.get(), CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region, nullptr);
            REQUIRE(part != nullptr);
            held = {part, clReleaseMemObject};
        }
        image = Image(device, held.get(), shape.element, {shape.width, shape.height, shape.channels, stride},
                      placement.offset);
    }

    /// The image's rows, one after the other, once everything has ended.
    Bytes content() {
        fetch();
        Bytes packed;
        for (std::size_t y = 0; y < static_cast<std::size_t>(shape_.height); ++y) {
            const auto row = bytes_.begin() + static_cast<std::ptrdiff_t>(first_of(y));
            packed.insert(packed.end(), row, row + static_cast<std::ptrdiff_t>(shape_.row() * shape_.each()));
        }
        return packed;
    }

    /// After `content`: is everything beside the image as it was?
    bool guards_hold() const {
        Bytes rest = bytes_;
        for (std::size_t y = 0; y < static_cast<std::size_t>(shape_.height); ++y)
            std::memset(rest.data() + first_of(y), guard, shape_.row() * shape_.each());
        return std::ranges::all_of(rest, [](unsigned char each) { return each == guard; });
    }

    Image image;

private:
    static std::size_t origin_step() {
        cl_uint bits = 0;
        clGetDeviceInfo(cpu().id(), CL_DEVICE_MEM_BASE_ADDR_ALIGN, sizeof(bits), &bits, nullptr);
        return std::max<std::size_t>(bits / 8, 4);
    }
    std::size_t first_of(std::size_t y) const {
        return start_ + (placement_.offset + y * (shape_.row() + placement_.padding)) * shape_.each();
    }
    void fetch() {
        const Device& device = image.device();
        device.finish();
        REQUIRE(clEnqueueReadBuffer(device.queue(), whole_.get(), CL_TRUE, 0, bytes_.size(), bytes_.data(), 0, nullptr,
                                    nullptr) == CL_SUCCESS);
    }

    Placement placement_;
    Shape shape_;
    std::size_t start_ = 0; // bytes
    Bytes bytes_;
    Buffer whole_;
};

Bytes downloaded(const Image& image) {
    const std::size_t row = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.channels());
    Bytes bytes(row * static_cast<std::size_t>(image.height()) * element_bytes(image.element()));
    image.download(bytes.data());
    return bytes;
}

Camera camera(int width, int height) {
    return {.projection = perspective(1.0, 1.0 * width / height, {0.5, 100}), .width = width, .height = height};
}

/// Stored depth, as tight rows.
struct Content {
    Camera seen;
    Storage storage;
    Shape shape;
    Bytes values;

    Content(int width, int height, Storage storage_)
        : seen(camera(width, height)),
          storage(storage_), shape{element_of(storage), width, height, channels_of(storage)},
          values(shape.row() * static_cast<std::size_t>(height) * shape.each()) {
        std::mt19937 random(7);
        std::uniform_real_distribution<float> level(0.5f, 0.95f);
        for (std::size_t i = 0; shape.element == Element::f32 && i < values.size(); i += sizeof(float)) {
            const float value = level(random);
            std::memcpy(&values[i], &value, sizeof(float));
        }
        if (shape.element != Element::f32) // 24 bits of 32 lie in the low bytes
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] = shape.element == Element::u32 && i % 4 == 3 ? 0 : static_cast<unsigned char>(random());
    }

    StoredDepth plain() const {
        return {Image::from_host(cpu(), shape.element, values.data(), {shape.width, shape.height, shape.channels}),
                seen, storage};
    }
    Bytes linearized() const { return downloaded(linearize(plain()).image); }
};

/// Depth in every place, in queues of either kind. That other operations keep to strides and offsets, too, stands in
/// test_contract.cpp.
void check_everywhere(const Content& content) {
    const Context context;
    const Bytes expected = content.linearized();
    for (const Device& device : {context.in_order, context.any_order})
        for (const Placement& placement : placements) {
            INFO(placement.name << (device.queue() == context.any_order.queue() ? ", out of order" : ", in order"));
            Foreign depth(context, device, placement, content.shape, content.values);
            Foreign result(context, device, placement, {Element::f32, content.shape.width, content.shape.height, 1});
            linearize({depth.image, content.seen, content.storage}, result.image);
            CHECK(result.content() == expected);
            CHECK(result.guards_hold());
            CHECK(depth.content() == content.values);
            CHECK(depth.guards_hold());
        }
}

} // namespace

TEST_CASE("foreign memory: every storage is read wherever it lies", "[foreign-memory]") {
    for (const Storage storage : {Storage::float32, Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24,
                                  Storage::uint24_high, Storage::rgb8_red_low}) {
        INFO(to_string(storage));
        check_everywhere({53, 9, storage});
    }
}

TEST_CASE("foreign memory: an image is refused that does not fit its buffer", "[foreign-memory]") {
    const Context context;
    const Device device = context.in_order;
    const Buffer buffer = context.buffer(848 * 480 * 2);
    const Layout frame{848, 480, 1, 848};
    CHECK_NOTHROW(Image(device, buffer.get(), Element::u16, frame));
    CHECK_NOTHROW(Image(device, buffer.get(), Element::u16, {848, 479, 1, 848}, 848));
    const auto refused = [&](Layout layout, std::size_t offset, const char* needed) {
        INFO(layout.row_stride << ", " << offset);
        CHECK_THROWS_AS(Image(device, buffer.get(), Element::u16, layout, offset), std::invalid_argument);
        CHECK_THROWS_WITH(Image(device, buffer.get(), Element::u16, layout, offset),
                          ContainsSubstring("a buffer of 814080 bytes is too small") && ContainsSubstring(needed));
    };
    refused(frame, 1, "814080");
    refused({848, 480, 1, 849}, 0, "815038");
    refused({848, 481, 1, 848}, 0, "815776");
    refused({848, 480, 3, 848 * 3}, 0, "2442240");
    refused({1, 1, 1, 1}, 848 * 480, "2 from element 407040 on");
    refused({1, 1, 1, 1}, std::size_t{1} << 63, "2 ");
    refused({1, 1, 1, 1}, ~std::size_t{0}, "2 ");
    for (const int rows : {2, 3, 5, 2147483647}) // 4 · 2^62 is 0 in 64 bits
        for (const int power : {59, 61, 62, 63}) {
            INFO(rows << " rows, 2^" << power << " elements apart");
            CHECK_THROWS_AS(Image(device, buffer.get(), Element::u16, {4, rows, 1, std::size_t{1} << power}),
                            std::invalid_argument);
        }
    CHECK_THROWS_AS(Image(device, Element::f32, {2147483647, 2147483647, 2147483647}), std::invalid_argument);
    CHECK_THROWS_AS(Image(device, nullptr, Element::u16, frame), std::invalid_argument);
    CHECK_THROWS_AS(Image(device, buffer.get(), Element::u16, {848, 480, 1, 847}), std::invalid_argument);

    const auto with_flags = [&](cl_mem_flags flags) {
        return Buffer(clCreateBuffer(context.own.get(), flags, 4096, nullptr, nullptr), clReleaseMemObject);
    };
    CHECK_THROWS_WITH(Image(device, with_flags(CL_MEM_WRITE_ONLY).get(), Element::u16, {8, 4}),
                      ContainsSubstring("CL_MEM_WRITE_ONLY"));
    const Image to_read(device, with_flags(CL_MEM_READ_ONLY).get(), Element::f32, {8, 4});
    CHECK_THROWS_WITH(linearize({Image(device, Element::f32, {8, 4}), camera(8, 4)}, to_read),
                      ContainsSubstring("CL_MEM_READ_ONLY"));
    CHECK_NOTHROW(linearize({to_read, camera(8, 4)}, Image(device, Element::f32, {8, 4})));
    const cl_image_format format{CL_R, CL_FLOAT};
    cl_image_desc desc{};
    desc.image_type = CL_MEM_OBJECT_IMAGE2D;
    desc.image_width = desc.image_height = 64;
    const Buffer texture(clCreateImage(context.own.get(), CL_MEM_READ_WRITE, &format, &desc, nullptr, nullptr),
                         clReleaseMemObject);
    REQUIRE(texture != nullptr);
    CHECK_THROWS_WITH(Image(device, texture.get(), Element::f32, {8, 4}), ContainsSubstring("is an OpenCL image"));

    const std::vector<float> values(32);
    const Image held = Image::from_host(device, Element::f32, values.data(), {8, 4}),
                on_device(device, Element::f32, {8, 4});
    std::vector<float> target(32);
    CHECK_THROWS_AS(Image::from_host(device, Element::f32, nullptr, {8, 4}), std::invalid_argument);
    CHECK_THROWS_AS(on_device.download(nullptr), std::invalid_argument);
    CHECK_THROWS_AS(on_device.download(target.data(), 7), std::invalid_argument);
    CHECK_THROWS_AS(Image().region(0, 0, 1, 1), std::invalid_argument);
    CHECK_THROWS_AS(Image().download(target.data()), std::invalid_argument);

    const Buffer sub = [&] {
        const cl_buffer_region half{0, 848 * 240 * 2};
        return Buffer(clCreateSubBuffer(buffer.get(), 0, CL_BUFFER_CREATE_TYPE_REGION, &half, nullptr),
                      clReleaseMemObject);
    }();
    CHECK_NOTHROW(Image(device, sub.get(), Element::u16, {848, 240, 1, 848}));
    CHECK_THROWS_WITH(Image(device, sub.get(), Element::u16, frame),
                      ContainsSubstring("a buffer of 407040 bytes is too small"));
}

TEST_CASE("foreign memory: a buffer of another context is refused by name", "[foreign-memory]") {
    const Context context, other;
    const Device device = context.in_order;
    const Buffer buffer = other.buffer(4096);
    CHECK_THROWS_AS(Image(device, buffer.get(), Element::f32, {8, 4}), std::invalid_argument);
    CHECK_THROWS_WITH(Image(device, buffer.get(), Element::f32, {8, 4}),
                      ContainsSubstring("another context") && ContainsSubstring(device.info().name));
}

TEST_CASE("foreign memory: host memory that is not aligned to its elements is refused", "[foreign-memory]") {
    const Context context;
    const Device device = context.in_order;
    Bytes bytes(4096 + 1);
    const Buffer buffer(
        clCreateBuffer(context.own.get(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, 4096, bytes.data() + 1, nullptr),
        clReleaseMemObject);
    REQUIRE(buffer != nullptr);
    CHECK_THROWS_AS(Image(device, buffer.get(), Element::u16, {8, 4}), std::invalid_argument);
    CHECK_NOTHROW(Image(device, buffer.get(), Element::u8, {8, 4}));
}

TEST_CASE("foreign memory: sub-buffers of one buffer share its memory where they overlap", "[foreign-memory]") {
    const Context context;
    const Device device = context.in_order;
    const Buffer whole = context.buffer(8192);
    const auto part = [&](std::size_t origin, std::size_t size) {
        const cl_buffer_region region{origin, size};
        cl_mem made = clCreateSubBuffer(whole.get(), 0, CL_BUFFER_CREATE_TYPE_REGION, &region, nullptr);
        REQUIRE(made != nullptr);
        return Buffer(made, clReleaseMemObject);
    };
    const Layout rows{32, 8, 1, 32}; // 1024 bytes
    const auto image = [&](const Buffer& buffer, std::size_t offset = 0) {
        return Image(device, buffer.get(), Element::f32, rows, offset);
    };
    const Image first = image(part(0, 2048)), second = image(part(1024, 2048)), again = image(part(0, 4096), 256),
                last = image(part(4096, 1024)), in_whole = image(whole, 256);
    CHECK(!first.overlaps(second)); // rows 0 to 1023 and 1024 to 2047 of the whole
    CHECK(image(part(0, 2048), 128).overlaps(second));
    CHECK(second.overlaps(again));
    CHECK(second.same_as(again));
    CHECK(second.same_as(in_whole));
    CHECK(in_whole.overlaps(second));
    CHECK(!last.overlaps(second));
    CHECK(!first.same_as(second));

    const Camera seen = camera(32, 8);
    CHECK_THROWS_WITH(linearize({second, seen}, image(part(0, 2048), 128)),
                      "the result shares memory with the stored depth");
    CHECK_NOTHROW(linearize({second, seen}, again)); // in place
    CHECK_NOTHROW(linearize({second, seen}, last));
    device.finish();
}

TEST_CASE("foreign memory: an image keeps its buffer after everybody else let it go", "[foreign-memory]") {
    const Context context;
    const Device device = context.in_order;
    const Content content(61, 37, Storage::float32);
    const Bytes expected = content.linearized();
    Image image;
    {
        const Buffer buffer = context.buffer(content.values.size(), content.values.data());
        image = Image(device, buffer.get(), Element::f32, {61, 37, 1, 61});
    }
    CHECK(downloaded(linearize({image, content.seen}).image) == expected);
}
