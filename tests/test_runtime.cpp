// Devices, launches and images: what they share, what they copy and what they refuse.

#include "catch.hpp"
#include "operations/parameters.hpp"
#include "runtime/memory.hpp"
#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

const Device& device() {
    static const Device opened = Device::open("cpu");
    return opened;
}

template <typename Thrown, typename Action>
std::string message_of(const Action& action) {
    try {
        action();
    } catch (const Thrown& error) {
        return error.what();
    }
    return "nothing was thrown";
}

Camera camera(int width, int height) {
    return {.projection = perspective(1.0, 1.0, {1, 4}), .width = width, .height = height};
}

runtime::Kernel& linearize_kernel() {
    return runtime::kernel(
        device(), "linearize",
        {{"V", 1}, {"STREAM", 0}, {"FORM", 0}, {"STORAGE", 0}, {"PIXEL_TERMS", 0}, {"W_IS_DEPTH", 1}, {"LENS", 0}});
}

std::vector<float> counted(std::size_t count) {
    std::vector<float> values(count);
    std::iota(values.begin(), values.end(), 0.0f);
    return values;
}

} // namespace

TEST_CASE("runtime: a device answers to its kind, its index and a part of its name", "[runtime]") {
    const auto all = list_devices();
    REQUIRE(!all.empty());
    for (std::size_t i = 0; i < all.size(); ++i) {
        CHECK(all[i].index == static_cast<int>(i));
        CHECK(!all[i].name.empty());
        CHECK(all[i].compute_units > 0);
        CHECK(Device::open(std::to_string(i)).info().name == all[i].name);
        CHECK(Device::open(all[i].name.substr(0, 4)).info().index <= static_cast<int>(i));
    }
    CHECK(device().info().cpu);
    const bool has_gpu = std::any_of(all.begin(), all.end(), [](const DeviceInfo& info) { return !info.cpu; });
    CHECK(Device::open().info().cpu == !has_gpu);
}

TEST_CASE("runtime: a device that is not there is named beside those that are", "[runtime]") {
    const auto all = list_devices();
    for (const char* wanted : {"no such device", "99", "-1"}) {
        const std::string message = message_of<NoDevice>([&] { Device::open(wanted); });
        INFO(message);
        CHECK(contains(message, wanted));
        for (const DeviceInfo& info : all)
            CHECK(contains(message, info.name));
    }
}

TEST_CASE("runtime: options of a device have a range", "[runtime]") {
    for (const int vector_width : {-1, 2, 3, 5, 32}) {
        const auto message =
            message_of<std::invalid_argument>([&] { Device::open("cpu", {.vector_width = vector_width}); });
        CHECK(contains(message, "vector_width = " + std::to_string(vector_width)));
    }
    for (const int group_size : {-1, 1025})
        CHECK_THROWS_AS(Device::open("cpu", {.group_size = group_size}), std::invalid_argument);
    CHECK(device().options().vector_width == 16);
    CHECK(device().options().group_size == 64);
    CHECK(device().options().arithmetic == (device().info().fp64 ? Arithmetic::fp64 : Arithmetic::two_float));
    CHECK(Device::open("cpu", {.arithmetic = Arithmetic::two_float}).options().arithmetic == Arithmetic::two_float);
}

TEST_CASE("runtime: a launch refuses arguments that the kernel does not declare", "[runtime]") {
    const Image floats(device(), Element::f32, {4, 4}), shorts(device(), Element::u16, {4, 4});
    const params::grid_params grid{};
    const params::depth_params depth{};
    const params::ray_params rays{};
    runtime::Kernel& kernel = linearize_kernel();
    const runtime::Range range{1, 1};

    const auto fewer = message_of<Error>([&] { runtime::launch(device(), kernel, range, floats, floats, grid); });
    CHECK(contains(fewer, "takes 5 arguments and was given 3"));
    CHECK(contains(fewer, "kernels/camera/linearize.cl"));
    const auto type =
        message_of<Error>([&] { runtime::launch(device(), kernel, range, shorts, floats, grid, depth, rays); });
    CHECK(contains(type, "argument 0 is a float* and was given a ushort*"));
    const auto order =
        message_of<Error>([&] { runtime::launch(device(), kernel, range, floats, floats, depth, grid, rays); });
    CHECK(contains(order, "argument 2 is a grid_params and was given a depth_params"));
    CHECK_NOTHROW(runtime::launch(device(), kernel, range, floats, floats, grid, depth, rays));
    device().finish();
}

