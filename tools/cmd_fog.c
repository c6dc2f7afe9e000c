/* nebel fog: fog over pictures that exist. */
#include "commands.h"
#include "fog_call.h"
#include "fog_list.h"
#include "fog_work.h"
#include "signals.h"
#include "load_scene.h"
#include "record.h"
#include "thread_pool.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <threads.h>

static const char about[] = "Puts fog into pictures whose depth is known: each pixel's light is weakened over\n"
                            "the length of its ray, and the fog's own light is added. Pictures are PNG (8 or\n"
                            "16 bit), JPEG or OpenEXR.\n"
                            "\n"
                            "Of many pictures, a * in IMAGE stands for any letters but a slash; names with as\n"
                            "many * get the same letters. Without one, a * stands for the picture's name\n"
                            "without folder and ending. A picture that fails is named with the reason, and\n"
                            "the others are done. Folders of results are made.\n"
                            "\n"
                            "Of processes that mpirun started, each takes the next picture; --shard divides\n"
                            "the work without MPI. docs/clusters.md says how.\n"
                            "\n"
                            "docs/photographs.md has the formulas and the formats of data sets.\n";

static const char examples[] = "Examples:\n"
                               "  A photograph with depth in meters along the camera's axis:\n"
                               "    nebel fog street.png -d street.exr --hfov 60 -v 150 -o foggy.png\n"
                               "  Cityscapes, as Foggy Cityscapes blends it (extinction 0.02 per meter):\n"
                               "    nebel fog 'left/*_leftImg8bit.png' --depth 'disparity/*_disparity.png' \\\n"
                               "        --camera 'camera/*_camera.json' --depth-format cityscapes \\\n"
                               "        --extinction 0.02 --blend srgb -o 'foggy/*_foggy_beta_0.02.png'\n"
                               "  A bank of ground fog, with the scene's sun and lights:\n"
                               "    nebel fog street.png --depth street.exr --scene bank.json -o foggy.png\n"
                               "  A data set by four processes, which go on where they were:\n"
                               "    mpirun -n 4 nebel fog 'left/*.png' --depth 'depth/*.png' -f kitti \\\n"
                               "        --camera calib.txt -v 80 -o 'foggy/*.png' --resume\n"
                               "\n"
                               "Exit status: 0 done, 1 some of the work failed, 2 the call was wrong.\n";

/* ---- many pictures at once ------------------------------------------------------------------- */

/* What is added up over all processes. */
enum { PIXELS, UNKNOWN, INFINITE };
_Static_assert((int)INFINITE < (int)NB_JOBS_SUMS, "as many as jobs add up");

/* After so many results in a row that it could not write, a process leaves the rest to the others: its disk is full, or not there. */
enum { MOST_UNWRITTEN = 2 };

