/* Transparent surfaces and particles in fog. Part of the shader text where NEBEL_TRANSPARENT is defined. */
#ifdef NEBEL_TRANSPARENT

/* ---- blending: nb_blend for three colours ---------------------------------------------------- */

struct nebel_blend {
    nb_vec3 source;
    nb_vec3 factor;
};

nebel_blend nb_blend_join(nb_blend x, nb_blend y, nb_blend z)
{
    nebel_blend blend;
    blend.source = nb_vec3(x.source, y.source, z.source);
    blend.factor = nb_vec3(x.factor, y.factor, z.factor);
    return blend;
}

nebel_blend nebel_blend_over(nb_vec3 color, float alpha, nebel_transfer fog)
{
    nb_vec3 t = fog.transmittance;
    nb_vec3 s = fog.in_scattering;
    return nb_blend_join(nb_blend_over(color.x, alpha, t.x, s.x), nb_blend_over(color.y, alpha, t.y, s.y),
                         nb_blend_over(color.z, alpha, t.z, s.z));
}

nebel_blend nebel_blend_premultiplied(nb_vec3 color, float alpha, nebel_transfer fog)
{
    nb_vec3 t = fog.transmittance;
    nb_vec3 s = fog.in_scattering;
    return nb_blend_join(nb_blend_premultiplied(color.x, alpha, t.x, s.x), nb_blend_premultiplied(color.y, alpha, t.y, s.y),
                         nb_blend_premultiplied(color.z, alpha, t.z, s.z));
}

nebel_blend nebel_blend_additive(nb_vec3 color, nebel_transfer fog)
{
    nb_vec3 t = fog.transmittance;
    return nb_blend_join(nb_blend_additive(color.x, t.x), nb_blend_additive(color.y, t.y), nb_blend_additive(color.z, t.z));
}

nebel_blend nebel_blend_multiply(nb_vec3 color, nebel_transfer fog)
{
    nb_vec3 s = fog.in_scattering;
    return nb_blend_join(nb_blend_multiply(color.x, s.x), nb_blend_multiply(color.y, s.y), nb_blend_multiply(color.z, s.z));
}

nebel_blend nebel_blend_screen(nb_vec3 color, nebel_transfer fog)
{
    nb_vec3 t = fog.transmittance;
    nb_vec3 s = fog.in_scattering;
    return nb_blend_join(nb_blend_screen(color.x, t.x, s.x), nb_blend_screen(color.y, t.y, s.y),
                         nb_blend_screen(color.z, t.z, s.z));
}

/* b(L) = in_scattering + transmittance L: premultiplied, with an alpha for each colour */
nebel_blend nebel_blend_medium(nebel_transfer medium, nebel_transfer fog)
{
    nb_vec3 c = medium.in_scattering;
    nb_vec3 a = nb_splat3(1.0) - medium.transmittance;
    nb_vec3 t = fog.transmittance;
    nb_vec3 s = fog.in_scattering;
    return nb_blend_join(nb_blend_premultiplied(c.x, a.x, t.x, s.x), nb_blend_premultiplied(c.y, a.y, t.y, s.y),
                         nb_blend_premultiplied(c.z, a.z, t.z, s.z));
}

nb_vec4 nebel_blend_gray(nebel_blend blend)
{
    return nb_vec4(blend.source.x, blend.source.y, blend.source.z, dot(blend.factor, nb_splat3(1.0 / 3.0)));
}

/* ---- particles: the piece of a ball or a Gaussian that lies before the opaque surface -------- */

/* The ray by its closest approach to a centre: t there, the square of the distance, |direction|, and where it is inside. */
struct nb_approach {
    float closest;
    float square;
    float speed;
    float enter;
    float leave;
};

nb_approach nb_approach_at(float closest, float square, float speed, float t_max, float radius)
{
    nb_approach approach;
    approach.closest = closest;
    approach.square = square;
    approach.speed = speed;
    float half_chord = sqrt(max(radius * radius - square, 0.0)) / max(speed, NB_TINY);
    approach.enter = clamp(closest - half_chord, 0.0, max(t_max, 0.0));
    approach.leave = clamp(closest + half_chord, 0.0, max(t_max, 0.0));
    return approach;
}

