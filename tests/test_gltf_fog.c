#define _XOPEN_SOURCE 700
/* Fog in the nodes of glTF models. */
#include "scene_help.h"

#include <fcntl.h>
#include <math.h>
#include <unistd.h>

#define GLTF "test_gltf_fog.gltf"
#define GLB "test_gltf_fog.glb"
#define HEAD "{\"asset\": {\"version\": \"2.0\"}, "

static void write_file(const char *name, const void *bytes, size_t size)
{
    FILE *stream = fopen(name, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(bytes, 1, size, stream), size);
    fclose(stream);
}

static void write_gltf(const char *members)
{
    char text[4000];
    const int size = snprintf(text, sizeof text, HEAD "%s}", members);
    write_file(GLTF, text, (size_t)size);
}

#define NODE(members) "\"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"name\": \"Mist\", " members "}]"
#define MODEL(members) "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"" GLTF "\"" members "}]}"

/* ---- the same fog, written by hand ----------------------------------------------------------- */

enum { RAYS = 3000 };

static void trace(const nebel_scene *scene, nebel_transfer *transfers)
{
    static nebel_ray rays[RAYS];
    uint32_t seed = 5;
    for (int i = 0; i < RAYS; i++) {
        double numbers[6];
        for (int k = 0; k < 6; k++) numbers[k] = (double)(seed = seed * 1664525u + 1013904223u) / 4294967296.0 - .5;
        rays[i] =
            (nebel_ray){{16 * numbers[0], 16 * numbers[1], 16 * numbers[2]}, {numbers[3], numbers[4], numbers[5]}, 30};
    }
    scene_trace(scene, 0, (nebel_trace_desc){.tolerance = 1e-12}, RAYS, rays, transfers);
}

static void assert_same_fog(const char *members, const char *model, const char *fog)
{
    static nebel_transfer got[RAYS], wanted[RAYS];
    char text[2000];
    write_gltf(members);
    nebel_scene *node = parse_good(model);
    snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [%s]}", fog);
    nebel_scene *hand = parse_good(text);
    trace(node, got);
    trace(hand, wanted);
    int touched = 0;
    for (int i = 0; i < RAYS; i++) {
        touched += wanted[i].transmittance[0] < .99;
        for (int c = 0; c < 3; c++)
            if (!(fabs(got[i].transmittance[c] - wanted[i].transmittance[c]) <= 1e-11) ||
                !(fabs(got[i].in_scattering[c] - wanted[i].in_scattering[c]) <= 1e-11))
                fail_msg("%s\n ray %d: T %.17g, not %.17g", members, i, got[i].transmittance[c],
                         wanted[i].transmittance[c]);
    }
    assert_true(touched > 10);
    nebel_destroy_scene(node);
    nebel_destroy_scene(hand);
}

#define AMOUNT "\"extinction\": 0.4, \"source\": [0.1, 0.2, 0.3]"
#define EXTRAS(more)                                                                                                   \
    "\"extras\": {\"nebel_extinction\": 0.4, \"nebel_source\": [0.1, 0.2, 0.3], \"cycles\": {\"nebel_\": 1}" more "}"

static void test_named_shapes_are_as_large_as_empties(void **state)
{
    (void)state;
    assert_same_fog(NODE("\"translation\": [1, 2, 3], \"scale\": [2, 3, 4], " EXTRAS("")), MODEL(""),
                    "{" AMOUNT ", \"shape\": {\"type\": \"box\", \"min\": [-1, -1, -1], \"max\": [3, 5, 7]}}");
    assert_same_fog(NODE("\"translation\": [1, 2, 3], \"scale\": [2, 3, 4], " EXTRAS(", \"nebel_shape\": \"sphere\"")),
                    MODEL(""),
                    "{" AMOUNT ", \"shape\": {\"type\": \"ellipsoid\", \"center\": [1, 2, 3], \"radii\": [2, 3, 4]}}");
    assert_same_fog(NODE("\"scale\": [2, 3, 2], " EXTRAS(", \"nebel_shape\": \"cylinder\"")), MODEL(""),
                    "{" AMOUNT
                    ", \"shape\": {\"type\": \"cylinder\", \"from\": [0, -3, 0], \"to\": [0, 3, 0], \"radius\": 2}}");
    assert_same_fog(NODE("\"rotation\": [0, 0, -0.7071067811865476, 0.7071067811865476], \"scale\": [5, 5, 5], " EXTRAS(
                        ", \"nebel_shape\": \"cone\"")),
                    MODEL(""),
                    "{" AMOUNT ", \"shape\": {\"type\": \"cone\", \"from\": [-5, 0, 0], \"to\": [5, 0, 0], "
                    "\"radius_from\": 5, \"radius_to\": 0}}");
    assert_same_fog(NODE(EXTRAS(", \"nebel_shape\": \"world\", \"nebel_name\": \"haze\"")), MODEL(""),
                    "{" AMOUNT ", \"shape\": {\"type\": \"world\"}}");
}

