#pragma once

/// __float128 and its functions. GCC ships the header; clang only finds the library.
#if __has_include(<quadmath.h>)
#include <quadmath.h>
#else
__extension__ typedef __float128 QuadmathValue;
extern "C" {
QuadmathValue expm1q(QuadmathValue) noexcept;
QuadmathValue expq(QuadmathValue) noexcept;
QuadmathValue fabsq(QuadmathValue) noexcept;
int ilogbq(QuadmathValue) noexcept;
int isinfq(QuadmathValue) noexcept;
QuadmathValue log1pq(QuadmathValue) noexcept;
QuadmathValue logq(QuadmathValue) noexcept;
QuadmathValue sqrtq(QuadmathValue) noexcept;
QuadmathValue tanq(QuadmathValue) noexcept;
int quadmath_snprintf(char* text, decltype(sizeof(0)) size, const char* format, ...) noexcept;
}
#endif
