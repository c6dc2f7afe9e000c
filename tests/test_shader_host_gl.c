/* A host's shader as docs/shaders.md has it, with NEBEL_SUN_VISIBILITY: a wall's shadow in sunlit fog, against pieces of nebel_trace. The
 * argument `all` leaves NEBEL_FEATURES out, too: then drivers compile for some twenty seconds. */
#include "shader_help.h"

/* The wall keeps the sun from what lies beyond BORDER along x; `sun_lit` steps by 0.5 m, as the page has it. */
#define BORDER 1.25
static const char host_text[] =
    "float my_shadow(vec3 place) { return place.x > 1.25 ? 0.0 : 1.0; }\n"
    "vec2 sun_lit(vec3 origin, vec3 direction, float t, float end)\n"
    "{\n"
    "    float next = min(t + 0.5, end);\n"
    "    return vec2(my_shadow(origin + direction * (0.5 * (t + next))), next);\n"
    "}\n"
    "#define NEBEL_SUN_VISIBILITY(origin, direction, t, end) sun_lit(origin, direction, t, end)\n";

enum { ASKED = 512 };

static const double eye[3] = {0, 0, 0};
static int all_features = 0;

/* Haze in a box and a denser ball of another colour in it. */
static nebel_lighting *commit_sunlit(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-8, -4, -8}, .max = {8, 4, 8}},
         .extinction = {.05, .06, .08},
         .albedo = {.9, .9, .8}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {2, 0, -3}, .radius = 2},
         .extinction = {.5, .3, .2},
         .albedo = {.9, .6, .3}},
    };
    const nebel_lighting_desc lights = {.sun = {.direction = {.48, .6, .64}, .irradiance = {5, 4, 3}}};
    return fog_light(&lights, volumes, 2);
}

/* In-scattering of the ray as if it ended at t. */
static nebel_transfer light_up_to(const nebel_lighting *lighting, nebel_ray ray, double t)
{
    const nebel_trace_desc desc = {.tolerance = 1e-5};
    nebel_transfer transfer;
    ray.t_max = fmax(t, 0);
    fog_trace(lighting, desc, 1, &ray, &transfer);
    return transfer;
}

/* Where the ray crosses the border of the shadow, which it does once at most; its end where it does not. */
static double border_of(const nebel_ray *ray)
{
    const double t = (BORDER - ray->origin[0]) / ray->direction[0];
    return t > 0 && t < ray->t_max ? t : ray->t_max;
}

/* The eye is in light. A step counts as its middle does, so that half a step beside the border may be lit or not. */
static void check_ray(const nebel_lighting *lighting, int i)
{
    const nebel_ray *const ray = &rays[i];
    const double border = border_of(ray), doubt = border < ray->t_max ? .26 : 0;
    const nebel_transfer least = light_up_to(lighting, *ray, border - doubt);
    const nebel_transfer most = light_up_to(lighting, *ray, fmin(border + doubt, ray->t_max));
    const nebel_transfer all = light_up_to(lighting, *ray, ray->t_max);
    for (int c = 0; c < 3; c++) {
        const double got = (double)answers[i].in_scattering[c];
        assert_true(got > least.in_scattering[c] - 5e-4 && got < most.in_scattering[c] + 5e-4);
        assert_true(fabs((double)answers[i].transmittance[c] - all.transmittance[c]) < 1e-5);
    }
}

static void test_the_host_of_the_page(void **unused)
{
    (void)unused;
    tracer t;
    uint64_t state = 3;
    int crossing = 0;
    nebel_lighting *const lighting = commit_sunlit();
    char defines[sizeof host_text + 64] = "";
    if (!all_features)
        (void)snprintf(defines, 64, "#define NEBEL_FEATURES %u\n", (unsigned)nebel_pack_features(lighting));
    strcat(defines, host_text);
    open_tracer(&t, NB_GL_330, BLOCK, defines, trace_body);
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.t_max = i < ASKED ? dice(&state, 2, 12) : 0};
        for (int axis = 0; axis < 3; axis++) ray.direction[axis] = dice(&state, -1, 1);
        set_ray(i, &ray, eye);
    }
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    for (int i = 0; i < ASKED; i++) {
        check_ray(lighting, i);
        crossing += border_of(&rays[i]) < rays[i].t_max;
    }
    assert_true(crossing > ASKED / 8);
    nebel_release_lighting(lighting);
    nb_gl_close(&t.gl);
}

int main(int argc, char **argv)
{
    all_features = argc > 1 && strcmp(argv[1], "all") == 0;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_host_of_the_page),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
