/* Fog per vertex: any fog, in any layout, on any instruction set; response curves; and what the printed code of the
 * time has wrong: each such test computes the printed form, too, and shows that it differs. */
#include "random_fog.h"

#include <nebel/classic.h>

#include <math.h>

#include "fog_help.h"

enum { COUNT = 1100 }; /* more than a block, no multiple of any number of lanes */

typedef struct points {
    float at[COUNT][3];
} points;

static points random_points(uint64_t *state, double size)
{
    points p;
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 3; k++) p.at[i][k] = (float)dice(state, -size, size);
    return p;
}

static nebel_volume_desc box_of(double x0, double y0, double z0, double x1, double y1, double z1, double extinction)
{
    return (nebel_volume_desc){
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {x0, y0, z0}, .max = {x1, y1, z1}},
        .extinction = {extinction, extinction, extinction},
        .source = {.9, .2, .55},
    };
}

static nebel_snapshot *commit_box(double x0, double y0, double z0, double x1, double y1, double z1, double extinction)
{
    const nebel_volume_desc box = box_of(x0, y0, z0, x1, y1, z1, extinction);
    return fog_commit(&(nebel_fog_desc){0}, &box, 1);
}

/* The same box where the stream kernel does not see it. */
static nebel_snapshot *commit_turned_box(double half, double extinction)
{
    nebel_volume_desc box = box_of(-half, -half, -half, half, half, half, extinction);
    box.shape.transform.rotation[1] = .5;
    box.shape.transform.rotation[3] = .5;
    return fog_commit(&(nebel_fog_desc){0}, &box, 1);
}

static void fog_points(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc, const nebel_vertices *vertices,
                       nebel_vertex_format format, void *out)
{
    const nebel_vertex_output output = {format, out, 0};
    assert_int_equal(nebel_compute_vertex_fog(snapshot, desc, COUNT, vertices, &output, 1), NEBEL_OK);
}

static float fog_one(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc, const double eye[3],
                     const float point[3])
{
    float out = -7;
    const nebel_vertices vertices = {.positions = point, .eye = {eye[0], eye[1], eye[2]}};
    const nebel_vertex_output output = {NEBEL_VERTEX_FACTOR, &out, 0};
    assert_int_equal(nebel_compute_vertex_fog(snapshot, desc, 1, &vertices, &output, 1), NEBEL_OK);
    return out;
}

/* ---- right, for all fog ---------------------------------------------------------------------- */

static nebel_transfer trace_vertex(const nebel_snapshot *snapshot, const nebel_vertices *v, const float point[3])
{
    nebel_ray ray = {.t_max = 0};
    nebel_transfer transfer;
    double square = 0;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = v->eye[k];
        ray.direction[k] = v->origin[k] + (double)point[k] - v->eye[k];
        square += ray.direction[k] * ray.direction[k];
    }
    ray.t_max = sqrt(square);
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    return transfer;
}

/* The double trace is integrated to the tolerance, too; float rounds lengths of up to 60 m. */
static void test_vertices_in_any_fog_are_what_the_trace_says(void **unused)
{
    (void)unused;
    static random_fog fog;
    static points p;
    static float factor[COUNT], color[COUNT][4];
    uint64_t state = 21;
    for (uint64_t seed = 0; seed < 2 * RANDOM_FOG_KIND_COUNT; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 900 + seed);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        p = random_points(&state, 15);
        nebel_vertices vertices = {.positions = p.at};
        memcpy(vertices.origin, fog.shift, sizeof vertices.origin);
        for (int k = 0; k < 3; k++) vertices.eye[k] = fog.shift[k] + dice(&state, -15, 15);
        const nebel_vertex_desc desc = {.channel = (int)(seed % 3)};
        fog_points(snapshot, &desc, &vertices, NEBEL_VERTEX_FACTOR, factor);
        fog_points(snapshot, &desc, &vertices, NEBEL_VERTEX_RGBA_FLOAT, color);
        for (int i = 0; i < COUNT; i += 7) {
            const nebel_transfer transfer = trace_vertex(snapshot, &vertices, p.at[i]);
            double scale = 1, most = transfer.error + 2 * NEBEL_DEFAULT_TOLERANCE;
            for (int c = 0; c < 3; c++) scale = fmax(scale, transfer.in_scattering[c]);
            assert_true(fabs((double)factor[i] - transfer.transmittance[desc.channel]) <= most);
            assert_true(fabs((double)color[i][3] - (1 - transfer.transmittance[desc.channel])) <= most);
            for (int c = 0; c < 3; c++)
                assert_true(fabs((double)color[i][c] - transfer.in_scattering[c]) <= most * 4 * scale);
        }
        nebel_release_snapshot(snapshot);
    }
}

