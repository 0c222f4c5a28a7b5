#pragma once

#include "runtime/state.hpp"

#include <vector>

namespace fathom::runtime {

/// Images that an operation needs between its passes. Their memory goes back to the device's pool when this goes out of
/// scope, so that a second call allocates nothing. Kernels run in the order in which they were started, so that nobody
/// overwrites what is still read.
class Scratch {
public:
    explicit Scratch(const Device& device);
    ~Scratch();
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    /// An image whose rows start at multiples of 64 bytes. Its content is undefined.
    Image image(Element element, Layout layout);

    /// Another image in the memory of one of these, which takes at least as much.
    Image image_in(const Image& memory, Element element, Layout layout) const;

private:
    bool take(std::size_t size);
    void make_room(std::size_t size);

    Device device_;
    std::list<ScratchBuffer> used_;
};

/// An image's elements on the host, whose rows lie without a gap. Waits for the device.
template <typename Value>
std::vector<Value> on_host(const Image& image) {
    const auto pixels = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
    std::vector<Value> values(pixels * static_cast<std::size_t>(image.channels()) * element_bytes(image.element()) /
                              sizeof(Value));
    image.download(values.data());
    return values;
}

/// Its numbers there: codes of 8 and of 16 bits are parts of the largest one.
std::vector<float> floats_of(const Image& image);

/// Copies an image to another one of its size and type.
void copy(const Image& from, const Image& to);

/// Copies such pixels of the host, whose rows lie without a gap, and waits for the device.
void copy_from_host(const void* from, const Image& to);

} // namespace fathom::runtime
