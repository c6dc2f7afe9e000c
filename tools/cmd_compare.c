/* nebel compare: how far two pictures are apart. */
#define _POSIX_C_SOURCE 200809L

#include "commands.h"
#include "signals.h"
#include "messages.h"
#include "output_check.h"

#include <nebel/scene.h>

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OUTPUT, AMPLIFY, CHANNEL, FAIL_ABOVE };

static const nb_option options[] = {
    [OUTPUT] = {"output", 'o', "FILE", "Writes the difference |A - B| as a picture, .png or\n.exr."},
    [AMPLIFY] = {"amplify", 'a', "X",
                 "How much brighter the difference is drawn, more than\n0 to 1000000. Default: 8."},
    [CHANNEL] =
        {"channel", 'c', "NAME",
         "Only this channel, such as G or depth.Z. Default:\nR, G and B where both pictures have them, else all\n"
         "channels, which must then be the same."},
    [FAIL_ABOVE] = {"fail-above", 0, "RMSE", "Exit status 1 where the root mean square error is\nlarger, 0 or more."},
};

static const char about[] = "Compares two pictures of the same size, PNG or EXR, sample by sample as stored:\n"
                            "a PNG's are 0 to 1 in sRGB, an EXR's are linear.\n"
                            "\n"
                            "  RMSE                root mean square error over the compared channels\n"
                            "  PSNR                20 log10(peak / RMSE) in dB; the peak of PNG is 1, that of\n"
                            "                      EXR is the largest finite sample of A by magnitude\n"
                            "  largest difference  and where it is, counted from 0 at the top left\n"
                            "\n"
                            "Samples that are both NaN, or the same infinity, are equal. Where only one of\n"
                            "the two is NaN or infinite the difference is infinite, and so is the RMSE; such\n"
                            "samples are counted. In a difference picture they are white (PNG) or inf (EXR).\n";

static const char examples[] = "Examples:\n"
                               "  Did the change alter the picture?\n"
                               "    nebel compare before.png after.png -o difference.png --amplify 32\n"
                               "  In a test:\n"
                               "    nebel compare expected.exr now.exr --fail-above 0.001\n"
                               "  One layer alone:\n"
                               "    nebel compare a.exr b.exr --channel depth.Z\n"
                               "\n"
                               "Exit status: 0 compared, 1 a picture could not be read or written, the sizes\n"
                               "differ or the RMSE is above --fail-above, 2 the call was wrong.\n";

typedef struct nb_compare_options {
    const char *paths[2];
    const char *output; /* NULL: none */
    const char *channel;
    double amplify, fail_above;
} nb_compare_options;

/* Two pictures and which of their channels belong together. */
typedef struct nb_sample_pair {
    nebel_image images[2];
    uint32_t *channels[2]; /* positions in each, `channel_count` of them */
    uint32_t channel_count;
} nb_sample_pair;

typedef struct findings {
    double square_sum, peak;
    double largest;
    size_t largest_pixel;
    uint32_t largest_channel; /* position in the pair's channels */
    size_t incomparable;      /* NaN or infinite in one only */
} findings;

/* ---- which channels -------------------------------------------------------------------------- */

static int find_channel(const nebel_image *image, const char *name)
{
    for (uint32_t i = 0; i < image->channel_count; i++) {
        if (strcmp(image->channel_names[i], name) == 0) return (int)i;
    }
    return -1;
}

/* 0 where one of the pictures has no such channel; *missing says which. */
static int add_channel(nb_sample_pair *both, const char *name, int *missing)
{
    for (int i = 0; i < 2; i++) {
        const int position = find_channel(&both->images[i], name);
        *missing = i;
        if (position < 0) return 0;
        both->channels[i][both->channel_count] = (uint32_t)position;
    }
    both->channel_count++;
    return 1;
}

static int add_color(nb_sample_pair *both)
{
    int missing;
    const int found =
        add_channel(both, "R", &missing) && add_channel(both, "G", &missing) && add_channel(both, "B", &missing);
    if (!found) both->channel_count = 0;
    return found;
}

static int report_missing(const nb_compare_options *wanted, const nb_sample_pair *both, int which, const char *name)
{
    char list[512] = "";
    size_t used = 0;
    const nebel_image *const image = &both->images[which];
    for (uint32_t i = 0; i < image->channel_count && used < sizeof list - 64; i++) {
        const int size = snprintf(list + used, sizeof list - used, " %.60s", image->channel_names[i]);
        used += size > 0 ? (size_t)size : 0;
    }
    return nb_report_failure("compare: %s: has no channel %s; it has%s", wanted->paths[which], name, list);
}

