/* Ambient light by direction as words for shaders: sizes, places, what is the same, and what is refused. */
#include "fog_help.h"

#include "shader/texel_layout.h"
#include <nebel/shader.h>

static const nebel_environment dusk = {
    .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {0.1, 0.3, 1}, .horizon = {2, 1, 0.5}, .ground = {0.05, 0.04, 0}};

enum { HEIGHT = 8, PIXELS = 2 * HEIGHT * HEIGHT };

static nebel_environment_map *make_map(void)
{
    float pixels[3 * PIXELS];
    nebel_environment_map *map = NULL;
    for (int i = 0; i < 3 * PIXELS; i++) pixels[i] = (float)i;
    const nebel_environment_map_desc desc = {.width = 2 * HEIGHT, .height = HEIGHT, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_OK);
    return map;
}

/* Volumes of these means of the cosine, the last of which has no albedo. */
static nebel_lighting *commit(const nebel_environment *sky, size_t count, const double *g, nebel_log log)
{
    nebel_volume_desc volumes[8];
    for (size_t i = 0; i < count; i++) {
        const double albedo = i + 1 < count ? 0.5 : 0;
        volumes[i] = (nebel_volume_desc){.extinction = {1, 2, 3},
                                         .albedo = {albedo, albedo, albedo},
                                         .emission = {7, 8, 9},
                                         .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = g[i]}};
    }
    const nebel_lighting_desc lights = {.environment = *sky};
    return fog_commit_lit(&(nebel_fog_desc){.host.log = log}, volumes, count, &lights);
}

static nebel_texel_f32 *pack(const nebel_lighting *lighting, int surfaces, size_t *count)
{
    assert_int_equal(nebel_pack_environment(lighting, surfaces, NULL, 0, count), NEBEL_OK);
    nebel_texel_f32 *words = malloc((*count + 1) * sizeof *words);
    assert_non_null(words);
    memset(words, 0xff, (*count + 1) * sizeof *words); /* NaN wherever nothing is written */
    assert_int_equal(nebel_pack_environment(lighting, surfaces, words, *count, count), NEBEL_OK);
    for (size_t i = 0; i < *count; i++)
        for (int c = 0; c < 4; c++)
            if (!isfinite(words[i].v[c])) fail_msg("word %zu, component %d is %g", i, c, (double)words[i].v[c]);
    assert_true(isnan(words[*count].v[0]));
    return words;
}

/* Media of one phase function have one filter, and those that scatter nothing none. */
static void media_name_their_filters(void **state)
{
    (void)state;
    static const double g[] = {0.5, 0.3, 0.5, 0.3};
    size_t count, fog_count;
    nebel_lighting *fog = commit(&dusk, 4, g, (nebel_log){0});
    nebel_texel_f32 *words = pack(fog, 0, &count), packed[64];
    assert_int_equal(count, NB_ENVIRONMENT_TEXELS + 2 * (1 + NB_FILTER_PIECES));
    assert_int_equal(nebel_pack_fog(fog, (const double[3]){1, 2, 3}, packed, 64, &fog_count), NEBEL_OK);
    int used[2] = {0, 0}, none = 0;
    for (int i = 0; i < 4; i++) {
        const nebel_texel_f32 *medium = &packed[NB_HEADER_TEXELS + i * NB_MEDIUM_TEXELS];
        const int filter = (int)medium[NB_MEDIUM_FILTER].v[3];
        none += filter == 0;
        if (filter == 0) continue;
        const double cosine = (double)words[filter].v[0];
        assert_true(fabs(cosine - 0.5) < 1e-6 || fabs(cosine - 0.3) < 1e-6);
        used[cosine > 0.4]++;
        assert_true(medium[2].v[0] == 0.5F && medium[1].v[0] == 7); /* albedo, and emission alone */
    }
    assert_int_equal(used[0], 1);
    assert_int_equal(used[1], 2);
    assert_int_equal(none, 1);
    assert_true(nebel_pack_features(fog) & NEBEL_FEATURE_ENVIRONMENT);
    assert_true(nebel_pack_features(fog) & NEBEL_FEATURE_MIXED);
    free(words);
    nebel_release_lighting(fog);
}

