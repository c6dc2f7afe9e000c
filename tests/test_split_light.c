/* Fog by its lights apart: they add up to the whole, each is its own light's, and lost memory is told and leaks nothing. */
#include "fog_help.h"

#include <nebel/light.h>

#include <math.h>
#include <string.h>

enum { RAYS = 24 };

static const nebel_sun suns[2] = {{{.3, .8, .2}, {1, 2, 3}}, {{.3, .8, .2}, {4, 5, 6}}};

static const nebel_light lamp = {.position = {1, 5, -3}, .intensity = {30, 20, 10}, .radius = .1};

/* Scattering fog, fog that shines, fog with a source of its own. */
static const nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 2, -8}, .radius = 6},
                                             .extinction = {.1, .15, .2},
                                             .albedo = {.9, .8, .7},
                                             .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4}},
                                            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-4, 0, -12}, .max = {4, 3, -5}},
                                             .extinction = {.05, .05, .05},
                                             .emission = {.01, .02, .03}},
                                            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, -9}, .max = {-5, 4, -5}},
                                             .extinction = {.1, .1, .1},
                                             .source = {.3, .2, .1}}};

static nebel_snapshot *commit(size_t count, const nebel_volume_desc *given, int is_diffuse, fog_memory *memory)
{
    nebel_fog *fog;
    nebel_snapshot *snapshot;
    nebel_fog_desc desc = {.sun = suns[0]};
    const nebel_environment sky = {
        .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {.2, .3, .4}, .horizon = {.4, .3, .2}, .ground = {.1, .1, .1}};
    if (memory != NULL) desc.allocator = fog_memory_allocator(memory);
    assert_int_equal(nebel_create_fog(&desc, &fog), NEBEL_OK);
    assert_int_equal(nebel_set_environment(fog, &sky), NEBEL_OK);
    assert_int_equal(nebel_set_lamps(fog, 1, &lamp), NEBEL_OK);
    if (is_diffuse) assert_int_equal(nebel_set_diffusion(fog, &(nebel_diffusion_desc){.max_cells = 4096}), NEBEL_OK);
    for (size_t i = 0; i < count; i++) assert_int_equal(nebel_add_volume(fog, &given[i], NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

static void look(const nebel_snapshot *snapshot, nebel_transfer transfers[RAYS])
{
    nebel_ray rays[RAYS];
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, 2, 4}, {-.9 + .075 * i, .02 * (i % 5) - .04, -1}, i % 3 == 0 ? 10 : HUGE_VAL};
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){.tolerance = 1e-7}, RAYS, rays, sizeof *rays, transfers,
                                 sizeof *transfers),
                     NEBEL_OK);
}

static void parts_add_up(void **state)
{
    (void)state;
    for (int is_diffuse = 0; is_diffuse < 2; is_diffuse++) {
        nebel_snapshot *snapshot = commit(3, volumes, is_diffuse, NULL);
        nebel_split_fog split, brighter;
        nebel_transfer whole[RAYS], sun[RAYS], sky[RAYS], own[RAYS], bright[RAYS];
        assert_int_equal(nebel_split_light(snapshot, &suns[0], &split), NEBEL_OK);
        assert_int_equal(nebel_split_light(snapshot, &suns[1], &brighter), NEBEL_OK);
        look(snapshot, whole);
        nebel_release_snapshot(snapshot); /* the parts live on */
        look(split.sun, sun);
        look(split.sky, sky);
        look(split.own, own);
        look(brighter.sun, bright);
        double worst = 0, brightest = 0, least[3] = {0, 0, 0};
        for (int i = 0; i < RAYS; i++) {
            for (int c = 0; c < 3; c++) {
                const double parts[3] = {sun[i].in_scattering[c], sky[i].in_scattering[c], own[i].in_scattering[c]};
                const double ratio = suns[1].irradiance[c] / suns[0].irradiance[c];
                assert_true(sun[i].transmittance[c] == whole[i].transmittance[c] &&
                            sky[i].transmittance[c] == whole[i].transmittance[c] &&
                            own[i].transmittance[c] == whole[i].transmittance[c]);
                brightest = fmax(brightest, whole[i].in_scattering[c]);
                worst = fmax(worst, fabs(parts[0] + parts[1] + parts[2] - whole[i].in_scattering[c]));
                worst = fmax(worst, fabs(bright[i].in_scattering[c] - ratio * parts[0]) / ratio);
                for (int k = 0; k < 3; k++) least[k] = fmax(least[k], parts[k]);
            }
        }
        print_message("parts are off the whole by %.1e of %.2g\n", worst, brightest);
        assert_true(least[0] > .01 && least[1] > .01 && least[2] > .01);
        /* Diffused light is interpolated by its logarithm: of lights apart that is not what it is of their sum. */
        assert_true(worst <= (is_diffuse ? .01 * brightest : 1e-6));
        nebel_release_split_light(&split);
        nebel_release_split_light(&brighter);
    }
}

static void another_sun_takes_the_place_of_the_first(void **state)
{
    (void)state;
    nebel_snapshot *snapshot = commit(3, volumes, 0, NULL), *lit = snapshot;
    nebel_split_fog split;
    nebel_transfer whole[RAYS], sun[RAYS], sky[RAYS], own[RAYS];
    assert_int_equal(nebel_relight(NULL, &suns[1], &lit), NEBEL_ERROR_ARGUMENT);
    assert_null(lit);
    assert_int_equal(nebel_relight(snapshot, NULL, &lit), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_relight(snapshot, &suns[1], NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_relight(snapshot, &suns[1], &lit), NEBEL_OK);
    assert_int_equal(nebel_split_light(snapshot, &suns[1], &split), NEBEL_OK);
    nebel_release_snapshot(snapshot); /* it lives on */
    look(lit, whole);
    look(split.sun, sun);
    look(split.sky, sky);
    look(split.own, own);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            const double sum = sun[i].in_scattering[c] + sky[i].in_scattering[c] + own[i].in_scattering[c];
            assert_true(fabs(whole[i].in_scattering[c] - sum) <= 1e-6 * fmax(1, sum));
        }
    nebel_release_split_light(&split);
    nebel_release_snapshot(lit);
}

