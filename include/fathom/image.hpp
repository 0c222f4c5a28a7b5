#pragma once

#include <fathom/camera.hpp>
#include <fathom/device.hpp>

#include <cstddef>
#include <memory>

namespace fathom {
namespace runtime {
class Scratch;
struct Table;
} // namespace runtime

#pragma GCC visibility push(default)

/// Type of one element of an image in memory.
enum class Element { u8, u16, u32, f16, f32 };

std::size_t element_bytes(Element element);

/// Size and layout of an image in host memory.
struct Layout {
    int width = 0;              ///< pixels
    int height = 0;             ///< pixels
    int channels = 1;           ///< interleaved
    std::size_t row_stride = 0; ///< elements from one row to the next; 0: rows follow each other without a gap
};

/// A part of an image, in pixels.
struct Region {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;
};

/// The element of an image that holds depth in this storage, and how many of them a pixel takes.
Element element_of(Storage storage);
int channels_of(Storage storage);

/// An image on the device: a row-major region of a buffer. A handle: copies and `region` share the memory.
///
/// On a CPU device an image made from host memory *is* that memory: nothing is copied, and the caller keeps it alive
/// and leaves it alone until `download` or `Device::finish`.
class Image {
public:
    Image() = default;

    /// Allocates an image whose rows start at multiples of 64 bytes. Its content is undefined.
    Image(const Device& device, Element element, Layout layout);

    /// An image in a buffer or sub-buffer that is there already, whose first element is number `offset`. Any row stride of at
    /// least a row will do; without one, rows lie as the constructor above would lay them. The buffer is retained.
    /// Throws: std::invalid_argument for a null handle, a buffer of another context, an OpenCL image, a buffer that is too small
    /// or CL_MEM_WRITE_ONLY, and host memory that is not aligned to its elements; Error from the driver. A handle that was
    /// released before cannot be told from one that is good.
    Image(const Device& device, cl_mem buffer, Element element, Layout layout, std::size_t offset = 0);

    /// Bytes that such an image takes.
    static std::size_t allocation(Element element, Layout layout);

    /// An image that reads `data`: shared on a CPU device, copied to any other.
    static Image from_host(const Device& device, Element element, const void* data, Layout layout);

    /// An image that operations write into and whose `download(data)` costs nothing on a CPU device.
    static Image onto_host(const Device& device, Element element, void* data, Layout layout);

    /// A region of the same memory; x, y, width and height in pixels.
    Image region(int x, int y, int width, int height) const;

    /// Waits for what was started and copies to host memory (nothing is copied when the image already lies there).
    void download(void* data, std::size_t row_stride = 0) const;

    const Device& device() const { return device_; }
    cl_mem buffer() const { return buffer_.get(); } ///< lives as long as the image: retain it to keep it longer
    Element element() const { return element_; }
    int width() const { return layout_.width; }
    int height() const { return layout_.height; }
    int channels() const { return layout_.channels; }
    std::size_t row_stride() const { return layout_.row_stride; } ///< elements
    std::size_t offset() const { return offset_; }                ///< elements from the buffer's start
    explicit operator bool() const { return buffer_ != nullptr; }

    /// Do all rows start at multiples of `alignment` bytes?
    bool aligned_to(std::size_t alignment) const;

    /// May kernels write it? They may not write a buffer that was made with CL_MEM_READ_ONLY.
    bool writable() const { return place_.writable; }

    /// Do two images share memory? Two regions of one image do where they have pixels in common.
    bool overlaps(const Image& other) const;

    /// Are they the same pixels in the same memory, taken in the same way?
    bool same_as(const Image& other) const;

private:
    // Where the buffer's first byte lies: on the host, if it is host memory; in the buffer that it is a part of, otherwise.
    struct Place {
        const void* host = nullptr;
        cl_mem whole = nullptr;
        std::size_t offset = 0; // bytes
        bool writable = true;
    };

    friend class runtime::Scratch;
    friend struct runtime::Table;

    // In a buffer that the library made, about which the driver need not be asked.
    Image(const Device& device, std::shared_ptr<_cl_mem> own, Element element, Layout layout);

    std::size_t first_byte() const;

    Device device_;
    std::shared_ptr<_cl_mem> buffer_; // released with the last copy
    Element element_ = Element::f32;
    Layout layout_;
    std::size_t offset_ = 0;
    Place place_;
};

/// Depth as it was stored, with the camera that gives it a meaning.
struct StoredDepth {
    Image image;
    Camera camera; ///< of the whole image; if that is larger, `image` is its part from pixel x, y on
    Storage storage = Storage::float32;
    int x = 0; ///< where the image's first pixel lies in the camera's whole image
    int y = 0;

    /// A part of it, decoded to the same bits as within the whole.
    StoredDepth region(int x, int y, int width, int height) const;
};

/// Pixels of a camera's image, and how their depth is stored. There need be no image of them yet: what is asked of a tile can be
/// asked of stored depth, too.
struct Tile {
    Camera camera;
    Storage storage;
    Region pixels; ///< of the camera's whole image

    Tile(const Camera& camera, Storage storage, const Region& pixels);
    Tile(const StoredDepth& stored);
};

/// Pixels on either side of a tile that decide on its results. A tile with so many around it, or with all up to the image's
/// border, has the bits of the whole image. Never more than the camera's image has.
struct Reach {
    int columns = 0;
    int rows = 0;
};

/// Distance along the view axis, positive in front of the camera: +inf for the background, NaN for invalid pixels.
/// The camera is that of the stored image.
struct ViewDepth {
    Image image; ///< one float a pixel
    Camera camera;
    int x = 0; ///< where the image's first pixel lies in the camera's whole image
    int y = 0;

    /// The same image seen as stored depth of the `view_z` encoding, for operations that take either.
    StoredDepth stored() const;
};

#pragma GCC visibility pop
} // namespace fathom