/* Filters are where they are whatever else is packed; pixels are what they were. */
static void maps_bring_what_surfaces_want(void **state)
{
    (void)state;
    static const double g[] = {0.2, 0};
    size_t alone, count;
    nebel_environment_map *map = make_map();
    const nebel_environment sky = {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = 90, .intensity = 3};
    nebel_lighting *fog = commit(&sky, 2, g, (nebel_log){0});
    nebel_texel_f32 *filter = pack(fog, 0, &alone), *all = pack(fog, 1, &count);
    assert_true(count > alone + PIXELS);
    assert_memory_equal(filter + NB_ENVIRONMENT_TEXELS, all + NB_ENVIRONMENT_TEXELS,
                        (alone - NB_ENVIRONMENT_TEXELS) * sizeof *all);
    assert_true(filter[1].v[0] == 0 && (size_t)all[1].v[0] == alone);
    assert_true(fabsf(all[0].v[1]) < 1e-6F && fabsf(all[0].v[2] - 1) < 1e-6F && all[0].v[3] == 3);
    const nebel_texel_f32 *picture = &all[(size_t)all[1].v[1]];
    assert_true(picture->v[0] == 2 * HEIGHT && picture->v[1] == HEIGHT);
    for (int i = 0; i < PIXELS; i++)
        for (int c = 0; c < 3; c++) assert_true(picture[1 + i].v[c] == (float)(3 * i + c));
    assert_int_equal((size_t)(picture - all) + 1 + PIXELS, count);
    free(filter);
    free(all);
    nebel_release_lighting(fog);
    nebel_release_environment_map(map);
}

static void what_is_the_same(void **state)
{
    (void)state;
    static const double g[] = {0.2, 0.4, 0};
    nebel_environment_map *map = make_map();
    nebel_environment sky = dusk;
    const nebel_environment night = {.radiance = {0.1, 0.1, 0.2}};
    size_t count;
    sky.ground[2] = 1;
    const nebel_environment maps[] = {{.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = 1},
                                      {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = 1, .rotation = 3}};
    nebel_lighting *const fogs[] = {
        commit(&dusk, 2, g, (nebel_log){0}),    commit(&dusk, 2, g, (nebel_log){0}),
        commit(&dusk, 3, g, (nebel_log){0}),    commit(&sky, 2, g, (nebel_log){0}),
        commit(&maps[0], 2, g, (nebel_log){0}), commit(&maps[1], 2, g, (nebel_log){0}),
        commit(&night, 2, g, (nebel_log){0}),
    };
    enum { FOGS = sizeof fogs / sizeof *fogs };
    for (int i = 0; i < FOGS; i++)
        for (int k = 0; k < FOGS; k++)
            assert_int_equal(nebel_is_same_environment(fogs[i], fogs[k]), i == k || (i < 2 && k < 2));
    assert_int_equal(nebel_pack_environment(fogs[FOGS - 1], 0, NULL, 0, &count), NEBEL_OK);
    assert_int_equal(count, 0);
    nebel_texel_f32 *words = pack(fogs[FOGS - 1], 1, &count);
    assert_int_equal(count, NB_ENVIRONMENT_TEXELS);
    assert_true((int)words[0].v[0] == NB_ENVIRONMENT_CONSTANT && words[1].v[2] == 0.2F);
    assert_false(nebel_pack_features(fogs[FOGS - 1]) & NEBEL_FEATURE_ENVIRONMENT);
    free(words);
    for (int i = 0; i < FOGS; i++) nebel_release_lighting(fogs[i]);
    nebel_release_environment_map(map);
}

static void bad_input_is_refused(void **state)
{
    (void)state;
    static const double g[] = {0.2, 0};
    fog_messages messages = {0};
    nebel_texel_f32 word = {{77, 0, 0, 0}};
    size_t count = 0;
    nebel_lighting *fog = commit(&dusk, 2, g, fog_messages_log(&messages));
    assert_int_equal(nebel_pack_environment(NULL, 0, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_environment(fog, 0, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_environment(fog, 0, NULL, 1, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_environment(fog, 0, &word, 1, &count), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "room for 1"));
    assert_true(word.v[0] == 77);
    nebel_release_lighting(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(media_name_their_filters),
        cmocka_unit_test(maps_bring_what_surfaces_want),
        cmocka_unit_test(what_is_the_same),
        cmocka_unit_test(bad_input_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
