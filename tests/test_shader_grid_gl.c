/* Voxels in shaders against nebel_trace in double. */
#include "random_grid.h"
#include "shader_help.h"

/* Voxels beside everything else: of other light, covered and covering, behind distances, far away. */
static void try_grids(nb_gl_language language, uint64_t first)
{
    tracer t;
    open_tracer(&t, language, TEXTURE, "#define NEBEL_VOXELS\n", trace_body);
    for (uint64_t seed = first; seed < first + 6; seed++) {
        nebel_grid *grids[RANDOM_GRIDS];
        random_grids_make(&fog, (random_fog_kind)(seed % 6 + (seed % 6 >= RANDOM_FOG_MANY)), seed, grids);
        try_fog(&t, "grids", seed);
        random_grids_release(grids);
    }
    nb_gl_close(&t.gl);
}

static void test_grids(void **unused)
{
    (void)unused;
    try_grids(NB_GL_330, 0);
    try_grids(NB_GL_300ES, 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_grids)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
