#pragma once

/// Catch2, whichever of its two layouts is installed: 2 as Debian 12 has it, or 3. `Approx` is in scope with both.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