TEST_CASE("runtime: types of arguments are compared whatever the driver's way to spell them", "[runtime]") {
    for (const char* spelling :
         {"float*", "float *", "__global float*", "global const float *", "const __global float * restrict"})
        CHECK(runtime::bare_type(spelling) == "float*");
    for (const char* spelling : {"grid_params", "struct grid_params", "const struct grid_params "})
        CHECK(runtime::bare_type(spelling) == "grid_params");
    CHECK(runtime::bare_type(std::string_view("uint*\0*", 7)) == "uint*");
    CHECK(type_name(params::circle_params{}) == std::string("circle_params"));
}

TEST_CASE("runtime: a group is as large as its kernel allows", "[runtime]") {
    const auto kernel = [&](std::size_t limit) {
        runtime::Kernel one = linearize_kernel();
        one.group_limit = limit;
        return one;
    };
    runtime::Kernel unasked = kernel(0), narrow = kernel(24), wide = kernel(4096);
    CHECK(runtime::group_size(device(), narrow) == 24);
    CHECK(runtime::group_size(device(), wide) == 64);
    CHECK(runtime::group_size(device(), unasked) <= 64);
    CHECK(unasked.group_limit > 0);
    const std::vector<float> stored(100, 0.5f);
    const Image image = Image::from_host(device(), Element::f32, stored.data(), {100, 1});
    const Image target(device(), Element::f32, {100, 1});
    CHECK_NOTHROW(runtime::launch(device(), narrow, {7, 1}, image, target, params::grid_params{},
                                  params::depth_params{}, params::ray_params{}));
    device().finish();
}

TEST_CASE("runtime: a kernel that does not build shows its log, with the file that a person would open", "[runtime]") {
    const auto message = message_of<Error>([] { runtime::kernel(device(), "linearize", {{"V", 3}}); });
    INFO(message);
    CHECK(contains(message, "kernels/camera/linearize.cl does not build"));
    CHECK(contains(message, "V must be 1, 4, 8 or 16"));
    CHECK(contains(message, "; try another device or driver"));
    CHECK_THROWS_AS(runtime::kernel(device(), "no_such_kernel", {}), Error);
}

