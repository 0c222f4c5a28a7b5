// The pool of scratch memory: buffers that the last operations left, taken again by size.

#include "runtime/scratch.hpp"

#include "runtime/state.hpp"

#include <algorithm>

namespace fathom::runtime {
namespace {

// An operation has fewer images than this between its passes; what is left over from other sizes is given back.
constexpr std::size_t most_kept = 12;

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
        used_.push_back(Image(device_, element, layout).buffer());
    }
    return Image(device_, used_.back(), element, layout);
}

} // namespace fathom::runtime