static int choose_channels(const nb_compare_options *wanted, nb_sample_pair *both)
{
    const uint32_t most = both->images[0].channel_count > 3 ? both->images[0].channel_count : 3;
    for (int i = 0; i < 2; i++) both->channels[i] = calloc(most, sizeof(uint32_t));
    if (both->channels[0] == NULL || both->channels[1] == NULL) return nb_report_failure("compare: out of memory");
    int missing;
    if (wanted->channel != NULL) {
        if (add_channel(both, wanted->channel, &missing)) return NB_DONE;
        return report_missing(wanted, both, missing, wanted->channel);
    }
    if (add_color(both)) return NB_DONE;
    for (uint32_t i = 0; i < both->images[0].channel_count; i++) {
        const char *const name = both->images[0].channel_names[i];
        if (!add_channel(both, name, &missing)) return report_missing(wanted, both, missing, name);
    }
    if (both->images[1].channel_count == both->images[0].channel_count) return NB_DONE;
    return nb_report_failure("compare: %s: has other channels than %s; choose one with --channel", wanted->paths[1],
                             wanted->paths[0]);
}

/* ---- the numbers ----------------------------------------------------------------------------- */

static double sample_of(const nb_sample_pair *both, int which, size_t pixel, uint32_t channel)
{
    const nebel_image *const image = &both->images[which];
    return (double)image->samples[pixel * image->channel_count + both->channels[which][channel]];
}

static double difference_of(double a, double b)
{
    if (isfinite(a) && isfinite(b)) return fabs(a - b);
    const int same = (isnan(a) && isnan(b)) || a == b;
    return same ? 0 : (double)INFINITY;
}

static size_t pixels_of(const nb_sample_pair *both)
{
    return (size_t)both->images[0].width * both->images[0].height;
}

static findings measure(const nb_sample_pair *both)
{
    findings found = {0};
    const size_t pixels = pixels_of(both);
    for (size_t i = 0; i < pixels; i++) {
        for (uint32_t c = 0; c < both->channel_count; c++) {
            const double a = sample_of(both, 0, i, c);
            const double difference = difference_of(a, sample_of(both, 1, i, c));
            if (isfinite(a) && fabs(a) > found.peak) found.peak = fabs(a);
            if (!isfinite(difference)) found.incomparable++;
            found.square_sum += difference * difference;
            if (difference <= found.largest) continue;
            found.largest = difference;
            found.largest_pixel = i;
            found.largest_channel = c;
        }
    }
    return found;
}

static double rmse_of(const nb_sample_pair *both, const findings *found)
{
    return sqrt(found->square_sum / ((double)pixels_of(both) * both->channel_count));
}

static void print_psnr(double peak, double rmse)
{
    if (rmse == 0) {
        (void)printf("PSNR: infinite, the samples are equal\n");
    } else if (peak == 0 || !isfinite(rmse)) {
        (void)printf("PSNR: none (peak %.9g)\n", peak);
    } else {
        (void)printf("PSNR: %.4f dB (peak %.9g)\n", 20 * log10(peak / rmse), peak);
    }
}

static void print_findings(const nb_compare_options *wanted, const nb_sample_pair *both, const findings *found)
{
    const nebel_image *const image = &both->images[0];
    const int is_png = nebel_get_image_format(wanted->paths[0]) == NEBEL_IMAGE_PNG;
    const double rmse = rmse_of(both, found);
    (void)printf("size: %u x %u\nchannels:", (unsigned)image->width, (unsigned)image->height);
    for (uint32_t c = 0; c < both->channel_count; c++) {
        (void)printf(" %s", image->channel_names[both->channels[0][c]]);
    }
    (void)printf("\nRMSE: %.9g\n", rmse);
    print_psnr(is_png ? 1 : found->peak, rmse);
    (void)printf("largest difference: %.9g", found->largest);
    if (found->largest > 0) {
        const size_t pixel = found->largest_pixel;
        (void)printf(" at x %zu, y %zu, channel %s: %.9g and %.9g", pixel % image->width, pixel / image->width,
                     image->channel_names[both->channels[0][found->largest_channel]],
                     sample_of(both, 0, pixel, found->largest_channel),
                     sample_of(both, 1, pixel, found->largest_channel));
    }
    (void)printf("\n");
    if (found->incomparable > 0)
        (void)printf("NaN or infinite in one picture only: %zu samples\n", found->incomparable);
}

/* ---- the difference picture ------------------------------------------------------------------ */

static float shade(double difference, double amplify, nebel_image_format format)
{
    const double bright = difference * amplify;
    if (format == NEBEL_IMAGE_PNG) return bright < 1 ? (float)bright : 1.f;
    return bright < (double)FLT_MAX ? (float)bright : INFINITY;
}

/* The first three channels, or the only one in all three. */
static void paint(const nb_sample_pair *both, const nb_compare_options *wanted, float *samples)
{
    const nebel_image_format format = nebel_get_image_format(wanted->output);
    const size_t pixels = pixels_of(both);
    for (size_t i = 0; i < pixels; i++) {
        for (uint32_t c = 0; c < 3; c++) {
            const uint32_t channel = both->channel_count < 3 ? 0 : c;
            const double difference = difference_of(sample_of(both, 0, i, channel), sample_of(both, 1, i, channel));
            samples[3 * i + c] = shade(difference, wanted->amplify, format);
        }
    }
}

