// How a device rounds. Its cases are those that approximations get wrong first.

#include "runtime/probe.hpp"

#include "runtime/launch.hpp"
#include "runtime/scratch.hpp"
#include "text.hpp"

#include <fathom/image.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>

namespace fathom {
namespace runtime {
namespace {

constexpr std::size_t case_count = std::size_t{1} << 20;

template <typename Number>
using Bits = std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint64_t>;

/// Digits of a significand, and a whole number of so many bits.
template <typename Number>
constexpr int digits = std::numeric_limits<Number>::digits;

using Random = std::mt19937_64;
__extension__ using Product = unsigned __int128;

std::uint64_t low_bits(std::uint64_t value, int count) {
    return value & ((std::uint64_t{1} << count) - 1);
}

// A whole number of exactly `count` bits.
std::uint64_t whole(Random& random, int count) {
    return low_bits(random(), count - 1) | std::uint64_t{1} << (count - 1);
}

// 1 / odd modulo 2^64: each step doubles the bits that are right.
std::uint64_t inverse_of_odd(std::uint64_t odd) {
    std::uint64_t inverse = odd;
    for (int right = 3; right < 64; right *= 2)
        inverse *= 2 - odd * inverse;
    return inverse;
}

// A square root of r modulo 2^count, for r that is 1 modulo 8: each bit follows from those below it.
std::uint64_t root_modulo(std::uint64_t r, int count) {
    std::uint64_t root = 1;
    for (int bit = 3; bit < count; ++bit)
        root += (root * root - r) >> bit & 1 ? std::uint64_t{1} << (bit - 1) : 0;
    return low_bits(root, count);
}

// x / y that lies beside the middle between two neighbours by 1 / y of the last place: as close as any.
template <typename Number>
void add_quotient(Cases<Number>& cases, Random& random) {
    constexpr int p = digits<Number>;
    const std::uint64_t y = whole(random, p) | 1;
    const std::uint64_t inverse = low_bits(inverse_of_odd(y), p + 1);
    const bool above = inverse >> p == 0;
    const std::uint64_t middle =
        above ? (std::uint64_t{1} << (p + 1)) - inverse : inverse; // p + 1 bits, the last one set
    const auto x = static_cast<std::uint64_t>((Product{middle} * y + (above ? 1 : 0)) >> (p + 1));
    const int scale = static_cast<int>(random() % 60) - 30;
    cases.a.push_back(std::ldexp(static_cast<Number>(x), scale));
    cases.b.push_back(static_cast<Number>(y));
    cases.c.push_back(random() & 1 ? Number{0} : -Number{0});
}

// A number whose root lies close beside the middle between two neighbours: the middle's square is larger by r.
template <typename Number>
void add_root(Cases<Number>& cases, Random& random) {
    constexpr int p = digits<Number>;
    const std::uint64_t r = 1 + 8 * (random() % 8192), root = low_bits(root_modulo(r, p + 2), p + 1);
    const std::uint64_t middle = root >> p == 0 ? (std::uint64_t{1} << (p + 1)) - root : root; // its square is r, too
    const auto x = static_cast<std::uint64_t>((Product{middle} * middle - r) >> (p + 2));
    const int scale = 2 * (static_cast<int>(random() % 30) - 15);
    cases.a.push_back(std::ldexp(static_cast<Number>(x), scale + (p & 1)));
    cases.b.push_back(static_cast<Number>(whole(random, p)));
    cases.c.push_back(1);
}

// A product that cancels: all that is left is what a rounded product loses.
template <typename Number>
void add_fused(Cases<Number>& cases, Random& random) {
    constexpr int p = digits<Number>;
    const auto a = static_cast<Number>(whole(random, p)), b = static_cast<Number>(whole(random, p));
    cases.a.push_back(a);
    cases.b.push_back(b);
    cases.c.push_back(-(a * b));
}

// Operands or results below the least normal number.
template <typename Number>
void add_denormal(Cases<Number>& cases, Random& random) {
    using Limits = std::numeric_limits<Number>;
    constexpr int p = digits<Number>;
    const Number part = std::ldexp(static_cast<Number>(whole(random, p)), -p); // from 0.5 to 1
    const Number tiny = Limits::min() * std::ldexp(part, -static_cast<int>(random() % (p - 1)));
    const bool as_operand = random() & 1;
    cases.a.push_back(as_operand ? tiny : Limits::min() * part * 2);
    cases.b.push_back(as_operand ? 1 + part : 4 + part);
    cases.c.push_back(as_operand ? tiny : -Limits::min());
}

// Counts from the least number to the greatest.
template <typename Number>
std::int64_t place_of(Number value) {
    using Signed = std::make_signed_t<Bits<Number>>;
    const auto bits = std::bit_cast<Signed>(value);
    return bits < 0 ? -static_cast<std::int64_t>(bits & std::numeric_limits<Signed>::max()) : bits;
}

template <typename Number>
std::uint64_t ulps_between(Number right, Number found) {
    if (std::isnan(right) || std::isnan(found))
        return std::isnan(right) == std::isnan(found) ? 0 : std::numeric_limits<std::uint64_t>::max();
    const std::int64_t a = place_of(right), b = place_of(found);
    return a > b ? static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b)
                 : static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
}

template <typename Number>
bool is_denormal(Number value) {
    return value != 0 && std::abs(value) < std::numeric_limits<Number>::min();
}

// A double is two words: kernels for devices without it take no image of doubles.
template <typename Number>
Results<Number> found_by(const Device& device, const Cases<Number>& cases) {
    constexpr bool is_float = sizeof(Number) == 4;
    constexpr Element element = is_float ? Element::f32 : Element::u32;
    constexpr int words = sizeof(Number) / 4;
    const int count = static_cast<int>(cases.a.size()), width = is_float ? device.options().vector_width : 1;
    const auto on_device = [&](const std::vector<Number>& values) {
        return Image::from_host(device, element, values.data(), {words * count, 1});
    };
    const Image a = on_device(cases.a), b = on_device(cases.b), c = on_device(cases.c),
                results(device, element, {words * count, 7});
    launch(device, kernel(device, is_float ? "arithmetic" : "arithmetic_fp64", {{"V", width}, {"STREAM", 0}}),
           {static_cast<std::size_t>(count / width), 1}, a, b, c, results,
           params::probe_params{static_cast<params::u32>(count)});
    const std::vector<Number> values = on_host<Number>(results);
    const auto row = [&](int index) {
        const auto first = values.begin() + std::ptrdiff_t{index} * count;
        return std::vector<Number>(first, first + count);
    };
    return {row(0), row(1), row(2), row(3), row(4), row(5), row(6)};
}

template <typename Number>
DeviceArithmetic tried(const Device& device) {
    static const Cases<Number> cases = hard_cases<Number>(case_count);
    static const Results<Number> right = right_results(cases);
    return judged(cases, right, found_by(device, cases));
}

} // namespace

template <typename Number>
Cases<Number> hard_cases(std::size_t count) {
    Cases<Number> cases;
    Random random(1);
    for (std::size_t i = 0; i < count; ++i) {
        constexpr void (*add[])(Cases<Number>&, Random&) = {add_quotient<Number>, add_root<Number>, add_fused<Number>,
                                                            add_denormal<Number>};
        add[i % 4](cases, random);
    }
    return cases;
}

template <typename Number>
Results<Number> right_results(const Cases<Number>& cases) {
    Results<Number> results;
    for (std::size_t i = 0; i < cases.a.size(); ++i) {
        results.quotient.push_back(cases.a[i] / cases.b[i]);
        results.root.push_back(std::sqrt(cases.a[i]));
        results.fused.push_back(std::fma(cases.a[i], cases.b[i], cases.c[i]));
        results.second_quotient.push_back(cases.c[i] / cases.b[i]);
        results.by_constant.push_back(cases.a[i] / static_cast<Number>(params::probe_divisor));
        results.sum.push_back(cases.a[i] * cases.b[i] + cases.c[i]); // fathom is compiled with -ffp-contract=off
        results.sum_with_zero.push_back(cases.c[i] + Number{0});
    }
    return results;
}

template <typename Number>
DeviceArithmetic judged(const Cases<Number>& cases, const Results<Number>& right, const Results<Number>& found) {
    DeviceArithmetic arithmetic;
    std::uint64_t sum_ulp = 0;
    for (std::size_t i = 0; i < cases.a.size(); ++i) {
        const bool small_operand = is_denormal(cases.a[i]) || is_denormal(cases.b[i]) || is_denormal(cases.c[i]);
        const auto count = [&](Number expected, Number got, std::uint64_t& worst) {
            const std::uint64_t off = ulps_between(expected, got);
            arithmetic.signed_zeros &= expected != 0 || got != 0 || std::signbit(expected) == std::signbit(got);
            if (off != 0 && got == 0 && (small_operand || is_denormal(expected)))
                arithmetic.denormals = false;
            else
                worst = std::max(worst, off);
        };
        count(right.quotient[i], found.quotient[i], arithmetic.division_ulp);
        count(right.root[i], found.root[i], arithmetic.sqrt_ulp);
        count(right.fused[i], found.fused[i], arithmetic.fma_ulp);
        count(right.second_quotient[i], found.second_quotient[i], arithmetic.division_ulp);
        count(right.by_constant[i], found.by_constant[i], arithmetic.division_ulp);
        count(right.sum[i], found.sum[i], sum_ulp);
        count(right.sum_with_zero[i], found.sum_with_zero[i], sum_ulp);
    }
    arithmetic.separate_products = sum_ulp == 0;
    return arithmetic;
}

template Cases<float> hard_cases(std::size_t);
template Cases<double> hard_cases(std::size_t);
template Results<float> right_results(const Cases<float>&);
template Results<double> right_results(const Cases<double>&);
template DeviceArithmetic judged(const Cases<float>&, const Results<float>&, const Results<float>&);
template DeviceArithmetic judged(const Cases<double>&, const Results<double>&, const Results<double>&);

} // namespace runtime

