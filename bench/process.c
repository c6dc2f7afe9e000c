/* The whole program: a scene file and a model read, Embree built, a picture written. */
#define _DEFAULT_SOURCE

#include "embree_floor.h"
#include "groups.h"
#include "measure.h"
#include "scenes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

static const char group_name[] = "The whole program for scene A1: nebel render scene.json -o picture.png --samples 1";
static const char failed[] = "process: the program or Embree failed, or could not be started";
static const char no_files[] = "process: the scene could not be written to a temporary folder";

typedef struct nb_call {
    const char *program, *threads, *size;
    char folder[4096], scene[4128], picture[4128];
    double megabytes; /* largest resident set of all runs */
} nb_call;

static void become_program(const nb_call *call)
{
    const char *const words[] = {call->program, "render", call->scene, "-o",        call->picture, "--size", call->size,
                                 "--samples",   "1",      "--quiet",   "--threads", call->threads, NULL};
    char *copies[sizeof words / sizeof *words];
    memcpy(copies, words, sizeof words);
    (void)execv(call->program, copies);
    _exit(127);
}

/* The resident set that Linux reports for a child begins with the parent's at the fork: measure before memory is taken.
 */
static double run_program(void *user)
{
    nb_call *const call = user;
    const double start = nb_clock_wall();
    const pid_t child = fork();
    if (child == 0) become_program(call);
    int status = 0;
    struct rusage usage = {0};
    pid_t ended = -1;
    do {
        ended = child > 0 ? wait4(child, &status, 0, &usage) : -1;
    } while (ended < 0 && child > 0 && errno == EINTR);
    if (ended != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) return -1;
    const double megabytes = (double)usage.ru_maxrss * 1024 / (1 << 20);
    if (megabytes > call->megabytes) call->megabytes = megabytes;
    return nb_clock_wall() - start;
}

/* ---- floors ---------------------------------------------------------------------------------------------------- */

typedef struct nb_bare {
    const nb_bench_scene *scene;
    uint32_t width, height;
    double megabytes; /* of Embree, the model and the picture */
} nb_bare;

static double run_embree(void *user)
{
    nb_bare *const bare = user;
    const double start = nb_clock_wall();
    nb_embree_floor *const floor = nb_embree_floor_make(bare->scene, bare->width, bare->height);
    if (floor == NULL) return -1;
    (void)nb_embree_floor_trace(floor);
    const double seconds = nb_clock_wall() - start;
    const size_t pixel = 3 * sizeof(float) + 3, point = 3 * sizeof(float), triangle = 3 * sizeof(uint32_t);
    bare->megabytes =
        ((double)nb_embree_floor_bytes(floor) + (double)pixel * bare->width * bare->height +
         (double)point * bare->scene->terrain.vertex_count + (double)triangle * bare->scene->terrain.triangle_count) /
        (1 << 20);
    nb_embree_floor_free(floor);
    return seconds;
}

/* ---- files ----------------------------------------------------------------------------------------------------- */

static int make_files(const nb_bench_scene *scene, nb_call *call)
{
    const char *const place = getenv("TMPDIR");
    (void)snprintf(call->folder, sizeof call->folder, "%s/nebel-bench-XXXXXX", place != NULL ? place : "/tmp");
    if (mkdtemp(call->folder) == NULL) {
        call->folder[0] = '\0';
        return -1;
    }
    (void)snprintf(call->scene, sizeof call->scene, "%s/scene.json", call->folder);
    (void)snprintf(call->picture, sizeof call->picture, "%s/picture.png", call->folder);
    return nb_bench_scene_write(scene, call->folder);
}

static void remove_files(const nb_call *call)
{
    if (call->folder[0] == '\0') return;
    char terrain[4128];
    (void)snprintf(terrain, sizeof terrain, "%s/terrain.ply", call->folder);
    (void)unlink(call->scene);
    (void)unlink(call->picture);
    (void)unlink(terrain);
    (void)rmdir(call->folder);
}

/* ---- figures --------------------------------------------------------------------------------------------------- */

static void add_figures(nb_figures *figures, const nb_call *all, const nb_contest contests[3], const nb_bare *bare)
{
    const char *const build = "Embree built, rays on one thread";
    nb_figures_add(figures, &(nb_figure){.group = group_name,
                                         .name = "all threads",
                                         .unit = "s",
                                         .value = contests[1].seconds,
                                         .floor_name = build,
                                         .floor = contests[0].seconds,
                                         .value_at_most = .5});
    nb_figures_add(figures, &(nb_figure){.group = group_name,
                                         .name = "one thread",
                                         .unit = "s",
                                         .value = contests[2].seconds,
                                         .floor_name = build,
                                         .floor = contests[0].seconds});
    nb_figures_add(figures, &(nb_figure){.group = group_name,
                                         .name = "memory, all threads",
                                         .unit = "MiB",
                                         .value = all->megabytes,
                                         .floor_name = "Embree, model and picture",
                                         .floor = bare->megabytes,
                                         .value_at_most = 130});
}

static const char *measure(nb_call *all, nb_bare *bare, int repetitions, nb_figures *figures)
{
    nb_call one = *all;
    one.threads = "1";
    if (run_program(all) < 0) return failed;
    const double megabytes = all->megabytes;
    nb_contest contests[] = {
        {.run = run_embree, .user = bare}, {.run = run_program, .user = all}, {.run = run_program, .user = &one}};
    if (nb_measure(contests, 3, repetitions) != 0) return failed;
    all->megabytes = megabytes; /* before Embree took memory here */
    add_figures(figures, all, contests, bare);
    return NULL;
}

const char *nb_bench_process(const nb_bench_desc *desc, nb_figures *figures)
{
    if (desc->program == NULL) return NULL;
    nb_bench_scene scene;
    nb_call call = {.program = desc->program, .threads = "0", .size = desc->quick ? "160x88" : "1280x720"};
    nb_bare bare = {
        .scene = &scene, .width = desc->quick ? 160 : NB_BENCH_WIDTH, .height = desc->quick ? 88 : NB_BENCH_HEIGHT};
    const double aspect = (double)bare.width / bare.height;
    if (nb_bench_scene_make(desc->quick ? 64 : 512, aspect, &scene) != 0) return "process: out of memory";
    const char *fault = no_files;
    if (make_files(&scene, &call) == 0) fault = measure(&call, &bare, desc->quick ? 1 : 7, figures);
    remove_files(&call);
    nb_bench_scene_free(&scene);
    return fault;
}
