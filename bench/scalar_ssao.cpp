#include "scalar_ssao.hpp"

#include "text.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

const std::map<std::string, std::string>& fathom_baseline_files(); // generated from the kernels beside this file

namespace fathom::bench {
namespace {

// pattern_slice of scalar_ssao.cl.
struct PatternSlice {
    cl_float turn_x, turn_y, rounding, reserved;
    cl_float shares[2][ScalarSsao::steps + 1];
};

double fraction(double value) {
    return value - std::floor(value);
}

// Order of the 4 × 4 pixels, the library's.
constexpr int rank_of[] = {0, 9, 6, 15, 4, 13, 10, 3, 8, 1, 14, 7, 12, 5, 2, 11};

// Directions in equal steps over half a turn, distances that grow with the power 1.5, both shifted from pattern to pattern
// as the library does it; or all pixels alike.
std::vector<PatternSlice> pattern_slices(bool alike) {
    constexpr int patterns = 16, slices = ScalarSsao::slices, steps = ScalarSsao::steps;
    std::vector<PatternSlice> list;
    for (const int rank : rank_of) {
        const double shift = alike ? 0.5 : (rank + 0.5) / patterns;
        for (int k = 0; k < slices; ++k) {
            const double angle = std::numbers::pi * (k + shift) / slices;
            const double spread = fraction((rank * 7 % 16 + 0.5) / patterns + (k + 1) * 0.754877666246693);
            PatternSlice slice{.turn_x = static_cast<float>(std::cos(angle)),
                               .turn_y = static_cast<float>(std::sin(angle)),
                               .rounding = static_cast<float>(1.0 / 16 + (alike ? 0.5 : fraction(spread * 7)) * 7 / 8),
                               .reserved = 0,
                               .shares = {}};
            for (int side = 0; side < 2; ++side) {
                const double along =
                    alike ? 0.5 : fraction((rank * 5 % 16 + 0.5) / patterns + (2 * k + side) * 0.618033988749895);
                for (int i = 0; i <= steps; ++i)
                    slice.shares[side][i] = static_cast<float>(std::pow((i + along) / steps, 1.5));
            }
            list.push_back(slice);
        }
    }
    return list;
}

cl::Program program(const Device& device) {
    cl::Program program(device.context(), fathom_baseline_files().at("scalar_ssao.cl"));
    try {
        program.build(text("-cl-std=CL1.2 -DSLICES=", ScalarSsao::slices, " -DSTEPS=", ScalarSsao::steps).c_str());
    } catch (const cl::Error&) {
        throw Error(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>().front().second);
    }
    return program;
}

void set(cl::Kernel& kernel, const auto&... arguments) {
    cl_uint index = 0;
    (kernel.setArg(index++, arguments), ...);
}

} // namespace

ScalarSsao::ScalarSsao(const Image& stored, double fov_y, DepthSpan span, double radius, double thickness,
                       Patterns patterns)
    : stored_(stored) {
    const Device& device = stored.device();
    const cl::Program built = program(device);
    surfaces_kernel_ = cl::Kernel(built, "scalar_surfaces");
    kernel_ = cl::Kernel(built, "scalar_ssao");
    const cl_int width = stored.width(), height = stored.height();
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    surfaces_ = cl::Buffer(device.context(), CL_MEM_READ_WRITE, pixels * sizeof(cl_float4));
    std::vector<PatternSlice> table = pattern_slices(patterns == Patterns::alike);
    patterns_ = cl::Buffer(device.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR,
                           table.size() * sizeof(PatternSlice), table.data());

    const auto single = [](double value) { return static_cast<cl_float>(value); };
    const double focal = height / (2 * std::tan(fov_y / 2));
    const double gain = 1 / span.far - 1 / span.near; // 1/z = gain d + 1/near
    set(surfaces_kernel_, stored_.buffer(), surfaces_, width, height, static_cast<cl_int>(stored.row_stride()),
        single(gain), single(1 / span.near), single(focal), single(thickness));
    const double error = std::abs(gain) * 0x1p-25; // half a step of the stored value
    set(kernel_, surfaces_, patterns_, cl::Buffer(), width, height, cl_int{0}, single(focal), single(radius),
        single(error));
}

void ScalarSsao::run(const Image& visibility) {
    const Device& device = stored_.device();
    kernel_.setArg(2, visibility.buffer());
    kernel_.setArg(5, static_cast<cl_int>(visibility.row_stride()));
    const auto group = static_cast<std::size_t>(device.options().group_size);
    const std::size_t columns = (static_cast<std::size_t>(stored_.width()) + group - 1) / group * group;
    const cl::NDRange items(columns, static_cast<std::size_t>(stored_.height()));
    for (const cl::Kernel* kernel : {&surfaces_kernel_, &kernel_})
        device.queue().enqueueNDRangeKernel(*kernel, cl::NullRange, items, cl::NDRange(group, 1));
}

} // namespace fathom::bench
