/* nebel trace: rays in, numbers out. */
#define _POSIX_C_SOURCE 200809L

#include "warn_atmosphere.h"
#include "commands.h"
#include "warn_endless_fog.h"
#include "isa_option.h"
#include "load_scene.h"
#include "fd_output.h"
#include "ray_reader.h"
#include "reader.h"
#include "messages.h"
#include "shortest_decimal.h"
#include "thread_pool.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PRECISION, ISA, TOLERANCE, FRAME, THREADS, MEMORY };

static const nb_option options[] = {
    [PRECISION] = {"precision", 'p', "NAME", "double: the reference (default).\nfloat: 32 bit, several rays at once."},
    [ISA] = {"isa", 0, "NAME",
             "Instruction set for float: scalar, sse2, avx2,\navx512 or neon. All give the same bits.\n"
             "Default: the best of this processor."},
    [TOLERANCE] = {"tolerance", 0, "E",
                   "How far off an integrated result may be: absolute\non transmittance, relative to max(1, largest\n"
                   "source radiance) on in-scattering. Closed forms\nare exact whatever it is. 0 < E <= 1.\n"
                   "Default: 0.002."},
    [FRAME] = {"frame", 0, "N", "The frame of moving fog, 0 to 1000000. Default: 0."},
    [THREADS] = {"threads", 't', "N", "Threads, 0 for all (default). Any number gives the\nsame bytes."},
    [MEMORY] = NB_MEMORY_OPTION,
};

static const char about[] = "Reads rays from standard input and writes to standard output what the fog of\n"
                            "SCENE (JSON) does to the light along each: no surfaces, media only.\n"
                            "With \"multiple_scattering\" in the scene the light that fog scatters more than\n"
                            "once is in it, by diffusion: a model, whose own error is not in the bound.\n"
                            "\n"
                            "In: one ray to a line,\n"
                            "\n"
                            "    ox oy oz dx dy dz tmax      # a comment\n"
                            "\n"
                            "the origin in metres, a direction of any length but 0, and the length of the ray\n"
                            "in metres, 0 or more, or inf. Numbers are decimal (1, -0.5, 2e3) and stand apart\n"
                            "by blanks or tabs; empty lines and comments are skipped.\n"
                            "\n"
                            "Out: CSV with the header T_r,T_g,T_b,S_r,S_g,S_b,error and a line for each ray:\n"
                            "transmittance, in-scattered radiance, and a bound of the absolute error of the\n"
                            "six as they are written. Numbers have as many digits as it takes to read them\n"
                            "back exactly: as doubles, or with --precision float as floats.\n"
                            "\n"
                            "All rays are checked and traced before the first byte is written: on an error\n"
                            "standard output stays empty and the message names the line.\n";

static const char examples[] = "Examples:\n"
                               "  Straight ahead for 100 m, then without end:\n"
                               "    printf '0 1 0  0 0 -1  100\\n0 1 0  0 0 -1  inf\\n' | nebel trace mist.json\n"
                               "  The reference, as exact as it gets:\n"
                               "    nebel trace mist.json --tolerance 1e-9 < rays.txt > light.csv\n"
                               "  What a renderer sees:\n"
                               "    nebel trace mist.json -p float --isa avx2 < rays.txt > light.csv\n"
                               "\n"
                               "Exit status: 0 done, 1 the scene or a ray is wrong or the output could not be\n"
                               "written, 2 the call was wrong.\n";

enum { LAST_FRAME = 1000000 };

typedef struct nb_trace_options {
    nebel_trace_desc trace;
    uint32_t frame;
    int threads;
} nb_trace_options;

/* ---- reading --------------------------------------------------------------------------------- */

static int report_line(size_t line, const char *problem)
{
    return nb_report_failure("standard input:%zu: %s", line, problem);
}

static int read_rays(nb_ray_list *rays)
{
    enum { PIECE = 1 << 18 };
    char *const piece = malloc(PIECE);
    if (piece == NULL) return nb_report_failure("standard input: out of memory");
    if (isatty(STDIN_FILENO)) nb_report_message("rays, please: ox oy oz dx dy dz tmax; Ctrl-D ends them");
    int status = NB_DONE;
    for (;;) {
        const ssize_t size = read(STDIN_FILENO, piece, PIECE);
        if (size < 0 && errno == EINTR) continue;
        if (size < 0) status = nb_report_failure("standard input: %s", strerror(errno));
        const int good = size > 0 ? nb_rays_feed(rays, piece, (size_t)size) : nb_rays_finish(rays);
        if (size >= 0 && !good) status = report_line(rays->line, rays->problem);
        if (size <= 0 || status != NB_DONE) break;
    }
    free(piece);
    return status;
}

/* ---- tracing --------------------------------------------------------------------------------- */

/* Rays are traced in blocks: whoever is free takes the next one. */
enum { BLOCK = 1024 };

typedef struct nb_trace_work {
    const nebel_snapshot *fog;
    nebel_trace_desc desc;
    const nb_ray_list *rays;
    nebel_transfer *transfers;
    atomic_size_t next_block;
    atomic_size_t first_failed; /* the lowest ray that is an error; the number of rays: none */
} nb_trace_work;

