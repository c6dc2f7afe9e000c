/* Lit fog of which most light comes from a small part of the ray, in shaders: alone, and in a scene that has voxels elsewhere. */
#include "lit_cases.h"
#include "shader_help.h"

/* Far off every ray, of voxels that light does not pass on its way to the fog. */
static nebel_grid *add_voxels(nebel_fog *made)
{
    static const uint8_t voxels[2] = {255, 255};
    nebel_grid *grid = NULL;
    const nebel_grid_desc desc = {.size = {2, 1, 1}, .type = NEBEL_VOXEL_UINT8, .voxels = voxels};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    const nebel_volume_desc cloud = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-3e3, 2e3, 1e3}, .max = {-2e3, 3e3, 2e3}},
        .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
        .extinction = {1e-3, 1e-3, 1e-3},
        .albedo = {.5, .5, .5}};
    assert_int_equal(nebel_add_volume(made, &cloud, NULL), NEBEL_OK);
    return grid;
}

static nebel_lighting *commit_case(const lit_case *c, int beside_voxels)
{
    nebel_fog *made = NULL;
    nebel_snapshot *snapshot = NULL;
    const nebel_lighting_desc lights = {
        .sun = c->sun, .lights = &c->point_light, .light_count = c->point_light.intensity[0] > 0 ? 1 : 0};
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &made), NEBEL_OK);
    assert_int_equal(nebel_add_volume(made, &c->volume, NULL), NEBEL_OK);
    nebel_grid *const grid = beside_voxels ? add_voxels(made) : NULL;
    assert_int_equal(nebel_commit_fog(made, &snapshot), NEBEL_OK);
    nebel_release_grid(grid);
    nebel_destroy_fog(made);
    nebel_lighting *const lighting = light_fog(snapshot, &lights);
    nebel_release_snapshot(snapshot);
    return lighting;
}

/* One program of what all of them need. */
static void open_cases(tracer *t, int is_point_lit, int beside_voxels)
{
    char defines[128];
    uint32_t features = 0;
    for (size_t i = 0; i < LIT_CASES; i++) {
        if ((lit_cases[i].point_light.intensity[0] > 0) != is_point_lit) continue;
        nebel_lighting *lighting = commit_case(&lit_cases[i], beside_voxels);
        features |= nebel_pack_features(lighting);
        nebel_release_lighting(lighting);
    }
    snprintf(defines, sizeof defines, "#define NEBEL_FEATURES_LITERAL\n%s#define NEBEL_FEATURES %u\n",
             beside_voxels ? "#define NEBEL_VOXELS\n" : "", (unsigned)features);
    open_tracer(t, NB_GL_330, TEXTURE, defines, trace_body);
}

static double trace_case(tracer *t, const lit_case *c, int beside_voxels)
{
    nebel_lighting *lighting = commit_case(c, beside_voxels);
    memset(items, 0, sizeof items);
    set_ray(0, &c->ray, c->ray.origin);
    pack_and_upload(t, lighting, c->ray.origin);
    if (beside_voxels) upload_voxels(t, lighting);
    evaluate(t);
    nebel_release_lighting(lighting);
    return (double)answers[0].in_scattering[0];
}

/* Whether floats tell the depths of its skin apart: places on a body count from its center. */
static int is_skin_of_floats(const lit_case *c)
{
    return c->volume.extinction[0] * c->volume.shape.radius * ldexp(1, -24) < 1. / 255;
}

/* Within 1/255 of it, and a thousandth of the tolerance that is packed. */
static int try_cases(int is_point_lit, int beside_voxels)
{
    int wrong = 0;
    tracer t;
    open_cases(&t, is_point_lit, beside_voxels);
    for (size_t i = 0; i < LIT_CASES; i++) {
        const lit_case *c = &lit_cases[i];
        if ((c->point_light.intensity[0] > 0) != is_point_lit || !is_skin_of_floats(c)) continue;
        const double light = trace_case(&t, c, beside_voxels), off = fabs(light - c->right);
        print_message("%s%s: %g for %g, off by %.1e, %.1e of it\n", c->name, beside_voxels ? ", beside voxels" : "",
                      light, c->right, off, off / c->right);
        wrong += !(off <= c->right / 255 + 1e-7);
    }
    nb_gl_close(&t.gl);
    return wrong;
}

static void sunlight_of_small_places_is_found(void **state)
{
    (void)state;
    assert_int_equal(try_cases(0, 0), 0);
}

static void point_light_of_small_places_is_found_beside_voxels(void **state)
{
    (void)state;
    assert_int_equal(try_cases(1, 1), 0);
}

/* Ever lower point lights, whose light falls off ever faster than what is seen, against nebel_trace in double: within
 * 1/255 of it and a tenth of the step of a picture of bytes. */
static void grazing_point_light_is_found_beside_voxels(void **state)
{
    (void)state;
    int wrong = 0;
    tracer t;
    open_cases(&t, 1, 1);
    for (int i = 0; i < 8; i++) {
        const double far = 20 << i;
        lit_case c = {.volume = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 0, 1}},
                                 .extinction = LIT_GRAY(300),
                                 .albedo = LIT_GRAY(1)},
                      .point_light = {.position = {far, .4, 0}, .intensity = LIT_GRAY(far * far * 100)},
                      .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL}};
        nebel_lighting *lighting = commit_case(&c, 1);
        fog_trace(lighting, precise, 1, &c.ray, transfers);
        nebel_release_lighting(lighting);
        c.right = transfers[0].in_scattering[0];
        const double light = trace_case(&t, &c, 1), off = fabs(light - c.right);
        print_message("%g: %g for %g +- %g, off %g\n", far, light, c.right, transfers[0].error, off / c.right);
        wrong += !(off <= (c.right + .1) / 255);
    }
    nb_gl_close(&t.gl);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(sunlight_of_small_places_is_found),
                                       cmocka_unit_test(point_light_of_small_places_is_found_beside_voxels),
                                       cmocka_unit_test(grazing_point_light_is_found_beside_voxels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