/* A node that hangs on others, in a model that is turned, scaled and moved, in a scene in centimetres with z up. */
static void test_a_node_goes_where_its_model_goes(void **state)
{
    (void)state;
    static const char nodes[] =
        "\"scenes\": [{\"nodes\": [2]}], \"nodes\": [{\"translation\": [1, 0, 0], \"scale\": [0.5, 1, 2], " EXTRAS(
            "") "}, "
                "{\"matrix\": [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 3, 0, 1], \"children\": [0]}, {\"children\": "
                "[1], \"scale\": [2, 2, 2]}]";
    static const char fog[] = "{" AMOUNT ", \"shape\": {\"type\": \"box\", \"min\": [-4, 4, -3], \"max\": [4, 8, -1]}}";
    assert_same_fog(nodes, MODEL(""), fog);
    static const char moved[] = "{" AMOUNT ", \"shape\": {\"type\": \"box\", \"min\": [-4, 4, -3], \"max\": [4, 8, "
                                "-1], \"transform\": {\"position\": [1, -2, 3], "
                                "\"rotation\": [0, 0.6, 0, 0.8], \"scale\": [1, 1, -1]}}}";
    assert_same_fog(nodes, MODEL(", \"position\": [1, -2, 3], \"rotation\": [0, 0.6, 0, 0.8], \"scale\": [1, 1, -1]"),
                    moved);
    assert_same_fog(nodes,
                    "{\"nebel\": 1, \"up\": \"z\", \"unit\": 0.01, \"fog\": [], \"models\": [{\"file\": \"" GLTF
                    "\", \"position\": [100, -300, -200], "
                    "\"rotation\": [0, 0, 0.6, 0.8], \"scale\": [1, -1, 1]}]}",
                    moved);
    assert_same_fog(nodes, MODEL(", \"up\": \"z\", \"unit\": 0.5"),
                    "{" AMOUNT ", \"shape\": {\"type\": \"box\", \"min\": [-2, -1.5, -4], \"max\": [2, -0.5, -2]}}");
}

static void test_densities_move_with_their_node(void **state)
{
    (void)state;
    assert_same_fog(NODE("\"translation\": [1, 2, 3], \"scale\": [5, 5, 5], " EXTRAS(
                        ", \"nebel_shape\": \"sphere\", \"nebel_density\": \"radial\"")),
                    MODEL(""),
                    "{" AMOUNT ", \"density\": {\"type\": \"radial\"}, \"shape\": {\"type\": \"sphere\", \"center\": "
                    "[1, 2, 3], \"radius\": 5}}");
    assert_same_fog(NODE("\"translation\": [1, 2, 3], \"scale\": [5, 4, 3], " EXTRAS(
                        ", \"nebel_density\": {\"type\": \"height\", \"scale_height\": 2, "
                        "\"base\": 1}")),
                    MODEL(""),
                    "{" AMOUNT ", \"density\": {\"type\": \"height\", \"base\": 3, \"scale_height\": 2}, \"shape\": "
                    "{\"type\": \"box\", \"min\": [-4, -2, 0], "
                    "\"max\": [6, 6, 6]}}");
    assert_same_fog(NODE("\"translation\": [1, 2, 3], \"scale\": [5, 5, -5], " EXTRAS(
                        ", \"nebel_density\": {\"type\": \"gaussian\", \"sigma\": 0.5, "
                        "\"center\": [0, 0, 0.2]}")),
                    MODEL(""),
                    "{" AMOUNT ", \"density\": {\"type\": \"gaussian\", \"center\": [1, 2, 2], \"sigma\": 2.5}, "
                    "\"shape\": {\"type\": \"box\", "
                    "\"min\": [-4, -3, -2], \"max\": [6, 7, 8]}}");
    assert_same_fog(
        NODE("\"translation\": [1, 2, 3], \"rotation\": [0, 0, -0.7071067811865476, 0.7071067811865476], \"scale\": "
             "[4, 5, 6], " EXTRAS(
                 ", \"nebel_density\": {\"type\": \"linear\", \"from\": [0.5, -1, 0], \"to\": [0.5, 1, 0]}")),
        MODEL(""),
        "{" AMOUNT ", \"density\": {\"type\": \"linear\", \"from\": [-4, 0, 0], \"to\": [6, 0, 0]}, \"shape\": "
        "{\"type\": \"box\", "
        "\"min\": [-4, -2, -3], \"max\": [6, 6, 9]}}");
    /* Across the scales: the planes of equal density are stretched, their normal is not. */
    assert_same_fog(NODE("\"scale\": [4, 8, 4], " EXTRAS(
                        ", \"nebel_density\": {\"type\": \"linear\", \"from\": [-1, -1, 0], \"to\": [1, 1, 0]}")),
                    MODEL(""),
                    "{" AMOUNT ", \"density\": {\"type\": \"linear\", \"from\": [-4, -8, 0], \"to\": [8.8, -1.6, 0]}, "
                    "\"shape\": {\"type\": \"box\", "
                    "\"min\": [-4, -8, -4], \"max\": [4, 8, 4]}}");
    assert_same_fog(
        NODE("\"scale\": [5, 5, 5], " EXTRAS(", \"nebel_density\": {\"type\": \"soft_edge\", \"distance\": 0.4}")),
        MODEL(""),
        "{" AMOUNT ", \"density\": {\"type\": \"soft_edge\", \"distance\": 2}, \"shape\": {\"type\": \"box\", \"min\": "
        "[-5, -5, -5], "
        "\"max\": [5, 5, 5]}}");
}

