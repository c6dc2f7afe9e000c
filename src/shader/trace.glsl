/* The march along a ray, and the face of the text. */

/* The first leg of a piece: all of it. */
nb_leg nb_first_leg(nb_piece piece, bool lit)
{
    bool uneven = piece.emits || nb_largest(piece.most - piece.least) > 0.0;
    return nb_open_leg(0.0, piece.end - piece.start, lit && uneven && piece.present > 1, 0);
}

void nb_pass_piece(inout nb_gathered g, nb_piece piece, bool lit)
{
    float length = piece.end - piece.start;
    nb_vec3 depth = piece.extinction * length;
    if (lit) g.radiance += nb_light_even(piece.light * length, depth, g.depth);
    g.light += piece.light * length;
    g.depth += depth;
}

/* What is left of a ray that is too much to walk, where no medium covers another: in steps up to each of which all media are summed in
 * closed form. Within a step they count as if they were mixed evenly, and as sunny as what lies before it; so transmittance is right, and
 * light is off by the square of a step's depth, nb_even_error. */
struct nb_rest {
    float end, step; /* of the step to come [m] */
    float share; /* optical depth that a step should take */
};

/* Behind so much depth light hardly counts. */
#define NB_REST_DEPTH 8.0

nb_rest nb_open_rest(nb_gathered g, nb_media_sum all, float t_max, int steps)
{
    nb_rest rest;
    rest.share = min(nb_largest(all.depth - g.depth), NB_REST_DEPTH) / float(steps);
    rest.step = ((all.last > g.reached ? all.last : t_max) - g.reached) / float(steps);
    rest.end = min(g.reached + rest.step, t_max);
    return rest;
}

/* `sum`: of all up to the end of the step. */
nb_gathered nb_pass_even(nb_gathered g, nb_media_sum sum)
{
    nb_vec3 depth = max(sum.depth - g.depth, nb_splat3(0.0));
    nb_vec3 light = max(sum.light - g.light, nb_splat3(0.0));
    g.radiance += nb_light_even(light, depth, g.depth);
    if (NB_HAS(NB_HAS_SUN)) {
        nb_vec3 taken = nb_attenuate(g.depth).mean * g.depth;
        nb_vec3 sunlight = g.sunlight * nb_exp3(-g.depth) * nb_attenuate(depth).mean * depth / max(taken, nb_splat3(1e-6));
        g.radiance += sunlight;
        g.sunlight += sunlight;
    }
    g.depth += depth;
    g.light += light;
    return g;
}

/* Passes a step, or makes it shorter. */
nb_rest nb_step_rest(inout nb_gathered g, nb_rest rest, nb_media_sum sum, float t_max)
{
    float depth = nb_largest(sum.depth - g.depth);
    if (depth <= 2.0 * rest.share) {
        g = nb_pass_even(g, sum);
        g.reached = rest.end;
    }
    rest.step *= clamp(rest.share / max(depth, NB_TINY), 0.1, 4.0);
    rest.end = min(g.reached + rest.step, t_max);
    return rest;
}

/* `all`: the sum of the whole ray. */
nb_gathered nb_pass_rest(nb_gathered g, nb_media_sum all, nb_ray ray, int first, int count, bool listed)
{
    int steps = nb_rest_steps(count);
    nb_ray part = ray;
    nb_rest rest = nb_open_rest(g, all, ray.t_max, steps);
    for (int i = 0; i < steps; i++) {
        if (g.reached >= ray.t_max || nb_smallest(g.depth) >= NB_OPAQUE) break;
        part.t_max = rest.end;
        rest = nb_step_rest(g, rest, nb_sum_media(part, first, count, listed), ray.t_max);
    }
    return nb_pass_even(g, all);
}

/* Each turn of the outer loop looks once at all media on the ray: to find the end of the next piece, or to sum a leg within one of
 * varying density. So the shapes and profiles stand in the program once, not once for each purpose. Goes on
 * from what `g` has reached. */
