/* Strides: 0 means packed in every function that takes one, and gaps are stepped over. Clouds are asked in test_clouds. */
#include "fog_help.h"

#include <nebel/classic.h>
#include <nebel/planet.h>

enum { COUNT = 3 };

/* An element of each kind, with a gap behind it. */
#define WITH_GAP(type)                                                                                                 \
    struct {                                                                                                           \
        type it;                                                                                                       \
        double gap[3];                                                                                                 \
    }

static nebel_snapshot *some_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 4}, .extinction = {.1, .2, .3}, .source = {1, .5, .2}},
        {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 5}, .extinction = {.01, .01, .02}}};
    return fog_commit(&(nebel_fog_desc){0}, volumes, 2);
}

static void set_rays(nebel_ray *rays)
{
    for (int i = 0; i < COUNT; i++) rays[i] = (nebel_ray){{i - 1., .5 * i, 9}, {.05 * i, .1, -1}, 12 + i};
}

static void rays_may_be_packed_or_apart(void **state)
{
    (void)state;
    nebel_snapshot *fog = some_fog();
    nebel_ray rays[COUNT];
    WITH_GAP(nebel_ray) apart[COUNT];
    WITH_GAP(nebel_transfer) wide[COUNT];
    nebel_transfer transfers[COUNT];
    double distances[2][COUNT];
    memset(transfers, 0, sizeof transfers);
    set_rays(rays);
    for (int i = 0; i < COUNT; i++) apart[i].it = rays[i];
    assert_int_equal(nebel_trace(fog, NULL, COUNT, rays, 0, transfers, 0), NEBEL_OK);
    assert_int_equal(nebel_trace(fog, NULL, COUNT, &apart[0].it, sizeof *apart, &wide[0].it, sizeof *wide), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&transfers[i], &wide[i].it, sizeof *transfers);
    assert_true(transfers[0].transmittance[0] != transfers[2].transmittance[0]);
    assert_int_equal(nebel_invert_transmittance(fog, .7, 2, COUNT, rays, 0, distances[0]), NEBEL_OK);
    assert_int_equal(nebel_invert_transmittance(fog, .7, 2, COUNT, &apart[0].it, sizeof *apart, distances[1]),
                     NEBEL_OK);
    assert_memory_equal(distances[0], distances[1], sizeof distances[0]);
    nebel_release_snapshot(fog);
}

static void planes_may_be_packed_or_apart(void **state)
{
    (void)state;
    enum { STEP = 5 };
    nebel_snapshot *fog = some_fog();
    static float packed[11][COUNT], wide[11][STEP * COUNT];
    for (int k = 0; k < 7; k++)
        for (int i = 0; i < COUNT; i++)
            packed[k][i] = wide[k][STEP * i] = k == 6 ? 20.f : k == 5 ? -1.f : .3f * (float)(i - 1) + .1f * (float)k;
    float *p[11], *w[11];
    for (int k = 0; k < 11; k++) {
        p[k] = packed[k];
        w[k] = wide[k];
    }
    const size_t gap = STEP * sizeof(float);
    const nebel_ray_planes near = {
        .origin = {0, 1, 9}, .offset = {p[0], p[1], p[2]}, .direction_float = {p[3], p[4], p[5]}, .t_max = p[6]};
    const nebel_ray_planes far = {.origin = {0, 1, 9},
                                  .offset = {w[0], w[1], w[2]},
                                  .offset_stride = gap,
                                  .direction_float = {w[3], w[4], w[5]},
                                  .direction_stride = gap,
                                  .t_max = w[6],
                                  .t_max_stride = gap};
    const nebel_transfer_planes to = {.transmittance = {p[7]}, .in_scattering = {p[8], p[9]}, .error = p[10]};
    const nebel_transfer_planes spread = {.transmittance = {w[7]},
                                          .transmittance_stride = gap,
                                          .in_scattering = {w[8], w[9]},
                                          .in_scattering_stride = gap,
                                          .error = w[10],
                                          .error_stride = gap};
    assert_int_equal(nebel_trace_planes(fog, NULL, COUNT, &near, &to), NEBEL_OK);
    assert_int_equal(nebel_trace_planes(fog, NULL, COUNT, &far, &spread), NEBEL_OK);
    for (int k = 7; k < 11; k++)
        for (int i = 0; i < COUNT; i++) assert_memory_equal(&packed[k][i], &wide[k][STEP * i], sizeof(float));
    assert_true(packed[7][0] != packed[7][2]);
    nebel_release_snapshot(fog);
}

static void places_may_be_packed_or_apart(void **state)
{
    (void)state;
    nebel_snapshot *fog = some_fog();
    nebel_sample_point places[COUNT];
    WITH_GAP(nebel_sample_point) apart[COUNT];
    nebel_medium_properties matter[COUNT];
    WITH_GAP(nebel_medium_properties) wide[COUNT];
    memset(matter, 0, sizeof matter);
    for (int i = 0; i < COUNT; i++) places[i] = apart[i].it = (nebel_sample_point){{i, 3. * i, 0}, -1};
    assert_int_equal(nebel_sample_medium(fog, COUNT, places, 0, matter, 0), NEBEL_OK);
    assert_int_equal(nebel_sample_medium(fog, COUNT, &apart[0].it, sizeof *apart, &wide[0].it, sizeof *wide), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&matter[i], &wide[i].it, sizeof *matter);
    assert_true(matter[0].extinction[0] != matter[2].extinction[0]);
    nebel_release_snapshot(fog);
}

