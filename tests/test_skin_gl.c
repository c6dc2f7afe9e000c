/* Bodies so dense that only a skin of them is lit, in shaders against nebel_trace in double: of any shape and size, lit by the sun and by
 * point lights, seen from outside and from within. */
#include "shader_help.h"

enum { EACH = 32 };

typedef enum eye_place { OUTSIDE, WITHIN, EYE_PLACES } eye_place;

static const char *const eye_names[EYE_PLACES] = {"from outside", "from within"};
static const char *const light_names[2] = {"sun", "point lights"};

static const nebel_shape_type types[] = {NEBEL_SHAPE_SPHERE,     NEBEL_SHAPE_ELLIPSOID, NEBEL_SHAPE_BOX,
                                         NEBEL_SHAPE_HALF_SPACE, NEBEL_SHAPE_CONVEX,    NEBEL_SHAPE_CYLINDER,
                                         NEBEL_SHAPE_CONE,       NEBEL_SHAPE_CAPSULE};
enum { TYPES = sizeof types / sizeof *types };
static const char *const type_names[TYPES] = {"ball",     "ellipsoid", "box",  "half space",
                                              "polytope", "cylinder",  "cone", "capsule"};

/* A body's radius is that of a ball around it. A skin's depth is extinction times radius. */
typedef struct skin {
    double radius, depth, center[3], eye[3];
    int by_lights, kind, is_turned;
    eye_place place;
} skin;

static void turn_any(uint64_t *state, double size, double v[3])
{
    double length = 0;
    for (int k = 0; k < 3; k++) v[k] = dice(state, -1, 1), length += v[k] * v[k];
    for (int k = 0; k < 3; k++) v[k] *= size / sqrt(length);
}

static skin draw_skin(uint64_t seed, int by_lights, int kind, eye_place place)
{
    uint64_t state = seed;
    skin s = {.by_lights = by_lights, .place = place, .kind = kind, .is_turned = seed % 3 == 0};
    s.radius = pow(10, dice(&state, -3, 4));
    s.depth = fmin(pow(10, dice(&state, 3, 8)), .99 * NEBEL_MAX_AMOUNT * s.radius);
    turn_any(&state, s.radius * dice(&state, 0, 50), s.center);
    const double within = dice(&state, 0, kind < 2 ? .9 : .1), away = 1 + pow(10, dice(&state, -1, 2));
    turn_any(&state, s.radius * (place == WITHIN ? within : away), s.eye);
    for (int k = 0; k < 3; k++) s.eye[k] += s.center[k];
    return s;
}

static void set_axis(const skin *s, uint64_t *state, double half, nebel_shape *shape)
{
    double axis[3];
    turn_any(state, half * s->radius, axis);
    for (int k = 0; k < 3; k++) shape->from[k] = s->center[k] - axis[k], shape->to[k] = s->center[k] + axis[k];
}

/* Faces of a cube, each leaning; the eye is before the face of a half space, or behind it. */
static void set_faces(const skin *s, uint64_t *state, nebel_shape *shape)
{
    static nebel_plane planes[6];
    double lean[3];
    turn_any(state, s->radius, lean);
    for (int k = 0; k < 3; k++) {
        const double towards = s->place == WITHIN ? s->radius : s->eye[k] - s->center[k];
        shape->normal[k] = towards + lean[k];
        shape->point[k] = s->center[k] + (s->place == WITHIN ? .2 * shape->normal[k] : 0);
    }
    for (int i = 0; i < 6; i++) {
        nebel_plane *face = &planes[i];
        double length = 0;
        for (int k = 0; k < 3; k++) face->normal[k] = (k == i / 2 ? i % 2 ? 1 : -1 : 0) + dice(state, -.3, .3);
        for (int k = 0; k < 3; k++) length += face->normal[k] * face->normal[k];
        face->distance = sqrt(length) * s->radius * dice(state, .2, .5);
        for (int k = 0; k < 3; k++) face->distance += face->normal[k] * s->center[k];
    }
    shape->planes = planes;
    shape->plane_count = 6;
}

static nebel_shape shape_of(const skin *s, uint64_t *state)
{
    const double r = s->radius;
    nebel_shape shape = {.type = types[s->kind], .radius = r};
    for (int k = 0; k < 3; k++) {
        const double half = r * dice(state, .2, .57);
        shape.center[k] = s->center[k];
        shape.radii[k] = r * (k == 1 ? .5 : 1);
        shape.min[k] = -half;
        shape.max[k] = half;
        if (shape.type != NEBEL_SHAPE_BOX) continue;
        shape.transform.position[k] = s->center[k];
        if (s->is_turned) shape.transform.rotation[k] = dice(state, -1, 1);
    }
    if (shape.type == NEBEL_SHAPE_HALF_SPACE || shape.type == NEBEL_SHAPE_CONVEX) set_faces(s, state, &shape);
    if (s->kind < 5) return shape;
    set_axis(s, state, dice(state, .2, .6), &shape);
    shape.radius = r * dice(state, .2, .4);
    shape.radius_from = r * dice(state, .2, .6);
    shape.radius_to = dice(state, 0, 1) < .5 ? 0 : r * dice(state, 0, .6);
    return shape;
}