void nb_walk(inout nb_gathered g, nb_ray ray, int first, int count, bool listed, bool lit, inout int turns)
{
    float tolerance = NEBEL_FOG_TEXEL(0).y;
    float t = g.reached;
    bool overflow = false;
    bool stepping = false;
    nb_vec2 sunlit = nb_vec2(1.0, 0.0);
    nb_piece piece = nb_open_piece(0.0, 0.0);
    nb_leg leg = nb_open_leg(0.0, 0.0, false, 0);
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = 0.0;
    window.turns = 0;
    if (NB_RESUMES) nb_keep_gathered(count, g);
    while (t < ray.t_max && nb_smallest(g.depth) < NB_OPAQUE && !nb_is_tired(turns)) {
        bool on_leg = NB_HAS(NB_HAS_PROFILE | NB_HAS_SUN) && stepping;
        if (NB_HAS(NB_HAS_SUN) && on_leg && lit && piece.sunlit) {
            nb_plan_leg(leg, piece, ray, sunlit, turns);
            leg.h = min(leg.h, min(leg.stop - leg.from, leg.most));
        }
        bool stale = overflow || t >= window.end;
        if (!on_leg) piece = nb_open_piece(t, ray.t_max);
        for (int next = 0; next < count;) {
            if (stale) {
                window = nb_fill_slots(ray, first, count, listed, next, t, overflow);
                turns += window.turns;
                if (nb_is_tired(turns)) break;
            }
            turns += 1 + window.used * (on_leg ? 1 + NB_NODES : 2);
            bool over_full = !overflow && window.end <= t;
            overflow = overflow || over_full;
            if (over_full) continue;
            next = window.rest;
            piece.end = min(piece.end, window.end);
            if (NB_HAS(NB_HAS_OVERRIDE) && !on_leg) piece = nb_cover_piece(piece, window.used);
            for (int k = 0; k < window.used; k++) {
                if (!on_leg)
                    piece = nb_note_slot(piece, k, ray, lit && !overflow && nb_is_day());
                else if (nb_is_there(nb_fog_slot(k), piece))
                    nb_add_slot(leg, piece, k, ray);
            }
        }
        if (nb_is_tired(turns)) break;
        bool foggy = piece.present > 0;
        bool legged = (NB_HAS(NB_HAS_PROFILE) && piece.varies) || (NB_HAS(NB_HAS_SUN) && lit && piece.sunlit);
        bool celled = NB_HAS(NB_HAS_GRID) && NB_HAS(NB_HAS_SUN) && !on_leg && piece.voxels > 0;
        bool begins = foggy && !on_leg && legged && !celled;
        bool over = !begins;
        if (NB_HAS(NB_HAS_SUN) && on_leg && nb_is_sunlit(leg)) turns += nb_turns_to_sun();
        nb_grid_turns = 0; /* of walks to the sun */
        if (on_leg)
            over = nb_end_leg(g, leg, piece, ray, tolerance, lit) <= (piece.end - piece.start) * (4.0 * NB_EPSILON);
        else if (begins)
            leg = nb_first_leg(piece, lit);
#if NB_DECLARES(NB_HAS_GRID) && NB_DECLARES(NB_HAS_SUN)
        else if (celled)
            turns = nb_walk_voxels(g, piece, ray, window.used, tolerance, sunlit, turns);
#endif
        else if (foggy)
            nb_pass_piece(g, piece, lit);
        if (on_leg) turns += nb_grid_turns;
        stepping = !over;
        if (over) {
            t = piece.end;
            if (overflow) window.end = t;
            overflow = false;
        }
        g.reached = t + (stepping ? leg.from : 0.0);
        if (!nb_has_loops(count)) break;
        if (NB_RESUMES) nb_keep_gathered(count, g);
    }
    if (NB_RESUMES) g = nb_kept_gathered(count);
    /* by itself, or because the driver has ended its loops */
    if (NB_MAY_TIRE) g.is_cut = nb_is_tired(turns) || (g.reached < ray.t_max && nb_smallest(g.depth) < NB_OPAQUE);
}

