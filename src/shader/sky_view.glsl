/* The air of a planet from the words of nebel_pack_sky_view: what src/atmosphere/sky_view_lookup.c says of it, in float. Part of the shader
 * text where NEBEL_SKY_VIEW_TEXEL is defined. */
#ifdef NEBEL_SKY_VIEW_TEXEL

/* ---- rays ------------------------------------------------------------------------------------ */

nb_elevation_map nb_air_elevation_map()
{
    nb_vec4 a = NEBEL_SKY_VIEW_TEXEL(NB_AIR_ELEVATION_MAP);
    nb_vec4 b = NEBEL_SKY_VIEW_TEXEL(NB_AIR_ELEVATION_MAP + 1);
    nb_elevation_map outlook;
    outlook.radius = a.x;
    outlook.ground = a.y;
    outlook.thickness = a.z;
    outlook.height = a.w;
    outlook.dip = b.x;
    outlook.ratio = b.y;
    outlook.horizon = b.z;
    outlook.half_arc = b.w;
    return outlook;
}

/* Up, level towards the sun, level aside. */
nb_vec3 nb_air_bearing(nb_vec3 direction)
{
    return nb_vec3(dot(direction, NEBEL_SKY_VIEW_TEXEL(NB_AIR_AXES).xyz), dot(direction, NEBEL_SKY_VIEW_TEXEL(NB_AIR_AXES + 1).xyz),
                   dot(direction, NEBEL_SKY_VIEW_TEXEL(NB_AIR_AXES + 2).xyz));
}

nb_reach nb_air_reach(nb_vec3 bearing)
{
    nb_elevation_map outlook = nb_air_elevation_map();
    float level = sqrt(bearing.y * bearing.y + bearing.z * bearing.z);
    nb_reach reach = nb_rising_reach(outlook, bearing.x, level);
    if (nb_above_horizon(outlook, bearing.x, level) < 0.0) reach = nb_falling_reach(outlook, bearing.x, level);
    return reach;
}

/* A place among entries 0 to count - 1: the one before it, and the part of the way to the next. */
nb_vec2 nb_air_place(float place, float count)
{
    float first = clamp(floor(place), 0.0, count - 2.0);
    return nb_vec2(first, place - first);
}

nb_vec3 nb_toward(nb_vec3 a, nb_vec3 b, float part) { return a + (b - a) * part; }

/* What all pieces of a ray from the view's place have in common. */
struct nb_air_ray {
    float begin; /* where it enters the air [m] */
    float span;  /* and how far it goes there */
    float dense, soft; /* see nb_reach */
    int entry; /* of the first row and column that it lies between */
    int extinction;
    float row;       /* part of the way to the next row, of which entries are so many words on */
    nb_vec4 weights; /* of the entry, the next column, the next row, both */
    nb_vec4 phases;
};

/* 1/sr, of one kind of air. */
float nb_air_phase(int number, nb_turn turn)
{
    nb_vec4 a = NEBEL_SKY_VIEW_TEXEL(NB_AIR_LOBES + 2 * number);
    nb_vec4 b = NEBEL_SKY_VIEW_TEXEL(NB_AIR_LOBES + 2 * number + 1);
    return nb_phase_lobe(a.x, a.y, a.z, a.w, turn) + nb_phase_lobe(b.x, b.y, b.z, b.w, turn);
}

nb_air_ray nb_find_air(nb_vec3 direction)
{
    nb_air_ray ray;
    nb_vec4 sizes = NEBEL_SKY_VIEW_TEXEL(NB_AIR_SIZES);
    nb_vec4 parts = NEBEL_SKY_VIEW_TEXEL(NB_AIR_PARTS);
    nb_vec3 bearing = nb_air_bearing(direction);
    nb_reach reach = nb_air_reach(bearing);
    float level = sqrt(bearing.y * bearing.y + bearing.z * bearing.z);
    float turned = level > 0.0 ? sqrt(clamp(0.5 * (1.0 - bearing.y / level), 0.0, 1.0)) : 0.0;
    nb_vec2 column = nb_air_place(turned * (sizes.x - 1.0), sizes.x);
    float rows = reach.falls ? NB_AIR_FALLING : NB_AIR_RISING;
    nb_vec2 row = nb_air_place(reach.row * (rows - 1.0), rows);
    int at = int(row.x) + (reach.falls ? 0 : int(NB_AIR_FALLING));
    int levels = int(sizes.y) + 1;
    ray.begin = reach.begin;
    ray.span = reach.span;
    ray.dense = reach.dense;
    ray.soft = reach.soft;
    ray.entry = int(parts.x) + (at * int(sizes.x) + int(column.x)) * levels * (int(sizes.z) + 1);
    ray.extinction = int(parts.y) + at * levels;
    ray.row = row.y;
    ray.weights = nb_vec4((1.0 - row.y) * (1.0 - column.y), (1.0 - row.y) * column.y, row.y * (1.0 - column.y), row.y * column.y);
    nb_turn turn = nb_turn_between(direction, NEBEL_SKY_VIEW_TEXEL(NB_AIR_SUN).xyz);
    ray.phases = nb_vec4(nb_air_phase(0, turn), nb_air_phase(1, turn), nb_air_phase(2, turn), nb_air_phase(3, turn));
    return ray;
}

/* ---- light ----------------------------------------------------------------------------------- */

