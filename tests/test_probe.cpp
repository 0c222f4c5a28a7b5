// The arithmetic of a device: cases that are as hard as they claim, and wrong results that are found.

#include "catch.hpp"
#include "runtime/probe.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::runtime;

namespace {

constexpr std::size_t count = std::size_t{1} << 16;

// How far a value lies from the middle between two floats, in units in the last place of a float.
double from_middle(double value) {
    int exponent = 0;
    const double places = std::ldexp(std::frexp(value, &exponent), 24);
    return std::abs(places - std::floor(places) - 0.5);
}

template <typename Number, typename Change>
DeviceArithmetic judged_after(const Change& change) {
    const Cases<Number> cases = hard_cases<Number>(count);
    const Results<Number> right = right_results(cases);
    Results<Number> found = right;
    for (std::size_t i = 0; i < count; ++i)
        change(cases.a[i], cases.b[i], cases.c[i], found.quotient[i], found.root[i], found.fused[i]);
    return judged(cases, right, found);
}

template <typename Number>
Number flushed(Number value) {
    return std::abs(value) < std::numeric_limits<Number>::min() ? 0 : value;
}

} // namespace

TEST_CASE("probe: quotients and roots lie beside the middle between two floats") {
    const Cases<float> cases = hard_cases<float>(count);
    for (std::size_t i = 0; i < count; i += 4) {
        const double a = static_cast<double>(cases.a[i]), b = static_cast<double>(cases.b[i]);
        REQUIRE(from_middle(a / b) < 0x1p-22); // 1 / b of the last place
        REQUIRE(from_middle(std::sqrt(static_cast<double>(cases.a[i + 1]))) < 65536 * 0x1p-24);
    }
}

TEMPLATE_TEST_CASE("probe: what rounds otherwise is found", "", float, double) {
    using Number = TestType;
    const auto nothing = [](auto...) {};
    CHECK(judged_after<Number>(nothing).exact());

    const auto divided =
        judged_after<Number>([](Number a, Number b, Number, Number& q, Number&, Number&) { q = a * (1 / b); });
    CHECK(divided.division_ulp >= 1);
    CHECK(divided.division_ulp <= 2);
    CHECK((divided.sqrt_ulp == 0 && divided.fma_ulp == 0));

    // A compiler that shares a reciprocal between two quotients, or knows that of a constant, leaves single ones alone.
    const Cases<Number> cases = hard_cases<Number>(count);
    const Results<Number> right = right_results(cases);
    Results<Number> shared = right, by_constant = right;
    for (std::size_t i = 0; i < count; ++i) {
        shared.second_quotient[i] = cases.c[i] * (1 / cases.b[i]);
        by_constant.by_constant[i] = cases.a[i] * (Number{1} / 65535);
    }
    CHECK(judged(cases, right, shared).division_ulp >= 1);
    CHECK(judged(cases, right, by_constant).division_ulp >= 1);

    // A compiler that fuses what is to be rounded twice, and one that takes -0 for 0.
    Results<Number> fused = right, unsigned_zeros = right;
    for (std::size_t i = 0; i < count; ++i) {
        fused.sum[i] = std::fma(cases.a[i], cases.b[i], cases.c[i]);
        unsigned_zeros.sum_with_zero[i] = cases.c[i];
    }
    CHECK(to_string(judged(cases, right, fused)) == "a * b + c is rounded once");
    CHECK(to_string(judged(cases, right, unsigned_zeros)) == "signs of 0 are lost");

    const auto rooted =
        judged_after<Number>([](Number a, Number, Number, Number&, Number& r, Number&) { r = a * (1 / std::sqrt(a)); });
    CHECK(rooted.sqrt_ulp >= 1);
    CHECK((rooted.division_ulp == 0 && rooted.fma_ulp == 0));

    const auto unfused = judged_after<Number>([](Number a, Number b, Number c, Number&, Number&, Number& f) {
        const volatile Number product = a * b;
        f = product + c;
    });
    CHECK(unfused.fma_ulp > 1000);
    CHECK((unfused.division_ulp == 0 && unfused.sqrt_ulp == 0));

    const auto no_denormals = judged_after<Number>(
        [](Number a, Number b, Number, Number& q, Number&, Number&) { q = flushed(flushed(a) / flushed(b)); });
    CHECK_FALSE(no_denormals.denormals);
    CHECK(no_denormals.division_ulp == 0);
    CHECK_FALSE(no_denormals.exact());
    CHECK(to_string(no_denormals) == "denormals become 0");
    CHECK(to_string(judged_after<Number>(nothing)) == "exact, without double");
}

TEST_CASE("probe: a CPU rounds as IEEE 754 says, in vectors of every width") {
    for (const int width : {1, 4, 8, 16}) {
        const Device device = test_device({.vector_width = width});
        const DeviceArithmetic found = probe_arithmetic(device);
        INFO(to_string(found));
        CHECK((found.exact() || device.info().platform == "rusticl")); // which makes denormals 0
        CHECK(found.fp64 == (device.info().fp64 ? std::optional(true) : std::nullopt));
    }
    const Device two_float = test_device({.arithmetic = Arithmetic::two_float});
    const DeviceArithmetic found = probe_arithmetic(two_float);
    CHECK_FALSE(found.fp64);
    CHECK((to_string(found) == "exact, without double" || two_float.info().platform == "rusticl"));
}
