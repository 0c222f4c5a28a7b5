// Horizons by line sweep: every line of pixels in one direction is walked both ways, and a convex hull of what was passed is
// kept. A pixel's horizon is where a line from it touches the hull, however far away that is.
// Timonen 2013, "Line-Sweep Ambient Obscurance"; Timonen and Westerholm 2010, "Scalable Height Field Self-Shadowing".
// On a line of the screen inverse depth q of a straight line in space is affine, and so is the cotangent of the angle from the
// view ray in (q - q_c) / s: hulls of (s, q) are hulls of the scene under every camera. What lies behind a surface is solid.
//
// The hard radius is not in the papers. Points of the hull count while they are in the sphere; where the next one is not, what lies
// between is asked block by block, each of which has a hull of its own, until nothing farther can count; and where a block's hull
// leaves the sphere, the surface is searched by halving. What is missed there, within a block, makes a pixel too open.
// The surfaces are those of kernels/ssao_planes.cl, the measure is that of kernels/ssao.cl, whose text stands before this.

#define NO_HORIZON -1e30f
#define BLOCK 32 // pixels, a power of two

// A line of pixels in the plane that it spans with its view rays.
typedef struct {
    __global float* q;      // inverse depth where the line passes, NaN where there is none
    __global float2* place; // across and along the middle view ray (perspective), or the rays
    __global float* tilt;   // slope of the pixel's own plane
    __global int* hull;     // of all that was passed
    __global int* before;   // the pixel before each on the hull of its block, -1 for none
    int begin, end;
    float radius_square;
} line_of_pixels;

// A direction on the screen, see `Direction` of line_sweep.cpp.
typedef struct {
    float by_rows, shear;  // major axis: 0 columns, 1 rows; minor pixels per major one
    float step_x, step_y;  // of one major pixel
    float share, rounding; // of kernels/ssao.cl
    float square;          // of the step's length in pixels
    float first;           // is it the first direction?
} direction_params;

INLINE float3 step_between(const occlusion_params* p, float x, float y) {
    return (float3)(x * p->step[0][0] + y * p->step[0][1], x * p->step[1][0] + y * p->step[1][1],
                    x * p->step[2][0] + y * p->step[2][1]);
}

INLINE float3 direction_of(const occlusion_params* p, float x, float y) {
    return (float3)(p->direction[0][0] * x + p->direction[0][1] * y + p->direction[0][2],
                    p->direction[1][0] * x + p->direction[1][1] * y + p->direction[1][2],
                    p->direction[2][0] * x + p->direction[2][1] * y + p->direction[2][2]);
}

// The columns that begin at `at` as a sphere sees them: inside, passing through it from above to inside, below, or beside it.
enum { INSIDE, THROUGH, BELOW, BESIDE };

// Where it starts against the sphere around `centre`; `slope` becomes (q - q_c) / s of its highest point inside.
INLINE int against_sphere(const line_of_pixels* line, float2 centre, float q, int at, float s, float* slope) {
    const float2 place = line->place[at], away = centre - place;
    const float away_square = dot(away, away);
    *slope = (line->q[at] - q) / s;
    if (away_square <= line->radius_square)
        return INSIDE;
#if PERSPECTIVE
    const float2 ray = place;
#else
    const float2 ray = (float2)(0.0f, 1.0f);
#endif
    const float ray_square = dot(ray, ray), middle = dot(away, ray);
    const float square = middle * middle - (away_square - line->radius_square) * ray_square;
    if (square < 0)
        return BESIDE;
    if (middle < 0)
        return BELOW;
    const float enters = (middle - sqrt(square)) / ray_square;
#if PERSPECTIVE
    *slope = (line->q[at] / (1 + enters) - q) / s;
#else
    *slope = (line->q[at] - enters * line->place[-1].x - q) / s; // inverse depth per length
#endif
    return THROUGH;
}

// Slope from the pixel `m` of where the straight line from one pixel, inside its sphere, to the next one outside leaves it.
INLINE float slope_where_it_leaves(const line_of_pixels* line, int m, float q, int inner, int outer) {
    const float2 start = line->place[inner] - line->place[m], way = line->place[outer] - line->place[inner];
    const float square = dot(way, way), middle = dot(start, way);
    const float root = sqrt(max(middle * middle - square * (dot(start, start) - line->radius_square), 0.0f));
    const float t = clamp((root - middle) / square, 0.0f, 1.0f);
#if PERSPECTIVE
    const float of_outer = t * line->q[inner], share = of_outer / fma(1 - t, line->q[outer], of_outer);
#else
    const float share = t;
#endif
    const float there = fma(share, line->q[outer] - line->q[inner], line->q[inner]);
    return (there - q) / fabs((float)(m - inner) + share * (float)(inner - outer));
}

