/* glTF beyond what Assimp reads by itself: integers as numbers of vertices, compressed data, required extensions, names
 * that are percent-encoded, maps of texture coordinates. */
#define _GNU_SOURCE
#include "model_help.h"

#include <math.h>
#include <stdbool.h>
#include <sys/stat.h>

#if defined(NEBEL_HAVE_MESHOPT)
#include <meshoptimizer.h>
#endif

#define MODELS "/usr/share/assimp/models/"

enum { VERTICES = 4, CORNERS = 6 };

static const uint16_t corners[CORNERS] = {0, 1, 2, 0, 2, 3};

static void write_bytes(const char *name, const void *bytes, size_t size)
{
    FILE *file = fopen(in_folder(name), "wb");
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* One mesh of the accessors 0 to 2 and the indices 3, in the file NAME; `data` are its buffers, views and accessors. */
static void write_gltf(const char *name, const char *required, const char *data)
{
    char text[4000];
    snprintf(
        text, sizeof text,
        "{\"asset\": {\"version\": \"2.0\"}, \"extensionsUsed\": [%s], \"extensionsRequired\": [%s], \"scene\": 0, "
        "\"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": "
        "{\"POSITION\": 0, \"NORMAL\": 1, \"TEXCOORD_0\": 2}, \"indices\": 3, \"material\": 0}]}], %s}",
        required, required, data);
    write_text(name, text);
}

#define PLAIN_MATERIAL "\"materials\": [{}], "
#define PICTURE_MATERIAL(more)                                                                                         \
    "\"images\": [{\"uri\": \"t.png\"}], \"textures\": [{\"source\": 0}], \"materials\": [{\"pbrMetallicRoughness\": " \
    "{\"baseColorTexture\": {\"index\": 0" more "}}}], "

/* A white pixel. */
static void write_picture(const char *name)
{
    static const float white[3] = {1, 1, 1};
    static const char *const channels[] = {"R", "G", "B"};
    const nebel_image image = {1, 1, 3, channels, (float *)white};
    assert_int_equal(nebel_write_image(in_folder(name), &(nebel_host){0}, &image), NEBEL_OK);
}

static nebel_scene *load_file(const char *name)
{
    char members[200];
    snprintf(members, sizeof members, "\"file\": \"%s\"", name);
    return load_good(members);
}

static void assert_triple(const float *got, double x, double y, double z)
{
    const double wanted[3] = {x, y, z};
    for (int i = 0; i < 3; i++)
        if (!(fabs((double)got[i] - wanted[i]) < 1e-6))
            fail_msg("(%g, %g, %g) should be (%g, %g, %g)", (double)got[0], (double)got[1], (double)got[2], x, y, z);
}

/* ---- integers -------------------------------------------------------------------------------- */

typedef struct integer {
    int type, size;
    long low, high;
    double unit; /* of normalized ones */
} integer;

static const integer integers[] = {
    {5120, 1, -128, 127, 127}, {5121, 1, 0, 255, 255}, {5122, 2, -32768, 32767, 32767}, {5123, 2, 0, 65535, 65535}};

static void put_integer(unsigned char *bytes, const integer *kind, long value)
{
    for (int i = 0; i < kind->size; i++) bytes[i] = (unsigned char)((unsigned long)value >> 8 * i);
}

/* What the data begin with: three views with a stride of 8 for each vertex, then the indices. */
static size_t fill_data(unsigned char *bytes, const integer *kind)
{
    static const integer bytewise = {5120, 1, -128, 127, 127};
    const long x[VERTICES] = {kind->low, kind->high, kind->high, kind->low},
               y[VERTICES] = {kind->low, kind->low, 100, 100};
    memset(bytes, 0, 3 * 8 * VERTICES + 2 * CORNERS);
    for (int i = 0; i < VERTICES; i++) {
        unsigned char *place = bytes + 8 * i, *normal = bytes + 8 * (VERTICES + i),
                      *uv = bytes + 8 * (2 * VERTICES + i);
        put_integer(place, kind, x[i]);
        put_integer(place + kind->size, kind, y[i]);
        put_integer(place + 2 * kind->size, kind, 7);
        put_integer(normal + 2, &bytewise, 127);
        put_integer(uv, kind, i < 2 ? kind->high : 0);
        put_integer(uv + kind->size, kind, i % 2 == 0 ? kind->high : 0);
    }
    memcpy(bytes + 3 * 8 * VERTICES, corners, sizeof corners);
    return 3 * 8 * VERTICES + sizeof corners;
}

static void describe_data(char *text, size_t size, const integer *kind, bool is_normalized, const char *buffer)
{
    const char *normalized = is_normalized ? ", \"normalized\": true" : "";
    snprintf(
        text, size,
        PICTURE_MATERIAL(
            "") "\"buffers\": [{\"byteLength\": 108%s}], "
                "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 32, \"byteStride\": 8}, "
                "{\"buffer\": 0, \"byteOffset\": 32, \"byteLength\": 32, \"byteStride\": 8}, "
                "{\"buffer\": 0, \"byteOffset\": 64, \"byteLength\": 32, \"byteStride\": 8}, "
                "{\"buffer\": 0, \"byteOffset\": 96, \"byteLength\": 12}], "
                "\"accessors\": [{\"bufferView\": 0, \"componentType\": %d, \"count\": 4, \"type\": \"VEC3\"%s}, "
                "{\"bufferView\": 1, \"componentType\": 5120, \"normalized\": true, \"count\": 4, \"type\": \"VEC3\"}, "
                "{\"bufferView\": 2, \"componentType\": %d, \"normalized\": true, \"count\": 4, \"type\": \"VEC2\"}, "
                "{\"bufferView\": 3, \"componentType\": 5123, \"count\": 6, \"type\": \"SCALAR\"}]",
        buffer, kind->type, normalized, kind->type);
}

/* glTF 2.0, section 3.6.2.2: a normalized integer is a fraction of the largest one, at least -1. */
static double value_of(const integer *kind, bool is_normalized, long value)
{
    const double fraction = (double)value / kind->unit;
    return !is_normalized ? (double)value : fraction < -1 ? -1 : fraction;
}

static void check_quad(const char *name, const integer *kind, bool is_normalized)
{
    nebel_scene *scene = load_file(name);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->mesh_count, 1);
    const nebel_mesh *mesh = data->meshes;
    assert_int_equal(mesh->triangle_count, 2);
    assert_int_equal(mesh->vertex_count, 4);
    const double low = value_of(kind, is_normalized, kind->low), high = value_of(kind, is_normalized, kind->high);
    const double up = value_of(kind, is_normalized, 100), deep = value_of(kind, is_normalized, 7);
    assert_triple(mesh->positions, low, low, deep);
    assert_triple(mesh->positions + 3, high, low, deep);
    assert_triple(mesh->positions + 6, high, up, deep);
    assert_triple(mesh->normals, 0, 0, 1);
    const float wanted[8] = {1, 1, 1, 0, 0, 1, 0, 0};
    for (int i = 0; i < 8; i++) assert_true(fabsf(mesh->uvs[i] - wanted[i]) < 1e-6f);
    nebel_destroy_scene(scene);
}