static void note_failure(nb_trace_work *shared, size_t ray)
{
    size_t first = atomic_load(&shared->first_failed);
    while (ray < first && !atomic_compare_exchange_weak(&shared->first_failed, &first, ray)) {
    }
}

static nebel_result trace(const nb_trace_work *shared, size_t first, size_t count, size_t *failed)
{
    nebel_trace_desc desc = shared->desc;
    *failed = 0;
    desc.failed_ray = failed;
    return nebel_trace(shared->fog, &desc, count, &shared->rays->entries[first].ray, sizeof(nb_rays_entry),
                       &shared->transfers[first], sizeof(nebel_transfer));
}

static void trace_blocks(int worker, int count, void *user)
{
    nb_trace_work *const shared = user;
    (void)worker, (void)count;
    for (;;) {
        const size_t first = BLOCK * atomic_fetch_add(&shared->next_block, 1);
        /* Blocks are taken in ascending order: beyond a failure there is nothing to learn. */
        if (first >= shared->rays->count || first > atomic_load(&shared->first_failed)) return;
        const size_t left = shared->rays->count - first;
        size_t failed;
        if (trace(shared, first, left < BLOCK ? left : BLOCK, &failed) != NEBEL_OK) {
            note_failure(shared, first + failed);
        }
    }
}

/* Traces the ray alone once more, to hear what is wrong with it. */
static int report_ray(const nb_trace_work *shared, size_t ray, nb_report_listener *listener)
{
    size_t failed;
    listener->mode = NB_REPORT_KEEP;
    const nebel_result result = trace(shared, ray, 1, &failed);
    const char *problem = nebel_result_text(result != NEBEL_OK ? result : NEBEL_ERROR_MEMORY);
    if (listener->kept[0] != '\0') problem = listener->kept;
    return report_line(shared->rays->entries[ray].line, problem);
}

/* The results, or NULL after a message. */
static nebel_transfer *trace_all(const nb_load_result *loaded, const nb_ray_list *rays, const nb_trace_options *wanted,
                                 nb_report_listener *listener)
{
    nb_trace_work shared = {.fog = loaded->fog, .desc = wanted->trace, .rays = rays};
    shared.desc.lighting = loaded->lighting;
    shared.transfers =
        rays->count < SIZE_MAX / sizeof(nebel_transfer) ? malloc((rays->count + 1) * sizeof(nebel_transfer)) : NULL;
    if (shared.transfers == NULL) {
        (void)nb_report_failure("standard input: out of memory for %zu rays; trace them in parts", rays->count);
        return NULL;
    }
    atomic_init(&shared.next_block, 0);
    atomic_init(&shared.first_failed, rays->count);
    listener->mode = NB_REPORT_DROP;
    nb_workers_run(wanted->threads, trace_blocks, &shared);
    const size_t failed = atomic_load(&shared.first_failed);
    if (failed == rays->count) return shared.transfers;
    (void)report_ray(&shared, failed, listener);
    free(shared.transfers);
    return NULL;
}

/* ---- writing --------------------------------------------------------------------------------- */

enum { COLUMNS = 7, SHARE = 2048, LINE_SIZE = COLUMNS * (NB_SHORTEST_SIZE + 1) };

/* Each worker writes the text of SHARE results, which then go out in order. */
typedef struct nb_output_page {
    const nebel_transfer *transfers;
    size_t count; /* results on this page */
    nebel_precision precision;
    char *text; /* workers * SHARE * LINE_SIZE */
    size_t sizes[NB_MAX_WORKERS];
} nb_output_page;

static size_t write_number(double number, nebel_precision precision, char *text)
{
    if (precision == NEBEL_PRECISION_FLOAT) return nb_shortest_write_float((float)number, text);
    return nb_shortest_write_double(number, text);
}

/* The shortest text of a float, taken as a real number, is off by up to half a unit in the float's last place, which
 * the bound then has to hold for, too. It is a text of that kind itself, so that the next larger float is written. */
static double bound_of_floats(const double numbers[COLUMNS - 1], double bound)
{
    double largest = 0;
    for (int i = 0; i < COLUMNS - 1; i++) largest = fmax(largest, fabs(numbers[i]));
    return (double)nextafterf((float)(bound + largest * (double)(FLT_EPSILON / 2)), HUGE_VALF);
}

static size_t write_light(const nebel_transfer *transfer, nebel_precision precision, char *text)
{
    double numbers[COLUMNS];
    memcpy(numbers, transfer->transmittance, sizeof transfer->transmittance);
    memcpy(numbers + 3, transfer->in_scattering, sizeof transfer->in_scattering);
    numbers[6] = precision == NEBEL_PRECISION_FLOAT ? bound_of_floats(numbers, transfer->error) : transfer->error;
    size_t size = 0;
    for (int i = 0; i < COLUMNS; i++) {
        size += write_number(numbers[i], precision, text + size);
        text[size++] = i + 1 < COLUMNS ? ',' : '\n';
    }
    return size;
}