// The greatest slope inside the sphere from the pixel `m` between two others, of which `inner` is not beyond it and `outer` is.
INLINE float slope_between(const line_of_pixels* line, int m, float q, int inner, int outer, bool inside) {
    float best = NO_HORIZON;
    while (abs(outer - inner) > 1) {
        const int middle = (outer + inner) / 2;
        float slope = NO_HORIZON;
        const int where = isnan(line->q[middle])
                              ? BESIDE
                              : against_sphere(line, line->place[m], q, middle, (float)abs(m - middle), &slope);
        if (where == INSIDE || where == THROUGH)
            best = max(best, slope);
        if (where == INSIDE || where == BELOW)
            inner = middle, inside = where == INSIDE;
        else
            outer = middle;
    }
    if (inside && !isnan(line->q[outer]))
        best = max(best, slope_where_it_leaves(line, m, q, inner, outer));
    return best;
}

// The same of all that lies beyond `inner`, block by block.
INLINE float slope_beyond(const line_of_pixels* line, int m, float q, float tangent, int inner, int outward) {
    float best = NO_HORIZON;
    for (int near = inner + outward; near >= line->begin && near < line->end;) {
        if (isnan(line->q[near])) {
            near += outward;
            continue;
        }
        float last = 2 * NO_HORIZON;
        int within = near;
        bool inside = false;
        for (int at = near; at >= 0; at = line->before[at]) {
            const float s = (float)abs(m - at), plain = (line->q[at] - q) / s;
            if (plain <= last)
                break;
            last = plain;
            float slope;
            const int where = against_sphere(line, line->place[m], q, at, s, &slope);
            if (where == INSIDE || where == THROUGH)
                best = max(best, slope);
            if (where == INSIDE)
                within = at, inside = true;
            if (where == THROUGH || where == BESIDE)
                return plain <= tangent ? best : max(best, slope_between(line, m, q, within, at, inside));
        }
        near = outward < 0 ? (near & ~(BLOCK - 1)) - 1 : (near | (BLOCK - 1)) + 1;
    }
    return best;
}

// The greatest slope inside the sphere from the pixel `m`, with `size` points on the hull of what was passed.
INLINE float horizon_of(const line_of_pixels* line, int m, int size, float q, int outward) {
    const float tangent = line->tilt[m] * (float)outward;
    float best = NO_HORIZON, last = 2 * NO_HORIZON;
    int inner = m;
    for (int i = size - 1; i >= 0; --i) {
        const int at = line->hull[i];
        const float s = (float)abs(m - at), plain = (line->q[at] - q) / s;
        if (plain <= last)
            break;
        last = plain;
        float slope;
        const int where = against_sphere(line, line->place[m], q, at, s, &slope);
        if (where == INSIDE) {
            best = max(best, slope);
            inner = at;
        } else if (where != BELOW) { // nothing nearer has a greater slope than this
            return plain <= tangent ? best : max(best, slope_beyond(line, m, q, tangent, inner, outward));
        }
    }
    return best;
}

// Size of the hull with the pixel `m` in it.
INLINE int with_pixel(const line_of_pixels* line, int m, int size) {
    const float q = line->q[m];
    while (size >= 2) {
        const int top = line->hull[size - 1], under = line->hull[size - 2];
        if ((line->q[under] - q) * (float)abs(m - top) < (line->q[top] - q) * (float)abs(m - under))
            break;
        --size;
    }
    line->hull[size] = m;
    return size + 1;
}

// The same in the pixel's block.
INLINE void add_to_block(const line_of_pixels* line, int m, int outward) {
    int top = m + outward;
    while (top >= line->begin && top < line->end && top / BLOCK == m / BLOCK && isnan(line->q[top]))
        top += outward;
    if (top < line->begin || top >= line->end || top / BLOCK != m / BLOCK)
        top = -1;
    while (top >= 0 && line->before[top] >= 0) {
        const int under = line->before[top];
        const float q = line->q[m];
        if ((line->q[under] - q) * (float)abs(m - top) < (line->q[top] - q) * (float)abs(m - under))
            break;
        top = under;
    }
    line->before[m] = top;
}

INLINE uint at_pixel(const split_params* split, int x, int y) {
    return in_plane(split, (y & 3) * 4 + (x & 3), x >> 2, y >> 2);
}

