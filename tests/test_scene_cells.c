/* The section "cells" of scene files: what it becomes, what is wrong with it, and how it is saved. */
#define _POSIX_C_SOURCE 200809L

#include "near.h"
#include "scene_help.h"

#include <math.h>
#include <unistd.h>

#define SCENE(members) "{\"nebel\": 1, \"fog\": [], \"cells\": {" members "}}"
#define HALL                                                                                                           \
    "{\"name\": \"hall\", \"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [4, 3, 9]}, \"density\": 0.2}"
#define CRYPT                                                                                                          \
    "{\"name\": \"crypt\", \"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [9, 3, 9]}, \"density\": 0.1, " \
    "\"color\": [0.5, 0.25, 1]}"
#define CELL(members) SCENE("\"cells\": [" HALL ", {" members "}]")
#define DOOR "[[4, 0, 4], [4, 2, 4], [4, 2, 6], [4, 0, 6]]"
#define PORTALS(portals) SCENE("\"cells\": [" HALL ", " CRYPT "], \"portals\": " portals)
#define AND(members) SCENE("\"cells\": [" HALL "], " members)

/* ---- what it becomes ------------------------------------------------------------------------- */

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("\"cells\": [" HALL ", " CRYPT "], \"model\": \"exponential\", \"span\": "
                                          "\"printed\", \"grouping\": false, \"portals\": [{\"cells\": [\"crypt\", "
                                          "\"hall\"], \"polygon\": " DOOR "}]"));
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    const nebel_cells_desc *cells = data->cells;
    assert_int_equal(cells->cell_count, 2);
    assert_string_equal(data->cell_names[1], "crypt");
    assert_int_equal(cells->cells[1].shape.type, NEBEL_SHAPE_BOX);
    assert_number(cells->cells[1].shape.max[0], 9);
    assert_number(cells->cells[1].density, .1);
    assert_number(cells->cells[1].color[2], 1);
    assert_int_equal(cells->model, NEBEL_CELL_EXPONENTIAL);
    assert_int_equal(cells->span, NEBEL_SPAN_PRINTED);
    assert_int_equal(cells->ungrouped, 1);
    assert_int_equal(cells->portal_count, 1);
    assert_int_equal(cells->portals[0].cells[0], 1);
    assert_int_equal(cells->portals[0].cells[1], 0);
    assert_int_equal(cells->portals[0].vertex_count, 4);
    assert_number(cells->portals[0].vertices[2][2], 6);
    nebel_destroy_scene(scene);
}

static void test_what_it_leaves_out(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good(SCENE("\"cells\": [{\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}}]"));
    const nebel_cells_desc *cells = nebel_get_scene_data(scene)->cells;
    assert_int_equal(cells->model, NEBEL_CELL_LINEAR);
    assert_int_equal(cells->span, NEBEL_SPAN_RAY);
    assert_int_equal(cells->ungrouped, 0);
    assert_null(cells->portals);
    assert_number(cells->cells[0].density, 0);
    assert_string_equal(nebel_get_scene_data(scene)->cell_names[0], "");
    nebel_destroy_scene(scene);
    scene = parse_good(PORTALS("\"derived\""));
    assert_null(nebel_get_scene_data(scene)->cells->portals);
    nebel_destroy_scene(scene);
    scene = parse_good(PORTALS("[]"));
    assert_non_null(nebel_get_scene_data(scene)->cells->portals);
    nebel_destroy_scene(scene);
    scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_null(nebel_get_scene_data(scene)->cells);
    nebel_destroy_scene(scene);
}

/* Centimetres, z up. */
static void test_other_units_and_axes(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"unit\": 0.01, \"up\": \"z\", \"fog\": [], \"cells\": {\"cells\": ["
        "{\"name\": \"a\", \"density\": 0.002, \"shape\": {\"type\": \"box\", \"min\": [0, 100, 200], \"max\": [400, "
        "300, "
        "500]}}, {\"name\": \"b\", \"shape\": {\"type\": \"convex\", \"planes\": [[0, 0, 1, 700], [0, 0, -1, -500], "
        "[1, 0, "
        "0, 400], [-1, 0, 0, 0], [0, 1, 0, 300], [0, -1, 0, -100]]}}], \"portals\": [{\"cells\": [\"a\", \"b\"], "
        "\"polygon\": [[0, 100, 500], [400, 100, 500], [400, 300, 500]]}]}}");
    const nebel_cells_desc *cells = nebel_get_scene_data(scene)->cells;
    const double *min = cells->cells[0].shape.min, *vertex = cells->portals[0].vertices[1];
    assert_number(cells->cells[0].density, .2);
    assert_number(min[0], 0);
    assert_number(min[1], 2);
    assert_number(min[2], -3);
    assert_number(cells->cells[1].shape.planes[0].normal[1], 1);
    assert_number(cells->cells[1].shape.planes[0].distance, 7);
    assert_number(vertex[0], 4);
    assert_number(vertex[1], 5);
    assert_number(vertex[2], -1);
    nebel_destroy_scene(scene);
}