static void write_share(int worker, int count, void *user)
{
    nb_output_page *const shared = user;
    (void)count;
    const size_t first = (size_t)worker * SHARE;
    char *const text = shared->text + first * LINE_SIZE;
    size_t size = 0;
    for (size_t i = first; i < first + SHARE && i < shared->count; i++) {
        size += write_light(&shared->transfers[i], shared->precision, text + size);
    }
    shared->sizes[worker] = size;
}

/* 0 or the errno of what went wrong. */
static int write_page(nb_output_page *shared, int workers)
{
    nb_workers_run(workers, write_share, shared);
    int error = 0;
    for (int i = 0; i < workers && error == 0; i++) {
        error = nb_output_write(STDOUT_FILENO, shared->text + (size_t)i * SHARE * LINE_SIZE, shared->sizes[i]);
    }
    return error;
}

static int write_lights(const nebel_transfer *transfers, size_t count, const nb_trace_options *wanted)
{
    static const char header[] = "T_r,T_g,T_b,S_r,S_g,S_b,error\n";
    const size_t step = (size_t)wanted->threads * SHARE;
    nb_output_page shared = {.precision = wanted->trace.precision, .text = malloc(step * LINE_SIZE)};
    if (shared.text == NULL) return nb_report_failure("standard output: out of memory");
    nb_shortest_prepare();
    int error = nb_output_write(STDOUT_FILENO, header, sizeof header - 1);
    for (size_t first = 0; first < count && error == 0; first += step) {
        shared.transfers = transfers + first;
        shared.count = count - first < step ? count - first : step;
        error = write_page(&shared, wanted->threads);
    }
    free(shared.text);
    return nb_output_status(error);
}

/* ---- the command ----------------------------------------------------------------------------- */

/* -1 to go on, or the exit status. */
static int read_settings(nb_arguments *arguments, nb_trace_options *wanted)
{
    static const char *const precisions[] = {"double", "float", NULL};
    const uint32_t threads = nb_options_whole(arguments, THREADS, 0, NB_MAX_WORKERS, 0);
    wanted->threads = threads > 0 ? (int)threads : nb_workers_available();
    nb_reader_limit(nb_options_memory(arguments, MEMORY));
    wanted->frame = nb_options_whole(arguments, FRAME, 0, LAST_FRAME, 0);
    wanted->trace.tolerance = nb_options_number(arguments, TOLERANCE, 0, 1, NEBEL_DEFAULT_TOLERANCE);
    if (wanted->trace.tolerance == 0) nb_options_reject(arguments, TOLERANCE, "is not more than 0");
    wanted->trace.precision = (nebel_precision)nb_options_choice(arguments, PRECISION, precisions, 0);
    wanted->trace.isa = nb_isa_choose(arguments, ISA);
    if (arguments->misused) return nb_report_misuse("trace", "trace: nothing was done");
    if (arguments->values[ISA] != NULL && wanted->trace.precision != NEBEL_PRECISION_FLOAT) {
        return nb_report_misuse("trace", "trace: --isa is for float; add --precision float or leave --isa out");
    }
    return -1;
}

/* Few rays are not worth threads. */
static int useful_threads(size_t rays, int threads)
{
    const size_t shares = rays / BLOCK + 1;
    return shares < (size_t)threads ? (int)shares : threads;
}

static void note_planets(const nebel_scene_data *scene, const char *path)
{
    if (scene->planet_count > 0)
        nb_report_message("note: %s: rays meet fog alone, in the light that reaches it; air, ground and clouds of "
                          "planets are left out",
                          path);
}

static int trace_scene(const char *path, nb_trace_options *wanted, nb_ray_list *rays)
{
    nb_report_listener listener = {0};
    nb_load_result loaded;
    int status = nb_load_scene(path, 0, wanted->frame, &listener, &loaded);
    if (status != NB_DONE) return status;
    nb_warn_of_darkness(nebel_get_scene_data(loaded.scene), path);
    nb_warn_of_deep_air(nebel_get_scene_data(loaded.scene), path);
    note_planets(nebel_get_scene_data(loaded.scene), path);
    status = read_rays(rays);
    if (status == NB_DONE) {
        wanted->threads = useful_threads(rays->count, wanted->threads);
        nebel_transfer *const transfers = trace_all(&loaded, rays, wanted, &listener);
        status = transfers != NULL ? write_lights(transfers, rays->count, wanted) : NB_FAILED;
        free(transfers);
    }
    nb_load_free(&loaded);
    return status;
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    nb_trace_options wanted = {0};
    int status = nb_options_parse(&nb_commands_trace, count, words, &arguments);
    if (status < 0) status = read_settings(&arguments, &wanted);
    if (status >= 0) return status;
    nb_ray_list rays = {0};
    status = trace_scene(arguments.operands[0], &wanted, &rays);
    nb_rays_free(&rays);
    return status;
}

const nb_command nb_commands_trace = {
    .name = "trace",
    .summary = "what the fog does to the light along rays",
    .synopsis = "SCENE [options] < RAYS > LIGHT",
    .about = about,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands = "one scene file",
    .fewest_operands = 1,
    .most_operands = 1,
    .examples = examples,
    .run = run,
};