static void boxes_are_of_fog_that_scatters(void **state)
{
    (void)state;
    double min[3], max[3];
    nebel_split_fog split;
    nebel_snapshot *snapshot = commit(3, volumes, 0, NULL);
    assert_int_equal(nebel_snapshot_scattering_fog(snapshot, min, max), 1);
    const double middle[3] = {0, 2, -8};
    for (int c = 0; c < 3; c++) assert_true(fabs(min[c] - middle[c] + 6) < 1e-6 && fabs(max[c] - middle[c] - 6) < 1e-6);
    assert_int_equal(nebel_split_light(NULL, &suns[0], &split), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_split_light(snapshot, NULL, &split), NEBEL_ERROR_ARGUMENT);
    assert_null(split.sun);
    assert_int_equal(nebel_split_light(snapshot, &suns[0], NULL), NEBEL_ERROR_ARGUMENT);
    const nebel_sun bad[] = {{.direction = {0, (double)NAN, 0}, .irradiance = {1, 1, 1}},
                             {.irradiance = {1, 1, 1}},
                             {.direction = {0, 1, 0}, .irradiance = {-1, 1, 1}}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        nebel_snapshot *lit = snapshot;
        assert_int_equal(nebel_split_light(snapshot, &bad[i], &split), NEBEL_ERROR_VALUE);
        assert_null(split.sun);
        assert_int_equal(nebel_relight(snapshot, &bad[i], &lit), NEBEL_ERROR_VALUE);
        assert_null(lit);
    }
    nebel_release_split_light(NULL);
    nebel_release_snapshot(snapshot);
    snapshot = commit(2, volumes + 1, 0, NULL);
    assert_int_equal(nebel_snapshot_scattering_fog(snapshot, min, max), 0);
    assert_int_equal(nebel_snapshot_skylit_fog(snapshot, min, max), 0);
    nebel_release_snapshot(snapshot);
    nebel_volume_desc level = volumes[0], bent;
    level.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    bent = level;
    bent.density =
        (nebel_density){.type = NEBEL_DENSITY_ALTITUDE, .scale_height = 9, .center = {0, -1e6, 0}, .radius = 1e6};
    snapshot = commit(1, &level, 0, NULL);
    assert_int_equal(nebel_snapshot_scattering_fog(snapshot, min, max), 0);
    assert_int_equal(nebel_snapshot_skylit_fog(snapshot, min, max), 1);
    assert_true(max[0] == HUGE_VAL && min[2] == -HUGE_VAL);
    nebel_release_snapshot(snapshot);
    snapshot = commit(1, &bent, 0, NULL);
    assert_int_equal(nebel_snapshot_scattering_fog(snapshot, min, max), 1);
    assert_true(max[0] == HUGE_VAL && min[2] == -HUGE_VAL);
    nebel_release_snapshot(snapshot);
    /* Without own light there is no part for it. */
    nebel_fog *fog;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.sun = suns[0]}, &fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(fog, &volumes[0], NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    assert_int_equal(nebel_split_light(snapshot, &suns[0], &split), NEBEL_OK);
    assert_null(split.own);
    nebel_release_split_light(&split);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
}

static void boxes_hang_on_no_light(void **state)
{
    (void)state;
    nebel_fog *fog;
    nebel_snapshot *snapshot;
    nebel_sunlit_fog sunlit;
    double min[3], max[3];
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.sun = {.direction = {0, 1, 0}}}, &fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(fog, &volumes[0], NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    assert_int_equal(nebel_snapshot_sunlit_fog(snapshot, &sunlit), 0);
    assert_int_equal(nebel_snapshot_skylit_fog(snapshot, min, max), 1);
    assert_true(fabs(min[1] + 4) < 1e-6 && fabs(max[1] - 8) < 1e-6);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
}

static void lost_memory_is_survived(void **state)
{
    (void)state;
    for (size_t in_a_row = 1; in_a_row <= 1000; in_a_row *= 1000) {
        fog_memory memory = {.live = 0};
        nebel_snapshot *snapshot = commit(3, volumes, 0, &memory);
        nebel_result result = NEBEL_ERROR_MEMORY;
        size_t k = 0;
        while (result != NEBEL_OK) {
            const size_t live = memory.live;
            nebel_split_fog split;
            memory.fail_first = ++k;
            memory.fail_count = in_a_row;
            result = nebel_split_light(snapshot, &suns[0], &split);
            memory.fail_first = 0;
            if (result == NEBEL_OK) {
                nebel_release_split_light(&split);
            } else {
                assert_int_equal(result, NEBEL_ERROR_MEMORY);
                assert_true(split.sun == NULL && split.sky == NULL && split.own == NULL);
            }
            assert_int_equal(memory.live, live);
        }
        assert_true(k > 10);
        nebel_release_snapshot(snapshot);
        assert_int_equal(memory.live, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_add_up),
        cmocka_unit_test(another_sun_takes_the_place_of_the_first),
        cmocka_unit_test(boxes_are_of_fog_that_scatters),
        cmocka_unit_test(boxes_hang_on_no_light),
        cmocka_unit_test(lost_memory_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
