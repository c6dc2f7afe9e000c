/* Light that fog scatters more than once, as src/diffusion/diffusion_gather.c gathers it along a ray: the source radiance of the lattice's
 * nodes, which layout.h describes, between places a cell apart; in each such piece the exact transmittance. */
#ifndef NEBEL_DIFFUSION_TEXEL
#define NEBEL_DIFFUSION_TEXEL(i) nb_vec4(0.0, 0.0, 0.0, 0.0)
#endif

#if NB_DECLARES(NB_HAS_DIFFUSION)

/* Pieces that leave less than this are halved, so often at most: fog may begin anywhere in them. Where they leave more than that they
 * grow again. */
#define NB_THICK_PIECE 0.5
#define NB_THIN_PIECE 0.8
#define NB_MAX_HALVINGS 5

/* g of no lobe of own light that went almost straight on is more. */
#define NB_MAX_GLOW 0.999

/* What fog leaves less of does not matter. */
#define NB_DARK_DEPTH 9.2103

/* ---- depth ----------------------------------------------------------------------------------- */

/* Of the fog as it is, and of what does not scatter straight on. */
struct nb_two_depths {
    nb_vec3 whole, scaled;
};

void nb_add_two_depths(inout nb_two_depths sum, int at, nb_ray ray, nb_stretch s)
{
    nb_vec3 depth = nb_depth_within(at, ray, s);
    int scattering = int(NEBEL_FOG_TEXEL(at + NB_MEDIUM_SCATTERING).w);
    nb_vec3 albedo = nb_splat3(0.0);
    if (scattering > 0) albedo = NEBEL_FOG_TEXEL(scattering).xyz;
    sum.whole += depth;
    sum.scaled += depth * (nb_splat3(1.0) - albedo * NEBEL_FOG_TEXEL(at + NB_MEDIUM_AHEAD).w);
}

/* From `from` to the end of the ray, of what ranks from `floor` on. */
void nb_add_depths_between(inout nb_two_depths sum, nb_ray ray, nb_media media, float from, int floor, inout int turns)
{
    for (int i = 0; i < media.count; i++) {
        int at = nb_medium_at(media.first + i, media.listed);
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        float t = from;
        if (NB_HAS(NB_HAS_OVERRIDE) && (nb_is_covered(at, floor) || int(NEBEL_FOG_TEXEL(at).w) == NB_KIND_EXCLUDE)) {
            turns++;
            continue;
        }
        for (int part = 0; part < (NB_HAS(NB_HAS_GROUP) ? leaves : 1); part++) {
            nb_stretch s = nb_next_stretch(at, leaves, ray, t);
            turns += nb_stretch_turns(leaves, s);
            if (!(s.enter < s.leave)) break;
            nb_add_two_depths(sum, at, ray, s);
            t = s.leave;
        }
    }
}

/* Where some may cover others: see nb_depth_of. */
void nb_add_covered_between(inout nb_two_depths sum, nb_ray ray, nb_media media, float from, inout int turns)
{
    float t = from;
    nb_ray part = ray;
    while (t < ray.t_max && !nb_is_tired(turns)) {
        nb_cover cover = nb_cover_at(ray, media, t, turns);
        part.t_max = cover.end;
        nb_add_depths_between(sum, part, media, t, cover.floor, turns);
        t = cover.end;
    }
}

nb_two_depths nb_depths_between(nb_ray ray, nb_media media, float from, float to, inout int turns)
{
    nb_two_depths sum;
    sum.whole = nb_splat3(0.0);
    sum.scaled = nb_splat3(0.0);
    ray.t_max = to;
    if (!NB_HAS(NB_HAS_SEVERAL)) media.count = min(media.count, 1);
    if (NB_HAS(NB_HAS_OVERRIDE))
        nb_add_covered_between(sum, ray, media, from, turns);
    else
        nb_add_depths_between(sum, ray, media, from, 0, turns);
    return sum;
}

/* ---- the lattice ----------------------------------------------------------------------------- */

struct nb_diffusion_lattice {
    nb_vec3 low, spacing, cells; /* relative to the packed eye [m] */
    int word, texel, channels, flags;
};

nb_diffusion_lattice nb_diffusion_lattice_of(int word)
{
    nb_vec4 low = NEBEL_FOG_TEXEL(word);
    nb_vec4 spacing = NEBEL_FOG_TEXEL(word + 1);
    nb_vec4 cells = NEBEL_FOG_TEXEL(word + 2);
    nb_diffusion_lattice l;
    l.low = low.xyz;
    l.spacing = spacing.xyz;
    l.cells = cells.xyz;
    l.word = word;
    l.texel = int(low.w);
    l.channels = int(spacing.w);
    l.flags = int(cells.w);
    return l;
}

