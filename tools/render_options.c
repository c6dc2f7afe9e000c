#define _POSIX_C_SOURCE 200809L

#include "render_options.h"

#include "decimal.h"
#include "isa_option.h"
#include "frame_pattern.h"
#include "reader.h"
#include "messages.h"
#include "thread_pool.h"

#include <string.h>
#include <unistd.h>

enum {
    OUTPUT,
    SIZE,
    SAMPLES,
    EXPOSURE,
    FRAME,
    FRAMES,
    SHUTTER,
    FPS,
    QUALITY,
    AOV,
    TOLERANCE,
    METHOD,
    MULTIPLE_SCATTERING,
    TESSELLATE,
    TESSELLATE_TRIANGLES,
    TESSELLATE_DEPTH,
    DEVICE,
    ISA,
    THREADS,
    MEMORY,
    BOUNCES,
    SEED,
    SHARD,
    RESUME,
    BANDS,
    QUIET,
    COUNT
};

_Static_assert((int)COUNT == (int)NB_RENDER_OPTIONS, "as many as the header says");
_Static_assert((int)COUNT <= (int)NB_MAX_OPTIONS, "no more than arguments have room for");

const nb_option nb_render_options[NB_RENDER_OPTIONS] = {
    [OUTPUT] = {"output", 'o', "FILE",
                "The picture: .png (tone mapped, sRGB, 8 bit) or .exr\n(linear light, float); -: PNG to standard "
                "output.\nWith --frames also .webp: a film. Needed."},
    [SIZE] = {"size", 's', "WxH", "Pixels, each side 1 to 32768, 2^28 in all (--aov:\n2^26). Default: 1280x720."},
    [SAMPLES] = {"samples", 0, "N", "Samples for each pixel, 1 to 4096. Default: 4."},
    [EXPOSURE] = {"exposure", 'e', "EV", "Stops, -20 to 20: 1 doubles the light. Not for\nEXR. Default: 0."},
    [FRAME] = {"frame", 0, "N", "The frame of a moving camera, 0 to 1000000.\nDefault: 0."},
    [FRAMES] = {"frames", 0, "A-B",
                "All frames from A to B; FILE then has %d or %04d\nwhere the number belongs (and %% for a %), or it "
                "ends\nin .webp: one film of all."},
    [SHUTTER] = {"shutter", 0, "S",
                 "Motion blur: how long a picture looks from its frame\non, in frames, 0 to 1; each of its --samples "
                 "at a\ntime "
                 "of its own. Default: 0, a moment."},
    [FPS] = {"fps", 0, "N", "Of a film: frames a second, 1 to 100. Default: 24."},
    [QUALITY] = {"quality", 0, "N", "Of a film, 1 to 100: more is larger and better, 100\nwithout loss. Default: 85."},
    [AOV] = {"aov", 0, NULL,
             "EXR only: adds transmittance.{R,G,B},\nin_scattering.{R,G,B}, depth.Z (m, inf: nothing\n"
             "there), normal.{X,Y,Z} and, of the CPU, error (its\nbound) or, of path, standard_error.{R,G,B}."},
    [TOLERANCE] = {"tolerance", 0, "E",
                   "How far off the fog may be where it is integrated:\nabsolute on transmittance, relative to max(1,\n"
                   "largest source radiance) on in-scattering.\n0 < E <= 1. Default: 0.002."},
    [METHOD] =
        {"method", 0, "NAME",
         "exact (default); on surfaces alone: vertex: the\nfog at vertices; additive: the same, but it only\nadds; "
         "linear, exp, exp2: the factors of section\n\"classic\"; fog-coord, two-pass, alpha: the fog at\nvertices as "
         "OpenGL 1.x takes it; d3d9: the states\nin \"classic\"; cells, cells-pixel: section \"cells\"\nat vertices or "
         "pixels; five-tap, of --device gl:\nparticles meet surfaces by five depths; path, of the\nCPU: paths of "
         "light, by chance and without bias,\nslow (its old name: reference)."},
    [MULTIPLE_SCATTERING] = {"multiple-scattering", 0, "MODEL",
                             "Of sunlight in fog, in place of what the scene says:\ndiffusion, which adds what comes "
                             "after the first\nscattering; or off."},
    [TESSELLATE] = {"tessellate", 0, "E",
                    "With --method vertex or additive: smaller triangles,\nuntil the fog's factor is within E of the "
                    "exact one\nfor the camera, 1e-6 < E <= 1."},
    [TESSELLATE_TRIANGLES] = {"tessellate-triangles", 0, "N",
                              "No triangle of a model that has come to so many is\nhalved for its error, up to 10^9. "
                              "Default: 262144."},
    [TESSELLATE_DEPTH] = {"tessellate-depth", 0, "N",
                          "How often a triangle may be halved for its error, 1\nto 48. Default: 20."},
    [DEVICE] =
        {"device", 0, "NAME",
         "cpu (default): ray tracing; gl: OpenGL, with shadow\nmaps. No --tolerance, --isa and --threads with gl."},
    [ISA] = {"isa", 0, "NAME",
             "Instruction set: scalar, sse2, avx2, avx512 or neon.\nDefault: the best of this processor."},
    [THREADS] = {"threads", 't', "N", "Threads, 0 for all (default). Any number gives the\nsame picture."},
    [MEMORY] = NB_MEMORY_OPTION,
    [BOUNCES] = {"bounces", 0, "N",
                 "With --method path: how often light is\nscattered or reflected at most, 1 to 10000. 1 is what\n"
                 "exact shows. Default: as often as it happens."},
    [SEED] = {"seed", 0, "N",
              "With --method path: 0 to 4294967295; other\nseeds give independent pictures. Default: 0."},
    [SHARD] = NB_SHARD_OPTION,
    [RESUME] = NB_RESUME_OPTION,
    [BANDS] = {"bands", 0, "ROWS",
               "Renders a picture in bands of so many rows, a\nmultiple of 64, in memory for one of them. Default:\n"
               "none; of one picture with --shard, --resume or MPI\nas many as have 2^18 pixels."},
    [QUIET] = {"quiet", 'q', NULL,
               "No progress bar, no notes and no summary; warnings\nand errors are still reported."},
};

