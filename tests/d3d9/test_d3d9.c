/* Direct3D 9 as an oracle: nebel's factors, its specular alpha and the facts recorded on Windows beside what a device
 * of this system draws. In Wine that is wined3d, which differs from Windows in what d3d9_fact calls wined3d_differs,
 * and adds specular colours to more than 1 before fog, which nothing here does. Pixels have their centres at whole
 * numbers. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "../d3d9_facts.h"
#include "../fog_help.h"
#include "device.h"

enum { RED = 0xff0000, GREEN = 0x00ff00, BLUE = 0x0000ff };

/* Half a step of a byte, and what wined3d's floats may add; and of a picture in floats. */
static const double half_byte = .5 / 255 + 1e-6, float_noise = 4e-5;

static d3d9_device floats, bytes;

static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static uint32_t specular_of(double alpha)
{
    return (uint32_t)(alpha * 255 + .5) << 24;
}

/* ---- the recorded facts ---------------------------------------------------------------------- */

static void set_camera(const d3d9_device *d, const d3d9_quad *quad)
{
    float world[16], projection[16];
    memcpy(world, identity, sizeof world);
    memcpy(projection, identity, sizeof projection);
    world[14] = (float)quad->world;
    projection[14] = (float)quad->projection;
    d3d9_set_matrix(d, D3DTS_WORLD, world);
    d3d9_set_matrix(d, D3DTS_VIEW, identity);
    d3d9_set_matrix(d, D3DTS_PROJECTION, projection);
}

static void draw_transformed(const d3d9_device *d, const d3d9_quad *quad, uint32_t color)
{
    const float side = D3D9_SIZE;
    d3d9_pixel_vertex strip[4];
    for (int i = 0; i < 4; i++)
        strip[i] = (d3d9_pixel_vertex){{i / 2 ? side : 0, i % 2 ? side : 0, (float)quad->z[i / 2], (float)quad->rhw},
                                       color,
                                       specular_of(quad->alpha[i / 2])};
    d3d9_draw(d, D3D9_PIXEL_VERTEX, sizeof *strip, strip, 4);
}

static void draw_quad(const d3d9_device *d, const d3d9_fact *fact, IDirect3DVertexShader9 *shader)
{
    const d3d9_quad *quad = &fact->quad;
    const uint32_t color = (uint32_t)fact->object | 0xff000000;
    const float fog_register[4] = {(float)quad->fog_register};
    d3d9_vertex strip[4];
    for (int i = 0; i < 4; i++)
        strip[i] = (d3d9_vertex){
            {i / 2 ? 1 : -1, i % 2 ? -1 : 1, (float)quad->z[i / 2]}, color, specular_of(quad->alpha[i / 2])};
    d3d9_set_fog(d, &fact->fog);
    set_camera(d, quad);
    D3D9_REQUIRE(
        IDirect3DDevice9_SetRenderState(d->device, D3DRS_SHADEMODE, quad->is_flat ? D3DSHADE_FLAT : D3DSHADE_GOURAUD));
    D3D9_REQUIRE(IDirect3DDevice9_SetVertexShader(d->device, shader));
    D3D9_REQUIRE(IDirect3DDevice9_SetVertexShaderConstantF(d->device, 0, fog_register, 1));
    if (quad->source == NEBEL_D3D9_TRANSFORMED)
        draw_transformed(d, quad, color);
    else
        d3d9_draw(d, D3D9_VERTEX, sizeof *strip, strip, 4);
    D3D9_REQUIRE(IDirect3DDevice9_SetVertexShader(d->device, NULL));
}

/* wined3d computes the fog of vertices anew for each pixel: nebel, which interpolates as Windows does, says the same
 * where the quad is level. */
static int is_comparable(const d3d9_fact *fact)
{
    const int of_vertices = fact->quad.source == NEBEL_D3D9_FIXED && fact->fog.fog_table_mode == NEBEL_D3DFOG_NONE &&
                            fact->fog.fog_vertex_mode != NEBEL_D3DFOG_NONE;
    return !of_vertices || fact->quad.z[0] == fact->quad.z[1];
}

