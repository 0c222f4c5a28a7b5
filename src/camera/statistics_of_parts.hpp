#pragma once

#include <fathom/findings.hpp>

#include <functional>

namespace fathom {

/// Calls a function with each part of an image, in any order. It is asked twice, and gives the same parts.
using EachPart = std::function<void(const std::function<void(const HostDepth&)>&)>;

/// `stored_statistics` of an image that lies in parts. It needs memory for none of them.
StoredStatistics statistics_of_parts(Storage storage, const EachPart& each_part);

} // namespace fathom