/* What nebel_tessellate counts for rounding. */
#define LEAST_TESSELLATION 1e-6

/* Pictures of more samples are not written. */
enum { LARGEST_SIDE = 32768, MOST_PIXELS = 1 << 28, MOST_PIXELS_AOV = 1 << 26, LAST_FRAME = 1000000 };

/* "A<separator>B", two whole numbers up to `most`. */
static int read_pair(const char *text, char separator, uint32_t most, uint32_t *a, uint32_t *b)
{
    const char *const middle = strchr(text, separator);
    if (middle == NULL) return 0;
    const int good = nb_decimal_read_whole(text, (size_t)(middle - text), a) == NB_DECIMAL_GOOD &&
                     nb_decimal_read_whole(middle + 1, strlen(middle + 1), b) == NB_DECIMAL_GOOD;
    return good && *a <= most && *b <= most;
}

static void read_size(nb_arguments *arguments, nb_render_arguments *wanted)
{
    wanted->width = 1280;
    wanted->height = 720;
    const char *const text = arguments->values[SIZE];
    if (text == NULL) return;
    const int good = read_pair(text, 'x', LARGEST_SIDE, &wanted->width, &wanted->height);
    const uint64_t pixels = (uint64_t)wanted->width * wanted->height;
    if (!good || pixels == 0) {
        nb_options_reject(arguments, SIZE, "is no size such as 1280x720, each side from 1 to 32768");
    } else if (pixels > (wanted->aov ? MOST_PIXELS_AOV : MOST_PIXELS)) {
        nb_options_reject(arguments, SIZE, "is too large; 2^28 pixels are possible, 2^26 with --aov");
    }
}