/* Whether fog goes on beyond the low end along an axis, of the high one for high = 1. */
bool nb_goes_on(nb_diffusion_lattice l, int axis, int high) { return (l.flags >> (2 * axis + high) & 1) != 0; }

bool nb_dims_sky(nb_diffusion_lattice l) { return (l.flags & NB_LATTICE_SKY) != 0; }

bool nb_is_own(nb_diffusion_lattice l) { return (l.flags & NB_LATTICE_OWN) != 0; }

bool nb_is_beside(float place, float low, float extent) { return place < low || place > low + extent; }

/* Where fog goes on beside a lattice, bodies in it are not seen any more. */
nb_diffusion_lattice nb_diffusion_lattice_at(nb_diffusion_lattice l, nb_vec3 place)
{
    nb_vec3 extent = l.spacing * l.cells;
    bool beside = (nb_goes_on(l, 0, 0) && nb_is_beside(place.x, l.low.x, extent.x)) ||
                  (nb_goes_on(l, 2, 0) && nb_is_beside(place.z, l.low.z, extent.z));
    if ((l.flags & NB_LATTICE_BESIDE) != 0 && beside) return nb_diffusion_lattice_of(l.word + NB_LATTICE_TEXELS);
    return l;
}

/* The part of a ray between two ends of the lattice. `from` counts from its low end. */
void nb_clip_axis(inout nb_vec2 span, float from, float d, float extent, bool low_goes_on, bool high_goes_on)
{
    float inverse = nb_rcp_bounded(d);
    bool up = d > 0.0;
    bool still = d == 0.0;
    bool beyond = (from < 0.0 && !low_goes_on) || (from > extent && !high_goes_on);
    if (still && beyond) span.y = 0.0;
    if (!still && !(up ? low_goes_on : high_goes_on)) span.x = max(span.x, (up ? -from : extent - from) * inverse);
    if (!still && !(up ? high_goes_on : low_goes_on)) span.y = min(span.y, (up ? extent - from : -from) * inverse);
}

nb_vec2 nb_clip_to_lattice(nb_diffusion_lattice l, nb_ray ray)
{
    nb_vec2 span = nb_vec2(0.0, ray.t_max);
    nb_vec3 from = ray.origin - l.low;
    nb_vec3 extent = l.spacing * l.cells;
    nb_clip_axis(span, from.x, ray.direction.x, extent.x, nb_goes_on(l, 0, 0), nb_goes_on(l, 0, 1));
    nb_clip_axis(span, from.y, ray.direction.y, extent.y, nb_goes_on(l, 1, 0), nb_goes_on(l, 1, 1));
    nb_clip_axis(span, from.z, ray.direction.z, extent.z, nb_goes_on(l, 2, 0), nb_goes_on(l, 2, 1));
    return span;
}

/* How far along a ray to the next cell, about; a place outside goes to the end first. */
float nb_step_along(float at, float d, float spacing, float cells)
{
    float inverse = abs(nb_rcp_bounded(d));
    float extent = spacing * cells;
    float before = d > 0.0 ? -at : at - extent;
    float behind = d > 0.0 ? at - extent : -at;
    float step = NB_FAR;
    if (cells > 1.0 && d != 0.0) {
        if (before > 1e-5 * spacing)
            step = before * inverse;
        else if (behind < -1e-5 * spacing)
            step = spacing * inverse;
    }
    return step;
}

float nb_diffusion_lattice_step(nb_diffusion_lattice l, nb_ray ray, float t)
{
    nb_vec3 at = ray.origin + ray.direction * t - l.low;
    float step = nb_step_along(at.x, ray.direction.x, l.spacing.x, l.cells.x);
    step = min(step, nb_step_along(at.y, ray.direction.y, l.spacing.y, l.cells.y));
    return min(step, nb_step_along(at.z, ray.direction.z, l.spacing.z, l.cells.z));
}

/* ---- source radiance ------------------------------------------------------------------------- */

float nb_diffusion_lattice_lobe(float g, nb_turn turn)
{
    float rest = 1.0 - abs(g);
    return nb_phase_lobe(rest * (1.0 + abs(g)) * 0.079577471545947667884, 0.0, rest * rest, 2.0 * g, turn);
}

/* See diffuse_source in diffusion_gather.c. `numbers`: mean over directions, and flux. */
float nb_diffuse_source(nb_vec4 numbers, float most, nb_vec3 direction)
{
    float size = length(numbers.yzw);
    float mean = max(numbers.x, 0.0);
    if (!(mean > 0.0) || !(size > 0.0)) return mean;
    nb_turn turn = nb_turn_between(numbers.yzw * (1.0 / size), -direction);
    return 12.566370614359172954 * mean * nb_diffusion_lattice_lobe(min(size / mean, most), turn);
}

