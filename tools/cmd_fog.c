/* nebel fog: fog over pictures that exist. */
#include "commands.h"
#include "fog_call.h"
#include "fog_work.h"
#include "interrupt.h"
#include "load.h"
#include "meter.h"
#include "report.h"
#include "workers.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <threads.h>

static const char about[] = "Puts fog into pictures whose depth is known: each pixel's light is weakened over\n"
                            "the length of its ray, and the fog's own light is added. Pictures are PNG (8 or\n"
                            "16 bit), JPEG or OpenEXR.\n"
                            "\n"
                            "Of many pictures, a * in IMAGE stands for any letters but a slash; names with as\n"
                            "many * get the same letters. Without one, a * stands for the picture's name\n"
                            "without folder and ending. A picture that fails is named with the reason, and\n"
                            "the others are done.\n"
                            "\n"
                            "docs/photographs.md has the formulas and the formats of data sets.\n";

static const char examples[] = "Examples:\n"
                               "  A photograph with depth in meters along the camera's axis:\n"
                               "    nebel fog street.png -d street.exr --hfov 60 -v 150 -o foggy.png\n"
                               "  Cityscapes, as Foggy Cityscapes blends it (extinction 0.02 per meter):\n"
                               "    nebel fog 'left/*_leftImg8bit.png' --depth 'disparity/*_disparity.png' \\\n"
                               "        --camera 'camera/*_camera.json' --depth-format cityscapes \\\n"
                               "        --extinction 0.02 --blend srgb -o 'foggy/*_foggy_beta_0.02.png'\n"
                               "  A bank of ground fog, with the scene's sun and lamps:\n"
                               "    nebel fog street.png --depth street.exr --scene bank.json -o foggy.png\n"
                               "\n"
                               "Exit status: 0 done, 1 some of the work failed, 2 the call was wrong.\n";

/* ---- many pictures at once ------------------------------------------------------------------- */

/* What the threads have in common; everything from `next` on under the lock. */
typedef struct crew {
    nb_fog_shared shared;
    const nb_fog_list *list;
    mtx_t lock;
    size_t next, done, failed;
    nb_meter meter;
    nb_fog_tale last;         /* of those that are done: the last one, */
    double unknown, infinite; /* and sums */
} crew;

/* How many threads are writing: signals wait for the last one. */
static mtx_t holding;
static int holders;

static void hold(int is_held)
{
    (void)mtx_lock(&holding);
    if (is_held && holders++ == 0) nb_interrupt_hold();
    if (!is_held && --holders == 0) nb_interrupt_release();
    (void)mtx_unlock(&holding);
}

static const nb_fog_files *take_next(crew *all)
{
    const nb_fog_files *files = NULL;
    (void)mtx_lock(&all->lock);
    if (all->next < all->list->count && !nb_interrupt_is_requested()) files = &all->list->files[all->next++];
    (void)mtx_unlock(&all->lock);
    return files;
}

static void take_result(crew *all, int status, const nb_report_listener *listener, const nb_fog_tale *tale)
{
    char label[64] = "";
    (void)mtx_lock(&all->lock);
    if (status == NB_DONE) {
        all->done++;
        all->last = *tale;
        all->unknown += tale->unknown;
        all->infinite += tale->infinite;
    } else {
        all->failed++;
        nb_report_message("fog: %s", listener->kept);
    }
    const size_t finished = all->done + all->failed, count = all->list->count;
    if (count > 1) (void)snprintf(label, sizeof label, "picture %zu of %zu", finished, count);
    nb_meter_show(&all->meter, (double)finished / (double)count, label);
    (void)mtx_unlock(&all->lock);
}

static void work(int worker, int count, void *user)
{
    crew *const all = user;
    (void)worker;
    (void)count;
    for (const nb_fog_files *files = take_next(all); files != NULL; files = take_next(all)) {
        nb_report_listener listener = {.mode = NB_REPORT_KEEP, .quiet = 1};
        nb_fog_tale tale;
        const int status = nb_fog_work(&all->shared, files, &listener, &tale);
        take_result(all, status, &listener, &tale);
    }
}

/* ---- the summary ----------------------------------------------------------------------------- */

static void describe_fog(const nb_fog_call *wanted, const crew *all, char *text, size_t size)
{
    const double *const light = all->last.airlight;
    char airlight[96] = "airlight estimated";
    if (wanted->scene != NULL) {
        (void)snprintf(text, size, "the fog of %s", wanted->scene);
        return;
    }
    if (all->done == 1 || wanted->has_airlight)
        (void)snprintf(airlight, sizeof airlight, "airlight %.3f,%.3f,%.3f", light[0], light[1], light[2]);
    (void)snprintf(text, size, "extinction %.6g per meter, %s, blended in %s", wanted->extinction, airlight,
                   wanted->blends_stored ? "sRGB" : "linear light");
}

