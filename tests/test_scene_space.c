/* One scene in metres with y up, and the same in other units and axes: the same fog, camera and models. */
#include "fog_help.h"
#include "scene_help.h"

#include <math.h>
#include <stdbool.h>

typedef struct convention {
    bool z_up;
    double unit;
    bool late; /* said at the end of the file, as programs do that sort keys */
} convention;

/* ---- the same text in a convention ----------------------------------------------------------- */

/* A template has marks, each a letter before numbers in parentheses, in metres with y up:
 * P place, D direction, Q quaternion, S scale, E extents along the axes, L length, K inverse length, B box: two
 * corners, C plane. */
static size_t write_vector(char *at, const convention *in, const double *v, double factor, bool signed_axes)
{
    if (!in->z_up) return (size_t)sprintf(at, "%.17g, %.17g, %.17g", v[0] * factor, v[1] * factor, v[2] * factor);
    return (size_t)sprintf(at, "%.17g, %.17g, %.17g", v[0] * factor, (signed_axes ? -v[2] : v[2]) * factor,
                           v[1] * factor);
}

/* The least and the greatest corner: with z up they change roles along y. */
static size_t write_box(char *at, const convention *in, const double *v)
{
    const double low[3] = {v[0], v[1], in->z_up ? v[5] : v[2]}, high[3] = {v[3], v[4], in->z_up ? v[2] : v[5]};
    size_t size = (size_t)sprintf(at, "\"min\": [");
    size += write_vector(at + size, in, low, 1 / in->unit, true);
    size += (size_t)sprintf(at + size, "], \"max\": [");
    size += write_vector(at + size, in, high, 1 / in->unit, true);
    return size + (size_t)sprintf(at + size, "]");
}

static size_t write_mark(char *at, const convention *in, char mark, const double *v)
{
    size_t size = 0;
    if (mark == 'B') return write_box(at, in, v);
    if (mark == 'L') return (size_t)sprintf(at, "%.17g", v[0] / in->unit);
    if (mark == 'K') return (size_t)sprintf(at, "%.17g", v[0] * in->unit);
    at[size++] = '[';
    const double factor = mark == 'P' || mark == 'E' ? 1 / in->unit : 1;
    size += write_vector(at + size, in, v, factor, mark != 'S' && mark != 'E');
    if (mark == 'Q') size += (size_t)sprintf(at + size, ", %.17g", v[3]);
    if (mark == 'C') size += (size_t)sprintf(at + size, ", %.17g", v[3] / in->unit);
    at[size++] = ']';
    return size;
}

static size_t write_space(char *at, const convention *in)
{
    return (size_t)sprintf(at, "\"unit\": %.17g, \"up\": \"%s\"", in->unit, in->z_up ? "z" : "y");
}

static char *expand(const char *template, const convention *in)
{
    char *text = malloc(4 * strlen(template) + 4000), *at = text;
    at += sprintf(at, "{\"nebel\": 1, ");
    if (!in->late) {
        at += write_space(at, in);
        at += sprintf(at, ", ");
    }
    while (*template != '\0') {
        const bool is_mark = strchr("PDQSELKBC", template[0]) != NULL && template[1] == '(';
        if (!is_mark) {
            *at++ = *template ++;
            continue;
        }
        const char mark = *template;
        double numbers[6] = {0};
        template += 2;
        for (int i = 0; *template != ')'; i++) {
            char *end;
            numbers[i] = strtod(template, &end);
            template = end;
        }
        template ++;
        at += write_mark(at, in, mark, numbers);
    }
    if (in->late) {
        while (*--at != '}') {
        }
        at += sprintf(at, ", ");
        at += write_space(at, in);
        *at++ = '}';
    }
    *at = '\0';
    return text;
}

static const convention ours = {.unit = 1};
static const convention others[] = {
    {.z_up = true, .unit = 1},         {.unit = .01},   {.z_up = true, .unit = .01},
    {.z_up = true, .unit = 9.4607e15}, {.unit = .3048}, {.z_up = true, .unit = .01, .late = true},
    {.unit = 9.4607e15, .late = true}};

