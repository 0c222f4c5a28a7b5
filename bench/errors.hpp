#pragma once

#include "figures.hpp"
#include "methods.hpp"

#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

/// Errors of every method against the truth in each of the views: a row for each, without times.
/// ssao is run with radii of a twentieth and two fifths of the width, twice each: as thick as brute force takes surfaces to
/// be, for the error against that, and as the method takes them, for the error against the scene itself; dof with circles up to a thirtieth of it and
/// up to a quarter of that.
/// `report` is told of every row as soon as it is there.
std::vector<Figures> errors(const Device& device, const std::vector<Method>& methods, const std::vector<View>& views,
                            const std::string& only, const std::function<void(const Figures&)>& report);

} // namespace fathom::bench
