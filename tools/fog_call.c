#include "fog_call.h"

#include "decimal.h"
#include "messages.h"
#include "thread_pool.h"

#include <math.h>
#include <string.h>

enum {
    DEPTH,
    OUTPUT,
    DEPTH_FORMAT,
    DEPTH_SCALE,
    DEPTH_KIND,
    DEPTH_CHANNEL,
    CAMERA,
    INTRINSICS,
    HFOV,
    VISIBILITY,
    CONTRAST,
    EXTINCTION,
    AIRLIGHT,
    BLEND,
    INVALID,
    SKY,
    SCENE,
    FRAME,
    SEED,
    TRANSMITTANCE,
    SHARD,
    RESUME,
    THREADS,
    QUIET,
    COUNT
};

_Static_assert((int)COUNT == (int)NB_FOG_OPTIONS, "as many as the header says");

const nb_option nb_fog_options[NB_FOG_OPTIONS] = {
    [DEPTH] = {"depth", 'd', "FILE",
               "How far away each pixel is: PNG, EXR, NPY or PFM, of\nthe picture's size. Needed."},
    [OUTPUT] = {"output", 'o', "FILE",
                "The foggy picture: .png, with the bits of the\npicture, or .exr of an .exr. Needed."},
    [DEPTH_FORMAT] = {"depth-format", 'f', "NAME",
                      "metric (default), cityscapes, kitti, tum, scannet,\nvkitti, carla or hypersim."},
    [DEPTH_SCALE] = {"depth-scale", 0, "M",
                     "Meters that a number of --depth-format metric stands\nfor. Default: 1 of floats."},
    [DEPTH_KIND] =
        {"depth-kind", 0, "KIND",
         "planar: along the camera's axis; radial: along the\npixel's ray; inverse: 1 / meters along the axis;\n"
         "disparity of a stereo pair. Default: the format's,\nwhich is planar of metric."},
    [DEPTH_CHANNEL] = {"depth-channel", 0, "NAME", "Of EXR. Default: Z, depth.Z or the only one."},
    [CAMERA] = {"camera", 'c', "FILE",
                "JSON of Cityscapes, calib.txt of KITTI, YAML of\nOpenCV, or a text of fx fy cx cy."},
    [INTRINSICS] = {"intrinsics", 0, "FX,FY,CX,CY",
                    "The same in pixels; a pixel's center is a whole\nnumber, counted from 0."},
    [HFOV] = {"hfov", 0, "DEG", "The same: degrees from the left to the right edge."},
    [VISIBILITY] = {"visibility", 'v', "M",
                    "How far one sees: where black things have --contrast\nof the fog's light. 0.01 to 1e9."},
    [CONTRAST] = {"contrast", 0, "C", "0 < C < 1. Default: 0.05, the meteorological optical\nrange."},
    [EXTINCTION] = {"extinction", 0, "B", "In place of --visibility: -ln(C) / M, per meter,\n0 to 1e6."},
    [AIRLIGHT] =
        {"airlight", 0, "R,G,B",
         "The fog's own color, 0 to 1 as the picture stores\nit, or estimate (default): from the picture's dark\n"
         "channel."},
    [BLEND] = {"blend", 0, "SPACE",
               "linear (default): light adds, as in nature; srgb:\nstored numbers do, as in most data sets."},
    [INVALID] = {"invalid", 0, "WAY",
                 "Pixels of unknown depth: inpaint (default), from the\nfarther of their neighbours in the row; far; "
                 "keep\nthem without fog."},
    [SKY] = {"sky", 0, "WAY",
             "Pixels that are infinitely far: far (default), keep\nthem without fog, or at so many meters."},
    [SCENE] = {"scene", 0, "FILE",
               "In place of --visibility: the fog, sun and lights of\na scene, seen by its camera."},
    [FRAME] = {"frame", 0, "N",
               "With --scene: the frame of its camera, fog and sun, 0\nto 1000000, or name: the last number in what "
               "the last\n"
               "* of a picture's name stands for. Default: 0."},
    [SEED] =
        {"seed", 0, "N",
         "With --scene: each picture has noise of its own, by N\nand its name. Default: all have that of the scene."},
    [TRANSMITTANCE] = {"transmittance", 0, "FILE",
                       "Writes what part of the light comes through, 0 to 1:\n.png, 16 bit gray (of colors the "
                       "luminance), or .exr."},
    [SHARD] = NB_SHARD_OPTION,
    [RESUME] = NB_RESUME_OPTION,
    [THREADS] = {"threads", 't', "N", "Threads, 0 for all (default). Any number gives the\nsame pictures."},
    [QUIET] = {"quiet", 'q', NULL, "No progress bar and no summary."},
};

