// A kernel that does not compile with V = 16 and FORM = 1.
// Built for: FORM = 0 1; LAST = 0

#include "broken.h"

#if FORM == 2 || LAST
#error "FORM is never 2 here, nor LAST 1"
#endif

__kernel void broken(__global float* target) {
#if V == 16 && FORM == 1
    target[0] = undeclared;
#else
    target[0] = 1;
#endif
}