static void test_all_of_it_in_one_property(void **state)
{
    (void)state;
    static const char hand[] =
        "{" AMOUNT ", \"shape\": {\"type\": \"capsule\", \"from\": [0, 0, 0], \"to\": [0, 6, 0], \"radius\": 3}}";
    assert_same_fog(NODE("\"scale\": [3, 3, 3], \"extras\": {\"nebel\": {\"extinction\": 0.4, \"source\": [0.1, 0.2, "
                         "0.3], \"shape\": {\"type\": \"capsule\", "
                         "\"from\": [0, 0, 0], \"to\": [0, 2, 0], \"radius\": 1}}}"),
                    MODEL(""), hand);
    assert_same_fog(
        NODE("\"scale\": [3, 3, 3], \"extras\": {\"nebel\": \"{\\\"extinction\\\": 0.4, \\\"source\\\": [0.1, 0.2, "
             "0.3], /* in m */ \\\"shape\\\": "
             "{\\\"type\\\": \\\"capsule\\\", \\\"from\\\": [0, 0, 0], \\\"to\\\": [0, 2, 0], \\\"radius\\\": 1}}\"}"),
        MODEL(""), hand);
}

static void test_what_a_scene_does_not_show_is_no_fog(void **state)
{
    (void)state;
    write_gltf("\"scene\": 1, \"scenes\": [{\"nodes\": [0]}, {\"nodes\": [2]}], \"nodes\": [{\"name\": \"a\", " EXTRAS(
        "") "}, {\"name\": \"b\", " EXTRAS("") "}, {\"name\": \"c\", \"children\": [3]}, {\"name\": \"d\", \"extras\": "
                                               "{\"nebel_extinction\": 1, \"nebel_name\": \"\\u00fc\"}}, "
                                               "{\"name\": \"e\", " EXTRAS("") "}]");
    nebel_scene *scene = parse_good(MODEL(""));
    assert_int_equal(nebel_get_scene_data(scene)->volume_count, 1);
    assert_string_equal(nebel_get_scene_data(scene)->volume_names[0], "\xC3\xBC");
    nebel_destroy_scene(scene);
    write_gltf(NODE(EXTRAS("")));
    scene = parse_good(MODEL(""));
    assert_string_equal(nebel_get_scene_data(scene)->volume_names[0], "Mist");
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK); /* no triangle, but fog */
    nebel_destroy_scene(scene);
}

