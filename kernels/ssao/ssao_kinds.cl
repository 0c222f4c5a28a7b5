// Is any block computed at half resolution, and any at all pixels? Two words behind the blocks' own.

#include "ssao/blocks.h"

KERNEL void ssao_kinds(__global uint* blocks, const block_params p) {
    if (get_global_id(0) > 0)
        return;
    const uint count = p.columns * p.rows;
    uint any[2] = {0, 0};
    for (uint i = 0; i < count; ++i)
        any[blocks[i]] = 1;
    for (uint i = 0; i < 2; ++i)
        blocks[count + i] = any[i];
}
