/* Voxels in shaders against nebel_trace in double. */
#include "random_grid.h"
#include "shader_help.h"

/* Voxels beside everything else: of other light, covered and covering, behind distances, far away. */
static void try_grids(nb_gl_language language, const char *defines, uint64_t first)
{
    tracer t;
    open_tracer(&t, language, TEXTURE, defines, trace_body);
    for (uint64_t seed = first; seed < first + 6; seed++) {
        nebel_grid *grids[RANDOM_GRIDS];
        random_grids_make(&fog, (random_fog_kind)(seed % 6 + (seed % 6 >= RANDOM_FOG_MANY)), seed, grids);
        try_fog(&t, "grids", seed);
        random_grids_release(grids);
    }
    nb_gl_close(&t.gl);
}

/* By the whole text, which takes drivers a minute to compile, and by one without what lights fog. */
static void test_grids(void **unused)
{
    (void)unused;
    try_grids(NB_GL_330, "#define NEBEL_VOXELS\n", 0);
    try_grids(NB_GL_300ES, "#define NEBEL_VOXELS\n#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 18350079\n",
              6);
}

/* ---- in sunlight ----------------------------------------------------------------------------- */

static int tries_all; /* an argument asks for more scenes */

static const nebel_sun low_sun = {{.8, .42, .4}, {3, 2.5, 2}};

/* Against light in double, which is found without lattices; features as packed, to the preprocessor as well in one language. */
static void trace_packed(const nebel_lighting *lighting, const double eye[3], double scale, const char *name,
                         nb_gl_language language)
{
    char defines[128];
    tracer t;
    snprintf(defines, sizeof defines, "%s#define NEBEL_VOXELS\n#define NEBEL_FEATURES %u\n",
             language == NB_GL_330 ? "#define NEBEL_FEATURES_LITERAL\n" : "", (unsigned)nebel_pack_features(lighting));
    open_tracer(&t, language, TEXTURE, defines, trace_body);
    pack_and_upload(&t, lighting, eye);
    upload_voxels(&t, lighting);
    evaluate(&t);
    compare(lighting, &(nebel_trace_desc){.tolerance = 1e-4}, eye, scale, 0, name);
    nb_gl_close(&t.gl);
}

static nebel_volume_desc cloud_of(nebel_grid *grid, double extinction)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-6, -4, -5}, .max = {6, 4, 5}},
                               .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                               .extinction = {extinction, 1.1 * extinction, 1.3 * extinction},
                               .albedo = {.95, .9, .8},
                               .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .5}};
}

/* A puff: dense in the middle, with waves on it. */
static nebel_grid *make_puff(nebel_grid_filter filter)
{
    enum { SIZE = 40 };
    static uint8_t voxels[SIZE * SIZE * SIZE];
    const nebel_grid_desc desc = {
        .size = {SIZE, SIZE, SIZE}, .type = NEBEL_VOXEL_UINT8, .voxels = voxels, .filter = filter};
    nebel_grid *grid = NULL;
    for (int i = 0; i < SIZE * SIZE * SIZE; i++) {
        const double x = i % SIZE - 19.5, y = i / SIZE % SIZE - 19.5, z = i / (SIZE * SIZE) - 19.5;
        const double waves = sin(x * .7) * sin(y * .9 + 1) * sin(z * .8 + 2);
        voxels[i] = (uint8_t)(255 * fmin(fmax(1 - sqrt(x * x + y * y + z * z) / 17 + .4 * waves, 0), 1));
    }
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

static const double origin[3] = {0, 0, 0}, before[3] = {-3, 2, 14}, amid[3] = {.5, .4, -.3};

static void test_sunlit_puff(void **unused)
{
    (void)unused;
    for (int i = tries_all ? 0 : 1; i < (tries_all ? 4 : 3); i++) {
        nebel_grid *grid = make_puff(i < 2 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST);
        const nebel_volume_desc cloud = cloud_of(grid, i == 0 ? .4 : 2);
        const nebel_lighting_desc lights = {.sun = low_sun, .environment = {.radiance = {.1, .12, .15}}};
        nebel_lighting *lighting = fog_light(&lights, &cloud, 1);
        const double *eye = i == 1 ? amid : before;
        camera_rays(eye, origin, (uint64_t)i);
        trace_packed(lighting, eye, 1, i < 2 ? "sunlit puff" : "sunlit puff of nearest voxels",
                     i % 2 == 0 ? NB_GL_330 : NB_GL_300ES);
        nebel_release_lighting(lighting);
        nebel_release_grid(grid);
    }
}

/* Noise that scatters as droplets do, in haze and beside a body, which shade each other. */
static void test_sunlit_noise_among_others(void **unused)
{
    (void)unused;
    uint64_t state = 3;
    nebel_grid *grid = random_noise(&state);
    nebel_volume_desc volumes[] = {cloud_of(grid, .8),
                                   {.shape = {.type = NEBEL_SHAPE_WORLD},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 6},
                                    .extinction = {.02, .025, .03},
                                    .albedo = {.9, .9, .9},
                                    .phase = {.type = NEBEL_PHASE_RAYLEIGH}},
                                   {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {5, 5, 3}, .radius = 2},
                                    .extinction = {1, 1, 1},
                                    .source = {.1, .2, .3}}};
    volumes[0].phase = (nebel_phase){.type = NEBEL_PHASE_DROPLETS, .diameter = 12};
    for (int i = tries_all ? 0 : 1; i < 2; i++) {
        const nebel_lighting_desc lights = {.sun = low_sun};
        nebel_lighting *lighting = fog_light(&lights, volumes, i == 0 ? 2 : 3);
        const double *eye = i == 1 ? amid : before;
        camera_rays(eye, origin, (uint64_t)i);
        trace_packed(lighting, eye, 1, "sunlit noise among others", i == 0 ? NB_GL_330 : NB_GL_300ES);
        nebel_release_lighting(lighting);
    }
    nebel_release_grid(grid);
}

