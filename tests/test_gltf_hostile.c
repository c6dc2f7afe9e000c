/* glTF whose sparse numbers, names and embedded data are right in odd ways, or wrong. */
#define _GNU_SOURCE
#include "model_help.h"

#include <math.h>
#include <sys/stat.h>

enum { VERTICES = 4 };

static void write_bytes(const char *name, const void *bytes, size_t size)
{
    FILE *file = fopen(in_folder(name), "wb");
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* One mesh of positions; what else there is of the file stands in `data`. */
static void write_gltf(const char *required, const char *data)
{
    char text[4000];
    snprintf(
        text, sizeof text,
        "{\"asset\": {\"version\": \"2.0\"}, \"extensionsUsed\": [%s], \"extensionsRequired\": [%s], \"scene\": 0, "
        "\"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": "
        "[{\"attributes\": {\"POSITION\": 0}, \"mode\": 6}]}], %s}",
        required, required, data);
    write_text("a.gltf", text);
}

/* ---- sparse numbers -------------------------------------------------------------------------- */

/* Four corners of bytes, each with a stride of 4; then two indices of `width` bytes, and two values. */
static size_t fill(unsigned char *bytes, int width, unsigned second)
{
    static const unsigned char base[VERTICES][4] = {{0, 0, 0, 0}, {9, 9, 9, 0}, {10, 10, 0, 0}, {8, 8, 8, 0}};
    static const unsigned char values[2][3] = {{10, 0, 0}, {0, 10, 5}};
    memset(bytes, 0, 100);
    memcpy(bytes, base, sizeof base);
    bytes[16] = 1;
    for (int i = 0; i < width; i++) bytes[16 + width + i] = (unsigned char)(second >> (8 * i) & 255);
    memcpy(bytes + 16 + 2 * width, values, sizeof values);
    return sizeof base + 2 * (size_t)width + sizeof values;
}

#define SPARSE(base, count, sparse)                                                                                    \
    "\"buffers\": [{\"byteLength\": %zu, \"uri\": \"a.bin\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 16, " \
    "\"byteStride\": 4}, {\"buffer\": 0, \"byteOffset\": 16, \"byteLength\": %d}, {\"buffer\": 0, \"byteOffset\": "    \
    "%d, \"byteLength\": 6}], \"accessors\": [{" base "\"componentType\": 5121, \"count\": " count                     \
    ", \"type\": \"VEC3\", \"sparse\": {" sparse "}}]"
#define INDICES "\"indices\": {\"bufferView\": 1, \"componentType\": %d}, "
#define VALUES "\"values\": {\"bufferView\": 2}"
#define BASE "\"bufferView\": 0, "

static void write_sparse(const char *format, int width, unsigned second)
{
    static const int types[] = {0, 5121, 5123, 0, 5125};
    unsigned char bytes[100];
    char text[3000];
    const size_t size = fill(bytes, width, second);
    write_bytes("a.bin", bytes, size);
    snprintf(text, sizeof text, format, size, 2 * width, 16 + 2 * width, types[width]);
    write_gltf("\"KHR_mesh_quantization\"", text);
}

static void check_corners(const double wanted[VERTICES][3])
{
    nebel_scene *scene = load_good("\"file\": \"a.gltf\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->triangle_count, 2);
    for (int i = 0; i < VERTICES; i++) {
        int found = 0;
        for (uint32_t k = 0; k < mesh->vertex_count; k++) {
            double distance = 0;
            for (int c = 0; c < 3; c++) distance += fabs((double)mesh->positions[3 * k + (uint32_t)c] - wanted[i][c]);
            found += distance < 1e-5;
        }
        if (found == 0) fail_msg("corner %d is missing", i);
    }
    nebel_destroy_scene(scene);
}

static void test_sparse_integers(void **state)
{
    (void)state;
    static const double whole[VERTICES][3] = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 5}};
    for (int width = 1; width <= 4; width *= 2) {
        write_sparse(SPARSE(BASE, "4", "\"count\": 2, " INDICES VALUES), width, 3);
        check_corners(whole);
    }
    /* Without a view all others are 0. */
    write_sparse(SPARSE("", "3", "\"count\": 2, " INDICES VALUES), 2, 2);
    nebel_scene *scene = load_good("\"file\": \"a.gltf\"");
    assert_int_equal(nebel_get_scene_data(scene)->meshes[0].triangle_count, 1);
    nebel_destroy_scene(scene);
}

