// What max_error chooses, from a table made up here, and that the options then stand for the chosen method.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "seen.hpp"

#include "operations/cheapest.hpp"
#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using fathom::images::floats;
using fathom::images::same_bits;
using fathom::seen::refusal;

namespace {

constexpr Measured table[] = {
    {"ssao", "float32", "fast", 0.2, "bars", 50, "chip, small"},
    {"ssao", "float32", "balanced", 0.07, "bars", 100, "chip"},
    {"ssao", "float32", "accurate", 0.06, "bars", 300, "chip"},
    {"ssao", "float32", "3 x 5", 0.065, "bars", 100, "chip"},
    {"normals", "float32", "neighbours", 0.4, "room", 3, "chip"},
    {"normals", "float32", "least squares", 0.5, "room", 20, "chip"},
    {"normals", "uint16", "neighbours", 5, "room", 4, "chip"},
    {"normals", "uint16", "least squares", 2, "room", 19, "chip"},
};

std::vector<MeasuredMethod> known(const char* operation, const char* storage) {
    return measured_for(table, operation, storage);
}

std::string choice(const char* operation, const char* storage, double max_error) {
    const std::optional<MeasuredMethod> found = cheapest_method(known(operation, storage), max_error);
    return found ? found->method : "";
}

const Device& device() {
    return oracle::device(Arithmetic::fp64);
}

// Of rows that fill whole multiples of 64 bytes.
template <typename Value>
Image uploaded(Element element, const Layout& layout, const std::vector<Value>& values) {
    const Image image(device(), element, layout);
    runtime::queue_of(device()).enqueueWriteBuffer(runtime::buffer_of(image), CL_TRUE, 0, values.size() * sizeof(Value),
                                                   values.data());
    return image;
}

StoredDepth ramp(Storage storage = Storage::float32) {
    constexpr int width = 64, height = 32;
    const Camera camera = fathom::seen::camera_of(perspective(1.0, 2.0, {0.5, 100}), width, height);
    std::vector<float> values(width * height);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = 0.9f + 0.05f * static_cast<float>(i % 23) / 23;
    if (storage == Storage::float32)
        return {uploaded(Element::f32, {width, height}, values), camera};
    std::vector<std::uint16_t> codes;
    for (const float value : values)
        codes.push_back(static_cast<std::uint16_t>(std::lround(65535 * value)));
    return {uploaded(Element::u16, {width, height}, codes), camera, storage};
}

// As the tables have it.
std::string name_of(const SsaoOptions& options) {
    const Sampling& sampling = std::get<Sampling>(options.sampling);
    const std::string name = sampling.slices
                                 ? std::to_string(*sampling.slices) + " x " + std::to_string(sampling.samples.value())
                             : sampling.quality == Quality::fast     ? "fast"
                             : sampling.quality == Quality::balanced ? "balanced"
                                                                     : "accurate";
    return name + (sampling.half_resolution ? ", half resolution" : "");
}

} // namespace

TEST_CASE("max_error: the cheapest within the error of its worst scene") {
    CHECK(choice("ssao", "float32", 1) == "fast");
    // The error counts in the worst scene, which is neither the first nor the last; an equal error is enough.
    CHECK(choice("ssao", "float32", 0.2) == "fast");
    CHECK(choice("ssao", "float32", 0.19) == "3 x 5");
    CHECK(choice("ssao", "float32", 0.0625) == "accurate");
    const MeasuredMethod fast = *cheapest_method(known("ssao", "float32"), 1);
    CHECK(fast.error == 0.2);
    CHECK(fast.scene == "bars");
    CHECK(fast.ns_per_pixel == Approx(50));
    CHECK(fast.device == "chip, small");
}

TEST_CASE("max_error: half resolution is a way of its own") {
    constexpr Measured halves[] = {{"ssao", "float32", "fast", 0.2, "bars", 5, "chip"},
                                   {"ssao", "float32", "fast, half resolution", 0.25, "bars", 2, "chip"},
                                   {"ssao", "float32", "3 x 5, half resolution", 0.15, "bars", 7, "chip"}};
    const std::vector<MeasuredMethod> list = measured_for(halves, "ssao", "float32");
    CHECK(list.size() == 3);
    CHECK(cheapest_method(list, 0.3)->method == "fast, half resolution");
    CHECK(cheapest_method(list, 0.2)->method == "fast");
    CHECK(cheapest_method(list, 0.15)->method == "3 x 5, half resolution");
}

TEST_CASE("max_error: not half resolution for a row that it does not look from") {
    const StoredDepth stored = ramp(), row = stored.region(0, 5, 64, 1), two = stored.region(0, 5, 64, 2);
    const auto half_resolution = [](const StoredDepth& depth, double max_error) {
        return std::get<Sampling>(chosen(depth, SsaoOptions{.sampling = MaxError{max_error}}).sampling).half_resolution;
    };
    for (const double max_error : {0.06, 0.08, 0.1, 0.15, 0.2, 0.25, 0.3, 0.5, 1.0}) {
        CHECK(half_resolution(two, max_error) == half_resolution(stored, max_error));
        CHECK(!half_resolution(row, max_error));
    }
    CHECK(half_resolution(stored, 1)); // the cheapest of all
}