/* Some drivers end loops after so many turns, and those of neighbours add up: seven of eight rays end at once. */
static void thin_rays(const double eye[3])
{
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = rays[i];
        if (i % 8 != 0) ray.t_max = 0;
        set_ray(i, &ray, eye);
    }
}

static void test_sunlit_random_grids(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 12; seed += tries_all ? 1 : 9) {
        nebel_grid *grids[RANDOM_GRIDS];
        uint64_t state = seed + 100;
        random_grids_make(&fog, (random_fog_kind)(seed % 6 + (seed % 6 >= RANDOM_FOG_MANY)), seed, grids);
        random_fog_light(&fog, &state);
        const nebel_fog_desc desc = random_fog_desc(&fog);
        nebel_lighting_desc lights = random_fog_lights(&fog);
        lights.sun = (nebel_sun){{dice(&state, -1, 1), dice(&state, .2, 1), .3}, {3, 2.5, 2}};
        nebel_lighting *lighting = fog_commit_lit(&desc, fog.volumes, fog.count, &lights);
        double eye[3];
        for (int k = 0; k < 3; k++) eye[k] = fog.shift[k] + dice(&state, -20, 20) * (seed % 3 == 0 ? .2 : 1);
        camera_rays(eye, fog.shift, seed);
        if (tries_all) thin_rays(eye);
        trace_packed(lighting, eye, largest_source(&fog), "sunlit random grids", NB_GL_330);
        nebel_release_lighting(lighting);
        random_grids_release(grids);
    }
}

/* The others end at once. */
static void keep_rays(int count, const double eye[3])
{
    for (int i = count; i < RAYS; i++) {
        nebel_ray ray = rays[i];
        ray.t_max = 0;
        set_ray(i, &ray, eye);
    }
}

/* Voxels of which one is many optical depths wide, so that what lies between nodes of a lattice of one or two a cell matters: two
 * of them, a checkerboard, and any. */
