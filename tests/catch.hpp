#pragma once

/// Catch2, whichever of its two layouts is installed: 2 as Debian 12 has it, or 3. `Approx` and
/// `ContainsSubstring` are in scope with both.
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