static void read_frames(nb_arguments *arguments, nb_render_arguments *wanted)
{
    wanted->first_frame = nb_options_whole(arguments, FRAME, 0, LAST_FRAME, 0);
    wanted->last_frame = wanted->first_frame;
    const char *const text = arguments->values[FRAMES];
    wanted->many_frames = text != NULL;
    if (text == NULL) return;
    if (arguments->values[FRAME] != NULL) nb_options_reject(arguments, FRAMES, "contradicts --frame; leave one out");
    const int good = read_pair(text, '-', LAST_FRAME, &wanted->first_frame, &wanted->last_frame);
    if (good && wanted->first_frame <= wanted->last_frame) return;
    nb_options_reject(arguments, FRAMES, "is no range such as 0-95, of frames up to 1000000; one alone is --frame");
}

/* A side of a WebP. */
enum { FILM_SIDE = 16383 };

static void read_film(nb_arguments *arguments, nb_render_arguments *wanted)
{
    static const int of_films[] = {FPS, QUALITY};
    wanted->fps = nb_options_number(arguments, FPS, 1, NEBEL_MAX_MOVIE_RATE, NEBEL_DEFAULT_MOVIE_RATE);
    wanted->quality = (int)nb_options_whole(arguments, QUALITY, 1, 100, NEBEL_DEFAULT_MOVIE_QUALITY);
    if (!wanted->is_film) {
        for (size_t i = 0; i < sizeof of_films / sizeof *of_films; i++)
            if (arguments->values[of_films[i]] != NULL)
                nb_options_refuse(arguments, of_films[i], "is for films; name a file that ends in .webp");
        return;
    }
    if (!wanted->many_frames)
        nb_options_reject(arguments, OUTPUT, "is a film; say which frames, as in --frames 0-95, or name a .png");
    else if (nb_pattern_find_fault(wanted->output) == NULL)
        nb_options_reject(arguments, OUTPUT, "is one film of all frames; leave out the number");
    if (wanted->aov) nb_options_reject(arguments, OUTPUT, "is no .exr; --aov needs one");
    if (wanted->width > FILM_SIDE || wanted->height > FILM_SIDE)
        nb_options_reject(arguments, SIZE, "is too large for a film, whose sides are at most 16383");
}

static const char standard_output[] = "/dev/stdout";

static void read_output(nb_arguments *arguments, nb_render_arguments *wanted)
{
    wanted->output = arguments->values[OUTPUT];
    if (wanted->output == NULL) {
        nb_report_message("render: where to? add -o FILE.png or -o FILE.exr");
        arguments->misused = 1;
        return;
    }
    if (strcmp(wanted->output, "-") == 0) wanted->output = standard_output;
    if (strcmp(wanted->output, standard_output) == 0 && isatty(STDOUT_FILENO))
        nb_options_reject(arguments, OUTPUT, "is a terminal; send the picture to a file or to a program");
    wanted->is_film = nebel_is_movie_path(wanted->output);
    if (wanted->is_film) return;
    wanted->format = nebel_get_image_format(wanted->output);
    if (wanted->format == NEBEL_IMAGE_NONE) {
        nb_options_reject(arguments, OUTPUT, "is no name that ends in .png, .exr or .webp");
        return;
    }
    const char *const fault = wanted->many_frames ? nb_pattern_find_fault(wanted->output) : NULL;
    if (fault != NULL) nb_options_reject(arguments, OUTPUT, fault);
    if (wanted->format == NEBEL_IMAGE_PNG && wanted->aov)
        nb_options_reject(arguments, OUTPUT, "is no .exr; --aov needs one");
    if (wanted->format == NEBEL_IMAGE_EXR && arguments->values[EXPOSURE] != NULL) {
        nb_options_reject(arguments, EXPOSURE, "is for PNG; an EXR keeps the light as it is");
    }
}

int nb_render_takes_factor(nebel_method method)
{
    return method == NEBEL_METHOD_LINEAR || method == NEBEL_METHOD_EXP || method == NEBEL_METHOD_EXP2;
}