static void test_boxes_have_the_bits_of_segments(void **unused)
{
    (void)unused;
    uint64_t state = 3;
    const points p = random_points(&state, 15);
    const nebel_volume_desc boxes[] = {box_of(-5, -5, -5, 5, 5, 5, .1), box_of(0, -8, 2, 9, 0, 8, .07),
                                       box_of(-9, -9, -9, 9, -7, 9, .2)};
    for (size_t n = 1; n <= 3; n++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, boxes, n);
        const nebel_vertices vertices = {.positions = p.at, .origin = {1, 2, 3}, .eye = {-10, 5, 12.5}};
        points from;
        for (int i = 0; i < COUNT; i++) memcpy(from.at[i], (const float[3]){-11, 3, 9.5f}, sizeof from.at[i]);
        const nebel_segments segments = {.origin = {1, 2, 3}, .from = from.at[0], .to = p.at[0]};
        float a[COUNT], b[COUNT];
        assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, COUNT, &segments, a, 0),
                         NEBEL_OK);
        fog_points(snapshot, NULL, &vertices, NEBEL_VERTEX_FACTOR, b);
        assert_memory_equal(a, b, sizeof a);
        nebel_release_snapshot(snapshot);
    }
}

/* Boxes that the stream kernel takes for their factors, but not for their light; of colours other than each other's,
 * and an extinction other in each channel. */
static void test_boxes_of_several_colors_have_their_own_light(void **unused)
{
    (void)unused;
    uint64_t state = 8;
    const points p = random_points(&state, 15);
    nebel_volume_desc boxes[] = {box_of(-5, -5, -5, 5, 5, 5, .1), box_of(0, -8, 2, 9, 3, 8, .07)};
    for (int tinted = 0; tinted < 2; tinted++) {
        for (int c = 0; c < 3; c++) {
            boxes[1].source[c] = .2 + .1 * c;
            if (tinted) boxes[0].extinction[c] = .05 + .1 * c;
        }
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, boxes, 2);
        const nebel_vertices vertices = {.positions = p.at, .eye = {-11, 2, 9}};
        for (int channel = 0; channel < 3; channel++) {
            static float factor[COUNT], color[COUNT][4];
            fog_points(snapshot, &(nebel_vertex_desc){.channel = channel}, &vertices, NEBEL_VERTEX_FACTOR, factor);
            fog_points(snapshot, &(nebel_vertex_desc){.channel = channel}, &vertices, NEBEL_VERTEX_RGBA_FLOAT, color);
            for (int i = 0; i < COUNT; i++) {
                const nebel_transfer transfer = trace_vertex(snapshot, &vertices, p.at[i]);
                assert_true(fabs((double)factor[i] - transfer.transmittance[channel]) <= 2e-5);
                assert_true(fabs(1 - (double)color[i][3] - transfer.transmittance[channel]) <= 2e-5);
                for (int c = 0; c < 3; c++) assert_true(fabs((double)color[i][c] - transfer.in_scattering[c]) <= 2e-5);
            }
        }
        nebel_release_snapshot(snapshot);
    }
}

/* ---- formats --------------------------------------------------------------------------------- */

static unsigned char byte_of(double x)
{
    return (unsigned char)(fmin(fmax(x, 0), 1) * 255 + .5);
}

/* Every format from the factors and colours, whichever way those came. */
static void check_formats(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc)
{
    uint64_t state = 4;
    static points p;
    static float factor[COUNT], coordinate[COUNT], color[COUNT][4];
    static unsigned char bytes[COUNT][4], specular[COUNT][4], alpha[COUNT][4];
    p = random_points(&state, 12);
    const nebel_vertices vertices = {.positions = p.at, .eye = {1, 2, 11}};
    memset(specular, 0x5a, sizeof specular);
    memset(alpha, 0xa5, sizeof alpha);
    const nebel_vertex_output outputs[] = {
        {NEBEL_VERTEX_SPECULAR_ALPHA, specular, 0}, {NEBEL_VERTEX_RGBA8, bytes, 0}, {NEBEL_VERTEX_RGBA_FLOAT, color, 0},
        {NEBEL_VERTEX_COORDINATE, coordinate, 0},   {NEBEL_VERTEX_ALPHA, alpha, 0}, {NEBEL_VERTEX_FACTOR, factor, 0}};
    assert_int_equal(nebel_compute_vertex_fog(snapshot, desc, COUNT, &vertices, outputs, 6), NEBEL_OK);
    int partly = 0;
    for (int i = 0; i < COUNT; i++) {
        const double f = (double)factor[i];
        assert_true(f >= 0 && f <= 1);
        partly += f > 0 && f < 1;
        assert_true(fabs((double)coordinate[i] - desc->coordinate_end * (1 - f)) <= 1e-5);
        assert_true(fabs((double)color[i][3] - (1 - f)) <= 1e-7);
        for (int c = 0; c < 4; c++) {
            assert_true(abs(bytes[i][c] - byte_of((double)color[i][c])) <= 0);
            assert_int_equal(specular[i][c], c == 3 ? byte_of(f) : 0x5a);
            assert_int_equal(alpha[i][c], c == 3 ? bytes[i][3] : 0xa5);
        }
        for (int c = 0; c < 3 && desc->color != NULL; c++)
            assert_true(fabs((double)color[i][c] - desc->color[c] * (1 - f)) <= 1e-6);
    }
    assert_true(partly > COUNT / 4);
}

