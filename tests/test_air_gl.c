/* The air of planets in shaders against nebel_trace_sky_view and nebel_trace_ground: heights from below the ground to a billion
 * metres, three planets, in GLSL 3.30 and GLSL ES 3.00. */
#include "dice.h"
#include "gl_harness.h"
#include "unit.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/shader.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 512, OUTPUTS = 20 };

static float inputs[RAYS][4], outputs[RAYS][OUTPUTS];

/* What the library says of the same rays. */
typedef struct answers {
    double direction[3][RAYS];
    float t_max[RAYS], transmittance[3][RAYS], in_scattering[3][RAYS];
    float distance[RAYS], normal[3][RAYS], sun[3][RAYS], sky[3][RAYS];
} answers;

static unsigned compile(nb_gl *gl)
{
    const int es = gl->language == NB_GL_300ES;
    const char *const texts[] = {"#define NEBEL_SKY_VIEW\n",
                                 nebel_get_shader_source(es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330),
                                 NULL};
    const char *const body = "vec3 way = normalize(in0.xyz);\n"
                             "nebel_transfer air = nebel_trace_atmosphere(way, in0.w);\n"
                             "nebel_ground ground = nebel_trace_ground(way);\n"
                             "out0 = vec4(air.transmittance, ground.distance); out1 = vec4(air.in_scattering, 0.0);\n"
                             "out2 = vec4(ground.normal, 0.0); out3 = vec4(ground.sun, 0.0);\n"
                             "out4 = vec4(ground.sky, 0.0);\n";
    const unsigned program = nb_gl_compile_texts(gl, texts, body, 1, 5);
    if (program == 0) fail_msg("%s", gl->fault);
    return program;
}

static unsigned make_texture(void)
{
    unsigned name;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return name;
}

static void upload(const nebel_sky_view *view)
{
    size_t count = 0;
    assert_int_equal(nebel_pack_sky_view(view, NULL, 0, &count), NEBEL_OK);
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    nebel_texel_f32 *words = calloc(rows * NEBEL_TEXTURE_WIDTH, sizeof *words);
    assert_non_null(words);
    assert_int_equal(nebel_pack_sky_view(view, words, count - 1, &count), NEBEL_ERROR_LIMIT);
    assert_int_equal(nebel_pack_sky_view(view, words, count, &count), NEBEL_OK);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, 0, GL_RGBA, GL_FLOAT, words);
    free(words);
}

/* Half of the rays near the horizon or, from far away, over the planet and its rim. */
static void aim(const nebel_atmosphere_desc *planet, double height, int ends, uint64_t *numbers, answers *a)
{
    const double r = planet->radius + fmax(height, 0), horizon = -sqrt(fmax(0, 1 - pow(planet->radius / r, 2)));
    for (int i = 0; i < RAYS; i++) {
        const double turn = dice(numbers, -4, 4);
        double up = i % 2 ? dice(numbers, -1, 1) : horizon + .3 * pow(dice(numbers, -1, 1), 3);
        if (height > planet->thickness)
            up = -sqrt(1 - pow(fmin(.999, (planet->radius + planet->thickness) * sqrt(dice(numbers, 0, 1)) / r), 2));
        up = fmax(-1, fmin(1, up));
        const double level = sqrt((1 - up) * (1 + up)), way[3] = {level * cos(turn), up, level * sin(turn)};
        for (int c = 0; c < 3; c++) a->direction[c][i] = (double)(inputs[i][c] = (float)way[c]);
        const double far = fmax(0, height - planet->thickness) + planet->thickness * pow(10, dice(numbers, -5, 1));
        a->t_max[i] = inputs[i][3] = ends && i % 4 ? (float)far : 1e18f;
    }
}

static void ask(const nebel_sky_view *view, answers *a)
{
    const double *const direction[3] = {a->direction[0], a->direction[1], a->direction[2]};
    const nebel_transfer_planes transfers = {
        .transmittance = {a->transmittance[0], a->transmittance[1], a->transmittance[2]},
        .in_scattering = {a->in_scattering[0], a->in_scattering[1], a->in_scattering[2]}};
    const nebel_ground_planes ground = {.distance = a->distance,
                                        .normal = {a->normal[0], a->normal[1], a->normal[2]},
                                        .sun = {a->sun[0], a->sun[1], a->sun[2]},
                                        .sky = {a->sky[0], a->sky[1], a->sky[2]}};
    assert_int_equal(nebel_trace_sky_view(view, RAYS, direction, a->t_max, &transfers), NEBEL_OK);
    assert_int_equal(nebel_trace_ground(view, RAYS, direction, &ground), NEBEL_OK);
}

/* Of transmittance; of light as a part of the brightest; of the ground's light as a part of the sun's, normal and, as a part of it, distance. */
typedef struct differences {
    double clear, light, ground, normal, distance;
    int strays; /* rays of which only one meets the ground */
} differences;

