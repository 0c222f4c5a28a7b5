// Read before every file of a portable wheel: hypot as C libraries before 2.35 have it, too. Only its errors are told otherwise.
#if defined(__x86_64__)
__asm__(".symver hypot, hypot@GLIBC_2.2.5");
#elif defined(__aarch64__)
__asm__(".symver hypot, hypot@GLIBC_2.17");
#endif
