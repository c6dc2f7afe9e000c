/* Voxels in files: NanoVDB in all its forms, pictures, numbers; what is wrong with them, said in time. */
#define _XOPEN_SOURCE 700
#include "scene_help.h"

#include "near.h"
#include "grid_file/grid_file.h"

#include <math.h>
#include <png.h>
#include <unistd.h>
#include <zlib.h>

#define CORPUS NEBEL_SOURCE "/fuzz/corpus/grid/"

static char folder[] = "/tmp/nebel_grids_XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_bytes(const char *name, const void *bytes, size_t size)
{
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static nb_bytes read_bytes(const char *path)
{
    nb_bytes bytes;
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    assert_int_equal(nb_file_read(&allocator, &(nebel_log){0}, NULL, "grid", path, 1 << 28, &bytes), NEBEL_OK);
    return bytes;
}

/* The transmittance along a ray through the middle of the box 0..1, along an axis. */
static double through(nebel_grid *grid, int axis, double u, double v)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_transfer transfer;
    const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}},
                                      .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                                      .extinction = {1, 1, 1}};
    nebel_ray ray = {.t_max = 3};
    ray.origin[axis] = -1;
    ray.direction[axis] = 1;
    ray.origin[(axis + 1) % 3] = u;
    ray.origin[(axis + 2) % 3] = v;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    assert_int_equal(nebel_trace(snapshot, NULL, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
    nebel_destroy_fog(fog);
    nebel_release_snapshot(snapshot);
    return transfer.transmittance[0];
}

static nebel_grid *load(const nebel_grid_file *file)
{
    journal kept = {0};
    nebel_grid *grid = NULL;
    if (nebel_load_grid(file, &(nebel_scene_desc){.host.log = {remember, &kept}}, &grid) != NEBEL_OK)
        fail_msg("%s", kept.last);
    return grid;
}

/* The corpus holds the corner x / 3 + y / 2 + z <= 1 of the first octant at 0.1 a voxel, 31 x 21 x 11 of them, with fog
 * that grows from 0 on its faces to 1 from 0.3 within. What is wanted is the integral of min(1, distance / 0.3) along
 * each axis; voxels know distances to some hundredths. */
static void check_wedge(const char *path, double tolerance)
{
    static const double wanted[3] = {0.7529, 0.7642, 0.7610};
    nebel_grid *grid = load(&(nebel_grid_file){.path = path, .grid_name = "density"});
    for (int axis = 0; axis < 3; axis++) {
        assert_near(through(grid, axis, .2, .2), wanted[axis], tolerance);
        assert_near(through(grid, axis, .9, .9), 1, 1e-12);
    }
    nebel_release_grid(grid);
}

static void nanovdb_is_read_whatever_its_form(void **state)
{
    (void)state;
    check_wedge(CORPUS "zip.nvdb", 1e-2);
    check_wedge(CORPUS "blosc.nvdb", 1e-2);
    check_wedge(CORPUS "fp16.nvdb", 1e-2);
    check_wedge(CORPUS "fpn.nvdb", 1e-2);
    check_wedge(CORPUS "fp8.nvdb", 1e-2);
    check_wedge(CORPUS "fp4.nvdb", 3e-2);
}

/* The zipped file, whose header, entry and name are 200 bytes, without its zip. */
static nb_bytes plain_wedge(void)
{
    enum { HEAD = 200 };
    uint64_t size;
    nb_bytes zipped = read_bytes(CORPUS "zip.nvdb");
    memcpy(&size, zipped.data + 16, sizeof size);
    nb_bytes plain = {malloc(HEAD + size), HEAD + size, 0};
    assert_non_null(plain.data);
    memcpy(plain.data, zipped.data, HEAD);
    memset(plain.data + 14, 0, 2);
    memcpy(plain.data + 24, &size, sizeof size);
    uLongf written = size;
    assert_int_equal(uncompress(plain.data + HEAD, &written, zipped.data + HEAD + 8, zipped.size - HEAD - 8), Z_OK);
    free(zipped.data);
    return plain;
}

static void plain_files_are_those_that_were_zipped(void **state)
{
    (void)state;
    nb_bytes plain = plain_wedge();
    for (char magic = '0'; magic <= '2'; magic++) {
        plain.data[7] = (unsigned char)magic;
        write_bytes("plain.nvdb", plain.data, plain.size);
        nebel_grid *zipped = load(&(nebel_grid_file){.path = CORPUS "zip.nvdb"});
        nebel_grid *other = load(&(nebel_grid_file){.path = in_folder("plain.nvdb")});
        for (int axis = 0; axis < 3; axis++) assert_true(through(zipped, axis, .1, .3) == through(other, axis, .1, .3));
        nebel_release_grid(zipped);
        nebel_release_grid(other);
    }
    free(plain.data);
}

static nebel_result read_nanovdb(const void *data, size_t size, const char *name, journal *kept)
{
    meter m;
    nb_voxels voxels;
    const nebel_scene_desc desc = metered_desc(&m, kept);
    const nb_codec codec = {.allocator = desc.host.allocator, .log = desc.host.log, .name = "x.nvdb"};
    const nb_bytes bytes = {(unsigned char *)data, size, size};
    const nebel_result result = nb_nanovdb_read(&codec, &bytes, name, &voxels);
    if (result == NEBEL_OK) nb_release(&codec.allocator, voxels.data);
    assert_int_equal(kept->count, result == NEBEL_OK ? 0 : 1);
    assert_int_equal(m.live, 0);
    return result;
}

static void files_that_are_cut_off_are_refused(void **state)
{
    (void)state;
    const char *const names[] = {CORPUS "zip.nvdb", CORPUS "blosc.nvdb", CORPUS "fpn.nvdb"};
    for (int i = 0; i < 3; i++) {
        journal kept;
        nb_bytes whole = read_bytes(names[i]);
        for (size_t size = 0; size < whole.size; size += size < 300 ? 1 : 97) {
            unsigned char *part = malloc(size + 1);
            assert_non_null(part);
            memcpy(part, whole.data, size);
            assert_int_equal(read_nanovdb(part, size, NULL, &kept), NEBEL_ERROR_FORMAT);
            free(part);
        }
        free(whole.data);
    }
}

/* Offsets and counts that lie: voxels or an error, nothing else. */
static void damaged_trees_do_no_harm(void **state)
{
    (void)state;
    journal kept;
    nb_bytes plain = plain_wedge();
    for (size_t at = 0; at < 2000; at += 4)
        for (int k = 0; k < 3; k++) {
            static const uint32_t lies[3] = {0, 0x7fffffff, 0xfffffff0};
            uint32_t was;
            memcpy(&was, plain.data + at, sizeof was);
            memcpy(plain.data + at, &lies[k], sizeof was);
            read_nanovdb(plain.data, plain.size, NULL, &kept);
            memcpy(plain.data + at, &was, sizeof was);
        }
    free(plain.data);
}

typedef struct lie {
    size_t at;
    uint32_t value;
    nebel_result result;
    const char *words;
} lie;

static void what_is_wrong_is_said(void **state)
{
    (void)state;
    static const lie lies[] = {
        {0, 0, NEBEL_ERROR_FORMAT, "x.nvdb: is not a NanoVDB file"},
        {8, 31u << 21, NEBEL_ERROR_UNSUPPORTED, "is of NanoVDB's version 31; this program reads 32"},
        {14, 9, NEBEL_ERROR_UNSUPPORTED, "is compressed in a way that is not known"},
        {12, 0, NEBEL_ERROR_FORMAT, "is not a NanoVDB file"},
        {48, 4, NEBEL_ERROR_UNSUPPORTED, "its voxels are of NanoVDB's type 4; float,"},
        {52, 1, NEBEL_ERROR_UNSUPPORTED, "is a level set, which holds distances"},
        {16, 0, NEBEL_ERROR_FORMAT, "too small or too large"},
        {200, 0, NEBEL_ERROR_FORMAT, "its grid is damaged"},
    };
    nb_bytes plain = plain_wedge();
    for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
        journal kept;
        unsigned char was[4];
        memcpy(was, plain.data + lies[i].at, sizeof was);
        memcpy(plain.data + lies[i].at, &lies[i].value, lies[i].at == 14 ? 2 : sizeof was);
        assert_int_equal(read_nanovdb(plain.data, plain.size, NULL, &kept), lies[i].result);
        if (strstr(kept.last, lies[i].words) == NULL) fail_msg("byte %zu: %s", lies[i].at, kept.last);
        memcpy(plain.data + lies[i].at, was, sizeof was);
    }
    journal kept;
    assert_int_equal(read_nanovdb(plain.data, plain.size, "heat", &kept), NEBEL_ERROR_FORMAT);
    assert_string_equal(kept.last, "x.nvdb: holds no grid of the name heat");
    free(plain.data);
}

