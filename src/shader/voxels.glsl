/* Light in voxels that the sun lights, alone or among other fog: from cell to cell along the ray. In each step Gauss's rule of two points
 * finds everything: optical depth up to a point, the density there, exact where the ray's density is a cubic, and the depth to the sun,
 * from lattices. Steps are shorter than a cell where they would take much of the light, and never pass where shadows of surfaces or
 * of other fog begin and end. */

/* Where the walk is. */
struct nb_cell_walk {
    nb_vec3 brick, cell; /* the cell counts within the brick */
    float least, step;   /* of the brick, as in layout.h */
    int cells;           /* first texel of its cells; 0: it is even */
};

nb_cell_walk nb_enter_brick(int grid, nb_vec3 size, nb_vec3 brick, nb_vec3 place)
{
    nb_uvec4 texel = NEBEL_VOXEL_TEXEL(grid + 1 + nb_grid_index(brick, size));
    nb_cell_walk w;
    w.brick = brick;
    w.cell = clamp(floor(place - brick * NB_BRICK), nb_splat3(0.0), nb_splat3(NB_BRICK - 1.0));
    w.least = nb_from_bits(int(texel.x));
    w.step = nb_from_bits(int(texel.y));
    w.cells = int(texel.z);
    return w;
}

/* Densities at two places that count in cells of the brick. */
nb_vec2 nb_densities_in_cell(nb_cell_walk w, int grid, nb_vec3 first, nb_vec3 second)
{
    bool even = w.cells == 0;
    nb_grid_cell corners = nb_grid_cell_of(NEBEL_VOXEL_TEXEL(even ? grid : w.cells + nb_grid_index(w.cell, nb_splat3(NB_BRICK))));
    float step = even ? 0.0 : w.step;
    return nb_vec2(max(w.least + step * nb_grid_value(corners, nb_grid_share(first, w.cell)), 0.0),
                   max(w.least + step * nb_grid_value(corners, nb_grid_share(second, w.cell)), 0.0));
}

/* What there is at the two points, per metre: extinction, light, and what full sunlight would add. */
struct nb_two_points {
    nb_vec3 extinction[2];
    nb_vec3 light[2];
    nb_vec3 glow[2];
};

/* `radiance`: of its opaque fog. */
void nb_add_at_points(inout nb_two_points sum, int medium, nb_vec3 direction, nb_vec3 radiance, nb_vec2 densities)
{
    nb_vec3 extinction = NEBEL_FOG_TEXEL(medium).xyz;
    nb_vec3 light = nb_light_per_metre(medium, radiance);
    nb_vec3 glow = nb_sunlit_radiance(medium, direction) * extinction;
    sum.extinction[0] += extinction * densities.x;
    sum.extinction[1] += extinction * densities.y;
    sum.light[0] += light * densities.x;
    sum.light[1] += light * densities.y;
    sum.glow[0] += glow * densities.x;
    sum.glow[1] += glow * densities.y;
}

/* Of other fog, which may be voxels, too. */
float nb_density_beside(nb_profile profile, float s)
{
    float density = 0.0;
    if (profile.kind == NB_KIND_GRID) {
        nb_vec3 place = profile.offset + profile.slope * s;
        density = nb_grid_density(nb_grid_spot_at(profile.first, place), place);
    } else {
        density = nb_density(profile, s);
    }
    return density;
}

/* The other fog of the piece. */
void nb_add_others_at_points(inout nb_two_points sum, nb_piece piece, nb_ray ray, int used, float first, float second)
{
    for (int k = 0; k < used; k++) {
        nb_vec3 slot = nb_fog_slot(k);
        int at = int(slot.z);
        int kind = int(NEBEL_FOG_TEXEL(at).w);
        if (at == piece.voxels || kind == NB_KIND_EXCLUDE || !nb_is_there(slot, piece)) continue;
        nb_profile profile = nb_profile_of(at, kind, ray, piece.start);
        nb_add_at_points(sum, at, ray.direction, nb_slot_radiance(k, at), nb_vec2(nb_density_beside(profile, first), nb_density_beside(profile, second)));
    }
}

