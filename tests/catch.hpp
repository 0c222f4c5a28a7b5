#pragma once

/// Catch2, whichever of its two layouts is installed: 2 as Debian 12 has it, or 3. `Approx` and `ContainsSubstring` are in scope
/// with both. And of the standard library and Eigen what most tests need, which is compiled once for all of them.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
#include <catch2/catch.hpp>
inline auto ContainsSubstring(const std::string& text) { // NOLINT: Catch2 3 calls it so
    return Catch::Matchers::Contains(text);
}
#endif

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

inline bool contains(std::string_view text, const auto& part) {
    return text.find(part) != std::string_view::npos;
}
