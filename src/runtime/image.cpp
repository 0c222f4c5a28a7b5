// Images on the device. On a CPU device they are the caller's memory: kernels read and write at any element's address,
// so that even an unaligned sub-matrix needs no copy.

#include <fathom/image.hpp>

#include "require.hpp"
#include "runtime/launch.hpp"
#include "runtime/memory.hpp"
#include "runtime/state.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <tuple>

namespace fathom {
namespace {

constexpr std::size_t row_alignment = 64;

std::size_t row_elements(const Layout& layout) {
    return static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.channels);
}

void check(const Layout& layout) {
    require(layout.width >= 1 && layout.height >= 1 && layout.channels >= 1, "an image of ", layout.width, " x ",
            layout.height, " pixels and ", layout.channels, " channels: all must be at least 1");
    constexpr std::size_t most = std::numeric_limits<std::size_t>::max() / 16; // elements that can be counted in bytes
    const std::size_t row = row_elements(layout), stride = std::max(layout.row_stride, row);
    require(layout.row_stride == 0 || layout.row_stride >= row, "row_stride = ", layout.row_stride,
            " must be at least ", row);
    require<ImageTooLarge>(stride <= most / static_cast<std::size_t>(layout.height), "an image of ", layout.height,
                           " rows of ", stride, " elements is too large for any memory");
}

Layout with_stride(Layout layout) {
    check(layout);
    if (layout.row_stride == 0)
        layout.row_stride = row_elements(layout);
    return layout;
}

Layout with_aligned_stride(Element element, Layout layout) {
    layout = with_stride(layout);
    const std::size_t step = row_alignment / element_bytes(element);
    layout.row_stride = (layout.row_stride + step - 1) / step * step;
    return layout;
}

std::size_t elements(const Layout& layout) {
    return static_cast<std::size_t>(layout.height - 1) * layout.row_stride + row_elements(layout);
}

void release_buffer(cl_mem buffer) {
    if (!runtime::forked())
        clReleaseMemObject(buffer);
}

std::shared_ptr<_cl_mem> make_buffer(const Device& device, cl_mem_flags flags, std::size_t size, void* host) {
    const auto make = [&] { return runtime::shared(cl::Buffer(runtime::context_of(device), flags, size, host)()); };
    return runtime::ask(device, make, "has no room for ", size, " bytes");
}

void CL_CALLBACK free_memory(cl_mem, void* memory) {
    runtime::give_back(memory);
}

// Memory of the device's own. A CPU's is allocated here, since the driver's lies in small pages.
std::shared_ptr<_cl_mem> make_own(const Device& device, std::size_t size) {
    if (!device.info().cpu)
        return make_buffer(device, CL_MEM_READ_WRITE, size, nullptr);
    // Declared before the buffer, so that it outlives it.
    std::unique_ptr<void, decltype(&runtime::give_back)> memory(runtime::allocate(size), runtime::give_back);
    if (!memory)
        throw Error(text(device.info().name, " has no room for ", size, " bytes"));
    auto buffer = make_buffer(device, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size, memory.get());
    const auto give = [&] { cl::Buffer(buffer.get(), true).setDestructorCallback(free_memory, memory.get()); };
    runtime::ask(device, give, "cannot use ", size, " bytes");
    memory.release(); // it goes with the buffer
    return buffer;
}

bool can_share(const Device& device, Element element, const void* data) {
    return device.info().cpu && reinterpret_cast<std::uintptr_t>(data) % element_bytes(element) == 0;
}

// The bytes of an image's rows, counted from an address, or from where its buffer begins.
struct Span {
    std::uintptr_t first;
    std::uintptr_t width, pitch, count;

    std::uintptr_t end() const { return first + (count - 1) * pitch + width; }
};

// Has any row of one a byte in common with a row of the other?
bool rows_meet(const Span& a, const Span& b) {
    if (a.first > b.first)
        return rows_meet(b, a);
    if (b.first >= a.end())
        return false;
    if (a.pitch != b.pitch)
        return true; // they may not, but that is rare
    const std::uintptr_t row = (b.first - a.first) / a.pitch, column = (b.first - a.first) % a.pitch;
    return (row < a.count && column < a.width) || (row + 1 < a.count && column + b.width > a.pitch);
}

} // namespace

std::shared_ptr<_cl_mem> runtime::shared(cl_mem buffer) {
    check_process();
    require(buffer != nullptr, "an image in a buffer that is null");
    clRetainMemObject(buffer);
    return {buffer, release_buffer};
}