/* To everything but the method of their own they are volumes. */
static void test_cells_are_exact_fog_too(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("\"cells\": [" HALL ", " CRYPT "]"));
    nebel_snapshot *fog = NULL;
    assert_int_equal(nebel_commit_scene_fog(scene, &fog), NEBEL_OK);
    assert_int_equal(nebel_get_volume_count(fog), 2);
    const nebel_ray ray = {.origin = {1, 1, 1}, .direction = {1, 0, 0}, .t_max = 6};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    assert_number(transfer.transmittance[0], exp(-.6 - .3));
    assert_number(transfer.in_scattering[2], exp(-.6) * (1 - exp(-.3)));
    nebel_release_snapshot(fog);
    nebel_destroy_scene(scene);
}

/* ---- what is wrong with it ------------------------------------------------------------------- */

static void test_what_no_cell_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{\"nebel\": 1, \"fog\": [], \"cells\": `[]}", "cells: is an array; must be an object {\"cells\": "},
        {FORMAT, "{\"nebel\": 1, \"fog\": [], \"cells\": `{}}",
         "cells: the key \"cells\" is missing; the section \"cells\" needs it"},
        {FORMAT, AND("`\"portal\": []"),
         "cells.portal: unknown key; the section \"cells\" has: cells, portals, model, span, grouping; did you mean "
         "\"portals\"?"},
        {FORMAT, SCENE("\"cells\": `{}"), "cells.cells: is an object; must be an array of cells"},
        {FORMAT, SCENE("\"cells\": `[]"), "cells.cells: holds 0 cells; must hold 1 to 1024"},
        {FORMAT, SCENE("\"cells\": [`1]"), "cells.cells[0]: is a number; must be a cell"},
        {FORMAT, SCENE("\"cells\": [`{}]"), "cells.cells[0]: the key \"shape\" is missing; a cell needs it"},
        {FORMAT, CELL("`\"extinction\": 1"),
         "cells.cells[1].extinction: unknown key; a cell has: name, shape, density, color"},
        {FORMAT, CELL("\"name\": `\"hall\", \"shape\": {}"), "cells.cells[1].name: is the name of cells[0], too"},
        {FORMAT, CELL("\"density\": `-0.5, \"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [5, 1, 1]}"),
         "cells.cells[1].density: is -0.5; must be an amount from 0 to 1e9 per metre"},
        {FORMAT,
         CELL("\"density\": `[1, 1, 1], \"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [5, 1, 1]}"),
         "cells.cells[1].density: is an array; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, CELL("\"color\": `-1, \"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [5, 1, 1]}"),
         "cells.cells[1].color: is -1; must be a number from 0 to 1e9"},
        {FORMAT,
         SCENE("\"cells\": [" HALL ", {\"shape\": `{\"type\": \"sphere\", \"center\": [9, 9, 9], \"radius\": 1}}]"),
         "cells.cells[1].shape: is neither a box nor a convex body of planes; split what is not convex"},
        {FORMAT, SCENE("\"cells\": [" HALL ", `{\"shape\": {\"type\": \"convex\", \"planes\": [[1, 0, 0, 1]]}}]"),
         "cells.cells[1]: has no end towards -x; a cell needs planes all around"},
        {FORMAT,
         CELL("\"shape\": {\"type\": \"convex\", \"planes\": `[[1, 0, 0, -1], [-1, 0, 0, -1], [0, 1, 0, -1], [0, -1, "
              "0, -1], [0, 0, 1, -1], [0, 0, -1, -1]]}"),
         "cells.cells[1].shape.planes: no point is inside all planes; the body is empty: its normals point inwards"},
        {FORMAT, CELL("\"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [`3, 1, 1]}"),
         "cells.cells[1].shape.max[0]: is 3; must be greater than min[0], which is 4"},
        {FORMAT,
         SCENE("\"cells\": [" HALL ", `{\"shape\": {\"type\": \"box\", \"min\": [1, 1, 1], \"max\": [2, 2, 2]}}]"),
         "cells.cells[1]: overlaps cell 0; cells may touch, but share no place"},
    };
    CHECK(rules);
}