static nebel_scene *parse_in(const char *template, const convention *in)
{
    char *text = expand(template, in);
    nebel_scene *scene = parse_good(text);
    free(text);
    return scene;
}

/* ---- comparing ------------------------------------------------------------------------------- */

static void assert_same(const double *got, const double *wanted, size_t count, double scale)
{
    for (size_t i = 0; i < count; i++)
        if (!(fabs(got[i] - wanted[i]) <= 1e-12 * scale)) fail_msg("%zu: %.17g, not %.17g", i, got[i], wanted[i]);
}

static double random_number(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)*seed / 4294967296.0;
}

enum { RAYS = 2000 };

static void trace_at(const nebel_scene *scene, double frame, nebel_transfer *transfers)
{
    nebel_ray rays[RAYS];
    uint32_t seed = 7;
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (nebel_ray){.t_max = i % 3 == 0 ? HUGE_VAL : 40 * random_number(&seed)};
        for (int k = 0; k < 3; k++) rays[i].origin[k] = 24 * random_number(&seed) - 12;
        for (int k = 0; k < 3; k++) rays[i].direction[k] = random_number(&seed) - .5;
    }
    scene_trace(scene, frame, (nebel_trace_desc){.tolerance = 1e-13}, RAYS, rays, transfers);
}

static void trace(const nebel_scene *scene, nebel_transfer *transfers)
{
    trace_at(scene, 0, transfers);
}

static void assert_same_light(const char *template)
{
    static nebel_transfer wanted[RAYS], got[RAYS];
    nebel_scene *scene = parse_in(template, &ours);
    trace(scene, wanted);
    nebel_destroy_scene(scene);
    int touched = 0;
    for (int i = 0; i < RAYS; i++) touched += wanted[i].transmittance[0] < .99;
    assert_true(touched > RAYS / 50);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        scene = parse_in(template, &others[k]);
        trace(scene, got);
        nebel_destroy_scene(scene);
        for (int i = 0; i < RAYS; i++) {
            assert_same(got[i].transmittance, wanted[i].transmittance, 3, 1);
            assert_same(got[i].in_scattering, wanted[i].in_scattering, 3, 1);
        }
    }
}

#define FOG(shape, rest) "\"fog\": [{\"shape\": {" shape "}, " rest "}]}"
#define AMOUNT "\"extinction\": [K(.1), K(.2), K(.3)], \"emission\": [K(.01), K(.02), 0], \"source\": \"#8090a0\""
#define TRANSFORM ", \"transform\": {\"position\": P(1 -2 3), \"rotation\": Q(.1 .3 -.2 .9), \"scale\": S(1.5 .5 -2)}"

static void test_every_shape(void **state)
{
    (void)state;
    assert_same_light(FOG("\"type\": \"box\", B(-3 -2 1 4 5 7)" TRANSFORM, AMOUNT));
    assert_same_light(FOG("\"type\": \"sphere\", \"center\": P(1 2 3), \"radius\": L(4)" TRANSFORM, AMOUNT));
    assert_same_light(FOG("\"type\": \"ellipsoid\", \"center\": P(1 2 3), \"radii\": E(2 4 6)" TRANSFORM, AMOUNT));
    assert_same_light(
        FOG("\"type\": \"cylinder\", \"from\": P(-4 0 1), \"to\": P(3 5 2), \"radius\": L(2)" TRANSFORM, AMOUNT));
    assert_same_light(FOG("\"type\": \"capsule\", \"from\": P(-4 0 1), \"to\": P(3 5 2), \"radius\": L(2)", AMOUNT));
    assert_same_light(
        FOG("\"type\": \"cone\", \"from\": P(-4 0 1), \"to\": P(3 5 2), \"radius_from\": L(3), \"radius_to\": L(1)",
            AMOUNT));
    assert_same_light(FOG("\"type\": \"half_space\", \"point\": P(0 -1 0), \"normal\": D(.2 1 .4)", AMOUNT));
    assert_same_light(
        FOG("\"type\": \"convex\", \"planes\": [C(1 .5 .2 4), C(-1 .1 0 5), C(0 1 3 6), C(0 -1 -2 7)]", AMOUNT));
    assert_same_light(
        FOG("\"type\": \"union\", \"shapes\": [{\"type\": \"sphere\", \"center\": P(1 2 3), \"radius\": L(4)},"
            "{\"type\": \"intersection\", \"shapes\": [{\"type\": \"world\"}, {\"type\": \"box\", "
            "B(-5 -4 -3 -1 2 3)" TRANSFORM "}]}]",
            AMOUNT));
}

