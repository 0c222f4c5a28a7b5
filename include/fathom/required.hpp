#pragma once

namespace fathom {
#pragma GCC visibility push(default)

/// A number that has to be given: an options struct without it does not compile.
struct Required {
    double value;

    Required(double given) : value(given) {}
    operator double() const { return value; }
};

#pragma GCC visibility pop
} // namespace fathom