static void test_integers_become_floats(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    write_picture("t.png");
    for (size_t i = 0; i < sizeof integers / sizeof *integers; i++)
        for (int normalized = 0; normalized < 2; normalized++) {
            write_bytes("quad.bin", bytes, fill_data(bytes, &integers[i]));
            describe_data(text, sizeof text, &integers[i], normalized != 0, ", \"uri\": \"quad.bin\"");
            write_gltf("quad.gltf", "\"KHR_mesh_quantization\"", text);
            check_quad("quad.gltf", &integers[i], normalized != 0);
        }
}

static void put_word(FILE *file, size_t word)
{
    for (int i = 0; i < 4; i++) fputc((int)(word >> 8 * i & 255), file);
}

/* A .gltf file and its data as one .glb file. */
static void write_glb(const char *name, const char *gltf, const unsigned char *bytes, size_t size)
{
    char text[5000];
    FILE *file = fopen(in_folder(gltf), "r");
    size_t length = fread(text, 1, sizeof text, file);
    fclose(file);
    while (length % 4 != 0) text[length++] = ' ';
    file = fopen(in_folder(name), "wb");
    fputs("glTF", file);
    put_word(file, 2);
    put_word(file, 28 + length + size);
    put_word(file, length);
    fputs("JSON", file);
    fwrite(text, 1, length, file);
    put_word(file, size);
    fwrite("BIN\0", 1, 4, file);
    fwrite(bytes, 1, size, file);
    fclose(file);
}