static void test_every_density_and_amount(void **state)
{
    (void)state;
    assert_same_light(FOG("\"type\": \"world\"",
                          "\"visibility\": L(20), \"source\": 1, \"density\": {\"type\": \"height\", "
                          "\"base\": L(2), \"scale_height\": L(3), \"below\": \"constant\"}"));
    assert_same_light(FOG("\"type\": \"world\"", "\"mean_free_path\": [L(3), L(4), L(5)], \"source\": 1, \"density\": "
                                                 "{\"type\": \"linear\", \"from\": P(0 5 1), \"to\": P(2 -3 4)}"));
    assert_same_light(FOG("\"type\": \"world\"",
                          "\"extinction\": K(.3), \"source\": 1, \"density\": {\"type\": \"gaussian\", "
                          "\"center\": P(1 2 3), \"sigma\": L(2)}"));
    assert_same_light(FOG("\"type\": \"box\", B(-3 -2 1 4 5 7)",
                          "\"extinction\": K(.3), \"source\": 1, \"density\": {\"type\": "
                          "\"soft_edge\", \"distance\": L(1.5)}"));
    assert_same_light(FOG("\"type\": \"sphere\", \"center\": P(0 1 2), \"radius\": L(5)" TRANSFORM,
                          "\"extinction\": K(.3), \"source\": 1, \"density\": {\"type\": \"radial\", \"power\": 2}"));
}

static void write_file(const char *name, const char *text)
{
    FILE *stream = fopen(name, "wb");
    assert_non_null(stream);
    fputs(text, stream);
    fclose(stream);
}

#define BOX_IN "\"fog\": [{\"shape\": {\"type\": \"box\", B(-8 -7 -6 8 6 7)" TRANSFORM "}, \"extinction\": K(.3), "
#define NOISE                                                                                                          \
    "{\"type\": \"noise\", \"size\": S(14 10 12), \"cells\": S(3 2 4), \"octaves\": 2, \"edge\": S(.1 .2 .3), "        \
    "\"velocity\": D(.3 -.2 .1), \"evolution\": 0.1}"

static nebel_grid *first_grid(const nebel_scene *scene)
{
    return nebel_get_scene_data(scene)->volumes[0].density.grid;
}

static void assert_same_noise(const nebel_scene_noise *got, const nebel_scene_noise *wanted)
{
    for (int k = 0; k < 3; k++) assert_int_equal(got->desc.size[k], wanted->desc.size[k]);
    assert_same(got->desc.frequency, wanted->desc.frequency, 3, 1);
    assert_same(got->desc.falloff, wanted->desc.falloff, 3, 1);
    assert_same(got->velocity, wanted->velocity, 3, 1);
}

/* The voxels of two grids, by fog in them. */
static void assert_same_grid(nebel_grid *got, nebel_grid *wanted)
{
    nebel_transfer transfers[2][RAYS];
    nebel_grid *const grids[2] = {got, wanted};
    for (int i = 0; i < 2; i++) {
        const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, -9, -9}, .max = {9, 9, 9}},
                                          .extinction = {.1, .1, .1},
                                          .density = {.type = NEBEL_DENSITY_GRID, .grid = grids[i]}};
        nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
        uint32_t seed = 7;
        for (int r = 0; r < RAYS; r++) {
            nebel_ray ray = {.t_max = HUGE_VAL};
            for (int k = 0; k < 3; k++) ray.origin[k] = 24 * random_number(&seed) - 12;
            for (int k = 0; k < 3; k++) ray.direction[k] = random_number(&seed) - .5;
            assert_int_equal(nebel_trace(fog, NULL, 1, &ray, 0, &transfers[i][r], 0), NEBEL_OK);
        }
        nebel_release_snapshot(fog);
    }
    for (int r = 0; r < RAYS; r++) assert_same(transfers[0][r].transmittance, transfers[1][r].transmittance, 3, 1);
}