static void test_formats_say_the_same(void **unused)
{
    (void)unused;
    const double color[3] = {.25, 1.5, 0};
    nebel_snapshot *const kinds[] = {commit_box(-6, -6, -6, 6, 6, 6, .1), commit_turned_box(6, .1)};
    for (int kind = 0; kind < 2; kind++) {
        check_formats(kinds[kind], &(nebel_vertex_desc){.coordinate_end = 100});
        check_formats(kinds[kind], &(nebel_vertex_desc){.coordinate_end = 7, .color = color});
        check_formats(kinds[kind],
                      &(nebel_vertex_desc){.coordinate_end = 1, .color = color, .curve = NEBEL_CURVE_EXP2});
        nebel_release_snapshot(kinds[kind]);
    }
}

/* 127.5 becomes 128: the extinction is such that half the light is left, to the bit. */
static void test_halves_are_rounded_upwards(void **unused)
{
    (void)unused;
    const double eye[3] = {0, 0, 0}, color[3] = {1, 1, 1};
    nebel_snapshot *const snapshot = commit_box(-9, -9, -9, 9, 9, 9, log(2));
    const float point[3] = {1, 0, 0};
    unsigned char bytes[4], specular[4] = {1, 2, 3, 4};
    assert_true(fog_one(snapshot, NULL, eye, point) == .5f);
    const nebel_vertices vertices = {.positions = point};
    const nebel_vertex_output outputs[] = {{NEBEL_VERTEX_RGBA8, bytes, 0}, {NEBEL_VERTEX_SPECULAR_ALPHA, specular, 0}};
    assert_int_equal(nebel_compute_vertex_fog(snapshot, &(nebel_vertex_desc){.color = color}, 1, &vertices, outputs, 2),
                     NEBEL_OK);
    for (int c = 0; c < 4; c++) assert_int_equal(bytes[c], 128);
    assert_memory_equal(specular, ((const unsigned char[4]){1, 2, 3, 128}), 4);
    nebel_release_snapshot(snapshot);
}

/* ---- layouts and instruction sets: the same bits --------------------------------------------- */

typedef struct vertex {
    float pad, x, y, z;
    unsigned char color[4], specular[4], alpha[4];
    float coordinate, light[4], factor, tail;
} vertex;

static void fill_vertices(vertex *v, const points *p)
{
    memset(v, 0x33, COUNT * sizeof *v);
    for (int i = 0; i < COUNT; i++) memcpy(&v[i].x, p->at[i], sizeof p->at[i]);
}

static void fog_structures(const nebel_snapshot *snapshot, nebel_isa isa, vertex *v, size_t first, size_t n)
{
    const nebel_vertices vertices = {.positions = &v[first].x, .position_stride = sizeof *v, .eye = {1, 2, 11}};
    const nebel_vertex_output outputs[] = {{NEBEL_VERTEX_FACTOR, &v[first].factor, sizeof *v},
                                           {NEBEL_VERTEX_COORDINATE, &v[first].coordinate, sizeof *v},
                                           {NEBEL_VERTEX_RGBA_FLOAT, v[first].light, sizeof *v},
                                           {NEBEL_VERTEX_RGBA8, v[first].color, sizeof *v},
                                           {NEBEL_VERTEX_SPECULAR_ALPHA, v[first].specular, sizeof *v},
                                           {NEBEL_VERTEX_ALPHA, v[first].alpha, sizeof *v}};
    assert_int_equal(nebel_compute_vertex_fog(snapshot, &(nebel_vertex_desc){.isa = isa}, n, &vertices, outputs, 6),
                     NEBEL_OK);
}

static void assert_same_as_packed(const nebel_snapshot *snapshot, const points *p, const vertex *v)
{
    static float factor[COUNT], coordinate[COUNT], light[COUNT][4];
    static unsigned char color[COUNT][4];
    const nebel_vertices vertices = {.positions = p->at, .eye = {1, 2, 11}};
    const nebel_vertex_desc scalar = {.isa = NEBEL_ISA_SCALAR};
    fog_points(snapshot, &scalar, &vertices, NEBEL_VERTEX_FACTOR, factor);
    fog_points(snapshot, &scalar, &vertices, NEBEL_VERTEX_COORDINATE, coordinate);
    fog_points(snapshot, &scalar, &vertices, NEBEL_VERTEX_RGBA_FLOAT, light);
    fog_points(snapshot, &scalar, &vertices, NEBEL_VERTEX_RGBA8, color);
    for (int i = 0; i < COUNT; i++) {
        vertex wanted;
        memset(&wanted, 0x33, sizeof wanted);
        memcpy(&wanted.x, p->at[i], sizeof p->at[i]);
        wanted.factor = factor[i];
        wanted.coordinate = coordinate[i];
        memcpy(wanted.light, light[i], sizeof wanted.light);
        memcpy(wanted.color, color[i], sizeof wanted.color);
        wanted.specular[3] = byte_of((double)factor[i]);
        wanted.alpha[3] = color[i][3];
        assert_memory_equal(&v[i], &wanted, sizeof wanted);
    }
}