static void test_binary_files(void **state)
{
    (void)state;
    static const char json[] = HEAD NODE(EXTRAS("")) "}";
    unsigned char file[2000] = "glTF\2\0\0\0";
    const size_t size = (sizeof json - 1 + 3) / 4 * 4, whole = 20 + size;
    memset(file + 20, ' ', size);
    memcpy(file + 20, json, sizeof json - 1);
    for (int i = 0; i < 4; i++) {
        file[8 + i] = (unsigned char)(whole >> 8 * i);
        file[12 + i] = (unsigned char)(size >> 8 * i);
    }
    memcpy(file + 16, "JSON", 4);
    write_file(GLB, file, whole);
    static const char model[] = "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"" GLB "\"}]}";
    nebel_scene *scene = parse_good(model);
    assert_int_equal(nebel_get_scene_data(scene)->volume_count, 1);
    nebel_destroy_scene(scene);
    const nebel_scene_desc silent = {.host.log = {NULL, NULL}};
    for (size_t cut = 0; cut < 20; cut++) { /* said when the model is loaded */
        write_file(GLB, file, cut);
        assert_int_equal(nebel_parse_scene(model, strlen(model), "test.json", &silent, &scene), NEBEL_OK);
        assert_int_equal(nebel_get_scene_data(scene)->volume_count, 0);
        assert_int_equal(nebel_load_scene_models(scene), NEBEL_ERROR_FORMAT);
        nebel_destroy_scene(scene);
    }
}

/* ---- rules ----------------------------------------------------------------------------------- */

/* The mark ` stands in the model where the message must point: after "node", if any, where it says GLTF. */
static void assert_broken(const char *members, nebel_result wanted, const char *node, const char *message)
{
    meter m;
    journal kept;
    char expected[500], place[32], whole[2000];
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    snprintf(whole, sizeof whole, HEAD "%s}", members);
    char *text = unmark(whole, place);
    write_file(GLTF, text, strlen(text));
    assert_int_equal(nebel_parse_scene(MODEL(""), strlen(MODEL("")), "a.json", &desc, &scene), wanted);
    snprintf(expected, sizeof expected, "a.json:1:45: models[0].file: %s%s%s%s%s", node,
             place[0] != '\0' ? GLTF ":" : "", place, place[0] != '\0' ? ": " : "", message);
    if (strncmp(kept.last, expected, strlen(expected)) != 0) fail_msg("%s\n is not %s", kept.last, expected);
    assert_int_equal(kept.count, 1);
    assert_null(scene);
    assert_int_equal(m.live, 0);
    free(text);
}

#define MIST "node \"Mist\": "
#define PROPERTIES(members) NODE("\"extras\": {" members "}")

static void test_messages_name_the_node(void **state)
{
    (void)state;
    assert_broken(PROPERTIES("`\"nebel_visibilty\": 3"), FORMAT, MIST,
                  "nodes[0].extras.nebel_visibilty: unknown key; a fog node has: nebel_name, nebel_shape");
    assert_broken(PROPERTIES("\"nebel_visibility\": `0"), FORMAT, MIST,
                  "nodes[0].extras.nebel_visibility: is 0; must be");
    assert_broken(NODE("\"extras\": `{\"nebel_source\": 0}"), FORMAT, MIST, "nodes[0].extras: the amount is missing");
    assert_broken(PROPERTIES("\"nebel_extinction\": 1, `\"nebel_keys\": []"), FORMAT, MIST,
                  "nodes[0].extras.nebel_keys: unknown key");
    assert_broken(PROPERTIES("\"nebel_extinction\": 1, \"nebel_shape\": `\"cube\""), FORMAT, MIST,
                  "nodes[0].extras.nebel_shape: unknown; must be one of: box, sphere, cylinder, cone, world");
    assert_broken(PROPERTIES("\"nebel_extinction\": 1, \"nebel_density\": `\"radial\""), FORMAT, MIST,
                  "nodes[0].extras.nebel_density: \"radial\" does not fit this shape");
    assert_broken(PROPERTIES("\"nebel\": {\"extinction\": 1}, `\"nebel_source\": 1"), FORMAT, MIST,
                  "nodes[0].extras.nebel_source: does not go with \"nebel\"");
    assert_broken(NODE("\"mesh\": 0, \"extras\": `{\"nebel_extinction\": 1}"), FORMAT, MIST,
                  "nodes[0].extras: has fog and a mesh");
}

static void test_messages_about_a_text_in_a_property(void **state)
{
    (void)state;
    assert_broken(PROPERTIES("\"nebel\": \"{\\\"extinction\\\": -1}\""), FORMAT, MIST,
                  "extras:1:16: nebel.extinction: is -1; must be an amount from 0 to 1e9 per metre");
    assert_broken(PROPERTIES("\"nebel\": \"{\\n\\\"extinction\\\": -1}\""), FORMAT, MIST,
                  "extras:2:15: nebel.extinction: is -1; must be an amount from 0 to 1e9 per metre");
    assert_broken(PROPERTIES("\"nebel\": \"{\\\"extinction\\\": 1\""), FORMAT, MIST, "extras:1:18: ");
    assert_broken(PROPERTIES("\"nebel\": \"fog\""), FORMAT, MIST, "extras:1:1: ");
}

