// What an upsampled result of ssao is, and what one from another surface weighs.
// Built for: OUTPUT = 0 1 2

#ifndef FATHOM_UPSAMPLED_H
#define FATHOM_UPSAMPLED_H

#ifndef OUTPUT
#error "OUTPUT is not defined: 0 visibility, 1 confidence, 2 bent normal"
#endif
#if OUTPUT == 2
#define CHANNELS 3
#else
#define CHANNELS 1
#endif

// Weight of a result from another surface. Beside results of the pixel's own surface it is too small to be seen. Without any,
// it makes the result closest in depth count.
#define NEAREST 1e-4f

#endif
