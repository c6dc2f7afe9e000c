/* Ambient light by direction, from the words of nebel_pack_environment: what src/light/environment.c and environment_map.c say of it, in float. Without
 * NEBEL_ENVIRONMENT_TEXEL it is dark. */
#ifndef NEBEL_ENVIRONMENT_TEXEL
#define NEBEL_ENVIRONMENT_TEXEL(i) nb_vec4(0.0, 0.0, 0.0, 0.0)
#endif

/* ---- directions ------------------------------------------------------------------------------ */

/* The angle whose tangent is y / x, both 0 or more, in full turns: drivers' own may be off by a thousandth. Below the tangent of 15
 * degrees the series up to x^9 is within 5e-8. */
float nb_turns_of(float y, float x)
{
    float most = max(max(x, y), NB_TINY);
    float ratio = min(x, y) / most;
    float angle = 0.0;
    if (ratio > 0.26794919243112271) {
        angle = 0.52359877559829887;
        ratio = (ratio * 1.7320508075688773 - 1.0) / (1.7320508075688773 + ratio);
    }
    float s = ratio * ratio;
    angle += ratio * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s * (1.0 / 9.0)))));
    return (y > x ? 1.5707963267948966 - angle : angle) * 0.15915494309189534;
}

/* Longitude from the left edge and colatitude, in parts of the whole, in the frame of the environment's map. */
nb_vec2 nb_environment_place(nb_vec3 direction)
{
    nb_vec4 head = NEBEL_ENVIRONMENT_TEXEL(0);
    float x = direction.x * head.y - direction.z * head.z;
    float ahead = -(direction.x * head.z + direction.z * head.y);
    float turn = nb_turns_of(abs(x), abs(ahead));
    if (ahead < 0.0) turn = 0.5 - turn;
    float side = sqrt(x * x + ahead * ahead);
    float fall = nb_turns_of(side, abs(direction.y));
    if (direction.y < 0.0) fall = 0.5 - fall;
    return nb_vec2(x < 0.0 ? 0.5 - turn : 0.5 + turn, 2.0 * fall);
}

/* ---- gradients ------------------------------------------------------------------------------- */

/* Of the means of the sine of the elevation and of its size. */
nb_vec3 nb_mix_gradient(float mean, float rectified)
{
    float above = max(0.5 * (rectified + mean), 0.0);
    float below = max(0.5 * (rectified - mean), 0.0);
    return max(NEBEL_ENVIRONMENT_TEXEL(2).xyz * (1.0 - above - below) + NEBEL_ENVIRONMENT_TEXEL(1).xyz * above +
                   NEBEL_ENVIRONMENT_TEXEL(3).xyz * below,
               nb_splat3(0.0));
}

/* The cubic through the four nearest nodes. */
float nb_rectified(int table, float y)
{
    nb_vec4 head = NEBEL_ENVIRONMENT_TEXEL(table);
    float place = head.z * nb_log1p(y * head.y);
    float first = clamp(floor(place) - 1.0, 0.0, float(NB_FILTER_PIECES - 1));
    float x = place - first;
    nb_vec4 k = NEBEL_ENVIRONMENT_TEXEL(table + 1 + int(first));
    return k.x * ((x - 1.0) * (x - 2.0) * (3.0 - x) / 6.0) + k.y * (x * (x - 2.0) * (x - 3.0) / 2.0) +
           k.z * (x * (x - 1.0) * (3.0 - x) / 2.0) + k.w * (x * (x - 1.0) * (x - 2.0) / 6.0);
}

/* ---- maps ------------------------------------------------------------------------------------ */

nb_vec4 nb_spline_weights(float x)
{
    float y = 1.0 - x;
    return nb_vec4(y * y * y, 4.0 + x * x * (3.0 * x - 6.0), 4.0 + y * y * (3.0 * y - 6.0), x * x * x) / 6.0;
}

float nb_component(nb_vec4 v, int i) { return i == 0 ? v.x : i == 1 ? v.y : i == 2 ? v.z : v.w; }

/* B-splines. A row beyond a pole is the one as far on the other side, half way round. */
nb_vec3 nb_spline_at(int table, nb_vec3 direction)
{
    nb_vec2 place = nb_environment_place(direction);
    int rows = int(NEBEL_ENVIRONMENT_TEXEL(table).y);
    int columns = 2 * rows;
    float x = place.x * float(columns) - 0.5;
    float y = place.y * float(rows) - 0.5;
    nb_vec4 across = nb_spline_weights(x - floor(x));
    nb_vec4 down = nb_spline_weights(y - floor(y));
    nb_vec3 sum = nb_splat3(0.0);
    for (int i = 0; i < 4; i++) {
        int row = int(floor(y)) - 1 + i;
        int column = int(floor(x)) - 1 + columns;
        if (row < 0 || row >= rows) {
            row = row < 0 ? -1 - row : 2 * rows - 1 - row;
            column += rows;
        }
        nb_vec3 along = nb_splat3(0.0);
        for (int j = 0; j < 4; j++)
            along += NEBEL_ENVIRONMENT_TEXEL(table + 1 + row * columns + ((column + j) & (columns - 1))).xyz * nb_component(across, j);
        sum += along * nb_component(down, i);
    }
    return max(sum, nb_splat3(0.0)) * NEBEL_ENVIRONMENT_TEXEL(0).w;
}