/* Noise lies along the axes of the file, drifts along them, and is told and changed along ours. */
static void test_noise(void **state)
{
    (void)state;
    static nebel_transfer wanted[2][RAYS], got[RAYS];
    nebel_scene_noise noise, there;
    nebel_grid *changed, *same;
    nebel_scene *ours_too = parse_in(BOX_IN "\"source\": 1, \"density\": " NOISE "}]}", &ours);
    for (int i = 0; i < 2; i++) trace_at(ours_too, 3 * i, wanted[i]);
    assert_true(nebel_get_scene_noise(ours_too, first_grid(ours_too), &noise));
    noise.velocity[2] = .75;
    noise.desc.frequency[1] = 3;
    assert_int_equal(nebel_update_scene_noise(ours_too, first_grid(ours_too), &noise, &changed), NEBEL_OK);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        nebel_scene *scene = parse_in(BOX_IN "\"source\": 1, \"density\": " NOISE "}]}", &others[k]);
        for (int i = 0; i < 2; i++) {
            trace_at(scene, 3 * i, got);
            for (int r = 0; r < RAYS; r++) assert_same(got[r].transmittance, wanted[i][r].transmittance, 3, 1);
        }
        assert_int_equal(nebel_update_scene_noise(scene, first_grid(scene), &noise, &same), NEBEL_OK);
        assert_true(nebel_get_scene_noise(scene, same, &there));
        assert_same_noise(&there, &noise);
        assert_same_grid(same, changed);
        nebel_release_grid(same);
        nebel_destroy_scene(scene);
    }
    nebel_release_grid(changed);
    nebel_destroy_scene(ours_too);
}

/* 2 x 3 x 4 numbers along the axes of the file. */
static void write_voxels(const char *name, bool z_up)
{
    FILE *stream = fopen(name, "wb");
    assert_non_null(stream);
    const int rows = z_up ? 4 : 3, layers = z_up ? 3 : 4;
    for (int z = 0; z < layers; z++)
        for (int y = 0; y < rows; y++)
            for (int x = 0; x < 2; x++) {
                const float value = (float)(x + 2 * (z_up ? z : y) + 6 * (z_up ? rows - 1 - y : z));
                assert_int_equal(fwrite(&value, sizeof value, 1, stream), 1);
            }
    fclose(stream);
}

static void test_voxels(void **state)
{
    (void)state;
    static nebel_transfer wanted[RAYS], got[RAYS];
    static const char grid[] = BOX_IN "\"source\": 1, \"density\": {\"type\": \"grid\", \"file\": "
                                      "\"test_scene_space.raw\", \"size\": S(2 3 4), \"voxels\": \"float\"}}]}";
    write_voxels("test_scene_space.raw", false);
    nebel_scene *scene = parse_in(grid, &ours);
    trace(scene, wanted);
    nebel_destroy_scene(scene);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        write_voxels("test_scene_space.raw", others[k].z_up);
        scene = parse_in(grid, &others[k]);
        trace(scene, got);
        nebel_destroy_scene(scene);
        for (int r = 0; r < RAYS; r++) assert_same(got[r].transmittance, wanted[r].transmittance, 3, 1);
    }
    remove("test_scene_space.raw");
}

