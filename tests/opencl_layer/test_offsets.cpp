// Images that lie beyond 2^32 elements of their buffer: no kernel cuts an offset or the place of a row to 32 bits. Of the memory
// only those pages are there that hold pixels, and the layer says that the buffer holds all of it.
#include "catch.hpp"
#include "layer.hpp"
#include "operations.hpp"
#include "rounds.hpp"

#include <fathom/fathom.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <sys/mman.h>

#include <list>

using namespace fathom;

namespace {

constexpr std::size_t offset = (std::size_t{1} << 32) + 11, stride = (std::size_t{1} << 31) + 64;

/// Floats whose rows are 8 GiB apart.
class Far {
public:
    Far(const Device& device, Layout layout, const std::vector<float>& content = {}) : layout_(layout) {
        layout_.row_stride = stride;
        void* const memory =
            mmap(nullptr, size(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        REQUIRE(memory != MAP_FAILED);
        memory_ = static_cast<float*>(memory);
        for (std::size_t y = 0; !content.empty() && y < rows(); ++y)
            std::copy_n(content.data() + y * row(), row(), memory_ + offset + y * stride);
        buffer_ = clCreateBuffer(device.context(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, 4096, memory_, nullptr);
        REQUIRE(buffer_ != nullptr);
        layer::claim(buffer_, size());
        image = Image(device, buffer_, Element::f32, layout_, offset);
    }
    ~Far() {
        image = {};
        clReleaseMemObject(buffer_);
        munmap(memory_, size());
    }
    Far(const Far&) = delete;
    Far& operator=(const Far&) = delete;

    Image image;

    /// The rows one after the other, once the device has finished.
    std::vector<float> content() const {
        std::vector<float> all;
        for (std::size_t y = 0; y < rows(); ++y)
            all.insert(all.end(), memory_ + offset + y * stride, memory_ + offset + y * stride + row());
        return all;
    }

private:
    std::size_t rows() const { return static_cast<std::size_t>(layout_.height); }
    std::size_t row() const { return static_cast<std::size_t>(layout_.width * layout_.channels); }
    std::size_t size() const { return sizeof(float) * (offset + rows() * stride); }

    Layout layout_;
    float* memory_ = nullptr;
    cl_mem buffer_ = nullptr;
};

} // namespace

TEST_CASE("offsets: images beyond 2^32 elements of their buffer have the bits of others", "[offsets]") {
    constexpr int width = 37, height = 3;
    const Device device = Device::open("cpu");
    const std::vector<float> values = operations::depth(width, height), colors(3 * width * height, 0.5f);
    const Camera camera = operations::camera(width, height);
    const Far depth(device, {width, height}, values), color(device, {width, height, 3}, colors);
    const StoredDepth near{Image::from_host(device, Element::f32, values.data(), {width, height}), camera},
        far{depth.image, camera};
    const Image near_color = Image::from_host(device, Element::f32, colors.data(), {width, height, 3});
    for (const description::Operation& operation : description::operations()) {
        INFO(operation.name);
        const auto call = rounds::call_of(operation, 0, near_color, operations::lens, 0.5),
                   far_call = rounds::call_of(operation, 0, color.image, operations::lens, 0.5);
        const auto expected = rounds::with_images(operation, call.get(), near, [&](const description::Shape& shape) {
            return Image(device, shape.element, shape.layout);
        });
        std::list<Far> results;
        rounds::with_images(operation, far_call.get(), far, [&](const description::Shape& shape) {
            return results.emplace_back(device, shape.layout).image;
        });
        operation.run(call.get(), near, {});
        operation.run(far_call.get(), far, {});
        device.finish();
        for (std::size_t i = 0; const Far& result : results) {
            std::vector<float> wanted(result.content().size());
            expected[i].image->download(wanted.data());
            INFO(expected[i++].name);
            CHECK(std::memcmp(result.content().data(), wanted.data(), wanted.size() * sizeof(float)) == 0);
        }
    }
}