/* Point lights shine on the surface about as brightly as the sun; for an eye within one is near it. */
static void place_lights(const skin *s, uint64_t *state, nebel_light lights[2])
{
    lights[0] = (nebel_light){.type = NEBEL_LIGHT_POINT};
    lights[1] = (nebel_light){.type = NEBEL_LIGHT_SPOT, .inner_angle = 20, .outer_angle = 60};
    for (int i = 0; i < 2; i++) {
        double away = s->radius * dice(state, 1.3, 6);
        turn_any(state, away, lights[i].position);
        if (s->place == WITHIN && i == 0) turn_any(state, away = 2 * s->radius / s->depth, lights[i].position);
        for (int k = 0; k < 3; k++) {
            lights[i].direction[k] = -lights[i].position[k];
            lights[i].position[k] += s->place == WITHIN && i == 0 ? s->eye[k] : s->center[k];
            lights[i].intensity[k] = fmin(3 * away * away, NEBEL_MAX_AMOUNT);
        }
        lights[i].radius = fmax(1e-3, .02 * away);
    }
}

static nebel_lighting *commit_skin(const skin *s, uint64_t seed)
{
    const double extinction = s->depth / s->radius;
    uint64_t state = seed;
    nebel_volume_desc volume = {.shape = shape_of(s, &state),
                                .extinction = {extinction, .8 * extinction, .5 * extinction},
                                .albedo = {.9, .9, .8},
                                .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4}};
    nebel_sun sun = {.irradiance = {3, 3, 2}};
    nebel_light point_lights[2];
    nebel_lighting_desc lights = {.lights = point_lights};
    turn_any(&state, 1, sun.direction);
    if (s->by_lights) {
        place_lights(s, &state, point_lights);
        lights.light_count = 2;
    } else {
        lights.sun = sun;
    }
    return fog_light(&lights, &volume, 1);
}

static void distribute_rays(const skin *s, uint64_t seed)
{
    uint64_t state = seed;
    for (int i = 0; i < RAYS; i++) {
        double aim[3];
        nebel_ray ray = {.t_max = i < EACH ? HUGE_VAL : 0};
        turn_any(&state, s->radius * dice(&state, 0, .98), aim);
        for (int k = 0; k < 3; k++) {
            ray.origin[k] = s->eye[k];
            ray.direction[k] = s->place == WITHIN ? aim[k] : s->center[k] + aim[k] - s->eye[k];
        }
        set_ray(i, &ray, s->eye);
    }
}

static double worst[TYPES][2][EYE_PLACES];
static size_t tried[TYPES][2][EYE_PLACES], wrong, ill;

static void judge(const skin *s, const nebel_lighting *lighting, uint64_t seed)
{
    const nebel_trace_desc truth = {.tolerance = 1e-4};
    fog_trace(lighting, truth, EACH, rays, transfers);
    for (int i = 0; i < EACH; i++) {
        const double *is = transfers[i].in_scattering, scale = fmax(1, fmax(is[0], fmax(is[1], is[2])));
        const double off = worst_of(&answers[i], &transfers[i], scale);
        if (transfers[i].error > 1e-3 * scale) continue; /* the reference does not know either */
        if (off > 1. / 255 && off < 2 * conditioning(lighting, &truth, &rays[i], s->eye, scale)) {
            ill++;
            continue;
        }
        double *most = &worst[s->kind][s->by_lights][s->place];
        tried[s->kind][s->by_lights][s->place]++;
        *most = fmax(*most, off);
        if (off <= 1. / 255) continue;
        wrong++;
        print_message("%s, %s, %s, seed %llu, ray %d, radius %g, depth %g: off by %g: light %g for %g\n",
                      type_names[s->kind], light_names[s->by_lights], eye_names[s->place], (unsigned long long)seed, i,
                      s->radius, s->depth, off, (double)answers[i].in_scattering[0], is[0]);
    }
}

static unsigned features_of_all(int by_lights)
{
    unsigned features = 0;
    for (int kind = 0; kind < TYPES; kind++) {
        const skin like = {.by_lights = by_lights, .radius = 1, .depth = 1e3, .kind = kind, .is_turned = 1};
        nebel_lighting *lighting = commit_skin(&like, 1);
        features |= (unsigned)nebel_pack_features(lighting);
        nebel_release_lighting(lighting);
    }
    return features;
}

static void try_light(int by_lights, int seeds)
{
    char defines[128];
    tracer t;
    snprintf(defines, sizeof defines, "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n",
             features_of_all(by_lights));
    open_tracer(&t, NB_GL_330, BLOCK, defines, trace_body);
    for (int i = 0; i < seeds; i++) {
        const uint64_t seed = (uint64_t)i + 1;
        const skin s = draw_skin(seed, by_lights, i / EYE_PLACES % TYPES, (eye_place)(i % EYE_PLACES));
        nebel_lighting *lighting = commit_skin(&s, seed);
        distribute_rays(&s, seed);
        pack_and_upload(&t, lighting, s.eye);
        evaluate(&t);
        judge(&s, lighting, seed);
        nebel_release_lighting(lighting);
    }
    nb_gl_close(&t.gl);
}

static void test_lit_skins(void **unused)
{
    (void)unused;
    for (int by_lights = 0; by_lights < 2; by_lights++) try_light(by_lights, (int)nb_test_count(96));
    for (int i = 0; i < TYPES * 4; i++) {
        const int kind = i / 4, by_lights = i / 2 % 2, place = i % 2;
        print_message("%s, %s, %s: %zu rays, worst %.1e\n", type_names[kind], light_names[by_lights], eye_names[place],
                      tried[kind][by_lights][place], worst[kind][by_lights][place]);
    }
    print_message("off by more than 1/255: %zu, and %zu where the ray's own rounding matters as much\n", wrong, ill);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lit_skins)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
