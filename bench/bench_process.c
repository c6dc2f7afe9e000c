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

static const char group_name[] = "The whole program for scene A1: nebel render, one sample, 1280x720";
static const char failed[] = "process: the program or Embree failed, or could not be started";
static const char no_files[] = "process: the scene could not be written to a temporary folder";

typedef struct nb_call {
    const char *program, *threads, *size;
    char scene[4128], picture[4128];
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

/* ---- floors ---------------------------------------------------------------------------------- */

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

/* ---- figures --------------------------------------------------------------------------------- */

enum { CALLS = 3 };

static const struct {
    const char *scene, *threads, *name;
} variants[CALLS] = {{"map.json", "0", "terrain as a height map"},
                     {"map.json", "1", "terrain as a height map, one thread"},
                     {"mesh.json", "0", "terrain as a PLY model"}};

static void add_figures(nb_figures *figures, const nb_call *call, const char *name, double seconds, double megabytes,
                        const nb_contest *embree)
{
    const nb_bare *const bare = embree->user;
    nb_figure time = {.group = group_name,
                      .unit = "s",
                      .value = seconds,
                      .floor_name = "Embree built, rays on one thread",
                      .floor = embree->seconds};
    nb_figure memory = {.group = group_name,
                        .unit = "MiB",
                        .value = megabytes,
                        .floor_name = "Embree, model and picture",
                        .floor = bare->megabytes};
    if (strcmp(call->threads, "0") == 0) {
        time.value_at_most = .5;
        memory.value_at_most = 130;
    }
    (void)snprintf(time.name, sizeof time.name, "%s", name);
    (void)snprintf(memory.name, sizeof memory.name, "%s", name);
    nb_figures_add(figures, &time);
    nb_figures_add(figures, &memory);
}

/* Memory comes from the first runs, before this process has taken any. */
static const char *measure(nb_call *calls, nb_bare *bare, int repetitions, nb_figures *figures)
{
    nb_contest contests[CALLS + 1] = {{.run = run_embree, .user = bare}};
    double megabytes[CALLS];
    for (int i = 0; i < CALLS; i++) {
        if (run_program(&calls[i]) < 0) return failed;
        megabytes[i] = calls[i].megabytes;
        contests[i + 1] = (nb_contest){.run = run_program, .user = &calls[i]};
    }
    if (nb_measure(contests, CALLS + 1, repetitions) != 0) return failed;
    for (int i = 0; i < CALLS; i++) {
        add_figures(figures, &calls[i], variants[i].name, contests[i + 1].seconds, megabytes[i], &contests[0]);
    }
    return NULL;
}

static void set_calls(const nb_bench_desc *desc, const char *folder, nb_call *calls)
{
    for (int i = 0; i < CALLS; i++) {
        calls[i] = (nb_call){
            .program = desc->program, .threads = variants[i].threads, .size = desc->quick ? "160x88" : "1280x720"};
        (void)snprintf(calls[i].scene, sizeof calls[i].scene, "%s/%s", folder, variants[i].scene);
        (void)snprintf(calls[i].picture, sizeof calls[i].picture, "%s/picture.png", folder);
    }
}

/* In a folder of its own, which is gone afterwards. */
static const char *measure_in_folder(const nb_bench_desc *desc, nb_bare *bare, nb_figures *figures)
{
    char folder[4096];
    const char *const place = getenv("TMPDIR");
    const int length = snprintf(folder, sizeof folder, "%s/nebel-bench-XXXXXX", place != NULL ? place : "/tmp");
    if (length < 0 || (size_t)length >= sizeof folder || mkdtemp(folder) == NULL) return no_files;
    nb_call calls[CALLS];
    set_calls(desc, folder, calls);
    const char *fault = no_files;
    if (nb_bench_scene_write(bare->scene, folder) == 0) fault = measure(calls, bare, desc->quick ? 1 : 7, figures);
    nb_bench_scene_remove(folder);
    (void)unlink(calls[0].picture);
    (void)rmdir(folder);
    return fault;
}

const char *nb_bench_process(const nb_bench_desc *desc, nb_figures *figures)
{
    if (desc->program == NULL) return NULL;
    nb_bench_scene scene;
    nb_bare bare = {
        .scene = &scene, .width = desc->quick ? 160 : NB_BENCH_WIDTH, .height = desc->quick ? 88 : NB_BENCH_HEIGHT};
    const double aspect = (double)bare.width / bare.height;
    if (nb_bench_scene_make(desc->quick ? 64 : 512, aspect, &scene) != 0) return "process: out of memory";
    const char *const fault = measure_in_folder(desc, &bare, figures);
    nb_bench_scene_free(&scene);
    return fault;
}