/* glTF is y up: noise in a node of it is so, too, in any scene and at any frame. */
static void test_noise_in_nodes(void **state)
{
    (void)state;
    static nebel_transfer wanted[RAYS], got[RAYS];
    write_file(
        "test_scene_space.gltf",
        "{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"scale\": "
        "[8, 7, 6], \"extras\": {\"nebel\": {\"extinction\": 0.3, \"source\": 1, \"density\": {\"type\": "
        "\"noise\", \"size\": [14, 10, 12], \"cells\": [3, 2, 4], \"velocity\": [0.3, -0.2, 0.1]}}}}]}");
    for (size_t k = 0; k <= sizeof others / sizeof *others; k++) {
        nebel_scene *scene = parse_in("\"models\": [{\"file\": \"test_scene_space.gltf\"}], \"fog\": []}",
                                      k > 0 ? &others[k - 1] : &ours);
        trace_at(scene, 3, k > 0 ? got : wanted);
        for (int r = 0; r < RAYS && k > 0; r++) assert_same(got[r].transmittance, wanted[r].transmittance, 3, 1);
        nebel_destroy_scene(scene);
    }
    remove("test_scene_space.gltf");
}

static void test_a_nebula(void **state)
{
    (void)state;
    assert_same_light(
        "\"fog\": [], \"nebula\": [{\"shape\": {\"type\": \"ellipsoid\", \"center\": P(1 2 3), \"radii\": E(5 6 7)}, "
        "\"count\": 200, \"radius_range\": [L(.5), L(2)], \"absorption\": K(.4), \"emission\": K(.2), \"colors\": "
        "[\"#f00\", "
        "\"#00f\"],"
        "\"turbulence\": L(1), \"turbulence_scale\": L(3)}, {\"shape\": {\"type\": \"box\", B(-8 -8 -8 -5 -5 -5)}, "
        "\"count\": 500, "
        "\"absorption\": K(4)}]}");
}

/* ---- camera, sun, models --------------------------------------------------------------------- */

static void assert_same_camera(const nebel_camera *got, const nebel_camera *wanted)
{
    assert_same(got->position, wanted->position, 3, 100);
    assert_same(got->look_at, wanted->look_at, 3, 100);
    assert_same(got->up, wanted->up, 3, 1);
    assert_same(&got->view_height, &wanted->view_height, 1, 100);
    assert_true(got->vertical_fov == wanted->vertical_fov);
}

/* Directions count, distances do not, where the file leaves look_at out. */
static void assert_same_view(const nebel_camera *got, const nebel_camera *wanted)
{
    double a[3], b[3], length = 0;
    for (int i = 0; i < 3; i++) a[i] = got->look_at[i] - got->position[i];
    for (int i = 0; i < 3; i++) b[i] = wanted->look_at[i] - wanted->position[i];
    for (int i = 0; i < 3; i++) length += a[i] * a[i];
    for (int i = 0; i < 3; i++) a[i] /= sqrt(length);
    assert_same(got->position, wanted->position, 3, 100);
    assert_same(a, b, 3, 1000);
}

static void test_cameras_and_sun(void **state)
{
    (void)state;
    static const char full[] =
        "\"camera\": {\"position\": P(1 2 3), \"look_at\": P(4 -5 6), \"up\": D(.1 1 .2), \"view_height\": L(7), "
        "\"keys\": ["
        "{\"frame\": 0, \"position\": P(-1 -2 -3)}, {\"frame\": 10, \"look_at\": P(1 0 9), \"view_height\": L(3)}]},"
        "\"sun\": {\"direction\": D(.3 .8 -.5), \"irradiance\": 3}, \"fog\": []}";
    static const char bare[] =
        "\"camera\": {\"position\": P(1 2 3), \"keys\": [{\"frame\": 0, \"position\": P(3 2 1)}]}, \"fog\": []}";
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        nebel_scene *scenes[4] = {parse_in(full, &ours), parse_in(full, &others[k]), parse_in(bare, &ours),
                                  parse_in(bare, &others[k])};
        const nebel_scene_data *wanted = nebel_get_scene_data(scenes[0]), *got = nebel_get_scene_data(scenes[1]);
        assert_same(got->sun_direction, wanted->sun_direction, 3, 1);
        assert_same(got->sun_irradiance, wanted->sun_irradiance, 3, 1);
        assert_same_camera(&got->camera, &wanted->camera);
        for (int frame = 0; frame <= 10; frame += 5) {
            const nebel_camera a = nebel_get_scene_camera(scenes[1], frame),
                               b = nebel_get_scene_camera(scenes[0], frame);
            assert_same_camera(&a, &b);
        }
        wanted = nebel_get_scene_data(scenes[2]), got = nebel_get_scene_data(scenes[3]);
        if (others[k].unit < 1) assert_same_view(&got->camera, &wanted->camera);
        if (others[k].unit < 1) assert_same_view(&got->camera_keys[0].camera, &wanted->camera_keys[0].camera);
        for (int i = 0; i < 4; i++) nebel_destroy_scene(scenes[i]);
    }
}

