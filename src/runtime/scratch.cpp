// The pool of scratch memory: buffers that the last operations left, taken again where they fit.

#include "runtime/scratch.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <array>

namespace fathom::runtime {
namespace {

// An operation has fewer images than this between its passes; what is left over from other sizes is given back. Threads that
// call at the same time leave as many each.
constexpr std::size_t most_kept = 12;

constexpr std::size_t large = std::size_t{1} << 16; // bytes, for which it matters whether memory is new

} // namespace

Scratch::Scratch(const Device& device) : device_(device) {
    const auto lock = locked(device_.state().mutex);
    ++device_.state().calls_with_scratch;
}

Scratch::~Scratch() {
    if (forked())
        return; // it holds nothing, and the lock may never open
    Device::State& state = device_.state();
    const std::lock_guard lock(state.mutex);
    state.scratch.splice(state.scratch.end(), used_); // moves nodes, which cannot fail
    const std::size_t budget = state.options.memory_budget;
    while (!state.scratch.empty() && (state.scratch.size() > most_kept * state.calls_with_scratch ||
                                      (budget > 0 && state.scratch_bytes > budget))) {
        state.scratch_bytes -= state.scratch.front().size;
        state.scratch.pop_front();
    }
    --state.calls_with_scratch;
}

// Takes a buffer of this size from the pool, or, if that is large, the smallest one that fits and is not far too large: what
// `dof` needs differs from frame to frame, and what `ssao` needs from face to face of a lens, and new memory costs as much as
// kernels. A budget leaves no room for that.
bool Scratch::take(std::size_t size) {
    const std::size_t most_times = size >= large && device_.options().memory_budget == 0 ? 5 : 1;
    const auto lock = locked(device_.state().mutex);
    auto& pool = device_.state().scratch;
    auto found = pool.end();
    for (auto each = pool.begin(); each != pool.end(); ++each) {
        const bool fits = each->size >= size && each->size <= size * most_times;
        if (fits && (found == pool.end() || each->size < found->size))
            found = each;
    }
    if (found == pool.end())
        return false;
    used_.splice(used_.end(), pool, found);
    return true;
}

// Gives back what was kept, as far as it would exceed the budget beside a new buffer.
void Scratch::make_room(std::size_t size) {
    Device::State& state = device_.state();
    std::list<ScratchBuffer> gone;
    {
        const auto lock = locked(state.mutex);
        const std::size_t budget = state.options.memory_budget;
        while (budget > 0 && state.scratch_bytes + size > budget && !state.scratch.empty()) {
            state.scratch_bytes -= state.scratch.front().size;
            gone.splice(gone.end(), state.scratch, state.scratch.begin());
        }
    }
    if (!gone.empty())
        device_.finish(); // the memory goes when the last kernel that uses it has ended
}

Image Scratch::image(Element element, Layout layout) {
    const std::size_t size = Image::allocation(element, layout);
    if (!take(size)) {
        make_room(size);
        used_.push_back({size, buffer_of(Image(device_, element, layout))});
        Device::State& state = device_.state();
        const auto lock = locked(state.mutex);
        state.scratch_bytes += size;
        state.most_scratch_bytes = std::max(state.most_scratch_bytes, state.scratch_bytes);
    }
    return Image(device_, shared(used_.back().buffer()), element, layout);
}

Image Scratch::image_in(const Image& memory, Element element, Layout layout) const {
    return Image(device_, shared(memory.buffer()), element, layout);
}

std::vector<float> floats_of(const Image& image) {
    const auto divided = [&]<typename T>(T largest) {
        const std::vector<T> elements = on_host<T>(image);
        std::vector<float> floats(elements.size());
        std::ranges::transform(elements, floats.begin(),
                               [&](T each) { return static_cast<float>(each) / static_cast<float>(largest); });
        return floats;
    };
    switch (image.element()) {
    case Element::u8:
        return divided(std::uint8_t{255});
    case Element::u16:
        return divided(std::uint16_t{65535});
    case Element::f16:
        return divided(Eigen::half(1));
    case Element::u32:
        return divided(std::uint32_t{1});
    default:
        return on_host<float>(image);
    }
}

void copy(const Image& from, const Image& to) {
    const std::size_t size = element_bytes(from.element()), rows = static_cast<std::size_t>(from.height()),
                      width = static_cast<std::size_t>(from.width() * from.channels()) * size;
    // PoCL 3.1 crashes on rectangles of sub-buffers, so the buffer that they are parts of is named.
    const auto whole = [](const Image& image) {
        const cl::Buffer buffer = buffer_of(image);
        const cl::Memory parent = buffer.getInfo<CL_MEM_ASSOCIATED_MEMOBJECT>();
        return parent() ? cl::Buffer(parent(), true) : buffer;
    };
    const auto first = [&](const Image& image) {
        return buffer_of(image).getInfo<CL_MEM_OFFSET>() + image.offset() * size;
    };
    const auto start = [&] {
        const cl::CommandQueue& queue = queue_of(from.device());
        const cl::Buffer source = whole(from), target = whole(to);
        const std::size_t from_pitch = from.row_stride() * size, to_pitch = to.row_stride() * size;
        keep_order(from.device());
        const auto copy_row = [&](std::size_t y) {
            queue.enqueueCopyBuffer(source, target, first(from) + y * from_pitch, first(to) + y * to_pitch, width);
        };
        if (source() == target() && from_pitch != to_pitch) { // OpenCL takes one pitch for a rectangle of one buffer
            for (std::size_t y = 0; y < rows; ++y)
                copy_row(y);
            return;
        }
        const auto corner = [](std::size_t byte, std::size_t pitch) {
            return std::array<cl::size_type, 3>{byte % pitch, byte / pitch, 0};
        };
        if (rows > 1) { // the last row goes by itself, as in Image::download
            queue.enqueueCopyBufferRect(source, target, corner(first(from), from_pitch), corner(first(to), to_pitch),
                                        {width, rows - 1, 1}, from_pitch, 0, to_pitch, 0);
        }
        copy_row(rows - 1);
    };
    ask(from.device(), start, "cannot copy an image");
}

void copy_from_host(const void* from, const Image& to) {
    copy(Image::from_host(to.device(), to.element(), from, {to.width(), to.height(), to.channels()}), to);
    to.device().finish();
}

} // namespace fathom::runtime