static int write_difference(const nb_sample_pair *both, const nb_compare_options *wanted, nb_report_listener *listener)
{
    static const char *const names[] = {"R", "G", "B"};
    const size_t pixels = pixels_of(both);
    const nebel_host host = {.log = nb_report_log(listener)};
    nebel_image image = {
        .width = both->images[0].width, .height = both->images[0].height, .channel_count = 3, .channel_names = names};
    image.samples = pixels <= SIZE_MAX / (3 * sizeof(float)) ? malloc(pixels * 3 * sizeof(float)) : NULL;
    if (image.samples == NULL) return nb_report_failure("compare: %s: out of memory", wanted->output);
    paint(both, wanted, image.samples);
    nb_interrupt_hold();
    const nebel_result result = nebel_write_image(wanted->output, &host, &image);
    nb_interrupt_release();
    free(image.samples);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(listener, wanted->output, result);
}

/* ---- the command ----------------------------------------------------------------------------- */

static int read_settings(nb_arguments *arguments, nb_compare_options *wanted)
{
    for (int i = 0; i < 2; i++) wanted->paths[i] = arguments->operands[i];
    wanted->output = arguments->values[OUTPUT];
    wanted->channel = arguments->values[CHANNEL];
    wanted->amplify = nb_options_number(arguments, AMPLIFY, 0, 1e6, 8);
    if (wanted->amplify == 0) nb_options_reject(arguments, AMPLIFY, "is not more than 0");
    wanted->fail_above = nb_options_number(arguments, FAIL_ABOVE, 0, (double)INFINITY, (double)INFINITY);
    if (wanted->output != NULL && nebel_get_image_format(wanted->output) == NEBEL_IMAGE_NONE) {
        nb_options_reject(arguments, OUTPUT, "is no name that ends in .png or .exr");
    }
    return arguments->misused ? nb_report_misuse("compare", "compare: nothing was done") : -1;
}

static int read_pictures(const nb_compare_options *wanted, nb_sample_pair *both, nb_report_listener *listener)
{
    const nebel_host host = {.log = nb_report_log(listener)};
    for (int i = 0; i < 2; i++) {
        const nebel_result result = nebel_read_image(wanted->paths[i], &host, &both->images[i]);
        if (result != NEBEL_OK) return nb_report_result(listener, wanted->paths[i], result);
    }
    const nebel_image *const a = &both->images[0], *const b = &both->images[1];
    if (a->width != b->width || a->height != b->height) {
        return nb_report_failure("compare: %s is %u x %u, %s is %u x %u; only pictures of one size compare",
                                 wanted->paths[0], (unsigned)a->width, (unsigned)a->height, wanted->paths[1],
                                 (unsigned)b->width, (unsigned)b->height);
    }
    if (nebel_get_image_format(wanted->paths[0]) != nebel_get_image_format(wanted->paths[1])) {
        nb_report_message("compare: one picture holds sRGB and the other linear light; the numbers compare as stored");
    }
    return choose_channels(wanted, both);
}

static int compare(const nb_compare_options *wanted, nb_sample_pair *both)
{
    nb_report_listener listener = {0};
    int status = wanted->output != NULL ? nb_target_check(wanted->output) : NB_DONE;
    for (int i = 0; i < 2 && status == NB_DONE && wanted->output != NULL; i++)
        if (nb_target_is_same(wanted->output, wanted->paths[i]))
            status = nb_report_failure("compare: cannot write \"%s\": it is one of the pictures; name another file",
                                       wanted->output);
    if (status == NB_DONE) status = read_pictures(wanted, both, &listener);
    if (status != NB_DONE) return status;
    const findings found = measure(both);
    print_findings(wanted, both, &found);
    if (wanted->output != NULL) status = write_difference(both, wanted, &listener);
    if (status != NB_DONE || rmse_of(both, &found) <= wanted->fail_above) return status;
    return nb_report_failure("compare: the RMSE %.9g is above %.9g", rmse_of(both, &found), wanted->fail_above);
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    nb_compare_options wanted = {0};
    nb_sample_pair both = {0};
    int status = nb_options_parse(&nb_commands_compare, count, words, &arguments);
    if (status < 0) status = read_settings(&arguments, &wanted);
    if (status >= 0) return status;
    status = compare(&wanted, &both);
    for (int i = 0; i < 2; i++) {
        nebel_free_image(&(nebel_host){0}, &both.images[i]);
        free(both.channels[i]);
    }
    return status;
}

const nb_command nb_commands_compare = {
    .name = "compare",
    .summary = "how far two pictures are apart",
    .synopsis = "A B [-o DIFFERENCE] [options]",
    .about = about,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands = "two pictures",
    .fewest_operands = 2,
    .most_operands = 2,
    .examples = examples,
    .run = run,
};