/* What is known of a ray, pass after pass. */
struct nb_progress {
    int stage;
    nb_gathered walked;
    nb_light_state lights;
    int turns; /* of loops, in this shader */
};

#define NB_STAGE_WALK 0
#define NB_STAGE_LIGHTS 1
#define NB_STAGE_DIFFUSION 2
#define NB_STAGE_DONE 3

nb_progress nb_open_progress()
{
    nb_progress p;
    p.stage = NB_STAGE_WALK;
    p.walked = nb_open_gathered();
    p.lights = nb_start_lights();
    p.turns = 0;
    return p;
}

#ifdef NEBEL_RESUMABLE
/* A stage that may take many turns begins where most are left. */
bool nb_is_fresh(int turns) { return turns < NEBEL_MAX_ITERATIONS / 4; }
#else
bool nb_is_fresh(int turns) { return true; }
#endif

/* ---- the face -------------------------------------------------------------------------------- */

/* See nebel_set_max_opacity. */
nebel_transfer nb_limit_opacity(nebel_transfer transfer, float most)
{
    nb_vec3 opacity = nb_splat3(1.0) - transfer.transmittance;
    transfer.in_scattering *= nb_vec3(most / max(opacity.x, most), most / max(opacity.y, most), most / max(opacity.z, most));
    transfer.transmittance = max(transfer.transmittance, nb_splat3(1.0 - most));
    return transfer;
}

/* Goes on with a ray. `last`: what is left of it counts as even. */
nebel_transfer nb_trace_further(inout nb_progress p, nb_ray ray, nb_media media, bool lit, bool last)
{
    int first = media.first;
    int count = media.count;
    bool listed = media.listed;
    int before = p.turns;
    int turns = before + count; /* of the sums */
    nb_media_sum sum = nb_sum_media(ray, first, count, listed);
    nb_attenuation attenuation = nb_attenuate(sum.depth);
    nebel_transfer transfer;
    transfer.transmittance = attenuation.left;
    transfer.in_scattering = sum.light * attenuation.mean;
    bool covers = NB_HAS(NB_HAS_OVERRIDE) && sum.met && sum.covers;
    bool mixed = (NB_HAS(NB_HAS_MIXED) && sum.mixed) || (NB_HAS(NB_HAS_SUN) && sum.scatters);
    bool walks = lit && (covers || mixed);
#if NB_DECLARES(NB_HAS_OVERRIDE)
    if (covers && (!lit || (NB_MAY_TIRE && last))) {
        nb_vec3 depth = nb_depth_of(ray, media, turns);
        sum.light *= depth / max(sum.depth, nb_splat3(NB_TINY)); /* what is not walked is as bright as all together */
        sum.depth = depth;
        transfer.transmittance = nb_exp3(-depth);
    }
#endif
#if NB_DECLARES(NB_HAS_OVERRIDE | NB_HAS_MIXED | NB_HAS_SUN)
    if (walks && p.stage == NB_STAGE_WALK && !(NB_RESUMES && last)) nb_walk(p.walked, ray, first, count, listed, lit, turns);
    if (walks && p.stage == NB_STAGE_WALK && NB_MAY_TIRE && last && (NB_RESUMES || p.walked.is_cut)) {
        /* WebGL 2 knows no conditional operator between structures */
        if (covers)
            p.walked = nb_pass_even(p.walked, sum);
        else
            p.walked = nb_pass_rest(p.walked, sum, ray, first, count, listed);
        p.walked.is_cut = false;
    }
#endif
    if (walks) transfer.in_scattering = p.walked.radiance;
    if (walks && covers) transfer.transmittance = nb_exp3(-p.walked.depth);
    if (p.stage == NB_STAGE_WALK && !(NB_MAY_TIRE && p.walked.is_cut)) p.stage = NB_STAGE_LIGHTS;
    if (NB_HAS(NB_HAS_LIGHTS) && lit && sum.scatters) {
        int light_iterations = NB_RESUMES ? turns : before;
        if (p.stage == NB_STAGE_LIGHTS && nb_is_fresh(turns) && nb_has_loops(count)) nb_surface_lights(p.lights, ray, first, count, listed, light_iterations);
        turns = NB_RESUMES ? light_iterations : turns + light_iterations - before;
        transfer.in_scattering += p.lights.light;
        bool is_lit = !(p.lights.reached < ray.t_max && nb_smallest(p.lights.before) < NB_OPAQUE);
        if (p.stage == NB_STAGE_LIGHTS && (last || is_lit)) p.stage = NB_STAGE_DIFFUSION;
    } else if (p.stage == NB_STAGE_LIGHTS) {
        p.stage = NB_STAGE_DIFFUSION;
    }
    if (p.stage == NB_STAGE_DIFFUSION && (last || nb_is_fresh(turns))) {
        if (NB_HAS(NB_HAS_DIFFUSION) && lit && sum.met && NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).x + NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).y > 0.0)
            transfer.in_scattering = max(transfer.in_scattering + nb_gather_diffuse(ray, media), nb_splat3(0.0));
        if (last || nb_has_loops(count)) p.stage = NB_STAGE_DONE;
    }
    p.turns = turns;
    if (NB_HAS(NB_HAS_MAX_OPACITY)) transfer = nb_limit_opacity(transfer, NEBEL_FOG_TEXEL(0).z);
    transfer.in_scattering = min(transfer.in_scattering, nb_splat3(NEBEL_MAX_RADIANCE));
    return transfer;
}