static void test_structures_splits_and_instruction_sets_change_no_bit(void **unused)
{
    (void)unused;
    static random_fog fog;
    static points p;
    static vertex v[COUNT];
    uint64_t state = 5;
    for (uint64_t seed = 0; seed < 6; seed++) {
        random_fog_make(&fog, seed % 2 ? RANDOM_FOG_PROFILES : RANDOM_FOG_OVERLAP, seed);
        nebel_snapshot *const snapshot = seed < 3 ? commit_box(-6, -6, -6, 6, 6, 6, .05 + .1 * (double)seed)
                                                  : fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        p = random_points(&state, 12);
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            fill_vertices(v, &p);
            fog_structures(snapshot, (nebel_isa)isa, v, 0, COUNT);
            assert_same_as_packed(snapshot, &p, v);
            fill_vertices(v, &p);
            for (size_t first = 0; first < COUNT;) {
                const size_t some = 1 + (size_t)dice_below(&state, 200),
                             n = COUNT - first < some ? COUNT - first : some;
                fog_structures(snapshot, (nebel_isa)isa, v, first, n);
                first += n;
            }
            assert_same_as_packed(snapshot, &p, v);
        }
        nebel_release_snapshot(snapshot);
    }
}

/* ---- curves ---------------------------------------------------------------------------------- */

/* The extinction of the volume is the k of the curve. */
static void test_curves_are_those_of_the_length_inside(void **unused)
{
    (void)unused;
    float table[NEBEL_CURVE_ENTRIES];
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) table[i] = sqrtf((float)i / 255);
    for (int type = 0; type < NEBEL_CURVE_COUNT; type++) {
        nebel_curve curve;
        assert_int_equal(nebel_resolve_curve(&(nebel_curve){.type = (nebel_curve_type)type, .table = table}, &curve),
                         NEBEL_OK);
        nebel_snapshot *const kinds[] = {commit_box(-40, -1, -1, 40, 1, 1, curve.scale),
                                         commit_box(-1, -1, -40, 1, 1, 40, curve.scale)};
        const nebel_vertex_desc desc = {.curve = curve.type, .table = table};
        for (int kind = 0; kind < 2; kind++) {
            const double eye[3] = {kind ? 0 : -50, 0, kind ? -50 : 0};
            for (double end = -45; end < 60; end += .25) {
                const float point[3] = {kind ? 0 : (float)end, 0, kind ? (float)end : 0};
                const double inside = fmax(0, fmin(end, 40) + 40);
                const double wanted = 1 - nebel_compute_curve_weight(&curve, inside);
                const double most = type == NEBEL_CURVE_TABLE ? 1e-4 : 3e-6; /* the root is steep at 0 */
                assert_true(fabs((double)fog_one(kinds[kind], &desc, eye, point) - wanted) <= most);
            }
            nebel_release_snapshot(kinds[kind]);
        }
    }
}

static void test_a_table_ends_with_its_last_entry(void **unused)
{
    (void)unused;
    float table[NEBEL_CURVE_ENTRIES] = {0};
    table[255] = 1;
    const double eye[3] = {0, 0, 0};
    nebel_snapshot *const snapshot = commit_box(-9, -9, -9, 9, 9, 9, 1);
    for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        const nebel_vertex_desc desc = {.isa = (nebel_isa)isa, .curve = NEBEL_CURVE_TABLE, .table = table};
        assert_true(fog_one(snapshot, &desc, eye, (const float[3]){1.001f, 0, 0}) == 0);
        assert_true(fog_one(snapshot, &desc, eye, (const float[3]){.99f, 0, 0}) == 1);
        assert_true(fabsf(fog_one(snapshot, &desc, eye, (const float[3]){254.5f / 255, 0, 0}) - .5f) < 1e-3f);
    }
    nebel_release_snapshot(snapshot);
}

