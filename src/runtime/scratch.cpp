// The pool of scratch memory: buffers that the last operations left, taken again by size.

#include "runtime/scratch.hpp"

#include "runtime/state.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace fathom::runtime {
namespace {

// An operation has fewer images than this between its passes; what is left over from other sizes is given back.
constexpr std::size_t most_kept = 12;

// Kernels that read far around their pixels wait for address translation more than for data if pages are small.
constexpr std::size_t huge_page = std::size_t{2} << 20;

void CL_CALLBACK free_memory(cl_mem, void* memory) {
    std::free(memory);
}

// Memory in huge pages where the system hands them out; the driver's own otherwise.
cl::Buffer in_huge_pages(const Device& device, std::size_t size) {
    void* memory = std::aligned_alloc(huge_page, (size + huge_page - 1) / huge_page * huge_page);
    if (!memory)
        throw Error(text("no room for ", size, " bytes between the passes of an operation"));
#ifdef __linux__
    madvise(memory, size, MADV_HUGEPAGE);
#endif
    cl::Buffer buffer;
    try {
        buffer = cl::Buffer(context_of(device), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size, memory);
        buffer.setDestructorCallback(free_memory, memory);
    } catch (const cl::Error& error) {
        std::free(memory);
        throw Error(
            text(device.info().name, " cannot use ", size, " bytes: ", error.what(), " returned ", error.err()));
    }
    return buffer;
}

std::size_t size_of(const cl::Buffer& buffer) {
    return buffer.getInfo<CL_MEM_SIZE>();
}

} // namespace

Scratch::~Scratch() {
    auto& pool = device_.state().scratch;
    pool.insert(pool.end(), used_.begin(), used_.end());
    if (pool.size() > most_kept)
        pool.erase(pool.begin(), pool.end() - most_kept);
}

Image Scratch::image(Element element, Layout layout) {
    const std::size_t size = Image::allocation(element, layout);
    auto& pool = device_.state().scratch;
    const auto found = std::ranges::find_if(pool, [&](const cl::Buffer& buffer) { return size_of(buffer) == size; });
    if (found != pool.end()) {
        used_.push_back(*found);
        pool.erase(found);
    } else {
        const bool huge = device_.info().cpu && size >= huge_page;
        used_.push_back(huge ? in_huge_pages(device_, size) : buffer_of(Image(device_, element, layout)));
    }
    return Image(device_, used_.back()(), element, layout);
}

void copy(const Image& from, const Image& to) {
    const auto width = static_cast<std::size_t>(from.width() * from.channels()) * element_bytes(from.element());
    const auto corner = [](const Image& image) {
        const std::size_t size = element_bytes(image.element());
        return std::array<cl::size_type, 3>{image.offset() % image.row_stride() * size,
                                            image.offset() / image.row_stride(), 0};
    };
    queue_of(from.device())
        .enqueueCopyBufferRect(buffer_of(from), buffer_of(to), corner(from), corner(to),
                               {width, static_cast<std::size_t>(from.height()), 1},
                               from.row_stride() * element_bytes(from.element()), 0,
                               to.row_stride() * element_bytes(to.element()), 0);
}

} // namespace fathom::runtime