static void test_integers_in_a_binary_file(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    write_picture("t.png");
    const size_t size = fill_data(bytes, &integers[2]);
    describe_data(text, sizeof text, &integers[2], true, "");
    write_gltf("chunk.gltf", "\"KHR_mesh_quantization\"", text);
    write_glb("quad.glb", "chunk.gltf", bytes, size);
    check_quad("quad.glb", &integers[2], true);
}

static void test_integers_beyond_their_data_are_refused(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    write_bytes("quad.bin", bytes, fill_data(bytes, &integers[0]) - 80);
    describe_data(text, sizeof text, &integers[0], false, ", \"uri\": \"quad.bin\"");
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "buffers[0] is shorter");
    write_bytes("quad.bin", bytes, fill_data(bytes, &integers[0]));
    char *count = strstr(text, "\"count\": 4");
    count[9] = '9';
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "accessors[0] is longer than its view");
    describe_data(text, sizeof text, &integers[0], false, ", \"uri\": \"../quad.bin\"");
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "outside the folder");
    describe_data(text, sizeof text, &integers[0], false, ", \"uri\": \"data:;base64,A*\"");
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "not base64");
}

/* ---- compressed data ------------------------------------------------------------------------- */

#if defined(NEBEL_HAVE_MESHOPT)
enum { RING = 64, RING_VERTICES = 2 * RING, RING_CORNERS = 6 * RING };

typedef struct ring {
    int16_t places[RING_VERTICES][4];
    float floats[RING_VERTICES][3], normals[RING_VERTICES][4];
    uint16_t uvs[RING_VERTICES][2];
    unsigned indices[RING_CORNERS];
} ring;

/* A band around the y axis. */
static void make_ring(ring *made)
{
    for (int i = 0; i < RING_VERTICES; i++) {
        const double turn = 2 * acos(-1.0) * (i / 2) / RING, x = cos(turn), z = sin(turn);
        const int16_t place[4] = {(int16_t)(20000 * x), (int16_t)(i % 2 * 9000), (int16_t)(20000 * z), 0};
        const float normal[4] = {(float)x, 0, (float)z, 0};
        memcpy(made->places[i], place, sizeof place);
        memcpy(made->normals[i], normal, sizeof normal);
        for (int k = 0; k < 3; k++) made->floats[i][k] = place[k];
        made->uvs[i][0] = (uint16_t)(i / 2 * 1000);
        made->uvs[i][1] = (uint16_t)(i % 2 * 65535);
    }
    for (unsigned i = 0; i < RING; i++) {
        const unsigned a = 2 * i, b = 2 * ((i + 1) % RING), quad[6] = {a, a + 1, b, b, a + 1, b + 1};
        memcpy(made->indices + 6 * i, quad, sizeof quad);
    }
}

typedef struct packed {
    unsigned char bytes[20000];
    size_t size, begin[4], length[4];
} packed;

static void add_vertices(packed *out, int view, const void *vertices, size_t stride)
{
    out->begin[view] = out->size;
    out->length[view] = meshopt_encodeVertexBuffer(out->bytes + out->size, sizeof out->bytes - out->size, vertices,
                                                   RING_VERTICES, stride);
    assert_true(out->length[view] > 0);
    out->size += (out->length[view] + 3) / 4 * 4;
}

