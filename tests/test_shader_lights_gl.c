/* Point lights in fog that scatters sharply, in shaders against nebel_trace in double: at the eye, near it, in view,
 * beside.
 * The argument `all` tries more rays. */
#include "shader_help.h"

enum { HAZES = 5, PLACES = 6 };

static const nebel_phase phases[HAZES] = {
    {.type = NEBEL_PHASE_ISOTROPIC},
    {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .9},
    {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = -.9},
    {.type = NEBEL_PHASE_DROPLETS, .diameter = 12},
    {.type = NEBEL_PHASE_DROPLETS, .diameter = 40},
};
static const char *const phase_names[HAZES] = {"isotropic", "forward", "backward", "droplets", "large droplets"};

/* Where the point light is, in metres from the eye. */
typedef struct setting {
    const char *name;
    double place[3], radius;
} setting;

static const setting settings[PLACES] = {
    {"at the eye", {0, 0, 0}, .05},      {"near the eye", {.02, .03, -.05}, .02},
    {"an arm ahead", {.6, .1, .1}, .05}, {"in view", {8, .5, -.4}, .1},
    {"beside", {.5, 3, 1}, .1},          {"behind", {-4, 1, 0}, 0},
};

static const double eye[3] = {0, 0, 0};
static int asked = 192;

/* Half of them past the point light, closely or not. */
static void distribute_rays(const setting *s)
{
    uint64_t state = 1;
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.t_max = dice_below(&state, 3) == 0 ? HUGE_VAL : dice(&state, 1, 60)};
        if (i >= asked) ray.t_max = 0;
        const double spread = i % 2 == 0 ? 4 : pow(10, dice(&state, -3, .5));
        for (int k = 0; k < 3; k++) ray.direction[k] = s->place[k] * (i % 2) + dice(&state, -spread, spread);
        set_ray(i, &ray, eye);
    }
}

static nebel_lighting *commit_haze(const nebel_phase *phase, const setting *s)
{
    const nebel_volume_desc volume = {.extinction = {.05, .06, .08}, .albedo = {.95, .95, .9}, .phase = *phase};
    nebel_light light = {.intensity = {10, 8, 6}, .radius = s->radius};
    memcpy(light.position, s->place, sizeof light.position);
    const nebel_lighting_desc lights = {.lights = &light, .light_count = 1};
    return fog_light(&lights, &volume, 1);
}

/* As a share of the ray's own light, or of a hundredth of what is bright where that is more. */
static double point_light_off(const answer *got, const nebel_transfer *wanted, double bright)
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        const double light = wanted->in_scattering[c], off = fabs((double)got->in_scattering[c] - light);
        if (!(off < HUGE_VAL)) return HUGE_VAL;
        most = fmax(most, off / fmax(light, .01 * bright));
    }
    return most;
}

static void try_setting(tracer *t, int phase, const setting *s)
{
    const nebel_trace_desc truth = {.tolerance = 1e-6};
    nebel_lighting *const lighting = commit_haze(&phases[phase], s);
    const size_t count = (size_t)asked;
    double brightest = 0;
    distribute_rays(s);
    pack_and_upload(t, lighting, eye);
    evaluate(t);
    fog_trace(lighting, truth, count, rays, transfers);
    for (size_t i = 0; i < count; i++) brightest = fmax(brightest, transfers[i].in_scattering[0]);
    for (size_t i = 0; i < count; i++) differences[i] = point_light_off(&answers[i], &transfers[i], fmin(brightest, 1));
    qsort(differences, count, sizeof *differences, ascending);
    print_message("%s, point light %s: light up to %.3g; median %.1e, 95 %% %.1e, worst %.1e\n", phase_names[phase],
                  s->name, brightest, differences[count / 2], differences[count * 95 / 100], differences[count - 1]);
    assert_true(brightest > .05);
    assert_true(differences[count * 95 / 100] <= 4e-4);
    assert_true(differences[count - 1] <= 2e-3);
    nebel_release_lighting(lighting);
}

/* All settings want the same program. */
static void open_hazes(tracer *t, nb_gl_language language)
{
    nebel_lighting *const lighting = commit_haze(&phases[1], &settings[0]);
    char defines[96];
    snprintf(defines, sizeof defines, "#define NEBEL_MAX_RADIANCE 1e9\n#define NEBEL_FEATURES %u\n",
             (unsigned)nebel_pack_features(lighting));
    open_tracer(t, language, BLOCK, defines, trace_body);
    nebel_release_lighting(lighting);
}

static void try_all(nb_gl_language language)
{
    tracer t;
    open_hazes(&t, language);
    for (int phase = 0; phase < HAZES; phase++) {
        for (int i = 0; i < PLACES; i++) {
            if (i % 2 == (language == NB_GL_330)) try_setting(&t, phase, &settings[i]);
        }
    }
    nb_gl_close(&t.gl);
}

static void test_lights_in_sharply_scattering_fog(void **unused)
{
    (void)unused;
    try_all(NB_GL_330);
    try_all(NB_GL_300ES);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lights_in_sharply_scattering_fog)};
    if (argc > 1 && strcmp(argv[1], "all") == 0) asked = RAYS;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
