#pragma once

namespace fathom {

/// A number that has to be given: an options struct without it does not compile.
struct Required {
    double value;

    Required(double given) : value(given) {}
    operator double() const { return value; }
};

} // namespace fathom