nb_approach nb_approach_of(nb_vec3 p, nb_vec3 direction, float t_max, float radius)
{
    float square = dot(direction, direction);
    float closest = -dot(p, direction) / max(square, NB_TINY);
    nb_vec3 q = p + direction * closest;
    return nb_approach_at(closest, dot(q, q), sqrt(square), t_max, radius);
}

float nb_sphere_piece(nb_approach a, float radius, int power)
{
    float h = a.leave - a.enter;
    float k = a.speed / radius;
    float c = 1.0 - a.square / (radius * radius);
    float uneven = nb_radial_integral(c, (a.enter - a.closest) * k, k, h, power).value;
    return h > 0.0 ? (power > 0 ? uneven : h) : 0.0;
}

float nebel_sphere_path_length(nb_vec3 origin, nb_vec3 direction, float t_max, nb_vec3 center, float radius, int power)
{
    return nb_sphere_piece(nb_approach_of(origin - center, direction, t_max, radius), radius, power);
}

float nb_gaussian_piece(nb_approach a, float sigma)
{
    float scale = 0.70710678118654752440 / sigma;
    float k = a.speed * scale;
    float m = min(a.square * (scale * scale), 1e9);
    float from = (a.enter - a.closest) * k;
    float to = (a.leave - a.closest) * k;
    return a.leave > a.enter ? nb_gaussian_integral(m, from, to, k).value : 0.0;
}

float nebel_gaussian_path_length(nb_vec3 origin, nb_vec3 direction, float t_max, nb_vec3 center, float radius, float sigma)
{
    return nb_gaussian_piece(nb_approach_of(origin - center, direction, t_max, min(radius, NB_FAR)), sigma);
}

nebel_transfer nebel_medium_transfer(float length, nb_vec3 extinction, nb_vec3 light)
{
    nb_attenuation attenuation = nb_attenuate(extinction * length);
    nebel_transfer medium;
    medium.transmittance = attenuation.left;
    medium.in_scattering = min(light * length * attenuation.mean, nb_splat3(NEBEL_MAX_RADIANCE));
    return medium;
}

/* ---- the comparison of depth at five places -------------------------------------------------- */

struct nebel_depth_taps {
    float offset;
    float nothing;
    float edge;
    float margin;
    float brightness;
};

nebel_depth_taps nebel_default_taps()
{
    nebel_depth_taps taps;
    taps.offset = 0.0005;
    taps.nothing = 100000.0;
    taps.edge = 0.5;
    taps.margin = 0.125;
    taps.brightness = 1.0;
    return taps;
}

nb_vec2 nebel_screen_uv(nb_vec4 clip)
{
    return nb_vec2(0.5 + 0.5 * clip.x / clip.w, 0.5 + 0.5 * clip.y / clip.w);
}

float nb_tap_depth(float depth, nebel_depth_taps taps)
{
    return depth < 0.0 ? taps.nothing : depth;
}

float nebel_compare_taps(float depth, float center, nb_vec4 corners, nebel_depth_taps taps)
{
    float a = nb_tap_depth(center, taps);
    float b = nb_tap_depth(corners.x, taps);
    float c = nb_tap_depth(corners.y, taps);
    float d = nb_tap_depth(corners.z, taps);
    float e = nb_tap_depth(corners.w, taps);
    float nearest = min(min(a, b), min(c, min(d, e)));
    float farthest = max(max(a, b), max(c, max(d, e)));
    bool drawn = farthest - nearest > taps.edge || nearest >= depth - taps.margin;
    return drawn ? taps.brightness : 0.0;
}

#ifdef NEBEL_OPAQUE_DEPTH
/* Alone with a name of its own: the host's macro may use any other. */
float nb_opaque_depth(nb_vec2 nb_place) { return NEBEL_OPAQUE_DEPTH(nb_place); }

float nebel_five_taps(nb_vec2 place, float depth, nebel_depth_taps taps)
{
    float o = taps.offset;
    nb_vec4 corners = nb_vec4(nb_opaque_depth(place + nb_vec2(-o, -o)), nb_opaque_depth(place + nb_vec2(o, -o)),
                              nb_opaque_depth(place + nb_vec2(-o, o)), nb_opaque_depth(place + nb_vec2(o, o)));
    return nebel_compare_taps(depth, nb_opaque_depth(place), corners, taps);
}
#endif
#endif
