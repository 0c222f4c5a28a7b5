#pragma once

#include "baselines.hpp"
#include "case.hpp"

#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

/// A way to compute an operation, a point of the charts.
struct Method {
    enum class Kind { library, baseline, opencv, blender, python, floor };

    std::string operation; ///< as the library names it; "copy" for floors
    std::string name;
    Kind kind = Kind::library;
    Storage storage = Storage::float32;
    std::string floor;                          ///< name of the floor that moves the same bytes
    std::function<Image(Case&)> run;            ///< starts it; the result is overwritten by the next run
    std::function<void(Case&)> prepare = {};    ///< makes what a frame needs besides; not timed
    std::function<bool(const View&)> fits = {}; ///< can it be used on a view? Empty: on each
    bool swept =
        false; ///< one of the samplings that the qualities of ssao were chosen from: timed where errors are measured alone

    /// "OPERATION NAME" contains the text.
    bool matches(const std::string& only) const { return (operation + ' ' + name).find(only) != std::string::npos; }
};

/// Ends the name of a method whose thickness is a quarter of the radius. Errors against brute force are the same: it has that one.
constexpr const char* constant_suffix = ", a quarter thick";

/// Ends the name of a method that is told where solids end, which brute force is not.
constexpr const char* backs_suffix = ", back depth";

const char* kind_name(Method::Kind kind);

/// Every method of every operation, the baselines, and the floors with a control for each.
std::vector<Method> methods(Baselines& kernels);

/// Bytes of a device's memory that a run takes: the images it reads and writes, and the scratch between its passes.
double bytes_of(const Method& method, Case& on);

} // namespace fathom::bench