static void add_indices(packed *out, const unsigned *indices, bool is_sequence)
{
    unsigned char *at = out->bytes + out->size;
    const size_t room = sizeof out->bytes - out->size;
    out->begin[3] = out->size;
    meshopt_encodeIndexVersion(1);
    out->length[3] = is_sequence ? meshopt_encodeIndexSequence(at, room, indices, RING_CORNERS)
                                 : meshopt_encodeIndexBuffer(at, room, indices, RING_CORNERS);
    assert_true(out->length[3] > 0);
    out->size += (out->length[3] + 3) / 4 * 4;
}

#define VIEW                                                                                                           \
    "{\"buffer\": 1, \"byteOffset\": %zu, \"byteLength\": %zu%s, \"extensions\": {\"EXT_meshopt_compression\": "       \
    "{\"buffer\": 0, \"byteOffset\": %zu, \"byteLength\": %zu, \"byteStride\": %d, \"count\": %d, \"mode\": "          \
    "\"%s\"%s}}}"

static void write_ring(const packed *in, bool has_floats, bool is_sequence)
{
    const int strides[4] = {has_floats ? 12 : 8, 4, 4, 2};
    char views[2000] = "", text[3000];
    size_t fallback = 0, length = 0;
    for (int i = 0; i < 4; i++) {
        char stride[40] = "";
        const int count = i == 3 ? RING_CORNERS : RING_VERTICES;
        const char *mode = i < 3 ? "ATTRIBUTES" : is_sequence ? "INDICES" : "TRIANGLES";
        const char *filter = i == 1                 ? ", \"filter\": \"OCTAHEDRAL\""
                             : i == 0 && has_floats ? ", \"filter\": \"EXPONENTIAL\""
                                                    : "";
        if (i < 3) snprintf(stride, sizeof stride, ", \"byteStride\": %d", strides[i]);
        length += (size_t)snprintf(views + length, sizeof views - length, "%s" VIEW, i > 0 ? ", " : "", fallback,
                                   (size_t)(count * strides[i]), stride, in->begin[i], in->length[i], strides[i], count,
                                   mode, filter);
        fallback += (size_t)(count * strides[i]);
    }
    snprintf(text, sizeof text,
             PICTURE_MATERIAL(
                 "") "\"buffers\": [{\"byteLength\": %zu, \"uri\": \"ring.bin\"}, {\"byteLength\": %zu, "
                     "\"extensions\": {\"EXT_meshopt_compression\": {\"fallback\": true}}}], \"bufferViews\": [%s], "
                     "\"accessors\": [{\"bufferView\": 0, \"componentType\": %d, \"count\": %d, \"type\": \"VEC3\"}, "
                     "{\"bufferView\": 1, \"componentType\": 5120, \"normalized\": true, \"count\": %d, \"type\": "
                     "\"VEC3\"}, "
                     "{\"bufferView\": 2, \"componentType\": 5123, \"normalized\": true, \"count\": %d, \"type\": "
                     "\"VEC2\"}, "
                     "{\"bufferView\": 3, \"componentType\": 5123, \"count\": %d, \"type\": \"SCALAR\"}]",
             in->size, fallback, views, has_floats ? 5126 : 5122, RING_VERTICES, RING_VERTICES, RING_VERTICES,
             RING_CORNERS);
    write_bytes("ring.bin", in->bytes, in->size);
    write_gltf("ring.gltf", "\"KHR_mesh_quantization\", \"EXT_meshopt_compression\"", text);
}

static void pack_ring(packed *out, const ring *made, bool has_floats, bool is_sequence)
{
    static float spread[RING_VERTICES][3];
    static signed char normals[RING_VERTICES][4];
    memset(out, 0, sizeof *out);
    if (has_floats) {
        meshopt_encodeFilterExp(spread, RING_VERTICES, sizeof spread[0], 20, made->floats[0]);
        add_vertices(out, 0, spread, sizeof spread[0]);
    } else {
        add_vertices(out, 0, made->places, sizeof made->places[0]);
    }
    meshopt_encodeFilterOct(normals, RING_VERTICES, sizeof normals[0], 8, made->normals[0]);
    add_vertices(out, 1, normals, sizeof normals[0]);
    add_vertices(out, 2, made->uvs, sizeof made->uvs[0]);
    add_indices(out, made->indices, is_sequence);
}