/* Where bodies of a union overlap the fog counts once. */
static void test_bodies_put_together_count_once(void **unused)
{
    (void)unused;
    const nebel_shape parts[] = {{.type = NEBEL_SHAPE_BOX, .min = {-3, -1, -1}, .max = {1, 1, 1}},
                                 {.type = NEBEL_SHAPE_SPHERE, .center = {1, 0, 0}, .radius = 2},
                                 {.type = NEBEL_SHAPE_CYLINDER, .from = {2, 0, 0}, .to = {5, 0, 0}, .radius = 1}};
    const nebel_volume_desc body = {.shape = {.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 3},
                                    .extinction = {.05, .05, .05}};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &body, 1);
    const double eye[3] = {-10, 0, 0};
    const float f =
        fog_one(snapshot, &(nebel_vertex_desc){.curve = NEBEL_CURVE_LINEAR}, eye, (const float[3]){10, 0, 0});
    assert_true(fabsf(f - (1 - .05f * 8)) < 1e-5f);
    nebel_release_snapshot(snapshot);
}

/* ---- what was printed wrong ------------------------------------------------------------------ */

/* From both ends of a ray in units of its length, as printed: all that lies before the vertex counts, also what is
 * behind the camera. */
static double distance_as_printed(double in, double out, double end)
{
    if (out < 0 || in > end) return 0;
    return out < end ? out - in : end - fmax(in, 0);
}

static void test_a_camera_in_the_fog_does_not_see_what_is_behind_it(void **unused)
{
    (void)unused;
    const double k = .05, eye[3] = {-2, 0, 0};
    nebel_snapshot *const snapshot = commit_box(-8, -1, -1, 5, 1, 1, k);
    const nebel_vertex_desc linear = {.curve = NEBEL_CURVE_LINEAR};
    const struct {
        float x;
        double right;
    } cases[] = {{20, 7} /* camera inside, vertex beyond */, {3, 5} /* both inside */, {-2, 0}};
    for (int i = 0; i < 3; i++) {
        const float f = fog_one(snapshot, &linear, eye, (const float[3]){cases[i].x, 0, 0});
        assert_true(fabs((1 - (double)f) / k - cases[i].right) < 1e-4);
    }
    assert_true(distance_as_printed(-6, 7, 22) == 13); /* too long by what lies behind the camera */
    const float beyond = fog_one(snapshot, &linear, eye, (const float[3]){20, 0, 0});
    assert_true(fabs((1 - (double)beyond) / k - distance_as_printed(-6, 7, 22)) > 5);
    const double outside[3] = {-20, 0, 0}, behind[3] = {10, 0, 0};
    const float through = fog_one(snapshot, &linear, outside, (const float[3]){20, 0, 0});
    assert_true(fabs((1 - (double)through) / k - 13) < 1e-4);
    assert_true(fog_one(snapshot, &linear, outside, (const float[3]){-9, 0, 0}) == 1);
    assert_true(fog_one(snapshot, &linear, behind, (const float[3]){20, 0, 0}) == 1);
    nebel_release_snapshot(snapshot);
}