static double largest(const float plane[3][RAYS])
{
    double most = 0;
    for (int i = 0; i < 3 * RAYS; i++) most = fmax(most, (double)plane[i / RAYS][i % RAYS]);
    return most;
}

/* No number is farther off than any. */
static double worse(double most, double a, double b)
{
    const double apart = fabs(a - b);
    return apart <= most ? most : isnan(apart) ? HUGE_VAL : apart;
}

static void compare_ground(const answers *a, int i, differences *d)
{
    const float *got = outputs[i];
    d->distance = worse(d->distance, 1, (double)got[3] / fmax(1e-3, (double)a->distance[i]));
    for (int c = 0; c < 3; c++) {
        d->normal = worse(d->normal, (double)got[8 + c], (double)a->normal[c][i]);
        d->ground = worse(d->ground, (double)got[12 + c], (double)a->sun[c][i]);
        d->ground = worse(d->ground, (double)got[16 + c], (double)a->sky[c][i]);
    }
}

static differences compare(const answers *a)
{
    differences d = {0};
    const double most = largest(a->in_scattering);
    for (int i = 0; i < RAYS; i++) {
        const int falls = a->distance[i] < HUGE_VALF, drawn = outputs[i][3] < 1e17f;
        d.strays += falls != drawn;
        if (falls != drawn) continue;
        for (int c = 0; c < 3; c++) {
            d.clear = worse(d.clear, (double)outputs[i][c], (double)a->transmittance[c][i]);
            d.light = worse(d.light, (double)outputs[i][4 + c] / most, (double)a->in_scattering[c][i] / most);
        }
        if (falls && a->distance[i] > 0) compare_ground(a, i, &d);
    }
    return d;
}

static void check_place(nb_gl *gl, unsigned program, const nebel_atmosphere *air, const nebel_atmosphere_desc *planet,
                        double height, double elevation, const char *name)
{
    static answers a;
    uint64_t numbers = 7;
    const double angle = elevation * acos(-1) / 180;
    const int ends = elevation > 0;
    const nebel_sky_view_desc desc = {
        .atmosphere = air,
        .sun = {.direction = {.6 * cos(angle), sin(angle), -.8 * cos(angle)}, .irradiance = {1, .9, .8}},
        .position = {0, height, 0},
        .has_ray_ends = ends};
    nebel_sky_view *view;
    assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
    upload(view);
    aim(planet, height, ends, &numbers, &a);
    ask(view, &a);
    if (!nb_gl_evaluate(gl, program, RAYS, &inputs[0][0], &outputs[0][0])) fail_msg("%s", gl->fault);
    const differences d = compare(&a);
    print_message(
        "%s from %g m, sun %g: transmittance %.1e, light %.1e, ground %.1e, normal %.1e, distance %.1e, %d strays\n",
        name, height, elevation, d.clear, d.light, d.ground, d.normal, d.distance, d.strays);
    nebel_destroy_sky_view(view);
    assert_true(d.clear < 1e-3 && d.light < 1e-3 && d.ground < 1e-3 && d.normal < 1e-3 && d.distance < 1e-3);
    assert_true(d.strays <= 2);
}

static void check_language(nb_gl_language language)
{
    static const struct {
        const char *name;
        double height, elevation;
    } places[] = {{"earth", 2, 60},      {"earth", -5, 3},    {"earth", 1e4, -4}, {"earth", 9.9e4, 20},
                  {"earth", 1.01e5, 20}, {"earth", 4e5, -10}, {"earth", 2e7, 10}, {"earth", 1e9, -50},
                  {"mars", 2, 1},        {"toy", 2, 10},      {"toy", 40, -5},    {"toy", 1e6, 40}};
    nb_gl gl;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    const unsigned program = compile(&gl), texture = make_texture();
    nebel_atmosphere *air = NULL;
    const nebel_atmosphere_desc *planet = NULL;
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        const nebel_atmosphere_desc *const next = nebel_lookup_atmosphere(places[i].name);
        if (language == NB_GL_300ES && next->radius > 1e6) continue;
        if (next != planet) {
            nebel_destroy_atmosphere(air);
            assert_int_equal(nebel_create_atmosphere(next, &air), NEBEL_OK);
        }
        planet = next;
        check_place(&gl, program, air, planet, places[i].height, places[i].elevation, places[i].name);
    }
    nebel_destroy_atmosphere(air);
    glDeleteTextures(1, &texture);
    nb_gl_close(&gl);
}

static void glsl_330_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_330);
}

static void glsl_es_300_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_300ES);
}

static void wrong_questions(void **state)
{
    (void)state;
    size_t count;
    assert_int_equal(nebel_pack_sky_view(NULL, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glsl_330_agrees_with_c),
        cmocka_unit_test(glsl_es_300_agrees_with_c),
        cmocka_unit_test(wrong_questions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