static void test_what_no_portal_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, PORTALS("`\"found\""), "cells.portals: unknown; must be one of: derived"},
        {FORMAT, PORTALS("`{}"), "cells.portals: is an object; must be \"derived\" or an array of portals"},
        {FORMAT, PORTALS("[`7]"), "cells.portals[0]: is a number; must be a portal"},
        {FORMAT, PORTALS("[`{\"polygon\": " DOOR "}]"),
         "cells.portals[0]: the key \"cells\" is missing; a portal needs"},
        {FORMAT, PORTALS("[{\"cells\": `[\"hall\"], \"polygon\": " DOOR "}]"),
         "cells.portals[0].cells: names 1 cells; a portal joins two"},
        {FORMAT, PORTALS("[{\"cells\": [\"hall\", `\"cript\"], \"polygon\": " DOOR "}]"),
         "cells.portals[0].cells[1]: is the name of no cell"},
        {FORMAT, PORTALS("[{\"cells\": [`\"\", \"hall\"], \"polygon\": " DOOR "}]"),
         "cells.portals[0].cells[0]: is the name of no cell"},
        {FORMAT, PORTALS("[`{\"cells\": [\"hall\", \"hall\"], \"polygon\": " DOOR "}]"),
         "cells.portals[0]: joins cell 0 with itself; it must join two"},
        {FORMAT, PORTALS("[{\"cells\": [\"hall\", \"crypt\"], \"polygon\": `[[4, 0, 4], [4, 2, 4]]}]"),
         "cells.portals[0].polygon: holds 2 vertices; must hold 3 to 64"},
        {FORMAT, PORTALS("[{\"cells\": [\"hall\", \"crypt\"], \"polygon\": [[4, 0, 4], [4, 2, 4], [4, `\"a\", 5]]}]"),
         "cells.portals[0].polygon[2][1]: is a string"},
        {FORMAT,
         PORTALS("[{\"cells\": [\"hall\", \"crypt\"], \"polygon\": " DOOR "}, `{\"cells\": [\"hall\", \"crypt\"], "
                 "\"polygon\": [[4, 0, 4], [4, 2, 4], [3, 2, 6]]}]"),
         "cells.portals[1]: vertex 2 is 1 m outside cell 1; a portal lies where its two cells touch"},
        {FORMAT,
         PORTALS(
             "[`{\"cells\": [\"hall\", \"crypt\"], \"polygon\": [[4, 0, 4], [4, 2, 4], [4, 0.5, 4.5], [4, 0, 6]]}]"),
         "cells.portals[0]: is not convex"},
        {FORMAT, AND("\"model\": `\"exp\""), "cells.model: unknown; must be one of: linear, exponential"},
        {FORMAT, AND("\"span\": `\"z\""), "cells.span: unknown; must be one of: ray, depth, printed"},
        {FORMAT, AND("\"grouping\": `1"), "cells.grouping: is a number; must be true or false"},
    };
    CHECK(rules);
}

static void test_memory_runs_out(void **state)
{
    (void)state;
    static const char text[] = PORTALS("[{\"cells\": [\"hall\", \"crypt\"], \"polygon\": " DOOR "}]");
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (long fail = 0; result != NEBEL_OK && fail < 500; fail++) {
        meter m;
        journal kept;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        nebel_scene *scene = NULL;
        m.fail_at = fail;
        result = nebel_parse_scene(text, strlen(text), "a.json", &desc, &scene);
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
    }
    assert_int_equal(result, NEBEL_OK);
}

/* ---- saving ---------------------------------------------------------------------------------- */

static char path[32];

static void make_file(void)
{
    strcpy(path, "/tmp/nebel_cells_XXXXXX");
    const int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
}

static void write_text(const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    fclose(file);
}

static void check_text(const char *wanted)
{
    char text[4096];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(text, wanted);
}