TEST_CASE("runtime: an image from host memory is that memory on a CPU", "[runtime]") {
    std::vector<float> stored{0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    std::vector<float> depth(5, -1.0f);
    // An address that is only as aligned as a float.
    const Image source = Image::from_host(device(), Element::f32, stored.data() + 1, {5, 1});
    const Image result = Image::onto_host(device(), Element::f32, depth.data(), {5, 1});
    stored[1] = 0.0f; // after the image was made: seen, because nothing was copied
    stored[5] = 5.0f;
    linearize({source, camera(5, 1)}, result);
    device().finish();
    CHECK(depth[0] == 1);
    CHECK(std::isnan(depth[4]));
    result.download(depth.data());
    CHECK(depth[0] == 1);
}

TEST_CASE("runtime: a result on a part of its input's host memory is refused, on all of it the call is in place",
          "[runtime]") {
    std::vector<float> values = counted(40);
    const Image source = Image::from_host(device(), Element::f32, values.data(), {17, 1});
    const Image same = Image::onto_host(device(), Element::f32, values.data(), {17, 1});
    const Image partly = Image::onto_host(device(), Element::f32, values.data() + 16, {17, 1});
    const Image beside = Image::onto_host(device(), Element::f32, values.data() + 17, {17, 1});
    CHECK_THROWS_AS(linearize({source, camera(17, 1)}, partly), std::invalid_argument);
    CHECK_NOTHROW(linearize({source, camera(17, 1)}, beside));
    device().finish();
    const std::vector<float> apart(values.begin() + 17, values.begin() + 34);
    linearize({source, camera(17, 1)}, same);
    device().finish();
    CHECK(std::equal(apart.begin(), apart.end(), values.begin(), [](float a, float b) {
        return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
    }));
}

TEST_CASE("runtime: regions and strides address the same memory", "[runtime]") {
    const std::vector<float> values = counted(13 * 7);
    const Image whole = Image::from_host(device(), Element::f32, values.data(), {11, 7, 1, 13});
    const Image part = whole.region(2, 1, 8, 5).region(1, 2, 4, 3);
    CHECK(part.width() == 4);
    CHECK(part.height() == 3);
    CHECK(part.offset() == 3 * 13 + 3);
    CHECK(part.row_stride() == 13);
    CHECK(part.overlaps(whole));
    std::vector<float> packed(12), spread(3 * 6, -1.0f);
    part.download(packed.data());
    part.download(spread.data(), 6);
    for (std::size_t y = 0; y < 3; ++y)
        for (std::size_t x = 0; x < 6; ++x) {
            const float expected = values[(y + 3) * 13 + x + 3];
            if (x < 4)
                CHECK(packed[y * 4 + x] == expected);
            CHECK(spread[y * 6 + x] == (x < 4 ? expected : -1.0f));
        }

    const std::vector<float> triples = counted(3 * 5 * 4);
    const Image points = Image::from_host(device(), Element::f32, triples.data(), {5, 4, 3});
    std::vector<float> three(3);
    points.region(4, 3, 1, 1).download(three.data());
    CHECK(three == std::vector<float>{57, 58, 59});
}

TEST_CASE("runtime: a region outside, an empty image and a stride that is too short are refused", "[runtime]") {
    const Image image(device(), Element::f32, {8, 4});
    for (const auto& [x, y, w, h] :
         {std::array{-1, 0, 2, 2}, {0, -1, 2, 2}, {7, 0, 2, 1}, {0, 3, 1, 2}, {0, 0, 0, 1}, {2147483647, 0, 1, 1}})
        CHECK_THROWS_AS(image.region(x, y, w, h), std::invalid_argument);
    CHECK_THROWS_AS(Image(device(), Element::f32, {0, 4}), std::invalid_argument);
    CHECK_THROWS_AS(Image(device(), Element::f32, {4, -1}), std::invalid_argument);
    CHECK_THROWS_AS(Image(device(), Element::f32, {4, 4, 0}), std::invalid_argument);
    CHECK_THROWS_AS(Image::from_host(device(), Element::f32, nullptr, {4, 4, 3, 11}), std::invalid_argument);
    constexpr std::size_t longest = std::numeric_limits<std::size_t>::max() / 16;
    CHECK_THROWS_AS(Image(device(), Element::f32, {4, 4, 1, longest}), ImageTooLarge);
}

TEST_CASE("runtime: images that do not belong together are refused", "[runtime]") {
    const Image image(device(), Element::f32, {8, 4}), other(device(), Element::f32, {8, 5});
    CHECK_THROWS_AS(linearize({image, camera(8, 4), Storage::float32, 0, 1}), std::invalid_argument);
    CHECK_THROWS_AS(linearize({image, camera(8, 4)}, other), std::invalid_argument);
    const StoredDepth part{image.region(0, 0, 4, 4), camera(4, 4)};
    CHECK_THROWS_WITH(linearize(part, image.region(1, 0, 4, 4)), "the result shares memory with the stored depth");
    CHECK_THROWS_WITH(linearize(part, image.region(3, 0, 4, 4)), "the result shares memory with the stored depth");
    CHECK_NOTHROW(linearize(part, image.region(4, 0, 4, 4)));
    CHECK_NOTHROW(linearize({image, camera(8, 4)}, image)); // in place
}

// PoCL's device has doubles, so a kernel built with FP64=0 there could use one unseen. It does not: what is left when
// the FP64 branches are taken out names no double.
TEST_CASE("runtime: the two-float kernels have no double in them", "[runtime]") {
    for (const char* file : {"camera/linearize.cl", "camera/unproject.cl"}) {
        std::istringstream lines(runtime::assembled_source(file));
        int depth = 0, skipped_at = 0, checked = 0;
        for (std::string line; std::getline(lines, line);) {
            if (line.starts_with("#if")) {
                ++depth;
                if (line == "#if FP64")
                    skipped_at = depth;
            } else if (line.starts_with("#endif")) {
                skipped_at = skipped_at == depth ? 0 : skipped_at;
                --depth;
            } else if (line.starts_with("#else") && skipped_at == depth) {
                skipped_at = 0;
            }
            const std::string code = line.starts_with("#error") ? "" : line.substr(0, line.find("//"));
            if (skipped_at == 0) {
                ++checked;
                INFO(line);
                CHECK(!contains(code, "double"));
                CHECK(!contains(code, "fp64"));
            }
        }
        CHECK(checked > 100);
    }
}

// The bounds of linearize are promised on a device that keeps denormals: PoCL does, and says so.
TEST_CASE("runtime: the CPU device keeps denormals", "[runtime]") {
    const auto devices = runtime::context_of(device()).getInfo<CL_CONTEXT_DEVICES>();
    CHECK((devices.front().getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_DENORM) != 0);
    std::vector<float> values(17);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<float>(i + 1) * std::numeric_limits<float>::denorm_min();
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        const Device on = Device::open("cpu", {.arithmetic = arithmetic});
        Camera metric = camera(17, 1);
        metric.encoding = Encoding::view_z;
        std::vector<float> depth(17);
        linearize({Image::from_host(on, Element::f32, values.data(), {17, 1}), metric}).image.download(depth.data());
        CHECK(depth == values);
    }
}