nb_ray nb_ray_up_to(nb_vec3 origin, nb_vec3 direction, float t_max, bool from_eye)
{
    nb_ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.t_max = min(t_max, NB_FAR);
    ray.from_eye = from_eye;
    return ray;
}

nb_media nb_media_of(int first, int count, bool listed)
{
    nb_media media;
    media.first = first;
    media.count = count;
    media.listed = listed;
    media.to_sun = false;
    media.is_way = false;
    media.spot = nb_spot_on(nb_ray_up_to(nb_splat3(0.0), nb_splat3(0.0), 0.0, false), 0.0, 0.0);
    return media;
}

bool nb_is_ray(nb_vec3 origin, nb_vec3 direction, float t_max)
{
    float square = dot(direction, direction);
    return t_max > 0.0 && square > 0.0 && nb_is_number(dot(origin, origin) + square + t_max);
}

nebel_transfer nb_clear()
{
    nebel_transfer transfer;
    transfer.transmittance = nb_splat3(1.0);
    transfer.in_scattering = nb_splat3(0.0);
    return transfer;
}

#ifndef NEBEL_RESUMABLE
/* `lit`: in-scattering is asked for, too. `from_eye`: distances along the ray count. */
nebel_transfer nb_trace_media(nb_vec3 origin, nb_vec3 direction, float t_max, int first, int count, bool listed, bool lit,
                           bool from_eye)
{
    nebel_transfer transfer = nb_clear();
    if (nb_is_ray(origin, direction, t_max)) {
        nb_progress progress = nb_open_progress();
        nb_ray ray = nb_ray_up_to(origin, direction, t_max, from_eye);
        transfer = nb_trace_further(progress, ray, nb_media_of(first, count, listed), lit, true);
    }
    return transfer;
}
#endif

#ifdef NEBEL_RESUMABLE
/* How far a ray has come, in words from pass to pass; all 0 at first. First of them: light or what there is of it, and up to where;
 * second: transmittance or depth, and the stage. */
