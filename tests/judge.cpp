#include "judge.hpp"
#include "test_device.hpp"

#include "quad.hpp"

#include <fathom/probe.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>

namespace oracle {
namespace {

using namespace fathom;

// The stored value at which a sum is zero, as a float.
float zero_of(const Quotient& q, const Sum& s, Quad x, Quad y) {
    const Quad u = -(s.low + s.x * x + s.y * y + s.one) / (s.high - s.low);
    return static_cast<float>(q.v_low + u * (q.v_high - q.v_low));
}

bool depends_on_stored(const Sum& s) {
    return s.high != s.low;
}

} // namespace

std::vector<float> stored_values(const Subject& subject, const Truth& truth, const Patch& patch, std::mt19937& random) {
    const Quotient& q = truth.quotient();
    const bool metric = is_metric(subject.camera.encoding);
    const auto low = static_cast<float>(q.v_low < q.v_high ? q.v_low : q.v_high);
    const auto high = static_cast<float>(q.v_low < q.v_high ? q.v_high : q.v_low);
    std::uniform_real_distribution<float> unit(0, 1);
    std::uniform_int_distribution<int> kind(0, 7), bits(0, 30), few(0, 12);
    const auto value = [&](int x, int y) -> float {
        const float part = std::ldexp(unit(random), -bits(random));
        if (metric)
            return std::copysign(std::ldexp(unit(random), bits(random) - 10), static_cast<float>(subject.camera.scale));
        switch (kind(random)) {
        case 0:
        case 1:
            return low + (high - low) * part;
        case 2:
        case 3:
            return high - (high - low) * part;
        case 4: {
            float v = unit(random) < 0.5f ? low : high;
            for (int i = few(random); i > 0; --i)
                v = std::nextafter(v, (low + high) / 2);
            return v;
        }
        case 5: {
            const Sum& sum = depends_on_stored(q.denominator) ? q.denominator : q.numerator;
            if (!depends_on_stored(sum))
                return low;
            float v = zero_of(q, sum, x + 0.5, y + 0.5);
            for (int i = few(random) - 6; i > 0; --i)
                v = std::nextafter(v, (low + high) / 2);
            return v;
        }
        default:
            return low + (high - low) * unit(random);
        }
    };
    std::vector<float> values;
    for (int y = patch.y; y < patch.y + patch.height; ++y)
        for (int x = patch.x; x < patch.x + patch.width; ++x)
            values.push_back(value(x, y));
    return values;
}

const std::vector<Arithmetic>& arithmetics() {
    static const std::vector<Arithmetic> all = device(Arithmetic::automatic).info().fp64
                                                   ? std::vector{Arithmetic::fp64, Arithmetic::two_float}
                                                   : std::vector{Arithmetic::two_float};
    return all;
}

const Device& device(Arithmetic arithmetic) {
    static const Device automatic = test_device();
    static const Device two_float = test_device({.arithmetic = Arithmetic::two_float});
    return arithmetic == Arithmetic::two_float ? two_float : automatic;
}

bool is_lost(Quad number) {
    static const bool kept = probe_arithmetic(device()).denormals;
    return !kept && number != 0 && fabsq(number) < Quad(0x1p-126);
}

const char* name(Arithmetic arithmetic) {
    return arithmetic == Arithmetic::fp64 ? "fp64" : "two-float";
}

Promise promise(Form form, Arithmetic arithmetic) {
    const bool fp64 = arithmetic == Arithmetic::fp64;
    const double condition = fp64 ? sum_condition_fp64 : sum_condition_two_float;
    switch (form) {
    case Form::exponential:
        return {linearize_ulp_exponential, condition, fp64 ? 0 : exponential_least_two_float};
    case Form::ray_distance:
    case Form::inverse_ray_distance:
        return {linearize_ulp_ray_distance, sum_condition_ray_distance};
    default:
        return {fp64 ? linearize_ulp_fp64 : linearize_ulp_two_float, condition};
    }
}

std::string judge(const Subject& subject, const Truth& truth, Form form, const Promise& promise, double v, double x,
                  double y, float got, Worst& worst) {
    const auto fault = [&](const std::string& what) {
        std::ostringstream message;
        message << std::hexfloat << subject.name << ", v = " << v << std::defaultfloat << " at (" << x << ", " << y
                << "): " << got << " but " << what << '\n';
        return message.str();
    };
    if (v != 0 && std::abs(v) < promise.least)
        return {};
    if (!truth.in_range(v))
        return std::isnan(got) ? std::string() : fault("the value is outside the range");
    const Quad exact = truth.depth(v, x, y);
    if (is_lost(v) || is_lost(exact))
        return {};
    const Quad condition = truth.condition(form, v, x, y);
    const Quad slack = isinfq(exact) ? 0 : promise.condition * condition * fabsq(exact);
    const auto condition_ulp = static_cast<double>(slack / ulp(exact));
    const double bound = promise.ulps + condition_ulp;
    if (!(promise.condition * condition < Quad(0.125)))
        return {}; // not even the sign is promised
    if (std::isnan(got)) {
        const Quad margin = slack + promise.ulps * ulp(exact);
        return truth.in_front(exact - margin) ? fault("the exact depth is " + text_of(exact)) : std::string();
    }
    if (!truth.in_front(exact + slack + promise.ulps * ulp(exact)))
        return fault("the exact depth, " + text_of(exact) + ", is not in front of the camera");
    const double error = error_in_ulp(got, exact);
    worst.add(error, bound, condition_ulp, static_cast<double>(condition), subject.name, v, x, y);
    if (error <= bound)
        return {};
    std::ostringstream message;
    message << "the exact depth is " << text_of(exact) << ": " << error << " ulp, allowed " << bound << " (condition "
            << static_cast<double>(condition) << ")";
    return fault(message.str());
}

std::string judge_all(const std::string& label, const std::vector<Subject>& subjects, Arithmetic arithmetic) {
    std::mt19937 random(20240521);
    Worst worst;
    Faults faults;
    for (const Subject& subject : subjects) {
        const Truth truth(subject, Storage::float32);
        const Form form = depth_form(subject.camera).form;
        for (const Patch& patch : default_patches) {
            std::vector<float> values = stored_values(subject, truth, patch, random);
            std::vector<float> depth(values.size());
            const Layout layout{patch.width, patch.height};
            const Image stored = Image::from_host(device(arithmetic), Element::f32, values.data(), layout);
            const Image result = Image::onto_host(device(arithmetic), Element::f32, depth.data(), layout);
            linearize({stored, subject.camera, Storage::float32, patch.x, patch.y}, result, {Background::decode});
            result.download(depth.data());
            for (std::size_t i = 0; i < values.size(); ++i) {
                const auto row = i / static_cast<std::size_t>(patch.width),
                           column = i % static_cast<std::size_t>(patch.width);
                faults.add(judge(subject, truth, form, promise(form, arithmetic), static_cast<double>(values[i]),
                                 patch.x + static_cast<double>(column) + 0.5, patch.y + static_cast<double>(row) + 0.5,
                                 depth[i], worst));
            }
        }
    }
    worst.print(label + ", " + name(arithmetic));
    return faults.text();
}

void Worst::add(double error, double bound, double condition_ulp, double condition_now, const std::string& name,
                double v, double x, double y) {
    ++checked;
    const auto place = [&] {
        std::array<char, 200> buffer{};
        std::snprintf(buffer.data(), buffer.size(), "%s, v = %a (%.9g) at (%.1f, %.1f)", name.c_str(), v, v, x, y);
        return std::string(buffer.data());
    };
    if (condition_ulp < 1.0 / 64 && error > ulps) {
        ulps = error;
        where = place();
    }
    if (!(error / bound <= share)) {
        share = error / bound;
        condition = condition_now;
        share_where = place();
    }
}

void Worst::add(const Worst& other) {
    if (other.ulps > ulps) {
        ulps = other.ulps;
        where = other.where;
    }
    if (!(other.share <= share)) {
        share = other.share;
        condition = other.condition;
        share_where = other.share_where;
    }
    checked += other.checked;
}

void Worst::print(const std::string& label) const {
    std::printf("%-44s %9ld values  worst %.4f ulp  %s\n", label.c_str(), checked, ulps, where.c_str());
    std::printf("%-44s %26.3f of the bound  %s, condition %.2g\n", "", share, share_where.c_str(), condition);
}

std::string text_of(Quad value) {
    std::array<char, 64> buffer{};
    quadmath_snprintf(buffer.data(), buffer.size(), "%.20Qg", value);
    return buffer.data();
}

} // namespace oracle
