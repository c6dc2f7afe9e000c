/* Rays of pixels and lengths of depths, from the words of nebel_compute_view_rays; see src/shader/view_rays.c for what they are.
 * Part of the shader text where NEBEL_VIEW is defined. */
#ifdef NEBEL_VIEW
struct nebel_view_ray {
    nb_vec3 origin;
    nb_vec3 direction;
    float t_max;
};

/* A word is linear in the pixel: its xyz at (0, 0), and its growth in x and y in the two words behind it. */
nb_vec3 nb_view_vector(int i, nb_vec2 pixel)
{
    return NEBEL_RAY(i).xyz + pixel.x * NEBEL_RAY(i + 1).xyz + pixel.y * NEBEL_RAY(i + 2).xyz;
}

/* The same for one number: at (0, 0), growth in x, growth in y. */
float nb_view_number(int i, nb_vec2 pixel)
{
    return NEBEL_RAY(i).x + pixel.x * NEBEL_RAY(i).y + pixel.y * NEBEL_RAY(i).z;
}

/* Where the plane meets the ray, in steps; `never` where it is not in front. */
float nb_view_divide(float above, float below, float never)
{
    return below > 0.0 ? above / below : never;
}

bool nb_view_is_sky(float depth)
{
    float test = NEBEL_RAY(9).w;
    bool found = depth > 0.0 && depth < 1e18;
    return test == 1.0 ? depth == NEBEL_RAY(8).w : test == 0.0 && !found;
}

/* How far, in steps of the ray's own length, before division by that of a distance. */
float nb_view_steps(float kind, float depth, nb_vec2 pixel)
{
    float above = nb_view_number(6, pixel);
    float below = nb_view_number(7, pixel);
    float value = depth;
    if (kind == 0.0) value = NEBEL_RAY(1).w - depth;
    if (kind == 1.0) value = nb_expm1(depth * NEBEL_RAY(1).w) * NEBEL_RAY(2).w;
    return nb_view_divide(above + value * NEBEL_RAY(6).w, below + value * NEBEL_RAY(7).w, 1e18);
}

/* NEBEL_DEPTH_ENCODING and NEBEL_FROM_EYE leave out what a host knows that it does not need. */
nebel_view_ray nebel_make_view_ray(nb_vec2 pixel, float depth)
{
    nebel_view_ray sight;
#ifdef NEBEL_DEPTH_ENCODING
    float kind = float(NEBEL_DEPTH_ENCODING);
#else
    float kind = NEBEL_RAY(0).w;
#endif
    nb_vec3 way = nb_view_vector(3, pixel);
    float size = sqrt(dot(way, way));
    float end = kind == 3.0 ? depth : size * nb_view_steps(kind, depth, pixel);
    if (nb_view_is_sky(depth)) end = 1e18;
    sight.direction = way * (1.0 / size);
#ifdef NEBEL_FROM_EYE
    sight.origin = nb_vec3(0.0, 0.0, 0.0);
    sight.t_max = end < 1e18 ? max(end, 0.0) : 1e18;
#else
    float start = size * nb_view_divide(nb_view_number(8, pixel), nb_view_number(9, pixel), 0.0);
    sight.origin = nb_view_vector(0, pixel) + start * sight.direction;
    sight.t_max = end < 1e18 ? max(end - start, 0.0) : 1e18;
#endif
    return sight;
}
#endif