/* What the device makes of the fact against what was recorded, and against nebel's factor at the same pixel. */
static void check_fact(const d3d9_fact *fact, IDirect3DVertexShader9 *shader)
{
    d3d9_picture picture;
    draw_quad(&bytes, fact, shader);
    d3d9_read(&bytes, &picture);
    const int x = fact->probe < 1 ? (int)(fact->probe * D3D9_SIZE) : D3D9_SIZE - 1;
    const float *pixel = picture.pixels[D3D9_SIZE / 2][x];
    const double f = d3d9_factor_of(&fact->fog, &fact->quad, (double)x / D3D9_SIZE);
    const int own = d3d9_color_of(&fact->fog, fact->object, f);
    for (int c = 0; c < 3; c++) {
        const int drawn = (int)(pixel[c] * 255 + .5f);
        const int wanted = fact->wanted >> (16 - 8 * c) & 255, found = own >> (16 - 8 * c) & 255;
        if (abs(drawn - wanted) > fact->most || (is_comparable(fact) && abs(drawn - found) > 1))
            fail_msg("%s, table %u, vertex %u, channel %d: drawn %d, recorded %d, nebel %d\n", fact->test,
                     (unsigned)fact->fog.fog_table_mode, (unsigned)fact->fog.fog_vertex_mode, c, drawn, wanted, found);
    }
}

static void test_facts_recorded_on_windows(void **state)
{
    (void)state;
    int left_out = 0;
    for (size_t i = 0; i < d3d9_fact_count; i++) {
        left_out += d3d9_facts[i].wined3d_differs;
        if (!d3d9_facts[i].wined3d_differs)
            check_fact(&d3d9_facts[i], d3d9_facts[i].quad.source == NEBEL_D3D9_SHADER ? bytes.without_fog : NULL);
    }
    print_message("%d of %d facts left out\n", left_out, (int)d3d9_fact_count);
}

static void test_ramps_recorded_on_windows(void **state)
{
    (void)state;
    for (int i = 0; i < D3D9_RAMP_COUNT; i++)
        for (uint32_t mode = d3d9_ramps[i].first_mode; mode <= d3d9_ramps[i].last_mode; mode++)
            for (int step = 0; step < D3D9_RAMP_STEPS; step++) {
                const d3d9_fact fact = {.test = "fog_with_shader",
                                        .fog = d3d9_ramp_fog(&d3d9_ramps[i], mode),
                                        .quad = d3d9_ramp_quad(&d3d9_ramps[i], step),
                                        .object = D3D9_RAMP_OBJECT,
                                        .probe = .5,
                                        .wanted = d3d9_ramps[i].wanted[step],
                                        .most = D3D9_RAMP_MOST};
                check_fact(&fact, fact.quad.source == NEBEL_D3D9_SHADER ? bytes.with_fog : NULL);
            }
}

/* ---- ProcessVertices ------------------------------------------------------------------------- */

enum { MOST_PROCESSED = 1000 };

static IDirect3DVertexBuffer9 *make_buffer(const d3d9_device *d, size_t size, DWORD format)
{
    IDirect3DVertexBuffer9 *buffer = NULL;
    D3D9_REQUIRE(
        IDirect3DDevice9_CreateVertexBuffer(d->device, (UINT)size, 0, format, D3DPOOL_SYSTEMMEM, &buffer, NULL));
    return buffer;
}