static void test_a_scene_without_camera_has_the_usual_one(void **state)
{
    (void)state;
    nebel_scene *scene = parse_in("\"fog\": [], \"camera\": {\"vertical_fov\": 50}}", &others[2]);
    const nebel_camera *camera = &nebel_get_scene_data(scene)->camera;
    const double position[3] = {0, 1.7, 0}, ahead[3] = {0, 1.7, -1}, up[3] = {0, 1, 0}, height = 10;
    assert_same(camera->position, position, 3, 1);
    assert_same(camera->look_at, ahead, 3, 1);
    assert_same(camera->up, up, 3, 1);
    assert_same(&camera->view_height, &height, 1, 10);
    nebel_destroy_scene(scene);
}

static void load_mesh(nebel_scene *scene, double places[3][3])
{
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK);
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 1);
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t k = 0; k < 3; k++)
            places[i][k] = mesh->origin[k] + (double)mesh->positions[3 * mesh->indices[i] + k];
    nebel_destroy_scene(scene);
}

#define PLACED ", \"position\": P(10 20 30), \"rotation\": Q(.1 .3 -.2 .9), \"scale\": S(1.5 .5 -2)}], \"fog\": []}"

/* Positions are floats. */
static void assert_same_places(double got[3][3], double wanted[3][3])
{
    for (int i = 0; i < 3; i++) assert_same(got[i], wanted[i], 3, 1e7);
}

/* A model stands where it should; one that was written with z up in feet is the same model. */
static void test_models(void **state)
{
    (void)state;
    write_file("test_scene_space_y.obj", "v 1 2 3\nv 4 -5 6\nv 0 1 -2\nf 1 2 3\n");
    write_file("test_scene_space_z.obj", "v 1 -3 2\nv 4 -6 -5\nv 0 2 1\nf 1 2 3\n");
    double wanted[3][3], got[3][3];
    load_mesh(parse_in("\"models\": [{\"file\": \"test_scene_space_y.obj\"" PLACED, &ours), wanted);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        load_mesh(parse_in("\"models\": [{\"file\": \"test_scene_space_y.obj\"" PLACED, &others[k]), got);
        assert_same_places(got, wanted);
        load_mesh(parse_in("\"models\": [{\"file\": \"test_scene_space_z.obj\", \"up\": \"z\"" PLACED, &others[k]),
                  got);
        assert_same_places(got, wanted);
    }
    load_mesh(
        parse_in("\"models\": [{\"file\": \"test_scene_space_z.obj\", \"up\": \"z\", \"unit\": 0.25}], \"fog\": []}",
                 &others[2]),
        got);
    double small[3][3] = {{.25, .5, .75}, {1, -1.25, 1.5}, {0, .25, -.5}};
    assert_same_places(got, small);
    remove("test_scene_space_y.obj");
    remove("test_scene_space_z.obj");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_shape),     cmocka_unit_test(test_every_density_and_amount),
        cmocka_unit_test(test_noise),           cmocka_unit_test(test_voxels),
        cmocka_unit_test(test_noise_in_nodes),  cmocka_unit_test(test_a_nebula),
        cmocka_unit_test(test_cameras_and_sun), cmocka_unit_test(test_a_scene_without_camera_has_the_usual_one),
        cmocka_unit_test(test_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