#define NB_PROGRESS_WORDS 4
struct nb_progress_words {
    nb_vec4 word[NB_PROGRESS_WORDS];
};

bool nb_is_done(nb_progress_words words) { return int(words.word[1].w) == NB_STAGE_DONE; }

/* The walk's light and depth go on with the ray; the rest of a stage's words is its own. */
nb_progress nb_read_progress(nb_progress_words words)
{
    nb_progress p = nb_open_progress();
    p.stage = int(words.word[1].w);
    p.walked.depth = words.word[1].xyz;
    if (p.stage == NB_STAGE_WALK) {
        p.walked.radiance = words.word[0].xyz;
        p.walked.reached = words.word[0].w;
        p.walked.light = words.word[2].xyz;
        p.walked.sunlight = words.word[3].xyz;
    } else {
        p.walked.radiance = words.word[3].xyz;
        p.lights.light = words.word[0].xyz;
        p.lights.reached = words.word[0].w;
        p.lights.before = words.word[2].xyz;
        p.lights.most = words.word[2].w;
    }
    return p;
}

nb_progress_words nb_write_progress(nb_progress p, nebel_transfer transfer)
{
    nb_progress_words words;
    if (p.stage == NB_STAGE_DONE) {
        words.word[0] = nb_vec4(transfer.in_scattering, 0.0);
        words.word[1] = nb_vec4(transfer.transmittance, float(p.stage));
        words.word[2] = nb_vec4(0.0, 0.0, 0.0, 0.0);
        words.word[3] = words.word[2];
    } else if (p.stage == NB_STAGE_WALK) {
        words.word[0] = nb_vec4(p.walked.radiance, p.walked.reached);
        words.word[1] = nb_vec4(p.walked.depth, float(p.stage));
        words.word[2] = nb_vec4(p.walked.light, 0.0);
        words.word[3] = nb_vec4(p.walked.sunlight, 0.0);
    } else {
        words.word[0] = nb_vec4(p.lights.light, p.lights.reached);
        words.word[1] = nb_vec4(p.walked.depth, float(p.stage));
        words.word[2] = nb_vec4(p.lights.before, p.lights.most);
        words.word[3] = nb_vec4(p.walked.radiance, 0.0);
    }
    return words;
}

nb_progress_words nb_resume(nb_progress_words words, nb_vec3 origin, nb_vec3 direction, float t_max, nb_media media, bool last)
{
    nebel_transfer transfer = nb_clear();
    nb_progress progress = nb_read_progress(words);
    if (nb_is_ray(origin, direction, t_max))
        transfer = nb_trace_further(progress, nb_ray_up_to(origin, direction, t_max, true), media, true, last);
    else
        progress.stage = NB_STAGE_DONE;
    return nb_write_progress(progress, transfer);
}
#endif

/* No functions: of each that a program does not call it would hold another copy of the whole walk until its compiler finds that out. */
#define nb_trace_all(origin, direction, t_max, lit, from_eye) nb_trace_media(origin, direction, t_max, 0, int(NEBEL_FOG_TEXEL(0).x), false, lit, from_eye)
#define nebel_trace(origin, direction, t_max) nb_trace_all(origin, direction, t_max, true, true)
#define nebel_transmit(origin, direction, t_max) nb_trace_all(origin, direction, t_max, false, true).transmittance
#define nebel_transmit_shadow(origin, direction, t_max) nb_trace_all(origin, direction, t_max, false, false).transmittance
#ifdef NEBEL_TILE_ENTRY
#define nebel_trace_list(origin, direction, t_max, first, count) nb_trace_media(origin, direction, t_max, first, count, true, true, true)
#define nebel_transmit_list(origin, direction, t_max, first, count) nb_trace_media(origin, direction, t_max, first, count, true, false, true).transmittance
#define nebel_transmit_shadow_list(origin, direction, t_max, first, count) nb_trace_media(origin, direction, t_max, first, count, true, false, false).transmittance
#endif