/* Transforms and fogs `count` vertices as the device is set. */
static void process(const d3d9_device *d, const d3d9_vertex *vertices, UINT count, d3d9_pixel_vertex *processed)
{
    IDirect3DVertexBuffer9 *from = make_buffer(d, count * sizeof *vertices, D3D9_VERTEX);
    IDirect3DVertexBuffer9 *to = make_buffer(d, count * sizeof *processed, D3D9_PIXEL_VERTEX);
    void *memory;
    D3D9_REQUIRE(IDirect3DVertexBuffer9_Lock(from, 0, 0, &memory, 0));
    memcpy(memory, vertices, count * sizeof *vertices);
    D3D9_REQUIRE(IDirect3DVertexBuffer9_Unlock(from));
    D3D9_REQUIRE(IDirect3DDevice9_SetFVF(d->device, D3D9_VERTEX));
    D3D9_REQUIRE(IDirect3DDevice9_SetStreamSource(d->device, 0, from, 0, sizeof *vertices));
    D3D9_REQUIRE(IDirect3DDevice9_ProcessVertices(d->device, 0, 0, count, to, NULL, 0));
    D3D9_REQUIRE(IDirect3DVertexBuffer9_Lock(to, 0, 0, &memory, D3DLOCK_READONLY));
    memcpy(processed, memory, count * sizeof *processed);
    D3D9_REQUIRE(IDirect3DVertexBuffer9_Unlock(to));
    D3D9_REQUIRE(IDirect3DDevice9_SetStreamSource(d->device, 0, NULL, 0, 0));
    IDirect3DVertexBuffer9_Release(from);
    IDirect3DVertexBuffer9_Release(to);
}

/* Turned about y and moved; exact in float. */
static const float view[16] = {.6f, 0, .8f, 0, 0, 1, 0, 0, -.8f, 0, .6f, 0, .5f, -.25f, 3, 1};

static void to_camera(const float place[3], double out[3])
{
    for (int k = 0; k < 3; k++) {
        out[k] = (double)view[12 + k];
        for (int i = 0; i < 3; i++) out[k] += (double)place[i] * (double)view[4 * i + k];
    }
}

/* The worst distance of a byte to 255 f, in bytes. */
static double worst_of(const nebel_d3d9_fog *fog, const d3d9_vertex *vertices, const d3d9_pixel_vertex *processed)
{
    double worst = 0;
    for (int i = 0; i < MOST_PROCESSED; i++) {
        nebel_d3d9_vertex vertex = {.specular_alpha = (vertices[i].specular >> 24) / 255.};
        to_camera(vertices[i].place, vertex.position);
        const double f = nebel_compute_d3d9_vertex_factor(fog, &vertex);
        worst = fmax(worst, fabs((processed[i].specular >> 24) - 255 * f));
    }
    return worst;
}

/* start == end is left out: here wined3d makes a step of it, though it draws f = 0 as Windows does. */
static void test_process_vertices_has_the_same_factors(void **state)
{
    (void)state;
    static d3d9_vertex vertices[MOST_PROCESSED];
    static d3d9_pixel_vertex processed[MOST_PROCESSED];
    static const float ends[][2] = {{2, 10}, {0, 1}, {12, 3}, {4, 6}};
    uint64_t seed = 9;
    for (int i = 0; i < MOST_PROCESSED; i++)
        vertices[i] = (d3d9_vertex){{(float)dice(&seed, -8, 8), (float)dice(&seed, -8, 8), (float)dice(&seed, -8, 8)},
                                    0xff000000 | RED,
                                    specular_of(dice(&seed, 0, 1))};
    d3d9_set_matrix(&bytes, D3DTS_WORLD, identity);
    d3d9_set_matrix(&bytes, D3DTS_VIEW, view);
    d3d9_set_matrix(&bytes, D3DTS_PROJECTION, identity);
    for (uint32_t mode = NEBEL_D3DFOG_NONE; mode <= NEBEL_D3DFOG_LINEAR; mode++)
        for (uint32_t i = 0; i < 8; i++) {
            const nebel_d3d9_fog fog = {1,    GREEN, 0, mode, ends[i / 2][0], ends[i / 2][1], .04f * (float)(i / 2 + 1),
                                        i % 2};
            d3d9_set_fog(&bytes, &fog);
            process(&bytes, vertices, MOST_PROCESSED, processed);
            const double worst = worst_of(&fog, vertices, processed);
            print_message("mode %u, range %u, set %u: at most %.4f of a byte\n", mode, i % 2, i / 2, worst);
            assert_true(worst <= 255 * half_byte);
        }
}