/* Triangles may begin at another of their corners. */
static void check_ring(const ring *made, double tolerance)
{
    nebel_scene *scene = load_file("ring.gltf");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->vertex_count, RING_VERTICES);
    assert_int_equal(mesh->triangle_count, RING_CORNERS / 3);
    for (int i = 0; i < RING_VERTICES; i++)
        for (int k = 0; k < 3; k++) {
            assert_true(fabs((double)mesh->positions[3 * i + k] - (double)made->floats[i][k]) <= tolerance);
            assert_true(fabsf(mesh->normals[3 * i + k] - made->normals[i][k]) < .02f);
            if (k < 2) assert_true(fabsf(mesh->uvs[2 * i + k] - made->uvs[i][k] / 65535.0f) < 1e-6f);
        }
    for (int i = 0; i < RING_CORNERS / 3; i++) {
        const uint32_t *got = mesh->indices + 3 * i;
        const unsigned *wanted = made->indices + 3 * i;
        int turn = 0;
        while (turn < 3 && got[0] != wanted[turn]) turn++;
        for (int k = 0; k < 3; k++) assert_int_equal(got[k], wanted[(turn + k) % 3]);
    }
    nebel_destroy_scene(scene);
}

static void test_compressed_views_are_decompressed(void **state)
{
    (void)state;
    static ring made;
    static packed out;
    make_ring(&made);
    write_picture("t.png");
    for (int i = 0; i < 4; i++) {
        pack_ring(&out, &made, i % 2 == 1, i >= 2);
        write_ring(&out, i % 2 == 1, i >= 2);
        check_ring(&made, i % 2 == 1 ? .05 : 0);
    }
}

/* What is damaged is refused, or is other numbers. */
static void test_damaged_compressed_views(void **state)
{
    (void)state;
    static ring made;
    static packed out;
    journal kept;
    nebel_result result;
    int refused = 0;
    make_ring(&made);
    pack_ring(&out, &made, false, false);
    for (size_t i = 0; i < 24; i++) {
        static packed bad;
        bad = out;
        if (i % 2 == 0)
            bad.bytes[(i * 1237) % out.size] ^= (unsigned char)(1 + i);
        else
            bad.length[i / 2 % 4] -= 1 + i;
        write_ring(&bad, false, false);
        nebel_destroy_scene(load("\"file\": \"ring.gltf\"", &result, &kept));
        assert_true(result == NEBEL_OK || result == NEBEL_ERROR_FORMAT);
        assert_null(strstr(kept.last, "reader"));
        refused += result != NEBEL_OK;
    }
    assert_true(refused >= 9);
}
#endif

#define ENGINE MODELS "glTF2/draco/2CylinderEngine"

typedef struct extent {
    double low[3], high[3];
    size_t triangles;
} extent;

static extent measure(const char *file)
{
    extent of = {{1e9, 1e9, 1e9}, {-1e9, -1e9, -1e9}, 0};
    nebel_scene *scene = load_file(file);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    for (size_t m = 0; m < data->mesh_count; m++) {
        of.triangles += data->meshes[m].triangle_count;
        for (size_t i = 0; i < 3 * (size_t)data->meshes[m].vertex_count; i++) {
            of.low[i % 3] = fmin(of.low[i % 3], (double)data->meshes[m].positions[i]);
            of.high[i % 3] = fmax(of.high[i % 3], (double)data->meshes[m].positions[i]);
        }
    }
    nebel_destroy_scene(scene);
    return of;
}

