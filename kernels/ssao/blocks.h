// Blocks of the camera's image, each of which is computed at all pixels or at half resolution; one word a block.

#ifndef FATHOM_BLOCKS_H
#define FATHOM_BLOCKS_H

#include "vector.h"

#define WHOLE 1u // the word of a block that is computed at all pixels; 0 for half resolution

// The word of a block, or of the one that is closest to it among those of the image.
INLINE uint block_at(__global const uint* blocks, const block_params* p, int column, int row) {
    const int last_column = (int)p->columns - 1, last_row = (int)p->rows - 1;
    return blocks[clamp(row, 0, last_row) * (int)p->columns + clamp(column, 0, last_column)];
}

INLINE int block_column(const block_params* p, int x) {
    return (x >> ssao_block_shift) - p->first_column;
}
INLINE int block_row(const block_params* p, int y) {
    return (y >> ssao_block_shift) - p->first_row;
}

// Does the pass work for a block that lies within its margin of pixels x to x + wide - 1 of row y? They are counted in the
// camera's lattice.
INLINE bool is_needed(__global const uint* blocks, const block_params* p, int x, int wide, int y) {
    if (p->columns == 0)
        return true;
    const int every = (int)p->every, margin = (int)p->margin;
    const int left = block_column(p, every * x - margin), right = block_column(p, every * (x + wide - 1) + margin);
    const int top = block_row(p, every * y - margin), bottom = block_row(p, every * y + margin);
    for (int row = top; row <= bottom; ++row)
        for (int column = left; column <= right; ++column)
            if (block_at(blocks, p, column, row) == p->wanted)
                return true;
    return false;
}

// Is there any such block? Two words behind the blocks' say so.
INLINE bool is_any_needed(__global const uint* blocks, const block_params* p) {
    return p->columns == 0 || blocks[p->columns * p->rows + p->wanted] != 0;
}

#endif