static void test_vertices_recorded_on_windows(void **state)
{
    (void)state;
    static const float half[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, .5f, 0, 0, 0, 0, 1};
    static const float three_quarters[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, .75f, 0, 0, 0, 0, 1};
    const d3d9_vertex vertex = {{.5f, 0, 1}, 0xff000000 | RED, specular_of(.5)};
    d3d9_set_matrix(&bytes, D3DTS_WORLD, three_quarters);
    d3d9_set_matrix(&bytes, D3DTS_VIEW, half);
    d3d9_set_matrix(&bytes, D3DTS_PROJECTION, identity);
    for (int i = 0; i < D3D9_VERTEX_FACT_COUNT; i++)
        for (uint32_t table = 0; table <= NEBEL_D3DFOG_LINEAR; table++) {
            const d3d9_vertex_fact *fact = &d3d9_vertex_facts[i];
            const nebel_d3d9_fog fog = {1, GREEN, table, fact->vertex_mode, 0, 1, 1, fact->range};
            d3d9_pixel_vertex processed;
            d3d9_set_fog(&bytes, &fog);
            process(&bytes, &vertex, 1, &processed);
            assert_in_range((int)(processed.specular >> 24), fact->wanted - 1, fact->wanted + 1);
        }
}

/* ---- specular alpha -------------------------------------------------------------------------- */

static const double fog_rgb[3] = {0, 0, 1};
static const uint32_t object_color = 0xffff8040;

static void expect_blend(const float *pixel, double f, double most)
{
    const float surface[4] = {1, 128 / 255.f, 64 / 255.f, 1};
    float wanted[4];
    nebel_blend_fog_factor(f, surface, fog_rgb, wanted);
    for (int c = 0; c < 4; c++)
        if (!(fabs((double)(pixel[c] - wanted[c])) <= most))
            fail_msg("channel %d: drawn %.6f, wanted %.6f, f %.6f\n", c, (double)pixel[c], (double)wanted[c], f);
}

/* Every byte of specular alpha is the factor, whatever FOGVERTEXMODE says. */
static void test_specular_alpha_is_the_factor(void **state)
{
    (void)state;
    for (int alpha = 0; alpha < 256; alpha += 3) {
        const d3d9_device *const devices[] = {&floats, &bytes};
        const nebel_d3d9_fog fog = {1, BLUE, 0, (uint32_t)alpha % 4, 0, .25f, 1, (uint32_t)alpha % 2};
        const nebel_d3d9_vertex vertex = {NEBEL_D3D9_TRANSFORMED, .specular_alpha = alpha / 255.};
        const d3d9_quad quad = {.z = {.5, .5}, .rhw = 1, .alpha = {alpha / 255., alpha / 255.}};
        for (int i = 0; i < 2; i++) {
            d3d9_picture picture;
            d3d9_set_fog(devices[i], &fog);
            draw_transformed(devices[i], &quad, object_color);
            d3d9_read(devices[i], &picture);
            expect_blend(picture.pixels[20][40], nebel_compute_d3d9_vertex_factor(&fog, &vertex),
                         i == 0 ? float_noise : half_byte);
        }
    }
}

/* ---- range fog ------------------------------------------------------------------------------- */

/* A quad across the axis whose corners are equally far from the eye, so that nothing is left to interpolation. */
static void draw_across(const d3d9_device *d, float z, float half_side)
{
    d3d9_vertex strip[4];
    const float projection[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, -.1f, 0};
    for (int i = 0; i < 4; i++)
        strip[i] = (d3d9_vertex){{i / 2 ? half_side : -half_side, i % 2 ? -half_side : half_side, z}, object_color, 0};
    d3d9_set_matrix(d, D3DTS_WORLD, identity);
    d3d9_set_matrix(d, D3DTS_VIEW, identity);
    d3d9_set_matrix(d, D3DTS_PROJECTION, projection);
    d3d9_draw(d, D3D9_VERTEX, sizeof *strip, strip, 4);
}