static void copy_file(const char *from, const char *to)
{
    char bytes[4096];
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    assert_true(in != NULL && out != NULL);
    for (size_t size; (size = fread(bytes, 1, sizeof bytes, in)) > 0;) fwrite(bytes, 1, size, out);
    fclose(in);
    fclose(out);
}

static char *read_text(const char *path)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    const size_t size = (size_t)ftell(file);
    char *text = malloc(size + 1);
    rewind(file);
    assert_int_equal(fread(text, 1, size, file), size);
    text[size] = '\0';
    fclose(file);
    return text;
}

/* Draco has floats; where accessors call them normalized integers nothing changes. */
static void test_draco(void **state)
{
    (void)state;
    static const char number[] = "\"componentType\": 5126";
    char data[200];
    if (access(ENGINE ".gltf", R_OK) != 0) skip();
    char *text = read_text(ENGINE ".gltf");
    for (char *at = text; (at = strstr(at, number)) != NULL;) memcpy(at, "\"componentType\": 5122", sizeof number - 1);
    assert_non_null(strstr(text, "5122"));
    write_text("engine.gltf", text);
    free(text);
    snprintf(data, sizeof data, "%s", in_folder("2CylinderEngine.bin"));
    copy_file(ENGINE ".bin", data);
    const extent plain = measure(MODELS "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"),
                 draco = measure(ENGINE ".gltf"), renamed = measure("engine.gltf");
    assert_true(draco.triangles > 110000 && draco.triangles <= plain.triangles); /* rounding makes some flat */
    for (int i = 0; i < 3; i++)
        assert_true(fabs(draco.low[i] - plain.low[i]) < .1 && fabs(draco.high[i] - plain.high[i]) < .1);
    assert_memory_equal(&renamed, &draco, sizeof draco);
}

/* ---- extensions and names -------------------------------------------------------------------- */

static void test_unknown_required_extensions_are_named(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    write_picture("t.png");
    write_bytes("quad.bin", bytes, fill_data(bytes, &integers[0]));
    describe_data(text, sizeof text, &integers[0], true, ", \"uri\": \"quad.bin\"");
    write_gltf("quad.gltf", "\"KHR_mesh_quantization\", \"VENDOR_unknown\"", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_UNSUPPORTED,
                  "requires the glTF extension \"VENDOR_unknown\", which is not supported");
    write_gltf("quad.gltf", "\"KHR_mesh_quantization\", \"KHR_materials_unlit\"", text);
    check_quad("quad.gltf", &integers[0], true);
    write_text("unused.gltf", "{\"asset\": {\"version\": \"2.0\"}, \"extensionsRequired\": "
                              "[\"KHR_draco_mesh_compression\"]}");
    assert_broken("\"file\": \"unused.gltf\"", NEBEL_ERROR_FORMAT, "does not name it in \"extensionsUsed\"");
#if defined(NEBEL_HAVE_MESHOPT)
    journal kept;
    nebel_result result;
    write_gltf("quad.gltf", "\"EXT_meshopt_compression\"", text);
    nebel_destroy_scene(load("\"file\": \"quad.gltf\"", &result, &kept));
    assert_int_equal(result, NEBEL_OK);
    assert_non_null(strstr(kept.last, "requires \"EXT_meshopt_compression\", but nothing in it is compressed"));
#endif
}

static void test_names_are_percent_encoded(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    mkdir(in_folder("a b"), 0700);
    write_bytes("a b/\xc3\xbc.bin", bytes, fill_data(bytes, &integers[1]));
    write_picture("t.png");
    describe_data(text, sizeof text, &integers[1], true, ", \"uri\": \"a%20b/%C3%bc.bin\"");
    write_gltf("quad.gltf", "", text);
    check_quad("quad.gltf", &integers[1], true);
    /* A name that only looks so is found, too, and no name leads out. */
    write_bytes("a%20.bin", bytes, fill_data(bytes, &integers[1]));
    describe_data(text, sizeof text, &integers[1], true, ", \"uri\": \"a%20.bin\"");
    write_gltf("quad.gltf", "", text);
    check_quad("quad.gltf", &integers[1], true);
    describe_data(text, sizeof text, &integers[1], true, ", \"uri\": \"%2e%2E/%2fetc/passwd\"");
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "outside the folder");
}