static void test_only_what_changes_is_written(void **state)
{
    (void)state;
    static const char before[] = "{\"nebel\": 1, \"unit\": 0.5, \"fog\": [], \"cells\": {\"cells\": [" HALL ", " CRYPT
                                 "] /* two */, \"model\": \"linear\"}}";
    static const char after[] =
        "{\"nebel\": 1, \"unit\": 0.5, \"fog\": [], \"cells\": {\"cells\": [{\"name\": \"hall\", \"shape\": {\"type\": "
        "\"box\", \"min\": [0, 0, 0], \"max\": [4, 3, 10]}, \"density\": 0.2}, {\"name\": \"crypt\", \"shape\": "
        "{\"type\": "
        "\"box\", \"min\": [4, 0, 0], \"max\": [9, 3, 9]}, \"density\": 0.05, \"color\": [0.5, 0.75, 1]}] /* two */, "
        "\"model\": \"exponential\", \"span\": \"depth\", \"grouping\": false}}";
    make_file();
    write_text(before);
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {NULL, NULL}};
    assert_int_equal(nebel_load_scene(path, &desc, &scene), NEBEL_OK);
    const nebel_scene_data *was = nebel_get_scene_data(scene);
    nebel_scene_data now = *was;
    nebel_cells_desc cells = *was->cells;
    nebel_cell two[2] = {was->cells->cells[0], was->cells->cells[1]};
    now.cells = &cells;
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(before);
    cells.cells = two;
    two[0].shape.max[2] = 5;
    two[1].density = .1;
    two[1].color[1] = .75;
    cells.model = NEBEL_CELL_EXPONENTIAL;
    cells.span = NEBEL_SPAN_DEPTH;
    cells.ungrouped = 1;
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(after);
    cells.ungrouped = 0;
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    write_text("{\"nebel\": 1, \"fog\": []}");
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_ERROR_ARGUMENT);
    write_text(SCENE("\"cells\": [" HALL "]"));
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_scene(scene);
    remove(path);
}

static void test_names_and_portals_are_written(void **state)
{
    (void)state;
#define FILE_OF(hall, crypt, portals)                                                                                  \
    "{\"nebel\": 1, \"unit\": 0.5, \"up\": \"z\", \"fog\": [], \"cells\": {\"cells\": ["                               \
    "{\"name\": " hall ", \"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [4, 3, 9]}}, "                   \
    "{\"shape\": {\"type\": \"box\", \"min\": [4, 0, 0], \"max\": [9, 3, 9]}, \"name\": " crypt                        \
    "}], \"portals\": " portals "}}"
#define POLYGON "\"polygon\": [[4, 0, 4], [4, 2, 4], [4, 2, 6]]"
    static const char derived[] = FILE_OF("\"a\"", "\"b\"", "\"derived\""),
                      given[] = FILE_OF("\"a\"", "\"b\"", "[{\"cells\": [\"b\", \"a\"] /* mine */, " POLYGON "}]");
    make_file();
    write_text(given);
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {NULL, NULL}};
    assert_int_equal(nebel_load_scene(path, &desc, &scene), NEBEL_OK);
    const nebel_scene_data *was = nebel_get_scene_data(scene);
    nebel_scene_data now = *was;
    nebel_cells_desc cells = *was->cells;
    nebel_portal two[2] = {was->cells->portals[0], was->cells->portals[0]};
    now.cells = &cells;
    now.cell_names = (const char *const[]){"the \"hall\"", "b"};
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(FILE_OF("\"the \\\"hall\\\"\"", "\"b\"",
                       "[{\"cells\": [\"b\", \"the \\\"hall\\\"\"] /* mine */, " POLYGON "}]"));
    write_text(given);
    now.cell_names = was->cell_names;
    cells.portals = two;
    cells.portal_count = 2;
    two[1].cells[0] = 0;
    two[1].cells[1] = 1;
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(FILE_OF("\"a\"", "\"b\"",
                       "[{ \"cells\": [\"b\", \"a\"], " POLYGON " }, { \"cells\": [\"a\", \"b\"], " POLYGON " }]"));
    write_text(given);
    cells.portals = NULL;
    cells.portal_count = 0;
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(derived);
    nebel_destroy_scene(scene);
    assert_int_equal(nebel_load_scene(path, &desc, &scene), NEBEL_OK);
    was = nebel_get_scene_data(scene);
    now = *was;
    cells = *was->cells;
    now.cells = &cells;
    cells.portals = two; /* all there are: none */
    assert_int_equal(nebel_save_scene(path, &desc, was, &now, NULL), NEBEL_OK);
    check_text(FILE_OF("\"a\"", "\"b\"", "[]"));
    nebel_destroy_scene(scene);
    remove(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names_and_portals_are_written),
        cmocka_unit_test(test_everything_it_may_say),
        cmocka_unit_test(test_what_it_leaves_out),
        cmocka_unit_test(test_other_units_and_axes),
        cmocka_unit_test(test_cells_are_exact_fog_too),
        cmocka_unit_test(test_what_no_cell_has),
        cmocka_unit_test(test_what_no_portal_has),
        cmocka_unit_test(test_memory_runs_out),
        cmocka_unit_test(test_only_what_changes_is_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