static void summarize(const nb_fog_call *wanted, const crew *all, double seconds)
{
    static const char *const ways[] = {
        [NB_FOG_FILL] = "filled in", [NB_FOG_FAR] = "taken as far", [NB_FOG_KEEP] = "left without fog"};
    char span[32], fog[512];
    if (all->done == 0) return;
    nb_meter_write_span(seconds, span, sizeof span);
    describe_fog(wanted, all, fog, sizeof fog);
    nb_report_message("%s: %zu picture%s%s, %s", wanted->patterns.output, all->done, all->done > 1 ? "s" : "",
                      all->failed > 0 ? " (others failed)" : "", fog);
    nb_report_message("depth: %.1f %% unknown, %s; %.1f %% without end; %s", 100 * all->unknown / (double)all->done,
                      ways[wanted->unknown], 100 * all->infinite / (double)all->done, span);
}

/* ---- the command ----------------------------------------------------------------------------- */

static void fog_all(const nb_fog_call *wanted, crew *all)
{
    const int most = wanted->threads;
    const int threads = all->list->count < (size_t)most ? (int)all->list->count : most;
    all->shared.row_threads = most / threads;
    nb_workers_run(threads, work, all);
}

/* The fog and the camera of a scene, where one is wanted. */
static int load_scene(const nb_fog_call *wanted, nb_report_listener *listener, nb_load_result *loaded,
                      nebel_camera *camera, nb_fog_shared *shared)
{
    if (wanted->scene == NULL) return NB_DONE;
    const int status = nb_load_scene(wanted->scene, 0, 0, listener, loaded);
    if (status != NB_DONE) return status;
    *camera = nebel_scene_camera(loaded->scene, 0);
    if (camera->projection != NEBEL_PROJECTION_PERSPECTIVE)
        return nb_report_failure("fog: %s: its camera must be a perspective one, as that of the picture",
                                 wanted->scene);
    shared->scene = loaded->scene;
    shared->scene_fog = loaded->fog;
    shared->scene_camera = camera;
    shared->scene_fov = camera->vertical_fov;
    return NB_DONE;
}

static int fog_pictures(const nb_fog_call *wanted, const nb_fog_list *list)
{
    crew all = {.shared = {.wanted = wanted, .row_threads = 1, .hold = hold}, .list = list};
    nb_report_listener listener = {.quiet = wanted->quiet};
    nb_load_result loaded = {0};
    nebel_camera camera;
    int status = load_scene(wanted, &listener, &loaded, &camera, &all.shared);
    if (status == NB_DONE &&
        (mtx_init(&all.lock, mtx_plain) != thrd_success || mtx_init(&holding, mtx_plain) != thrd_success))
        status = nb_report_failure("fog: out of memory");
    if (status == NB_DONE) {
        nb_interrupt_listen();
        all.meter = nb_meter_start(wanted->quiet);
        fog_all(wanted, &all);
        const double seconds = nb_meter_end(&all.meter);
        if (all.done + all.failed < list->count) (void)nb_report_failure("fog: stopped");
        if (!wanted->quiet) summarize(wanted, &all, seconds);
        status = all.done == list->count ? NB_DONE : NB_FAILED;
        mtx_destroy(&all.lock);
        mtx_destroy(&holding);
    }
    nb_load_free(&loaded);
    return status;
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    nb_fog_call wanted = {0};
    nb_fog_list list = {0};
    int status = nb_options_parse(&nb_commands_fog, count, words, &arguments);
    if (status < 0) status = nb_fog_call_read(&arguments, &wanted);
    if (status >= 0) return status;
    status = nb_fog_names_list(&wanted.patterns, wanted.scene, &list);
    if (status == NB_DONE) status = fog_pictures(&wanted, &list);
    nb_fog_names_free(&list);
    nb_interrupt_obey();
    return status;
}

const nb_command nb_commands_fog = {
    .name = "fog",
    .summary = "fog over pictures that exist",
    .synopsis = "IMAGE... --depth FILE -o FILE [options]",
    .about = about,
    .options = nb_fog_options,
    .option_count = NB_FOG_OPTIONS,
    .operands = "pictures",
    .fewest_operands = 1,
    .most_operands = INT_MAX,
    .examples = examples,
    .run = run,
};
