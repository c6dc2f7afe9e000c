/* nebel bench: how fast this build is on this processor. */
#define _POSIX_C_SOURCE 200809L

#include "commands.h"
#if defined(NEBEL_HAVE_GL)
#include "gl_context.h"
#endif
#include "system_info.h"
#include "messages.h"
#include "output_check.h"

#include "bench/bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { OPTION_DEVICE, OPTION_GROUP, OPTION_JSON, OPTION_QUICK };

static const char about[] = "Measures, and prints each figure beside a floor measured in the same run: what\n"
                            "memory, Embree or older code need for the same work. The ratios compare from one\n"
                            "machine to another, the absolute figures do not. Keep the machine quiet meanwhile;\n"
                            "bench/NOTES.md says what to expect.\n";

static const nb_option options[] = {
    {"device", 'd', "NAME", "cpu (default), or gl: OpenGL on a graphics\nprocessor or in Mesa's software"},
    {"group", 'g', "NAME",
     "only one group; on the cpu: process, segments,\nvertices, frame, sunlight, pass, particles,\noverlap, "
     "lighting, photographs, planet; on gl:\n"
     "pass, particles, planet"},
    {"json", 'j', "FILE", "also write the figures to FILE, as JSON"},
    {"quick", 'q', NULL, "small and short: whether everything runs; the\nfigures mean little"},
};

static const char examples[] = "Examples:\n"
                               "  nebel bench\n"
                               "  nebel bench --group segments --json figures.json\n"
                               "  nebel bench --device gl\n"
                               "\n"
                               "A target that is missed is no failure: the exit status says whether it ran.\n"
                               "Exit status: 0 done, 1 the work failed, 2 the call was wrong.\n";

/* The path of this program; NULL where the system does not tell. */
static const char *find_program(char *path, size_t size)
{
    const ssize_t length = readlink("/proc/self/exe", path, size - 1);
    if (length <= 0) return NULL;
    path[length] = '\0';
    return path;
}

static void print_head(const char *processor)
{
    (void)printf("nebel %s on %s\n", nebel_version(), processor);
    (void)printf("A line: what, how much, how many times its floor, the floor, the target of that ratio.\n");
}

/* The file keeps what it has until there is all of it. */
static int write_json(const nb_figures *figures, int file, const char *path)
{
    char *text = NULL;
    size_t size = 0;
    FILE *const stream = open_memstream(&text, &size);
    if (stream != NULL) nb_figures_write_json(figures, stream);
    const int good = stream != NULL && !ferror(stream);
    const int closed = stream != NULL && fclose(stream) == 0;
    int status = NB_FAILED;
    if (good && closed)
        status = nb_target_replace(file, path, text, size);
    else
        (void)nb_report_failure("bench: %s: out of memory", path);
    free(text);
    return status;
}

static int bench(const nb_bench_desc *desc, const char *json, const char *renderer)
{
    char processor[640];
    nb_machine_read_processor(processor, 256);
    if (renderer != NULL) {
        const size_t used = strlen(processor);
        (void)snprintf(processor + used, sizeof processor - used, "; %s", renderer);
    }
    nb_figures figures = {
        .table = stdout, .processor = processor, .compiler = nb_machine_compiler(), .quick = desc->quick};
    const char *fault = NULL;
    int file = -1;
    if (json != NULL && nb_target_open(json, &file) != NB_DONE) return NB_FAILED;
    print_head(processor);
    int status = NB_DONE;
    if (nb_bench_run(desc, &figures, &fault) != 0) status = nb_report_failure("bench: %s", fault);
    if (json != NULL) {
        const int written = write_json(&figures, file, json);
        if (status == NB_DONE) status = written;
    }
    return status;
}

#if defined(NEBEL_HAVE_GL)
static int bench_opengl(const nb_bench_desc *desc, const char *json)
{
    nb_gl_context gl;
    if (nb_gl_context_open(&gl, NB_GL_API_DESKTOP) != 0) return nb_report_failure("bench: --device gl: %s", gl.fault);
    const int status = bench(desc, json, gl.renderer);
    nb_gl_context_close(&gl);
    return status;
}
#else
static int bench_opengl(const nb_bench_desc *desc, const char *json)
{
    (void)desc, (void)json;
    return nb_report_failure(
        "bench: --device gl: this program was built without OpenGL; build it with -DNEBEL_BUILD_GL=ON");
}
#endif

static int run(int count, char **words)
{
    nb_arguments arguments;
    const int status = nb_options_parse(&nb_commands_bench, count, words, &arguments);
    if (status >= 0) return status;
    char path[4096];
    nb_bench_desc desc = {.quick = arguments.values[OPTION_QUICK] != NULL, .program = find_program(path, sizeof path)};
    static const char *const devices[] = {"cpu", "gl", NULL};
    desc.opengl = nb_options_choice(&arguments, OPTION_DEVICE, devices, 0) == 1;
    if (arguments.values[OPTION_GROUP] != NULL) {
        const int group = nb_options_choice(&arguments, OPTION_GROUP, nb_bench_groups, 0);
        if (arguments.misused) return nb_report_misuse("bench", "bench: nothing was done");
        desc.group = nb_bench_groups[group];
        if (desc.opengl && !nb_bench_has(group, 1))
            nb_options_reject(&arguments, OPTION_GROUP, "is measured on the cpu alone; on gl are pass and particles");
    }
    if (arguments.misused) return nb_report_misuse("bench", "bench: nothing was done");
    if (desc.opengl) return bench_opengl(&desc, arguments.values[OPTION_JSON]);
    return bench(&desc, arguments.values[OPTION_JSON], NULL);
}

const nb_command nb_commands_bench = {
    .name = "bench",
    .summary = "how fast this build is here",
    .synopsis = "[options]",
    .about = about,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands = "nothing",
    .examples = examples,
    .run = run,
};