/* Names in Latin-1 were never allowed, but are read; what Assimp cannot read either is refused with line and column. */
static void test_json_that_is_none(void **state)
{
    (void)state;
    unsigned char bytes[200];
    char text[3000];
    journal kept;
    nebel_result result;
    write_picture("t.png");
    write_bytes("quad.bin", bytes, fill_data(bytes, &integers[0]));
    describe_data(text, sizeof text, &integers[0], true, ", \"uri\": \"quad.bin\", \"name\": \"\xfc\"");
    write_gltf("quad.gltf", "", text);
    nebel_destroy_scene(load("\"file\": \"quad.gltf\"", &result, &kept));
    assert_int_equal(result, NEBEL_OK);
    assert_non_null(strstr(kept.last, "is not UTF-8"));
    describe_data(text, sizeof text, &integers[0], true, ", ");
    write_gltf("quad.gltf", "", text);
    assert_broken("\"file\": \"quad.gltf\"", NEBEL_ERROR_FORMAT, "quad.gltf:1:");
}

/* The second example of KHR_texture_transform: the lower left quarter of the picture, turned. Two more by its formula. */
static void test_texture_coordinates_are_mapped(void **state)
{
    (void)state;
    static const struct {
        const char *map;
        double uvs[VERTICES][2];
    } cases[] = {{"\"offset\": [0, 1], \"rotation\": 1.57079632679, \"scale\": [0.5, 0.5]",
                  {{.5, .5}, {0, .5}, {.5, 1}, {0, 1}}},
                 {"\"offset\": [0, 1], \"scale\": [1, -1]", {{1, 0}, {1, 1}, {0, 0}, {0, 1}}},
                 {"\"rotation\": 1.57079632679, \"scale\": [2, 3]", {{3, -2}, {0, -2}, {3, 0}, {0, 0}}}};
    unsigned char bytes[200];
    write_picture("t.png");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[3000], whole[3400], extension[200];
        const size_t size = fill_data(bytes, &integers[0]);
        write_bytes("quad.bin", bytes, size);
        describe_data(text, sizeof text, &integers[0], true, ", \"uri\": \"quad.bin\"");
        char *index = strstr(text, "\"index\": 0") + strlen("\"index\": 0");
        snprintf(extension, sizeof extension, ", \"extensions\": {\"KHR_texture_transform\": {%s}}", cases[i].map);
        snprintf(whole, sizeof whole, "%.*s%s%s", (int)(index - text), text, extension, index);
        write_gltf("quad.gltf", "\"KHR_texture_transform\"", whole);
        nebel_scene *scene = load_file("quad.gltf");
        const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
        for (int v = 0; v < VERTICES; v++)
            for (int k = 0; k < 2; k++)
                if (fabs((double)mesh->uvs[2 * v + k] - cases[i].uvs[v][k]) > 1e-5)
                    fail_msg("%s: corner %d: %g %g", cases[i].map, v, (double)mesh->uvs[2 * v],
                             (double)mesh->uvs[2 * v + 1]);
        nebel_destroy_scene(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_integers_become_floats),
        cmocka_unit_test(test_integers_in_a_binary_file),
        cmocka_unit_test(test_integers_beyond_their_data_are_refused),
#if defined(NEBEL_HAVE_MESHOPT)
        cmocka_unit_test(test_compressed_views_are_decompressed),
        cmocka_unit_test(test_damaged_compressed_views),
#endif
        cmocka_unit_test(test_draco),
        cmocka_unit_test(test_unknown_required_extensions_are_named),
        cmocka_unit_test(test_names_are_percent_encoded),
        cmocka_unit_test(test_json_that_is_none),
        cmocka_unit_test(test_texture_coordinates_are_mapped)
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder_tree);
}