std::size_t element_bytes(Element element) {
    static constexpr std::size_t bytes[] = {1, 2, 4, 2, 4}; // of u8, u16, u32, f16, f32
    return bytes[static_cast<std::size_t>(element)];
}

Element element_of(Storage storage) {
    switch (storage) {
    case Storage::float32:
        return Element::f32;
    case Storage::float16:
        return Element::f16;
    case Storage::uint16:
        return Element::u16;
    case Storage::uint24:
    case Storage::uint24_high:
        return Element::u32;
    default:
        return Element::u8;
    }
}

int channels_of(Storage storage) {
    return element_of(storage) == Element::u8 && storage != Storage::uint8 ? 3 : 1;
}

Image::Image(const Device& device, std::shared_ptr<_cl_mem> own, Element element, Layout layout)
    : device_(device), buffer_(std::move(own)), element_(element),
      layout_(with_aligned_stride(element, layout)), place_{.whole = buffer_.get()} {}

Image::Image(const Device& device, Element element, Layout layout)
    : Image(device, make_own(device, allocation(element, layout)), element, layout) {}

Image::Image(const Device& device, cl_mem buffer, Element element, Layout layout, std::size_t offset)
    : device_(device), buffer_(runtime::shared(buffer)), element_(element),
      layout_(layout.row_stride == 0 ? with_aligned_stride(element, layout) : with_stride(layout)), offset_(offset) {
    const cl::Buffer given = runtime::buffer_of(*this);
    runtime::ask(
        device,
        [&] {
            require(given.getInfo<CL_MEM_CONTEXT>() == runtime::context_of(device),
                    "the buffer is of another context than ", device.info().name, "'s");
            require(given.getInfo<CL_MEM_TYPE>() == CL_MEM_OBJECT_BUFFER,
                    "the memory is an OpenCL image, and a buffer is needed");
            require((given.getInfo<CL_MEM_FLAGS>() & CL_MEM_WRITE_ONLY) == 0,
                    "the buffer is CL_MEM_WRITE_ONLY, so that no kernel may read it; make it CL_MEM_READ_WRITE");
            place_.writable = (given.getInfo<CL_MEM_FLAGS>() & CL_MEM_READ_ONLY) == 0;
            const std::size_t size = given.getInfo<CL_MEM_SIZE>(), each = element_bytes(element),
                              needed = elements(layout_);
            require(offset <= size / each && needed <= size / each - offset, "a buffer of ", size,
                    " bytes is too small: the image takes ", needed * each, " from element ", offset, " on");
            place_.offset = given.getInfo<CL_MEM_OFFSET>();
            const cl::Memory parent = given.getInfo<CL_MEM_ASSOCIATED_MEMOBJECT>(), whole = parent() ? parent : given;
            place_.whole = whole();
            if (device.info().cpu && (whole.getInfo<CL_MEM_FLAGS>() & CL_MEM_USE_HOST_PTR) != 0) // of any alignment
                place_.host = static_cast<const char*>(whole.getInfo<CL_MEM_HOST_PTR>()) + place_.offset;
        },
        "cannot use a buffer");
    require(first_byte() % element_bytes(element) == 0, "the buffer's host memory is not aligned to elements of ",
            element_bytes(element), " bytes");
}

std::size_t Image::allocation(Element element, Layout layout) {
    return elements(with_aligned_stride(element, layout)) * element_bytes(element);
}

Image Image::from_host(const Device& device, Element element, const void* data, Layout layout) {
    require(data != nullptr, "an image of a null pointer");
    Image image;
    image.device_ = device;
    image.element_ = element;
    image.layout_ = with_stride(layout);
    const bool shared = can_share(device, element, data);
    image.buffer_ = make_buffer(device, CL_MEM_READ_WRITE | (shared ? CL_MEM_USE_HOST_PTR : CL_MEM_COPY_HOST_PTR),
                                elements(image.layout_) * element_bytes(element), const_cast<void*>(data));
    image.place_ = {.host = shared ? data : nullptr, .whole = image.buffer_.get()};
    return image;
}

Image Image::onto_host(const Device& device, Element element, void* data, Layout layout) {
    if (can_share(device, element, data))
        return from_host(device, element, data, layout);
    return Image(device, element, layout);
}

Image Image::region(int x, int y, int width, int height) const {
    require(buffer_ != nullptr, "a region of an Image that is none");
    require(x >= 0 && y >= 0 && width >= 1 && height >= 1 && x <= layout_.width - width && y <= layout_.height - height,
            "region = (", x, ", ", y, ", ", width, ", ", height, ") reaches beyond the image of ", layout_.width, " x ",
            layout_.height);
    Image part = *this;
    part.offset_ += static_cast<std::size_t>(y) * layout_.row_stride +
                    static_cast<std::size_t>(x) * static_cast<std::size_t>(layout_.channels);
    part.layout_.width = width;
    part.layout_.height = height;
    return part;
}

