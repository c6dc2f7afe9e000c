/* Fog above a ball in shaders: against the double reference, from the ground to orbit. */
#include "shader_help.h"

#define EARTH 6.36e6

static const double center[3] = {2e6, -EARTH * .8, 1e6};

static nebel_volume_desc mist(double base, double scale_height, nebel_below below, double visibility, double source)
{
    nebel_volume_desc v = {.density = {.type = NEBEL_DENSITY_ALTITUDE,
                                       .below = below,
                                       .base = base,
                                       .scale_height = scale_height,
                                       .radius = EARTH}};
    memcpy(v.density.center, center, sizeof center);
    for (int c = 0; c < 3; c++) {
        v.extinction[c] = 3 / visibility;
        v.source[c] = source * (1 - .2 * c);
    }
    return v;
}

/* From `height` above the ground, about the horizon and below; half of the rays end where they meet the ground. */
static void aim(double height, const double eye[3], const double up[3])
{
    uint64_t state = 1;
    const double dip = sqrt(height * (2 * EARTH + height)) / (EARTH + height);
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.origin = {eye[0], eye[1], eye[2]}, .t_max = HUGE_VAL};
        double level[3], along = 0;
        for (int c = 0; c < 3; c++) level[c] = dice(&state, -1, 1);
        for (int c = 0; c < 3; c++) along += level[c] * up[c];
        for (int c = 0; c < 3; c++) level[c] -= along * up[c];
        const double length = sqrt(level[0] * level[0] + level[1] * level[1] + level[2] * level[2]);
        const double horizon = -asin(fmin(dip, 1)), angle = horizon + dice(&state, -.3, .1);
        for (int c = 0; c < 3; c++) ray.direction[c] = cos(angle) * level[c] / length + sin(angle) * up[c];
        const double rise = (EARTH + height) * sin(angle), root = rise * rise - height * (2 * EARTH + height);
        if (i % 2 == 0 && rise < 0 && root > 0) ray.t_max = height * (2 * EARTH + height) / (sqrt(root) - rise);
        set_ray(i, &ray, eye);
    }
}

static void try_heights(const nebel_lighting_desc *lights, const nebel_volume_desc *volumes, size_t count,
                        const char *what)
{
    static const double heights[] = {2, 300, 2e3, 1e5, 1.5e6};
    const double up[3] = {.6, .64, .48};
    char features[64], name[96];
    nebel_lighting *lighting = fog_light(lights, volumes, count);
    tracer t;
    snprintf(features, sizeof features, "#define NEBEL_FEATURES %u\n", (unsigned)nebel_pack_features(lighting));
    open_tracer(&t, NB_GL_330, TEXTURE, features, trace_body);
    for (size_t i = 0; i < sizeof heights / sizeof *heights; i++) {
        double eye[3];
        for (int c = 0; c < 3; c++) eye[c] = center[c] + (EARTH + heights[i]) * up[c];
        snprintf(name, sizeof name, "%s from %g m", what, heights[i]);
        aim(heights[i], eye, up);
        pack_and_upload(&t, lighting, eye);
        evaluate(&t);
        compare(lighting, &(nebel_trace_desc){.tolerance = 1e-4}, eye, 1, 0, name);
    }
    nb_gl_close(&t.gl);
    nebel_release_lighting(lighting);
}

static void test_one(void **state)
{
    (void)state;
    const nebel_volume_desc grows = mist(0, 200, NEBEL_BELOW_GROW, 9000, 1);
    const nebel_volume_desc capped = mist(150, 120, NEBEL_BELOW_CONSTANT, 5000, 1);
    try_heights(NULL, &grows, 1, "mist");
    try_heights(NULL, &capped, 1, "capped mist");
}

static void test_two_of_different_light(void **state)
{
    (void)state;
    const nebel_volume_desc both[2] = {mist(0, 300, NEBEL_BELOW_GROW, 20000, 1),
                                       mist(500, 150, NEBEL_BELOW_CONSTANT, 15000, .4)};
    try_heights(NULL, both, 2, "two mists");
}

static void test_sunlight(void **state)
{
    (void)state;
    nebel_volume_desc lit = mist(0, 300, NEBEL_BELOW_GROW, 9000, 0);
    const nebel_lighting_desc lights = {.sun = {{.3, .9, .2}, {3, 2.5, 2}}};
    for (int c = 0; c < 3; c++) lit.albedo[c] = .95;
    try_heights(&lights, &lit, 1, "sunlit mist");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one),
        cmocka_unit_test(test_two_of_different_light),
        cmocka_unit_test(test_sunlight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
