#include "uniform_batch.h"

#include <math.h>
#include <string.h>

/* What the centre of a pixel may be off the mean over it: a part of its light, and of 1 of transmittance. */
#define MOST_OFF 1e-3f

int nb_uniform_batch_may_be(const nb_frame *frame)
{
    return frame->air.count > 0 && !frame->air.has_fog && frame->samples > 1 && !frame->lighting.shows_ambient &&
           frame->renderer->method == NEBEL_METHOD_EXACT;
}

/* ---- what has an edge ------------------------------------------------------------------------ */

static int sees_models(const nb_frame *frame, const nb_batch_place *place, uint32_t count, nb_scratch *scratch)
{
    if (frame->renderer->geometry.scene == NULL) return 0;
    for (uint32_t s = 0; s < count; s++) {
        nb_batch_find(frame, place, s, scratch);
        if (nb_hits_any(&scratch->hits)) return 1;
    }
    return 0;
}

/* The ground and the sky at once; or ground on which models may cast shadows. */
static int sees_borders(const nb_frame *frame, const nb_scratch *scratch)
{
    int ground = 0, sky = 0;
    for (int i = 0; i < NB_BATCH; i++) {
        const int is_ground = scratch->air.ground.distance[i] < HUGE_VALF;
        ground |= scratch->inside[i] && is_ground;
        sky |= scratch->inside[i] && !is_ground;
    }
    return ground && (sky || frame->renderer->geometry.scene != NULL);
}

/* ---- how light bends ------------------------------------------------------------------------- */

/* Numbers of a batch's pixels, row by row. */
typedef float nb_rows[NB_BLOCK][NB_REGION];

static void set_rows(const float *lanes, nb_rows rows)
{
    for (int block = 0; block < NB_PACKETS; block++)
        for (int y = 0; y < NB_BLOCK; y++)
            memcpy(rows[y] + block * NB_BLOCK, lanes + block * NB_PACKET + y * NB_BLOCK, NB_BLOCK * sizeof **rows);
}

/* Second differences along a row. Pixels at the batch's border take that of their neighbours. */
NB_CLONES static void bend_across(const float *restrict row, uint32_t columns, float *restrict bend)
{
    NB_SIMD
    for (uint32_t x = 1; x < NB_REGION - 1; x++) bend[x] = fabsf(row[x - 1] - 2 * row[x] + row[x + 1]);
    bend[0] = bend[1];
    bend[columns - 1] = bend[columns - 2];
}

/* The mean over a pixel of a parabola is off its centre by a 24th of each second difference; `most` becomes that where it
 * is less. */
NB_CLONES static void widen_by_bends(const float *restrict above, const float *restrict row,
                                     const float *restrict below, const float *restrict across, float *restrict most)
{
    NB_SIMD
    for (int x = 0; x < NB_REGION; x++) {
        const float off = (across[x] + fabsf(above[x] - 2 * row[x] + below[x])) / 24;
        most[x] = most[x] > off ? most[x] : off;
    }
}

static uint32_t clamp(uint32_t i, uint32_t count)
{
    return i < 1 ? 1 : i > count - 2 ? count - 2 : i;
}

static void widen(const float *lanes, uint32_t columns, uint32_t rows, nb_rows most)
{
    nb_rows values;
    set_rows(lanes, values);
    for (uint32_t y = 0; y < rows; y++) {
        const uint32_t v = clamp(y, rows);
        float across[NB_REGION] = {0};
        bend_across(values[y], columns, across);
        widen_by_bends(values[v - 1], values[v], values[v + 1], across, most[y]);
    }
}

static float brightest_channel(const nb_light_samples *samples, uint32_t lane)
{
    float most = 0;
    for (int c = 0; c < 3; c++) most = most > samples->color[c][lane] ? most : samples->color[c][lane];
    return most;
}

/* What light may be off is added to the error. */
static int is_smooth(uint32_t columns, uint32_t rows, nb_light_samples *samples)
{
    nb_rows off = {{0}}, left = {{0}};
    for (int c = 0; c < 3; c++) {
        widen(samples->color[c], columns, rows, off);
        widen(samples->in_scattering[c], columns, rows, off);
        widen(samples->transmittance[c], columns, rows, left);
    }
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < columns; x++) {
            const uint32_t i = nb_lane_at(x, y);
            if (!(off[y][x] <= MOST_OFF * brightest_channel(samples, i) && left[y][x] <= MOST_OFF)) return 0;
            samples->error[i] += off[y][x];
        }
    return 1;
}

/* Whether clouds before the sky are seen, which are means over pixels already. Shadows on slanted ground are not. */
static int sees_clouds_alone(const nb_frame *frame, const nb_scratch *scratch)
{
    int any = 0;
    if (frame->cloud_view == NULL) return 0;
    for (int i = 0; i < NB_BATCH; i++) {
        if (scratch->air.ground.distance[i] < HUGE_VALF) return 0;
        any |= scratch->clouds.nodes[i].count > 0;
    }
    return any;
}

nebel_result nb_uniform_batch_render(const nb_frame *frame, const nb_batch_place *place, uint32_t count,
                                     nb_scratch *scratch, int *is_even)
{
    const uint32_t right = frame->width - place->left, below = frame->height - place->top - nb_lane_y(place->first);
    const uint32_t columns = right < NB_REGION ? right : NB_REGION, rows = below < NB_BLOCK ? below : NB_BLOCK;
    *is_even = 0;
    if (columns < 3 || rows < 3 || sees_models(frame, place, count, scratch)) return NEBEL_OK;
    nb_batch_find_centers(frame, place, scratch);
    if (sees_borders(frame, scratch) || nb_cpu_planets_sees_sun(&frame->air, &frame->lighting, &scratch->rays) ||
        nb_cpu_planets_sees_rim(&frame->air, &scratch->rays))
        return NEBEL_OK;
    const nebel_result result = nb_batch_light(frame, scratch);
    *is_even = result == NEBEL_OK && (sees_clouds_alone(frame, scratch) || is_smooth(columns, rows, &scratch->samples));
    return result;
}