/* Sunlight from t on, t from the start of the piece: its share, and up to where it comes through the same shadows; `of_fog`: those of
 * fog, too. */
nb_vec2 nb_sunlight_from(nb_piece piece, nb_ray ray, float t, bool of_fog, inout nb_vec2 lit, inout int turns)
{
    float from = piece.start + t;
    float near = nb_nearest(from);
    if (lit.y <= from + near) {
        turns -= NEBEL_SUN_VISIBILITY_ITERATIONS;
        lit = NEBEL_SUN_VISIBILITY(ray.origin, ray.direction, from + near, ray.t_max);
        turns += NEBEL_SUN_VISIBILITY_ITERATIONS;
        lit.y = max(lit.y, from + 2.0 * near);
    }
    float stop = min(piece.end, lit.y);
    if (of_fog && lit.x > 0.0) stop = nb_find_turn(ray, from, stop).next;
    return nb_vec2(lit.x, stop - piece.start);
}

/* Cells that a step takes along the ray, where nothing else ends it. */
#define NB_CELLS_AT_ONCE 2.0

/* What a step bears: optical depth, and change of that to the sun. */
#define NB_CELL_BEARS 1.0

/* `lit` is the host's last answer. Ends the piece where turns do not suffice for all of it. Returns those so far. */
int nb_walk_voxels(inout nb_gathered g, inout nb_piece piece, nb_ray ray, int used, float tolerance, inout nb_vec2 lit, int turns)
{
    int at = piece.voxels;
    nb_profile profile = nb_profile_of(at, NB_KIND_GRID, ray, piece.start);
    nb_grid_ray path = nb_grid_ray_of(profile.offset, profile.slope);
    nb_sun_lattice_ray to_sun = nb_sun_lattice_ray_of(int(NEBEL_FOG_TEXEL(at + NB_MEDIUM_LEAF).y), profile.offset, profile.slope);
    nb_vec3 size = nb_grid_bricks(profile.first);
    nb_vec3 last = size - nb_splat3(1.0);
    nb_vec3 extinction = NEBEL_FOG_TEXEL(at).xyz;
    float length = piece.end - piece.start;
    float most = min(nb_columns_by(to_sun), NB_CELLS_AT_ONCE / max(nb_largest(abs(path.slope)), NB_TINY));
    if (piece.rate > 0.0) most = min(most, 0.5 / piece.rate);
    float guess = most;
    bool alone = !NB_HAS(NB_HAS_SEVERAL) || piece.present == 1;
    nb_vec3 radiance = nb_opaque_radiance(at, ray.direction);
    float t = 0.0;
    nb_vec2 sunlight = nb_vec2(0.0, piece.sunlit ? 0.0 : NB_FAR);
    nb_vec3 way_at = nb_splat3(0.0); /* to the sun from t on, as far as it is known: steps into dense fog hide their lit skin from both points */
    nb_cell_walk w = nb_enter_brick(profile.first, size, nb_grid_brick_at(path.from, last), path.from);
    while (t < length && nb_smallest(g.depth) < NB_OPAQUE && !nb_is_tired(turns)) {
        turns += 1 + (alone ? 0 : 2 * used) + (NB_HAS(NB_HAS_SEVERAL) && piece.sunlit ? nb_turns_to_sun() / 2 : 0);
        if (t >= sunlight.y) {
            sunlight = nb_sunlight_from(piece, ray, t, NB_HAS(NB_HAS_SEVERAL) || to_sun.ends, lit, turns);
            way_at = nb_splat3(0.0);
        }
        nb_vec3 from = path.from - w.brick * NB_BRICK;
        nb_vec3 bricks = nb_grid_crossings(w.brick, last, path.from, path.inverse, NB_BRICK);
        nb_vec3 cells = nb_grid_crossings(w.cell, nb_splat3(NB_BRICK - 1.0), from, path.inverse, 1.0);
        float brick_end = min(bricks.x, min(bricks.y, bricks.z));
        float cell_end = w.cells == 0 ? NB_FAR : min(cells.x, min(cells.y, cells.z));
        bool empty = alone && w.cells == 0 && !(w.least > 0.0);
        float end = max(min(min(min(brick_end, cell_end), min(length, sunlight.y)), empty ? NB_FAR : t + guess), t);
        float h = end - t;
        float first = t + h * (0.5 - NB_GAUSS_HALF);
        float second = t + h * (0.5 + NB_GAUSS_HALF);
        nb_two_points sum;
        for (int j = 0; j < 2; j++) {
            sum.extinction[j] = nb_splat3(0.0);
            sum.light[j] = nb_splat3(0.0);
            sum.glow[j] = nb_splat3(0.0);
        }
        nb_vec2 densities = nb_densities_in_cell(w, profile.first, from + path.slope * first, from + path.slope * second);
        nb_add_at_points(sum, at, ray.direction, radiance, densities);
        if (!alone) nb_add_others_at_points(sum, piece, ray, used, first, second);
        nb_vec3 depth = (sum.extinction[0] + sum.extinction[1]) * (0.5 * h);
        /* up to the points, of the line through both extinctions */
        nb_vec3 before = g.depth + (sum.extinction[0] * 0.25 + sum.extinction[1] * (0.25 - NB_GAUSS_HALF)) * h;
        nb_vec3 behind = g.depth + (sum.extinction[0] * (0.25 + NB_GAUSS_HALF) + sum.extinction[1] * 0.25) * h;
        nb_vec3 ways[2];
        ways[0] = nb_splat3(0.0);
        ways[1] = nb_splat3(0.0);
        nb_grid_turns = 0;
        for (int j = 0; j < (sunlight.x > 0.0 && !empty ? 2 : 0); j++) {
            float s = j == 0 ? first : second;
            float amount = -1.0;
            if (!NB_HAS(NB_HAS_SEVERAL)) amount = nb_sun_lattice_amount(to_sun, s);
            if (amount >= 0.0)
                ways[j] = extinction * amount;
            else
                ways[j] = nb_depth_to_sun(nb_spot_on(ray, piece.start, s));
        }
        turns += nb_grid_turns;
        nb_vec3 way_before = ways[0];
        nb_vec3 way_behind = ways[1];
        nb_vec3 shine = sunlight.x * (sum.glow[0] + sum.glow[1]) * nb_exp3(-min(way_at, min(way_before, way_behind)));
        nb_vec3 bright = (shine + sum.light[0] + sum.light[1]) * (0.5 * h) * nb_exp3(-g.depth);
        float strain = nb_largest(depth + 0.5 / NB_GAUSS_HALF * abs(way_behind - way_before));
        bool faint = nb_largest(bright) <= tolerance;
        if (faint || strain <= NB_CELL_BEARS || h <= t * (8.0 * NB_EPSILON)) {
            nb_vec3 sunny = (0.5 * h * sunlight.x) *
                            (sum.glow[0] * nb_exp3(-(before + way_before)) + sum.glow[1] * nb_exp3(-(behind + way_behind)));
            g.radiance += sunny + (0.5 * h) * (sum.light[0] * nb_exp3(-before) + sum.light[1] * nb_exp3(-behind));
            g.sunlight += sunny;
            g.light += (sum.light[0] + sum.light[1]) * (0.5 * h);
            g.depth += depth;
            t = end;
            way_at = max(way_behind + (way_behind - way_before) * (0.25 / NB_GAUSS_HALF - 0.5), nb_splat3(0.0));
            if (NB_RESUMES) { /* a ray with more walks than a pass has turns would begin anew in each pass */
                if (!nb_has_loops(used)) break;
                g.reached = piece.start + t;
                nb_keep_gathered(used, g);
            }
            if (end >= brick_end) {
                nb_vec3 brick = nb_grid_step(w.brick, bricks, path.inverse);
                w = nb_enter_brick(profile.first, size, brick, path.from + path.slope * t);
            } else if (end >= cell_end) {
                w.cell = nb_grid_step(w.cell, cells, path.inverse);
            }
        }
        guess = faint || strain < 0.01 ? most : clamp(0.9 * NB_CELL_BEARS / strain * h, t * (4.0 * NB_EPSILON), most);
    }
    if (NB_MAY_TIRE && t < length) piece.end = piece.start + t;
    return turns;
}