/* Exactly `count` numbers between commas, each from low to high. */
static int read_list(nb_arguments *arguments, int option, int count, double low, double high, double *numbers)
{
    const char *at = arguments->values[option];
    for (int i = 0; i < count; i++) {
        const size_t size = strcspn(at, ",");
        if (nb_decimal_read(at, size, &numbers[i]) != NB_DECIMAL_GOOD) return 0;
        if (!(numbers[i] >= low && numbers[i] <= high)) return 0;
        at += size;
        if (*at != (i + 1 < count ? ',' : '\0')) return 0;
        at++;
    }
    return 1;
}

/* ---- depth ----------------------------------------------------------------------------------- */

static void read_depth(nb_arguments *arguments, nb_fog_call *wanted)
{
    static const char *const kinds[] = {"planar", "radial", "inverse", "disparity", NULL};
    static const nebel_depth_measure values[] = {NEBEL_MEASURE_PLANAR, NEBEL_MEASURE_RADIAL, NEBEL_MEASURE_INVERSE,
                                                 NEBEL_MEASURE_DISPARITY};
    enum { MOST_FORMATS = 16 };
    const char *formats[MOST_FORMATS + 1] = {NULL};
    for (size_t i = 0; i < MOST_FORMATS && nebel_depth_format_at(i) != NULL; i++)
        formats[i] = nebel_depth_format_at(i)->name;
    const int format = nb_options_choice(arguments, DEPTH_FORMAT, formats, 0);
    wanted->depth.format = formats[format];
    wanted->depth.channel = arguments->values[DEPTH_CHANNEL];
    if (arguments->values[DEPTH_KIND] != NULL)
        wanted->depth.measure = values[nb_options_choice(arguments, DEPTH_KIND, kinds, 0)];
    wanted->depth.scale = nb_options_number(arguments, DEPTH_SCALE, 1e-9, 1e9, 0);
    if (format != 0 && arguments->values[DEPTH_SCALE] != NULL)
        nb_options_refuse(arguments, DEPTH_SCALE, "is of --depth-format metric alone; the others have their own");
    if (nebel_depth_format_at((size_t)format)->measure == NEBEL_MEASURE_DISPARITY &&
        arguments->values[DEPTH_KIND] != NULL)
        nb_options_refuse(arguments, DEPTH_KIND, "has no place here: the format is disparity");
}

static void read_policies(nb_arguments *arguments, nb_fog_call *wanted)
{
    static const char *const ways[] = {[NB_FOG_FILL] = "inpaint", [NB_FOG_FAR] = "far", [NB_FOG_KEEP] = "keep", NULL};
    wanted->unknown = (nb_fog_unknown)nb_options_choice(arguments, INVALID, ways, NB_FOG_FILL);
    const char *const sky = arguments->values[SKY];
    wanted->sky = (double)INFINITY;
    if (sky == NULL || strcmp(sky, "far") == 0) return;
    if (strcmp(sky, "keep") == 0)
        wanted->sky = (double)NAN;
    else if (nb_decimal_read(sky, strlen(sky), &wanted->sky) != NB_DECIMAL_GOOD ||
             !(wanted->sky >= 0 && wanted->sky <= 1e9))
        nb_options_reject(arguments, SKY, "is not far, keep or a number of meters from 0 to 1e9");
}

/* ---- the camera ------------------------------------------------------------------------------ */

static void read_camera(nb_arguments *arguments, nb_fog_call *wanted)
{
    double numbers[4];
    const char *const *const values = arguments->values;
    wanted->patterns.camera = values[CAMERA];
    if ((values[CAMERA] != NULL) + (values[INTRINSICS] != NULL) + (values[HFOV] != NULL) > 1)
        nb_options_refuse(arguments, values[HFOV] != NULL ? HFOV : INTRINSICS,
                          "has no place here: the camera is given in another way, too");
    if (values[INTRINSICS] != NULL) {
        if (!read_list(arguments, INTRINSICS, 4, -1e9, 1e9, numbers) || !(numbers[0] >= 1e-6 && numbers[1] >= 1e-6))
            nb_options_reject(arguments, INTRINSICS,
                              "is not four numbers with commas between them, the first two from 1e-6 on");
        wanted->has_intrinsics = 1;
        wanted->intrinsics = (nebel_intrinsics){numbers[0], numbers[1], numbers[2], numbers[3], 0};
    }
    wanted->hfov = nb_options_number(arguments, HFOV, 0.001, 179.9, 0);
}

/* ---- fog ------------------------------------------------------------------------------------- */

static void read_airlight(nb_arguments *arguments, nb_fog_call *wanted)
{
    const char *const text = arguments->values[AIRLIGHT];
    if (text == NULL || strcmp(text, "estimate") == 0) return;
    wanted->has_airlight = 1;
    if (!read_list(arguments, AIRLIGHT, 3, 0, 1e6, wanted->airlight))
        nb_options_reject(arguments, AIRLIGHT, "is not estimate or three numbers from 0 with commas between them");
}