nb_vec3 nb_pixels_between(int row, float left, float width, float share)
{
    float next = left + 1.0 < width ? left + 1.0 : 0.0;
    nb_vec3 a = NEBEL_ENVIRONMENT_TEXEL(row + int(left)).xyz;
    return a + (NEBEL_ENVIRONMENT_TEXEL(row + int(next)).xyz - a) * share;
}

/* Linear between the middles of pixels. */
nb_vec3 nb_picture_at(int table, nb_vec3 direction)
{
    nb_vec2 place = nb_environment_place(direction);
    nb_vec4 head = NEBEL_ENVIRONMENT_TEXEL(table);
    float x = place.x * head.x - 0.5;
    float y = clamp(place.y * head.y - 0.5, 0.0, head.y - 1.0);
    float left = floor(x);
    float upper = floor(y);
    float lower = min(upper + 1.0, head.y - 1.0);
    float share = x - left;
    if (left < 0.0) left += head.x;
    if (left >= head.x) left -= head.x;
    nb_vec3 over = nb_pixels_between(table + 1 + int(upper) * int(head.x), left, head.x, share);
    nb_vec3 under = nb_pixels_between(table + 1 + int(lower) * int(head.x), left, head.x, share);
    return (over + (under - over) * (y - upper)) * NEBEL_ENVIRONMENT_TEXEL(0).w;
}

/* ---- light ----------------------------------------------------------------------------------- */

/* What a phase function, of which `table` is the filter, makes of it. */
nb_vec3 nb_environment_scattered(int table, nb_vec3 direction)
{
    if (int(NEBEL_ENVIRONMENT_TEXEL(0).x) == NB_ENVIRONMENT_MAP) return nb_spline_at(table, direction);
    float y = clamp(direction.y, -1.0, 1.0);
    return nb_mix_gradient(NEBEL_ENVIRONMENT_TEXEL(table).x * y, nb_rectified(table, abs(y)));
}

nb_vec3 nebel_evaluate_environment(nb_vec3 direction)
{
    int type = int(NEBEL_ENVIRONMENT_TEXEL(0).x);
    if (type == NB_ENVIRONMENT_CONSTANT) return NEBEL_ENVIRONMENT_TEXEL(1).xyz;
    if (type == NB_ENVIRONMENT_MAP) return nb_picture_at(int(NEBEL_ENVIRONMENT_TEXEL(1).y), direction);
    return nb_mix_gradient(direction.y, abs(direction.y));
}

/* Lambert's mean of the size of the sine of elevation: (4 / (3 pi)) (cos + y asin y), y the sine of the normal's. */
nb_vec3 nebel_evaluate_environment_diffuse(nb_vec3 normal)
{
    int type = int(NEBEL_ENVIRONMENT_TEXEL(0).x);
    if (type == NB_ENVIRONMENT_CONSTANT) return NEBEL_ENVIRONMENT_TEXEL(1).xyz;
    if (type == NB_ENVIRONMENT_MAP) return nb_spline_at(int(NEBEL_ENVIRONMENT_TEXEL(1).x), normal);
    float y = abs(normal.y);
    float side = sqrt(normal.x * normal.x + normal.z * normal.z);
    float rise = 6.2831853071795865 * nb_turns_of(y, side);
    return nb_mix_gradient(2.0 * normal.y / 3.0, 0.42441318157838759 * (side + y * rise));
}

/* ---- media ----------------------------------------------------------------------------------- */

/* As many times as bright is ambient light of a direction, all along the ray that is asked. */
#ifndef NEBEL_ENVIRONMENT_SCALE
#define NEBEL_ENVIRONMENT_SCALE nb_splat3(1.0)
#endif

/* Radiance of a medium's opaque fog along rays of a direction, without the light of sun and point lights. */
nb_vec3 nb_opaque_radiance(int medium, nb_vec3 direction)
{
    nb_vec3 radiance = NEBEL_FOG_TEXEL(medium + 2).xyz;
#if NB_DECLARES(NB_HAS_ENVIRONMENT)
    if (NB_HAS(NB_HAS_ENVIRONMENT)) {
        int table = int(NEBEL_FOG_TEXEL(medium + NB_MEDIUM_FILTER).w);
        if (table > 0) radiance *= NEBEL_ENVIRONMENT_SCALE * nb_environment_scattered(table, direction);
    }
#endif
    return radiance;
}

/* The same per metre where its density is 1, with what it emits. */
nb_vec3 nb_light_per_metre(int medium, nb_vec3 radiance)
{
    nb_vec3 light = NEBEL_FOG_TEXEL(medium + 1).xyz;
    if (NB_HAS(NB_HAS_ENVIRONMENT) && NEBEL_FOG_TEXEL(medium + NB_MEDIUM_FILTER).w > 0.0) light += radiance * NEBEL_FOG_TEXEL(medium).xyz;
    return light;
}