int nb_render_takes_color(nebel_method method)
{
    return nb_render_takes_factor(method) || method == NEBEL_METHOD_FOG_COORD || method == NEBEL_METHOD_ALPHA;
}

static void read_tessellate(nb_arguments *arguments, nb_render_arguments *wanted)
{
    nebel_tessellation_desc *const desc = &wanted->tessellation;
    desc->max_triangles = nb_options_whole(arguments, TESSELLATE_TRIANGLES, 1, 1000000000, 1 << 18);
    desc->max_depth = nb_options_whole(arguments, TESSELLATE_DEPTH, 1, 48, 20);
    if (arguments->values[TESSELLATE] == NULL) {
        static const int limits[] = {TESSELLATE_TRIANGLES, TESSELLATE_DEPTH};
        for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
            if (arguments->values[limits[i]] != NULL)
                nb_options_refuse(arguments, limits[i], "does nothing without --tessellate; add that, or leave it out");
        return;
    }
    desc->max_error = nb_options_number(arguments, TESSELLATE, 0, 1, 1);
    if (desc->max_error <= LEAST_TESSELLATION)
        nb_options_reject(arguments, TESSELLATE, "is not more than 1e-6, which rounding may take");
    if (wanted->method != NEBEL_METHOD_VERTEX && wanted->method != NEBEL_METHOD_ADDITIVE)
        nb_options_refuse(arguments, TESSELLATE, "needs --method vertex or additive; say so, or leave it out");
    if (wanted->many_frames)
        nb_options_refuse(arguments, TESSELLATE, "is for one frame: another camera needs other triangles");
}

static void read_path(nb_arguments *arguments, nb_render_arguments *wanted)
{
    static const int of_path[] = {BOUNCES, SEED};
    wanted->bounces = nb_options_whole(arguments, BOUNCES, 1, 10000, 0);
    wanted->seed = nb_options_whole(arguments, SEED, 0, UINT32_MAX, 0);
    for (size_t i = 0; i < sizeof of_path / sizeof *of_path; i++)
        if (arguments->values[of_path[i]] != NULL && wanted->method != NEBEL_METHOD_PATH)
            nb_options_refuse(arguments, of_path[i], "needs --method path; say so, or leave it out");
    if (wanted->method == NEBEL_METHOD_PATH && wanted->gl)
        nb_options_reject(arguments, METHOD, "is for --device cpu; leave out --device gl");
}

static void read_device(nb_arguments *arguments, nb_render_arguments *wanted)
{
    static const char *const devices[] = {"cpu", "gl", NULL};
    static const int of_cpu[] = {TOLERANCE, ISA, THREADS};
    const char *methods[NEBEL_METHOD_COUNT + 2] = {NULL};
    for (int i = 0; i < NEBEL_METHOD_COUNT; i++) methods[i] = nebel_method_name((nebel_method)i);
    methods[NEBEL_METHOD_COUNT] = "reference"; /* the old name of path */
    const int method = nb_options_choice(arguments, METHOD, methods, NEBEL_METHOD_EXACT);
    wanted->method = method == NEBEL_METHOD_COUNT ? NEBEL_METHOD_PATH : (nebel_method)method;
    wanted->gl = nb_options_choice(arguments, DEVICE, devices, 0);
    for (size_t i = 0; i < sizeof of_cpu / sizeof *of_cpu && wanted->gl; i++) {
        if (arguments->values[of_cpu[i]] != NULL) {
            nb_options_refuse(arguments, of_cpu[i], "is for --device cpu; leave it out with gl");
        }
    }
    if (!wanted->gl && wanted->method == NEBEL_METHOD_FIVE_TAP)
        nb_options_reject(arguments, METHOD, "is for --device gl; the CPU traces particles exactly");
    if (wanted->method != NEBEL_METHOD_EXACT && arguments->values[TOLERANCE] != NULL)
        nb_options_refuse(arguments, TOLERANCE, "is for --method exact; leave it out with another");
}