/* What the threads have in common; everything from `jobs` on under the lock. */
typedef struct crew {
    nb_fog_shared shared;
    nb_load_result loaded;
    nb_report_listener listener; /* of the scene */
    nb_fog_list list;
    nb_fingerprint start; /* of the records */
    mtx_t lock;
    nb_jobs jobs;
    nb_progress_bar meter;
    double airlight[3]; /* of the last picture */
    int unwritten;      /* how many in a row */
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

/* Whoever has the lock answers, too. */
static void answer(void *user)
{
    crew *const all = user;
    if (!all->jobs.is_joined || mtx_trylock(&all->lock) != thrd_success) return;
    nb_jobs_answer(&all->jobs);
    (void)mtx_unlock(&all->lock);
}

static int has_given_up(const crew *all)
{
    return all->jobs.is_joined && all->unwritten >= MOST_UNWRITTEN;
}

static int take_next(crew *all, uint64_t *item)
{
    (void)mtx_lock(&all->lock);
    const int has_one = !nb_interrupt_is_requested() && !has_given_up(all) && nb_jobs_take(&all->jobs, item);
    (void)mtx_unlock(&all->lock);
    return has_one;
}

static void count_done(crew *all, uint64_t item, const nb_fog_tale *tale)
{
    (void)nb_jobs_finish(&all->jobs, item, tale->is_kept);
    if (tale->has_replaced) nb_jobs_note_replaced(&all->jobs);
    all->jobs.sums[PIXELS] += tale->pixels;
    all->jobs.sums[UNKNOWN] += tale->unknown;
    all->jobs.sums[INFINITE] += tale->infinite;
    if (tale->is_kept) return;
    memcpy(all->airlight, tale->airlight, sizeof all->airlight);
    all->unwritten = 0;
}

static void count_failed(crew *all, const char *message, const nb_fog_tale *tale)
{
    nb_report_message("fog: %s", message);
    nb_jobs_fail(&all->jobs);
    all->unwritten = tale->cannot_write ? all->unwritten + 1 : 0;
    if (tale->cannot_write && all->jobs.is_joined && all->unwritten == MOST_UNWRITTEN)
        nb_report_message("fog: this process cannot write and takes no more pictures; the others do what is left");
}

/* What was stopped is neither done nor failed. */
static void take_result(crew *all, uint64_t item, int status, const char *message, const nb_fog_tale *tale)
{
    (void)mtx_lock(&all->lock);
    if (!nb_interrupt_is_requested()) {
        if (status == NB_DONE)
            count_done(all, item, tale);
        else
            count_failed(all, message, tale);
        if (all->jobs.is_chief) nb_jobs_show(&all->jobs, &all->meter, "picture", 0);
    }
    (void)mtx_unlock(&all->lock);
}

static void work(int worker, int count, void *user)
{
    crew *const all = user;
    uint64_t item;
    (void)worker;
    (void)count;
    while (take_next(all, &item)) {
        nb_report_listener listener = {.mode = NB_REPORT_KEEP, .quiet = 1};
        nb_fog_tale tale;
        const int status = nb_fog_work(&all->shared, &all->list.files[item], &listener, &tale);
        take_result(all, item, status, listener.kept, &tale);
    }
}

static void fog_all(crew *all)
{
    const size_t most = (size_t)all->shared.wanted->threads, own = nb_jobs_even_share(&all->jobs);
    const size_t threads = own < most ? own > 0 ? own : 1 : most;
    all->shared.row_threads = (int)(most / threads);
    nb_workers_run((int)threads, work, all);
}

/* ---- the summary ----------------------------------------------------------------------------- */

static void describe_fog(const crew *all, char *text, size_t size)
{
    const nb_fog_call *const wanted = all->shared.wanted;
    const double *const light = wanted->has_airlight ? wanted->airlight : all->airlight;
    char airlight[96] = "airlight estimated";
    if (wanted->scene != NULL) {
        (void)snprintf(text, size, "the fog of %s", wanted->scene);
        return;
    }
    if (wanted->has_airlight || (all->jobs.all_made == 1 && all->jobs.made == 1))
        (void)snprintf(airlight, sizeof airlight, "airlight %.3f,%.3f,%.3f", light[0], light[1], light[2]);
    (void)snprintf(text, size, "extinction %.6g per meter, %s, blended in %s", wanted->extinction, airlight,
                   wanted->blends_stored ? "sRGB" : "linear light");
}

static void summarize(const crew *all, double seconds)
{
    static const char *const ways[] = {
        [NB_FOG_FILL] = "filled in", [NB_FOG_FAR] = "taken as far", [NB_FOG_KEEP] = "left without fog"};
    const nb_fog_call *const wanted = all->shared.wanted;
    const uint64_t *const sums = all->jobs.sums;
    char span[32], fog[512], count[128], depth[128] = "";
    nb_progress_bar_write_span(seconds, span, sizeof span);
    describe_fog(all, fog, sizeof fog);
    nb_jobs_describe(&all->jobs, "picture", count, sizeof count);
    nb_report_message("%s: %s, %s", wanted->patterns.output, count, fog);
    if (sums[PIXELS] > 0)
        (void)snprintf(depth, sizeof depth, "depth: %.1f %% unknown, %s; %.1f %% without end; ",
                       100 * (double)sums[UNKNOWN] / (double)sums[PIXELS], ways[wanted->unknown],
                       100 * (double)sums[INFINITE] / (double)sums[PIXELS]);
    nb_report_message("%s%s", depth, span);
}

/* ---- the command ----------------------------------------------------------------------------- */

/* The fog and the camera of a scene, where one is wanted. */
static int load_scene(crew *all)
{
    const nb_fog_call *const wanted = all->shared.wanted;
    if (wanted->scene == NULL) return NB_DONE;
    const int status = nb_load_scene(wanted->scene, 0, wanted->frame, &all->listener, &all->loaded);
    if (status != NB_DONE) return status;
    if (nebel_get_scene_camera(all->loaded.scene, wanted->frame).projection != NEBEL_PROJECTION_PERSPECTIVE)
        return nb_report_failure("fog: %s: its camera must be a perspective one, as that of the picture",
                                 wanted->scene);
    if (wanted->frame_of_name && nebel_get_scene_data(all->loaded.scene)->sun_key_count > 1)
        return nb_report_failure(
            "fog: %s: --frame name: the sun has keys, and light is prepared for one frame; name the frame",
            wanted->scene);
    all->shared.scene = all->loaded.scene;
    all->shared.scene_fog = all->loaded.fog;
    all->shared.scene_lighting = all->loaded.lighting;
    return NB_DONE;
}

static const nebel_scene_data *contents_of(const crew *all)
{
    return all->shared.scene != NULL ? nebel_get_scene_data(all->shared.scene) : NULL;
}

/* The first process does so for all that joined. */
static int list_files(crew *all)
{
    const nb_fog_call *const wanted = all->shared.wanted;
    if (!all->jobs.is_chief) return NB_DONE;
    const int status = nb_fog_names_list(&wanted->patterns, wanted->scene, contents_of(all), &all->list);
    if (status != NB_DONE) return status;
    if (all->list.result_count > 0 && !wanted->quiet)
        nb_report_message("note: %zu of the pictures are results of an earlier call, and are passed over",
                          all->list.result_count);
    nb_fog_list_keep(&all->list, &wanted->shard);
    return nb_fog_list_make_folders(&all->list);
}

static int sign(crew *all)
{
    const nb_fog_call *const wanted = all->shared.wanted;
    if (wanted->scene != NULL && !nb_record_can_add_scene(wanted->scene)) {
        if (!wanted->resume && !all->jobs.is_joined) return NB_DONE;
        return nb_report_failure("fog: %s: --resume and MPI need a scene in a file", wanted->scene);
    }
    all->start = nb_fog_record_start(wanted, contents_of(all));
    all->shared.start = &all->start;
    return NB_DONE;
}

static int is_there(void *user, uint64_t item)
{
    const crew *const all = user;
    return nb_fog_names_are_made(&all->list.files[item]);
}

/* What all processes need, and whether they agree on what that is. */
static int prepare(crew *all)
{
    char name[NEBEL_MAX_RECORD + 1] = "";
    int status = load_scene(all);
    if (status == NB_DONE) status = list_files(all);
    status = nb_fog_list_copy_first(&all->jobs, status, &all->list);
    if (status == NB_DONE) status = sign(all);
    if (all->shared.start != NULL) nb_fog_record_name_job(&all->start, all->shared.wanted, name);
    if (status == NB_DONE && all->shared.wanted->resume && !all->shared.wanted->quiet)
        nb_jobs_survey(&all->jobs, all->list.count, is_there, all);
    return nb_jobs_begin(&all->jobs, all->list.count, 1, status, name);
}

/* Of those that no process took, as all had given up. */
static void note_left(const crew *all)
{
    const nb_jobs *const jobs = &all->jobs;
    const uint64_t seen = jobs->all_made + jobs->all_kept + jobs->all_failed;
    if (jobs->is_chief && jobs->has_begun && seen < jobs->count)
        nb_report_message("fog: %llu pictures are left to do", (unsigned long long)(jobs->count - seen));
}

static int fog_list(crew *all)
{
    if (!all->shared.wanted->quiet) nb_jobs_note_copies(&all->jobs);
    nb_interrupt_listen();
    nb_progress_bar_begin(&all->meter);
    fog_all(all);
    return all->jobs.failed == 0 ? NB_DONE : NB_FAILED;
}

static int fog_pictures(crew *all)
{
    int status = prepare(all);
    if (status == NB_DONE) status = fog_list(all);
    const double seconds = nb_progress_bar_end(&all->meter);
    if (nb_interrupt_is_requested()) return nb_report_failure("fog: %s: stopped", all->shared.wanted->patterns.output);
    status = nb_jobs_end(&all->jobs, status);
    const int has_some = status == NB_DONE || all->jobs.all_made + all->jobs.all_kept > 0;
    if (has_some && !all->shared.wanted->quiet) summarize(all, seconds);
    note_left(all);
    return status;
}

/* A shard has a list of its own, and does all of that. */
static int fog(const nb_fog_call *wanted)
{
    nb_fog_call own = *wanted;
    crew all = {.shared = {.wanted = &own, .row_threads = 1, .hold = hold, .answer = answer},
                .jobs = nb_jobs_of(&(nb_shard){0, wanted->shard.count > 0}),
                .meter = nb_progress_bar_start(wanted->quiet)};
    all.shared.user = &all;
    if (mtx_init(&all.lock, mtx_plain) != thrd_success || mtx_init(&holding, mtx_plain) != thrd_success)
        return nb_report_failure("fog: out of memory");
    int status = nb_jobs_join(&all.jobs);
    if (status != NB_DONE) return status;
    own.quiet |= !all.jobs.is_chief; /* what one has said need not be repeated */
    all.listener.quiet = own.quiet;
    if (all.jobs.is_joined && !own.quiet) nb_progress_bar_write_lines(&all.meter);
    status = fog_pictures(&all);
    nb_fog_names_free(&all.list);
    nb_load_free(&all.loaded);
    mtx_destroy(&all.lock);
    mtx_destroy(&holding);
    return status;
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    nb_fog_call wanted = {0};
    int status = nb_options_parse(&nb_commands_fog, count, words, &arguments);
    if (status < 0) status = nb_fog_call_read(&arguments, &wanted);
    if (status >= 0) return status;
    status = fog(&wanted);
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
