/* What a ray meets in voxels, from the texels of layout.h, as src/medium/grid_walk.c has it: bricks, and the cells of those that are
 * not even. Without NEBEL_VOXEL_TEXEL there are none. */
#ifndef NEBEL_VOXEL_TEXEL
#define NEBEL_VOXEL_TEXEL(i) nb_uvec4(0u, 0u, 0u, 0u)
#endif

#define NB_BRICK 8.0

nb_vec3 nb_splat3(float x) { return nb_vec3(x, x, x); }

/* A ray in cells: from + slope s, s in metres; the inverse is 0 where the ray runs level with the faces. */
struct nb_grid_ray {
    nb_vec3 from, slope, inverse;
};

float nb_grid_inverse(float slope) { return abs(slope) > NB_TINY ? 1.0 / slope : 0.0; }

nb_grid_ray nb_grid_ray_of(nb_vec3 from, nb_vec3 slope)
{
    nb_grid_ray ray;
    ray.from = from;
    ray.slope = slope;
    ray.inverse = nb_vec3(nb_grid_inverse(slope.x), nb_grid_inverse(slope.y), nb_grid_inverse(slope.z));
    return ray;
}

/* Where the ray leaves a block of `width` cells along one axis; never, from the last one. */
float nb_grid_crossing(float block, float last, float from, float inverse, float width)
{
    bool forward = inverse > 0.0;
    bool ends = inverse != 0.0 && block != (forward ? last : 0.0);
    return ends ? ((forward ? block + 1.0 : block) * width - from) * inverse : NB_FAR;
}

nb_vec3 nb_grid_crossings(nb_vec3 block, nb_vec3 last, nb_vec3 from, nb_vec3 inverse, float width)
{
    return nb_vec3(nb_grid_crossing(block.x, last.x, from.x, inverse.x, width),
                   nb_grid_crossing(block.y, last.y, from.y, inverse.y, width),
                   nb_grid_crossing(block.z, last.z, from.z, inverse.z, width));
}

/* The next block, through the face that is crossed first. */
nb_vec3 nb_grid_step(nb_vec3 block, nb_vec3 next, nb_vec3 inverse)
{
    if (next.x <= next.y && next.x <= next.z)
        block.x += inverse.x > 0.0 ? 1.0 : -1.0;
    else if (next.y <= next.z)
        block.y += inverse.y > 0.0 ? 1.0 : -1.0;
    else
        block.z += inverse.z > 0.0 ? 1.0 : -1.0;
    return block;
}

/* The eight values of a cell: at the lower and the higher end of x; within each y is the faster. */
struct nb_grid_cell {
    nb_vec4 low, high;
};

nb_grid_cell nb_grid_cell_of(nb_uvec4 texel)
{
    nb_grid_cell cell;
    cell.low = nb_vec4(float(texel.x & 0xffffu), float(texel.y & 0xffffu), float(texel.z & 0xffffu), float(texel.w & 0xffffu));
    cell.high = nb_vec4(float(texel.x >> 16), float(texel.y >> 16), float(texel.z >> 16), float(texel.w >> 16));
    return cell;
}

nb_vec3 nb_grid_share(nb_vec3 place, nb_vec3 cell) { return clamp(place - cell, nb_splat3(0.0), nb_splat3(1.0)); }

float nb_grid_value(nb_grid_cell cell, nb_vec3 share)
{
    nb_vec4 across = cell.low + (cell.high - cell.low) * share.x;
    nb_vec2 along = across.xz + (across.yw - across.xz) * share.y;
    return along.x + (along.y - along.x) * share.z;
}

/* Half the distance between the points of Gauss's rule on [0, 1]: exact for the cubic that the density is in a cell. */
#define NB_GAUSS_HALF 0.28867513459481288225

float nb_grid_mean(nb_grid_cell cell, nb_vec3 from, nb_vec3 to)
{
    nb_vec3 middle = (from + to) * 0.5;
    nb_vec3 reach = (to - from) * NB_GAUSS_HALF;
    return 0.5 * (nb_grid_value(cell, middle - reach) + nb_grid_value(cell, middle + reach));
}

int nb_grid_index(nb_vec3 block, nb_vec3 size) { return int(block.x) + int(size.x) * (int(block.y) + int(size.y) * int(block.z)); }

/* Turns of the loops below, for who counts them. */
NB_GLOBAL int nb_grid_turns;

/* The sum over the cells of a brick, whose first texel is `first`, from t to `end`. */
float nb_grid_brick_sum(nb_grid_ray ray, int first, nb_vec3 brick, float t, float end)
{
    nb_vec3 size = nb_splat3(NB_BRICK);
    nb_vec3 last = nb_splat3(NB_BRICK - 1.0);
    nb_vec3 from = ray.from - brick * NB_BRICK;
    nb_vec3 cell = clamp(floor(from + ray.slope * t), nb_splat3(0.0), last);
    float sum = 0.0;
    for (int i = 0; i < 32; i++) { /* at most 21 faces, and one of each axis that t lies in */
        nb_vec3 next = nb_grid_crossings(cell, last, from, ray.inverse, 1.0);
        float until = max(min(min(next.x, min(next.y, next.z)), end), t);
        nb_grid_turns++;
        nb_grid_cell corners = nb_grid_cell_of(NEBEL_VOXEL_TEXEL(first + nb_grid_index(cell, size)));
        sum += (until - t) * nb_grid_mean(corners, nb_grid_share(from + ray.slope * t, cell),
                                          nb_grid_share(from + ray.slope * until, cell));
        if (until >= end) break;
        t = until;
        cell = nb_grid_step(cell, next, ray.inverse);
    }
    return sum;
}