static void read_shutter(nb_arguments *arguments, nb_render_arguments *wanted)
{
    wanted->shutter = nb_options_number(arguments, SHUTTER, 0, 1, 0);
    if (wanted->shutter == 0) return;
    if (wanted->samples < 2)
        nb_options_refuse(arguments, SHUTTER, "needs a --samples for each time; ask for 2 or more, better 16");
    if (wanted->gl) nb_options_refuse(arguments, SHUTTER, "is for --device cpu; leave it out with gl");
    if (wanted->tessellation.max_error > 0)
        nb_options_refuse(arguments, SHUTTER,
                          "has many cameras, and each needs other triangles; leave out --tessellate");
}

static void read_scattering(nb_arguments *arguments, nb_render_arguments *wanted)
{
    static const char *const models[] = {"off", "diffusion", NULL};
    static const nb_scattering_option chosen[] = {NB_SCATTERING_OFF, NB_SCATTERING_DIFFUSION};
    const int is_path = wanted->method == NEBEL_METHOD_PATH;
    /* A path scatters light as often as it likes: a solution would be work for nothing. */
    wanted->scattering = is_path ? NB_SCATTERING_OFF : NB_SCATTERING_OF_FILE;
    if (arguments->values[MULTIPLE_SCATTERING] == NULL) return;
    if (is_path) nb_options_refuse(arguments, MULTIPLE_SCATTERING, "is not for --method path, which has --bounces");
    wanted->scattering = chosen[nb_options_choice(arguments, MULTIPLE_SCATTERING, models, 0)];
}

static void read_jobs(nb_arguments *arguments, nb_render_arguments *wanted)
{
    static const int of_files[] = {SHARD, RESUME, BANDS};
    wanted->shard = nb_jobs_read_shard(arguments, SHARD);
    wanted->resume = arguments->values[RESUME] != NULL;
    wanted->band_rows = nb_options_whole(arguments, BANDS, NEBEL_WINDOW_STEP, LARGEST_SIDE, 0);
    if (wanted->band_rows % NEBEL_WINDOW_STEP != 0)
        nb_options_reject(arguments, BANDS, "is no multiple of 64, such as 128");
    if (wanted->band_rows > 0 && wanted->is_film)
        nb_options_refuse(arguments, BANDS, "is for pictures; the frames of a film are parts already");
    if (wanted->band_rows > 0 && wanted->gl)
        nb_options_refuse(arguments, BANDS,
                          "is for --device cpu: OpenGL draws a picture as a whole; leave it out with gl");
    nb_jobs_refuse_special(arguments, of_files, sizeof of_files / sizeof *of_files, wanted->output);
}

int nb_render_call_read(nb_arguments *arguments, nb_render_arguments *wanted)
{
    wanted->scene = arguments->operands[0];
    wanted->aov = arguments->values[AOV] != NULL;
    wanted->quiet = arguments->values[QUIET] != NULL;
    wanted->samples = nb_options_whole(arguments, SAMPLES, 1, 4096, 4);
    wanted->exposure = nb_options_number(arguments, EXPOSURE, -20, 20, 0);
    wanted->tolerance = nb_options_number(arguments, TOLERANCE, 0, 1, NEBEL_DEFAULT_TOLERANCE);
    if (wanted->tolerance == 0) nb_options_reject(arguments, TOLERANCE, "is not more than 0");
    wanted->renderer.thread_count = (int)nb_options_whole(arguments, THREADS, 0, NB_MAX_WORKERS, 0);
    nb_reader_limit(nb_options_memory(arguments, MEMORY));
    wanted->renderer.isa = nb_isa_choose(arguments, ISA);
    read_size(arguments, wanted);
    read_frames(arguments, wanted);
    read_output(arguments, wanted);
    read_film(arguments, wanted);
    read_device(arguments, wanted);
    read_path(arguments, wanted);
    read_scattering(arguments, wanted);
    read_tessellate(arguments, wanted);
    read_shutter(arguments, wanted);
    read_jobs(arguments, wanted);
    if (arguments->misused) return nb_report_misuse("render", "render: nothing was done");
    return -1;
}