/* As printed: a direction without a part along an axis is a miss. */
static double slabs_as_printed(const double low[3], const double high[3], const double eye[3], const float point[3])
{
    double in = -HUGE_VAL, out = HUGE_VAL;
    for (int c = 0; c < 3; c++) {
        const double way = (double)point[c] - eye[c];
        if (way == 0) return 0;
        const double a = (low[c] - eye[c]) / way, b = (high[c] - eye[c]) / way;
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    return fmax(0, fmin(out, 1) - fmax(in, 0));
}

static void test_rays_along_an_axis_meet_the_box(void **unused)
{
    (void)unused;
    const double low[3] = {-1, -2, -3}, high[3] = {1, 2, 3};
    const double extinction = .05;
    nebel_snapshot *const snapshot = commit_box(-1, -2, -3, 1, 2, 3, extinction);
    const nebel_vertex_desc linear = {.curve = NEBEL_CURVE_LINEAR};
    for (int axis = 0; axis < 3; axis++) {
        double eye[3] = {.5, .5, .5};
        float point[3] = {.5f, .5f, .5f};
        eye[axis] = -10;
        point[axis] = 10;
        assert_true(slabs_as_printed(low, high, eye, point) == 0);
        const double right = extinction * (high[axis] - low[axis]);
        assert_true(fabs(1 - (double)fog_one(snapshot, &linear, eye, point) - right) < 1e-5);
        /* level with the box and outside of it: a miss, also as printed */
        const int other = (axis + 1) % 3;
        eye[other] = (double)(point[other] = 5);
        assert_true(fog_one(snapshot, &linear, eye, point) == 1);
        /* in a face: one of the two faces belongs to the box */
        int fogged = 0;
        for (int side = 0; side < 2; side++) {
            eye[other] = side ? high[other] : low[other];
            point[other] = (float)eye[other];
            const double amount = 1 - (double)fog_one(snapshot, &linear, eye, point);
            assert_true(amount == 0 || fabs(amount - right) < 1e-5);
            fogged += amount > 0;
        }
        assert_int_equal(fogged, 1);
    }
    nebel_release_snapshot(snapshot);
}

/* Printed: the fog's red, amount times colour, is the coordinate, and hardware fogs by LINEAR from 0 to 100. */
static void test_a_fog_coordinate_is_100_times_the_amount(void **unused)
{
    (void)unused;
    const double color[3] = {.7, .7, .8}, eye[3] = {0, 0, 0};
    nebel_factor_desc hardware = {
        .mode = NEBEL_FACTOR_LINEAR, .coordinate = NEBEL_COORDINATE_USER, .start = 0, .end = 100};
    assert_int_equal(nebel_resolve_factor(&hardware, &hardware), NEBEL_OK);
    nebel_snapshot *const snapshot = commit_box(-50, -50, -50, 50, 50, 50, .05);
    for (float x = 1; x < 40; x += 1.5f) {
        const float point[3] = {x, 0, 0};
        float coordinate, light[4];
        const nebel_vertices vertices = {.positions = point};
        const nebel_vertex_output outputs[] = {{NEBEL_VERTEX_COORDINATE, &coordinate, 0},
                                               {NEBEL_VERTEX_RGBA_FLOAT, light, 0}};
        assert_int_equal(
            nebel_compute_vertex_fog(snapshot, &(nebel_vertex_desc){.color = color}, 1, &vertices, outputs, 2),
            NEBEL_OK);
        const double f = (double)fog_one(snapshot, NULL, eye, point);
        assert_true(fabs(nebel_compute_fog_factor(&hardware, (double)coordinate) - f) < 1e-6);
        const double printed = nebel_compute_fog_factor(&hardware, (double)light[0]);
        assert_true(printed > .99 && f < .96);
    }
    nebel_release_snapshot(snapshot);
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void test_vertices_that_are_no_place_get_no_fog(void **unused)
{
    (void)unused;
    const float bad[] = {NAN, HUGE_VALF, -HUGE_VALF};
    nebel_snapshot *const kinds[] = {
        commit_box(-50, -50, -50, 50, 50, 50, 1), commit_turned_box(50, 1),
        fog_commit(&(nebel_fog_desc){0}, &(nebel_volume_desc){.extinction = {1, 1, 1}, .emission = {1, 1, 1}}, 1)};
    uint64_t state = 6;
    static points p;
    static float factor[COUNT], color[COUNT][4];
    static unsigned char bytes[COUNT][4];
    for (int kind = 0; kind < 3; kind++) {
        p = random_points(&state, 30);
        for (int i = 0; i < COUNT; i += 2)
            for (int k = 0; k < 3; k++)
                if (k == i / 2 % 3 || i % 5 == 0) p.at[i][k] = bad[(i + k) % 3];
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            const nebel_vertex_desc desc = {.isa = (nebel_isa)isa};
            const nebel_vertices vertices = {.positions = p.at, .eye = {1, 2, 3}};
            fog_points(kinds[kind], &desc, &vertices, NEBEL_VERTEX_FACTOR, factor);
            fog_points(kinds[kind], &desc, &vertices, NEBEL_VERTEX_RGBA_FLOAT, color);
            fog_points(kinds[kind], &desc, &vertices, NEBEL_VERTEX_RGBA8, bytes);
            for (int i = 0; i < COUNT; i++) {
                const float none[4] = {0};
                if (i % 2 == 0) {
                    assert_true(factor[i] == 1);
                    assert_memory_equal(color[i], none, sizeof none);
                    assert_memory_equal(bytes[i], none, 4);
                } else {
                    assert_true(factor[i] < 1);
                }
            }
        }
        nebel_release_snapshot(kinds[kind]);
    }
}

static void test_vertices_beyond_all_reach_have_some_factor(void **unused)
{
    (void)unused;
    nebel_snapshot *const kinds[] = {commit_box(-50, -50, -50, 50, 50, 50, 1), commit_turned_box(50, 1)};
    const double eye[3] = {-60, 0, 0};
    for (int kind = 0; kind < 2; kind++) {
        for (float x = 1e18f; x < HUGE_VALF; x *= 10) {
            const float f = fog_one(kinds[kind], NULL, eye, (const float[3]){x, 1, 0});
            assert_true(f >= 0 && f <= 1);
        }
        assert_true(fog_one(kinds[kind], NULL, eye, (const float[3]){1e18f, 1, 0}) < 1e-6f);
        nebel_release_snapshot(kinds[kind]);
    }
}

typedef struct refusal {
    const char *word;
    size_t n, position_stride;
    int output_count;
    nebel_vertex_output outputs[2];
} refusal;

static void test_streams_that_share_bytes_are_refused(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    const nebel_volume_desc box = box_of(-5, -5, -5, 5, 5, 5, 1);
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &box, 1);
    static unsigned char memory[4096], before[4096];
    unsigned char *const m = memory + 1024;
    const refusal refusals[] = {
        {"position_stride", 9, 8, 1, {{NEBEL_VERTEX_FACTOR, m, 0}}},
        {"elements overlap", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, m + 512, 3}}},
        {"elements overlap", 9, 0, 1, {{NEBEL_VERTEX_RGBA_FLOAT, m + 512, 12}}},
        {"format", 9, 0, 1, {{NEBEL_VERTEX_FORMAT_COUNT, m + 512, 0}}},
        {"NULL", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, NULL, 0}}},
        {"positions share", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, m, 12}}},
        {"positions share", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, m + 100, 0}}},
        {"positions share", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, m - 33, 0}}},
        {"positions share", 9, 24, 1, {{NEBEL_VERTEX_FACTOR, m + 8, 24}}},
        {"positions share", 9, 24, 1, {{NEBEL_VERTEX_FACTOR, m + 22, 24}}},
        {"positions share", 9, 24, 1, {{NEBEL_VERTEX_FACTOR, m - 24 - 3, 24}}},
        {"positions share", 9, 24, 1, {{NEBEL_VERTEX_RGBA_FLOAT, m + 12, 24}}},
        {"positions share", 9, 24, 1, {{NEBEL_VERTEX_FACTOR, m + 12, 48}}}, /* other strides */
        {"positions share", 9, 16, 1, {{NEBEL_VERTEX_SPECULAR_ALPHA, m + 8, 16}}},
        {"outputs share", 9, 24, 2, {{NEBEL_VERTEX_FACTOR, m + 12, 24}, {NEBEL_VERTEX_RGBA8, m + 12, 24}}},
        {"outputs share", 9, 24, 2, {{NEBEL_VERTEX_RGBA8, m + 15, 24}, {NEBEL_VERTEX_FACTOR, m + 12, 24}}},
        {"outputs share", 9, 0, 2, {{NEBEL_VERTEX_FACTOR, m + 512, 0}, {NEBEL_VERTEX_FACTOR, m + 544, 0}}},
        {"memory", SIZE_MAX / 2, 0, 1, {{NEBEL_VERTEX_FACTOR, m + 512, 0}}},
    };
    for (size_t i = 0; i < sizeof memory; i++) memory[i] = (unsigned char)(i * 7);
    memcpy(before, memory, sizeof memory);
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        const refusal *const r = &refusals[i];
        const nebel_vertices vertices = {.positions = m, .position_stride = r->position_stride};
        messages.text[0] = '\0';
        assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, r->n, &vertices, r->outputs, (size_t)r->output_count),
                         NEBEL_ERROR_ARGUMENT);
        if (strstr(messages.text, r->word) == NULL) fail_msg("refusal %zu: %s", i, messages.text);
        assert_memory_equal(memory, before, sizeof memory);
    }
    nebel_release_snapshot(snapshot);
}