// All lines of a direction, in as many bands as there are rows of work-items. `scratch` has six floats for each pixel of the
// longest line, and two more, for every band.
__kernel void line_sweep(__global const float* fronts, __global const float* slopes, __global const float* directions,
                         __global float* scratch, __global float* horizons, const split_params split,
                         const occlusion_params p) {
    if (get_global_id(0) != 0)
        return;
    const direction_params d = *(__global const direction_params*)directions;
    const bool by_rows = d.by_rows != 0;
    const int width = (int)split.width, height = (int)split.height;
    const int major = by_rows ? height : width, minor = by_rows ? width : height, longest = max(width, height);
    const int lean = (int)rint((float)(major - 1) * fabs(d.shear)), lines = minor + lean;
    const int band = (int)get_global_id(1), bands = (int)get_global_size(1);
    __global float* own = scratch + (size_t)band * (6 * longest + 2);
    line_of_pixels line = {.q = own + 2 * longest + 2,
                           .place = (__global float2*)own + 1,
                           .tilt = own + 3 * longest + 2,
                           .hull = (__global int*)(own + 4 * longest + 2),
                           .before = (__global int*)(own + 5 * longest + 2),
                           .radius_square = p.radius * p.radius};
    const float3 step = step_between(&p, d.step_x, d.step_y);

    for (int number = (int)((long)lines * band / bands); number < (int)((long)lines * (band + 1) / bands); ++number) {
        const int start = d.shear > 0 ? number - lean : number; // minor coordinate of major pixel 0
        // Of the plane: a unit vector along the step and one across it (perspective), across the rays and along them.
        const float first_minor = (float)start + 0.5f;
        const float3 ray = direction_of(&p, by_rows ? first_minor : 0.5f, by_rows ? 0.5f : first_minor);
#if PERSPECTIVE
        const float per_step = length(step), along = dot(ray, step) / per_step;
        const float across = length(ray - step * (along / per_step));
#else
        const float ray_length = length(ray), depth_per_step = dot(step, ray) / ray_length;
        const float per_step = length(step - ray * (depth_per_step / ray_length));
        line.place[-1].x = 1 / ray_length;
#endif
        int begin = 0, end = 0;
        for (int m = 0; m < major; ++m) {
            const float exact = (float)m * d.shear;
            const int away = (int)rint(exact), n = start + away;
            if (n < 0 || n >= minor) {
                if (end > 0)
                    break;
                continue;
            }
            if (end == 0)
                begin = m;
            end = m + 1;
            const uint at = at_pixel(&split, by_rows ? n : m, by_rows ? m : n);
            const float front = fronts[at];
            const uint packed = as_uint(slopes[at]);
            const float right = as_float(packed << 16), down = as_float(packed & 0xffff0000u);
            const float q = fma(by_rows ? right : down, exact - (float)away, front);
            line.tilt[m] = fma(d.step_x, right, d.step_y * down);
            const bool surface = front > NOTHING && q > (PERSPECTIVE ? 0 : NOTHING);
            line.q[m] = surface ? q : NAN;
#if PERSPECTIVE
            line.place[m] = (float2)(fma((float)m, per_step, along), across) / q;
#else
            line.place[m] = (float2)((float)m * per_step, fma((float)m, depth_per_step, -q * ray_length));
#endif
        }
        line.begin = begin;
        line.end = end;
        for (int way = 0; way < 2; ++way) { // way 0: what lies at greater m blocks
            const int outward = way ? -1 : 1;
            int size = 0;
            for (int i = begin; i < end; ++i) {
                const int m = way ? i : begin + end - 1 - i;
                const float q = line.q[m];
                if (isnan(q))
                    continue;
                const float size_of_q = fabs(q);
                const float error = fma(size_of_q, fma(size_of_q, p.error_quadratic, p.error_linear), p.error_constant);
                const int n = start + (int)rint((float)m * d.shear);
                horizons[way * 16 * split.plane + at_pixel(&split, by_rows ? n : m, by_rows ? m : n)] =
                    horizon_of(&line, m, size, q + 2 * error, outward);
                size = with_pixel(&line, m, size);
                add_to_block(&line, m, outward);
            }
        }
    }
}

// What a direction's two horizons block, added to the sums: V pixels per work-item, as in kernels/ssao.cl.
__kernel void line_sweep_sums(__global const float* fronts, __global const float* slopes,
                              __global const float* directions, __global const float* horizons, __global float* sums,
                              const split_params split, const occlusion_params p) {
    const int column = (int)get_global_id(0) * V;
    const int pattern = (int)(get_global_id(1) % 16), row = (int)(get_global_id(1) / 16);
    if (column >= (int)split.columns)
        return;
    const uint here = in_plane(&split, pattern, column, row), all = 16 * split.plane;
    const pixelV c = pixel_at(fronts, slopes, &split, &p, here, pattern, column, row);
    const sliceV slice = slice_at(&c, &p, directions + 2);
    const floatV weight = slice.inverse_across * slice.inverse_across * directions[6];
    const bool first = directions[7] != 0;
    floatV blocked = first ? (floatV)0.0f : LOAD(float, sums + here);
    floatV whole = first ? (floatV)0.0f : LOAD(float, sums + all + here);
    for (int way = 0; way < 2; ++way) {
        const sideV side = side_at(&c, &slice, way ? -1.0f : 1.0f, p.slope_errors);
        const floatV slope = LOAD(float, horizons + way * all + here);
        const floatV cotangent = clamp(fma(side.scale, slope, side.offset), -1e15f, 1e15f);
        const floatV cosine = max(cotangent * inverse_root(fma(cotangent, cotangent, (floatV)1.0f)), side.lowest);
        whole = fma(weight, side.whole, whole);
        blocked = fma(weight, side.whole - measure(cosine, side.nu), blocked);
    }
    STORE(sums + here, select((floatV)0.0f, blocked, c.surface));
    STORE(sums + all + here, select((floatV)0.0f, whole, c.surface));
}