void Image::download(void* data, std::size_t row_stride) const {
    const std::size_t size = element_bytes(element_);
    if (row_stride == 0)
        row_stride = row_elements(layout_);
    require(data != nullptr, "an image is to be copied to a null pointer");
    require(row_stride >= row_elements(layout_), "row_stride = ", row_stride, " must be at least ",
            row_elements(layout_));
    const runtime::Launched launched(device_); // an exception waits for what has begun to use the memory
    const cl::CommandQueue& queue = runtime::queue_of(device_);
    const cl::Buffer buffer = runtime::buffer_of(*this);
    const auto read = [&] {
        runtime::keep_order(device_);
        const void* here = place_.host ? static_cast<const char*>(place_.host) + offset_ * size : nullptr;
        if (data == here && row_stride == layout_.row_stride) {
            // Mapping is what makes the results of the device visible to the host.
            void* mapped =
                queue.enqueueMapBuffer(buffer, CL_FALSE, CL_MAP_READ, offset_ * size, elements(layout_) * size);
            runtime::keep_order(device_);
            queue.enqueueUnmapMemObject(buffer, mapped);
            queue.finish();
            return;
        }
        // The last row goes by itself: NVIDIA's driver takes no rectangle whose last row ends before its stride does where
        // the buffer ends, too.
        const std::size_t row = row_elements(layout_) * size, before = static_cast<std::size_t>(layout_.height - 1);
        if (before > 0) {
            const std::array<cl::size_type, 3> from{offset_ % layout_.row_stride * size, offset_ / layout_.row_stride,
                                                    0};
            queue.enqueueReadBufferRect(buffer, CL_FALSE, from, {0, 0, 0}, {row, before, 1}, layout_.row_stride * size,
                                        0, row_stride * size, 0, data);
        }
        queue.enqueueReadBuffer(buffer, CL_TRUE, (offset_ + before * layout_.row_stride) * size, row,
                                static_cast<char*>(data) + before * row_stride * size);
    };
    runtime::ask(device_, read, "cannot hand over an image");
}

// From the start of the whole buffer, or of memory.
std::size_t Image::first_byte() const {
    const std::size_t start = place_.host ? reinterpret_cast<std::uintptr_t>(place_.host) : place_.offset;
    return start + offset_ * element_bytes(element_);
}

bool Image::aligned_to(std::size_t alignment) const {
    return first_byte() % alignment == 0 && layout_.row_stride * element_bytes(element_) % alignment == 0;
}

bool Image::overlaps(const Image& other) const {
    if (!*this || !other)
        return false;
    // Two buffers may still be made of the same host memory.
    if (place_.whole != other.place_.whole && !(place_.host && other.place_.host))
        return false;
    const auto rows = [&](const Image& image) {
        const std::size_t size = element_bytes(image.element_);
        return Span{image.first_byte(), row_elements(image.layout_) * size, image.layout_.row_stride * size,
                    static_cast<std::uintptr_t>(image.layout_.height)};
    };
    return rows_meet(rows(*this), rows(other));
}

bool Image::same_as(const Image& other) const {
    const bool one_memory = place_.whole == other.place_.whole || (place_.host && other.place_.host);
    const auto layout = [](const Image& image) {
        return std::tuple(image.width(), image.height(), image.channels(), image.row_stride(), image.first_byte(),
                          image.element());
    };
    return *this && other && one_memory && layout(*this) == layout(other);
}

StoredDepth StoredDepth::region(int left, int top, int width, int height) const {
    return {image.region(left, top, width, height), camera, storage, x + left, y + top};
}

Tile::Tile(const Camera& of, Storage stored_as, const Region& part) : camera(of), storage(stored_as), pixels(part) {}

Tile::Tile(const StoredDepth& stored)
    : Tile(stored.camera, stored.storage, {stored.x, stored.y, stored.image.width(), stored.image.height()}) {}

StoredDepth ViewDepth::stored() const {
    Camera view = camera;
    view.encoding = Encoding::view_z;
    view.scale = 1;
    view.offset = 0;
    view.along = Along::axis;
    view.from_near_plane = false;
    view.background.reset(); // and what else is meant of stored values
    view.background_from.reset();
    view.missing.reset();
    return {image, view, Storage::float32, x, y};
}

} // namespace fathom