/* The mean over the way of one kind of light. */
nb_vec3 nb_air_mean(nb_air_ray ray, int at, int across, int down)
{
    return NEBEL_SKY_VIEW_TEXEL(at).xyz * ray.weights.x + NEBEL_SKY_VIEW_TEXEL(at + across).xyz * ray.weights.y +
           NEBEL_SKY_VIEW_TEXEL(at + down).xyz * ray.weights.z + NEBEL_SKY_VIEW_TEXEL(at + down + across).xyz * ray.weights.w;
}

nebel_transfer nb_air_light(nb_air_ray ray, float t_max)
{
    nebel_transfer transfer;
    transfer.transmittance = nb_splat3(1.0);
    transfer.in_scattering = nb_splat3(0.0);
    float along = t_max - ray.begin;
    if (along > ray.span - 2.4e-7 * t_max) along = ray.span; /* float does not tell it from the end */
    if (along > 0.0) {
        nb_vec4 sizes = NEBEL_SKY_VIEW_TEXEL(NB_AIR_SIZES);
        int scatterers = int(sizes.z);
        int size = scatterers + 1;
        int across = (int(sizes.y) + 1) * size;
        int down = int(sizes.x) * across;
        float share = along / ray.span;
        nb_vec2 place = nb_air_place((along < ray.span ? nb_level_at(ray.dense, ray.soft, share) : 1.0) * sizes.y, sizes.y + 1.0);
        float level = place.y;
        /* Near the eye means are linear. */
        if (place.x == 0.0 && sizes.y > 1.0) level = min(1.0, share / nb_level_end(ray.dense, ray.soft, 1.0 / sizes.y));
        int row = ray.extinction + int(place.x);
        nb_vec3 near = nb_toward(NEBEL_SKY_VIEW_TEXEL(row).xyz, NEBEL_SKY_VIEW_TEXEL(row + int(sizes.y) + 1).xyz, ray.row);
        nb_vec3 far = nb_toward(NEBEL_SKY_VIEW_TEXEL(row + 1).xyz, NEBEL_SKY_VIEW_TEXEL(row + int(sizes.y) + 2).xyz, ray.row);
        nb_vec3 depth = along * nb_toward(near, far, level);
        nb_vec3 mean = nb_splat3(0.0);
        for (int i = 0; i <= scatterers; i++) {
            int at = ray.entry + int(place.x) * size + i;
            float phase = i < scatterers ? nb_component(ray.phases, i) : 1.0;
            mean += phase * nb_toward(nb_air_mean(ray, at, across, down), nb_air_mean(ray, at + size, across, down), level);
        }
        transfer.transmittance = nb_vec3(nb_exp(-depth.x), nb_exp(-depth.y), nb_exp(-depth.z));
        transfer.in_scattering = along * NEBEL_SKY_VIEW_TEXEL(NB_AIR_IRRADIANCE).xyz * mean;
    }
    return transfer;
}

nebel_transfer nebel_trace_atmosphere(nb_vec3 direction, float t_max)
{
    return nb_air_light(nb_find_air(direction), t_max);
}

/* ---- the ground ------------------------------------------------------------------------------ */

struct nebel_ground {
    float distance;
    nb_vec3 normal;
    nb_vec3 sun;
    nb_vec3 sky;
};

nebel_ground nebel_trace_ground(nb_vec3 direction)
{
    nebel_ground ground;
    nb_reach reach = nb_air_reach(nb_air_bearing(direction));
    nb_elevation_map outlook = nb_air_elevation_map();
    nb_vec4 parts = NEBEL_SKY_VIEW_TEXEL(NB_AIR_PARTS);
    nb_vec4 skies = NEBEL_SKY_VIEW_TEXEL(NB_AIR_SKIES);
    nb_vec3 irradiance = NEBEL_SKY_VIEW_TEXEL(NB_AIR_IRRADIANCE).xyz;
    float way = reach.begin + reach.span;
    ground.distance = reach.falls ? way : 1e18;
    ground.normal = normalize(outlook.radius * NEBEL_SKY_VIEW_TEXEL(NB_AIR_AXES).xyz + way * direction);
    float cosine = clamp(dot(ground.normal, NEBEL_SKY_VIEW_TEXEL(NB_AIR_SUN).xyz), -1.0, 1.0);
    nb_vec2 place = nb_air_place(sqrt(max(cosine, 0.0)) * (NB_AIR_SUNS - 1.0), NB_AIR_SUNS);
    int at = int(parts.z) + int(place.x);
    ground.sun = irradiance * nb_toward(NEBEL_SKY_VIEW_TEXEL(at).xyz, NEBEL_SKY_VIEW_TEXEL(at + 1).xyz, place.y);
    if (!(cosine > 0.0)) ground.sun = nb_splat3(0.0);
    float angle = 2.0 * abs(cosine) / (1.0 + sqrt(max(0.0, 1.0 - abs(cosine))));
    float spread = nb_copy_sign(nb_log(1.0 + angle * skies.x), cosine);
    place = nb_air_place(clamp((spread - skies.y) * skies.z, 0.0, skies.w - 1.0), skies.w);
    at = int(parts.w) + int(place.x);
    nb_vec3 power = nb_toward(NEBEL_SKY_VIEW_TEXEL(at).xyz, NEBEL_SKY_VIEW_TEXEL(at + 1).xyz, place.y);
    ground.sky = irradiance * nb_vec3(nb_exp(power.x), nb_exp(power.y), nb_exp(power.z));
    return ground;
}
#endif