TEST_CASE("max_error: among equally cheap ones the more exact") {
    CHECK(choice("ssao", "float32", 0.1) == "3 x 5"); // as cheap as balanced, which comes first
}

TEST_CASE("max_error: nothing, where nothing meets it") {
    CHECK(choice("ssao", "float32", 0.0599).empty());
    CHECK(choice("linearize", "float32", 1e9).empty());
    CHECK(!cheapest_method(std::vector<MeasuredMethod>{}, 1));
}

TEST_CASE("max_error: errors are those of the storage, or the worst of any") {
    CHECK(choice("normals", "float32", 0.45) == "neighbours"); // of the mean, not the root of the mean square
    CHECK(choice("normals", "float32", 0.39).empty());
    CHECK(choice("normals", "uint16", 2) == "least squares");
    CHECK(choice("normals", "uint16", 5) == "neighbours");
    CHECK(choice("normals", "uint24", 2) == "least squares");
    CHECK(choice("normals", "uint24", 1.9).empty());
    CHECK(choice("ssao", "uint16", 0.2) == "fast");
    const std::vector<MeasuredMethod> worst = known("normals", "uint24");
    REQUIRE(worst.size() == 2);
    CHECK(worst[0].error == 5);
    CHECK(worst[0].ns_per_pixel == Approx(4));
    CHECK(worst[1].ns_per_pixel == Approx(20));
}

TEST_CASE("max_error: the library chooses by its table") {
    for (const Operation operation : {Operation::ssao, Operation::dof, Operation::normals})
        for (const Storage storage : {Storage::float32, Storage::uint16}) {
            const std::vector<MeasuredMethod> list =
                measured_for(measured_methods(), to_string(operation), to_string(storage));
            REQUIRE(list.size() >= 2);
            for (const MeasuredMethod& each : list) {
                const MeasuredMethod expected = *cheapest_method(list, each.error),
                                     found = cheapest_method(operation, ramp(storage), each.error);
                INFO(to_string(operation) << ' ' << to_string(storage) << ' ' << each.method);
                CHECK(found.method == expected.method);
                CHECK(found.error == expected.error);
                CHECK(found.error <= each.error);
                CHECK(found.ns_per_pixel <= each.ns_per_pixel);
            }
        }
}

TEST_CASE("max_error: depth of 16 bits is judged as such in floats too") {
    StoredDepth stored = ramp();
    const double of_floats = cheapest_method(Operation::normals, stored, 90).error;
    stored.camera.depth_bits = 16;
    CHECK(cheapest_method(Operation::normals, stored, 90).error ==
          cheapest_method(Operation::normals, ramp(Storage::uint16), 90).error);
    CHECK(cheapest_method(Operation::normals, stored, 90).error > of_floats);
}

TEST_CASE("max_error: an operation with a tolerance has the bits of what is chosen", "[slow]") {
    const StoredDepth stored = ramp();
    const std::vector<MeasuredMethod> list = measured_for(measured_methods(), "ssao", "float32");
    for (const MeasuredMethod& each : list) {
        const SsaoOptions asked{.sampling = MaxError{each.error}}, settled = chosen(stored, asked);
        const std::string method = cheapest_method(Operation::ssao, stored, each.error).method;
        INFO(method);
        CHECK(name_of(settled) == method);
        CHECK(same_bits(floats(ssao(stored, 0.5, asked).visibility), floats(ssao(stored, 0.5, settled).visibility)));
    }

    std::vector<float> colors(64 * 32 * 3, 0.5f);
    for (std::size_t i = 0; i < colors.size(); i += 7)
        colors[i] = 0;
    const Image color = uploaded(Element::f32, {64, 32, 3}, colors);
    const CircleOfConfusion coc{8, 40};
    const DofOptions blur{.quality = MaxError{1}};
    const std::vector<float> found = floats(dof(stored, color, coc, blur));
    CHECK(same_bits(found, floats(dof(stored, color, coc, chosen(stored, blur)))));
    CHECK(!same_bits(found, floats(dof(stored, color, coc)))); // the cheapest of all is not the default

    const NormalsOptions any{.method = MaxError{90}};
    CHECK(std::get<NormalMethod>(chosen(stored, any).method) != NormalMethod::automatic);
    CHECK(same_bits(floats(normals(stored, any)), floats(normals(stored, chosen(stored, any)))));
}

TEST_CASE("max_error: it is refused where nothing meets it, and where it is no error") {
    const StoredDepth stored = ramp();
    const auto said = [](const std::string& message, const char* part) {
        INFO(message);
        CHECK(contains(message, part));
    };
    const std::vector<MeasuredMethod> list = measured_for(measured_methods(), "ssao", "float32");
    const MeasuredMethod& best = *std::ranges::min_element(list, {}, &MeasuredMethod::error);
    const std::string none = refusal([&] { ssao(stored, 1, {.sampling = MaxError{1e-6}}); });
    said(none, "max_error = 1e-06");
    said(none, best.method.c_str());
    said(none, best.scene.c_str());
    for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
        said(refusal([&] { ssao(stored, 1, {.sampling = MaxError{wrong}}); }), "max_error = ");
    said(refusal([&] { cheapest_method(static_cast<Operation>(3), stored, 1); }), "operation = 3");
}