/* How much more of what is diffuse there is than nodes say, in light of this direction. */
nb_vec3 nb_diffusion_lattice_gain(nb_diffusion_lattice l, nb_vec3 d)
{
    int word = l.word + 3;
    return d.x * d.x * NEBEL_FOG_TEXEL(word + (d.x < 0.0 ? 1 : 0)).xyz + d.y * d.y * NEBEL_FOG_TEXEL(word + (d.y < 0.0 ? 3 : 2)).xyz +
           d.z * d.z * NEBEL_FOG_TEXEL(word + (d.z < 0.0 ? 5 : 4)).xyz;
}

/* Of opaque fog after scaling, and what of it exact light of one scattering has already, of fog as it is; what ambient light lacks
 * and what of it is absorbed, likewise. */
struct nb_node_light {
    nb_vec3 source, once, dimmed, absorbed;
};

nb_node_light nb_no_node_light()
{
    nb_node_light light;
    light.source = nb_splat3(0.0);
    light.once = nb_splat3(0.0);
    light.dimmed = nb_splat3(0.0);
    light.absorbed = nb_splat3(0.0);
    return light;
}

/* Eight nodes around a place, which is taken to the nearest one of the lattice. */
struct nb_nodes {
    int texel, right, up, deep; /* the lowest, and how much farther the next ones along the axes are */
    nb_vec3 share;
};

nb_nodes nb_nodes_around(nb_diffusion_lattice l, nb_vec3 place)
{
    nb_vec3 at = clamp((place - l.low) / l.spacing, nb_splat3(0.0), l.cells);
    nb_vec3 base = min(floor(at), l.cells - nb_splat3(1.0));
    nb_nodes n;
    n.right = (nb_is_own(l) ? 5 : nb_dims_sky(l) ? 4 : 2) * l.channels + 1;
    n.up = n.right * (int(l.cells.x) + 1);
    n.deep = n.up * (int(l.cells.y) + 1);
    n.texel = l.texel + int(base.x) * n.right + int(base.y) * n.up + int(base.z) * n.deep;
    n.share = at - base;
    return n;
}

nb_vec4 nb_mix_row(nb_nodes n, int texel)
{
    return NEBEL_DIFFUSION_TEXEL(texel) * (1.0 - n.share.x) + NEBEL_DIFFUSION_TEXEL(texel + n.right) * n.share.x;
}

/* The texel with this number in each node. */
nb_vec4 nb_mix_nodes(nb_nodes n, int number)
{
    int texel = n.texel + number;
    nb_vec4 near = nb_mix_row(n, texel) * (1.0 - n.share.y) + nb_mix_row(n, texel + n.up) * n.share.y;
    texel += n.deep;
    nb_vec4 far = nb_mix_row(n, texel) * (1.0 - n.share.y) + nb_mix_row(n, texel + n.up) * n.share.y;
    return near * (1.0 - n.share.z) + far * n.share.z;
}

nb_node_light nb_lookup_nodes(nb_diffusion_lattice l, nb_ray ray, float t, nb_turn to_sun)
{
    nb_nodes n = nb_nodes_around(l, ray.origin + ray.direction * t);
    float g = nb_mix_nodes(n, 2 * l.channels).x;
    float turned = nb_diffusion_lattice_lobe(g, to_sun);
    nb_vec3 gain = nb_diffusion_lattice_gain(l, ray.direction);
    nb_node_light light = nb_no_node_light();
    for (int c = 0; c < l.channels; c++) {
        nb_vec3 own = nb_vec3(c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0);
        if (l.channels == 1) own = nb_splat3(1.0);
        float diffuse = nb_diffuse_source(nb_mix_nodes(n, 2 * c), max(g, 0.0), ray.direction);
        if (nb_is_own(l)) {
            int straight = 2 * l.channels + 1 + 3 * c;
            light.source += own * (gain * diffuse + nb_splat3(nb_diffuse_source(nb_mix_nodes(n, straight), max(g, 0.0), ray.direction)));
            light.once += own * (nb_diffuse_source(nb_mix_nodes(n, straight + 2), NB_MAX_GLOW, ray.direction) -
                                 nb_diffuse_source(nb_mix_nodes(n, straight + 1), max(g, 0.0), ray.direction));
            continue;
        }
        nb_vec4 sun = nb_mix_nodes(n, 2 * c + 1);
        light.source += own * (gain * diffuse + nb_splat3(turned * nb_exp(sun.x)));
        light.once += own * (sun.z * nb_diffusion_lattice_lobe(sun.w, to_sun) - turned * nb_exp(sun.y));
        if (!nb_dims_sky(l)) continue;
        nb_vec4 along = nb_vec4(1.0, -ray.direction.x, -ray.direction.y, -ray.direction.z); /* light comes along the ray */
        int sky = 2 * (l.channels + c) + 1;
        light.dimmed += own * dot(nb_mix_nodes(n, sky), along);
        light.absorbed += own * dot(nb_mix_nodes(n, sky + 1), along);
    }
    return light;
}

