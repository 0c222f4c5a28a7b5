// Blocks of a face that no pixel of the lens needs take a third word, with which neither pass works for them. Then the two kinds that
// are left, as ssao_kinds.cl has them.

#include "ssao/blocks.h"

#define NOT_NEEDED 2u

KERNEL void face_blocks(__global const uint* needed, __global uint* blocks, const block_params p, const face_block_params face) {
    if (get_global_id(0) > 0)
        return;
    const uint count = p.columns * p.rows;
    uint any[3] = {0, 0, 0};
    for (uint i = 0; i < count; ++i) {
        const uint column = i % p.columns + (uint)p.first_column, row = i / p.columns + (uint)p.first_row;
        if (needed[row * face.columns + column] == 0)
            blocks[i] = NOT_NEEDED;
        any[blocks[i]] = 1;
    }
    for (uint i = 0; i < 2; ++i)
        blocks[count + i] = any[i];
}
