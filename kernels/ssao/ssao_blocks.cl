// Which blocks of 64 x 64 pixels ssao computes at all pixels, from inverse depth. The others have a long radius, in pixels,
// on every surface; and a longer one where there are thin objects or low steps, beside which visibility changes within a few
// pixels.
//   jump = min(|after1 - (2 centre - before1)|, |centre - (2 after1 - after2)|)    where the two differ in sign
// A crease lies above or below both planes, so that its two terms have the same sign.
// Built for: PERSPECTIVE = 0 1

#include "ssao/blocks.h"
#include "ssao/ray.h"
#include "normals/slope.h"
#include "camera/window.h"

#define AROUND 8       // pixels around a block that count as well; 64 + 2 * 8 is a multiple of V
#define LEAST_STEP 0.5f // widths of a pixel: a step beside which visibility changes
#define THIN_PIXELS 1.0f // widths of a pixel that neither side may predict a pixel wrong by
#define MOST_STEPS 160 // pixels beside a step in a block and around it: bars have many

// How far the surface jumps from a pixel to the next; 0 if it does not, or if one of the four is no surface.
INLINE floatV jump(floatV before, floatV here, floatV after, floatV after2) {
    const floatV up = after - fma((floatV)2.0f, here, -before), down = here - fma((floatV)2.0f, after, -after2);
    const intV opposite = ((up > 0.0f) & (down < 0.0f)) | ((up < 0.0f) & (down > 0.0f));
    return select((floatV)0.0f, min(fabs(up), fabs(down)), opposite);
}

typedef struct {
    intV shorter, middling, rough; // than the least radius of all blocks, and than that of rough ones
    floatV steps;                  // a number: LLVM 18 ends the process where lanes of integers are counted and added up
} findingsV;

INLINE bool is_whole(const findingsV* found) {
    return any_of(found->shorter) || (any_of(found->middling) && any_of(found->rough));
}

INLINE void look(findingsV* found, const window* w, const block_params* blocks, const occlusion_params* p, intV inside) {
    const floatV q = surface_only(neighbour(w, 0, 0));
    const intV surface = inside & (fabs(q) < INFINITY);
    found->shorter |= surface & (q < blocks->least);
    found->middling |= surface & (q < blocks->least_rough);
    if (!(blocks->least < blocks->least_rough) || !any_of(surface))
        return;
    const floatV right = surface_only(neighbour(w, 1, 0)), down = surface_only(neighbour(w, 0, 1));
    const floatV left = surface_only(neighbour(w, -1, 0)), up = surface_only(neighbour(w, 0, -1));
    const floatV right2 = surface_only(neighbour(w, 2, 0)), down2 = surface_only(neighbour(w, 0, 2));
    const floatV left2 = surface_only(neighbour(w, -2, 0)), up2 = surface_only(neighbour(w, 0, -2));
    const floatV nearer = max(q, max(right, down)), tolerance = 4.0f * depth_error(p, nearer);
    const floatV size = PERSPECTIVE ? fabs(nearer) * p->pixel : (floatV)p->pixel;
    const floatV reach = (PERSPECTIVE ? nearer * nearer : (floatV)1.0f) * p->radius;
    const floatV across = jump(left, q, right, right2), along = jump(up, q, down, down2);
    const floatV least = fma((floatV)LEAST_STEP, size, tolerance);
    const intV step = surface & ((across > least) | (along > least));
    const intV low = ((across > least) & (across < reach)) | ((along > least) & (along < reach));
    const floatV off = max(min(misprediction(left2, left, q), misprediction(right2, right, q)),
                           min(misprediction(up2, up, q), misprediction(down2, down, q)));
    const intV thin = off > fma((floatV)THIN_PIXELS, size, tolerance);
    found->rough |= surface & (low | thin);
    found->steps += select((floatV)0.0f, (floatV)1.0f, step);
}

KERNEL void ssao_blocks(__global const float* depth, __global uint* blocks, const grid_params grid,
                          const block_params chosen, const occlusion_params p) {
    const int column = (int)get_global_id(0), row = (int)(get_global_id(1) + grid.y_begin), size = 1 << ssao_block_shift;
    if (column >= (int)chosen.columns)
        return;
    const int left = ((column + chosen.first_column) << ssao_block_shift) - (int)grid.pixel_x;
    const int top = ((row + chosen.first_row) << ssao_block_shift) - (int)grid.pixel_y;
    const int width = (int)grid.x_end, height = (int)grid.height;
    findingsV found = {0, 0, 0, 0};
    bool whole = false;
    for (int y = max(top - AROUND, 0); y < min(top + size + AROUND, height) && !whole; ++y) {
        for (int x = left - AROUND; x < left + size + AROUND; x += V) {
            if (x + V <= 0 || x >= width)
                continue;
            const window w = window_at(depth, &grid, x, y);
            const intV lane = (intV)x + LANE_INDEX(int);
            look(&found, &w, &chosen, &p, (lane >= 0) & (lane < (intV)width));
        }
        whole = is_whole(&found);
    }
    float steps = 0;
    for (int i = 0; i < V; ++i)
        steps += ((const float*)&found.steps)[i];
    whole |= steps > MOST_STEPS && any_of(found.middling);
    blocks[row * (int)chosen.columns + column] = whole ? WHOLE : 0;
}