static void test_sparse_integers_that_cannot_be(void **state)
{
    (void)state;
    static const struct {
        const char *format;
        unsigned second;
        const char *message;
    } cases[] = {
        {SPARSE(BASE, "4", "\"count\": 2, " INDICES VALUES), 4, "sparse index beyond its end"},
        {SPARSE(BASE, "4", "\"count\": 5, " INDICES VALUES), 3, "more sparse numbers than numbers"},
        {SPARSE(BASE, "4", "\"count\": 0, " INDICES VALUES), 3, "or none"},
        {SPARSE(BASE, "4", "\"count\": 3, " INDICES VALUES), 3, "longer than its view"},
        {SPARSE(BASE, "5", "\"count\": 2, " INDICES VALUES), 3, "longer than its view"},
        {SPARSE("", "9007199254740991", "\"count\": 2, " INDICES VALUES), 3, "too many numbers"},
        {SPARSE(BASE, "4", "\"count\": 2, \"indices\": {\"bufferView\": 1, \"componentType\": 5126}, " VALUES), 3,
         "no whole numbers"},
        {SPARSE(BASE, "4", "\"count\": 2, " INDICES "\"values\": {\"bufferView\": 7}"), 3, "view that does not exist"},
        {SPARSE(BASE, "4", "\"count\": 2, " VALUES), 3, "no whole numbers"},
        {SPARSE(BASE, "4", ""), 3, "no whole numbers"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_sparse(cases[i].format, 2, cases[i].second);
        assert_broken("\"file\": \"a.gltf\"", NEBEL_ERROR_FORMAT, cases[i].message);
    }
}

/* ---- names ----------------------------------------------------------------------------------- */

#define FLOATS(uri)                                                                                                    \
    "\"buffers\": [{\"byteLength\": 36, \"uri\": \"" uri "\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": "    \
    "36}], \"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}]"

/* The same of bytes, which are read here, not by Assimp. */
#define BYTES(uri)                                                                                                     \
    "\"buffers\": [{\"byteLength\": 36, \"uri\": \"" uri "\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": "    \
    "36}], \"accessors\": [{\"bufferView\": 0, \"componentType\": 5121, \"count\": 3, \"type\": \"VEC3\"}]"

/* Bytes of a buffer, or compressed ones, that the file does not have. */
#define NO_BUFFER(view)                                                                                                \
    "\"buffers\": [{\"byteLength\": 36, \"uri\": \"a.bin\"}], \"bufferViews\": [{" view "}], \"accessors\": "          \
    "[{\"bufferView\": 0, \"componentType\": 5121, \"count\": 3, \"type\": \"VEC3\"}]"
#define COMPRESSED(more)                                                                                               \
    "\"buffer\": 0, \"byteLength\": 9, \"extensions\": {\"EXT_meshopt_compression\": {\"buffer\": 0, \"byteLength\": " \
    "9, \"byteStride\": " more "}}"

static void test_views_that_cannot_be(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {NO_BUFFER("\"buffer\": 1, \"byteLength\": 36"), "buffers[1] does not exist, but is named"},
        {NO_BUFFER(COMPRESSED("4, \"count\": 3, \"mode\": \"LINES\"")), "a mode or a filter that"},
        {NO_BUFFER(COMPRESSED("3, \"count\": 3, \"mode\": \"ATTRIBUTES\"")), "bufferViews[0] has numbers that"},
        {NO_BUFFER(COMPRESSED("4, \"count\": 99999, \"mode\": \"ATTRIBUTES\"")), "bufferViews[0] has numbers that"},
    };
    write_bytes("a.bin", (const char[36]){0}, 36);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_gltf(i > 0 ? "\"EXT_meshopt_compression\"" : "", cases[i][0]);
        assert_broken("\"file\": \"a.gltf\"", NEBEL_ERROR_FORMAT, cases[i][1]);
    }
}

