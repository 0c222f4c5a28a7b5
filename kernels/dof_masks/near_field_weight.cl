// What a near pixel gives to each pixel that its disc reaches: its weight over their number, so that a plane that is near
// everywhere covers everything exactly once.
//   N(c) = #{(i, j) : (2 i)^2 + (2 j vertical)^2 <= c^2},   the disc's area beyond COUNTED pixels across

#include "dof_masks/near_field.h"

#define COUNTED 1024.0f

KERNEL void near_field_weight(__global const float* circle, const place_params circle_place, __global float* weights,
                         const place_params weights_place, const near_field_params p) {
    const uint x = first_column(0, p.width);
    const uint row = get_global_id(1), y = p.first_row + row;
    if (x >= p.width || y >= p.last_row)
        return;

    const floatV c = LOAD(float, circle + element_at(&circle_place, x, y));
    const floatV weight = near_weight(c, &p), none = (floatV)0.0f;
    const floatV area = (0.785398163f / p.vertical) * c * c;
    const intV counted = weight > 0.0f & c > -COUNTED;
    const floatV size = select(none, -c, counted);
    float sizes[V], largest = 0.0f;
    *(float_lanes*)sizes = size;
    for (int i = 0; i < V; ++i)
        largest = max(largest, sizes[i]);

    floatV count = none;
    const int rows = (int)(0.5f * largest / p.vertical) + 1;
    for (int j = 0; j <= rows; ++j) {
        const floatV down = (floatV)(2.0f * (float)j * p.vertical);
        floatV n = floor(0.5f * sqrt(max(fma(-down, down, size * size), none)));
        n = select(n, n + 1.0f, reaches(size, 2.0f * n + 2.0f, down)); // the root may be rounded either way
        n = select(n, n - 1.0f, !reaches(size, 2.0f * n, down));
        const floatV in_row = max(fma((floatV)2.0f, n, (floatV)1.0f), none); // -1 of a row that is not reached: none
        count += j == 0 ? in_row : 2.0f * in_row;
    }
    __global float* target = weights + element_at(&weights_place, x, row);
    *(__global float_lanes*)target = select(none, weight / select(area, count, counted), weight > 0.0f);
}