/* ---- along the ray --------------------------------------------------------------------------- */

/* Light of a piece in front of its own fog: its source is linear between the ends, the fog even. */
nb_vec3 nb_light_between(nb_vec3 first, nb_vec3 last, nb_vec3 depth)
{
    nb_attenuation through = nb_attenuate(depth);
    nb_vec3 x = min(depth, nb_splat3(1.0));
    nb_vec3 thin = x * (nb_splat3(0.5) - x * (nb_splat3(1.0 / 3.0) - x * 0.125));
    nb_vec3 of_last = through.mean - through.left;
    of_last = nb_vec3(depth.x > 0.01 ? of_last.x : thin.x, depth.y > 0.01 ? of_last.y : thin.y, depth.z > 0.01 ? of_last.z : thin.z);
    return first * (through.mean * depth - of_last) + last * of_last;
}

/* About how many turns of loops a piece takes, besides those of its media. */
#define NB_TURNS_OF_PIECE 8

/* A piece is in one lattice; where it is another one than that of the piece before, and at first, an empty piece looks at it. */
nb_vec3 nb_gather_in_lattice(nb_diffusion_lattice l, nb_ray ray, nb_media media, inout int turns)
{
    nb_turn to_sun = nb_turn_between(ray.direction, nb_to_sun());
    nb_vec2 span = nb_clip_to_lattice(l, ray);
    nb_vec3 light = nb_splat3(0.0);
    nb_vec3 dimmed = nb_splat3(0.0); /* of ambient light, per unit of its mean radiance */
    nb_two_depths before = nb_depths_between(ray, media, 0.0, span.x < span.y ? span.x : 0.0, turns); /* up to the lattice */
    float t = span.x;
    float smaller = 1.0;
    int halvings = 0;
    int word = 0;
    nb_node_light here = nb_no_node_light();
    while (t < span.y && nb_smallest(before.scaled) < NB_DARK_DEPTH && !nb_is_tired(turns)) {
        float step = max(smaller * min(nb_diffusion_lattice_step(l, ray, t), span.y - t), t * (2.0 * NB_EPSILON));
        nb_diffusion_lattice within = nb_diffusion_lattice_at(l, ray.origin + ray.direction * (t + 0.5 * step));
        float end = within.word == word ? min(t + step, span.y) : t;
        word = within.word;
        nb_two_depths depth = nb_depths_between(ray, media, t, end, turns);
        float left = nb_smallest(nb_exp3(-depth.scaled));
        turns += NB_TURNS_OF_PIECE;
        if (left < NB_THICK_PIECE && halvings < NB_MAX_HALVINGS) {
            halvings++;
            smaller *= 0.5;
            continue;
        }
        nb_node_light there = nb_lookup_nodes(within, ray, end, to_sun);
        light += nb_exp3(-before.scaled) * nb_light_between(here.source, there.source, depth.scaled) +
                 nb_exp3(-before.whole) * nb_light_between(here.once, there.once, depth.whole);
        dimmed += nb_exp3(-before.scaled) * nb_light_between(here.dimmed, there.dimmed, depth.scaled) -
                  nb_exp3(-before.whole) * nb_light_between(here.absorbed, there.absorbed, depth.whole);
        before.scaled += depth.scaled;
        before.whole += depth.whole;
        if (left > NB_THIN_PIECE && halvings > 0) {
            halvings--;
            smaller *= 2.0;
        }
        here = there;
        t = end;
    }
    nb_vec3 unit = NEBEL_FOG_TEXEL(l.word + 9).xyz;
    if (nb_is_own(l)) return max(light, nb_splat3(0.0)) * unit;
    return max(light, nb_splat3(0.0)) * NEBEL_FOG_TEXEL(NB_HEADER_SUN + 1).xyz - dimmed * unit;
}

/* Of the sun and the sky, and own light. */
nb_vec3 nb_gather_diffuse(nb_ray ray, nb_media media)
{
    nb_vec3 light = nb_splat3(0.0);
    int turns = 0;
    for (int i = 0; i < 2; i++) {
        float word = i == 0 ? NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).x : NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).y;
        if (word > 0.0) light += nb_gather_in_lattice(nb_diffusion_lattice_of(int(word)), ray, media, turns);
    }
    return light;
}

#else

nb_vec3 nb_gather_diffuse(nb_ray ray, nb_media media) { return nb_splat3(0.0); }

#endif