static void test_streams_that_lie_in_each_other_are_taken(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = commit_box(-5, -5, -5, 5, 5, 5, 1);
    static unsigned char m[4096];
    const refusal taken[] = {
        {"", 9, 24, 2, {{NEBEL_VERTEX_FACTOR, m + 12, 24}, {NEBEL_VERTEX_RGBA8, m + 16, 24}}},
        {"", 9, 24, 2, {{NEBEL_VERTEX_FACTOR, m + 12 + 24, 24}, {NEBEL_VERTEX_RGBA8, m + 12 + 24 * 20, 24}}},
        {"", 9, 0, 1, {{NEBEL_VERTEX_FACTOR, m + 108, 0}}},
        {"", 9, 13, 1, {{NEBEL_VERTEX_SPECULAR_ALPHA, m + 9, 13}}}, /* its alpha alone counts, and it is beyond z */
        {"", 1, 0, 1, {{NEBEL_VERTEX_FACTOR, m + 12, 1000}}},
        {"", 0, 0, 1, {{NEBEL_VERTEX_FACTOR, NULL, 0}}},
    };
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++) {
        const refusal *const r = &taken[i];
        const nebel_vertices vertices = {.positions = m, .position_stride = r->position_stride};
        memset(m, 0, sizeof m);
        assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, r->n, &vertices, r->outputs, (size_t)r->output_count),
                         NEBEL_OK);
    }
    nebel_release_snapshot(snapshot);
}