static void test_range_fog_draws_the_distance_of_vertices(void **state)
{
    (void)state;
    static const float places[][2] = {{1, 1}, {1, 3}, {3, .5f}, {3, 4}, {5, 2}, {7.5f, 9}};
    for (uint32_t mode = NEBEL_D3DFOG_EXP; mode <= NEBEL_D3DFOG_LINEAR; mode++)
        for (uint32_t i = 0; i < 12; i++) {
            const float z = places[i / 2][0], half_side = places[i / 2][1];
            const nebel_d3d9_fog fog = {1, BLUE, 0, mode, 2, 10, .2f, i % 2};
            const nebel_d3d9_vertex vertex = {.position = {(double)half_side, (double)half_side, (double)z}};
            d3d9_picture picture;
            d3d9_set_fog(&floats, &fog);
            draw_across(&floats, z, half_side);
            d3d9_read(&floats, &picture);
            expect_blend(picture.pixels[D3D9_SIZE / 2][D3D9_SIZE / 2], nebel_compute_d3d9_vertex_factor(&fog, &vertex),
                         float_noise);
        }
}

/* ---- fog volumes ----------------------------------------------------------------------------- */

enum { GRID = 9, STEP = D3D9_SIZE / (GRID - 1) };

static nebel_snapshot *make_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, .5, 8}, .radius = 3}, .extinction = {.4, .4, .4}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, -9, 5}, .max = {9, -1, 20}}, .extinction = {.1, .1, .1}}};
    return fog_commit(&(nebel_fog_desc){0}, volumes, 2);
}

/* A wall at z = 12 in a grid whose vertices fall on pixels; x and y go from -6 to 6. */
static void make_wall(float (*places)[3], d3d9_pixel_vertex *vertices)
{
    for (int i = 0; i < GRID * GRID; i++) {
        const float x = (float)(i % GRID * STEP), y = (float)(i / GRID * STEP);
        places[i][0] = (x / D3D9_SIZE - .5f) * 12;
        places[i][1] = (.5f - y / D3D9_SIZE) * 12;
        places[i][2] = 12;
        vertices[i] = (d3d9_pixel_vertex){{x, y, .5f, 1 / 12.f}, object_color, 0x00112233};
    }
}

static void draw_wall(const d3d9_device *d, const d3d9_pixel_vertex *vertices)
{
    static d3d9_pixel_vertex strip[2 * GRID * (GRID - 1) + 2 * (GRID - 2)];
    size_t count = 0;
    for (int row = 0; row + 1 < GRID; row++) {
        if (row > 0) strip[count++] = vertices[row * GRID]; /* twice, and the last before: no area between the rows */
        for (int x = 0; x < GRID; x++) {
            strip[count++] = vertices[row * GRID + x];
            strip[count++] = vertices[(row + 1) * GRID + x];
        }
        if (row + 2 < GRID) strip[count++] = vertices[(row + 1) * GRID + GRID - 1];
    }
    d3d9_draw(d, D3D9_PIXEL_VERTEX, sizeof *strip, strip, count);
}

