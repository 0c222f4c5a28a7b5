// The rays of the camera as the occlusion kernels see them, in floats: for angles, not for places.

#ifndef FATHOM_RAY_H
#define FATHOM_RAY_H

#include "vector.h"

INLINE floatV direction_at(const occlusion_params* p, int row, floatV x, float y) {
    return fma((floatV)p->direction[row][0], x, fma(p->direction[row][1], y, p->direction[row][2]));
}

INLINE floatV ray_length(const occlusion_params* p, floatV x, float y) {
    const floatV dx = direction_at(p, 0, x, y), dy = direction_at(p, 1, x, y), dz = direction_at(p, 2, x, y);
    return sqrt(fma(dx, dx, fma(dy, dy, dz * dz)));
}

// Bound of the error of inverse depth, see InverseDepthError.
INLINE floatV depth_error(const occlusion_params* p, floatV q) {
    const floatV size = fabs(q);
    return fma(size, fma(size, (floatV)p->error_quadratic, (floatV)p->error_linear), (floatV)p->error_constant);
}

#endif