static void read_extinction(nb_arguments *arguments, nb_fog_call *wanted)
{
    const double visibility = nb_options_number(arguments, VISIBILITY, 0.01, 1e9, 1);
    const double contrast = nb_options_number(arguments, CONTRAST, 0, 1, 0.05);
    if (contrast == 0 || contrast == 1) nb_options_reject(arguments, CONTRAST, "is not between 0 and 1");
    wanted->extinction = nb_options_number(arguments, EXTINCTION, 0, 1e6, -log(contrast) / visibility);
    if (arguments->values[EXTINCTION] == NULL) {
        if (arguments->values[VISIBILITY] == NULL && !arguments->misused)
            (void)nb_report_misuse(NULL, "fog: how dense is it? Say --visibility M, --extinction B or --scene FILE");
        arguments->misused = arguments->misused || arguments->values[VISIBILITY] == NULL;
        return;
    }
    if (arguments->values[VISIBILITY] != NULL)
        nb_options_refuse(arguments, VISIBILITY, "has no place beside --extinction, which says the same");
    if (arguments->values[CONTRAST] != NULL) nb_options_refuse(arguments, CONTRAST, "needs --visibility");
}

/* A scene says all of it. */
static void refuse_fog(nb_arguments *arguments)
{
    static const int options[] = {VISIBILITY, CONTRAST, EXTINCTION, AIRLIGHT, BLEND};
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        if (arguments->values[options[i]] != NULL)
            nb_options_refuse(arguments, options[i], "has no place beside --scene, whose fog and light are its own");
}

static void read_frame(nb_arguments *arguments, nb_fog_call *wanted)
{
    const char *const frame = arguments->values[FRAME];
    wanted->frame_of_name = frame != NULL && strcmp(frame, "name") == 0;
    if (!wanted->frame_of_name) wanted->frame = nb_options_whole(arguments, FRAME, 0, NB_FOG_LAST_FRAME, 0);
}

static void read_fog(nb_arguments *arguments, nb_fog_call *wanted)
{
    static const char *const spaces[] = {"linear", "srgb", NULL};
    wanted->scene = arguments->values[SCENE];
    if (wanted->scene != NULL) {
        refuse_fog(arguments);
        read_frame(arguments, wanted);
        wanted->has_seed = arguments->values[SEED] != NULL;
        wanted->seed = nb_options_whole(arguments, SEED, 0, UINT32_MAX, 0);
        return;
    }
    if (arguments->values[SEED] != NULL) nb_options_refuse(arguments, SEED, "needs --scene, whose noise it changes");
    if (arguments->values[FRAME] != NULL) nb_options_refuse(arguments, FRAME, "needs --scene, which has frames");
    read_extinction(arguments, wanted);
    read_airlight(arguments, wanted);
    wanted->blends_stored = nb_options_choice(arguments, BLEND, spaces, 0);
}

/* ---- many processes -------------------------------------------------------------------------- */

static void read_jobs(nb_arguments *arguments, nb_fog_call *wanted)
{
    static const int of_files[] = {SHARD, RESUME};
    wanted->shard = nb_jobs_read_shard(arguments, SHARD);
    wanted->resume = arguments->values[RESUME] != NULL;
    nb_jobs_refuse_special(arguments, of_files, sizeof of_files / sizeof *of_files, wanted->patterns.output);
    nb_jobs_refuse_special(arguments, of_files, sizeof of_files / sizeof *of_files, wanted->patterns.transmittance);
}

/* ---- all of it ------------------------------------------------------------------------------- */

static void need(nb_arguments *arguments, int option)
{
    if (arguments->values[option] != NULL) return;
    nb_options_refuse(arguments, option, "FILE is needed");
}

static void check_ending(nb_arguments *arguments, int option)
{
    const char *const name = arguments->values[option];
    if (name != NULL && nebel_get_image_format(name) == NEBEL_IMAGE_NONE)
        nb_options_reject(arguments, option, "is no name that ends in .png or .exr");
}

int nb_fog_call_read(nb_arguments *arguments, nb_fog_call *wanted)
{
    need(arguments, DEPTH);
    need(arguments, OUTPUT);
    check_ending(arguments, OUTPUT);
    check_ending(arguments, TRANSMITTANCE);
    wanted->patterns.images = arguments->operands;
    wanted->patterns.image_count = arguments->operand_count;
    wanted->patterns.depth = arguments->values[DEPTH];
    wanted->patterns.output = arguments->values[OUTPUT];
    wanted->patterns.transmittance = arguments->values[TRANSMITTANCE];
    read_depth(arguments, wanted);
    read_policies(arguments, wanted);
    read_camera(arguments, wanted);
    read_fog(arguments, wanted);
    read_jobs(arguments, wanted);
    wanted->threads = (int)nb_options_whole(arguments, THREADS, 0, NB_MAX_WORKERS, 0);
    if (wanted->threads == 0) wanted->threads = nb_workers_available();
    wanted->quiet = arguments->values[QUIET] != NULL;
    return arguments->misused ? nb_report_misuse("fog", "fog: nothing was done") : -1;
}