/* ---- numbers and pictures -------------------------------------------------------------------- */

static void numbers_are_x_first(void **state)
{
    (void)state;
    const float floats[6] = {0, 0, 1, 0, 0, .5F}; /* 3 x 2 x 1: the fog is where x is large */
    const uint16_t words[6] = {0, 0, 65535, 0, 0, 32768};
    const uint8_t bytes[6] = {0, 0, 255, 0, 0, 128};
    const void *const data[] = {floats, bytes, words};
    const size_t sizes[] = {sizeof floats, sizeof bytes, sizeof words};
    for (int type = 0; type < 3; type++) {
        write_bytes("numbers.raw", data[type], sizes[type]);
        nebel_grid *grid = load(&(nebel_grid_file){.path = in_folder("numbers.raw"),
                                                   .filter = NEBEL_GRID_FILTER_NEAREST,
                                                   .size = {3, 2, 1},
                                                   .type = (nebel_voxel_type)type});
        assert_near(through(grid, 1, .5, .9), exp(-.75), 2e-3); /* along y, at x = .9 */
        assert_near(through(grid, 1, .5, .5), 1, 0);
        assert_near(through(grid, 0, .2, .5), exp(-1. / 3), 1e-12);
        nebel_release_grid(grid);
    }
}

static void write_png(const char *name, uint32_t width, uint32_t height, uint32_t format, const uint8_t *pixels)
{
    png_image image = {.version = PNG_IMAGE_VERSION, .width = width, .height = height, .format = format};
    assert_true(png_image_write_to_file(&image, in_folder(name), 0, pixels, 0, NULL));
}

