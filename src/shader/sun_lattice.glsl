/* How much fog lies between places in voxels and the sun: from the sun lattices of layout.h, whose nodes src/light/sun_lattice.c finds,
 * or by a walk to the sun where they do not hold what lies between them. */

/* A ray in nodes of a lattice: from + slope s, s in metres. */
struct nb_sun_lattice_ray {
    int first; /* texel of its cells */
    nb_vec3 size, from, slope;
    float step;
    bool ends;                  /* whether there is fog where the box ends, and so beyond, which does not count */
    float up;                   /* 1 where the sun is where layers have larger numbers, else -1 */
    nb_vec3 end_from, end_slope; /* layers times `up` in which the way to the sun meets the faces; the nearest one is where it leaves */
};

/* Sides, and what lies across the layers. */
nb_vec3 nb_sun_lattice_axes(nb_vec3 v, int axis)
{
    nb_vec3 turned = v;
    if (axis == 0) turned = v.yzx;
    if (axis == 1) turned = v.zxy;
    return turned;
}

float nb_float_of(uint bits) { return nb_from_bits(int(bits)); }

/* Ways that lean less leave by no side. */
#define NB_MIN_LEAN 1e-6

/* `from` and `slope` are in cells of the grid. */
nb_sun_lattice_ray nb_sun_lattice_ray_of(int lattice, nb_vec3 from, nb_vec3 slope)
{
    nb_uvec4 head = NEBEL_VOXEL_TEXEL(lattice);
    nb_uvec4 lean = NEBEL_VOXEL_TEXEL(lattice + 1);
    nb_uvec4 last = NEBEL_VOXEL_TEXEL(lattice + 2);
    nb_vec3 place = nb_sun_lattice_axes(from, int(head.w));
    nb_vec3 rate = nb_sun_lattice_axes(slope, int(head.w));
    nb_vec2 leans = nb_vec2(nb_float_of(lean.x), nb_float_of(lean.y));
    float per_cell = nb_float_of(last.x);
    float per_layer = nb_float_of(last.w);
    nb_uvec4 end = NEBEL_VOXEL_TEXEL(lattice + 3);
    nb_vec2 aside = place.xy - leans * place.z;
    nb_vec2 drift = rate.xy - leans * rate.z;
    nb_vec2 sides = aside * per_cell - nb_vec2(nb_float_of(lean.z), nb_float_of(lean.w));
    nb_vec2 speed = drift * per_cell;
    float up = nb_float_of(end.w);
    bool by_first = abs(leans.x) > NB_MIN_LEAN;
    bool by_second = abs(leans.y) > NB_MIN_LEAN;
    nb_vec2 layers = nb_vec2(by_first ? per_layer * up / leans.x : 0.0, by_second ? per_layer * up / leans.y : 0.0);
    nb_sun_lattice_ray ray;
    ray.first = lattice + NB_SUN_LATTICE_TEXELS;
    ray.size = nb_vec3(float(head.x), float(head.y), float(head.z));
    ray.from = nb_vec3(sides.x, sides.y, place.z * per_layer);
    ray.slope = nb_vec3(speed.x, speed.y, rate.z * per_layer);
    ray.step = nb_float_of(last.y);
    ray.ends = last.z != 0u;
    ray.up = up;
    ray.end_from = nb_vec3(by_first ? (nb_float_of(end.x) - aside.x) * layers.x : NB_FAR,
                           by_second ? (nb_float_of(end.y) - aside.y) * layers.y : NB_FAR, nb_float_of(end.z) * per_layer * up);
    ray.end_slope = nb_vec3(-drift.x * layers.x, -drift.y * layers.y, 0.0);
    return ray;
}

/* -NB_HUGE where the nodes do not hold it. */
float nb_sun_lattice_value(nb_sun_lattice_ray ray, nb_vec3 at)
{
    nb_vec3 place = clamp(at, nb_splat3(0.0), ray.size);
    nb_vec3 cell = min(floor(place), ray.size - nb_splat3(1.0));
    nb_uvec4 texel = NEBEL_VOXEL_TEXEL(ray.first + nb_grid_index(cell, ray.size));
    bool flawed = (texel.x & texel.y & texel.z & texel.w) == 0xffffffffu;
    return flawed ? -NB_HUGE : ray.step * nb_grid_value(nb_grid_cell_of(texel), place - cell);
}

/* The integral of the density from there to where the way to the sun leaves the box; less than 0 where the nodes do not hold it. */
float nb_sun_lattice_amount(nb_sun_lattice_ray ray, float s)
{
    nb_vec3 place = ray.from + ray.slope * s;
    float amount = nb_sun_lattice_value(ray, place);
    if (ray.ends && amount >= 0.0) {
        float layer = ray.up * nb_smallest(ray.end_from + ray.end_slope * s);
        float outside = nb_sun_lattice_value(ray, nb_vec3(place.x, place.y, layer));
        amount = outside >= 0.0 ? max(amount - outside, 0.0) : -NB_HUGE;
    }
    return amount;
}

/* Behind so much depth no light counts. */
#define NB_SUN_IS_GONE 17.0

/* What a walk to the sun takes at first, in cells; then more and more. */
#define NB_FIRST_CELLS 2.0
#define NB_MAX_CELLS 16.0

/* Of the grid that a medium is, from where a ray to the sun enters its box to where it leaves, or something covers it: a walk to where
 * the lattice holds the rest, mostly none. */
float nb_amount_to_sun(int medium, nb_ray ray, nb_stretch s)
{
    nb_profile profile = nb_profile_of(medium, NB_KIND_GRID, ray, s.enter);
    nb_sun_lattice_ray to_sun =
        nb_sun_lattice_ray_of(int(NEBEL_FOG_TEXEL(medium + NB_MEDIUM_LEAF).y), profile.offset, profile.slope);
    float length = s.leave - s.enter;
    float behind = 0.0;
    if (NB_HAS(NB_HAS_OVERRIDE)) behind = nb_sun_lattice_amount(to_sun, length);
    float rest = nb_sun_lattice_amount(to_sun, 0.0);
    float sum = 0.0;
    bool ends = false;
    if (rest < 0.0 || behind < 0.0) { /* for drivers that count the turns of loops */
        float enough = NB_SUN_IS_GONE / max(nb_smallest(NEBEL_FOG_TEXEL(medium).xyz), NB_TINY);
        float cell = 1.0 / max(nb_largest(abs(profile.slope)), NB_TINY);
        float step = NB_FIRST_CELLS * cell;
        float t = 0.0;
        while (!ends && (rest < 0.0 || behind < 0.0)) {
            float h = min(step, length - t);
            sum += nb_grid_integral(profile.offset + profile.slope * t, profile.slope, profile.first, h, enough);
            t += max(h, length * NB_EPSILON);
            step = min(2.0 * step, NB_MAX_CELLS * cell);
            rest = nb_sun_lattice_amount(to_sun, t);
            ends = t >= length || sum >= enough;
        }
    }
    if (!ends) sum += max(rest - behind, 0.0);
    return sum;
}
