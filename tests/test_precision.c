/* Answers do not hang on how many bits the thread's x87 unit is set to round to: Windows starts threads with 53, and
 * Direct3D 9 leaves 24 behind, where the double precision of the library counts on 64. */
#include "random_fog.h"

#include <nebel/particles.h>
#include <nebel/shader.h>

#include <float.h>
#include <math.h>

#include "fog_help.h"

enum { RAYS = 200, WORDS = 20000, PARTICLES = 100 };

/* All that the library computes in long double. */
typedef struct answers {
    nebel_transfer transfers[2][RAYS]; /* in double, in float */
    double distances[RAYS];
    nebel_texel_f32 words[WORDS];
    nebel_particle particles[PARTICLES];
} answers;

static void ask(const random_fog *fog, const nebel_ray rays[RAYS], answers *got)
{
    memset(got, 0, sizeof *got);
    const nebel_lighting_desc lights = {.environment = {.radiance = {1, 1, 1}}};
    nebel_lighting *lighting = fog_light(&lights, fog->volumes, fog->count);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    for (int k = 0; k < 2; k++) {
        const nebel_trace_desc how = {.lighting = lighting,
                                      .precision = k == 0 ? NEBEL_PRECISION_DOUBLE : NEBEL_PRECISION_FLOAT};
        nebel_trace(snapshot, &how, RAYS, rays, sizeof *rays, got->transfers[k], sizeof *got->transfers[k]);
    }
    nebel_invert_transmittance(snapshot, 0.5, 0, RAYS, rays, sizeof *rays, got->distances);
    const double eye[] = {1 / 3.0, 2 / 7.0, 3 / 11.0};
    size_t count = 0;
    assert_int_equal(nebel_pack_fog(lighting, eye, got->words, WORDS, &count), NEBEL_OK);
    nebel_release_lighting(lighting);
    const nebel_nebula_desc nebula = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1 / 3.0},
                                      .density = {.type = NEBEL_DENSITY_RADIAL, .power = 2},
                                      .count = PARTICLES,
                                      .seed = fog->seed};
    assert_int_equal(nebel_generate_nebula(&nebula, got->particles), NEBEL_OK);
}

#if (defined(__x86_64__) || defined(__i386__)) && LDBL_MANT_DIG == 64

static unsigned control_word(void)
{
    unsigned short word;
    __asm__ volatile("fnstcw %0" : "=m"(word) : : "memory");
    return word;
}

static void set_control_word(unsigned setting)
{
    const unsigned short word = (unsigned short)setting;
    __asm__ volatile("fldcw %0" : : "m"(word) : "memory");
}

static void test_bits_do_not_hang_on_the_threads_precision(void **state)
{
    (void)state;
    static random_fog fog;
    static answers full, asked;
    const unsigned usual = control_word(), settings[] = {0x27f, 0x7f};
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        random_fog_make(&fog, (random_fog_kind)kind, 7);
        nebel_ray rays[RAYS];
        for (size_t i = 0; i < RAYS; i++) rays[i] = random_fog_ray(&fog, i);
        ask(&fog, rays, &full);
        for (int i = 0; i < 2; i++) {
            set_control_word(settings[i]);
            ask(&fog, rays, &asked);
            const unsigned left = control_word();
            set_control_word(usual);
            assert_int_equal(left, settings[i]);
            assert_memory_equal(&asked, &full, sizeof full);
        }
    }
}

#else

static void test_bits_do_not_hang_on_the_threads_precision(void **state)
{
    (void)state;
    (void)ask;
    skip();
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bits_do_not_hang_on_the_threads_precision)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