nb_vec3 nb_grid_bricks(int grid)
{
    nb_uvec4 head = NEBEL_VOXEL_TEXEL(grid);
    return nb_vec3(float(head.x), float(head.y), float(head.z));
}

nb_vec3 nb_grid_brick_at(nb_vec3 place, nb_vec3 last) { return clamp(floor(place * (1.0 / NB_BRICK)), nb_splat3(0.0), last); }

/* The density integrated from 0 to h metres, or until that comes to `enough`. */
float nb_grid_integral(nb_vec3 from, nb_vec3 slope, int grid, float h, float enough)
{
    nb_grid_ray ray = nb_grid_ray_of(from, slope);
    nb_vec3 size = nb_grid_bricks(grid);
    nb_vec3 last = size - nb_splat3(1.0);
    nb_vec3 brick = nb_grid_brick_at(from, last);
    int most = int(size.x + size.y + size.z) + 3;
    float t = 0.0;
    float sum = 0.0;
    for (int i = 0; i < most; i++) {
        nb_vec3 next = nb_grid_crossings(brick, last, from, ray.inverse, NB_BRICK);
        float until = max(min(min(next.x, min(next.y, next.z)), h), t);
        nb_grid_turns++;
        nb_uvec4 texel = NEBEL_VOXEL_TEXEL(grid + 1 + nb_grid_index(brick, size));
        sum += nb_from_bits(int(texel.x)) * (until - t);
        if (texel.z != 0u) sum += nb_from_bits(int(texel.y)) * nb_grid_brick_sum(ray, int(texel.z), brick, t, until);
        if (until >= h || sum >= enough) break;
        t = until;
        brick = nb_grid_step(brick, next, ray.inverse);
    }
    return max(sum, 0.0);
}

/* What is where `place` is: densities at the corners of its cell, or of an even brick. */
struct nb_grid_spot {
    nb_grid_cell corners;
    nb_vec3 cell;
    bool even;
};

nb_grid_spot nb_grid_spot_at(int grid, nb_vec3 place)
{
    nb_vec3 size = nb_grid_bricks(grid);
    nb_vec3 brick = nb_grid_brick_at(place, size - nb_splat3(1.0));
    nb_vec3 within = clamp(floor(place - brick * NB_BRICK), nb_splat3(0.0), nb_splat3(NB_BRICK - 1.0));
    nb_uvec4 texel = NEBEL_VOXEL_TEXEL(grid + 1 + nb_grid_index(brick, size));
    float least = nb_from_bits(int(texel.x));
    float step = nb_from_bits(int(texel.y));
    nb_grid_spot spot;
    spot.even = texel.z == 0u;
    spot.cell = brick * NB_BRICK + within;
    nb_uvec4 cell = NEBEL_VOXEL_TEXEL(spot.even ? grid : int(texel.z) + nb_grid_index(within, nb_splat3(NB_BRICK)));
    spot.corners = nb_grid_cell_of(cell);
    if (spot.even) step = 0.0;
    spot.corners.low = max(nb_vec4(least, least, least, least) + spot.corners.low * step, nb_vec4(0.0, 0.0, 0.0, 0.0));
    spot.corners.high = max(nb_vec4(least, least, least, least) + spot.corners.high * step, nb_vec4(0.0, 0.0, 0.0, 0.0));
    return spot;
}

float nb_grid_density(nb_grid_spot spot, nb_vec3 place) { return nb_grid_value(spot.corners, nb_grid_share(place, spot.cell)); }

/* Within the cell of the spot. */
float nb_grid_spot_integral(nb_grid_spot spot, nb_vec3 from, nb_vec3 slope, float h)
{
    return h * nb_grid_mean(spot.corners, nb_grid_share(from, spot.cell), nb_grid_share(from + slope * h, spot.cell));
}

/* How far it is to the next face of an axis that is more than `near` metres ahead. */
float nb_grid_face(float from, float slope, float width, float near)
{
    float inverse = nb_grid_inverse(slope);
    float block = (from + slope * near) / width;
    float face = inverse > 0.0 ? floor(block) + 1.0 : ceil(block) - 1.0;
    return inverse != 0.0 ? max((face * width - from) * inverse, near) : NB_FAR;
}

float nb_grid_faces(nb_vec3 from, nb_vec3 slope, float width, float near)
{
    return min(nb_grid_face(from.x, slope.x, width, near),
               min(nb_grid_face(from.y, slope.y, width, near), nb_grid_face(from.z, slope.z, width, near)));
}

/* How far it is to where the density is another polynomial. */
float nb_grid_kink(nb_vec3 from, nb_vec3 slope, int grid, float near)
{
    float kink = nb_grid_faces(from, slope, 1.0, near);
    if (kink < NB_FAR && nb_grid_spot_at(grid, from + slope * (0.5 * kink)).even)
        kink = nb_grid_faces(from, slope, NB_BRICK, near);
    return kink;
}