/* What Assimp would read without a word, or crash on. */
static void test_numbers_that_cannot_be(void **state)
{
    (void)state;
    static const char stride[] = "has a byteStride that is no multiple of 4 from 4 to 252";
    static const char *const cases[][2] = {
        {NO_BUFFER("\"buffer\": 0, \"byteLength\": 36, \"byteStride\": 4294967292"), stride},
        {NO_BUFFER("\"buffer\": 0, \"byteLength\": 36, \"byteStride\": 6"), stride},
        {NO_BUFFER("\"buffer\": 0, \"byteLength\": 36, \"byteStride\": -4"), stride},
        {NO_BUFFER("\"buffer\": 0, \"byteLength\": 36, \"byteOffset\": -8"),
         "bufferViews[0] has an offset or a length"},
        {NO_BUFFER("\"buffer\": 0, \"byteLength\": 36.5"), "bufferViews[0] has an offset or a length"},
        {"\"accessors\": [{\"byteOffset\": -8, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}]",
         "accessors[0] has a byteOffset or a count"},
        {"\"skins\": [{\"joints\": [0]}]", "skins[0] has no inverseBindMatrices"},
    };
    write_bytes("a.bin", (const char[36]){0}, 36);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_gltf("", cases[i][0]);
        assert_broken("\"file\": \"a.gltf\"", NEBEL_ERROR_FORMAT, cases[i][1]);
    }
}