/* nebel_compute_vertex_fog writes alpha; the device draws at each vertex what nebel_trace says in double. */
static void test_fog_volumes_arrive_through_specular_alpha(void **state)
{
    (void)state;
    static float places[GRID * GRID][3];
    static d3d9_pixel_vertex vertices[GRID * GRID];
    nebel_snapshot *fog = make_fog();
    make_wall(places, vertices);
    const nebel_vertices points = {.positions = places};
    const nebel_vertex_output alpha = {NEBEL_VERTEX_SPECULAR_ALPHA, &vertices[0].specular, sizeof *vertices};
    assert_int_equal(nebel_compute_vertex_fog(fog, NULL, GRID * GRID, &points, &alpha, 1), NEBEL_OK);
    d3d9_picture picture;
    d3d9_set_fog(&floats, &(nebel_d3d9_fog){.fog_enable = 1, .fog_color = BLUE});
    draw_wall(&floats, vertices);
    d3d9_read(&floats, &picture);
    int foggy = 0;
    for (int i = 0; i < GRID * GRID; i++) {
        if (i % GRID == GRID - 1 || i / GRID == GRID - 1) continue; /* on the edge of the picture */
        const double x = (double)places[i][0], y = (double)places[i][1], z = (double)places[i][2];
        const nebel_ray ray = {.direction = {x, y, z}, .t_max = sqrt(x * x + y * y + z * z)};
        nebel_transfer transfer;
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        expect_blend(picture.pixels[i / GRID * STEP][i % GRID * STEP], transfer.transmittance[0],
                     half_byte + float_noise);
        foggy += transfer.transmittance[0] < .9;
        assert_int_equal(vertices[i].specular & 0xffffff, 0x112233);
    }
    assert_true(foggy > 10);
    nebel_release_snapshot(fog);
}

/* ---- the processor --------------------------------------------------------------------------- */

/* CreateDevice without D3DCREATE_FPU_PRESERVE sets the x87 unit to 24 bits; nebel in double has the same bits before
 * and after. */
static void test_a_device_takes_no_digits(void **state)
{
    (void)state;
    enum { RAYS = 100 };
    nebel_snapshot *fog = make_fog();
    nebel_ray rays[RAYS];
    nebel_transfer transfers[2][RAYS];
    uint64_t seed = 4;
    memset(transfers, 0, sizeof transfers);
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){.direction = {dice(&seed, -.3, .3), dice(&seed, -.3, .3), 1}, .t_max = HUGE_VAL};
    unsigned short word[2];
    for (int i = 0; i < 2; i++) {
        d3d9_device another;
        if (i == 0) __asm__ volatile("fninit");
        if (i == 1) d3d9_open(&another, D3DFMT_A8R8G8B8);
        __asm__ volatile("fnstcw %0" : "=m"(word[i]));
        assert_int_equal(
            nebel_trace(fog, &(nebel_trace_desc){0}, RAYS, rays, sizeof *rays, transfers[i], sizeof *transfers[i]),
            NEBEL_OK);
        if (i == 1) d3d9_close(&another);
    }
    print_message("x87 control word %x, with a device %x\n", word[0], word[1]);
    assert_memory_equal(transfers[0], transfers[1], sizeof transfers[0]);
    nebel_release_snapshot(fog);
}

static void test_devices_open(void **state)
{
    (void)state;
    d3d9_open(&floats, D3DFMT_A32B32G32R32F);
    d3d9_open(&bytes, D3DFMT_A8R8G8B8);
}

static void test_devices_close(void **state)
{
    (void)state;
    d3d9_close(&bytes);
    d3d9_close(&floats);
}

int main(void)
{
    const struct CMUnitTest first[] = {cmocka_unit_test(test_devices_open)};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_facts_recorded_on_windows),
        cmocka_unit_test(test_ramps_recorded_on_windows),
        cmocka_unit_test(test_vertices_recorded_on_windows),
        cmocka_unit_test(test_process_vertices_has_the_same_factors),
        cmocka_unit_test(test_specular_alpha_is_the_factor),
        cmocka_unit_test(test_range_fog_draws_the_distance_of_vertices),
        cmocka_unit_test(test_fog_volumes_arrive_through_specular_alpha),
        cmocka_unit_test(test_a_device_takes_no_digits),
        cmocka_unit_test(test_devices_close),
    };
    if (cmocka_run_group_tests(first, NULL, NULL) != 0) return 1;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