static void write_slice(const char *name, uint32_t width, uint32_t height, const uint8_t *pixels)
{
    write_png(name, width, height, PNG_FORMAT_GRAY, pixels);
}

/* Rows go down, y up; slices go along z. */
static void pictures_are_slices(void **state)
{
    (void)state;
    const uint8_t black[6] = {0}, corner[6] = {255, 0, 0, 0, 0, 0};
    write_slice("s_00.png", 2, 3, black);
    write_slice("s_01.png", 2, 3, corner);
    nebel_grid *grid =
        load(&(nebel_grid_file){.path = in_folder("s_##.png"), .filter = NEBEL_GRID_FILTER_NEAREST, .slice_count = 2});
    assert_near(through(grid, 2, .25, .9), exp(-.5), 1e-12);
    assert_near(through(grid, 2, .25, .1), 1, 0);
    assert_near(through(grid, 2, .75, .9), 1, 0);
    assert_near(through(grid, 0, .9, .75), exp(-.5), 1e-12);
    assert_near(through(grid, 0, .9, .25), 1, 0);
    nebel_release_grid(grid);
}

/* ---- in scenes ------------------------------------------------------------------------------- */

typedef struct wrong {
    const char *density, *words;
} wrong;

static void scenes_say_what_is_wrong(void **state)
{
    (void)state;
    static const wrong cases[] = {
        {"\"type\": \"grid\"", "fog[0].density: the key \"file\" is missing"},
        {"\"type\": \"grid\", \"file\": \"\"", "missing"},
        {"\"type\": \"grid\", \"file\": 5", "fog[0].density.file: is a number; must be the path of a file"},
        {"\"type\": \"grid\", \"file\": \"\", \"size\": [1, 1, 1], \"voxels\": \"uint8\"",
         "fog[0].density.file: is empty; must be the path of a file"},
        {"\"type\": \"grid\", \"file\": \"none.nvdb\"", "fog[0].density.file: "},
        {"\"type\": \"grid\", \"file\": \"none.nvdb\", \"slices\": 3", "fog[0].density.slices: unknown key"},
        {"\"type\": \"grid\", \"file\": \"none.raw\"",
         "the key \"size\" is missing; a grid of numbers (no .nvdb, .vdb, .png) needs it"},
        {"\"type\": \"grid\", \"file\": \".\", \"size\": [3, 2, 1], \"voxels\": \"uint8\"", "directory"},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [4096, 4096, 65], \"voxels\": \"uint8\"",
         "4096 x 4096 x 65 voxels; at most 1073741824 in all"},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [3, 2], \"voxels\": \"uint8\"", "density.size: "},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [3, 2, 0], \"voxels\": \"uint8\"", "size[2]"},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [3, 2, 4097], \"voxels\": \"uint8\"", "size[2]"},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [3, 2, 1], \"voxels\": \"int8\"", "voxels: "},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"size\": [3, 2, 1], \"voxels\": \"uint8\"",
         "holds 12 bytes; 3 x 2 x 1 voxels of 1 bytes are 6"},
        {"\"type\": \"grid\", \"file\": \"bad.raw\", \"size\": [2, 1, 1], \"voxels\": \"float\"",
         "voxel 1, 0, 0 has the density -1"},
        {"\"type\": \"grid\", \"file\": \"s_##.png\"", "the key \"slices\" is missing"},
        {"\"type\": \"grid\", \"file\": \"s_##.png\", \"slices\": 3", "s_02.png"},
        {"\"type\": \"grid\", \"file\": \"s_00.png\", \"slices\": 1", "needs a run of 1 to 9 #"},
        {"\"type\": \"grid\", \"file\": \"odd_##.png\", \"slices\": 2", "odd_01.png: is 1 x 1 pixels of 8 bits; the"},
        {"\"type\": \"grid\", \"file\": \"text_#.png\", \"slices\": 1", "text_0.png: is not a PNG picture"},
        {"\"type\": \"grid\", \"file\": \"red_#.png\", \"slices\": 1",
         "red_0.png: not a good PNG picture: a slice of voxels must be grey, 8 or 16 bit, without alpha; convert it"},
        {"\"type\": \"grid\", \"file\": \"numbers.raw\", \"filter\": \"cubic\", \"size\": [3, 2, 1], "
         "\"voxels\": \"uint16\"",
         "filter: "},
    };
    const uint8_t black[6] = {0};
    const uint16_t words[6] = {0};
    const float bad[2] = {0, -1};
    write_bytes("numbers.raw", words, sizeof words);
    write_bytes("bad.raw", bad, sizeof bad);
    write_bytes("text_0.png", "hello", 5);
    write_slice("odd_00.png", 2, 3, black);
    write_slice("odd_01.png", 1, 1, black);
    write_png("red_0.png", 2, 1, PNG_FORMAT_RGB, black);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[512];
        journal kept = {0};
        nebel_scene *scene = NULL;
        snprintf(text, sizeof text,
                 "{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, "
                 "\"extinction\": 1, \"density\": {%s}}]}",
                 cases[i].density);
        const nebel_scene_desc desc = {.host.log = {remember, &kept}};
        const nebel_result result = nebel_parse_scene(text, strlen(text), in_folder("scene.json"), &desc, &scene);
        assert_int_not_equal(result, NEBEL_OK);
        assert_int_equal(kept.count, 1);
        if (strstr(kept.last, cases[i].words) == NULL) fail_msg("case %zu says: %s", i, kept.last);
    }
}