bool DeviceArithmetic::exact() const {
    return division_ulp == 0 && sqrt_ulp == 0 && fma_ulp == 0 && separate_products && denormals && signed_zeros &&
           fp64.value_or(true);
}

DeviceArithmetic probe_arithmetic(const Device& device) {
    DeviceArithmetic found = runtime::tried<float>(device);
    if (device.options().arithmetic == Arithmetic::fp64)
        found.fp64 = runtime::tried<double>(device).exact();
    return found;
}

std::string to_string(const DeviceArithmetic& arithmetic) {
    if (arithmetic.exact())
        return arithmetic.fp64 ? "exact" : "exact, without double";
    std::string said;
    const auto add = [&](bool wrong, const auto&... parts) {
        if (wrong)
            said += text(said.empty() ? "" : ", ", parts...);
    };
    add(arithmetic.division_ulp > 0, "division ", arithmetic.division_ulp, " ulp");
    add(arithmetic.sqrt_ulp > 0, "square root ", arithmetic.sqrt_ulp, " ulp");
    add(arithmetic.fma_ulp > 0, "fused products ", arithmetic.fma_ulp, " ulp");
    add(!arithmetic.separate_products, "a * b + c is rounded once");
    add(!arithmetic.denormals, "denormals become 0");
    add(!arithmetic.signed_zeros, "signs of 0 are lost");
    add(!arithmetic.fp64.value_or(true), "double is not exact");
    return said;
}

} // namespace fathom
