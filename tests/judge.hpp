#pragma once

// Lets the device decode stored values of a subject and compares every pixel with the oracle.

#include "oracle.hpp"

#include <fathom/device.hpp>
#include <fathom/linearize.hpp>

#include <random>
#include <string>
#include <vector>

namespace oracle {

/// A small image somewhere in the subject's whole image.
struct Patch {
    int x, y, width, height;
};
inline constexpr Patch default_patches[] = {{0, 0, 61, 33},
                                            {16384 - 67, 16384 - 31, 67, 31},
                                            {8185, 8181, 32, 64},
                                            {16384 - 40, 11, 40, 50},
                                            {5003, 16384 - 50, 41, 50}};

/// Stored values for a patch: spread evenly, crowded at both ends of the range, on the ends themselves, and near the
/// values whose sums cancel.
std::vector<float> stored_values(const Subject& subject, const Truth& truth, const Patch& patch, std::mt19937& random);

/// What the device can sum with: double, where it has that, and two floats. The first is what it takes by itself.
const std::vector<fathom::Arithmetic>& arithmetics();
inline fathom::Arithmetic widest() {
    return arithmetics().front();
}

/// Is a number below 2^-126, and does the device take such numbers for 0?
bool is_lost(Quad number);

/// The same device with either of them.
const fathom::Device& device(fathom::Arithmetic arithmetic = widest());
const char* name(fathom::Arithmetic arithmetic);

/// Allowed: so many ulp, plus ε·κ, for stored values of at least this size (and 0).
struct Promise {
    double ulps, condition, least = 0;
};

/// What linearize promises for a form.
Promise promise(fathom::Form form, fathom::Arithmetic arithmetic);

/// The worst error of a table's row and where it is.
struct Worst {
    double ulps = 0;  ///< error in ulp, where the sum is well conditioned (κ·ε below 1/64 ulp)
    double share = 0; ///< error over its bound, everywhere
    double condition = 1;
    long checked = 0;
    std::string where = {}, share_where = {};

    /// κ·ε in ulp.
    void add(double error, double bound, double condition_ulp, double condition, const std::string& name, double v,
             double x, double y);
    void add(const Worst& other);
    void print(const std::string& label) const;
};

std::string text_of(Quad value);

/// One result against the truth. Empty, or what is wrong with it.
std::string judge(const Subject& subject, const Truth& truth, fathom::Form form, const Promise& promise, double v,
                  double x, double y, float got, Worst& worst);

/// Decodes the default patches of each subject with one arithmetic, the background like any other value.
/// Returns what is wrong, with the first few faults, and prints the worst error.
std::string judge_all(const std::string& label, const std::vector<Subject>& subjects, fathom::Arithmetic arithmetic);

/// Gathers the first few faults of many.
class Faults {
public:
    void add(const std::string& fault) {
        if (!fault.empty() && ++count_ <= 8)
            text_ += fault;
    }
    std::string text() const {
        return count_ == 0 ? std::string() : '\n' + text_ + std::to_string(count_) + " values in all\n";
    }

private:
    std::string text_;
    long count_ = 0;
};

} // namespace oracle