static nebel_grid *make_coarse(int kind, nebel_grid_filter filter)
{
    float voxels[6 * 5 * 4];
    const uint32_t sizes[3][3] = {{1, 2, 1}, {6, 5, 4}, {6, 5, 4}}, *size = sizes[kind];
    uint64_t state = 7;
    for (uint32_t i = 0; i < size[0] * size[1] * size[2]; i++) {
        const uint32_t x = i % size[0], y = i / size[0] % size[1], z = i / (size[0] * size[1]);
        voxels[i] = kind == 2 ? (float)fmax(dice(&state, -.5, 1), 0) : (float)((x + y + z) % 2 == 0);
    }
    const nebel_grid_desc desc = {
        .size = {size[0], size[1], size[2]}, .type = NEBEL_VOXEL_FLOAT, .voxels = voxels, .filter = filter};
    nebel_grid *grid = NULL;
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

static void try_dense(tracer *t, int kind, double extinction, nebel_grid_filter filter, const nebel_sun *sun)
{
    char name[64];
    snprintf(name, sizeof name, "dense voxels %d, extinction %g, %s", kind, extinction,
             filter == NEBEL_GRID_FILTER_LINEAR ? "linear" : "nearest");
    nebel_grid *grid = make_coarse(kind, filter);
    nebel_volume_desc cloud = cloud_of(grid, extinction);
    cloud.phase = (nebel_phase){0};
    const nebel_lighting_desc lights = {.sun = *sun};
    nebel_lighting *lighting = fog_light(&lights, &cloud, 1);
    camera_rays(before, origin, (uint64_t)kind);
    for (int i = 0; i < 64;
         i++) { /* level ones, so that what a lattice is off by at one height is not made up for at another */
        const nebel_ray level = {.origin = {0, .125 * i - 3.9, 14}, .direction = {0, 0, -1}, .t_max = HUGE_VAL};
        set_ray(i, &level, before);
    }
    keep_rays(512, before);
    pack_and_upload(t, lighting, before);
    upload_voxels(t, lighting);
    evaluate(t);
    compare(lighting, &(nebel_trace_desc){.tolerance = 1e-4}, before, 1, 0, name);
    nebel_release_lighting(lighting);
    nebel_release_grid(grid);
}

static void test_sunlit_dense_voxels(void **unused)
{
    (void)unused;
    const nebel_sun suns[2] = {{{0, 1, 0}, {3, 2.5, 2}}, low_sun};
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE,
                "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_VOXELS\n#define NEBEL_FEATURES 1572866\n", trace_body);
    try_dense(&t, 0, 5, NEBEL_GRID_FILTER_LINEAR, &suns[0]);
    for (int kind = 0; kind < 3; kind++)
        for (int i = 0; i < 4; i++)
            try_dense(&t, kind, (const double[]){.5, 5, 100, 3000}[i],
                      i % 2 == kind % 2 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST,
                      &suns[(kind + i / 2) % 2]);
    nb_gl_close(&t.gl);
}

/* ---- point lights ----------------------------------------------------------------------------------- */

/* A ball in the puff and a spot beside it that shines through it. */
static nebel_lighting *commit_point_lit(const nebel_volume_desc *volumes, size_t count)
{
    const nebel_light point_lights[2] = {{.position = {1, -.5, .8}, .intensity = {9, 6, 3}, .radius = .1},
                                         {.type = NEBEL_LIGHT_SPOT,
                                          .position = {-9, 3, 2},
                                          .intensity = {200, 250, 300},
                                          .direction = {9, -2.5, -2},
                                          .inner_angle = 20,
                                          .outer_angle = 40}};
    const nebel_lighting_desc lights = {
        .environment = {.radiance = {.1, .12, .15}}, .lights = point_lights, .light_count = 2};
    return fog_light(&lights, volumes, count);
}

static void test_point_lit_puff(void **unused)
{
    (void)unused;
    for (int i = 0; i < (tries_all ? 4 : 2); i++) {
        nebel_grid *grid = make_puff(i % 2 == 0 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST);
        const nebel_volume_desc volumes[] = {cloud_of(grid, i < 2 ? 2 : .4),
                                             {.extinction = {.02, .02, .03}, .albedo = {.9, .9, .9}}};
        nebel_lighting *lighting = commit_point_lit(volumes, i == 0 ? 1 : 2);
        const double *eye = i == 0 ? amid : before;
        camera_rays(eye, origin, (uint64_t)i);
        keep_rays(tries_all ? RAYS : 192, eye);
        trace_packed(lighting, eye, 1, i % 2 == 0 ? "point-lit puff" : "point-lit puff of nearest voxels",
                     i % 2 == 0 ? NB_GL_300ES : NB_GL_330);
        nebel_release_lighting(lighting);
        nebel_release_grid(grid);
    }
}

int main(int argc, char **argv)
{
    (void)argv;
    tries_all = argc > 1;
    if (argc > 2) cmocka_set_test_filter(argv[2]);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_grids),
                                       cmocka_unit_test(test_point_lit_puff),
                                       cmocka_unit_test(test_sunlit_puff),
                                       cmocka_unit_test(test_sunlit_dense_voxels),
                                       cmocka_unit_test(test_sunlit_noise_among_others),
                                       cmocka_unit_test(test_sunlit_random_grids)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
