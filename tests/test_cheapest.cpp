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
    // the cheaper ones first
    {"ssao", "float32", "fast", 0.2, "bars"},          {"ssao", "float32", "3 x 5", 0.065, "bars"},
    {"ssao", "float32", "balanced", 0.07, "bars"},     {"ssao", "float32", "accurate", 0.06, "bars"},
    {"normals", "float32", "neighbours", 0.4, "room"}, {"normals", "float32", "least squares", 0.5, "room"},
    {"normals", "uint16", "neighbours", 5, "room"},    {"normals", "uint16", "least squares", 2, "room"},
};

std::vector<MeasuredMethod> known(const char* operation, const char* storage) {
    return measured_for(table, operation, storage);
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

TEST_CASE("max_error: errors are those of the storage, or the worst of any") {
    const auto errors = [](const char* operation, const char* storage) {
        std::vector<double> all;
        for (const MeasuredMethod& each : known(operation, storage))
            all.push_back(each.error);
        return all;
    };
    CHECK(errors("normals", "float32") == std::vector{0.4, 0.5});
    CHECK(errors("normals", "uint16") == std::vector{5.0, 2.0});
    CHECK(errors("normals", "uint24") == std::vector{5.0, 2.0});
    CHECK(errors("ssao", "uint16") == errors("ssao", "float32"));
    CHECK(errors("linearize", "float32").empty());
    CHECK(known("ssao", "float32")[1].method == "3 x 5");
    CHECK(known("ssao", "float32")[1].scene == "bars");
}

TEST_CASE("max_error: the library chooses by its table") {
    for (const Operation operation : {Operation::ssao, Operation::dof, Operation::normals})
        for (const Storage storage : {Storage::float32, Storage::uint16}) {
            const std::vector<MeasuredMethod> list =
                measured_for(measured_methods(), to_string(operation), to_string(storage));
            REQUIRE(list.size() >= 2);
            for (const MeasuredMethod& each : list) { // the first of the list that meets its error
                const auto expected =
                    std::ranges::find_if(list, [&](const MeasuredMethod& other) { return other.error <= each.error; });
                const MeasuredMethod found = cheapest_method(operation, ramp(storage), each.error);
                INFO(to_string(operation) << ' ' << to_string(storage) << ' ' << each.method);
                CHECK(found.method == expected->method);
                CHECK(found.error == expected->error);
                CHECK(found.scene == expected->scene);
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
