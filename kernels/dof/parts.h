// The sums of one layer in kernels/dof/dof_parts.cl, side by side for every pixel: what the layer's own pixels cover, what
// they and those behind cover, the colour of its own, under BRIGHT what of it lies beyond the knee, and the columns of its
// own. Then follow its own once more, which become their rows, and zeros.
// Built for: BRIGHT = 0 1

#ifndef FATHOM_PARTS_H
#define FATHOM_PARTS_H

#ifndef BRIGHT
#error "BRIGHT is not defined: 1 to sum what lies beyond the knee apart, 0 otherwise"
#elif BRIGHT
#define WIDTH 16
typedef float16 __attribute__((aligned(4))) sums_of_pixel;
typedef float16 floatW;
#else
#define WIDTH 8
typedef float8 __attribute__((aligned(4))) sums_of_pixel;
typedef float8 floatW;
#endif

#endif