#define WEDGE                                                                                                          \
    "{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, "               \
    "\"extinction\": 1, \"density\": {\"type\": \"grid\", \"file\": \"" CORPUS                                         \
    "zip.nvdb\", \"filter\": \"nearest\"}}]}"

static void scenes_give_back_all_memory(void **state)
{
    (void)state;
    parse_without_memory(WEDGE);
}

/* ---- noise ----------------------------------------------------------------------------------- */

#define NOISE                                                                                                          \
    "{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, "               \
    "\"extinction\": 1, \"density\": {\"type\": \"noise\", \"size\": [12, 12, 12], \"cells\": [2, 3, 2], "             \
    "\"octaves\": 2, \"gain\": 0.6, \"coverage\": 0.8, \"edge\": [0.1, 0, 0], \"seed\": 4, \"velocity\": [0.5, 0, "    \
    "0], "                                                                                                             \
    "\"evolution\": 0.25}}]}"

static double light_at_frame(const nebel_scene *scene, double frame)
{
    nebel_snapshot *fog = NULL;
    nebel_transfer transfer;
    const nebel_ray ray = {.origin = {-1, .4, .6}, .direction = {1, 0, 0}, .t_max = 3};
    assert_int_equal(nebel_commit_scene_fog_at(scene, frame, &fog), NEBEL_OK);
    assert_int_equal(nebel_trace(fog, NULL, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
    nebel_release_snapshot(fog);
    return transfer.transmittance[0];
}

/* The noise of a frame is that which the core makes with what has drifted and passed until then. */
static void noise_moves_from_frame_to_frame(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(NOISE);
    nebel_noise_desc desc = {.size = {12, 12, 12},
                             .frequency = {2, 3, 2},
                             .octaves = 2,
                             .gain = .6,
                             .coverage = .8,
                             .falloff = {.1, 0, 0},
                             .seed = 4};
    assert_int_equal(nebel_get_scene_data(scene)->animated_volume_count, 1);
    assert_true(nebel_get_scene_data(scene)->has_endless_motion);
    for (int frame = 0; frame < 8; frame += 3) {
        nebel_grid *grid = NULL;
        desc.offset[0] = .5 * frame;
        desc.time = .25 * frame;
        assert_int_equal(nebel_create_noise_grid(&desc, &grid), NEBEL_OK);
        assert_true(light_at_frame(scene, frame) == through(grid, 0, .4, .6));
        nebel_grid *at = NULL;
        assert_int_equal(nebel_get_scene_grid(scene, nebel_get_scene_data(scene)->volumes[0].density.grid, frame, &at),
                         NEBEL_OK);
        assert_true(through(at, 0, .4, .6) == through(grid, 0, .4, .6));
        nebel_release_grid(at);
        nebel_release_grid(grid);
    }
    assert_true(fabs(light_at_frame(scene, 0) - light_at_frame(scene, 3)) > 1e-4);
    nebel_grid *none = NULL;
    assert_int_equal(nebel_get_scene_grid(scene, NULL, 3, &none), NEBEL_OK);
    assert_null(none);
    nebel_destroy_scene(scene);
    parse_without_memory(NOISE);
}

static nebel_grid *grid_of(const nebel_scene *scene)
{
    return nebel_get_scene_data(scene)->volumes[0].density.grid;
}

/* Noise with other numbers is that of a file that has them, and its words stay. */
static void noise_is_given_other_numbers(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(NOISE);
    nebel_scene_noise noise, again;
    nebel_grid *changed = NULL, *here = NULL, *there = NULL;
    assert_true(nebel_get_scene_noise(scene, grid_of(scene), &noise));
    assert_int_equal(noise.desc.size[2], 12);
    assert_true(noise.desc.gain == .6 && noise.velocity[0] == .5 && noise.evolution == .25 && noise.desc.seed == 4);
    noise.desc.frequency[1] = 4;
    noise.velocity[2] = -1;
    noise.desc.octaves = 3;
    assert_int_equal(nebel_update_scene_noise(scene, grid_of(scene), &noise, &changed), NEBEL_OK);
    assert_true(nebel_get_scene_noise(scene, changed, &again));
    assert_memory_equal(noise.desc.frequency, again.desc.frequency, sizeof noise.desc.frequency);
    assert_true(again.velocity[2] == -1 && again.desc.octaves == 3 && again.desc.coverage == .8);
    assert_non_null(strstr(nebel_get_grid_name(changed), "\"cells\": [2, 4, 2], \"octaves\": 3, \"gain\": 0.6"));
    noise.desc.offset[0] = 1;
    noise.desc.offset[2] = -2;
    noise.desc.time = .5;
    assert_int_equal(nebel_create_noise_grid(&noise.desc, &there), NEBEL_OK);
    assert_int_equal(nebel_get_scene_grid(scene, changed, 2, &here), NEBEL_OK);
    assert_true(through(here, 0, .4, .6) == through(there, 0, .4, .6));
    assert_false(through(here, 0, .4, .6) == through(changed, 0, .4, .6));
    nebel_release_grid(there);
    nebel_release_grid(here);
    nebel_release_grid(changed);
    nebel_destroy_scene(scene);
}

static void what_is_no_noise_stays(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(NOISE), *of_file = parse_good(WEDGE);
    nebel_scene_noise noise;
    nebel_grid *changed = NULL;
    assert_false(nebel_get_scene_noise(of_file, grid_of(of_file), &noise));
    assert_false(nebel_get_scene_noise(scene, NULL, &noise));
    assert_true(nebel_get_scene_noise(scene, grid_of(scene), &noise));
    assert_int_equal(nebel_update_scene_noise(of_file, grid_of(of_file), &noise, &changed), NEBEL_ERROR_ARGUMENT);
    noise.desc.gain = 2;
    assert_int_equal(nebel_update_scene_noise(scene, grid_of(scene), &noise, &changed), NEBEL_ERROR_FORMAT);
    noise.desc.gain = .5;
    noise.desc.frequency[0] = 7;
    assert_int_equal(nebel_update_scene_noise(scene, grid_of(scene), &noise, &changed), NEBEL_ERROR_VALUE);
    assert_null(changed);
    nebel_destroy_scene(of_file);
    nebel_destroy_scene(scene);
}

/* Every allocation fails once, with all that come after it. */
static void memory_runs_out_while_noise_is_changed(void **state)
{
    (void)state;
    meter m;
    journal kept;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    nebel_scene *scene = NULL;
    nebel_scene_noise noise;
    assert_int_equal(nebel_parse_scene(NOISE, strlen(NOISE), "s.json", &desc, &scene), NEBEL_OK);
    assert_true(nebel_get_scene_noise(scene, grid_of(scene), &noise));
    noise.evolution = 2;
    nebel_result changing = NEBEL_ERROR_MEMORY, moving = NEBEL_ERROR_MEMORY;
    const long live = m.live;
    for (long k = 0; changing != NEBEL_OK || moving != NEBEL_OK; k++) {
        nebel_grid *changed = NULL, *at = NULL;
        m.fail_at = m.made + k;
        changing = nebel_update_scene_noise(scene, grid_of(scene), &noise, &changed);
        m.fail_at = m.made + k;
        moving = nebel_get_scene_grid(scene, grid_of(scene), 3, &at);
        if (changing != NEBEL_OK) assert_int_equal(changing, NEBEL_ERROR_MEMORY);
        if (moving != NEBEL_OK) assert_int_equal(moving, NEBEL_ERROR_MEMORY);
        nebel_release_grid(changed);
        nebel_release_grid(at);
        assert_int_equal(m.live, live);
        assert_true(k < 2000);
    }
    nebel_destroy_scene(scene);
    assert_int_equal(m.live, 0);
}

/* A copy of the volume, moved, has the file of the first. */
static void copies_are_saved(void **state)
{
    (void)state;
    journal kept = {0};
    nebel_scene *scene = NULL, *again = NULL;
    const char *path = in_folder("copies.json");
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    write_bytes("copies.json", WEDGE, strlen(WEDGE));
    assert_int_equal(nebel_load_scene(path, &desc, &scene), NEBEL_OK);
    const nebel_scene_data *before = nebel_get_scene_data(scene);
    nebel_scene_data changed = *before;
    nebel_volume_desc volumes[2] = {before->volumes[0], before->volumes[0]};
    const nebel_volume_track entries[2] = {before->volume_tracks[0], before->volume_tracks[0]};
    const char *const names[2] = {"", "copy"};
    const size_t sources[2] = {0, NEBEL_NEW_VOLUME};
    volumes[0].extinction[0] = volumes[0].extinction[1] = volumes[0].extinction[2] = 2;
    volumes[1].shape.transform.position[0] = 5;
    changed.volumes = volumes;
    changed.volume_tracks = entries;
    changed.volume_names = names;
    changed.volume_count = 2;
    if (nebel_save_scene(path, &desc, before, &changed, sources) != NEBEL_OK) fail_msg("%s", kept.last);
    if (nebel_load_scene(path, &desc, &again) != NEBEL_OK) fail_msg("%s", kept.last);
    const nebel_scene_data *after = nebel_get_scene_data(again);
    assert_int_equal(after->volume_count, 2);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(after->volumes[i].density.type, NEBEL_DENSITY_GRID);
        assert_true(through(after->volumes[i].density.grid, 0, .2, .2) == through(volumes[0].density.grid, 0, .2, .2));
    }
    nebel_destroy_scene(scene);
    nebel_destroy_scene(again);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state)
{
    static const char *const names[] = {"plain.nvdb", "numbers.raw", "s_00.png",   "s_01.png",    "bad.raw",
                                        "text_0.png", "odd_00.png",  "odd_01.png", "copies.json", "red_0.png"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) unlink(in_folder(names[i]));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nanovdb_is_read_whatever_its_form),
        cmocka_unit_test(plain_files_are_those_that_were_zipped),
        cmocka_unit_test(files_that_are_cut_off_are_refused),
        cmocka_unit_test(damaged_trees_do_no_harm),
        cmocka_unit_test(what_is_wrong_is_said),
        cmocka_unit_test(numbers_are_x_first),
        cmocka_unit_test(pictures_are_slices),
        cmocka_unit_test(scenes_say_what_is_wrong),
        cmocka_unit_test(scenes_give_back_all_memory),
        cmocka_unit_test(copies_are_saved),
        cmocka_unit_test(noise_moves_from_frame_to_frame),
        cmocka_unit_test(noise_is_given_other_numbers),
        cmocka_unit_test(what_is_no_noise_stays),
        cmocka_unit_test(memory_runs_out_while_noise_is_changed),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
