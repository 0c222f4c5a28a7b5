#pragma once

#include <fathom/relative.hpp>

#include <functional>

namespace fathom {

/// Runs a function over ranges [begin, end) of rows, perhaps several at once.
using InRows = std::function<void(int rows, const std::function<void(int begin, int end)>& work)>;

/// On all cores.
void in_threads(int rows, const std::function<void(int begin, int end)>& work);

/// The first step of `relative_values`: from 0 to 1, by the range if there is one. `bits` as there.
void to_fractions(std::span<float> values, int bits, const std::optional<std::array<double, 2>>& range);

RelativeValues relative_values(const HostFloats& stored, int bits, const RelativeOptions& options,
                               const HostFloats& color, const std::string& range_option, const InRows& in_rows);

} // namespace fathom