/* Whole numbers of four bytes are read as well, though no extension allows them. */
static void test_long_integers(void **state)
{
    (void)state;
    static const uint32_t places[9] = {1, 0, 0, 70000, 0, 0, 0, 70000, 16777216};
    write_bytes("a.bin", places, sizeof places);
    write_gltf("", "\"buffers\": [{\"byteLength\": 36, \"uri\": \"a.bin\"}], \"bufferViews\": [{\"buffer\": 0, "
                   "\"byteLength\": 36}], \"accessors\": [{\"bufferView\": 0, \"componentType\": 5125, \"count\": 3, "
                   "\"type\": \"VEC3\"}]");
    nebel_scene *scene = load_good("\"file\": \"a.gltf\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->triangle_count, 1);
    for (size_t i = 0; i < 9; i++) assert_true(mesh->positions[3 * mesh->indices[i / 3] + i % 3] == (float)places[i]);
    nebel_destroy_scene(scene);
}

static void assert_all_broken(const char *const *texts, size_t count, const char *message)
{
    for (size_t i = 0; i < count; i++) {
        write_gltf("", texts[i]);
        assert_broken("\"file\": \"sub/a.gltf\"", NEBEL_ERROR_FORMAT, message);
        assert_broken("\"file\": \"sub/a.gltf\"", NEBEL_ERROR_FORMAT, "sub/a.gltf");
    }
}

/* However it is written, a name leads nowhere but into the model's folder. */
static void test_names_that_lead_out(void **state)
{
    (void)state;
    static const float places[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const char *const outside[] = {
        FLOATS("../out.bin"),        BYTES("../out.bin"),       FLOATS("%2e%2e%2fout.bin"),
        BYTES("%2e%2e%2fout.bin"),   FLOATS("%2E%2E/out.bin"),  BYTES("x/%2e%2e/%2e%2e/out.bin"),
        FLOATS("..%2Fout.bin"),      BYTES("/etc/hostname"),    FLOATS("/etc/hostname"),
        BYTES("%2fetc%2fhostname"),  FLOATS("%2Fetc/hostname"), FLOATS("link.bin"),
        BYTES("link.bin"),           FLOATS("folder/out.bin"),  BYTES("folder/out.bin"),
        FLOATS("./%2e%2e//out.bin"),
    };
    static const char *const missing[] = {FLOATS("%252e%252e%252fout.bin"),
                                          BYTES("%252e%252e%252fout.bin"),
                                          BYTES("%2e%2e%00"),
                                          BYTES("%"),
                                          BYTES("%2"),
                                          BYTES("%zz%2"),
                                          BYTES("file:///etc/hostname"),
                                          BYTES("http://localhost/a.bin")};
    mkdir(in_folder("sub"), 0700);
    mkdir(in_folder("sub/x"), 0700);
    write_bytes("out.bin", places, sizeof places);
    assert_int_equal(symlink("../out.bin", in_folder("sub/link.bin")), 0);
    assert_int_equal(symlink("..", in_folder("sub/folder")), 0);
    assert_int_equal(symlink("../a.gltf", in_folder("sub/a.gltf")), 0); /* the model itself is named by the scene */
    assert_all_broken(outside, sizeof outside / sizeof *outside, "outside the folder");
    assert_all_broken(missing, sizeof missing / sizeof *missing, "");
    /* The same lead somewhere where the scene says so. */
    write_gltf("", FLOATS("%2e%2e%2fout.bin"));
    assert_int_equal(unlink(in_folder("sub/a.gltf")), 0);
    assert_int_equal(rename(in_folder("a.gltf"), in_folder("sub/a.gltf")), 0);
    nebel_destroy_scene(load_good("\"file\": \"sub/a.gltf\", \"folder\": \".\""));
    unlink(in_folder("sub/a.gltf"));
}

/* ---- data in the text ------------------------------------------------------------------------ */

static void test_data_that_are_none(void **state)
{
    (void)state;
    static const char *const texts[] = {
        BYTES("data:"),
        BYTES("data:,"),
        BYTES("data:;base64,"),
        BYTES("data:application/octet-stream;base64"),
        BYTES("data:application/octet-stream,AAAA"),
        BYTES("data:application/octet-stream;base64,A?AA"),
        BYTES("data:application/octet-stream;base64,AAAA"),
        BYTES("data:;base64,===="),
        BYTES("data:;base64,AAAAA"),
        FLOATS("data:"),
        FLOATS("data:,"),
        FLOATS("data:;base64,"),
        FLOATS("data:;base64,????"),
        FLOATS("data:application/octet-stream;base64,AAAA"),
        FLOATS("data:application/octet-stream,AAAA"),
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        write_gltf("", texts[i]);
        assert_broken("\"file\": \"a.gltf\"", NEBEL_ERROR_FORMAT, "a.gltf");
    }
}

/* ---- in process ------------------------------------------------------------------------------ */

static void test_what_is_not_decoded_in_process(void **state)
{
    (void)state;
    static const char scene_text[] = "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"a.gltf\"}]}";
    journal kept = {0};
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {remember, &kept}, .models_in_process = 1};
    write_gltf("\"EXT_meshopt_compression\"", FLOATS("a.bin"));
    assert_int_equal(nebel_parse_scene(scene_text, sizeof scene_text - 1, in_folder("s.json"), &desc, &scene),
                     NEBEL_OK);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_ERROR_UNSUPPORTED);
    assert_non_null(
        strstr(kept.last, "\"EXT_meshopt_compression\", which is not decoded where models are read in process"));
    assert_non_null(strstr(kept.last, "have nebel-read-model read it"));
    nebel_destroy_scene(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sparse_integers),        cmocka_unit_test(test_sparse_integers_that_cannot_be),
        cmocka_unit_test(test_numbers_that_cannot_be), cmocka_unit_test(test_views_that_cannot_be),
        cmocka_unit_test(test_long_integers),          cmocka_unit_test(test_names_that_lead_out),
        cmocka_unit_test(test_data_that_are_none),     cmocka_unit_test(test_what_is_not_decoded_in_process),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder_tree);
}