static void test_messages_about_nodes(void **state)
{
    (void)state;
    assert_broken(NODE("\"scale\": [1, 0, 1], \"extras\": `{\"nebel_extinction\": 1}"), FORMAT, MIST,
                  "nodes[0].extras: is flat or sheared");
    assert_broken(NODE("\"scale\": [1, 1, 2], \"extras\": `{\"nebel_extinction\": 1, \"nebel_density\": {\"type\": "
                       "\"gaussian\", \"center\": [0, 0, 0], \"sigma\": 1}}"),
                  FORMAT, MIST, "nodes[0].extras: has a gaussian density, but");
    assert_broken("\"nodes\": [{\"children\": [1], \"scale\": [1, 2, 1]}, {\"rotation\": [0.4, 0, 0, 0.9], \"extras\": "
                  "`{\"nebel_extinction\": 1}}]",
                  FORMAT, "node \"1\": ", "nodes[1].extras: is flat or sheared");
    assert_broken("\"nodes\": [{\"matrix\": `[1], " EXTRAS("") "}]", FORMAT, "",
                  "nodes[0].matrix: has 1 elements; must be an array of 16");
    assert_broken("\"nodes\": [{\"children\": [`-1], " EXTRAS("") "}]", FORMAT, "",
                  "nodes[0].children[0]: is -1; must be the number of a node");
    assert_broken("\"nodes\": [{" EXTRAS("") "}`", FORMAT, "", "nodes: } cannot close the array");
}

/* Nodes that hang on each other are in no scene. */
static void test_rings_of_nodes(void **state)
{
    (void)state;
    write_gltf("\"nodes\": [{\"children\": [1, 77], " EXTRAS("") "}, {\"children\": [0]}]");
    nebel_scene *scene = parse_good(MODEL(""));
    assert_int_equal(nebel_get_scene_data(scene)->volume_count, 0);
    nebel_destroy_scene(scene);
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    write_gltf(NODE("\"extras\": {\"nebel\": \"{\\\"extinction\\\": 1}\"}"));
    parse_without_memory(MODEL(""));
}

/* Any byte may be another: a scene or an error with a message, and all memory back. */
static void test_every_garbled_byte_is_survived(void **state)
{
    (void)state;
    static const char whole[] =
        HEAD "\"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"children\": [1], \"scale\": [1, 2, 3]}, "
             "{\"extras\": {\"nebel\": \"{\\\"extinction\\\": 1}\"}, \"rotation\": [0, 0, 0, 1]}]}";
    static const char others[] = "\0{}[]\"\\,:9-ne";
    const int file = open(GLTF, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    for (size_t i = 0; i < sizeof whole - 1; i++)
        for (size_t k = 0; k < sizeof others - 1; k++) {
            meter m;
            journal kept;
            char text[sizeof whole];
            nebel_scene *scene = NULL;
            const nebel_scene_desc desc = metered_desc(&m, &kept);
            memcpy(text, whole, sizeof whole);
            text[i] = others[k];
            /* Written over in place: a file that is made anew takes a disk a hundred times as long. */
            const size_t size = k == 0 ? i : sizeof whole - 1;
            assert_int_equal(pwrite(file, text, size, 0), (long)size);
            if (k < 2) assert_int_equal(ftruncate(file, (off_t)size), 0);
            const nebel_result result = nebel_parse_scene(MODEL(""), strlen(MODEL("")), "a.json", &desc, &scene);
            assert_int_equal(result == NEBEL_OK, scene != NULL);
            assert_int_equal(result == NEBEL_OK, kept.count == 0);
            nebel_destroy_scene(scene);
            assert_int_equal(m.live, 0);
        }
    close(file);
}

static int clean_up(void **state)
{
    (void)state;
    remove(GLTF);
    remove(GLB);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_named_shapes_are_as_large_as_empties),
        cmocka_unit_test(test_a_node_goes_where_its_model_goes),
        cmocka_unit_test(test_densities_move_with_their_node),
        cmocka_unit_test(test_all_of_it_in_one_property),
        cmocka_unit_test(test_what_a_scene_does_not_show_is_no_fog),
        cmocka_unit_test(test_binary_files),
        cmocka_unit_test(test_messages_name_the_node),
        cmocka_unit_test(test_messages_about_a_text_in_a_property),
        cmocka_unit_test(test_messages_about_nodes),
        cmocka_unit_test(test_rings_of_nodes),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
        cmocka_unit_test(test_every_garbled_byte_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, clean_up);
}