static void test_descriptions_that_are_none_are_refused(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    const nebel_volume_desc box = box_of(-5, -5, -5, 5, 5, 5, 1);
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &box, 1);
    const float point[3] = {0};
    float out[4];
    const double nan_color[3] = {0, 0, (double)NAN}, minus[3] = {-1, 0, 0}, beyond[3] = {0, 1e39, 0};
    nebel_vertices vertices = {.positions = point};
    const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, out, 0};
    const struct {
        nebel_vertex_desc desc;
        nebel_result result;
    } cases[] = {{{.channel = 3}, NEBEL_ERROR_ARGUMENT},
                 {{.channel = -1}, NEBEL_ERROR_ARGUMENT},
                 {{.isa = NEBEL_ISA_COUNT}, NEBEL_ERROR_ARGUMENT},
                 {{.curve = NEBEL_CURVE_COUNT}, NEBEL_ERROR_ARGUMENT},
                 {{.curve = NEBEL_CURVE_TABLE}, NEBEL_ERROR_ARGUMENT},
                 {{.curve = NEBEL_CURVE_LINEAR}, NEBEL_ERROR_ARGUMENT}, /* without a color */
                 {{.color = nan_color}, NEBEL_ERROR_VALUE},
                 {{.color = minus}, NEBEL_ERROR_VALUE},
                 {{.color = beyond}, NEBEL_ERROR_VALUE}, /* no float */
                 {{.coordinate_end = 1e39}, NEBEL_ERROR_VALUE},
                 {{.coordinate_end = -1}, NEBEL_ERROR_VALUE}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_int_equal(nebel_compute_vertex_fog(snapshot, &cases[i].desc, 1, &vertices, &output, 1), cases[i].result);
    for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++)
        if (!nebel_isa_available((nebel_isa)isa))
            assert_int_equal(nebel_compute_vertex_fog(snapshot, &(nebel_vertex_desc){.isa = (nebel_isa)isa}, 1,
                                                      &vertices, &output, 1),
                             NEBEL_ERROR_UNSUPPORTED);
    messages.count = 0;
    vertices.eye[1] = HUGE_VAL;
    assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, 1, &vertices, &output, 1), NEBEL_ERROR_ARGUMENT);
    vertices.eye[1] = 0;
    vertices.origin[2] = 2e15;
    assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, 1, &vertices, &output, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, 1, NULL, &output, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, 1, &vertices, NULL, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_vertex_fog(NULL, NULL, 1, &vertices, &output, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(messages.count, 4);
    nebel_release_snapshot(snapshot);
}

static void test_the_defaults_can_be_asked(void **unused)
{
    (void)unused;
    nebel_vertex_desc d;
    assert_int_equal(nebel_resolve_vertex_desc(&(nebel_vertex_desc){0}, &d), NEBEL_OK);
    assert_true(d.coordinate_end == 100 && d.curve == NEBEL_CURVE_PHYSICAL && d.color == NULL && d.channel == 0);
    assert_int_equal(nebel_resolve_vertex_desc(NULL, &d), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_resolve_vertex_desc(&d, NULL), NEBEL_ERROR_ARGUMENT);
}

static void test_nothing_is_written_beyond_the_last_vertex(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = commit_box(-9, -9, -9, 9, 9, 9, 1);
    uint64_t state = 9;
    const points p = random_points(&state, 15);
    for (int format = 0; format < NEBEL_VERTEX_FORMAT_COUNT; format++)
        for (size_t n = 0; n < 70; n++) {
            unsigned char out[71 * 16];
            const size_t size = format == NEBEL_VERTEX_RGBA_FLOAT ? 16 : 4;
            memset(out, 0x77, sizeof out);
            const nebel_vertices vertices = {.positions = p.at};
            const nebel_vertex_output output = {(nebel_vertex_format)format, out, 0};
            assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, n, &vertices, &output, 1), NEBEL_OK);
            for (size_t i = n * size; i < sizeof out; i++) assert_int_equal(out[i], 0x77);
        }
    nebel_release_snapshot(snapshot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_vertices_in_any_fog_are_what_the_trace_says),
        cmocka_unit_test(test_boxes_have_the_bits_of_segments),
        cmocka_unit_test(test_boxes_of_several_colors_have_their_own_light),
        cmocka_unit_test(test_formats_say_the_same),
        cmocka_unit_test(test_halves_are_rounded_upwards),
        cmocka_unit_test(test_structures_splits_and_instruction_sets_change_no_bit),
        cmocka_unit_test(test_curves_are_those_of_the_length_inside),
        cmocka_unit_test(test_a_table_ends_with_its_last_entry),
        cmocka_unit_test(test_bodies_put_together_count_once),
        cmocka_unit_test(test_a_camera_in_the_fog_does_not_see_what_is_behind_it),
        cmocka_unit_test(test_rays_along_an_axis_meet_the_box),
        cmocka_unit_test(test_a_fog_coordinate_is_100_times_the_amount),
        cmocka_unit_test(test_vertices_that_are_no_place_get_no_fog),
        cmocka_unit_test(test_vertices_beyond_all_reach_have_some_factor),
        cmocka_unit_test(test_streams_that_share_bytes_are_refused),
        cmocka_unit_test(test_streams_that_lie_in_each_other_are_taken),
        cmocka_unit_test(test_descriptions_that_are_none_are_refused),
        cmocka_unit_test(test_the_defaults_can_be_asked),
        cmocka_unit_test(test_nothing_is_written_beyond_the_last_vertex),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