static void segments_may_be_packed_or_apart(void **state)
{
    (void)state;
    nebel_snapshot *fog = some_fog();
    float from[COUNT][3], to[COUNT][3], wide_from[COUNT][5], wide_to[COUNT][7], out[COUNT], wide[COUNT][2];
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3; c++) {
            from[i][c] = wide_from[i][c] = (float)(c - i);
            to[i][c] = wide_to[i][c] = (float)(3 * i + c);
        }
    const nebel_segments packed = {.from = from[0], .to = to[0]};
    const nebel_segments apart = {
        .from = wide_from[0], .from_stride = sizeof *wide_from, .to = wide_to[0], .to_stride = sizeof *wide_to};
    assert_int_equal(nebel_compute_segment_transmittance(fog, NEBEL_ISA_DEFAULT, 0, COUNT, &packed, out, 0), NEBEL_OK);
    assert_int_equal(
        nebel_compute_segment_transmittance(fog, NEBEL_ISA_DEFAULT, 0, COUNT, &apart, wide[0], sizeof *wide), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&out[i], &wide[i][0], sizeof(float));
    assert_true(out[0] != out[2]);
    nebel_release_snapshot(fog);
}

static void vertices_may_be_packed_or_apart(void **state)
{
    (void)state;
    nebel_snapshot *fog = some_fog();
    float positions[COUNT][3], apart[COUNT][4], factors[COUNT], wide[COUNT][2];
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3; c++) positions[i][c] = apart[i][c] = (float)(2 * i - c);
    const nebel_vertices packed = {.positions = positions[0], .eye = {0, 2, 12}};
    const nebel_vertices spread = {.positions = apart[0], .position_stride = sizeof *apart, .eye = {0, 2, 12}};
    const nebel_vertex_output to = {.format = NEBEL_VERTEX_FACTOR, .data = factors};
    const nebel_vertex_output far = {.format = NEBEL_VERTEX_FACTOR, .data = wide[0], .stride = sizeof *wide};
    assert_int_equal(nebel_compute_vertex_fog(fog, NULL, COUNT, &packed, &to, 1), NEBEL_OK);
    assert_int_equal(nebel_compute_vertex_fog(fog, NULL, COUNT, &spread, &far, 1), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&factors[i], &wide[i][0], sizeof(float));
    assert_true(factors[0] != factors[2]);
    nebel_release_snapshot(fog);
}

static void air_may_be_packed_or_apart(void **state)
{
    (void)state;
    nebel_atmosphere *air = NULL;
    assert_int_equal(nebel_create_atmosphere(nebel_lookup_atmosphere("toy"), &air), NEBEL_OK);
    const nebel_sun sun = {.direction = {0, 1, .5}, .irradiance = {3, 3, 3}};
    nebel_ray rays[COUNT];
    WITH_GAP(nebel_ray) apart[COUNT];
    nebel_transfer transfers[COUNT];
    WITH_GAP(nebel_transfer) wide[COUNT];
    double places[COUNT][3], far_places[COUNT][4];
    nebel_irradiance light[COUNT];
    WITH_GAP(nebel_irradiance) wide_light[COUNT];
    memset(transfers, 0, sizeof transfers);
    memset(light, 0, sizeof light);
    set_rays(rays);
    for (int i = 0; i < COUNT; i++) {
        apart[i].it = rays[i];
        for (int c = 0; c < 3; c++) places[i][c] = far_places[i][c] = c == 1 ? 50. * i : 0;
    }
    assert_int_equal(nebel_trace_atmosphere(air, &sun, COUNT, rays, 0, transfers, 0), NEBEL_OK);
    assert_int_equal(nebel_trace_atmosphere(air, &sun, COUNT, &apart[0].it, sizeof *apart, &wide[0].it, sizeof *wide),
                     NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&transfers[i], &wide[i].it, sizeof *transfers);
    const double(*const near)[3] = (const double(*)[3])places;
    const double(*const far)[3] = (const double(*)[3])(const void *)far_places;
    assert_int_equal(nebel_compute_atmosphere_irradiance(air, &sun, COUNT, near, 0, light, 0), NEBEL_OK);
    assert_int_equal(nebel_compute_atmosphere_irradiance(air, &sun, COUNT, far, sizeof *far_places, &wide_light[0].it,
                                                         sizeof *wide_light),
                     NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(&light[i], &wide_light[i].it, sizeof *light);
    assert_true(light[0].sun[0] != light[2].sun[0]);
    nebel_destroy_atmosphere(air);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_may_be_packed_or_apart),     cmocka_unit_test(planes_may_be_packed_or_apart),
        cmocka_unit_test(places_may_be_packed_or_apart),   cmocka_unit_test(segments_may_be_packed_or_apart),
        cmocka_unit_test(vertices_may_be_packed_or_apart), cmocka_unit_test(air_may_be_packed_or_apart)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
