/* Fog per vertex into RGBA8, against the same by the magazine's code. */
#include "box_fog_scene.h"
#include "groups.h"
#include "measure.h"
#include "terrain.h"

#include <nebel/classic.h>

#include <stdlib.h>
#include <string.h>

static const float eye[3] = {0, 16, 62};

static const char out_of_memory[] = "vertices: out of memory";
static const char failed[] = "vertices: a query failed or gave other bytes than the magazine's code";

/* The terrain's points, as an array and in the magazine's structures, and what both ways make of them. */
typedef struct nb_terrain_mesh {
    size_t count;
    const float *points;          /* 3 each */
    unsigned char *colors;        /* 4 each */
    nb_old_colored_vertex *found; /* the kernel's */
    nb_old_colored_vertex *old;   /* the magazine's */
    nb_boxes boxes;
    nebel_snapshot *fog;
    int rounds; /* in one measurement */
} nb_terrain_mesh;

typedef struct nb_vertex_entry {
    const nb_terrain_mesh *mesh;
    nebel_isa isa;
    int structures; /* positions and colours in the magazine's structures, not in arrays */
} nb_vertex_entry;

/* ---- contestants ----------------------------------------------------------------------------- */

static nebel_result fog_mesh(const nb_vertex_entry *entry)
{
    const nb_terrain_mesh *const mesh = entry->mesh;
    nebel_vertices vertices = {.positions = mesh->points, .eye = {(double)eye[0], (double)eye[1], (double)eye[2]}};
    nebel_vertex_output output = {NEBEL_VERTEX_RGBA8, mesh->colors, 0};
    if (entry->structures) {
        vertices.positions = &mesh->found[0].position;
        output.data = mesh->found[0].color;
        vertices.position_stride = output.stride = sizeof *mesh->found;
    }
    return nebel_compute_vertex_fog(mesh->fog, &(nebel_vertex_desc){.isa = entry->isa}, mesh->count, &vertices, &output,
                                    1);
}

static double run_kernel(void *user)
{
    const nb_vertex_entry *const entry = user;
    const double start = nb_clock_cpu();
    for (int i = 0; i < entry->mesh->rounds; i++)
        if (fog_mesh(entry) != NEBEL_OK) return -1;
    return nb_clock_cpu() - start;
}

static double run_magazine(void *user)
{
    const nb_terrain_mesh *const mesh = ((const nb_vertex_entry *)user)->mesh;
    const nb_old_camera camera = {{eye[0], eye[1], eye[2]}};
    const float color[3] = {(float)nb_boxes_color[0], (float)nb_boxes_color[1], (float)nb_boxes_color[2]};
    const double start = nb_clock_cpu();
    for (int i = 0; i < mesh->rounds; i++)
        nb_magazine_color(&camera, mesh->boxes.list, mesh->boxes.count, color, mesh->old, mesh->count);
    return nb_clock_cpu() - start;
}

/* Both did the same work; a number that is nearly a half may be rounded either way. */
static int agree(const nb_terrain_mesh *mesh)
{
    for (size_t i = 0; i < mesh->count; i++)
        for (int c = 0; c < 4; c++) {
            const int old = mesh->old[i].color[c];
            if (abs(mesh->colors[4 * i + (size_t)c] - old) > 1 || abs(mesh->found[i].color[c] - old) > 1) return 0;
        }
    return 1;
}

/* ---- figures --------------------------------------------------------------------------------- */

static double million_per_second(const nb_terrain_mesh *mesh, double seconds)
{
    return 1e-6 * (double)mesh->count * mesh->rounds / seconds;
}

static void add_figure(nb_figures *figures, const nb_vertex_entry *entry, const char *setting, double seconds,
                       double floor)
{
    const nb_terrain_mesh *const mesh = entry->mesh;
    nb_figure figure = {.group = "Fog per vertex of a terrain into RGBA8, one box, one thread",
                        .unit = "M vertices/s",
                        .value = million_per_second(mesh, seconds),
                        .floor_name = "the magazine's code",
                        .floor = million_per_second(mesh, floor)};
    if (entry->isa == NEBEL_ISA_AVX2 && !entry->structures) figure.at_least = 8;
    (void)snprintf(figure.name, sizeof figure.name, "%s, %s, %s", setting, entry->structures ? "structures" : "arrays",
                   nebel_isa_name(entry->isa));
    nb_figures_add(figures, &figure);
}

/* The magazine's code and every instruction set in turn. */
static const char *measure(const nb_terrain_mesh *mesh, const char *setting, int repetitions, nb_figures *figures)
{
    nb_vertex_entry entries[2 * NEBEL_ISA_COUNT] = {{.mesh = mesh}};
    nb_contest contests[2 * NEBEL_ISA_COUNT] = {{.run = run_magazine, .user = &entries[0]}};
    size_t count = 1;
    for (int structures = 0; structures < 2; structures++)
        for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            entries[count] = (nb_vertex_entry){mesh, (nebel_isa)isa, structures};
            contests[count] = (nb_contest){.run = run_kernel, .user = &entries[count]};
            count++;
        }
    if (nb_measure(contests, count, repetitions) != 0 || !agree(mesh)) return failed;
    for (size_t i = 1; i < count; i++)
        add_figure(figures, &entries[i], setting, contests[i].seconds, contests[0].seconds);
    return NULL;
}

static int make_mesh(const nb_terrain *terrain, nb_setting setting, nb_terrain_mesh *mesh)
{
    mesh->count = terrain->vertex_count;
    mesh->points = terrain->positions;
    mesh->colors = malloc(4 * mesh->count);
    mesh->found = malloc(sizeof *mesh->found * mesh->count);
    mesh->old = malloc(sizeof *mesh->old * mesh->count);
    if (mesh->colors == NULL || mesh->found == NULL || mesh->old == NULL) return -1;
    for (size_t i = 0; i < mesh->count; i++) {
        const float *const p = mesh->points + 3 * i;
        mesh->old[i] = (nb_old_colored_vertex){.position = {p[0], p[1], p[2]}, .normal = {0, 1, 0}};
    }
    memcpy(mesh->found, mesh->old, sizeof *mesh->old * mesh->count);
    nb_boxes_set(setting, &mesh->boxes);
    mesh->fog = nb_boxes_commit(&mesh->boxes);
    return mesh->fog != NULL ? 0 : -1;
}

static const char *measure_setting(const nb_terrain *terrain, nb_setting setting, const nb_bench_desc *desc,
                                   nb_figures *figures)
{
    nb_terrain_mesh mesh = {.rounds = desc->quick ? 1 : 8};
    const char *fault = out_of_memory;
    if (make_mesh(terrain, setting, &mesh) == 0)
        fault = measure(&mesh, nb_setting_names[setting], desc->quick ? 1 : 15, figures);
    nebel_release_snapshot(mesh.fog);
    free(mesh.colors);
    free(mesh.found);
    free(mesh.old);
    return fault;
}

const char *nb_bench_vertices(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_terrain terrain;
    if (nb_terrain_make(desc->quick ? 64 : 512, &terrain) != 0) return out_of_memory;
    const char *fault = measure_setting(&terrain, NB_FOG_BANK, desc, figures);
    if (fault == NULL) fault = measure_setting(&terrain, NB_FOG_OVER_ALL, desc, figures);
    nb_terrain_free(&terrain);
    if (fault == NULL) fault = nb_bench_tessellation(desc, figures);
    return fault == NULL ? nb_bench_cells(desc, figures) : fault;
}
